//! The eigenproblem on one piece of the surface.
//!
//! Unknowns z are the offsets of the planes that lie in the piece and what its vertices are free to do besides; all else
//! stands still. With G = L Lᵀ the fields of most evidence for their visibility are
//!
//! ```text
//! E z = μ G z      ⇔      (L⁻¹ E L⁻ᵀ) x = μ x,      z = L⁻ᵀ x,   zᵀ G z = 1.
//! ```

use crate::Field;
use crate::carry::Shifts;
use crate::envelope::{Envelope, Factor};
use crate::evidence::Evidence;
use crate::lanczos;
use crate::planes::Planes;
use crate::surface::Rings;
use crate::together::add_up;
use crate::visibility::Term;
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};

/// What all pieces share.
pub(crate) struct Whole<'a> {
    pub(crate) rings: &'a Rings,
    pub(crate) planes: &'a Planes,
    /// The vertex of the full mesh, by which the planes know it.
    pub(crate) full: &'a [u32],
    pub(crate) terms: &'a [Term],
    /// Which terms each vertex takes part in.
    pub(crate) terms_of: &'a [Vec<u32>],
    /// The weight of |d_v|² in G.
    pub(crate) mass: &'a [f64],
    pub(crate) evidence: &'a Evidence,
}

/// The unknowns of one piece, and what they do.
struct Unknowns {
    vertices: Vec<u32>,
    /// For each vertex its unknowns with what a unit of each does.
    moves: Vec<Vec<(u32, Vector3<f64>)>>,
    /// The free offsets that are among the unknowns, with their places.
    offsets: Vec<(u32, u32)>,
    count: usize,
}

impl Unknowns {
    fn new(whole: &Whole, members: &[u32]) -> Self {
        let vertices = banded(whole.rings, members);
        let inside: BTreeSet<u32> = members.iter().copied().collect();
        // An offset belongs to the piece when no vertex that it moves is outside.
        let mut free: BTreeMap<u32, bool> = BTreeMap::new();
        for (v, &full) in (0..).zip(whole.full) {
            for &(offset, _) in whole.planes.columns(full) {
                *free.entry(offset).or_insert(true) &= inside.contains(&v);
            }
        }
        let mut count = 0;
        let mut moves: Vec<Vec<(u32, Vector3<f64>)>> = Vec::with_capacity(vertices.len());
        for &v in &vertices {
            let tangents = whole.planes.tangents(whole.full[v as usize]).iter();
            moves.push(
                tangents
                    .map(|t| {
                        count += 1;
                        (count - 1, *t)
                    })
                    .collect(),
            );
        }
        let mut place = BTreeMap::new();
        for (offset, _) in free.into_iter().filter(|(_, inside)| *inside) {
            place.insert(offset, count);
            count += 1;
        }
        for (&v, moves) in vertices.iter().zip(&mut moves) {
            let columns = whole.planes.columns(whole.full[v as usize]).iter();
            moves.extend(columns.filter_map(|(offset, column)| place.get(offset).map(|&p| (p, *column))));
        }
        Self { vertices, moves, offsets: place.into_iter().collect(), count: count as usize }
    }

    fn displacements(&self, z: &[f64]) -> Vec<Vector3<f64>> {
        let sum = |moves: &Vec<(u32, Vector3<f64>)>| moves.iter().map(|(i, d)| d * z[*i as usize]).sum();
        self.moves.iter().map(sum).collect()
    }

    fn transposed(&self, forces: &[Vector3<f64>]) -> Vec<f64> {
        let mut sums = vec![0.0; self.count];
        for (moves, force) in self.moves.iter().zip(forces) {
            moves.iter().for_each(|(i, d)| sums[*i as usize] += d.dot(force));
        }
        sums
    }

