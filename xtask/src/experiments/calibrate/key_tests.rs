//! The tests of a suspect, each ready for very many watermarks.

use super::LAST;
use serde::Serialize;
use sombrero::extraction::Estimate;
use sombrero::stats::{
    Ellipsoid, LogProbability, STATISTICS, Statistic, WatermarkTestOptions, watermark_test,
};

/// A suspect by name, and how many coefficients could be extracted from it. The test leaves out those beyond 2.5;
/// with fewer than three left, as another model may have, p is 1 for every watermark.
#[derive(Serialize)]
pub(super) struct Known {
    suspect: String,
    coefficients: usize,
}

/// A suspect, as one test sees it.
pub(super) struct Extracted {
    pub(super) name: String,
    pub(super) test: KeyTest,
}

/// The test of one suspect.
pub(super) enum KeyTest {
    Correlation(Vec<Option<f64>>),
    /// With the distance that belongs to each rate.
    Ellipsoid(Box<Ellipsoid>, [f64; LAST as usize]),
}

impl KeyTest {
    fn ellipsoid(estimate: &Estimate, floor: f64) -> anyhow::Result<Self> {
        let ellipsoid = Ellipsoid::new(&estimate.coefficients, &estimate.precision)?.with_floor(floor)?;
        let limits =
            std::array::from_fn(|i| ellipsoid.distance_at(LogProbability::from_log10(-(i as f64) - 1.0)));
        Ok(Self::Ellipsoid(Box::new(ellipsoid), limits))
    }

    fn coefficients(&self) -> usize {
        match self {
            Self::Correlation(w) => w.iter().flatten().count(),
            Self::Ellipsoid(ellipsoid, _) => ellipsoid.rank(),
        }
    }

    pub(super) fn length(&self) -> usize {
        match self {
            Self::Correlation(w) => w.len(),
            Self::Ellipsoid(ellipsoid, _) => ellipsoid.dimension(),
        }
    }

    /// How many of these rates p is at most.
    pub(super) fn rates(&self, w: &[f64]) -> anyhow::Result<usize> {
        Ok(match self {
            Self::Correlation(extracted) => {
                let log10_p = watermark_test(w, extracted, &WatermarkTestOptions::default())?.log10_p();
                (1..=LAST).take_while(|k| log10_p <= -f64::from(*k)).count()
            }
            Self::Ellipsoid(ellipsoid, limits) => {
                let distance = ellipsoid.distance(w)?;
                limits.iter().take_while(|limit| distance <= **limit).count()
            }
        })
    }
}

/// Every test that the robust method makes of an estimate.
pub(super) fn key_tests(name: &str, estimate: &Estimate) -> anyhow::Result<Vec<Extracted>> {
    let key_test = |statistic: Statistic| {
        let test = match statistic.floor {
            None => KeyTest::Correlation(estimate.known()),
            Some(floor) => KeyTest::ellipsoid(estimate, floor)?,
        };
        Ok(Extracted { name: format!("{name}, {statistic}"), test })
    };
    STATISTICS.into_iter().map(key_test).collect()
}

impl Extracted {
    pub(super) fn known(&self) -> Known {
        Known { suspect: self.name.clone(), coefficients: self.test.coefficients() }
    }
}
