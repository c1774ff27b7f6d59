//! What the whole must do.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero_mesh::Soup;
use sombrero_shapes as shapes;
use sombrero_spatial::Surface;

use crate::{ResampleError, ResampleOptions, Resampled, resample};

fn run(original: &Soup, suspect: &Soup) -> Resampled {
    resample(original, suspect, &ResampleOptions::default(), &mut ChaCha8Rng::seed_from_u64(7)).unwrap()
}

fn moved(soup: &Soup, by: impl Fn(&Point3<f64>) -> Vector3<f64>) -> Soup {
    Soup::new(soup.points.iter().map(|p| p + by(p)).collect(), soup.triangles.clone())
}

/// A smooth push along the normal of a sphere about the origin, 1 % of its diameter.
fn push(p: &Point3<f64>) -> Vector3<f64> {
    p.coords.normalize() * (0.02 * (2.0 * p.x + 1.0).sin() * (1.5 * p.y).cos())
}

/// Vertices backwards, and faces with them.
fn reordered(soup: &Soup) -> Soup {
    let last = soup.points.len() as u32 - 1;
    let points = soup.points.iter().rev().copied().collect();
    Soup::new(points, soup.triangles.iter().rev().map(|&[a, b, c]| [last - b, last - c, last - a]).collect())
}

/// Each face cut into three at its centroid.
fn subdivided(soup: &Soup) -> Soup {
    let mut points = soup.points.clone();
    let mut triangles = Vec::new();
    for &[a, b, c] in &soup.triangles {
        let [p, q, r] = [a, b, c].map(|v| soup.points[v as usize].coords);
        let centre = points.len() as u32;
        points.push(((p + q + r) / 3.0).into());
        triangles.extend([[a, b, centre], [b, c, centre], [c, a, centre]]);
    }
    Soup::new(points, triangles)
}

/// Faces whose corners all satisfy `keep`; vertices stay.
fn cropped(soup: &Soup, keep: impl Fn(&Point3<f64>) -> bool) -> Soup {
    let kept = |t: &&[u32; 3]| t.iter().all(|&v| keep(&soup.points[v as usize]));
    Soup::new(soup.points.clone(), soup.triangles.iter().filter(kept).copied().collect())
}

fn turned_faces(original: &Soup, positions: &[Option<Point3<f64>>]) -> usize {
    let normal = |p: [Point3<f64>; 3]| (p[1] - p[0]).cross(&(p[2] - p[0]));
    let turned = |t: &&[u32; 3]| {
        let before = normal(t.map(|v| original.points[v as usize]));
        let [Some(a), Some(b), Some(c)] = t.map(|v| positions[v as usize]) else { return false };
        normal([a, b, c]).dot(&before) < 0.0
    };
    original.triangles.iter().filter(turned).count()
}

/// Largest distance of a fitted vertex from the suspect.
fn farthest(found: &Resampled, suspect: &Soup) -> f64 {
    let surface = Surface::new(&suspect.points, &suspect.triangles);
    let distance = |p: &Point3<f64>| surface.closest(p).unwrap().distance();
    found.positions.iter().flatten().map(distance).fold(0.0, f64::max)
}

#[test]
fn the_original_itself_stays() {
    for soup in [shapes::bumpy_sphere(1000), shapes::part(4), shapes::bust(8), shapes::open_sheet(20, 20)] {
        let found = run(&soup, &soup);
        for (found, p) in found.positions.iter().zip(&soup.points) {
            assert!((found.unwrap() - p).norm() < 1e-6, "{found:?} {p:?}");
        }
        assert!(found.converged && found.attached > 0.999);
    }
}

#[test]
fn a_pushed_surface_is_found_whatever_its_connectivity() {
    let original = shapes::bumpy_sphere(2500);
    let largest = original.points.iter().map(|p| push(p).norm()).fold(0.0, f64::max);
    // The last is the same surface with two fifths of the vertices.
    for (suspect, far, off) in [
        (original.clone(), 0.1, 0.05),
        (reordered(&original), 0.1, 0.05),
        (subdivided(&original), 0.1, 0.05),
        (shapes::bumpy_sphere(1000), 0.6, 0.2),
    ] {
        let pushed = moved(&suspect, push);
        let (before, found) = (run(&original, &suspect), run(&original, &pushed));
        assert!(found.positions.iter().all(Option::is_some));
        assert!(farthest(&found, &pushed) < far * largest, "{} {largest}", farthest(&found, &pushed));
        assert_eq!(turned_faces(&original, &found.positions), 0);
        let (mut error, mut size) = (0.0, 0.0);
        for ((found, before), p) in found.positions.iter().zip(&before.positions).zip(&original.points) {
            let outwards = (found.unwrap() - before.unwrap()).dot(&p.coords.normalize());
            error += (outwards - push(p).dot(&p.coords.normalize())).powi(2);
            size += push(p).norm_squared();
        }
        assert!(error < off * off * size, "{}", (error / size).sqrt());
    }
}

