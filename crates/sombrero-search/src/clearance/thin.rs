//! Faces that are thinner than functions move their corners apart.

use super::Displacements;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use sombrero_coupling::{Assembly, Facing, across};

/// A face's height may change by so many times what a wall's thickness may: it is to keep its side, and is too small to be
/// seen turn a little.
const LOOSER: f64 = 8.0;

/// Faces that one task takes.
const CHUNK: usize = 4096;

/// The faces whose corner and longest edge come apart by more than `share` of their height, in root mean squares over all
/// functions at ε = 1; each along its height and along its normal.
pub(super) fn pairs(displacements: &[Displacements], assembly: &Assembly<'_>, share: f64) -> Vec<Facing> {
    let Assembly { points, triangles, reach, .. } = *assembly;
    let binding = |corners: &[u32; 3]| {
        let mut pairs = across(points, corners)?;
        pairs.iter_mut().for_each(|pair| pair.distance *= LOOSER);
        let Facing { distance, terms, .. } = &pairs[0];
        // What is no thicker than the numbers' steps is a crack that was filled, and is not seen.
        let contact = corners.iter().map(|&v| reach[v as usize]).fold(0.0, f64::max);
        let most = share * distance;
        (*distance > LOOSER * contact && apart(displacements, terms) > most * most).then_some(pairs)
    };
    let bound = triangles.par_iter().with_min_len(CHUNK).filter_map(binding);
    bound.flat_map_iter(|pairs| pairs).collect()
}

/// Σ_i |r_i|², where r_i is what function i moves the terms' places apart by.
fn apart(displacements: &[Displacements], terms: &[(u32, Matrix3<f64>)]) -> f64 {
    let mut rests = terms.iter().map(|(v, map)| (&displacements[*v as usize][..], map)).collect::<Vec<_>>();
    let mut sum = 0.0;
    while let Some(next) = rests.iter().filter_map(|(rest, _)| Some(rest.first()?.0)).min() {
        let mut r = Vector3::zeros();
        for (rest, map) in &mut rests {
            if let [(i, d), others @ ..] = rest
                && *i == next
            {
                r += **map * d;
                *rest = others;
            }
        }
        sum += r.norm_squared();
    }
    sum
}
