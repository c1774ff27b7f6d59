//! Extraction when the suspect has another connectivity: points of its surface against the deforming original.
//!
//! Each of many points p spread over the suspect is projected onto the original as it stands after the last solve,
//! v + B w + N β, to x with normal n. Only the component along n says something,
//!
//! ```text
//! n · (B w + N β)(x) = n · (p - x₀),    x₀ the place of x on the undeformed original,
//! ```
//!
//! so points may slide along the surface freely. Solving and projecting alternate until nothing changes. The
//! projection goes from the suspect to the original because the suspect is the noisy one: noise then is an error of
//! the observed offset, and not of the place that it belongs to.
//!
//! Left out are points whose nearest point lies on a rim of the original, that face the other way, that are much
//! further away than most (parts that the suspect has and the original has not), and by the biweight those whose
//! residual is an outlier. A suspect most of whose points face the other way is inside out, as mirror images often are, and is turned.

use crate::deformation::Deformation;
use crate::extractor::{Estimate, EstimateError, Extractor, check};
use crate::fields::Fields;
use crate::nuisance::Nuisance;
use crate::robust::{MAD_TO_DEVIATION, TUKEY, biweight, median};
use crate::system::{Observation, Solution, solve};
use nalgebra::{Point3, Vector3};
use sombrero_mesh::Soup;
use sombrero_progress::Progress;
use sombrero_spatial::{Closest, Surface, spread_samples};

/// Points on the suspect for each vertex of the original, and the least and most of them.
const SAMPLES_PER_VERTEX: usize = 2;
const SAMPLES: [usize; 2] = [10_000, 60_000];
/// The first iterations take about this many of them.
const COARSE: usize = 10_000;
/// Solves at most, on the few and on all points.
const ITERATIONS: [usize; 2] = [14, 3];
/// The same for warps, whose solves cost several times as much, and which start from the lattice's.
const WARP_ITERATIONS: [usize; 2] = [6, 2];
/// Solves after which a warp must explain something, and the share of the variance that it may leave of what a lattice leaves.
const GLIMPSE: (usize, f64) = (2, 0.25);
/// Solves at most for each simpler deformation on the way.
const APPROACH: usize = 5;
/// Converged when coefficients change by less than this (root mean square), in their standard deviations.
const STILL: [f64; 2] = [4e-3, 1e-3];
/// Points further away than this many medians belong to something else.
const FAR: f64 = 6.0;
/// Every so many points tell whether the suspect is inside out.
const LOOKS: usize = 8;
/// Normals must agree to this cosine.
const COMPATIBLE: f64 = 0.3;
/// The least scale of residuals, in largest sides.
const LEAST_SCALE: f64 = 1e-7;
/// Weight of a corner up to which a closest point lies on the edge opposite to it: samples of the suspect lie anywhere,
/// so this stands for rounding. Edges alone count: a corner of the rim on a face without such an edge does not.
const ON_RIM: f64 = 1e-9;
/// A vertex is present when the suspect is within [`FAR`] medians and this many largest sides.
const PRESENT: f64 = 1e-4;

impl Extractor {
    /// The estimate from a surface of any connectivity. `suspect` must have been brought onto the original: within about the size of the features that the mark
    /// moves, or what is left must be a deformation that `nuisance` has.
    ///
    /// # Errors
    /// [`EstimateError`] when a corner of the suspect is not usable, or it has no area.
    pub fn estimate_from_surface(
        &self,
        suspect: &Soup,
        nuisance: Nuisance,
    ) -> Result<Estimate, EstimateError> {
        check(&suspect.points, &suspect.triangles, "suspect")?;
        let count = (SAMPLES_PER_VERTEX * self.original.points.len()).clamp(SAMPLES[0], SAMPLES[1]);
        self.estimate_from(suspect, Points::new(suspect, COARSE), Points::new(suspect, count), nuisance)
    }

    /// The estimate from a point cloud, given as a small triangle about each point that faces as the surface does
    /// ([`sombrero_spatial::splats`]). It must have been brought onto the original, as a surface must.
    ///
    /// # Errors
    /// As [`estimate_from_surface`](Self::estimate_from_surface).
    pub fn estimate_from_points(&self, splats: &Soup, nuisance: Nuisance) -> Result<Estimate, EstimateError> {
        check(&splats.points, &splats.triangles, "suspect")?;
        self.estimate_from(
            splats,
            Points::of_splats(splats, COARSE),
            Points::of_splats(splats, usize::MAX),
            nuisance,
        )
    }

