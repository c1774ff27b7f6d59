//! MSDM2: how different two meshes look (Lavoué 2011, A multiscale metric for 3D mesh visual quality assessment).
//!
//! At three scales curvatures are compared in windows about each vertex, whose means m, deviations s and covariance s₁₂ are
//! weighted by a Gaussian of half the window's radius. The constants of the paper, 1 each, keep the ratios finite:
//!
//! ```text
//! L = |m₁ - m₂| / (max(m₁, m₂) + 1),   C = |s₁ - s₂| / (max(s₁, s₂) + 1),   S = |s₁ s₂ - s₁₂| / (s₁ s₂ + 1),
//! local = mean over scales of (L + C + S/2) / 2.5,   MSDM2 = (mean over vertices of local³)^⅓.
//! ```
//!
//! Curvatures are over the largest side of the bounding box, in balls of 0.002, 0.003 and 0.004 of it; windows are five times
//! as wide (as in the authors' own program, MEPP). Windows lie on one mesh, and on the other are what its vertices became:
//! where connectivity is the same no projection is needed. The result is the mean of both ways.
//!
//! Windows of a fixed size hold more and more vertices of finer and finer meshes. From 100,000 vertices on as many stand for
//! all, so that the cost does not grow with the square; and the mean is over 10,000 of the windows where there are more.

use crate::Change;
use crate::curvature::Bent;
use crate::evenly::evenly;
use crate::net::{Net, Piece, Walker, thinned};
use nalgebra::Point3;
use rayon::prelude::*;
use sombrero_mesh::Edges;

/// Radii of the balls in which curvature is taken, over the largest side.
const SCALES: [f64; 3] = [0.002, 0.003, 0.004];
/// Radius of a window over that of its balls.
const WINDOW: f64 = 5.0;
/// Vertices in whose curvature windows look at most.
const MOST_SITES: usize = 100_000;
/// Windows at most.
const MOST_WINDOWS: usize = 10_000;
/// Vertices that one task looks at.
const CHUNK: usize = 512;

/// MSDM2 between the meshes before and after: 0 for none to 1 for every difference; 0 without triangles. Exact up to 10,000
/// vertices, within some hundredths beyond. O(n log n).
pub fn msdm2(change: &Change<'_>) -> f64 {
    within(change, MOST_SITES, MOST_WINDOWS)
}

fn within(change: &Change<'_>, most: usize, windows: usize) -> f64 {
    let side = change.bounds.largest_side();
    let edges = Edges::new(change.vertices(), &change.triangles);
    let net = Net::new(change.vertices(), &edges.ends);
    let (sites, graph) = thinned(&net, &edges, most);
    if sites.is_empty() || side <= 0.0 {
        return 0.0;
    }
    let bent = [0, 1].map(|k| Bent::new(change, k, &edges));
    let points = change.sides().map(|points| sites.iter().map(|&v| points[v as usize]).collect::<Vec<_>>());
    let centres: Vec<u32> = evenly(sites.len(), windows).map(|i| i as u32).collect();
    let mut local = vec![[0.0; 2]; centres.len()];
    for scale in SCALES {
        let curved = bent.each_ref().map(|b| {
            let curvatures = b.curvatures(&net, &sites, scale * side);
            curvatures.into_iter().map(|k| k * side).collect::<Vec<f64>>()
        });
        for way in [0, 1] {
            let windows =
                Windows { graph: &graph, points: &points[way], curved: [&curved[way], &curved[1 - way]] };
            let values = windows.compared(&centres, WINDOW * scale * side);
            local.iter_mut().zip(values).for_each(|(sum, value)| sum[way] += value / SCALES.len() as f64);
        }
    }
    let pooled = |way: usize| {
        let cubes = local.iter().map(|values| values[way] * values[way] * values[way]);
        libm::cbrt(cubes.sum::<f64>() / local.len() as f64)
    };
    (pooled(0) + pooled(1)) / 2.0
}

/// Windows on one mesh, in which the curvatures of both are compared.
struct Windows<'a> {
    graph: &'a Net,
    points: &'a [Point3<f64>],
    curved: [&'a [f64]; 2],
}

impl Windows<'_> {
    /// The local difference at each of `centres`.
    fn compared(&self, centres: &[u32], radius: f64) -> Vec<f64> {
        let start = || (Walker::new(self.graph), Vec::new());
        let centres = centres.par_iter().with_min_len(CHUNK);
        centres.map_init(start, |(walker, seen), v| self.local(walker, seen, *v, radius)).collect()
    }

    fn local(&self, walker: &mut Walker<'_>, seen: &mut Vec<Seen>, centre: u32, radius: f64) -> f64 {
        seen.clear();
        let middle = self.points[centre as usize];
        let weight = |p: &Point3<f64>| libm::exp(-2.0 * (p - middle).norm_squared() / (radius * radius));
        walker.ball(
            |v| self.points[v as usize],
            centre,
            radius,
            |Piece { from, to, share, .. }| {
                if share < 1.0 {
                    let between = |a: f64, b: f64| a + share * (b - a);
                    let [from, to] = [from, to].map(|v| v as usize);
                    let curved = self.curved.map(|k| between(k[from], k[to]));
                    let point = self.points[from] + (self.points[to] - self.points[from]) * share;
                    seen.push(Seen { weight: weight(&point), curved });
                }
            },
        );
        seen.extend(walker.inside.iter().map(|&v| {
            let curved = self.curved.map(|k| k[v as usize]);
            Seen { weight: weight(&self.points[v as usize]), curved }
        }));
        difference(seen)
    }
}

