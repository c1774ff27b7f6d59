//! How far normals turn: what fields do to each face, to first order.

use crate::Field;
use crate::surface::Surface;
use crate::together::{Here, next_field};
use crate::visibility::{Term, face_terms, value};
use nalgebra::Vector3;
use rayon::prelude::*;

/// |dn|² of each face that turns.
pub(crate) fn turned(surface: &Surface, field: &Field) -> Vec<(u32, f64)> {
    let mut d = vec![Vector3::zeros(); surface.points.len()];
    field.iter().for_each(|(v, x)| d[*v as usize] = *x);
    let square = |term: &Term| {
        let x = value(term, &d);
        x * x
    };
    let of_face = |f: u32| {
        let here = surface.triangles[f as usize].iter().any(|&v| d[v as usize] != Vector3::zeros());
        let area = surface.facets.areas[f as usize];
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
    let mean = all.iter().zip(&surface.facets.areas).map(|(t, a)| t * a).sum::<f64>() / surface.area;
    let hot: Vec<f64> = all.iter().map(|t| t / mean).collect();
    let of_field = |(turns, sum): (&Vec<(u32, f64)>, &f64)| {
        let terms = turns.iter().map(|(f, t)| t * surface.facets.areas[*f as usize] * hot[*f as usize]);
        if *sum > 0.0 && mean > 0.0 { terms.sum::<f64>() / sum } else { 1.0 }
    };
    turns.iter().zip(sums).map(of_field).collect()
}

/// Faces that one task takes.
const CHUNK: usize = 4096;

/// Fields on a surface whose coefficients are standard Gaussian.
pub(crate) struct Strewn<'a, H, F> {
    /// For each point what each field does there.
    pub(crate) at: &'a [H],
    /// What the displacement of a field at a point is to be multiplied by.
    pub(crate) factor: F,
}

impl<H: AsRef<Here> + Sync, F: Fn(u32, u32) -> f64 + Sync> Strewn<'_, H, F> {
    /// The expectation of A |dn|² of each face.
    pub(crate) fn turned(&self, surface: &Surface) -> Vec<f64> {
        let of_face = |f: usize| {
            let [along, across, ..] = face_terms(surface, f);
            self.expectation([&along, &across])
        };
        (0..surface.triangles.len()).into_par_iter().with_min_len(CHUNK).map(of_face).collect()
    }

    /// The expectation of (n · d)² at a point.
    pub(crate) fn squared(&self, point: u32, n: &Vector3<f64>) -> f64 {
        let here = self.at[point as usize].as_ref().iter();
        here.map(|(field, d)| (d.dot(n) * (self.factor)(*field, point)).powi(2)).sum()
    }

    /// Σ over fields of the squares of what they do to the terms, which are of the same vertices.
    pub(crate) fn expectation<const N: usize>(&self, terms: [&Term; N]) -> f64 {
        let vertices = &terms[0].vertices[..terms[0].count];
        let mut rests: [&Here; 4] = [&[]; 4];
        rests.iter_mut().zip(vertices).for_each(|(rest, v)| *rest = self.at[*v as usize].as_ref());
        let squares = std::iter::from_fn(|| {
            let mut done = [0.0; N];
            next_field(&mut rests, |field, k, d| {
                let d = d * (self.factor)(field, vertices[k]);
                (0..N).for_each(|a| done[a] += terms[a].gradients[k].dot(&d));
            })?;
            Some(done.iter().map(|x| x * x).sum::<f64>())
        });
        squares.sum()
    }
}
