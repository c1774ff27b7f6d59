//! How far each coefficient moves its function's centre: the share of the mark's energy that it gets.
//!
//! The paper moves centre i by ε h_i (section 4), so a few tall functions carry nearly all of the mark: under noise
//! the others drown, and a second mark made the same way hides the tall ones. With the roots of the heights
//!
//! ```text
//! a_i = g sign(h_i) √|h_i|,   g² = Σ h_i² |φ_i|² (the 50 tallest) / Σ |h_i| |φ_i|² (all m),
//! ```
//!
//! more functions share the same energy: ε² Σ a_i² |φ_i|², the expected sum of squared displacements, is that of the
//! paper's mark with 50 coefficients on the same mesh.

use crate::BasisFunction;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// As many functions carry the energy that the others are measured by: the paper's m.
const PAPER_COEFFICIENTS: usize = 50;

/// The rule for a_i, by which coefficient i moves its centre by ε a_i.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Amplitudes {
    /// a_i = h_i, the paper's. The default.
    #[default]
    Heights,
    /// a_i in proportion to √|h_i|, at the energy of the paper's mark with 50 coefficients.
    RootHeights,
    /// As strong as each field pays, given all others and what is seen of it; the rule of fields alone.
    Filled,
}

impl Amplitudes {
    /// All rules.
    pub const ALL: [Self; 3] = [Self::Heights, Self::RootHeights, Self::Filled];

    /// Whether these are amplitudes of such functions: heights are those of vertex splits, which fields do not have.
    pub fn suit(self, function: BasisFunction) -> bool {
        (self == Self::Filled) == (function == BasisFunction::Field)
    }

    /// The name in key files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Heights => "heights",
            Self::RootHeights => "root-heights",
            Self::Filled => "filled",
        }
    }

    /// a_i of functions with these heights, tallest first, and these |φ_i|². Fields are filled before they come here.
    pub(crate) fn of(self, heights: &[f64], energies: &[f64]) -> Vec<f64> {
        match self {
            Self::Heights | Self::Filled => heights.to_vec(),
            Self::RootHeights => {
                let pairs = || heights.iter().zip(energies);
                let wanted: f64 = pairs().take(PAPER_COEFFICIENTS).map(|(h, e)| h * h * e).sum();
                let given: f64 = pairs().map(|(h, e)| h.abs() * e).sum();
                let gain = if given > 0.0 { (wanted / given).sqrt() } else { 0.0 };
                heights.iter().map(|h| gain * h.signum() * h.abs().sqrt()).collect()
            }
        }
    }
}

impl fmt::Display for Amplitudes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that is none of the rules.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("`{name}` is no rule for amplitudes; use heights, root-heights or filled")]
pub struct UnknownAmplitudes {
    /// What was given.
    pub name: String,
}

impl FromStr for Amplitudes {
    type Err = UnknownAmplitudes;

    fn from_str(name: &str) -> Result<Self, UnknownAmplitudes> {
        let known = Self::ALL.into_iter().find(|rule| rule.name() == name);
        known.ok_or_else(|| UnknownAmplitudes { name: name.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_have_the_energy_of_the_fifty_tallest() {
        let heights: Vec<f64> =
            (0..120).map(|i| (1.0 - 2.0 * f64::from(i % 2)) / (1.0 + f64::from(i))).collect();
        let energies: Vec<f64> = (0..120).map(|i| 3.0 + f64::from(i * 7 % 11)).collect();
        let energy = |a: &[f64]| a.iter().zip(&energies).map(|(a, e)| a * a * e).sum::<f64>();
        let roots = Amplitudes::RootHeights.of(&heights, &energies);
        assert!((energy(&roots) / energy(&heights[..50]) - 1.0).abs() < 1e-12);
        assert!(roots.iter().zip(&heights).all(|(a, h)| a * h > 0.0));
        assert!((roots[3] / roots[15] - 2.0).abs() < 1e-12, "1/4 and 1/16 of the height");
        assert_eq!(Amplitudes::Heights.of(&heights, &energies), heights);
    }

    #[test]
    fn names_are_read_back() {
        for rule in Amplitudes::ALL {
            assert_eq!(rule.name().parse(), Ok(rule));
        }
        assert!("roots".parse::<Amplitudes>().is_err());
    }
}