    /// From few points and from all, of `suspect`.
    fn estimate_from(
        &self,
        suspect: &Soup,
        mut few: Points,
        mut all: Points,
        nuisance: Nuisance,
    ) -> Result<Estimate, EstimateError> {
        if all.places.is_empty() {
            return Err(EstimateError::NoArea { which: "suspect" });
        }
        let simpler = || Deformation::ALL.into_iter().filter(|d| *d < nuisance.deformation);
        let [few_solves, all_solves] = [APPROACH * simpler().count() + ITERATIONS[0], ITERATIONS[1]];
        let mut fit = Fit::new(self, few_solves * few.places.len() + all_solves * all.places.len());
        if fit.sees_inside_out(&few) {
            [&mut few, &mut all].into_iter().for_each(Points::turn);
        }
        for deformation in simpler() {
            // What is simple first: a bend is found from a stretch, and a stretch from a turn.
            fit.fields = self.fields(Nuisance { deformation, modes: &[] });
            fit.iterate(&few, APPROACH, STILL[0]);
        }
        fit.fields = self.fields(nuisance);
        let (solution, converged) = match nuisance.deformation {
            Deformation::Warp => fit.finish_warp(&few, &all),
            _ => fit.finish(&few, &all, ITERATIONS),
        };
        let iterations = (fit.solves, converged);
        let present = self.present(suspect, &fit);
        self.give_back(fit.surface);
        let variance = fit.variance.max((LEAST_SCALE * self.side).powi(2));
        Ok(Estimate::new(&solution, &fit.weights, variance, fit.positions, present, iterations))
    }

    /// Which vertices, where they stand now, have the suspect beside them.
    fn present(&self, suspect: &Soup, fit: &Fit) -> Vec<bool> {
        let surface = Surface::new(&suspect.points, &suspect.triangles);
        let reach = FAR * fit.distance + PRESENT * self.side;
        let near = |c: Option<Closest>| c.is_some_and(|c| c.distance() <= reach);
        let closest = surface.closest_many(&fit.positions);
        closest.into_iter().zip(self.original.used()).map(|(c, used)| used && near(c)).collect()
    }
}

/// Points spread over the suspect, with the normals of their faces.
struct Points {
    places: Vec<Point3<f64>>,
    normals: Vec<Vector3<f64>>,
    /// Vertices of the suspect for each point: what one observation counts.
    weight: f64,
}

impl Points {
    fn new(suspect: &Soup, count: usize) -> Self {
        let samples = spread_samples(&suspect.points, &suspect.triangles, count);
        let normal = |face: u32| normal(&suspect.points, suspect.triangles[face as usize]);
        let places = samples.iter().filter_map(|s| s.point(&suspect.points, &suspect.triangles));
        let used = suspect.used().iter().filter(|used| **used).count();
        Self {
            places: places.collect(),
            normals: samples.iter().map(|s| normal(s.face)).collect(),
            weight: used as f64 / count as f64,
        }
    }

    /// The middles of at most so many small triangles, evenly many of all.
    fn of_splats(splats: &Soup, most: usize) -> Self {
        let stride = splats.triangles.len().div_ceil(most).max(1);
        let faces = || splats.triangles.iter().step_by(stride);
        let middle = |corners: &[u32; 3]| {
            let sum: Vector3<f64> = corners.iter().map(|&v| splats.points[v as usize].coords).sum();
            Point3::from(sum / 3.0)
        };
        Self {
            places: faces().map(middle).collect(),
            normals: faces().map(|corners| normal(&splats.points, *corners)).collect(),
            weight: stride as f64,
        }
    }

    /// Inside out.
    fn turn(&mut self) {
        self.normals.iter_mut().for_each(|n| *n = -*n);
    }
}

/// Of unit length; zero for a face without area.
fn normal(points: &[Point3<f64>], triangle: [u32; 3]) -> Vector3<f64> {
    let [a, b, c] = triangle.map(|v| points[v as usize]);
    (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
}

/// The deforming original.
struct Fit<'a> {
    extractor: &'a Extractor,
    fields: Fields<'a>,
    positions: Vec<Point3<f64>>,
    surface: Surface,
    /// Of the last solve.
    weights: Vec<f64>,
    variance: f64,
    /// Median distance between the suspect's points and the original.
    distance: f64,
    solves: usize,
    /// Points that were solved for, each as often as it was.
    reached: usize,
    progress: Progress,
}

/// A point of the suspect and the original's point nearest to it.
struct Pair {
    observation: Observation,
    /// n · (p - x).
    residual: f64,
    distance: f64,
    usable: bool,
}

impl<'a> Fit<'a> {
    fn new(extractor: &'a Extractor, most: usize) -> Self {
        Self {
            extractor,
            fields: extractor.fields(Nuisance { deformation: Deformation::Similarity, modes: &[] }),
            positions: extractor.original.points.clone(),
            surface: extractor.surface(),
            weights: Vec::new(),
            variance: 0.0,
            distance: 0.0,
            solves: 0,
            reached: 0,
            progress: Progress::new("extraction", most),
        }
    }

