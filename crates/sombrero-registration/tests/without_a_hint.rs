//! Damaged suspects find back to the original without a hint, and know when they do not.

use nalgebra::{
    Affine3, Matrix3, Point3, Quaternion, Rotation3, Similarity3, Translation3, UnitQuaternion, Vector3,
};
use proptest::prelude::*;
use sombrero_mesh::Soup;
use sombrero_registration::{
    Reference, RegisterOptions, Registration, refine_affine, register, register_affine,
};
use sombrero_shapes as shapes;

fn rotation() -> impl Strategy<Value = UnitQuaternion<f64>> {
    prop::array::uniform4(-1.0..1.0_f64)
        .prop_filter("a rotation", |q| (0.01..1.0).contains(&q.iter().map(|x| x * x).sum::<f64>()))
        .prop_map(|[w, i, j, k]| UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)))
}

/// Any rotation, scales from 0.1 to 10.
fn similarity() -> impl Strategy<Value = Similarity3<f64>> {
    let shift = prop::array::uniform3(-100.0..100.0_f64);
    (rotation(), shift, -1.0..1.0_f64).prop_map(|(rotation, shift, decades)| {
        Similarity3::from_parts(Translation3::from(Vector3::from(shift)), rotation, 10f64.powf(decades))
    })
}

fn direction() -> impl Strategy<Value = Vector3<f64>> {
    rotation().prop_map(|r| r * Vector3::z())
}

/// R diag(1, a, 1.5) Rᵀ.
fn stretch() -> impl Strategy<Value = Matrix3<f64>> {
    (rotation(), 1.0..1.5_f64).prop_map(|(axes, a)| {
        let axes: Rotation3<f64> = axes.to_rotation_matrix();
        axes.matrix() * Matrix3::from_diagonal(&Vector3::new(1.0, a, 1.5)) * axes.matrix().transpose()
    })
}

/// A shape, and the same with about half the vertices.
fn shape() -> impl Strategy<Value = (Soup, Soup)> {
    prop::sample::select(vec![
        (shapes::part(4), shapes::part(3)),
        (shapes::bust(20), shapes::bust(14)),
        (shapes::bumpy_sphere(4000), shapes::bumpy_sphere(2000)),
    ])
}

fn area(soup: &Soup, t: &[u32; 3]) -> f64 {
    let [a, b, c] = t.map(|v| soup.points[v as usize]);
    (b - a).cross(&(c - a)).norm() / 2.0
}

fn whole_area(soup: &Soup) -> f64 {
    soup.triangles.iter().map(|t| area(soup, t)).sum()
}

/// What lies on one side of a plane: this `share` of the area.
fn kept(soup: &Soup, share: f64, direction: &Vector3<f64>) -> Soup {
    let height = |t: &[u32; 3]| t.iter().map(|&v| soup.points[v as usize].coords.dot(direction)).sum::<f64>();
    let mut triangles = soup.triangles.clone();
    triangles.sort_by(|a, b| height(a).total_cmp(&height(b)));
    let mut left = share * whole_area(soup);
    triangles.retain(|t| {
        left -= area(soup, t);
        left > 0.0
    });
    Soup::new(soup.points.clone(), triangles)
}

fn joined(soup: &Soup, other: &Soup) -> Soup {
    let first = soup.points.len() as u32;
    let mut both = soup.clone();
    both.points.extend(&other.points);
    both.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    both
}

fn moved(soup: &Soup, s: &Similarity3<f64>) -> Soup {
    Soup::new(soup.points.iter().map(|p| s * p).collect(), soup.triangles.clone())
}

fn reference(soup: &Soup) -> Reference {
    Reference::new(&soup.points, &soup.triangles).expect("a surface")
}

fn found(original: &Soup, suspect: &Soup) -> Registration {
    register(&reference(original), &suspect.points, &suspect.triangles, &RegisterOptions::default())
        .expect("a surface")
}

fn affine(original: &Soup, suspect: &Soup) -> Registration<Affine3<f64>> {
    register_affine(&reference(original), &suspect.points, &suspect.triangles, &RegisterOptions::default())
        .expect("a surface")
}

/// Largest distance of a vertex of the original from its place, in largest sides.
fn error(original: &Soup, rest: impl Fn(&Point3<f64>) -> Point3<f64>) -> f64 {
    let side = original.bounding_box().expect("points").largest_side();
    original.points.iter().map(|p| (rest(p) - p).norm()).fold(0.0, f64::max) / side
}

