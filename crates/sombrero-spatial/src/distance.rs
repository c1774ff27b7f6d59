//! How far two surfaces are from each other.
//!
//! With d(p, S) the distance from p to the closest point of S, from A to B
//!
//! ```text
//! max = max over p in A of d(p, B),   mean = 1/|A| ∫ d(p, B) dA,   rms² = 1/|A| ∫ d(p, B)² dA.
//! ```
//!
//! The Hausdorff distance is the larger of the two maxima; two-sided mean and mean square weight the two
//! sides by their areas. As in Metro (Cignoni, Rocchini, Scopigno 1998) integrals are sums over samples
//! of equal area, and the maximum runs over samples and vertices: a lower bound that grows to the truth
//! with the number of samples. The samples are spread without chance: the k-th of N lies at (k + ½) / N
//! of the running sum of areas, and its place on the face is the k-th term of the plane sequence of the
//! plastic number ρ (Roberts 2018), folded into the triangle:
//!
//! ```text
//! (u, v) = (½ + k / ρ, ½ + k / ρ²) mod 1,   ρ³ = ρ + 1.
//! ```

use nalgebra::Point3;
use sombrero_mesh::Soup;

use crate::limits::{corners, usable};
use crate::sample::RunningAreas;
use crate::spread::spread_with;
use crate::surface::Surface;

/// 1 / ρ and 1 / ρ² for the plastic number ρ. The second is one unit in the last place above that of
/// [`spread_samples`](crate::spread_samples), and places are rounded otherwise: recorded distances stay what they are,
/// to the bit.
const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3];

/// How [`compare`] samples.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DistanceOptions {
    /// Points spread over each surface, besides its vertices. Default 200,000.
    pub samples: usize,
}

impl Default for DistanceOptions {
    fn default() -> Self {
        Self { samples: 200_000 }
    }
}

/// Distances from one surface to the other, in model units.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct OneSided {
    /// Largest distance of a vertex or sample.
    pub max: f64,
    /// Mean distance by area (over the vertices when there is no area or no sample).
    pub mean: f64,
    /// Root mean square distance, by area like the mean.
    pub rms: f64,
}

/// Distances between two surfaces, in model units.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Distances {
    /// Hausdorff distance, the larger of the two maxima.
    pub hausdorff: f64,
    /// Mean distance over both surfaces, by area.
    pub mean: f64,
    /// Root mean square distance over both surfaces, by area.
    pub rms: f64,
    /// Distances from the first surface to the second.
    pub forward: OneSided,
    /// Distances from the second surface to the first.
    pub backward: OneSided,
}

/// Compares two surfaces; `None` when one of them has no usable face.
///
/// Only vertices that usable faces have count. Deterministic, in parallel.
pub fn compare(a: &Soup, b: &Soup, options: &DistanceOptions) -> Option<Distances> {
    let (on_a, on_b) = (Samples::new(a, options), Samples::new(b, options));
    let forward = on_a.distances_to(b)?;
    let backward = on_b.distances_to(a)?;
    let total = on_a.area + on_b.area;
    let share = if total > 0.0 { on_a.area / total } else { 0.5 };
    let blend = |of_a: f64, of_b: f64| share * of_a + (1.0 - share) * of_b;
    Some(Distances {
        hausdorff: forward.max.max(backward.max),
        mean: blend(forward.mean, backward.mean),
        rms: blend(forward.rms * forward.rms, backward.rms * backward.rms).sqrt(),
        forward,
        backward,
    })
}

/// Points that stand for a surface.
struct Samples {
    vertices: Vec<Point3<f64>>,
    /// Each stands for the same area.
    spread: Vec<Point3<f64>>,
    area: f64,
}

impl Samples {
    fn new(soup: &Soup, options: &DistanceOptions) -> Self {
        let areas = RunningAreas::new(&soup.points, &soup.triangles);
        let area = areas.total();
        let place = |k: usize| (k as f64 + 0.5) / options.samples as f64 * area;
        let samples = spread_with(&areas, options.samples, STEPS, place);
        let spread = samples.iter().filter_map(|s| s.point(&soup.points, &soup.triangles));
        Self { vertices: vertices(soup), spread: spread.collect(), area }
    }

    fn distances_to(&self, soup: &Soup) -> Option<OneSided> {
        let surface = Surface::new(&soup.points, &soup.triangles);
        let distances = |points: &[Point3<f64>]| -> Option<Vec<f64>> {
            surface.closest_many(points).iter().map(|c| c.map(|c| c.distance())).collect()
        };
        let (at_vertices, at_spread) = (distances(&self.vertices)?, distances(&self.spread)?);
        let max = at_vertices.iter().chain(&at_spread).copied().fold(0.0, f64::max);
        let weighted = if at_spread.is_empty() { &at_vertices } else { &at_spread };
        if weighted.is_empty() {
            return None;
        }
        // Sums run in the order of samples, whatever the threads did.
        let count = weighted.len() as f64;
        let mean = weighted.iter().sum::<f64>() / count;
        let rms = (weighted.iter().map(|d| d * d).sum::<f64>() / count).sqrt();
        Some(OneSided { max, mean, rms })
    }
}

