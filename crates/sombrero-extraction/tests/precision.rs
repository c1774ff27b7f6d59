//! The precision of an estimate is a square, whatever was done to the suspect: its eigenvalues are not negative.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use nalgebra::{DMatrix, Matrix3, Point3, SymmetricEigen, Vector3};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sombrero_basis::{Basis, BasisOptions};
use sombrero_extraction::{Deformation, Estimate, Extractor, Modes, Nuisance};
use sombrero_mesh::{Soup, repair};
use sombrero_progressive::ProgressiveMesh;
use sombrero_shapes as shapes;

const EPSILON: f64 = 0.01;

struct Case {
    soup: Soup,
    extractor: Extractor,
}

/// A shape of many kinds, round, flat and open, at this scale and place.
fn case(kind: usize, scale: f64, away: f64) -> Case {
    let (shape, coefficients) = match kind {
        0 => (shapes::bumpy_sphere(400), 40),
        1 => (shapes::part(4), 25),
        2 => (shapes::bust(8), 60),
        3 => (shapes::open_sheet(16, 16), 30),
        _ => (plate(16), 12),
    };
    let moved = |p: &Point3<f64>| p * scale + Vector3::repeat(away * scale);
    let made = repair(&Soup::new(shape.points.iter().map(moved).collect(), shape.triangles));
    let soup = Soup::new(made.points.clone(), made.mesh.triangles());
    let progressive = ProgressiveMesh::new(made.mesh, &made.points).unwrap();
    let options = BasisOptions { coefficients, ..BasisOptions::default() };
    let basis = Basis::new(progressive, &soup.points, &options).unwrap();
    let extractor = Extractor::new(&basis, EPSILON, &soup).unwrap();
    Case { soup, extractor }
}

/// A flat sheet with a few low bumps: most of it says nothing about most deformations.
fn plate(n: usize) -> Soup {
    let mut sheet = shapes::open_sheet(n, n);
    for (i, p) in sheet.points.iter_mut().enumerate() {
        p.z = if i % 11 == 5 { 0.01 + 1e-4 * i as f64 } else { 0.0 };
    }
    sheet
}

/// Something was done to the vertices; some are gone.
fn attacked(soup: &Soup, attack: usize, strength: f64, seed: u64) -> Vec<Option<Point3<f64>>> {
    let side = soup.bounding_box().unwrap().largest_side();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut jitter = || Vector3::from_fn(|_, _| rng.random::<f64>() - 0.5) * side;
    let edge = soup.points[0].x;
    soup.points
        .iter()
        .enumerate()
        .map(|(i, p)| match attack {
            0 => Some(*p),
            1 => Some(p + jitter() * strength),
            2 => (p.x <= edge).then(|| p + jitter() * strength * 1e-3),
            3 => (i % 50 == 0).then_some(*p),
            // Outliers, most of which get no weight.
            4 => Some(if i % 3 == 0 { p + jitter() } else { *p }),
            5 => Some(Point3::new(p.x, p.y, soup.points[0].z)),
            6 => Some(Matrix3::new(1.0, strength, 0.0, 0.0, 1.0, -strength, strength, 0.0, 1.0) * p),
            _ => None,
        })
        .collect()
}

fn check(estimate: &Estimate) -> Result<(), TestCaseError> {
    let (p, m) = (&estimate.precision, estimate.coefficients.len());
    prop_assert!(p.iter().all(|x| x.is_finite()) && *p == p.transpose());
    let largest = p.amax();
    if largest > 0.0 {
        // Far below the rounding of eigenvalues, it keeps rows of zeros apart, which nalgebra does not like.
        let apart = p / largest + DMatrix::identity(m, m) * 1e-18;
        let smallest = SymmetricEigen::new(apart).eigenvalues.min();
        prop_assert!(smallest >= -1e-15 * m as f64, "{smallest:e} of the largest entry");
    }
    prop_assert!(estimate.coefficients.iter().all(|w| w.is_finite()));
    for (w, error) in estimate.coefficients.iter().zip(&estimate.standard_errors) {
        prop_assert!(error.is_infinite() || w.abs() <= 1e3, "{w} ± {error}");
    }
    Ok(())
}

fn nuisance() -> impl Strategy<Value = Nuisance> {
    let modes = prop_oneof![Just(&[][..]), Just(&[Modes::Smoothing][..])];
    (prop::sample::select(&Deformation::ALL[..]), modes)
        .prop_map(|(deformation, modes)| Nuisance { deformation, modes })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn of_vertices(
        kind in 0..5usize, attack in 0..8usize, nuisance in nuisance(), strength in -6.0..0.0f64,
        scale in -9.0..9.0f64, away in prop_oneof![Just(0.0), Just(100.0)], seed in any::<u64>(),
    ) {
        let case = case(kind, 10f64.powf(scale), away);
        let found = attacked(&case.soup, attack, 10f64.powf(strength), seed);
        check(&case.extractor.estimate_from_vertices(&found, nuisance).unwrap())?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10))]

    #[test]
    fn of_surfaces(
        kind in 0..5usize, attack in 0..7usize, nuisance in nuisance(), strength in -6.0..-1.0f64, seed in any::<u64>(),
    ) {
        let case = case(kind, 1.0, 0.0);
        let found = attacked(&case.soup, attack, 10f64.powf(strength), seed);
        let here = |t: &&[u32; 3]| t.iter().all(|&v| found[v as usize].is_some());
        let triangles: Vec<_> = case.soup.triangles.iter().filter(here).copied().collect();
        let points = found.iter().map(|p| p.unwrap_or(Point3::origin())).collect();
        if let Ok(estimate) = case.extractor.estimate_from_surface(&Soup::new(points, triangles), nuisance) {
            check(&estimate)?;
        }
    }
}
