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
//! others, and so are those of one to which something was added: poses of these come from landmarks.

use nalgebra::{Matrix3, Rotation3, Similarity3, Translation3, UnitQuaternion, Vector3};

use crate::surface::moments::Moments;
use crate::surface::shape::Shape;

/// Spreads closer than this ratio may have changed places.
const CLOSE: f64 = 0.93;

/// The poses by which the moments agree, in the unit frames.
pub(crate) fn by_moments(reference: &Shape, suspect: &Shape) -> Vec<Similarity3<f64>> {
    let (r, s) = (&reference.moments, &suspect.moments);
    let close = is_close(&r.spreads) || is_close(&s.spreads);
    let turns = if close { cube() } else { signs() };
    turns.iter().map(|d| pose(r, s, d)).collect()
}

fn is_close(spreads: &Vector3<f64>) -> bool {
    spreads.y > CLOSE * spreads.x || spreads.z > CLOSE * spreads.y
}

/// The centroids coincide and the axes agree up to `turn`.
fn pose(reference: &Moments, suspect: &Moments, turn: &Matrix3<f64>) -> Similarity3<f64> {
    let rotation = reference.axes * turn * suspect.axes.transpose();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    let scale = reference.radius() / suspect.radius();
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

#[cfg(test)]
mod tests {
    use super::*;

    fn is_group(turns: &[Matrix3<f64>]) -> bool {
        let holds = |m: Matrix3<f64>| turns.iter().filter(|t| (*t - m).norm() < 1e-9).count() == 1;
        turns.iter().all(|a| turns.iter().all(|b| holds(a * b)))
    }

    #[test]
    fn the_turns_are_the_rotation_groups() {
        for (turns, order) in [(signs(), 4), (cube(), 24)] {
            assert_eq!(turns.len(), order);
            assert!(turns.iter().all(|m| (m.determinant() - 1.0).abs() < 1e-12));
            assert!(is_group(&turns));
        }
    }
}
