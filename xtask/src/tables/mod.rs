//! `cargo xtask tables`: the paper's Tables 1, 2 and 3, ours beside its.

mod cell;
mod check;
mod paper;
mod show;

use crate::tables::cell::{Cell, Subject};
use anyhow::{Context, bail};
use indicatif::{ProgressBar, ProgressStyle};
use paper::{MODELS, ROWS, Row, TABLE2};
use rayon::prelude::*;
use sombrero::basis::BasisFunction;
use std::path::{Path, PathBuf};

/// What to recompute.
#[derive(clap::Args)]
pub(crate) struct Tables {
    /// Seeds for each cell.
    #[arg(long, default_value_t = 5)]
    runs: u64,
    /// Models, separated by commas. Default: all four.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Rows of Table 1, separated by commas. Default: all.
    #[arg(long, value_delimiter = ',')]
    rows: Vec<String>,
    /// Where to write the tables.
    #[arg(long, default_value = "docs/tables")]
    out: PathBuf,
    /// Recompute, compare with the recorded tables, write nothing.
    #[arg(long)]
    check: bool,
}

impl Tables {
    /// What CI checks.
    pub(crate) fn check() -> Self {
        Self { runs: 5, only: Vec::new(), rows: Vec::new(), out: "docs/tables".into(), check: true }
    }
}

/// A cell to compute: which model, basis and row.
struct Job<'a> {
    subject: &'a Subject,
    row: &'static Row,
    paper: Option<f64>,
}

pub(crate) fn run(args: &Tables, folder: &Path) -> anyhow::Result<()> {
    let known: Vec<&str> = MODELS.iter().map(|m| m.name).collect();
    if let Some(unknown) = args.only.iter().find(|name| !known.contains(&name.as_str())) {
        bail!("`{unknown}` is none of the models; known are {}", known.join(", "));
    }
    let wanted = |name: &str| args.only.is_empty() || args.only.iter().any(|m| m == name);
    let rows: Vec<&'static Row> =
        ROWS.iter().filter(|row| args.rows.is_empty() || args.rows.iter().any(|r| r == row.letter)).collect();
    if rows.is_empty() {
        bail!("no row of Table 1 is called {}", args.rows.join(" or "));
    }
    let (mut table1, mut table2) = (Vec::new(), Vec::new());
    for (column, model) in MODELS.iter().enumerate().filter(|(_, m)| wanted(m.name)) {
        for function in BasisFunction::ALL {
            let second: Vec<(&Row, Option<f64>)> = TABLE2
                .iter()
                .filter(|entry| entry.model == model.name)
                .filter_map(|entry| {
                    Some((*rows.iter().find(|r| r.letter == entry.row)?, entry.value(function)))
                })
                .collect();
            let sombrero = function == BasisFunction::Sombrero;
            if !sombrero && second.is_empty() {
                continue;
            }
            let subject = Subject::read(folder, model, function).context("run `cargo xtask models` first")?;
            if sombrero {
                let job = |row| Job { subject: &subject, row, paper: Some(row.paper[column]) };
                table1.extend(compute(rows.iter().map(|row| job(row)).collect(), args.runs)?);
            }
            let job = |&(row, paper): &(&'static Row, Option<f64>)| Job { subject: &subject, row, paper };
            let rows: Vec<Job<'_>> = second
                .iter()
                .map(|(row, paper)| {
                    (ROWS.iter().find(|r| r.letter == row.letter).unwrap_or(&ROWS[0]), *paper)
                })
                .map(|pair| job(&pair))
                .collect();
            table2.extend(compute(rows, args.runs)?);
        }
    }
    if args.check {
        return check::check(&args.out, &table1, &table2);
    }
    show::write(&args.out, args.runs, &table1, &table2)
}

/// Computes cells in parallel; the order of the result is that of the jobs.
fn compute(jobs: Vec<Job<'_>>, runs: u64) -> anyhow::Result<Vec<Cell>> {
    let bar = ProgressBar::new(jobs.len() as u64);
    bar.set_style(ProgressStyle::with_template("{msg:<16} {bar:30} {pos}/{len} {eta}")?);
    if let Some(job) = jobs.first() {
        bar.set_message(job.subject.title());
    }
    let cells = jobs
        .par_iter()
        .map(|job| {
            let cell = Cell::compute(job.subject, job.row, job.paper, runs);
            bar.inc(1);
            cell
        })
        .collect();
    bar.finish_and_clear();
    cells
}