#[test]
fn what_was_cropped_is_missing() {
    let closed = shapes::bumpy_sphere(2500);
    let open = shapes::open_sheet(40, 40);
    for original in [closed, open] {
        let bounds = original.bounding_box().unwrap();
        let cut = bounds.max.x - bounds.sides().x / 3.0;
        let suspect = reordered(&cropped(&moved(&original, |p| push(p) * 0.3), |p| p.x < cut));
        let found = run(&original, &suspect);
        // One edge to either side of the cut may go either way.
        let edge = 1.5 * bounds.largest_side() / 25.0;
        for (found, p) in found.positions.iter().zip(&original.points) {
            if p.x < cut - edge {
                assert!(found.is_some(), "{p:?}");
            }
            if p.x > cut + edge {
                assert!(found.is_none(), "{p:?}");
            }
            assert!(found.is_none_or(|f| (f - p).norm() < 0.05), "{found:?} {p:?}");
        }
        assert_eq!(turned_faces(&original, &found.positions), 0);
    }
}

#[test]
fn a_part_that_is_gone_is_missing_though_another_is_near() {
    // Two balls in a row, nearly touching: only the first is left.
    let ball = shapes::sphere(3);
    let (count, mut both) = (ball.points.len() as u32, ball.clone());
    both.points.extend(ball.points.iter().map(|p| p + Vector3::x() * 2.01));
    both.triangles.extend(ball.triangles.iter().map(|t| t.map(|v| v + count)));
    let found = run(&both, &ball);
    assert!(found.positions[..count as usize].iter().all(Option::is_some));
    assert!(found.positions[count as usize..].iter().all(Option::is_none));
}

#[test]
fn vertices_without_a_face_are_missing_whatever_they_are() {
    let mut original = shapes::sphere(2);
    let suspect = original.clone();
    original.points.insert(0, Point3::new(f64::NAN, 0.0, f64::INFINITY));
    original.triangles.iter_mut().flatten().for_each(|v| *v += 1);
    original.points.push(Point3::new(9e9, 0.0, 0.0));
    let found = run(&original, &suspect);
    assert_eq!((found.positions[0], found.positions[found.positions.len() - 1]), (None, None));
    let stays = |(f, p): (&Option<Point3<f64>>, &Point3<f64>)| (f.unwrap() - p).norm() < 1e-6;
    assert!(found.positions[1..].iter().zip(&suspect.points).all(stays));
}

#[test]
fn threads_do_not_matter() {
    let original = shapes::bumpy_sphere(1500);
    let suspect = subdivided(&moved(&original, push));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&original, &suspect))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn units_do_not_matter() {
    let original = shapes::bumpy_sphere(500);
    let suspect = subdivided(&moved(&original, push));
    let at = |scale: f64| {
        let scaled = |soup: &Soup| moved(soup, |p| p.coords * (scale - 1.0));
        run(&scaled(&original), &scaled(&suspect))
    };
    let one = at(1.0);
    for scale in [1e-3, 1e6] {
        for (a, b) in one.positions.iter().zip(&at(scale).positions) {
            assert!((a.unwrap().coords - b.unwrap().coords / scale).norm() < 1e-4);
        }
    }
}

#[test]
fn senseless_questions_are_refused() {
    let ball = shapes::sphere(1);
    let ask = |a: &Soup, b: &Soup, o: &ResampleOptions| {
        resample(a, b, o, &mut ChaCha8Rng::seed_from_u64(0)).map(|_| ())
    };
    let default = ResampleOptions::default();
    let empty = Soup::default();
    let point = Soup::new(vec![Point3::origin(); 3], vec![[0, 1, 2], [0, 0, 7]]);
    let line = Soup::new((0..3).map(|i| Point3::new(f64::from(i), 0.0, 0.0)).collect(), vec![[0, 1, 2]]);
    for bad in [&empty, &point, &line] {
        assert_eq!(ask(bad, &ball, &default), Err(ResampleError::NoFaces { which: "original" }));
        assert_eq!(ask(&ball, bad, &default), Err(ResampleError::NoFaces { which: "suspect" }));
    }
    let mut broken = ball.clone();
    broken.points[3].y = f64::NAN;
    assert_eq!(ask(&ball, &broken, &default), Err(ResampleError::NotFinite { which: "suspect", vertex: 3 }));
    assert_eq!(ask(&broken, &ball, &default), Err(ResampleError::NotFinite { which: "original", vertex: 3 }));
    let options = ResampleOptions { deform_weight: f64::NAN, ..default };
    assert!(matches!(ask(&ball, &ball, &options), Err(ResampleError::Option { name: "deform_weight", .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_suspect_has_a_finite_answer(
        points in prop::collection::vec([-2.0..2.0f64, -2.0..2.0f64, -2.0..2.0f64], 3..12),
        picks in prop::collection::vec([0..14u32, 0..14u32, 0..14u32], 1..20),
        exponent in -12..9
    ) {
        let scale = 10f64.powi(exponent);
        let points = points.into_iter().map(|[x, y, z]| Point3::new(x * scale, y * scale, z * scale)).collect();
        let mess = Soup::new(points, picks);
        for (a, b) in [(&shapes::sphere(1), &mess), (&mess, &shapes::sphere(1)), (&mess, &mess)] {
            let answer = resample(a, b, &ResampleOptions::default(), &mut ChaCha8Rng::seed_from_u64(3));
            let Ok(found) = answer else { continue };
            prop_assert_eq!(found.positions.len(), a.points.len());
            prop_assert!(found.rms.is_finite() && found.energy.total().is_finite());
            prop_assert!(found.positions.iter().flatten().all(|p| p.iter().all(|x| x.is_finite())));
        }
    }
}
