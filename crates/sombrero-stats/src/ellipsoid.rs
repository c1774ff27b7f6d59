//! The ellipsoid test: is w closer to w* than chance, in the units in which w* is known?
//!
//! Extraction gives the estimate w* of the m coefficients and its precision P, the inverse of the covariance of its
//! errors (m × m, symmetric, positive semi-definite; 0 in directions that the suspect does not determine). Then
//!
//! ```text
//! D = (w - w*)ᵀ P (w - w*)
//! p = Pr[(g - w*)ᵀ P (g - w*) ≤ D]   for g ~ N(0, I)
//!   = Pr[Σ l_k (g_k - c_k)² ≤ D]     with P = Q diag(l) Qᵀ, c = Qᵀ w*
//! ```
//!
//! the share of Gaussian watermarks in the ellipsoid around w* on whose surface w lies. Under the null hypothesis w
//! is independent of w* and P and Gaussian itself, so p is exact whatever w* and P are: precisions that are wrong cost
//! power, not honesty. Multiplying P by a number changes nothing.
//!
//! That holds for numbers as they are, and a claimant may choose w* and P so that doubles do badly: as (w - w*)ᵀ P (w - w*)
//! with |w*| = 1e17, D has no digit of w. So w is rotated by itself, D is Σ l_k ((Qᵀ w)_k - c_k)² with c as it is in
//! doubles, which is as good a centre as any other, and all that rounding can have taken away from D is added to it
//! (`axes.rs`): p is never smaller than that of the true D. Directions in which c is beyond [`FURTHEST`] are not known.
//!
//!
//! The test weighs each direction by how well it is known, so that many weak coefficients help as readily as a
//! few strong ones, where a correlation drowns in the weak ones.
//!
//! P's errors usually assume independent residuals and are too small when the attack is structured (a second mark, a
//! registration that is off). [`Ellipsoid::with_floor`] adds τ² to the variance in every direction; trying
//! several τ counts as several tests ([`select`](crate::select)).
//!
//! Cost: one eigendecomposition per (w*, P), then per key one product with an m × m matrix and some ten passes over
//! m numbers; with [`Ellipsoid::distance`] and [`Ellipsoid::distance_at`] the product alone.

use nalgebra::{DMatrix, DVector};

use crate::LogProbability;
use crate::axes::{Axes, check_symmetric, floored};
use crate::ellipsoid_error::EllipsoidError;
use crate::quadratic_form::QuadraticForm;

/// No watermark lies further out in any direction, in standard deviations: a Gaussian number exceeds 40 with a
/// probability of 1e-349. A w* that does is an error, and nothing is lost with it.
const FURTHEST: f64 = 1e3;

/// An extracted watermark w* with the precision at which it is known. Lengths are in units of the standard deviation
/// of w's coefficients, precisions in the inverse square of that.
///
/// ```
/// use nalgebra::dmatrix;
/// use sombrero_stats::Ellipsoid;
///
/// // Two coefficients known to ±0.1 each with errors that go together, a third one not at all.
/// let precision = dmatrix![150.0, -90.0, 0.0; -90.0, 150.0, 0.0; 0.0, 0.0, 0.0];
/// let ellipsoid = Ellipsoid::new(&[1.2, -0.7, 0.0], &precision)?;
/// assert_eq!((ellipsoid.dimension(), ellipsoid.rank()), (3, 2));
///
/// let test = ellipsoid.test(&[1.25, -0.68, 2.0])?;
/// assert!((test.distance - 0.255).abs() < 1e-12);
/// assert!(test.bound.p() < 0.01 && test.saddlepoint < test.bound);
/// assert!(ellipsoid.test(&[-1.25, 0.68, 2.0])?.bound.p() > 0.5);
/// # Ok::<(), sombrero_stats::EllipsoidError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Ellipsoid {
    /// w*, as it was given.
    centre: DVector<f64>,
    axes: Axes,
    /// c.
    rotated: DVector<f64>,
    /// X of the null hypothesis, over the largest l.
    form: QuadraticForm,
}

/// Answer of [`Ellipsoid::test`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct EllipsoidTest {
    /// D = (w - w*)ᵀ P (w - w*), without unit, and what rounding may have taken away from it.
    pub distance: f64,
    /// A certified upper bound on p for this D, all rounding included: the one to report. It is 1 where D is not
    /// below its mean, and some √(π r) times p in the far tail, for r directions that matter.
    pub bound: LogProbability,
    /// The saddlepoint approximation of p; never above the bound. It is off by some 1/(6 r) of p in the far tail, by
    /// 2 % or less for ten directions and more.
    pub saddlepoint: LogProbability,
}

impl Ellipsoid {
    /// From w* (m values; any finite number where the precision is 0) and the m × m precision P.
    ///
    /// Eigenvalues within rounding of 0 (m 2⁻⁵² of the largest) count as 0. A diagonal P is taken as it is, so that
    /// its entries may span any range. Directions in which w* is beyond 1000 count as unknown.
    ///
    /// # Errors
    ///
    /// When shapes differ, a value is not finite, or P is not symmetric or not positive semi-definite to 1e-8 of its
    /// largest entry or eigenvalue.
    pub fn new(centre: &[f64], precision: &DMatrix<f64>) -> Result<Self, EllipsoidError> {
        let (m, (rows, columns)) = (centre.len(), precision.shape());
        if (rows, columns) != (m, m) {
            return Err(EllipsoidError::Shape { centre: m, rows, columns });
        }
        if let Some(index) = first_not_finite(centre) {
            return Err(EllipsoidError::CentreNotFinite { index });
        }
        check_symmetric(precision)?;
        let (centre, mut axes) = (DVector::from_column_slice(centre), Axes::new(precision)?);
        let rotated = axes.rotated(centre.clone());
        axes.forget_beyond(&rotated, FURTHEST);
        Ok(Self::from_axes(centre, axes, rotated))
    }