fn is_right(original: &Soup, truth: &Similarity3<f64>, answer: &Similarity3<f64>) -> bool {
    error(original, |p| answer * (truth * p)) < 0.01
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2))]

    #[test]
    fn cut_and_simplified((original, coarse) in shape(), d in direction(), s in similarity()) {
        let answer = found(&original, &moved(&kept(&coarse, 2.0 / 3.0, &d), &s));
        prop_assert!(answer.trusted);
        prop_assert!(is_right(&original, &s, &answer.best.reference_from_suspect));
    }

    #[test]
    fn half_is_enough((original, _) in shape(), d in direction(), s in similarity()) {
        let answer = found(&original, &moved(&kept(&original, 0.5, &d), &s));
        prop_assert!(answer.trusted);
        prop_assert!(is_right(&original, &s, &answer.best.reference_from_suspect));
    }

    #[test]
    fn beside_another_object((original, coarse) in shape(), d in direction(), s in similarity()) {
        let ring = shapes::torus(48, 24, 2.0, 0.8);
        let size = (whole_area(&original) / whole_area(&ring)).sqrt();
        let bounds = original.bounding_box().unwrap();
        let aside = d * (bounds.sides().norm() / 2.0 + 2.9 * size);
        let place = Similarity3::new(nalgebra::center(&bounds.min, &bounds.max).coords + aside, d * 2.0, size);
        let answer = found(&original, &moved(&joined(&coarse, &moved(&ring, &place)), &s));
        prop_assert!(answer.trusted);
        prop_assert!((answer.best.suspect_overlap - 0.5).abs() < 0.1 && answer.best.overlap > 0.95);
        prop_assert!(is_right(&original, &s, &answer.best.reference_from_suspect));
    }

    #[test]
    fn on_a_base_plate((original, coarse) in shape(), s in similarity()) {
        let bounds = original.bounding_box().unwrap();
        let mut plate = shapes::genus(0, 10);
        let box_of_plate = plate.bounding_box().unwrap();
        let centre = nalgebra::center(&box_of_plate.min, &box_of_plate.max);
        let mut target = nalgebra::center(&bounds.min, &bounds.max);
        target.z = bounds.min.z;
        let mut sides = bounds.sides() * 1.3;
        sides.z *= 0.05;
        let stretch = sides.component_div(&box_of_plate.sides());
        plate.points.iter_mut().for_each(|p| *p = target + (*p - centre).component_mul(&stretch));
        let answer = found(&original, &moved(&joined(&coarse, &plate), &s));
        prop_assert!(answer.trusted);
        prop_assert!(is_right(&original, &s, &answer.best.reference_from_suspect));
    }

    #[test]
    fn stretched((original, coarse) in shape(), m in stretch(), s in similarity()) {
        let stretched = Soup::new(coarse.points.iter().map(|p| m * p).collect(), coarse.triangles.clone());
        let answer = affine(&original, &moved(&stretched, &s));
        prop_assert!(answer.trusted);
        let rest = |p: &Point3<f64>| answer.best.reference_from_suspect * (s * (m * p));
        prop_assert!(error(&original, rest) < 0.01);
    }

    #[test]
    fn stretched_and_cut((original, coarse) in shape(), d in direction(), m in stretch(), s in similarity()) {
        let cut = kept(&coarse, 2.0 / 3.0, &d);
        let stretched = Soup::new(cut.points.iter().map(|p| m * p).collect(), cut.triangles);
        let answer = affine(&original, &moved(&stretched, &s));
        prop_assert!(answer.trusted);
        let rest = |p: &Point3<f64>| answer.best.reference_from_suspect * (s * (m * p));
        prop_assert!(error(&original, rest) < 0.01);
    }
}

fn some_similarity() -> Similarity3<f64> {
    Similarity3::new(Vector3::new(3.0, 2.0, 1.0), Vector3::new(-1.0, 2.0, 0.5), 4.0)
}

