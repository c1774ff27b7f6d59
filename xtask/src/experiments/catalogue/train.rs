//! `cargo xtask catalogue --train FILE`: which combinations of a landmark's features tell landmarks apart though they were
//! attacked, and which of their values there are.
//!
//! Linear discriminant analysis (Fisher 1936; Rao 1948): with W the covariance of a feature vector about that of the same
//! landmark before the attack and T the covariance over all landmarks, the directions are those a that make aᵀ T a / aᵀ W a
//! largest. With W = L Lᵀ they are the L⁻ᵀ u of the first eigenvectors u of L⁻¹ T L⁻ᵀ, and then attacks shake each number by
//! 1, independently. Lloyd's algorithm (1982) finds the centroids, in two halves of the numbers (product quantisation:
//! Jégou, Douze and Schmid 2011; the inverted multi-index of Babenko and Lempitsky 2012).
//!
//! All of it from generated shapes, so that nothing of anybody's models is in a program that others get.

use super::families::{MEMBERS, original};
use nalgebra::{DMatrix, DVector, Point3, SymmetricEigen};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::mesh::Soup;
use sombrero::spatial::Surface;
use sombrero_landmarks::{Cloud, NUMBERS, RUNG, SurfacePoint, area, ladder, surface_points};
use std::path::Path;

/// Numbers that are kept, in two halves.
const KEPT: usize = 16;
const HALF: usize = KEPT / 2;
/// Values of a half.
const CENTROIDS: usize = 256;
/// How a standard deviation of what attacks do is written, in units of the last bit.
const UNIT: f64 = 4.0;
/// Largest radius of a description, relative to the root of the area: half of that of `sombrero-catalogue`, with whose own radius
/// the table tells less. Attacks shake smaller balls more, so that looks are told apart more coarsely.
const LARGEST: f64 = 0.1;
/// Originals, attacked ones of each, landmarks of each.
const SHAPES: u64 = 160;
const LANDMARKS: usize = 150;
const ATTACKS: [&str; 5] = [
    "simplify:ratio=0.05",
    "noise:amplitude=0.003 simplify:ratio=0.125",
    "isosurface:resolution=64",
    "remesh:length=1.5,iterations=3",
    "ffd:strength=0.02,lattice=4",
];

/// Features before and after.
type Pair = (DVector<f64>, DVector<f64>);

pub(crate) fn run(out: &Path) -> anyhow::Result<()> {
    let pairs: Vec<Pair> = (0..SHAPES).into_par_iter().flat_map_iter(pairs).collect();
    println!("{} pairs", pairs.len());
    let mean = pairs.iter().map(|p| &p.0).sum::<DVector<f64>>() / pairs.len() as f64;
    let projection = discriminant(&pairs, &mean);
    let looks: Vec<[i8; KEPT]> = pairs.iter().map(|p| looks(&projection, &mean, &p.0)).collect();
    let mut bytes: Vec<u8> = mean.iter().flat_map(|x| (*x as f32).to_le_bytes()).collect();
    bytes.extend(
        projection
            .row_iter()
            .flat_map(|row| row.iter().copied().collect::<Vec<f64>>())
            .flat_map(|x| (x as f32).to_le_bytes()),
    );
    for half in 0..2 {
        let points: Vec<[f32; HALF]> =
            looks.iter().map(|l| std::array::from_fn(|k| f32::from(l[half * HALF + k]))).collect();
        bytes.extend(lloyd(&points).into_iter().flatten().map(|x| x.round() as i8 as u8));
    }
    Ok(std::fs::write(out, bytes)?)
}

