//! Smooth deformations of space, as linear combinations of displacement fields.
//!
//! ```text
//! similarity   t + ω × x + s x                                      7 columns, to first order
//! polynomial   Σ c_q ψ_q(x), ψ_q products of Legendre polynomials   3 for each of the polynomials below
//!              affine       total degree ≤ 1                         4 · 3 = 12
//!              quadratic    total degree ≤ 2                        10 · 3 = 30
//!              cubic        total degree ≤ 3                        20 · 3 = 60
//!              lattice      degree ≤ 3 in each coordinate           64 · 3 = 192
//! warp         total degree ≤ 3, and a random field         60, and 3 for each node of the field (`warp.rs`)
//! ```
//!
//! with x scaled to [-1, 1] over the bounding box. Affine maps are exact, a 4 × 4 × 4 lattice of Bézier control
//! points (Sederberg and Parry 1986) too, projective maps to third order. This is the paper's open idea (section 7) of
//! a scheme that free-form deformation does not reach.

/// A family of smooth deformations that are projected out. Each contains those before it (a similarity to first order).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Deformation {
    /// Turning, moving and scaling, to first order: what a registration leaves.
    Similarity,
    /// Any affine map.
    Affine,
    /// Polynomials of total degree 2.
    Quadratic,
    /// Polynomials of total degree 3.
    Cubic,
    /// Polynomials of degree 3 in each coordinate: free-form deformation.
    Lattice,
    /// Polynomials of total degree 3, and a smooth random field whose strength follows from the residuals: warps of waves down
    /// to about a fifth of the largest side. It contains the lattice but for a prior.
    Warp,
}

impl Deformation {
    /// All families, simplest first.
    pub const ALL: [Self; 6] =
        [Self::Similarity, Self::Affine, Self::Quadratic, Self::Cubic, Self::Lattice, Self::Warp];

    /// Exponents of the Legendre polynomials in x, y and z for each scalar field.
    pub(crate) fn exponents(self) -> Vec<[usize; 3]> {
        let (total, each) = match self {
            Self::Similarity | Self::Affine => (1, 1),
            Self::Quadratic => (2, 2),
            Self::Cubic | Self::Warp => (3, 3),
            Self::Lattice => (9, 3),
        };
        let all = (0..=each).flat_map(|i| (0..=each).flat_map(move |j| (0..=each).map(move |k| [i, j, k])));
        let mut chosen: Vec<[usize; 3]> = all.filter(|e| e.iter().sum::<usize>() <= total).collect();
        // The constant first, then x, y, z, as the similarity's columns expect.
        chosen.sort_by_key(|&[i, j, k]| (i + j + k, [3 - i, 3 - j, 3 - k]));
        chosen
    }
}