    /// G's factor.
    fn visibility(&self, whole: &Whole) -> Factor {
        let place: BTreeMap<u32, usize> = self.vertices.iter().enumerate().map(|(i, &v)| (v, i)).collect();
        let mut numbers: Vec<u32> =
            self.vertices.iter().flat_map(|&v| whole.terms_of[v as usize].iter().copied()).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let mut rows: Vec<Vec<(u32, f64)>> = Vec::with_capacity(numbers.len());
        for number in numbers {
            let term = &whole.terms[number as usize];
            let mut row: Vec<(u32, f64)> = Vec::with_capacity(16);
            for (v, g) in term.vertices.iter().zip(&term.gradients).take(term.count) {
                if let Some(&p) = place.get(v) {
                    row.extend(self.moves[p].iter().map(|(i, d)| (*i, d.dot(g))));
                }
            }
            row.sort_unstable_by_key(|entry| entry.0);
            add_up(&mut row);
            rows.push(row);
        }
        let mut first: Vec<usize> = (0..self.count).collect();
        let mut reach = |entries: &mut dyn Iterator<Item = u32>, least: usize| {
            entries.for_each(|i| first[i as usize] = first[i as usize].min(least));
        };
        for row in rows.iter().filter(|row| !row.is_empty()) {
            reach(&mut row.iter().map(|e| e.0), row[0].0 as usize);
        }
        for moves in self.moves.iter().filter(|m| !m.is_empty()) {
            let least = moves.iter().map(|m| m.0).min().unwrap_or(0) as usize;
            reach(&mut moves.iter().map(|m| m.0), least);
        }
        let mut matrix = Envelope::zeros(first);
        for row in &rows {
            for (k, &(i, x)) in row.iter().enumerate() {
                row[..=k].iter().for_each(|&(j, y)| matrix.add(i as usize, j as usize, x * y));
            }
        }
        for (&v, moves) in self.vertices.iter().zip(&self.moves) {
            let mass = whole.mass[v as usize];
            for (k, (i, d)) in moves.iter().enumerate() {
                moves[..=k].iter().for_each(|(j, e)| matrix.add(*i as usize, *j as usize, mass * d.dot(e)));
            }
        }
        matrix.factor()
    }
}

/// The best fields on the vertices `members`, most evidence first.
pub(crate) fn best(whole: &Whole, members: &[u32], wanted: usize, steps: usize) -> Vec<Shifts> {
    let unknowns = Unknowns::new(whole, members);
    if unknowns.count == 0 {
        return Vec::new();
    }
    let factor = unknowns.visibility(whole);
    let evidence = whole.evidence;
    let apply = |x: &[f64]| {
        let mut z = x.to_vec();
        factor.solve_upper(&mut z);
        let d = unknowns.displacements(&z);
        let field = || unknowns.vertices.iter().copied().zip(&d);
        let explained = evidence.explained(field());
        let forces: Vec<Vector3<f64>> =
            field().map(|(v, d)| evidence.weigh(v, d) - evidence.explaining(v, &explained)).collect();
        let mut y = unknowns.transposed(&forces);
        factor.solve_lower(&mut y);
        y
    };
    let found = lanczos::largest(unknowns.count, wanted, steps, apply);
    let field = |(_, mut x): (f64, Vec<f64>)| {
        factor.solve_upper(&mut x);
        let d = unknowns.displacements(&x);
        let mut field: Field = unknowns.vertices.iter().copied().zip(d).collect();
        field.sort_unstable_by_key(|entry| entry.0);
        let offsets = unknowns.offsets.iter().map(|(offset, i)| (*offset, x[*i as usize])).collect();
        Shifts { moves: field, offsets }
    };
    found.into_iter().filter(|(mu, _)| *mu > 0.0).map(field).collect()
}

/// The members in an order in which neighbours are close to each other (Cuthill and McKee 1969), from the furthest on.
fn banded(rings: &Rings, members: &[u32]) -> Vec<u32> {
    let mut waiting: BTreeSet<u32> = members.iter().copied().collect();
    let mut order: Vec<u32> = Vec::with_capacity(members.len());
    for &start in members.iter().rev() {
        if !waiting.remove(&start) {
            continue;
        }
        let mut next = order.len();
        order.push(start);
        while next < order.len() {
            let v = order[next];
            next += 1;
            order.extend(rings.of(v).iter().filter(|w| waiting.remove(w)));
        }
    }
    order
}
