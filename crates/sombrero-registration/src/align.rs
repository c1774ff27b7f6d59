//! A rough pose refined: to a similarity, or to an affine map.

use nalgebra::{Affine3, Point3, Similarity3};
use sombrero_progress::Progress;

use crate::candidate::{Candidate, answer};
use crate::error::{RegistrationError, Side};
use crate::options::IcpOptions;
use crate::reference::Reference;
use crate::refinement::affine_map::AffineMap;
use crate::refinement::icp::{Icp, ROUGH_REACH, ROUNDS};
use crate::refinement::motion::Motion;
use crate::result::Registration;
use crate::surface::frame::to_unit;
use crate::surface::shape::Shape;
use crate::verdict::fit::FitMeasure;

/// Brings the suspect onto the reference from a rough pose, which may be off by some 20 degrees, a tenth
/// of the size and a tenth of the scale.
///
/// `start` maps suspect to reference, in model units. The suspect may show only a part of the reference.
///
/// # Errors
/// [`RegistrationError`] when the suspect has no shape, the start is no similarity, or an option is out of
/// range. Running out of iterations is told by [`Registration::converged`].
pub fn align(
    reference: &Reference,
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    start: &Similarity3<f64>,
    options: &IcpOptions,
) -> Result<Registration, RegistrationError> {
    refined::<Similarity3<f64>>(reference, points, triangles, start, options)
}

/// Makes an affine map of a similarity that already brings the suspect about into its place.
///
/// `start` maps suspect to reference, in model units. The suspect may show only a part of the reference.
///
/// # Errors
/// As [`align`].
pub fn refine_affine(
    reference: &Reference,
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    start: &Similarity3<f64>,
    options: &IcpOptions,
) -> Result<Registration<Affine3<f64>>, RegistrationError> {
    refined::<AffineMap>(reference, points, triangles, start, options)
}

fn refined<M: Motion>(
    reference: &Reference,
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    start: &Similarity3<f64>,
    options: &IcpOptions,
) -> Result<Registration<M::Model>, RegistrationError> {
    options.check()?;
    let suspect = Shape::new(Side::Suspect, points, triangles)?;
    let start = to_unit(&reference.shape, &suspect, start).ok_or(RegistrationError::Start { index: 0 })?;
    let icp = Icp::new(&reference.shape, &suspect, options);
    let progress = Progress::new("registration", ROUNDS);
    let run = icp.all_rounds(M::of(&start), ROUGH_REACH, options.max_iterations, || progress.advance(1));
    let fit = FitMeasure::fine(&reference.shape, &suspect, options.samples).of(&run.pose.map());
    answer(&reference.shape, &suspect, &[Candidate { run, fit }], 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, Vector3};
    use proptest::prelude::*;
    use sombrero_mesh::Soup;
    use sombrero_shapes as shapes;

    /// Turned by `degrees` about an axis through the centre, shifted by 3 % of the size, 5 % larger.
    fn rough(soup: &Soup, axis: Vector3<f64>, degrees: f64) -> Similarity3<f64> {
        let bounds = soup.bounding_box().unwrap();
        let centre = Translation3::from(nalgebra::center(&bounds.min, &bounds.max).coords);
        let shift = axis.yzx().normalize() * (0.03 * bounds.largest_side());
        let turn = axis.normalize() * degrees.to_radians();
        centre * Similarity3::new(shift, turn, 1.05) * centre.inverse()
    }

    /// Without the triangles that reach into the right third.
    fn cropped(soup: &Soup) -> Soup {
        let bounds = soup.bounding_box().unwrap();
        let limit = bounds.max.x - bounds.sides().x / 3.0;
        let keeps = |t: &[u32; 3]| t.iter().all(|&v| soup.points[v as usize].x <= limit);
        Soup::new(soup.points.clone(), soup.triangles.iter().copied().filter(keeps).collect())
    }

    fn largest_error(soup: &Soup, found: &Similarity3<f64>) -> f64 {
        let side = soup.bounding_box().unwrap().largest_side();
        soup.points.iter().map(|p| (found * p - p).norm()).fold(0.0, f64::max) / side
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn a_cropped_suspect_finds_its_place(
            soup in prop::sample::select(vec![shapes::part(3), shapes::bust(16), shapes::bumpy_sphere(1500)]),
            axis in prop::array::uniform3(0.1..1.0_f64),
            degrees in -10.0..10.0_f64,
        ) {
            let reference = Reference::new(&soup.points, &soup.triangles).unwrap();
            let suspect = cropped(&soup);
            let start = rough(&soup, Vector3::from(axis), degrees);
            let found =
                align(&reference, &suspect.points, &suspect.triangles, &start, &IcpOptions::default()).unwrap();
            prop_assert!(found.converged);
            prop_assert!(found.best.overlap < 0.85 && found.best.suspect_overlap > 0.98);
            prop_assert!(largest_error(&soup, &found.best.reference_from_suspect) < 1e-9);
        }
    }

    #[test]
    fn added_geometry_does_not_pull() {
        let soup = shapes::bumpy_sphere(1500);
        let reference = Reference::new(&soup.points, &soup.triangles).unwrap();
        let mut suspect = soup.clone();
        let first = suspect.points.len() as u32;
        let sheet = shapes::open_sheet(10, 10);
        suspect.points.extend(sheet.points.iter().map(|p| p - Vector3::new(0.75, 0.5, 1.6)));
        suspect.triangles.extend(sheet.triangles.iter().map(|t| t.map(|v| v + first)));
        let start = rough(&soup, Vector3::new(1.0, 2.0, -1.0), 5.0);
        let found =
            align(&reference, &suspect.points, &suspect.triangles, &start, &IcpOptions::default()).unwrap();
        assert!(largest_error(&soup, &found.best.reference_from_suspect) < 1e-9);
        assert!(found.best.suspect_overlap < 0.95 && found.best.overlap > 0.99);
    }

    #[test]
    fn running_out_is_told() {
        let soup = shapes::part(1);
        let reference = Reference::new(&soup.points, &soup.triangles).unwrap();
        let start = rough(&soup, Vector3::x(), 8.0);
        let options = IcpOptions { max_iterations: 1, uniform_reach: None, ..IcpOptions::default() };
        let found = align(&reference, &soup.points, &soup.triangles, &start, &options).unwrap();
        assert!(!found.converged && found.iterations == 1);
    }

    #[test]
    fn options_are_checked() {
        let soup = shapes::part(1);
        let reference = Reference::new(&soup.points, &soup.triangles).unwrap();
        for options in [
            IcpOptions { samples: 0, ..IcpOptions::default() },
            IcpOptions { relative_tolerance: f64::NAN, ..IcpOptions::default() },
            IcpOptions { rejection: Some(0.5), ..IcpOptions::default() },
            IcpOptions { tukey: Some(-1.0), ..IcpOptions::default() },
        ] {
            let answer = align(&reference, &soup.points, &soup.triangles, &Similarity3::identity(), &options);
            assert!(matches!(answer, Err(RegistrationError::Option { .. })), "{options:?}");
        }
    }
}