    /// Whether more of the points face against the original than with it, where they lie nearest.
    fn sees_inside_out(&self, points: &Points) -> bool {
        let some: Vec<Point3<f64>> = points.places.iter().step_by(LOOKS).copied().collect();
        let closest = self.surface.closest_many(&some);
        let cosine = |(c, n): (&Option<Closest>, &Vector3<f64>)| {
            let face = self.extractor.original.triangles[c.as_ref()?.face as usize];
            Some(normal(&self.positions, face).dot(n))
        };
        let cosines = closest.iter().zip(points.normals.iter().step_by(LOOKS)).filter_map(cosine);
        cosines.map(|c| f64::from(i8::from(c > COMPATIBLE) - i8::from(c < -COMPATIBLE))).sum::<f64>() < 0.0
    }

    /// On few points until nothing changes, then on all; whether both did.
    fn finish(&mut self, few: &Points, all: &Points, most: [usize; 2]) -> (Solution, bool) {
        let coarse = self.iterate(few, most[0], STILL[0]);
        let (solution, converged) = self.iterate(all, most[1], STILL[1]);
        (solution, coarse.1 && converged)
    }

    /// [`finish`](Self::finish) for a warp. One that explains next to nothing is not there, and not worth the time.
    fn finish_warp(&mut self, few: &Points, all: &Points) -> (Solution, bool) {
        let without = self.variance;
        let first = self.iterate(few, GLIMPSE.0, STILL[0]);
        if self.variance > GLIMPSE.1 * without { first } else { self.finish(few, all, WARP_ITERATIONS) }
    }

    /// Projects and solves until coefficients change by less than `still`; whether they did.
    fn iterate(&mut self, points: &Points, most: usize, still: f64) -> (Solution, bool) {
        let end = self.reached + most * points.places.len();
        let result = self.iterate_at_most(points, most, still);
        self.reach(end);
        result
    }

    fn iterate_at_most(&mut self, points: &Points, most: usize, still: f64) -> (Solution, bool) {
        let mut closest = self.surface.closest_many(&points.places);
        let mut solution = self.solve(points, &closest);
        for _ in 1..most {
            let faces: Vec<u32> = closest.iter().map(|c| c.map_or(u32::MAX, |c| c.face)).collect();
            closest = self.surface.closest_many_from(&points.places, &faces);
            let next = self.solve(points, &closest);
            let change = (&next.w - &solution.w).norm() / (next.w.len().max(1) as f64).sqrt();
            solution = next;
            if change < still {
                return (solution, true);
            }
        }
        (solution, false)
    }

    fn solve(&mut self, points: &Points, closest: &[Option<Closest>]) -> Solution {
        let extractor = self.extractor;
        let pairs: Vec<Pair> =
            (0..).zip(closest).filter_map(|(i, c)| c.map(|c| self.pair(points, i, &c))).collect();
        self.weigh(&pairs, points.weight);
        let observations: Vec<Observation> = pairs.iter().map(|p| p.observation).collect();
        let scale = (self.variance.max((LEAST_SCALE * extractor.side).powi(2)), extractor.side);
        let solution = solve(&extractor.mark_matrix, &self.fields, &observations, &self.weights, scale);
        self.positions = extractor.positions(&self.fields, &solution);
        self.surface.refit(&self.positions);
        self.fields.spread = solution.spread;
        self.solves += 1;
        self.reach(self.reached + points.places.len());
        solution
    }

    fn reach(&mut self, done: usize) {
        self.reached = done;
        self.progress.reach(done);
    }

    fn pair(&self, points: &Points, i: usize, closest: &Closest) -> Pair {
        let Extractor { original, rim, .. } = self.extractor;
        let corners = original.triangles[closest.face as usize];
        let weights = closest.barycentric;
        let direction = normal(&self.positions, corners);
        let start: Vector3<f64> =
            corners.iter().zip(weights).map(|(&v, w)| original.points[v as usize].coords * w).sum();
        let place = points.places[i];
        let agrees = points.normals[i].dot(&direction) > COMPATIBLE;
        Pair {
            observation: Observation {
                corners,
                weights,
                direction,
                offset: direction.dot(&(place.coords - start)),
            },
            residual: direction.dot(&(place - closest.point)),
            distance: closest.distance(),
            usable: agrees && !rim.holds_edge(closest, ON_RIM),
        }
    }

    /// Weights of the pairs, and the variance of their residuals.
    fn weigh(&mut self, pairs: &[Pair], each: f64) {
        let least = LEAST_SCALE * self.extractor.side;
        let of_usable =
            |value: fn(&Pair) -> f64| median(pairs.iter().filter(|p| p.usable).map(value).collect());
        self.distance = of_usable(|p| p.distance);
        let width = TUKEY * (MAD_TO_DEVIATION * of_usable(|p| p.residual.abs())).max(least);
        let reach = (FAR * self.distance).max(least);
        let weight = |p: &Pair| {
            if p.usable && p.distance < reach { each * biweight(p.residual, width) } else { 0.0 }
        };
        self.weights = pairs.iter().map(weight).collect();
        let squares: f64 = pairs.iter().zip(&self.weights).map(|(p, w)| w * p.residual * p.residual).sum();
        self.variance = squares / self.weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    }
}
