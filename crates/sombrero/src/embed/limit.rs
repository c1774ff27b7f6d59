//! How far a mark can move a vertex, known before there is a mark.
//!
//! A vertex moves by d = ε Σ_i b_i w_i with the three numbers b_i that its row of the matrix has for coefficient i and w
//! standard Gaussian. With σ² = Σ_i |b_i|²,
//!
//! ```text
//! Pr[|d| > t ε] ≤ Pr[|g| > t/σ] = erfc(t / (σ √2))   for t ≥ 1.24 σ,
//! ```
//!
//! since of all Gaussian quadratic forms of equal mean a single square has the heaviest tail (Székely and Bakirov 2003;
//! equality where all b_i point the same way). The sum over all vertices bounds the probability that any goes beyond.

use super::error::EmbedError;
use sombrero_basis::Basis;
use sombrero_watermark::EPSILONS;

/// The probability that a mark goes beyond the limit.
const EXCEEDANCE: f64 = 1e-3;

/// Where the inequality begins to hold.
const LEAST: f64 = 1.24;

/// So many standard deviations are enough for any number of vertices.
const MOST: f64 = 12.0;

/// Each halves the interval; two digits are kept of what comes of it.
const HALVINGS: usize = 20;

/// `epsilon`, or less where a mark would move a vertex by more than `most` model units.
pub(super) fn epsilon_within(basis: &Basis, epsilon: f64, most: f64) -> Result<f64, EmbedError> {
    if !(most > 0.0 && most.is_finite()) {
        return Err(EmbedError::Displacement { most });
    }
    let longest = longest_displacement(basis);
    if longest <= 0.0 {
        return Ok(epsilon);
    }
    let epsilon = epsilon.min(rounded_down(most / longest));
    if EPSILONS.contains(&epsilon) { Ok(epsilon) } else { Err(EmbedError::TooLittle { most, epsilon }) }
}

/// `x` with two significant digits, so that a key is easy to read.
fn rounded_down(x: f64) -> f64 {
    let unit = 10_f64.powi(libm::floor(libm::log10(x)) as i32 - 1);
    let rounded = (x / unit).floor() * unit;
    // What a decimal cannot hold exactly may come out above.
    let shown: f64 = format!("{rounded:.1e}").parse().unwrap_or(x);
    if shown <= x { shown } else { x }
}

/// The t with Σ_v erfc(t / (σ_v √2)) ≤ 0.001, in model units for ε = 1; 0 when nothing moves.
fn longest_displacement(basis: &Basis) -> f64 {
    let deviations: Vec<f64> = basis.deviations().into_iter().filter(|s| *s > 0.0).collect();
    let largest = deviations.iter().copied().fold(0.0, f64::max);
    let beyond =
        |t: f64| deviations.iter().map(|s| libm::erfc(t / (s * std::f64::consts::SQRT_2))).sum::<f64>();
    let (mut short, mut long) = (LEAST * largest, MOST * largest);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (short + long);
        if beyond(middle) > EXCEEDANCE {
            short = middle;
        } else {
            long = middle;
        }
    }
    long
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_basis::BasisOptions;
    use sombrero_search::Model;
    use sombrero_shapes as shapes;
    use sombrero_watermark::{Preset, gaussians};

    #[test]
    fn few_marks_go_beyond_and_none_far() {
        for preset in Preset::ALL {
            few_go_beyond(preset);
        }
    }

    fn few_go_beyond(preset: Preset) {
        let model = Model::new(&shapes::bumpy_sphere(600));
        let options = preset.parameters().basis;
        let basis = model.basis(&BasisOptions { coefficients: 50, ..options }).unwrap();
        let limit = longest_displacement(&basis);
        let longest = |seed: u64| {
            let mut bytes = [0; 32];
            bytes[..8].copy_from_slice(&seed.to_le_bytes());
            let w = gaussians(bytes, basis.functions().len());
            basis.displacements(&w, 1.0).iter().map(|d| d.norm()).fold(0.0, f64::max)
        };
        let all: Vec<f64> = (0..2000).map(longest).collect();
        // 2 are expected at most; 12 have a probability of 1e-6.
        assert!(all.iter().filter(|d| **d > limit).count() < 12);
        // And the limit is not far from what happens.
        assert!(all.iter().copied().fold(0.0, f64::max) > 0.6 * limit);
    }
}
