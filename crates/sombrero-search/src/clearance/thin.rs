//! Faces that are thinner than functions move their corners apart.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use sombrero_coupling::{Assembly, Facing, across};
use sombrero_spectral::{Here, next_field};

/// A face's height may change by so many times what a wall's thickness may: it is to keep its side, and is too small to be
/// seen turn a little.
const LOOSER: f64 = 4.0;

/// Faces that one task takes.
const CHUNK: usize = 4096;

/// The faces whose corner and longest edge come apart by more than `share` of their height, in root mean squares over all
/// functions at ε = 1; each along its height and along its normal.
pub(super) fn pairs(at: &[&Here], assembly: &Assembly<'_>, share: f64) -> Vec<Facing> {
    let Assembly { points, triangles, reach, .. } = *assembly;
    let binding = |corners: &[u32; 3]| {
        let mut pairs = across(points, corners)?;
        pairs.iter_mut().for_each(|pair| pair.distance *= LOOSER);
        let Facing { distance, terms, .. } = &pairs[0];
        // What is no thicker than the numbers' steps is a crack that was filled, and is not seen.
        let contact = corners.iter().map(|&v| reach[v as usize]).fold(0.0, f64::max);
        let most = share * distance;
        (*distance > LOOSER * contact && apart(at, terms) > most * most).then_some(pairs)
    };
    let bound = triangles.par_iter().with_min_len(CHUNK).filter_map(binding);
    bound.flat_map_iter(|pairs| pairs).collect()
}

/// Σ_i |r_i|², where r_i is what function i moves the terms' places apart by.
fn apart(at: &[&Here], terms: &[(u32, Matrix3<f64>)]) -> f64 {
    let mut rests: Vec<&Here> = terms.iter().map(|(v, _)| at[*v as usize]).collect();
    let mut sum = 0.0;
    loop {
        let mut r = Vector3::zeros();
        if next_field(&mut rests, |_, k, d| r += terms[k].1 * d).is_none() {
            return sum;
        }
        sum += r.norm_squared();
    }
}