/// One original, attacked in one way.
fn pairs(number: u64) -> Vec<Pair> {
    let soup = original((1 << 32) + number * MEMBERS);
    let mut rng = ChaCha8Rng::seed_from_u64(number);
    let Some(before) = described(&soup) else { return Vec::new() };
    let attack = ATTACKS[number as usize % ATTACKS.len()];
    let attacked = parse_list(attack)
        .map_err(anyhow::Error::from)
        .and_then(|a| Ok(apply_all(&a, &soup, &mut rng)?.soup));
    let Some((after, attacked)) = attacked.ok().and_then(|soup| Some((described(&soup)?, soup))) else {
        return Vec::new();
    };
    let surface = Surface::new(&attacked.points, &attacked.triangles);
    let step = before.0.samples().len() / LANDMARKS;
    let mut found = Vec::new();
    for sample in before.0.samples().iter().step_by(step) {
        // The ladder is as coarse as it is: the suspect's radii differ by up to half a rung, and its places a little.
        let radius = LARGEST * before.1 * RUNG.powf(rng.random_range(-0.5..0.5));
        let shift = nalgebra::Vector3::from_fn(|_, _| rng.random_range(-0.015..0.015) * before.1);
        let Some(place) = surface.closest(&Point3::from(sample.point + shift)) else { continue };
        if place.distance() > 0.04 * before.1 {
            continue;
        }
        let a = before.0.landmark(sample.point, &ladder(LARGEST * before.1, 0, 0));
        let b = after.0.landmark(place.point, &ladder(radius, 0, 0));
        let vector = |l: &sombrero_landmarks::Landmark| {
            DVector::from_iterator(NUMBERS, l.views[0].features.iter().map(|x| f64::from(*x)))
        };
        found.push((vector(&a), vector(&b)));
    }
    found
}

/// The cloud of a surface, and the root of its area.
fn described(soup: &Soup) -> Option<(Cloud, f64)> {
    let area = area(&soup.points, &soup.triangles);
    let points: Vec<SurfacePoint> = surface_points(&soup.points, &soup.triangles, 9_000);
    (points.len() > LANDMARKS).then(|| (Cloud::new(points, area), area.sqrt()))
}

/// The directions as rows, such that attacks shake each product by [`UNIT`].
fn discriminant(pairs: &[Pair], mean: &DVector<f64>) -> DMatrix<f64> {
    let mut within = DMatrix::identity(NUMBERS, NUMBERS) * 1e-5;
    let mut total = DMatrix::zeros(NUMBERS, NUMBERS);
    for (a, b) in pairs {
        let (d, c) = (b - a, a - mean);
        within += &d * d.transpose() / pairs.len() as f64;
        total += &c * c.transpose() / pairs.len() as f64;
    }
    let Some(factor) = within.cholesky() else { return DMatrix::zeros(KEPT, NUMBERS) };
    let inverse = factor.l().try_inverse().unwrap_or_else(|| DMatrix::identity(NUMBERS, NUMBERS));
    let eigen = SymmetricEigen::new(&inverse * total * inverse.transpose());
    let mut order: Vec<usize> = (0..NUMBERS).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    println!("ratios {:.1?}", order.iter().map(|k| eigen.eigenvalues[*k]).collect::<Vec<_>>());
    let mut rows = DMatrix::zeros(KEPT, NUMBERS);
    for (k, column) in order.iter().enumerate().take(KEPT) {
        // The strongest ones go to the halves in turns.
        let row = (k % 2) * HALF + k / 2;
        rows.set_row(row, &((inverse.transpose() * eigen.eigenvectors.column(*column)).transpose() * UNIT));
    }
    rows
}

fn looks(projection: &DMatrix<f64>, mean: &DVector<f64>, features: &DVector<f64>) -> [i8; KEPT] {
    let product = projection * (features - mean);
    std::array::from_fn(|k| product[k].round().clamp(-127.0, 127.0) as i8)
}

/// Centroids of the points.
fn lloyd(points: &[[f32; HALF]]) -> Vec<[f32; HALF]> {
    let mut centroids: Vec<[f32; HALF]> =
        (0..CENTROIDS).map(|k| points[k * points.len() / CENTROIDS]).collect();
    for _ in 0..30 {
        let nearest: Vec<usize> = points.par_iter().map(|p| nearest(&centroids, p)).collect();
        let mut sums = vec![([0.0f64; HALF], 0usize); CENTROIDS];
        for (point, of) in points.iter().zip(nearest) {
            let (sum, count) = &mut sums[of];
            sum.iter_mut().zip(point).for_each(|(s, x)| *s += f64::from(*x));
            *count += 1;
        }
        for (centroid, (sum, count)) in centroids.iter_mut().zip(sums) {
            if count > 0 {
                *centroid = sum.map(|s| (s / count as f64) as f32);
            }
        }
    }
    centroids
}

fn nearest(centroids: &[[f32; HALF]], p: &[f32; HALF]) -> usize {
    let distance = |c: &[f32; HALF]| c.iter().zip(p).map(|(a, b)| (a - b).powi(2)).sum::<f32>();
    let all = centroids.iter().map(distance).enumerate();
    all.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0))).map_or(0, |found| found.0)
}
