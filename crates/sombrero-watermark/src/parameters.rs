//! How a mark is made: the numbers that a key file holds, and the sets of them that have a name.

use sombrero_basis::{Amplitudes, BasisFunction, BasisOptions};
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;
use thiserror::Error;

/// How a mark is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// The preset that they are, at most with fewer coefficients or a smaller ε as the mesh or a limit asked for; `None`
    /// when somebody chose them.
    pub preset: Option<Preset>,
    /// m, the profile of the basis functions and how they share the energy.
    pub basis: BasisOptions,
    /// ε, the strength: coefficient 1 moves its centre by ε times its function's amplitude. Of fields it is the angle that
    /// normals turn by, in radians.
    pub epsilon: f64,
}

/// What a key can have. With fewer coefficients than these even a perfect copy proves little; with more a key of somebody
/// else is a burden.
pub const COEFFICIENTS: RangeInclusive<usize> = 16..=65_536;

/// What a key can have. Below, a mark is lost in the digits of any file (features of a hundredth of the model would move by
/// 1e-7 of it), and a key is made to play with the limits of arithmetic; above, every feature moves by a tenth of its
/// height.
pub const EPSILONS: RangeInclusive<f64> = 1e-5..=0.1;

impl Default for Parameters {
    /// Those of the default preset.
    fn default() -> Self {
        Preset::default().parameters()
    }
}

/// Parameters with a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Preset {
    /// Fields that carry the most evidence for the least visibility, as many as the mesh has room for: nobody sees them,
    /// and planes stay planar. Normals turn by 0.23 degrees, root mean square.
    /// The default.
    #[default]
    Faithful,
    /// 200 coefficients that share the energy by the roots of their heights: survives more, and is seen on flat faces. It
    /// moves vertices about as far as the paper's (root mean square).
    Robust,
    /// The paper's: 50 coefficients by their heights.
    Paper,
}

impl Preset {
    /// All presets.
    pub const ALL: [Self; 3] = [Self::Faithful, Self::Robust, Self::Paper];

    /// What the name stands for.
    pub fn parameters(self) -> Parameters {
        let (coefficients, function, amplitudes, epsilon) = match self {
            // As many as there are. Strength is what normals turn by, in radians: 0.23 degrees.
            Self::Faithful => (1024, BasisFunction::Field, Amplitudes::Filled, 0.0038),
            // At 0.01 the expected energy is that of the paper's. But there a few tall functions carry it, and most
            // marks move less than the mean; 0.0088 keeps below their median on the paper's four models.
            Self::Robust => (200, BasisFunction::Sombrero, Amplitudes::RootHeights, 0.0088),
            Self::Paper => (50, BasisFunction::Sombrero, Amplitudes::Heights, 0.01),
        };
        let basis = BasisOptions { coefficients, function, amplitudes };
        Parameters { preset: Some(self), basis, epsilon }
    }

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Faithful => "faithful",
            Self::Robust => "robust",
            Self::Paper => "paper",
        }
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that is none of the presets.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("`{name}` is not a preset; use faithful, robust or paper")]
pub struct UnknownPreset {
    /// What was given.
    pub name: String,
}

impl FromStr for Preset {
    type Err = UnknownPreset;

    fn from_str(name: &str) -> Result<Self, UnknownPreset> {
        let known = Self::ALL.into_iter().find(|preset| preset.name() == name);
        known.ok_or_else(|| UnknownPreset { name: name.into() })
    }
}
