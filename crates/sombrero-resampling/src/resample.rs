//! The rounds: project the samples, minimise the energy, until nothing moves; then see what is missing.
//!
//! ```text
//! v* ← v;   repeat: attach each sample to its projection on v*;   v* ← argmin E(v*) from there.
//! ```
//!
//! Positions go in and come out in model units; in between the unit is the original's largest side, so that
//! the weights mean the same for every model (see [`ResampleOptions`]).

use nalgebra::{Point3, Vector3};
use rand::Rng;
use sombrero_mesh::Soup;
use sombrero_progress::Progress;

use crate::energy::{Energy, EnergyTerms};
use crate::error::ResampleError;
use crate::frame::{Frame, usable_faces};
use crate::minimise::minimise;
use crate::missing::{Evidence, present};
use crate::options::ResampleOptions;
use crate::projection::Projection;

/// The original's vertices on the suspect.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Resampled {
    /// Positions on the suspect, one a vertex of the original, in model units; `None` without a counterpart.
    pub positions: Vec<Option<Point3<f64>>>,
    /// Root mean square distance of the attached samples from the fitted original, in model units; 0 when
    /// none is attached.
    pub rms: f64,
    /// Share of the samples that have a place on the original, from 0 to 1.
    pub attached: f64,
    /// Rounds of projection and minimisation.
    pub rounds: usize,
    /// Iterations of conjugate gradient, all rounds together.
    pub iterations: usize,
    /// Whether the last round moved no vertex beyond the tolerance.
    pub converged: bool,
    /// The energy at the end.
    pub energy: EnergyTerms,
}

/// Finds each vertex of `original` on `suspect`, which stands in the original's frame.
///
/// The connectivity of the suspect does not matter, and it may be a part of the original only. Faces with
/// an index out of range or with two equal corners are left out on both sides. The answer depends on the
/// numbers that `rng` gives and not on the number of threads.
///
/// # Errors
/// [`ResampleError`] when one of the meshes has no usable face or a vertex that is not finite, or when an
/// option is out of range. A suspect that has nothing to do with the original is no error: its vertices
/// come out missing, or wherever the fit led them.
pub fn resample<R: Rng + ?Sized>(
    original: &Soup,
    suspect: &Soup,
    options: &ResampleOptions,
    rng: &mut R,
) -> Result<Resampled, ResampleError> {
    options.check()?;
    let frame = Frame::new(original)?;
    let relative = suspect.points.iter().map(|p| Point3::from(frame.relative(p))).collect();
    let relative = Soup::new(relative, suspect.triangles.clone());
    let suspect = Soup { triangles: usable_faces(&relative, "suspect")?, ..relative };
    let mut fit = Fit::new(&frame, &suspect, options, rng)?;
    let effort = fit.run();
    Ok(fit.result(effort))
}

/// The original on its way to the suspect.
struct Fit<'a> {
    frame: &'a Frame,
    suspect: &'a Soup,
    options: &'a ResampleOptions,
    projection: Projection,
    points: Vec<Vector3<f64>>,
}

/// What it took.
#[derive(Debug, Clone, Copy, Default)]
struct Effort {
    rounds: usize,
    iterations: usize,
    converged: bool,
}

/// The energy with the present projections, and the state of the samples.
struct Round<'a> {
    energy: Energy<'a>,
    attached: usize,
    rms: f64,
}

impl<'a> Fit<'a> {
    fn new<R: Rng + ?Sized>(
        frame: &'a Frame,
        suspect: &'a Soup,
        options: &'a ResampleOptions,
        rng: &mut R,
    ) -> Result<Self, ResampleError> {
        let vertices = (0..frame.points.len()).filter(|&v| frame.is_used(v)).count();
        let samples = (options.samples_per_vertex * vertices as f64).ceil() as usize;
        let projection = Projection::new(frame, suspect, samples, rng);
        if projection.count() == 0 {
            return Err(ResampleError::NoFaces { which: "suspect" });
        }
        Ok(Self { frame, suspect, options, projection, points: frame.points.clone() })
    }

    fn run(&mut self) -> Effort {
        let mut effort = Effort::default();
        // Rounds may have fewer iterations than they are allowed.
        let each = self.options.iterations;
        let progress = Progress::new("resampling", self.options.rounds * each);
        while effort.rounds < self.options.rounds && !effort.converged {
            let round = self.project();
            let before = self.points.clone();
            let say = |iteration| progress.reach(effort.rounds * each + iteration);
            effort.iterations += minimise(&round.energy, &mut self.points, each, say);
            let moved = before.iter().zip(&self.points).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            effort.converged = moved <= self.options.tolerance;
            effort.rounds += 1;
        }
        effort
    }

    fn project(&mut self) -> Round<'a> {
        let attached = self.projection.attach(self.frame, &self.points, self.options.max_distance);
        let energy = Energy {
            frame: self.frame,
            attachments: attached.attachments,
            resistance: self.options.sliding_resistance,
            deform_weight: self.options.deform_weight,
            flip_weight: self.options.flip_weight,
        };
        let rms = (attached.squared / attached.count.max(1) as f64).sqrt();
        Round { energy, attached: attached.count, rms }
    }

    fn result(&mut self, effort: Effort) -> Resampled {
        let Round { energy, attached, rms } = self.project();
        let held: Vec<f64> =
            (0..self.frame.faces.len()).map(|f| energy.attachments.of(f).len() as f64).collect();
        let samples = self.projection.count() as f64;
        let evidence = Evidence {
            frame: self.frame,
            points: &self.points,
            suspect: self.suspect,
            held: &held,
            density: samples / area(self.suspect),
            distance: self.options.missing_distance,
        };
        let place = |(p, present): (&Vector3<f64>, bool)| present.then(|| self.frame.absolute(p));
        Resampled {
            positions: self.points.iter().zip(present(&evidence)).map(place).collect(),
            rms: rms * self.frame.side(),
            attached: attached as f64 / samples,
            rounds: effort.rounds,
            iterations: effort.iterations,
            converged: effort.converged,
            energy: energy.evaluate(&self.points, &mut vec![Vector3::zeros(); self.points.len()]),
        }
    }
}

/// Surface area.
fn area(soup: &Soup) -> f64 {
    let corner = |v: u32| &soup.points[v as usize];
    let face =
        |&[a, b, c]: &[u32; 3]| sombrero_mesh::geometry::area_vector(corner(a), corner(b), corner(c)).norm();
    0.5 * soup.triangles.iter().map(face).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use sombrero_progress::heard;
    use sombrero_shapes as shapes;

    #[test]
    fn a_fit_says_how_far_it_is() {
        let (original, suspect) = (shapes::bumpy_sphere(600), shapes::bumpy_sphere(500));
        let fit = || {
            let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
            resample(&original, &suspect, &ResampleOptions::default(), &mut rng).unwrap()
        };
        let (result, said) = heard(fit);
        assert!((8..=161).contains(&said.len()), "{said:?}");
        assert_eq!(result, fit(), "and is the same when nobody listens");
    }
}
