//! How far normals turn: what fields do to each face, to first order.

use crate::Field;
use crate::carry::Here;
use crate::surface::Surface;
use crate::visibility::{Term, face_terms};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// |dn|² of each face that turns.
pub(crate) fn turned(surface: &Surface, field: &Field) -> Vec<(u32, f64)> {
    let mut d = vec![Vector3::zeros(); surface.points.len()];
    field.iter().for_each(|(v, x)| d[*v as usize] = *x);
    let square = |term: &Term| {
        let x: f64 = (0..term.count).map(|k| term.gradients[k].dot(&d[term.vertices[k] as usize])).sum();
        x * x
    };
    let of_face = |f: u32| {
        let here = surface.triangles[f as usize].iter().any(|&v| d[v as usize] != Vector3::zeros());
        let area = surface.areas[f as usize];
        let turn = || face_terms(surface, f as usize)[..2].iter().map(square).sum::<f64>() / area;
        (here && area > 0.0).then(|| (f, turn()))
    };
    (0..surface.triangles.len() as u32).filter_map(of_face).collect()
}

/// How much more each field turns where much is turned already: Σ A |dn|² T / (T̄ Σ A |dn|²), T what all fields turn.
pub(crate) fn unevenness(surface: &Surface, turns: &[Vec<(u32, f64)>], sums: &[f64], p: &[f64]) -> Vec<f64> {
    let mut all = vec![0.0; surface.triangles.len()];
    for (turns, p) in turns.iter().zip(p) {
        turns.iter().for_each(|(f, t)| all[*f as usize] += t * p);
    }
    let mean = all.iter().zip(&surface.areas).map(|(t, a)| t * a).sum::<f64>() / surface.area;
    let hot: Vec<f64> = all.iter().map(|t| t / mean).collect();
    let of_field = |(turns, sum): (&Vec<(u32, f64)>, &f64)| {
        let terms = turns.iter().map(|(f, t)| t * surface.areas[*f as usize] * hot[*f as usize]);
        if *sum > 0.0 && mean > 0.0 { terms.sum::<f64>() / sum } else { 1.0 }
    };
    turns.iter().zip(sums).map(of_field).collect()
}

/// How far normals of a surface turn when fields have standard Gaussian coefficients: the expectation of |dn|² for each face, in
/// radians squared. `at` has for each point what each field does there, in order of fields.
///
/// # Panics
/// When a corner is not below the number of points, or `at` is shorter.
pub fn expected_turns(
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    at: &[Vec<(u32, Vector3<f64>)>],
) -> Vec<f64> {
    let surface = Surface::new(points.to_vec(), triangles.to_vec());
    let square = |f: usize| match surface.areas[f] {
        area if area > 0.0 => turned_by_each(&surface, at, f) / area,
        _ => 0.0,
    };
    (0..triangles.len()).into_par_iter().with_min_len(CHUNK).map(square).collect()
}

/// Faces that one task takes.
const CHUNK: usize = 4096;

/// Σ A |dn|² over faces and fields.
pub(crate) fn turned_by_all(surface: &Surface, at: &[Here]) -> f64 {
    let faces: Vec<usize> = (0..surface.triangles.len()).collect();
    let sum = |chunk: &[usize]| chunk.iter().map(|&f| turned_by_each(surface, at, f)).sum();
    let parts: Vec<f64> = faces.par_chunks(CHUNK).map(sum).collect();
    parts.iter().sum()
}

/// Σ A |dn|² over fields, of one face.
fn turned_by_each(surface: &Surface, at: &[Here], face: usize) -> f64 {
    let mut sums: Vec<(u32, [f64; 2])> = Vec::new();
    let terms = face_terms(surface, face);
    for (k, &v) in surface.triangles[face].iter().enumerate() {
        for (i, d) in &at[v as usize] {
            let turned = [terms[0].gradients[k].dot(d), terms[1].gradients[k].dot(d)];
            match sums.binary_search_by_key(i, |e| e.0) {
                Ok(place) => (0..2).for_each(|a| sums[place].1[a] += turned[a]),
                Err(place) => sums.insert(place, (*i, turned)),
            }
        }
    }
    sums.iter().map(|(_, [a, b])| a * a + b * b).sum::<f64>()
}
