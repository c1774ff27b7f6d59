//! What a caller may choose: where a search starts, and how each start is refined.

use nalgebra::Similarity3;

use crate::error::RegistrationError;

/// Where the search starts.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Starts {
    /// Moments of both surfaces first; then, if no pose fits, landmarks that look alike, which also finds the
    /// place of a suspect that lost a part or to which something was added.
    #[default]
    Auto,
    /// Moments only: fast, and enough for a suspect that is whole.
    Moments,
    /// These poses, which map suspect to reference in model units.
    Given(Vec<Similarity3<f64>>),
}

/// How [`register`](crate::register()) and [`register_affine`](crate::register_affine()) search.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RegisterOptions {
    /// Where the search starts. Default [`Starts::Auto`].
    pub starts: Starts,
    /// How each start is refined.
    pub icp: IcpOptions,
    /// Alternatives kept at most, besides the best pose. Default 23: a cube
    /// has so many.
    pub max_alternatives: usize,
}

impl Default for RegisterOptions {
    fn default() -> Self {
        Self { starts: Starts::Auto, icp: IcpOptions::default(), max_alternatives: 23 }
    }
}

/// Samples, stopping rule and outlier policy of [`align`](crate::align()) and
/// [`refine_affine`](crate::refine_affine()).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IcpOptions {
    /// Points of the suspect in the coarse round, 100 to 10⁷. Default 2 000.
    pub coarse_samples: usize,
    /// Points of the suspect in the last round, 100 to 10⁷. Default 20 000.
    pub samples: usize,
    /// Iterations at most, up to half of them in the coarse round; a last round with uniform weights may take as many again.
    /// Default 60.
    pub max_iterations: usize,
    /// Length of the last step: stop when a step moves the suspect by less than this fraction of its standard error,
    /// which is the residual over the square root of the number of samples. Default 0.03.
    pub relative_tolerance: f64,
    /// Distance, in median pair distances, beyond which pairs are dropped; `None` keeps all. Default `Some(4.0)`.
    pub rejection: Option<f64>,
    /// Width of Tukey's biweight, in standard deviations of the residual estimated from their median; `None` weights all
    /// pairs alike. Default `Some(5.0)`.
    pub tukey: Option<f64>,
    /// Reach of a last round in which all pairs that are closer weigh alike, as a fraction of the reference's diagonal;
    /// with `None` its weights are robust, as those of the coarse round. Default `Some(0.02)`.
    ///
    /// Robust weights find the pose among outliers. But where the suspect differs everywhere a little, as by a
    /// watermark whose functions have no mean, they prefer the parts that happen to fit, and plain least
    /// squares is nearer to the truth.
    pub uniform_reach: Option<f64>,
}

impl Default for IcpOptions {
    fn default() -> Self {
        Self {
            coarse_samples: 2_000,
            samples: 20_000,
            max_iterations: 60,
            relative_tolerance: 0.03,
            rejection: Some(4.0),
            tukey: Some(5.0),
            uniform_reach: Some(0.02),
        }
    }
}

impl IcpOptions {
    pub(crate) fn check(&self) -> Result<(), RegistrationError> {
        let within = |option, value: f64, least: f64, most: f64, range| {
            let inside = (least..=most).contains(&value);
            if inside { Ok(()) } else { Err(RegistrationError::Option { option, value, range }) }
        };
        within("coarse_samples", self.coarse_samples as f64, 100.0, 1e7, "from 100 to 10000000")?;
        within("samples", self.samples as f64, 100.0, 1e7, "from 100 to 10000000")?;
        within("relative_tolerance", self.relative_tolerance, 0.0, 1e6, "from 0 to 1e6")?;
        within("rejection", self.rejection.unwrap_or(1.0), 1.0, f64::MAX, "at least 1")?;
        within("tukey", self.tukey.unwrap_or(1.0), 1.0, f64::MAX, "at least 1")?;
        within("uniform_reach", self.uniform_reach.unwrap_or(0.0), 0.0, 1.0, "from 0 to 1")
    }
}
