//! How far normals turn: what fields do to each face, to first order.

use crate::Field;
use crate::carry::Here;
use crate::surface::Surface;
use crate::visibility::{Term, face_terms};
use nalgebra::Vector3;
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

/// Faces that one task takes.
const CHUNK: usize = 4096;

/// The expectation of A |dn|² of each face when fields have standard Gaussian coefficients. `at` has for each point what each
/// field does there, in order of fields.
pub(crate) fn expected(surface: &Surface, at: &[Here]) -> Vec<f64> {
    let turned = |f: usize| {
        let [along, across, ..] = face_terms(surface, f);
        expectation([&along, &across], at)
    };
    (0..surface.triangles.len()).into_par_iter().with_min_len(CHUNK).map(turned).collect()
}

/// Σ over fields of the squares of what they do to the terms, which are of the same vertices.
pub(crate) fn expectation<const N: usize>(terms: [&Term; N], at: &[Here]) -> f64 {
    let mut sums: Vec<(u32, [f64; N])> = Vec::new();
    for k in 0..terms[0].count {
        for (i, d) in &at[terms[0].vertices[k] as usize] {
            let done = terms.map(|term| term.gradients[k].dot(d));
            match sums.binary_search_by_key(i, |e| e.0) {
                Ok(place) => (0..N).for_each(|a| sums[place].1[a] += done[a]),
                Err(place) => sums.insert(place, (*i, done)),
            }
        }
    }
    sums.iter().map(|(_, done)| done.iter().map(|x| x * x).sum::<f64>()).sum()
}
