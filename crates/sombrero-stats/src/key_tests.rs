//! All tests that an estimate of w* is put to, one row each.
//!
//! Which of several tests is the strongest depends on the attack, so all are made and the best counts, corrected for
//! their number ([`best_of`](crate::best_of)): the table [`STATISTICS`] is what that number comes from.
//!
//! **Adding a statistic** takes a file with the test itself and a row of [`STATISTICS`] that prepares it for one
//! estimate. Whatever it does must be decided by the estimate alone: the prepared test sees one watermark after the
//! other, and its p must be exact for each that is Gaussian and independent of the estimate.

use nalgebra::DMatrix;
use thiserror::Error;

use crate::{
    Ellipsoid, EllipsoidError, LogProbability, WatermarkTestError, WatermarkTestOptions, watermark_test,
};

/// A test of an estimate against a watermark, by name.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Statistic {
    /// The name, such as "ellipsoid".
    pub name: &'static str,
    /// The least error that each coefficient is taken to have, in standard deviations of w's coefficients, where a
    /// statistic knows of errors.
    pub floor: Option<f64>,
    /// The absolute value beyond which extracted coefficients are dropped, in standard deviations of w's coefficients.
    pub outlier_threshold: Option<f64>,
    prepare: fn(&Extracted, &Statistic) -> Result<Prepared, KeyTestError>,
}

/// A statistic that is ready for any number of watermarks.
type Prepared = Box<dyn Fn(&[f64]) -> Result<Answer, KeyTestError> + Send + Sync>;

/// What a statistic says about one watermark.
struct Answer {
    p: LogProbability,
    /// How many coefficients were compared.
    used: usize,
    /// ρ, of a statistic that has one.
    correlation: Option<f64>,
}

/// An estimate as the statistics see it.
struct Extracted {
    /// w* where it is known.
    known: Vec<Option<f64>>,
    /// w* with its precision.
    ellipsoid: Ellipsoid,
}

/// The tests, in the order in which they are made.
///
/// Floors: residuals of a structured attack (a second mark, a registration that is off) are not independent, which the
/// precision takes them for.
pub const STATISTICS: [Statistic; 5] =
    [Statistic::CORRELATION, ellipsoid(0.0), ellipsoid(0.1), ellipsoid(0.3), ellipsoid(1.0)];

const fn ellipsoid(floor: f64) -> Statistic {
    Statistic { name: "ellipsoid", floor: Some(floor), outlier_threshold: None, prepare: prepare_ellipsoid }
}

impl Statistic {
    /// The paper's test: coefficients beyond 2.5 are dropped, all others count alike.
    pub const CORRELATION: Self =
        Self { name: "correlation", floor: None, outlier_threshold: Some(2.5), prepare: prepare_correlation };
}

/// Rows of one name differ in their floor.
impl PartialEq for Statistic {
    fn eq(&self, other: &Self) -> bool {
        (self.name, self.floor) == (other.name, other.floor)
    }
}

fn prepare_correlation(extracted: &Extracted, row: &Statistic) -> Result<Prepared, KeyTestError> {
    let known = extracted.known.clone();
    let options = WatermarkTestOptions { outlier_threshold: row.outlier_threshold };
    Ok(Box::new(move |w| {
        let test = watermark_test(w, &known, &options)?;
        Ok(Answer { p: test.p, used: test.used, correlation: Some(test.rho()) })
    }))
}

fn prepare_ellipsoid(extracted: &Extracted, row: &Statistic) -> Result<Prepared, KeyTestError> {
    let ellipsoid = extracted.ellipsoid.with_floor(row.floor.unwrap_or(0.0))?;
    let used = extracted.known.iter().flatten().count();
    Ok(Box::new(move |w| Ok(Answer { p: ellipsoid.test(w)?.bound, used, correlation: None })))
}

/// Everything that one estimate can be asked, prepared once for any number of watermarks.
///
/// ```
/// use nalgebra::DMatrix;
/// use sombrero_stats::{KeyTests, best_of};
///
/// // Four coefficients known to ±0.1.
/// let found = [0.93, -1.21, 0.28, 1.75];
/// let tests = KeyTests::new(&found, found.map(Some).to_vec(), &(DMatrix::identity(4, 4) * 100.0))?;
///
/// let result = tests.compare(&[0.9, -1.2, 0.3, 1.7])?;
/// let best = result.tests.iter().min_by(|a, b| a.p.ln().total_cmp(&b.p.ln())).expect("there are tests");
/// assert_eq!((best.statistic.name, best.statistic.floor), ("ellipsoid", Some(0.0)));
/// assert!(result.correlation > 0.99 && best_of(best.p, KeyTests::COUNT).p() < 0.01);
/// # Ok::<(), sombrero_stats::KeyTestError>(())
/// ```
pub struct KeyTests {
    extracted: Extracted,
    prepared: Vec<Prepared>,
}

/// How one watermark compares with an estimate.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Comparison {
    /// Pearson's ρ of the coefficients that the correlation's test compares; 0 where there is none.
    pub correlation: f64,
    /// One answer for each row of [`STATISTICS`], in their order.
    pub tests: Vec<KeyTest>,
}

/// The answer of one statistic.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct KeyTest {
    /// The statistic.
    pub statistic: Statistic,
    /// The probability that an unrelated watermark compares as well in this test alone.
    pub p: LogProbability,
    /// How many coefficients were compared.
    pub used: usize,
}