    fn from_axes(centre: DVector<f64>, axes: Axes, rotated: DVector<f64>) -> Self {
        let largest = axes.largest_precision();
        let pairs = axes.precisions().iter().zip(rotated.iter());
        let form = QuadraticForm::new(pairs.filter(|(l, _)| **l > 0.0).map(|(l, c)| (l / largest, *c)));
        Self { centre, axes, rotated, form }
    }

    /// The same with an independent error of standard deviation τ more in every direction: l → l/(1 + τ² l). Nothing is
    /// then known better than to τ, which is in units of the standard deviation of w's coefficients.
    ///
    /// # Errors
    ///
    /// When τ is negative, infinite or NaN.
    pub fn with_floor(&self, tau: f64) -> Result<Self, EllipsoidError> {
        if !(tau >= 0.0 && tau.is_finite()) {
            return Err(EllipsoidError::Floor { tau });
        }
        let axes = self.axes.clone();
        let axes = if tau > 0.0 { axes.with_floor(tau) } else { axes };
        Ok(Self::from_axes(self.centre.clone(), axes, self.rotated.clone()))
    }

    /// Compares with the m inserted coefficients.
    ///
    /// Of an ellipsoid that determines nothing the answer is p = 1.
    ///
    /// # Errors
    ///
    /// When `watermark` has another length than w*, or a value that is not finite.
    pub fn test(&self, watermark: &[f64]) -> Result<EllipsoidTest, EllipsoidError> {
        let relative = self.relative_distance(watermark)?;
        Ok(self.answer(relative * self.axes.largest_precision(), relative))
    }

    /// D alone, without unit: what [`test`](Self::test) would report, in a fraction of the time.
    ///
    /// # Errors
    ///
    /// As those of [`test`](Self::test).
    pub fn distance(&self, watermark: &[f64]) -> Result<f64, EllipsoidError> {
        Ok(self.relative_distance(watermark)? * self.axes.largest_precision())
    }

    /// The probability that a random watermark comes as close as `distance` ≥ 0; a NaN claims nothing.
    ///
    /// D counts as at least 2⁻¹⁰⁴ (4.9e-32) of its mean: doubles cannot be known to agree better. The logarithm
    /// is therefore finite for every D.
    pub fn tail(&self, distance: f64) -> EllipsoidTest {
        let largest = self.axes.largest_precision();
        self.answer(distance, if largest > 0.0 { distance / largest } else { 0.0 })
    }

    /// The largest D whose bound does not exceed p: `distance(w)? <= distance_at(p)` asks the same as
    /// `test(w)?.bound <= p`, without a search per key.
    ///
    /// ∞ for p = 1; -∞ when no D is small enough, because nothing is determined or p is beyond what doubles can show.
    pub fn distance_at(&self, p: LogProbability) -> f64 {
        let relative = self.form.quantile_of_bound(p);
        if relative.is_finite() { relative * self.axes.largest_precision() } else { relative }
    }

    /// How many coefficients m the watermark has.
    pub fn dimension(&self) -> usize {
        self.centre.len()
    }

    /// How many directions are determined at all: the number of positive l.
    pub fn rank(&self) -> usize {
        self.form.rank()
    }

    /// What the evidence is worth in coefficients: Σ l/(1 + l), between 0 and m. One that is known to ±σ counts as
    /// 1/(1 + σ²).
    pub fn effective_coefficients(&self) -> f64 {
        self.axes.precisions().iter().map(|l| floored(*l, 1.0)).sum()
    }

    /// The eigenvalues l of P, m of them in no particular order, none negative.
    pub fn precisions(&self) -> &[f64] {
        self.axes.precisions()
    }

    /// w*, as it was given.
    pub(crate) fn centre(&self) -> &DVector<f64> {
        &self.centre
    }

    pub(crate) fn axes(&self) -> &Axes {
        &self.axes
    }

    /// D over the largest l, which neither overflows nor underflows with the units of P.
    fn relative_distance(&self, watermark: &[f64]) -> Result<f64, EllipsoidError> {
        self.check(watermark)?;
        Ok(self.axes.relative_distance(DVector::from_column_slice(watermark), &self.rotated))
    }

    /// Whether a watermark can be compared.
    pub(crate) fn check(&self, watermark: &[f64]) -> Result<(), EllipsoidError> {
        if watermark.len() != self.dimension() {
            return Err(EllipsoidError::Lengths { watermark: watermark.len(), centre: self.dimension() });
        }
        match first_not_finite(watermark) {
            Some(index) => Err(EllipsoidError::WatermarkNotFinite { index }),
            None => Ok(()),
        }
    }

    fn answer(&self, distance: f64, relative: f64) -> EllipsoidTest {
        let tail = self.form.lower_tail(relative);
        EllipsoidTest { distance, bound: tail.bound, saddlepoint: tail.saddlepoint }
    }
}

fn first_not_finite(values: &[f64]) -> Option<usize> {
    values.iter().position(|x| !x.is_finite())
}

#[cfg(test)]
mod tests;
