//! A simulation of printing and scanning, at a size of L millimetres. It is no measurement: nothing was printed. Figures follow
//! studies of desktop printers (deviations of 0.11 to 0.16 mm rms, most of it smooth, repeated to 0.05 mm).
//!
//! In order, with the largest side as L:
//!
//! 1. **The machine's axes**: x' = c + diag(1 + s) (x - c), s even in ±0.3 %, and a free form that moves by up to 0.15 % of L.
//! 2. **The scanner's mesh**: an isosurface of cells of 0.25 mm (coarser beyond 256 mm).
//! 3. **Layers** of t = 0.1 to 0.2 mm across a random direction a: within a layer the wall is upright, so that a point with the
//!    normal n moves along n by -(frac(a · x / t) - 1/2) t (n · a).
//! 4. **Roughness**: waves along n, with wavelengths from 1 to 4 mm and 0.05 mm rms together.
//! 5. **What is not seen**: the base, 1 % of the height along a, and round holes, 5 % of the area together.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::ffd::{FreeForm, free_form};
use crate::isosurface::isosurface;
use crate::operation::Operation;
use crate::random::random_direction;
use crate::spec::Given;
use nalgebra::{Point3, Vector3};
use rand::{Rng, RngExt};
use sombrero_mesh::{Soup, geometry};

/// Deviation of each axis at most.
const AXES: f64 = 0.003;
/// Of the free form, in largest sides.
const BEND: f64 = 0.0015;
/// Millimetres.
const CELL: f64 = 0.25;
const LAYERS: (f64, f64) = (0.1, 0.2);
const ROUGHNESS: f64 = 0.05;
const WAVELENGTHS: (f64, f64) = (1.0, 4.0);
/// Cells along the largest side at most.
const MOST_CELLS: f64 = 1024.0;
const WAVES: usize = 48;
/// Share of the height that stands on the table.
const BASE: f64 = 0.01;
/// Share of the area that is in holes.
const HOLES: f64 = 0.05;
/// Radii of holes, in largest sides.
const HOLE_RADII: (f64, f64) = (0.01, 0.04);

/// The surface as it may come back from a printer and a scanner, in the units and about the place of `soup`. Vertices are new.
///
/// # Errors
/// [`AttackError::Parameter`] unless the size is 1 to 2000 mm, and those of [`isosurface`](crate::isosurface()).
pub fn print_and_scan<R: Rng + ?Sized>(soup: &Soup, size: f64, rng: &mut R) -> Result<Soup, AttackError> {
    in_range("size", size, (1.0, 2000.0), "between 1 and 2000 mm")?;
    let machine = by_machine(soup, rng)?;
    let cells = (size / CELL).clamp(16.0, MOST_CELLS) as u32;
    let mut scan = isosurface(&machine, cells)?.soup;
    let bounds = scan.bounding_box().ok_or(AttackError::NothingLeft)?;
    let millimetre = bounds.largest_side() / size;
    let up = random_direction(rng);
    layered(&mut scan, &up, millimetre, rng);
    seen(&scan, &up, bounds.largest_side(), rng)
}

/// Axes that are a little off, and a slight bend.
fn by_machine<R: Rng + ?Sized>(soup: &Soup, rng: &mut R) -> Result<Soup, AttackError> {
    let bounds = soup.bounding_box().ok_or(AttackError::NothingLeft)?;
    let centre = nalgebra::center(&bounds.min, &bounds.max);
    let stretch = Vector3::from_fn(|_, _| 1.0 + between(rng, (-AXES, AXES)));
    let points = soup.points.iter().map(|p| centre + (p - centre).component_mul(&stretch)).collect();
    let stretched = Soup::new(points, soup.triangles.clone());
    let bent = free_form(&stretched, &FreeForm { strength: BEND, lattice: 4 }, rng)?;
    Ok(Soup::new(bent, stretched.triangles))
}

