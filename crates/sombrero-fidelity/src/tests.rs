//! Laws of all measures together.

use crate::{Fidelity, Places};
use nalgebra::{Point3, Rotation3, Vector3};
use proptest::prelude::*;
use sombrero_mesh::Soup;
use sombrero_shapes as shapes;

fn shape() -> impl Strategy<Value = Soup> {
    prop_oneof![
        (100usize..800).prop_map(shapes::bumpy_sphere),
        Just(shapes::part(shapes::PART_RESOLUTION / 2)),
        Just(shapes::torus(40, 20, 1.0, 0.2)),
        Just(shapes::sheet_with_hole(12, 9)),
    ]
}

/// Each point moved by at most `size` along each axis, the same way every time.
fn rough(points: &[Point3<f64>], size: f64, seed: f64) -> Vec<Point3<f64>> {
    let wobble = |k: usize, step: f64| (k as f64 * step + seed).fract() - 0.5;
    let shift = |k| Vector3::new(wobble(k, 0.754_87), wobble(k, 0.569_84), wobble(k, 0.430_16));
    points.iter().enumerate().map(|(k, p)| p + shift(k) * (2.0 * size)).collect()
}

fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * a.abs().max(b.abs()) + 1e-9
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn what_stays_is_faithful(soup in shape()) {
        let same = Fidelity::between(&soup.points, &soup.points, &soup.triangles, None);
        prop_assert!(same.mrms < 1e-15 && same.msdm2 == 0.0 && same.new_intersections == 0);
        prop_assert!(same.normals_rms == 0.0 && same.normals_p99 == 0.0);
        prop_assert!(same.flat_dihedral.unwrap_or(0.0) == 0.0 && same.flatness.unwrap_or(0.0) == 0.0);
        prop_assert_eq!(same.thinnest_before, same.thinnest_after);
        prop_assert_eq!(same.widest_crack_before, same.widest_crack_after);
        prop_assert_eq!(same.warnings(None), Vec::<String>::new());
    }

    #[test]
    fn size_and_pose_change_only_lengths(
        soup in shape(), seed in 0.0..1.0f64, scale in 0.01..100.0f64, quarter in 0u8..4, shift in -3.0..3.0f64
    ) {
        let after = rough(&soup.points, 1e-3, seed);
        let one = Fidelity::between(&soup.points, &after, &soup.triangles, None);
        // By quarters, so that the largest side stays what it is.
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), f64::from(quarter) * std::f64::consts::FRAC_PI_2);
        let moved = |points: &[Point3<f64>]| -> Vec<Point3<f64>> {
            points.iter().map(|p| turn * p * scale + Vector3::new(shift, 0.0, -shift)).collect()
        };
        let other = Fidelity::between(&moved(&soup.points), &moved(&after), &soup.triangles, None);
        prop_assert!(near(one.mrms, other.mrms, 1e-6) && near(one.msdm2, other.msdm2, 1e-6));
        prop_assert!(near(one.normals_rms, other.normals_rms, 1e-6) && near(one.normals_p99, other.normals_p99, 1e-6));
        prop_assert_eq!(one.new_intersections, other.new_intersections);
        for (a, b, scale) in [
            (one.flat_dihedral, other.flat_dihedral, 1.0),
            (one.flatness, other.flatness, 1.0),
            (one.thinnest_before, other.thinnest_before, scale),
            (one.thinnest_after, other.thinnest_after, scale),
        ] {
            prop_assert_eq!(a.is_some(), b.is_some());
            prop_assert!(near(a.unwrap_or(0.0) * scale, b.unwrap_or(0.0), 1e-6), "{:?} {:?}", a, b);
        }
    }

    #[test]
    fn threads_change_no_bit(soup in shape(), seed in 0.0..1.0f64) {
        let after = rough(&soup.points, 2e-3, seed);
        let [one, four] = [1, 4].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Fidelity::between(&soup.points, &after, &soup.triangles, None))
        });
        prop_assert_eq!(one, four);
    }

    #[test]
    fn any_input_is_measured(
        points in prop::collection::vec([coordinate(), coordinate(), coordinate()], 0..30),
        moved in prop::collection::vec([coordinate(), coordinate(), coordinate()], 0..30),
        triangles in prop::collection::vec([0u32..32, 0..32, 0..32], 0..40)
    ) {
        let [before, after] = [points, moved].map(|p| p.into_iter().map(Point3::from).collect::<Vec<_>>());
        let Fidelity { mrms, msdm2, normals_rms, normals_p99, .. } = Fidelity::between(&before, &after, &triangles, None);
        prop_assert!([mrms, msdm2, normals_rms, normals_p99].iter().all(|x| x.is_finite() && *x >= 0.0));
    }
}

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => (-4i32..=4).prop_map(f64::from),
        4 => -1.0..1.0,
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => prop_oneof![Just(1e60), Just(-1e60), Just(1e-60), Just(1e300), Just(1e-310)],
    ]
}

#[test]
fn cracks_are_between_the_places_that_are_given() {
    let soup = shapes::cube();
    let [before, after] = [[0.0, 0.0], [0.0, 0.5]].map(|x| x.map(|x| Point3::new(x, 0.0, 0.0)));
    let far = [before[0], before[1], Point3::new(9.0, 9.0, 9.0)];
    let moved = [after[0], after[1], far[2]];
    let places = Places::new(&far, &moved);
    let measured = Fidelity::between(&soup.points, &soup.points, &soup.triangles, Some(places));
    assert_eq!((measured.widest_crack_before, measured.widest_crack_after), (0.0, 0.5));
    assert!(measured.warnings(None)[0].contains("by 0.5 ("));
}
