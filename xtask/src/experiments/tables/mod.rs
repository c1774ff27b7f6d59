//! `cargo xtask tables`: the paper's Tables 1, 2 and 3, ours beside its.

mod beyond;
mod cell;
mod check;
mod journal;
pub(crate) mod paper;
mod show;
mod times;
mod trial;

use anyhow::bail;
use cell::{Cell, rows};
use indicatif::{ProgressBar, ProgressStyle};
use journal::Journal;
use paper::{MODELS, Model, Row, TABLE2};
use rayon::prelude::*;
use sombrero::basis::BasisFunction;
use sombrero::watermark::Preset;
use std::path::{Path, PathBuf};
use trial::{Subject, Trial};

/// What to recompute.
#[derive(clap::Args)]
pub(crate) struct Tables {
    /// Seeds for each cell.
    #[arg(long, default_value_t = 5)]
    runs: u64,
    /// The method, with the preset that goes with it: the paper's both, or the robust method with one of its presets.
    #[arg(long, value_enum, default_value_t = Method::Paper)]
    method: Method,
    /// Models, separated by commas. Default: all four.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Rows of Table 1, separated by commas. Default: all.
    #[arg(long, value_delimiter = ',')]
    rows: Vec<String>,
    /// Where the tables are written, or are recorded. Default: docs/tables for the paper's method, docs/tables/robust.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Recompute what fits in CI's time, compare with the recorded tables, write nothing.
    #[arg(long)]
    check: bool,
}

impl Tables {
    /// What CI checks.
    pub(crate) fn check(method: Method) -> Self {
        Self { runs: 5, method, only: Vec::new(), rows: Vec::new(), out: None, check: true }
    }

    fn folder(&self) -> PathBuf {
        let usual = match self.method {
            Method::Paper => "docs/tables",
            Method::Robust => "docs/tables/robust",
            Method::Faithful => "docs/tables/faithful",
        };
        self.out.clone().unwrap_or_else(|| usual.into())
    }
}

/// The method, as the command line has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Method {
    Paper,
    Robust,
    /// The robust method on marks of the preset faithful.
    Faithful,
}

impl Method {
    fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Robust => "robust",
            Self::Faithful => "faithful",
        }
    }

    /// The functions to compare, that of Table 1 first.
    fn functions(self) -> &'static [BasisFunction] {
        match self {
            Self::Paper | Self::Robust => {
                &[BasisFunction::Sombrero, BasisFunction::Derby, BasisFunction::Hat]
            }
            Self::Faithful => &[BasisFunction::Field],
        }
    }

    /// The function of Table 1.
    fn main_function(self) -> BasisFunction {
        self.functions()[0]
    }

    /// The preset that goes with it.
    pub(crate) fn preset(self) -> Preset {
        match self {
            Self::Paper => Preset::Paper,
            Self::Robust => Preset::Robust,
            Self::Faithful => Preset::Faithful,
        }
    }

    /// What the names of its results end in.
    pub(crate) fn suffix(self) -> &'static str {
        match self {
            Self::Paper => "",
            Self::Robust => "-robust",
            Self::Faithful => "-faithful",
        }
    }
}

impl From<Method> for sombrero::Method {
    fn from(method: Method) -> Self {
        match method {
            Method::Paper => Self::Paper,
            Method::Robust | Method::Faithful => Self::Robust,
        }
    }
}

/// A model with a mark, and the rows to try on it.
struct Job {
    method: Method,
    model: &'static Model,
    function: BasisFunction,
    seed: u64,
    rows: Vec<&'static Row>,
}

pub(crate) fn run(args: &Tables, folder: &Path) -> anyhow::Result<()> {
    let models = models(&args.only)?;
    let mut wanted = rows(args.method, &args.rows);
    if args.check {
        wanted.retain(|row| check::is_quick(row));
    }
    if wanted.is_empty() {
        bail!("no row of Table 1 is called {}", args.rows.join(" or "));
    }
    let jobs = jobs(args.method, &models, &wanted, args.runs);
    let trials = compute(&jobs, folder)?;
    let (mut table1, mut table2, mut beyond) = (Vec::new(), Vec::new(), Vec::new());
    for model in &models {
        for row in &wanted {
            for &function in args.method.functions() {
                let is_main = function == args.method.main_function();
                let Some(cell) = Cell::gather(&trials, model.name, row, function, is_main)? else { continue };
                if in_table2(model, row) && args.method != Method::Faithful {
                    table2.push(cell.clone());
                }
                if is_main {
                    if row.is_beyond() { beyond.push(cell) } else { table1.push(cell) }
                }
            }
        }
    }
    if args.check {
        return check::check(&args.folder(), &table1, &table2);
    }
    let table3 =
        models.iter().map(|model| times::measure(folder, model)).collect::<anyhow::Result<Vec<_>>>()?;
    show::write(&args.folder(), args.method.name(), args.runs, [&table1, &table2, &beyond], &table3)
}

fn models(only: &[String]) -> anyhow::Result<Vec<&'static Model>> {
    let known: Vec<&str> = MODELS.iter().map(|m| m.name).collect();
    if let Some(unknown) = only.iter().find(|name| !known.contains(&name.as_str())) {
        bail!("`{unknown}` is none of the models; known are {}", known.join(", "));
    }
    Ok(MODELS.iter().filter(|m| only.is_empty() || only.iter().any(|name| name == m.name)).collect())
}

fn in_table2(model: &Model, row: &Row) -> bool {
    TABLE2.iter().any(|c| c.model == model.name && c.row == row.letter)
}

/// The large models first, so that the last job is a short one.
fn jobs(method: Method, models: &[&'static Model], wanted: &[&'static Row], runs: u64) -> Vec<Job> {
    let mut jobs = Vec::new();
    for &model in models.iter().rev() {
        for &function in method.functions() {
            let is_main = function == method.main_function();
            let rows: Vec<&'static Row> =
                wanted.iter().copied().filter(|row| is_main || in_table2(model, row)).collect();
            if !rows.is_empty() {
                jobs.extend((0..runs).map(|seed| Job { method, model, function, seed, rows: rows.clone() }));
            }
        }
    }
    jobs
}

/// Runs the jobs on all cores; trials that the journal has are not repeated.
fn compute(jobs: &[Job], folder: &Path) -> anyhow::Result<Vec<Trial>> {
    let journal = Journal::open()?;
    let bar = ProgressBar::new(jobs.iter().map(|job| job.rows.len() as u64).sum());
    bar.set_style(ProgressStyle::with_template("{elapsed} {bar:40} {pos}/{len} trials, {eta} left")?);
    let trials = jobs.par_iter().map(|job| {
        let known = |row: &&Row| {
            journal
                .find(job.method.name(), job.model.name, job.function.name(), row.letter, job.seed)
                .cloned()
        };
        let (mut done, mut marked) = (Vec::new(), None::<Subject>);
        for row in &job.rows {
            if let Some(trial) = known(row) {
                done.push(trial);
            } else {
                if marked.is_none() {
                    marked = Some(Subject::new(folder, job.method, job.model, job.function, job.seed)?);
                }
                if let Some(marked) = &marked {
                    let trial = marked.trial(row)?;
                    journal.add(&trial)?;
                    done.push(trial);
                }
            }
            bar.inc(1);
        }
        Ok(done)
    });
    let trials = trials.collect::<anyhow::Result<Vec<Vec<Trial>>>>()?;
    bar.finish_and_clear();
    Ok(trials.concat())
}
