//! What a registration finds, for similarities and affine maps alike.

use nalgebra::Similarity3;

/// A pose of the suspect and how well it fits. `M` is a [`Similarity3`] or, for a suspect that may be stretched, an
/// [`Affine3`](nalgebra::Affine3).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Pose<M = Similarity3<f64>> {
    /// Map of points of the suspect to the frame of the reference, in model units.
    pub reference_from_suspect: M,
    /// Root mean square distance between the suspect, where it has a counterpart, and the reference, in
    /// model units of the reference. Where nothing has a counterpart, of the whole suspect.
    pub rms: f64,
    /// Share of the reference's area that has a counterpart in the suspect, 0 to 1.
    pub overlap: f64,
    /// Share of the suspect's area that has a counterpart in the reference, 0 to 1.
    pub suspect_overlap: f64,
    /// The fit both ways, from 0 (the same surface) to 1 (nothing in common). Above about 0.5 the suspect is
    /// hardly the reference, or the pose is wrong.
    pub score: f64,
}

/// The best pose that was found, whether it can be trusted, and the poses that fit as well.
///
/// [`register`](crate::register()) and [`align`](crate::align()) give one of similarities,
/// [`register_affine`](crate::register_affine()) and [`refine_affine`](crate::refine_affine()) one of
/// [`Affine3`](nalgebra::Affine3).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Registration<M = Similarity3<f64>> {
    /// The pose that fits best.
    pub best: Pose<M>,
    /// Other poses that the fit cannot tell from the best, best first: those by which a symmetric original goes
    /// onto itself, or by which a part of it fits in several places.
    pub alternatives: Vec<Pose<M>>,
    /// Share of the two surfaces that lie within half a percent of the reference's diagonal of each other, 0 to 1.
    pub agreement: f64,
    /// Share of what has a counterpart (within 2 % of the diagonal) that is so close to it, 0 to 1.
    pub sharpness: f64,
    /// Whether the suspect shows the reference, as far as the surfaces tell: `agreement` is at least 0.4 and
    /// `sharpness` at least 0.7. A pose that is not trusted is most likely wrong, or the suspect another shape.
    pub trusted: bool,
    /// Iterations of the best pose, coarse and fine.
    pub iterations: usize,
    /// Whether the last step was below the tolerance, rather than the last one allowed.
    pub converged: bool,
}

impl<M> Registration<M> {
    /// The best pose, then the alternatives, best first.
    pub fn poses(&self) -> impl Iterator<Item = &Pose<M>> {
        std::iter::once(&self.best).chain(&self.alternatives)
    }
}
