//! The trials of one cell together.

use super::Method;
use super::beyond::BEYOND;
use super::paper::{ROWS, Row, table2};
use super::trial::Trial;
use anyhow::Context;
use serde::{Deserialize, Serialize};
use sombrero::basis::BasisFunction;
use sombrero::stats::median;

/// A cell of Table 1 or 2.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Cell {
    pub(crate) model: String,
    pub(crate) row: String,
    pub(crate) attack: String,
    pub(crate) basis: String,
    pub(crate) registration: bool,
    pub(crate) resampling: bool,
    /// One for each seed.
    pub(crate) log10_p: Vec<f64>,
    pub(crate) median_log10_p: f64,
    pub(crate) paper_log10_p: Option<f64>,
    /// Medians of the mark's displacement, relative to the largest side.
    pub(crate) relative_max: f64,
    pub(crate) relative_rms: f64,
    /// Attacks and detections of all seeds together.
    pub(crate) seconds: f64,
}

impl Cell {
    /// Gathers the trials of a model, a basis and a row; `None` when there are none.
    pub(crate) fn gather(
        trials: &[Trial],
        model: &str,
        row: &Row,
        function: BasisFunction,
        in_table1: bool,
    ) -> anyhow::Result<Option<Self>> {
        let mine = |t: &&Trial| t.model == model && t.row == row.letter && t.basis == function.name();
        let mut mine: Vec<&Trial> = trials.iter().filter(mine).collect();
        if mine.is_empty() {
            return Ok(None);
        }
        mine.sort_by_key(|t| t.seed);
        let middle = |value: fn(&Trial) -> f64| {
            median(&mine.iter().map(|t| value(t)).collect::<Vec<_>>()).context("a median of finite numbers")
        };
        Ok(Some(Self {
            model: model.into(),
            row: row.letter.into(),
            attack: row.attack.into(),
            basis: function.to_string(),
            registration: row.registration,
            resampling: row.resampling,
            log10_p: mine.iter().map(|t| t.log10_p).collect(),
            median_log10_p: middle(|t| t.log10_p)?,
            paper_log10_p: if in_table1 {
                row.paper_log10_p(model)
            } else {
                table2(model, row.letter, function)
            },
            relative_max: middle(|t| t.relative_max)?,
            relative_rms: middle(|t| t.relative_rms)?,
            seconds: mine.iter().map(|t| t.seconds).sum(),
        }))
    }
}

/// The rows with these letters, all of them when none is named: the paper's, and for the robust method more.
pub(crate) fn rows(method: Method, letters: &[String]) -> Vec<&'static Row> {
    let beyond = if method == Method::Paper { &[] } else { &BEYOND[..] };
    let all = ROWS.iter().chain(beyond);
    all.filter(|row| letters.is_empty() || letters.iter().any(|l| l == row.letter)).collect()
}