/// Why there is no comparison.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum KeyTestError {
    /// The estimate or the watermark is not usable for a correlation.
    #[error(transparent)]
    Correlation(#[from] WatermarkTestError),
    /// The estimate or the watermark is not usable for an ellipsoid.
    #[error(transparent)]
    Ellipsoid(#[from] EllipsoidError),
}

impl KeyTests {
    /// How many tests each watermark is put to, which is what the best p has to be corrected for.
    pub const COUNT: usize = STATISTICS.len();

    /// From w* (m values, 0 where nothing is known), the same with `None` where nothing is known, and the m × m
    /// precision of w*, all in units of the standard deviation of w's coefficients.
    ///
    /// # Errors
    /// [`KeyTestError`] when shapes do not fit, a value is not finite or the precision is none.
    pub fn new(
        coefficients: &[f64],
        known: Vec<Option<f64>>,
        precision: &DMatrix<f64>,
    ) -> Result<Self, KeyTestError> {
        let extracted = Extracted { known, ellipsoid: Ellipsoid::new(coefficients, precision)? };
        let prepared = STATISTICS.iter().map(|row| (row.prepare)(&extracted, row));
        Ok(Self { prepared: prepared.collect::<Result<_, _>>()?, extracted })
    }

    /// Puts a watermark of m values to all tests.
    ///
    /// # Errors
    /// [`KeyTestError`] when the watermark has another length than w* or a value that is not finite.
    pub fn compare(&self, watermark: &[f64]) -> Result<Comparison, KeyTestError> {
        let mut compared = Comparison { correlation: 0.0, tests: Vec::with_capacity(Self::COUNT) };
        for (statistic, prepared) in STATISTICS.into_iter().zip(&self.prepared) {
            let Answer { p, used, correlation } = prepared(watermark)?;
            compared.tests.push(KeyTest { statistic, p, used });
            compared.correlation = correlation.unwrap_or(compared.correlation);
        }
        Ok(compared)
    }

    /// w* with its precision, for [`accuse`](crate::accuse).
    pub fn ellipsoid(&self) -> &Ellipsoid {
        &self.extracted.ellipsoid
    }
}

impl Comparison {
    /// The smallest p of all tests, uncorrected.
    pub fn best(&self) -> LogProbability {
        let smaller = |a: LogProbability, b: LogProbability| if b < a { b } else { a };
        self.tests.iter().map(|test| test.p).fold(LogProbability::ONE, smaller)
    }
}

impl std::fmt::Display for Statistic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.floor {
            Some(floor) => write!(f, "{}, floor {floor}", self.name),
            None => f.write_str(self.name),
        }
    }
}

impl std::fmt::Debug for KeyTests {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("KeyTests").field("ellipsoid", &self.extracted.ellipsoid).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate() -> (Vec<f64>, Vec<Option<f64>>, DMatrix<f64>) {
        let found = vec![0.5, -1.0, 0.0, 2.9, 0.3];
        let known = found.iter().enumerate().map(|(i, x)| (i != 2).then_some(*x)).collect();
        let precision = DMatrix::from_fn(5, 5, |i, j| match (i, j) {
            (2, _) | (_, 2) => 0.0,
            (i, j) if i == j => 30.0,
            _ => 3.0,
        });
        (found, known, precision)
    }

    /// A row gives what the test itself gives.
    #[test]
    fn rows_are_the_tests_they_name() {
        let (found, known, precision) = estimate();
        let w = [0.4, -1.1, 7.0, 2.0, 0.1];
        let compared = KeyTests::new(&found, known.clone(), &precision).unwrap().compare(&w).unwrap();
        assert_eq!(compared.tests.len(), KeyTests::COUNT);
        let plain = watermark_test(&w, &known, &WatermarkTestOptions::default()).unwrap();
        assert_eq!((compared.tests[0].p, compared.tests[0].used), (plain.p, 3));
        assert_eq!(compared.correlation, plain.rho());
        let ellipsoid = Ellipsoid::new(&found, &precision).unwrap();
        for test in &compared.tests[1..] {
            let alone = ellipsoid.with_floor(test.statistic.floor.unwrap()).unwrap().test(&w).unwrap();
            assert_eq!((test.p, test.used), (alone.bound, 4), "{}", test.statistic);
        }
        let least = compared.tests.iter().map(|t| t.p.ln()).fold(0.0, f64::min);
        assert_eq!(compared.best().ln(), least);
    }

    #[test]
    fn rows_differ_and_say_so() {
        let names: Vec<String> = STATISTICS.iter().map(ToString::to_string).collect();
        let once: std::collections::BTreeSet<_> = names.iter().collect();
        assert_eq!(once.len(), KeyTests::COUNT, "{names:?}");
        let default = WatermarkTestOptions::default().outlier_threshold;
        assert_eq!(STATISTICS[0].outlier_threshold, default, "the correlation's row is the paper's test");
    }

    #[test]
    fn senseless_questions() {
        let (found, known, precision) = estimate();
        let negative = -&precision;
        assert!(matches!(
            KeyTests::new(&found, known.clone(), &negative),
            Err(KeyTestError::Ellipsoid(EllipsoidError::NotPositive { .. }))
        ));
        let tests = KeyTests::new(&found, known, &precision).unwrap();
        assert!(tests.compare(&[0.0; 4]).is_err() && tests.compare(&[f64::NAN; 5]).is_err());
    }
}
