//! How far walls and gaps let a mark move them.
//!
//! Where two places face each other at a distance D along u, a mark changes D by ε Σ_i (u · r_i) w_i, where r_i is what
//! function i moves the two apart by. With w standard Gaussian this is Gaussian, of deviation ε σ with
//! σ² = Σ_i (u · r_i)², and hardly ever more than 4.5 deviations. So that D keeps nine tenths, all functions are scaled
//! there by
//!
//! ```text
//! s = min(1, 0.07 D / (4.5 ε σ)),
//! ```
//!
//! and s changes slowly along the surface: by 0.03 over a way that is as long as the longest displacement, so that the two
//! places are scaled nearly alike and nothing is bent that anybody sees. A planar region is scaled as a whole. All of it
//! follows from B and ε, before there is a watermark.

use nalgebra::Vector3;
use rayon::prelude::*;
use sombrero_basis::Basis;
use sombrero_coupling::{Assembly, Coupling, Facing, Link, facing, spread};
use sombrero_mesh::{Edges, PlanarRegions};

/// As large as one of a model's many Gaussian numbers gets.
const LARGEST: f64 = 4.5;

/// What a distance may change by, of itself, where both places are scaled alike.
const CHANGE: f64 = 0.07;

/// What it may change by besides because they are not. And how much a factor changes over the longest displacement.
const SLOPE: f64 = 0.03;

/// Columns are summed in so many pieces, whatever the number of threads.
const PIECES: usize = 4;

/// The factor of each point for functions at ε; `None` when all of them are 1.
pub(crate) fn factors(
    basis: &Basis,
    assembly: &Assembly<'_>,
    coupling: &Coupling,
    side: f64,
    epsilon: f64,
) -> Option<Vec<f64>> {
    let deviations: Vec<f64> = basis.deviations().iter().map(|sigma| LARGEST * epsilon * sigma).collect();
    let longest = deviations.iter().copied().fold(0.0, f64::max);
    let farthest: Vec<f64> = deviations.iter().map(|d| (d + longest) / CHANGE).collect();
    let mut pairs = facing(assembly, &farthest);
    // Most move too little to matter, whatever the two do.
    pairs.retain(|pair| {
        let most: f64 = pair.terms.iter().map(|(v, map)| map.norm() * deviations[*v as usize]).sum();
        CHANGE * pair.distance < most
    });
    let mut factor = vec![1.0_f64; deviations.len()];
    for (pair, sigma) in pairs.iter().zip(apart(basis, &pairs)) {
        let change = LARGEST * epsilon * sigma;
        if CHANGE * pair.distance < change {
            let least = CHANGE * pair.distance / change;
            pair.terms.iter().for_each(|(v, _)| factor[*v as usize] = factor[*v as usize].min(least));
        }
    }
    if factor.iter().all(|factor| *factor >= 1.0) {
        return None;
    }
    Some(spread(&factor, &links(assembly, coupling, &pairs, side, longest / SLOPE)))
}

/// The basis with the functions of each point times its factor.
pub(crate) fn scaled(basis: &Basis, factors: &[f64]) -> Basis {
    let rebuilt = "the entries are where they were, and finite";
    if let Some(vectors) = basis.vectors() {
        let lengths: Vec<usize> = vectors.col_iter().map(|column| column.nnz()).collect();
        let entries = vectors.row_indices().iter().zip(vectors.values());
        let values = entries.map(|(row, d)| d * factors[*row]).collect();
        let rows = vectors.row_indices().to_vec();
        return Basis::from_vectors(basis.vertex_count(), &lengths, rows, values).expect(rebuilt);
    }
    let values = basis.values();
    let lengths: Vec<usize> = values.col_iter().map(|column| column.nnz()).collect();
    let entries = values.row_indices().iter().zip(values.values());
    let numbers = entries.map(|(row, phi)| phi * factors[*row]).collect();
    let (rows, functions) = (values.row_indices().to_vec(), basis.functions().to_vec());
    Basis::from_parts(basis.vertex_count(), functions, &lengths, rows, numbers).expect(rebuilt)
}

/// σ of each pair.
fn apart(basis: &Basis, pairs: &[Facing]) -> Vec<f64> {
    // For each point the pairs that it is part of, and u · M as a vector.
    let mut part_of: Vec<Vec<(u32, Vector3<f64>)>> = vec![Vec::new(); basis.vertex_count()];
    for (number, pair) in (0..).zip(pairs) {
        for (v, map) in &pair.terms {
            part_of[*v as usize].push((number, map.transpose() * pair.direction));
        }
    }
    let functions: Vec<usize> = (0..basis.functions().len()).collect();
    let piece = |functions: &[usize]| {
        let (mut squares, mut change) = (vec![0.0; pairs.len()], vec![0.0; pairs.len()]);
        let mut touched = Vec::new();
        for &i in functions {
            crate::coupled::each(basis, i, |row, d| {
                for (pair, along) in &part_of[row] {
                    touched.push(*pair);
                    change[*pair as usize] += along.dot(&d);
                }
            });
            for pair in touched.drain(..) {
                squares[pair as usize] += change[pair as usize] * change[pair as usize];
                change[pair as usize] = 0.0;
            }
        }
        squares
    };
    let pieces: Vec<Vec<f64>> =
        functions.par_chunks(functions.len().div_ceil(PIECES).max(1)).map(piece).collect();
    (0..pairs.len()).map(|pair| pieces.iter().map(|squares| squares[pair]).sum::<f64>().sqrt()).collect()
}

/// Along edges and between places that face each other, in ways of `unit`; without length where all is scaled alike.
fn links(assembly: &Assembly<'_>, coupling: &Coupling, pairs: &[Facing], side: f64, unit: f64) -> Vec<Link> {
    let Assembly { points, triangles, .. } = *assembly;
    let edges = Edges::new(points.len(), triangles);
    let regions = PlanarRegions::find(points, triangles, side);
    let mut planar = vec![false; edges.len()];
    for (edge, face) in edges.of_side.iter().zip((0..triangles.len()).flat_map(|face| [face; 3])) {
        planar[*edge as usize] |= regions.of_face[face].is_some();
    }
    let length = |[a, b]: [u32; 2]| (points[a as usize] - points[b as usize]).norm() / unit;
    let along = edges.ends.iter().zip(planar);
    let along =
        along.map(|(ends, planar)| Link { ends: *ends, length: if planar { 0.0 } else { length(*ends) } });
    let across = pairs.iter().flat_map(|pair| {
        let first = pair.terms[0].0;
        pair.terms[1..].iter().map(move |(v, _)| Link { ends: [first, *v], length: pair.distance / unit })
    });
    let coupled = coupling
        .rows()
        .flat_map(|(v, row)| row.iter().map(move |(k, _)| Link { ends: [v, *k], length: 0.0 }));
    along.chain(across).chain(coupled).collect()
}
