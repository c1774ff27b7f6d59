//! Rough poses without a human: moments of the two surfaces.
//!
//! Centroid, root mean square radius and principal axes of a surface move with it. With A the axes of the
//! reference and A' those of the suspect, as columns, the rotation is
//!
//! ```text
//! R = A D A'ᵀ
//! ```
//!
//! for one of few D: the four proper changes of sign when the three spreads differ, the 24 rotations of the
//! cube when two of them are close and may have changed places. The moments of a cropped suspect are
//! others; a grid of rotations (the 60 of the icosahedron, none of them more than 45 degrees from any) is
//! then tried with several scales.

use nalgebra::{Matrix3, Quaternion, Rotation3, Similarity3, Translation3, UnitQuaternion, Vector3};

use crate::moments::Moments;
use crate::shape::Shape;

/// Spreads closer than this ratio may have changed places.
const CLOSE: f64 = 0.93;
/// Scales of the wide search relative to equal radii: a crop has a smaller radius than the whole.
const LADDER: [f64; 2] = [1.0, 0.75];

/// The poses by which the moments agree, in the unit frames.
pub(crate) fn by_moments(reference: &Shape, suspect: &Shape) -> Vec<Similarity3<f64>> {
    let (r, s) = (&reference.moments, &suspect.moments);
    let close = is_close(&r.spreads) || is_close(&s.spreads);
    let turns = if close { cube() } else { signs() };
    turns.iter().map(|d| pose(r, s, d, 1.0)).collect()
}

/// Poses all over the rotations, for when no pose by moments fits.
pub(crate) fn all_over(reference: &Shape, suspect: &Shape) -> Vec<Similarity3<f64>> {
    let (r, s) = (&reference.moments, &suspect.moments);
    let turns = icosahedron();
    LADDER.iter().flat_map(|scale| turns.iter().map(|d| pose(r, s, d, *scale))).collect()
}

fn is_close(spreads: &Vector3<f64>) -> bool {
    spreads.y > CLOSE * spreads.x || spreads.z > CLOSE * spreads.y
}

/// The centroids coincide and the axes agree up to `turn`.
fn pose(reference: &Moments, suspect: &Moments, turn: &Matrix3<f64>, scale: f64) -> Similarity3<f64> {
    let rotation = reference.axes * turn * suspect.axes.transpose();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    let scale = scale * reference.radius() / suspect.radius();
    let shift = reference.centroid.coords - rotation * suspect.centroid.coords * scale;
    Similarity3::from_parts(Translation3::from(shift), rotation, scale)
}

/// The four diagonal rotations.
fn signs() -> Vec<Matrix3<f64>> {
    cube().into_iter().filter(|m| m.diagonal().iter().all(|x| *x != 0.0)).collect()
}

/// The rotations that take a cube to itself: signed permutations with determinant 1.
fn cube() -> Vec<Matrix3<f64>> {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let axis = |i: usize, negative: bool| Vector3::ith(i, if negative { -1.0 } else { 1.0 });
    let signed = |order: [usize; 3], signs: usize| {
        Matrix3::from_columns(&[0, 1, 2].map(|k| axis(order[k], signs >> k & 1 == 1)))
    };
    let all = ORDERS.iter().flat_map(|order| (0..8).map(|signs| signed(*order, signs)));
    all.filter(|m| m.determinant() > 0.0).collect()
}

/// The rotations that take an icosahedron to itself, as the unit quaternions (up to sign)
/// (±1, 0, 0, 0), (±1, ±1, ±1, ±1)/2 and (0, ±1/φ, ±1, ±φ)/2 in all even orders.
fn icosahedron() -> Vec<Matrix3<f64>> {
    const EVEN: [[usize; 4]; 12] = [
        [0, 1, 2, 3],
        [0, 2, 3, 1],
        [0, 3, 1, 2],
        [1, 0, 3, 2],
        [1, 2, 0, 3],
        [1, 3, 2, 0],
        [2, 0, 1, 3],
        [2, 1, 3, 0],
        [2, 3, 0, 1],
        [3, 0, 2, 1],
        [3, 1, 0, 2],
        [3, 2, 1, 0],
    ];
    let phi = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut found: Vec<[f64; 4]> = (0..4).map(|k| std::array::from_fn(|i| f64::from(i == k))).collect();
    let sign = |signs: usize, k: usize| if signs >> k & 1 == 1 { -0.5 } else { 0.5 };
    // The first sign is fixed, since q and -q are one rotation.
    found.extend((0..8).map(|signs| [0.5, sign(signs, 0), sign(signs, 1), sign(signs, 2)]));
    for order in EVEN {
        for signs in 0..4 {
            let values = [0.0, 0.5 / phi, sign(signs, 0), sign(signs, 1) * phi];
            found.push(order.map(|k| values[k]));
        }
    }
    let matrix = |q: &[f64; 4]| {
        let q = UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]));
        q.to_rotation_matrix().into_inner()
    };
    found.iter().map(matrix).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_group(turns: &[Matrix3<f64>]) -> bool {
        let holds = |m: Matrix3<f64>| turns.iter().filter(|t| (*t - m).norm() < 1e-9).count() == 1;
        turns.iter().all(|a| turns.iter().all(|b| holds(a * b)))
    }

    #[test]
    fn the_turns_are_the_rotation_groups() {
        for (turns, order) in [(signs(), 4), (cube(), 24), (icosahedron(), 60)] {
            assert_eq!(turns.len(), order);
            assert!(turns.iter().all(|m| (m.determinant() - 1.0).abs() < 1e-12));
            assert!(is_group(&turns));
        }
    }
}
