//! Maps between the unit frames of two surfaces, and the same maps in model units.

use nalgebra::{Affine3, Matrix3, Matrix4, Similarity3, Translation3, UnitQuaternion, Vector3};

use crate::error::RegistrationError;
use crate::surface::shape::Shape;

/// The similarity in model units that `pose` is between the unit frames.
pub(crate) fn to_model(
    reference: &Shape,
    suspect: &Shape,
    pose: &Similarity3<f64>,
) -> Option<Similarity3<f64>> {
    let scale = pose.scaling() * (reference.diagonal / suspect.diagonal);
    let rotation = pose.isometry.rotation;
    let shift = reference.centre.coords + pose.isometry.translation.vector * reference.diagonal
        - rotation * (suspect.centre.coords * scale);
    similarity(shift, rotation, scale)
}

/// The affine map in model units that x' = `linear` x + `shift` is between the unit frames.
pub(crate) fn affine_to_model(
    reference: &Shape,
    suspect: &Shape,
    linear: &Matrix3<f64>,
    shift: &Vector3<f64>,
) -> Option<Affine3<f64>> {
    let linear: Matrix3<f64> = linear * (reference.diagonal / suspect.diagonal);
    let shift: Vector3<f64> =
        reference.centre.coords + shift * reference.diagonal - linear * suspect.centre.coords;
    let mut matrix: Matrix4<f64> = linear.to_homogeneous();
    matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&shift);
    nalgebra::try_convert(matrix)
}

/// The reverse of [`to_model`].
pub(crate) fn to_unit(
    reference: &Shape,
    suspect: &Shape,
    model: &Similarity3<f64>,
) -> Option<Similarity3<f64>> {
    let scale = model.scaling() * (suspect.diagonal / reference.diagonal);
    let shift = (model * suspect.centre - reference.centre) / reference.diagonal;
    similarity(shift, model.isometry.rotation, scale)
}

/// [`to_unit`] of each of `starts`.
///
/// # Errors
/// [`RegistrationError`] when there are none, or one is no similarity.
pub(crate) fn all_to_unit(
    reference: &Shape,
    suspect: &Shape,
    starts: &[Similarity3<f64>],
) -> Result<Vec<Similarity3<f64>>, RegistrationError> {
    if starts.is_empty() {
        return Err(RegistrationError::NoStarts);
    }
    let unit = |(index, start)| to_unit(reference, suspect, start).ok_or(RegistrationError::Start { index });
    starts.iter().enumerate().map(unit).collect()
}

/// `None` when a number is not finite or the scale not positive.
fn similarity(shift: Vector3<f64>, rotation: UnitQuaternion<f64>, scale: f64) -> Option<Similarity3<f64>> {
    let finite = shift.iter().chain(rotation.coords.iter()).all(|x| x.is_finite());
    (finite && scale.is_normal() && scale > 0.0)
        .then(|| Similarity3::from_parts(Translation3::from(shift), rotation, scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Side;
    use sombrero_shapes as shapes;

    #[test]
    fn frames_there_and_back() {
        let (a, b) = (shapes::part(1), shapes::bumpy_sphere(200));
        let a = Shape::new(Side::Reference, &a.points, &a.triangles).unwrap();
        let b = Shape::new(Side::Suspect, &b.points, &b.triangles).unwrap();
        let s = Similarity3::new(Vector3::new(1.0, -2.0, 3.0), Vector3::new(0.3, 0.2, -0.9), 0.7);
        let back = to_model(&a, &b, &to_unit(&a, &b, &s).unwrap()).unwrap();
        assert!((back.to_homogeneous() - s.to_homogeneous()).norm() < 1e-12);
    }
}