/// Layers and roughness.
fn layered<R: Rng + ?Sized>(scan: &mut Soup, up: &Vector3<f64>, millimetre: f64, rng: &mut R) {
    let layer = between(rng, LAYERS) * millimetre;
    let waves: Vec<(Vector3<f64>, f64)> = (0..WAVES)
        .map(|_| {
            let length = between(rng, WAVELENGTHS) * millimetre;
            let turns = std::f64::consts::TAU;
            (random_direction(rng) * (turns / length), turns * rng.random::<f64>())
        })
        .collect();
    // Each of n waves has the mean square 1/2.
    let height = ROUGHNESS * millimetre * (2.0 / WAVES as f64).sqrt();
    let normals = scan.vertex_normals();
    for (p, n) in scan.points.iter_mut().zip(&normals) {
        let place = up.dot(&p.coords) / layer;
        let step = (0.5 - (place - place.floor())) * layer * n.dot(up);
        let rough: f64 = waves.iter().map(|(k, phase)| libm::sin(k.dot(&p.coords) + phase)).sum();
        *p += n * (step + rough * height);
    }
}

/// Without the base and holes.
fn seen<R: Rng + ?Sized>(
    scan: &Soup,
    up: &Vector3<f64>,
    side: f64,
    rng: &mut R,
) -> Result<Soup, AttackError> {
    let middles: Vec<Point3<f64>> = scan
        .triangles
        .iter()
        .map(|t| Point3::from(t.iter().map(|&v| scan.points[v as usize].coords).sum::<Vector3<f64>>() / 3.0))
        .collect();
    let areas: Vec<f64> = scan
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| &scan.points[v as usize]);
            geometry::area_vector(a, b, c).norm()
        })
        .collect();
    let heights = || middles.iter().map(|p| up.dot(&p.coords));
    let lowest = heights().fold(f64::INFINITY, f64::min);
    let highest = heights().fold(f64::NEG_INFINITY, f64::max);
    let base = lowest + BASE * (highest - lowest);
    let mut kept: Vec<bool> = heights().map(|height| height > base).collect();
    let wanted = HOLES * areas.iter().sum::<f64>();
    let mut gone = 0.0;
    while gone < wanted {
        let centre = middles[rng.random_range(0..middles.len())];
        let radius = between(rng, HOLE_RADII) * side;
        for ((kept, middle), area) in kept.iter_mut().zip(&middles).zip(&areas) {
            if *kept && (middle - centre).norm() < radius {
                *kept = false;
                gone += area;
            }
        }
        if !kept.contains(&true) {
            return Err(AttackError::NothingLeft);
        }
    }
    let left = scan.triangles.iter().zip(kept).filter(|(_, kept)| *kept).map(|(t, _)| *t).collect();
    Ok(Soup::new(scan.points.clone(), left).compacted().0)
}

fn between<R: Rng + ?Sized>(rng: &mut R, (least, most): (f64, f64)) -> f64 {
    least + (most - least) * rng.random::<f64>()
}

/// Printed and scanned, simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Print {
    /// The largest side in millimetres, 1 to 2000.
    pub size: f64,
}

impl Operation for Print {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        Ok(Self { size: given.needed_number("size")? })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("size", self.size.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
        Ok(Attacked::anew(print_and_scan(soup, self.size, rng)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use sombrero_shapes as shapes;
    use sombrero_spatial::{DistanceOptions, compare};

    #[test]
    fn what_comes_back_is_about_as_far_off_as_printers_are() {
        let soup = shapes::bumpy_sphere(3000);
        let side = soup.bounding_box().unwrap().largest_side();
        for seed in 0..3 {
            let scan = print_and_scan(&soup, 60.0, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            let distances = compare(&scan, &soup, &DistanceOptions { samples: 5000 }).unwrap();
            let millimetres = distances.forward.rms / side * 60.0;
            assert!((0.05..0.25).contains(&millimetres), "{millimetres}");
            let area = |soup: &Soup| {
                let area = |t: &[u32; 3]| {
                    let [a, b, c] = t.map(|v| &soup.points[v as usize]);
                    geometry::area_vector(a, b, c).norm()
                };
                soup.triangles.iter().map(area).sum::<f64>()
            };
            // Holes and base take some, steps and roughness add some.
            let share = area(&scan) / area(&soup);
            assert!((0.85..1.4).contains(&share), "{share}");
        }
    }

    #[test]
    fn sizes_are_checked() {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        for size in [0.0, -5.0, 1e9, f64::NAN] {
            let answer = print_and_scan(&shapes::sphere(2), size, &mut rng);
            assert!(matches!(answer, Err(AttackError::Parameter { .. })), "{size}");
        }
        assert_eq!(print_and_scan(&Soup::default(), 50.0, &mut rng), Err(AttackError::NothingLeft));
    }
}