/// A point of a window.
struct Seen {
    weight: f64,
    /// On the mesh of the window, and on the other.
    curved: [f64; 2],
}

/// (L + C + S/2) / 2.5 of a window.
fn difference(seen: &[Seen]) -> f64 {
    let total: f64 = seen.iter().map(|s| s.weight).sum();
    let mean = |k: usize| seen.iter().map(|s| s.weight * s.curved[k]).sum::<f64>() / total;
    let m = [mean(0), mean(1)];
    let product = |k: usize, l: usize| {
        let terms = seen.iter().map(|s| s.weight * (s.curved[k] - m[k]) * (s.curved[l] - m[l]));
        terms.sum::<f64>() / total
    };
    let s = [product(0, 0).sqrt(), product(1, 1).sqrt()];
    let luminance = (m[0] - m[1]).abs() / (m[0].max(m[1]) + 1.0);
    let contrast = (s[0] - s[1]).abs() / (s[0].max(s[1]) + 1.0);
    // The root of the product, not the product of the roots: exactly the covariance where both meshes are one.
    let both = (product(0, 0) * product(1, 1)).sqrt();
    let structure = (both - product(0, 1)).abs() / (both + 1.0);
    (luminance + contrast + structure / 2.0) / 2.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};
    use sombrero_shapes as shapes;

    /// A regular displacement of the given size, as noise is.
    fn rough(points: &[Point3<f64>], size: f64) -> Vec<Point3<f64>> {
        let wobble = |k: usize, step: f64| (k as f64 * step).fract() - 0.5;
        let shift = |k| Vector3::new(wobble(k, 0.754_87), wobble(k, 0.569_84), wobble(k, 0.430_16));
        points.iter().enumerate().map(|(k, p)| p + shift(k) * size).collect()
    }

    #[test]
    fn a_window_by_hand() {
        let seen = |weight, a, b| Seen { weight, curved: [a, b] };
        // Means 2 and 3, deviations 1 and 1, covariance -1.
        let window = [seen(1.0, 1.0, 4.0), seen(1.0, 3.0, 2.0)];
        assert!((difference(&window) - (0.25 + 0.0 + 1.0 / 2.0) / 2.5).abs() < 1e-15);
        // Weights 1 and 3: means 2.5 and 2, deviations √0.75 and 0.
        let window = [seen(1.0, 1.0, 2.0), seen(3.0, 3.0, 2.0)];
        let contrast = 0.75_f64.sqrt() / (0.75_f64.sqrt() + 1.0);
        assert!((difference(&window) - (0.5 / 3.5 + contrast) / 2.5).abs() < 1e-15);
    }

    #[test]
    fn grows_with_noise_from_nothing() {
        let ball = shapes::bumpy_sphere(3000);
        let of = |after: &[Point3<f64>]| msdm2(&Change::new(&ball.points, after, &ball.triangles));
        assert_eq!(of(&ball.points), 0.0);
        let grown: Vec<f64> = [1e-4, 1e-3, 1e-2].iter().map(|size| of(&rough(&ball.points, *size))).collect();
        assert!(grown.is_sorted() && grown[0] > 0.0 && grown[2] < 1.0, "{grown:?}");
        assert_eq!(msdm2(&Change::new(&[], &[], &[])), 0.0);
    }

    #[test]
    fn both_ways_and_in_any_place_alike() {
        let ball = shapes::bumpy_sphere(3000);
        let noisy = rough(&ball.points, 2e-3);
        let there = msdm2(&Change::new(&ball.points, &noisy, &ball.triangles));
        let back = msdm2(&Change::new(&noisy, &ball.points, &ball.triangles));
        assert!((there - back).abs() < 2e-3 * there, "{there} {back}");
        let turn = Rotation3::from_euler_angles(0.3, -1.0, 2.0);
        let moved = |points: &[Point3<f64>]| points.iter().map(|p| turn * p * 7.0).collect::<Vec<_>>();
        let (before, after) = (moved(&ball.points), moved(&noisy));
        // The largest side depends on the pose, so scales do too.
        let elsewhere = msdm2(&Change::new(&before, &after, &ball.triangles));
        assert!((there - elsewhere).abs() < 0.2 * there, "{there} {elsewhere}");
    }

    #[test]
    fn some_vertices_stand_for_all() {
        // A small ball whose windows hold a hundred vertices and more, as those of dense meshes do: a stray triangle far
        // away makes the box large.
        let ball = shapes::bumpy_sphere(10_000);
        let mut points: Vec<Point3<f64>> = ball.points.iter().map(|p| p * 0.1).collect();
        // A smooth displacement, as marks are: fewer vertices see more of the mean of white noise.
        let wave = |p: &Point3<f64>| {
            Vector3::new(libm::sin(90.0 * p.y), libm::sin(80.0 * p.z), libm::sin(100.0 * p.x))
        };
        let mut after: Vec<Point3<f64>> = points.iter().map(|p| p + wave(p) * 1e-3).collect();
        let far = [[4.0, 0.0, 0.0], [4.0, 1e-6, 0.0], [4.0, 0.0, 1e-6]].map(Point3::from);
        points.extend(far);
        after.extend(far);
        let stray = [0, 1, 2].map(|k| (ball.points.len() + k) as u32);
        let triangles = [ball.triangles, vec![stray]].concat();
        let change = Change::new(&points, &after, &triangles);
        let all = within(&change, 20_000, 20_000);
        for some in [within(&change, 2_500, 2_500), within(&change, 20_000, 2_500)] {
            assert!((all - some).abs() < 0.05 * all, "{all} {some}");
        }
    }
}