#[test]
fn a_similarity_becomes_affine() {
    let original = shapes::part(3);
    let m = Matrix3::new(1.05, 0.02, 0.0, -0.03, 0.97, 0.04, 0.0, 0.01, 1.0);
    let s = some_similarity();
    let bent = Soup::new(original.points.iter().map(|p| m * p).collect(), original.triangles.clone());
    let suspect = moved(&bent, &s);
    let start = s.inverse();
    let options = Default::default();
    let answer =
        refine_affine(&reference(&original), &suspect.points, &suspect.triangles, &start, &options).unwrap();
    assert!(answer.trusted && answer.converged);
    assert!(error(&original, |p| answer.best.reference_from_suspect * (s * (m * p))) < 1e-6);
}

#[test]
fn all_poses_of_a_symmetric_shape_are_returned() {
    let s = some_similarity();
    for (soup, order) in [
        (shapes::tetrahedron(), 12),
        (shapes::cube(), 24),
        (shapes::octahedron(), 24),
        (shapes::genus(1, 6), 8),
    ] {
        let answer = found(&soup, &moved(&soup, &s));
        assert!(answer.trusted);
        assert_eq!(answer.alternatives.len() + 1, order);
        let right = answer.poses().filter(|pose| is_right(&soup, &s, &pose.reference_from_suspect));
        assert_eq!(right.count(), 1);
    }
}

#[test]
fn a_cut_symmetric_shape_has_its_true_pose_among_the_alternatives() {
    let (soup, s) = (shapes::genus(1, 8), some_similarity());
    let cut = kept(&soup, 2.0 / 3.0, &Vector3::new(0.6, 0.7, 0.2));
    let answer = found(&soup, &moved(&cut, &s));
    assert!(answer.trusted);
    assert!(answer.poses().count() >= 8);
    assert!(answer.poses().any(|pose| is_right(&soup, &s, &pose.reference_from_suspect)));
}

#[test]
fn another_shape_is_not_trusted() {
    let shapes = [
        shapes::part(3),
        shapes::bust(16),
        shapes::bumpy_sphere(2000),
        shapes::torus(40, 20, 2.0, 0.7),
        shapes::icosahedron(),
    ];
    for pair in shapes.windows(2) {
        let answer = found(&pair[0], &pair[1]);
        assert!(!answer.trusted, "{answer:?}");
    }
    let answer = affine(&shapes[0], &shapes[2]);
    assert!(!answer.trusted, "{answer:?}");
}

#[test]
fn faces_turned_inside_out_do_not_matter() {
    let (original, s) = (shapes::bust(16), some_similarity());
    let mut suspect = moved(&kept(&original, 0.6, &Vector3::new(0.6, 0.7, 0.2)), &s);
    suspect.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let answer = found(&original, &suspect);
    assert!(answer.trusted && is_right(&original, &s, &answer.best.reference_from_suspect));
}

#[test]
fn threads_do_not_matter() {
    let original = shapes::bust(14);
    let suspect = moved(&kept(&original, 0.6, &Vector3::new(0.6, 0.7, 0.2)), &some_similarity());
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (found(&original, &suspect), affine(&original, &suspect)))
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn hardly_a_surface_is_no_panic() {
    let points = vec![
        Point3::origin(),
        Point3::new(1.0, 0.0, 0.0),
        Point3::new(0.0, 1.0, 0.0),
        Point3::new(0.2, 0.1, 1e-3),
        Point3::new(1e6, 1e6, 1e6),
    ];
    let suspects = [
        Soup::new(points.clone(), vec![[0, 1, 3], [1, 2, 3]]),
        Soup::new(points.clone(), vec![[0, 1, 2], [0, 1, 4]]),
        Soup::new(points.clone(), vec![[0, 1, 3], [0, 3, 1], [0, 1, 4], [2, 2, 3]]),
        shapes::tetrahedron(),
    ];
    for original in [suspects[0].clone(), shapes::open_sheet(2, 2)] {
        let Ok(reference) = Reference::new(&original.points, &original.triangles) else { continue };
        for suspect in &suspects {
            let options = RegisterOptions::default();
            if let Ok(answer) = register(&reference, &suspect.points, &suspect.triangles, &options) {
                assert!(answer.best.score.is_finite() && answer.best.rms.is_finite());
            }
            if let Ok(answer) = register_affine(&reference, &suspect.points, &suspect.triangles, &options) {
                assert!(answer.best.reference_from_suspect.matrix().iter().all(|x| x.is_finite()));
            }
        }
    }
}
