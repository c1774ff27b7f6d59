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
    centre: DVector<f64>,
    axes: Axes,
    /// X of the null hypothesis, over the largest l.
    form: QuadraticForm,
}

/// Answer of [`Ellipsoid::test`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct EllipsoidTest {
    /// D = (w - w*)ᵀ P (w - w*), without unit.
    pub distance: f64,
    /// A certified upper bound on p for this D, its own rounding included: the one to report. It is 1 where D is not
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
    /// its entries may span any range.
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
        Ok(Self::from_axes(DVector::from_column_slice(centre), Axes::new(precision)?))
    }

    fn from_axes(centre: DVector<f64>, axes: Axes) -> Self {
        let largest = axes.largest_precision();
        let rotated = axes.rotated(centre.clone());
        let pairs = axes.precisions().iter().zip(rotated.iter());
        let form = QuadraticForm::new(pairs.filter(|(l, _)| **l > 0.0).map(|(l, c)| (l / largest, *c)));
        Self { centre, axes, form }
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
        Ok(Self::from_axes(self.centre.clone(), if tau > 0.0 { axes.with_floor(tau) } else { axes }))
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
        let offset = DVector::from_iterator(
            watermark.len(),
            watermark.iter().zip(self.centre.iter()).map(|(w, c)| w - c),
        );
        Ok(self.axes.relative_norm(&self.axes.rotated(offset)))
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
mod tests {
    use super::*;
    use crate::wilson_interval;
    use proptest::prelude::*;
    use rand::{Rng, RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Of 150 coefficients 38 are known, and their errors go together: this has ended in NaN.
    #[test]
    fn many_coefficients_of_which_nothing_is_known() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for m in [3, 10, 40, 150] {
            let known = m / 4 + 1;
            let l: Vec<f64> = (0..known).map(|i| 10f64.powi(-(i as i32) / 3)).collect();
            let block = rotated(&rotation(known, &mut rng), &l);
            let mut precision = DMatrix::zeros(m, m);
            for (i, j) in (0..known).flat_map(|i| (0..known).map(move |j| (i, j))) {
                precision[(4 * i % m, 4 * j % m)] += block[(i, j)];
            }
            let ellipsoid = Ellipsoid::new(&vec![0.5; m], &precision).unwrap();
            assert!(ellipsoid.rank() <= known && ellipsoid.rank() > 0);
            assert!(ellipsoid.test(&gaussian(m, &mut rng)).unwrap().distance.is_finite());
        }
    }

    fn gaussian(m: usize, rng: &mut impl Rng) -> Vec<f64> {
        StandardNormal.sample_iter(rng).take(m).collect()
    }

    fn rotation(m: usize, rng: &mut impl Rng) -> DMatrix<f64> {
        DMatrix::from_vec(m, m, gaussian(m * m, rng)).qr().q()
    }

    fn rotated(q: &DMatrix<f64>, l: &[f64]) -> DMatrix<f64> {
        q * DMatrix::from_diagonal(&DVector::from_column_slice(l)) * q.transpose()
    }

    /// Precisions spread over so many decades, the largest 100.
    fn decades(m: usize, decades: f64, rng: &mut impl Rng) -> Vec<f64> {
        (0..m).map(|_| 10_f64.powf(2.0 - decades * rng.random::<f64>())).collect()
    }

    fn random(m: usize, spread: f64, seed: u64) -> Ellipsoid {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let p = rotated(&rotation(m, &mut rng), &decades(m, spread, &mut rng));
        Ellipsoid::new(&gaussian(m, &mut rng), &p).unwrap()
    }

    fn diagonal(centre: &[f64], l: &[f64]) -> Ellipsoid {
        Ellipsoid::new(centre, &DMatrix::from_diagonal(&DVector::from_column_slice(l))).unwrap()
    }

    fn close(a: EllipsoidTest, b: EllipsoidTest, tolerance: f64) -> bool {
        let near = |a: LogProbability, b: LogProbability| {
            (a.ln() - b.ln()).abs() <= tolerance * (1.0 + a.ln().abs())
        };
        near(a.bound, b.bound) && near(a.saddlepoint, b.saddlepoint)
    }

    #[test]
    fn distance_is_the_quadratic_form() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let m = 30;
        let p = rotated(&rotation(m, &mut rng), &decades(m, 4.0, &mut rng));
        let (centre, w) = (gaussian(m, &mut rng), gaussian(m, &mut rng));
        let d = DVector::from_iterator(m, w.iter().zip(&centre).map(|(w, c)| w - c));
        let ellipsoid = Ellipsoid::new(&centre, &p).unwrap();
        let distance = ellipsoid.distance(&w).unwrap();
        assert!((distance / d.dot(&(&p * &d)) - 1.0).abs() < 1e-12);
        let test = ellipsoid.test(&w).unwrap();
        assert_eq!(test.distance, distance);
        assert!(close(test, ellipsoid.tail(distance), 1e-13));
    }

    /// The promise of the bound and of the saddlepoint value, against 200,000 draws each.
    #[test]
    fn bound_and_saddlepoint_against_monte_carlo() {
        const DRAWS: usize = 200_000;
        for (seed, (m, spread)) in [(3, 1.0), (8, 3.0), (10, 0.0), (30, 6.0)].into_iter().enumerate() {
            let ellipsoid = random(m, spread, seed as u64);
            let mut rng = ChaCha8Rng::seed_from_u64(100 + seed as u64);
            let mut d: Vec<f64> =
                (0..DRAWS).map(|_| ellipsoid.distance(&gaussian(m, &mut rng)).unwrap()).collect();
            d.sort_by(f64::total_cmp);
            for rate in [0.5, 0.1, 0.01, 0.001] {
                let hits = (rate * DRAWS as f64) as usize;
                let test = ellipsoid.tail(d[hits - 1]);
                let seen = wilson_interval(hits, DRAWS, 0.9999).unwrap();
                let (bound, saddlepoint) = (test.bound.p(), test.saddlepoint.p());
                assert!(bound >= seen.low, "{m}, {spread}, {rate}: {bound}");
                assert!(
                    0.9 * seen.low <= saddlepoint && saddlepoint <= 1.1 * seen.high,
                    "{m}, {spread}, {rate}: {saddlepoint}"
                );
            }
        }
    }

    /// A wrong and strongly uneven precision costs no honesty: of random keys a share of at most p scores p.
    #[test]
    fn calibrated_against_random_keys() {
        const KEYS: usize = 200_000;
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let l: Vec<f64> = (0..40).map(|i| 10_f64.powi(-(i % 12))).collect();
        let centre: Vec<f64> = (0..40).map(|i| 0.3 * f64::from(i % 9) - 1.2).collect();
        let ellipsoid = Ellipsoid::new(&centre, &rotated(&rotation(40, &mut rng), &l)).unwrap();
        let d: Vec<f64> = (0..KEYS).map(|_| ellipsoid.distance(&gaussian(40, &mut rng)).unwrap()).collect();
        for rate in [0.5, 0.1, 0.01, 0.001] {
            let threshold = ellipsoid.distance_at(LogProbability::from_p(rate));
            let hits = d.iter().filter(|d| **d <= threshold).count();
            let seen = wilson_interval(hits, KEYS, 0.999).unwrap();
            assert!(seen.low <= rate && hits > 0, "{hits} at {rate}");
            assert!(seen.high > 0.05 * rate, "the bound is loose: {hits} at {rate}");
        }
    }

    #[test]
    fn distance_at_answers_as_the_test_does() {
        let ellipsoid = random(12, 5.0, 12);
        let mut rng = ChaCha8Rng::seed_from_u64(13);
        let mut counts = [0; 2];
        for _ in 0..2000 {
            let w = gaussian(12, &mut rng);
            let p = LogProbability::from_p(rng.random());
            let quick = ellipsoid.distance(&w).unwrap() <= ellipsoid.distance_at(p);
            assert_eq!(quick, ellipsoid.test(&w).unwrap().bound <= p);
            counts[usize::from(quick)] += 1;
        }
        assert!(counts.iter().all(|n| *n > 100), "{counts:?}");
    }

    /// Found at a noise of 1 %, a watermark of 300 coefficients gives ln p below -1000; unmarked ones give nothing.
    #[test]
    fn a_watermark_is_found() {
        let mut rng = ChaCha8Rng::seed_from_u64(14);
        let w = gaussian(300, &mut rng);
        let extracted: Vec<f64> = w.iter().zip(gaussian(300, &mut rng)).map(|(w, e)| w + 0.01 * e).collect();
        let ellipsoid = diagonal(&extracted, &[1e4; 300]);
        let test = ellipsoid.test(&w).unwrap();
        assert!(test.bound.ln() < -1000.0 && test.saddlepoint < test.bound, "{test:?}");
        assert!(ellipsoid.test(&gaussian(300, &mut rng)).unwrap().bound.p() > 1e-4);
        assert!((ellipsoid.effective_coefficients() - 300.0).abs() < 0.1);
        assert_eq!(test, ellipsoid.test(&w).unwrap());
        let clean = ellipsoid.test(&extracted).unwrap();
        assert_eq!(clean.distance, 0.0);
        assert!(clean.bound < test.bound && clean.bound.log10() > -16.0 * 300.0);
    }

    #[test]
    fn scale_of_the_precision_cancels() {
        let mut rng = ChaCha8Rng::seed_from_u64(15);
        let p = rotated(&rotation(15, &mut rng), &decades(15, 3.0, &mut rng));
        let centre = gaussian(15, &mut rng);
        let w: Vec<f64> = centre.iter().map(|c| c + 0.1).collect();
        let plain = Ellipsoid::new(&centre, &p).unwrap().test(&w).unwrap();
        for c in [1e-200, 1e-30, 0.3, 7.0, 1e30, 1e200] {
            let scaled = Ellipsoid::new(&centre, &(&p * c)).unwrap().test(&w).unwrap();
            assert!(close(plain, scaled, 1e-9), "{c}: {plain:?} {scaled:?}");
            assert!((scaled.distance / c / plain.distance - 1.0).abs() < 1e-9);
        }
        let l: Vec<f64> = (0..15).map(|i| 10_f64.powi(4 * i - 30)).collect();
        let wide = diagonal(&centre, &l);
        assert_eq!(wide.rank(), 15);
        assert!(wide.test(&w).unwrap().bound.ln().is_finite());
    }

    #[test]
    fn undetermined_directions_do_not_count() {
        let small = diagonal(&[0.4, -1.0], &[9.0, 2.0]);
        let padded = diagonal(&[0.4, 7.0, -1.0, 0.0], &[9.0, 0.0, 2.0, -1e-12]);
        assert_eq!((padded.dimension(), padded.rank()), (4, 2));
        assert_eq!(small.test(&[0.5, -0.8]), padded.test(&[0.5, 100.0, -0.8, -3.0]));
        assert_eq!(small.effective_coefficients(), padded.effective_coefficients());
        // Rank 5 of 20 under a rotation: rounding leaves no sixteenth direction behind.
        let mut rng = ChaCha8Rng::seed_from_u64(16);
        let mut l = [0.0; 20];
        l[..5].copy_from_slice(&[5.0, 4.0, 3.0, 2.0, 1.0]);
        let (q, y) = (rotation(20, &mut rng), gaussian(20, &mut rng));
        let turned = Ellipsoid::new(&gaussian(20, &mut rng), &rotated(&q, &l)).unwrap();
        assert_eq!(turned.rank(), 5);
        let w = gaussian(20, &mut rng);
        let mut hidden = DVector::from_column_slice(&y);
        hidden.rows_mut(0, 5).fill(0.0);
        let moved: Vec<f64> = w.iter().zip((&q * hidden).iter()).map(|(w, d)| w + 10.0 * d).collect();
        assert!(close(turned.test(&w).unwrap(), turned.test(&moved).unwrap(), 1e-10));
        let nothing = diagonal(&[1.0, 2.0], &[0.0, 0.0]);
        let test = nothing.test(&[1.0, 2.0]).unwrap();
        assert_eq!(
            (test.distance, test.bound, test.saddlepoint),
            (0.0, LogProbability::ONE, LogProbability::ONE)
        );
        assert_eq!(nothing.distance_at(LogProbability::from_p(0.5)), f64::NEG_INFINITY);
        assert_eq!(diagonal(&[], &[]).test(&[]).unwrap().bound, LogProbability::ONE);
    }

    #[test]
    fn floors() {
        let ellipsoid = random(10, 6.0, 17);
        let w = gaussian(10, &mut ChaCha8Rng::seed_from_u64(18));
        assert_eq!(ellipsoid.with_floor(0.0).unwrap().test(&w), ellipsoid.test(&w));
        let floor = ellipsoid.with_floor(0.3).unwrap();
        for (l, f) in ellipsoid.precisions().iter().zip(floor.precisions()) {
            assert!((f * (1.0 + 0.09 * l) / l - 1.0).abs() < 1e-13);
        }
        // Adding τ twice is adding √2 τ once, and a huge τ makes all directions alike.
        let (twice, once) = (floor.with_floor(0.3).unwrap(), ellipsoid.with_floor(0.18_f64.sqrt()).unwrap());
        assert!(close(twice.test(&w).unwrap(), once.test(&w).unwrap(), 1e-10));
        let alike = ellipsoid.with_floor(1e9).unwrap();
        assert!(alike.precisions().iter().all(|l| (l * 1e18 - 1.0).abs() < 1e-9));
        let equal = diagonal(ellipsoid.centre.as_slice(), &[1.0; 10]);
        assert!(close(alike.test(&w).unwrap(), equal.test(&w).unwrap(), 1e-9));
        for tau in [-0.1, f64::NAN, f64::INFINITY] {
            assert!(matches!(ellipsoid.with_floor(tau), Err(EllipsoidError::Floor { .. })));
        }
        assert_eq!(diagonal(&[0.0], &[1e-320]).with_floor(1.0).unwrap().rank(), 1);
    }

    #[test]
    fn senseless_questions() {
        let one = DMatrix::identity(2, 2);
        let shape = EllipsoidError::Shape { centre: 1, rows: 2, columns: 2 };
        assert_eq!(Ellipsoid::new(&[0.0], &one).err(), Some(shape));
        let centre = EllipsoidError::CentreNotFinite { index: 1 };
        assert_eq!(Ellipsoid::new(&[0.0, f64::NAN], &one).err(), Some(centre));
        let with =
            |values: [f64; 4]| Ellipsoid::new(&[0.0; 2], &DMatrix::from_row_slice(2, 2, &values)).err();
        let infinite = EllipsoidError::PrecisionNotFinite { row: 0, column: 1 };
        assert_eq!(with([1.0, f64::INFINITY, 0.0, 1.0]), Some(infinite));
        assert_eq!(with([1.0, 0.5, 0.0, 1.0]), Some(EllipsoidError::NotSymmetric { row: 1, column: 0 }));
        assert!(matches!(with([1.0, 2.0, 2.0, 1.0]), Some(EllipsoidError::NotPositive { .. })));
        assert!(matches!(with([-1.0, 0.0, 0.0, 0.0]), Some(EllipsoidError::NotPositive { .. })));
        assert_eq!(with([1.0, 1.0, 1.0, 1.0]), None);
        let ellipsoid = Ellipsoid::new(&[0.0; 2], &one).unwrap();
        let lengths = EllipsoidError::Lengths { watermark: 3, centre: 2 };
        assert_eq!(ellipsoid.test(&[0.0; 3]), Err(lengths));
        let damaged = EllipsoidError::WatermarkNotFinite { index: 0 };
        assert_eq!(ellipsoid.distance(&[f64::NAN, 0.0]), Err(damaged));
        assert_eq!(ellipsoid.tail(f64::NAN).bound, LogProbability::ONE);
        assert_eq!(ellipsoid.tail(f64::INFINITY).saddlepoint, LogProbability::ONE);
    }

    proptest! {
        #[test]
        fn any_bits_are_answered(
            rows in proptest::collection::vec((any::<f64>(), any::<f64>(), any::<f64>()), 0..6),
            off in any::<f64>(),
        ) {
            let (centre, w): (Vec<f64>, Vec<f64>) = rows.iter().map(|r| (r.0, r.1)).unzip();
            let l: Vec<f64> = rows.iter().map(|r| r.2.abs()).collect();
            let mut p = DMatrix::from_diagonal(&DVector::from_column_slice(&l));
            for off in [0.0, off] {
                if l.len() > 1 {
                    (p[(0, 1)], p[(1, 0)]) = (off, off);
                }
                if let Ok(test) = Ellipsoid::new(&centre, &p).and_then(|e| e.test(&w)) {
                    prop_assert!(test.bound.ln().is_finite() && test.saddlepoint <= test.bound);
                }
            }
        }

        #[test]
        fn further_away_is_weaker(seed in 0_u64..50, near in 0.0..3.0, step in 0.0..1.0) {
            let ellipsoid = random(6, 4.0, seed);
            let along = gaussian(6, &mut ChaCha8Rng::seed_from_u64(seed + 1000));
            let at = |r: f64| {
                let w: Vec<f64> = ellipsoid.centre.iter().zip(&along).map(|(c, a)| c + r * a).collect();
                ellipsoid.test(&w).unwrap()
            };
            let (a, b) = (at(near), at(near + step));
            prop_assert!(a.bound.ln() <= b.bound.ln() + 1e-10 && a.saddlepoint.ln() <= b.saddlepoint.ln() + 1e-10);
        }
    }
}
