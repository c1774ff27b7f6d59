//! The kinds of functions: the three radial profiles of the paper (section 3, figure 3), and fields.

use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// The kind of a basis function: a profile over its support, from radius 0 (centre) to 1 (boundary), or a field of vectors.
///
/// To add one: a variant here with its formula, and its place in [`BasisFunction::ALL`], in [`BasisFunction::value`] and in
/// [`BasisFunction::name`], all in this file. By its name the command, key files and attack specs know it then, and the
/// tests below hold it to 1 at the centre and 0 at the boundary. A function that is no profile over a radius begins in
/// [`Basis::new`](crate::Basis::new), which asks the crate that finds it, as it does for fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum BasisFunction {
    /// φ(r) = 1 - r.
    Hat,
    /// φ(r) = 2 r³ - 3 r² + 1: smooth at the centre and at the boundary.
    Derby,
    /// φ(r) = -21 r⁵ + 45 r⁴ - 25 r³ + 1: smooth, flat at the centre, and without a mean over the unit
    /// disc (∫ φ(r) r dr = 0), so that it does not pull a registration away. The default.
    #[default]
    Sombrero,
    /// A displacement field of `sombrero-spectral`, which is no profile over a radius.
    Field,
}

impl BasisFunction {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Hat, Self::Derby, Self::Sombrero, Self::Field];
    /// The profiles, in the paper's order.
    pub const PROFILES: [Self; 3] = [Self::Hat, Self::Derby, Self::Sombrero];

    /// φ(r) of a profile for r in [0, 1]; 1 at the centre and 0 at the boundary. NaN of a field.
    #[inline]
    pub fn value(self, r: f64) -> f64 {
        match self {
            Self::Hat => 1.0 - r,
            Self::Derby => (2.0 * r - 3.0) * r * r + 1.0,
            Self::Sombrero => ((-21.0 * r + 45.0) * r - 25.0) * r * r * r + 1.0,
            Self::Field => f64::NAN,
        }
    }

    /// The name in lower case, as the command line and key files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hat => "hat",
            Self::Derby => "derby",
            Self::Sombrero => "sombrero",
            Self::Field => "field",
        }
    }
}

impl fmt::Display for BasisFunction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that is none of these.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("`{name}` is not a basis function; use {}", known())]
pub struct UnknownFunction {
    /// What was given.
    pub name: String,
}

/// All names, the newest first: `field, sombrero, derby or hat`.
fn known() -> String {
    let [first, others @ ..] = &BasisFunction::ALL;
    let others: Vec<&str> = others.iter().rev().map(|f| f.name()).collect();
    format!("{} or {first}", others.join(", "))
}

impl FromStr for BasisFunction {
    type Err = UnknownFunction;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|f| f.name() == name);
        found.ok_or_else(|| UnknownFunction { name: name.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_are_one_at_the_centre_and_zero_at_the_boundary() {
        for f in BasisFunction::PROFILES {
            assert_eq!(f.value(0.0), 1.0);
            assert_eq!(f.value(1.0), 0.0);
        }
    }

    #[test]
    fn names_are_read_back() {
        for f in BasisFunction::ALL {
            assert_eq!(f.name().parse(), Ok(f));
        }
    }

    #[test]
    fn the_sombrero_has_no_mean_over_the_disc_and_no_slope_at_its_ends() {
        let f = BasisFunction::Sombrero;
        let n = 10_000;
        let mean: f64 = (0..n).map(|i| (f64::from(i) + 0.5) / f64::from(n)).map(|r| f.value(r) * r).sum();
        assert!((mean / f64::from(n)).abs() < 1e-8);
        let slope = |r: f64| (f.value(r + 1e-6) - f.value(r - 1e-6)) / 2e-6;
        assert!(slope(1e-6).abs() < 1e-6 && slope(1.0 - 1e-6).abs() < 1e-4);
    }

    #[test]
    fn a_wrong_name_is_answered_with_the_right_ones() {
        let error = "fedora".parse::<BasisFunction>().unwrap_err().to_string();
        assert_eq!(error, "`fedora` is not a basis function; use field, sombrero, derby or hat");
    }

    #[test]
    fn golden_values() {
        assert_eq!(BasisFunction::Hat.value(0.25), 0.75);
        assert_eq!(BasisFunction::Derby.value(0.5), 0.5);
        assert_eq!(BasisFunction::Sombrero.value(0.5), 0.03125);
    }
}