/// The corners of usable faces, each once.
fn vertices(soup: &Soup) -> Vec<Point3<f64>> {
    let mut used = vec![false; soup.points.len()];
    for &triangle in &soup.triangles {
        if corners(&soup.points, triangle).is_some() {
            for corner in triangle {
                used[corner as usize] = true;
            }
        }
    }
    soup.points.iter().zip(used).filter(|(p, used)| *used && usable(p)).map(|(p, _)| *p).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn plate(sides: Vector3<f64>, lift: f64) -> Soup {
        let corner = |x: f64, y: f64| Point3::new(x * sides.x, y * sides.y, lift);
        Soup::new(
            vec![corner(0., 0.), corner(1., 0.), corner(1., 1.), corner(0., 1.), Point3::new(99., 99., 99.)],
            vec![[0, 1, 2], [0, 2, 3]],
        )
    }

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-12 * (1.0 + b.abs())
    }

    #[test]
    fn a_lifted_plate_is_that_far_everywhere() {
        let sides = Vector3::new(2.0, 1.0, 0.0);
        let d = compare(&plate(sides, 0.0), &plate(sides, 0.25), &DistanceOptions { samples: 1000 }).unwrap();
        let all = [d.hausdorff, d.mean, d.rms, d.forward.max, d.forward.mean, d.backward.rms];
        assert!(all.into_iter().all(|x| near(x, 0.25)), "{d:?}");
    }

    #[test]
    fn a_plate_beside_a_longer_one() {
        // The longer plate overhangs by 1: distances on its outer half run evenly from 0 to 1.
        let (short, long) = (plate(Vector3::new(1., 1., 0.), 0.0), plate(Vector3::new(2., 1., 0.), 0.0));
        let d = compare(&long, &short, &DistanceOptions { samples: 100_000 }).unwrap();
        assert!(near(d.hausdorff, 1.0) && near(d.backward.max, 0.0), "{d:?}");
        assert!((d.forward.mean - 0.25).abs() < 1e-4, "{d:?}");
        assert!((d.forward.rms - (1.0f64 / 6.0).sqrt()).abs() < 1e-4, "{d:?}");
        assert!((d.mean - 0.25 * 2.0 / 3.0).abs() < 1e-4, "{d:?}");
        assert!((d.rms - (1.0f64 / 9.0).sqrt()).abs() < 1e-4, "{d:?}");
        let back = compare(&short, &long, &DistanceOptions { samples: 100_000 }).unwrap();
        assert_eq!((back.forward, back.backward), (d.backward, d.forward));
    }

    #[test]
    fn no_distance_to_oneself() {
        let soup = Soup::new(
            (0..40u32)
                .map(|k| Point3::from([0.754, 0.569, 0.331].map(|s| (f64::from(k) * s).fract())))
                .collect(),
            (0..38).map(|k| [k, k + 1, k + 2]).collect(),
        );
        let d = compare(&soup, &soup, &DistanceOptions { samples: 5000 }).unwrap();
        assert!(d.hausdorff < 1e-15, "{d:?}");
    }

    #[test]
    fn sides_without_faces_have_no_distance() {
        let (options, full) = (DistanceOptions::default(), plate(Vector3::new(1., 1., 0.), 0.0));
        let bad = Soup::new(vec![Point3::new(f64::NAN, 0., 0.)], vec![[0, 0, 0], [1, 2, 3]]);
        for empty in [Soup::default(), bad] {
            assert_eq!(compare(&full, &empty, &options), None);
            assert_eq!(compare(&empty, &full, &options), None);
        }
    }

    #[test]
    fn without_area_or_samples_the_vertices_count() {
        let full = plate(Vector3::new(1., 1., 0.), 0.0);
        let segment = Soup::new(vec![Point3::new(0., 0., 1.), Point3::new(0., 0., 3.)], vec![[0, 1, 1]]);
        let d = compare(&segment, &full, &DistanceOptions { samples: 100 }).unwrap();
        assert!(near(d.forward.mean, 2.0) && near(d.forward.max, 3.0), "{d:?}");
        let none = compare(&full, &full, &DistanceOptions { samples: 0 }).unwrap();
        assert_eq!(none.hausdorff, 0.0);
    }
}
