//! `cargo xtask alignment`: how often a suspect is brought back onto the original without a hint, and how often
//! the answer says rightly whether it can be trusted.
//!
//! A trial damages a model, moves it by a random similarity (any rotation, scales from 0.1 to 10) and asks for
//! the way back. A pose is right when no vertex of the original ends up farther from its place than 1 % of
//! the largest side. Of a symmetric shape several poses look alike; a trial succeeds when one of those returned
//! is right, or when the best one puts the shape onto itself.

mod damage;
mod moves;
mod shapes;
mod trial;

use anyhow::bail;
use damage::KINDS;
use indicatif::{ProgressBar, ProgressStyle};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use shapes::{others, subjects};
use sombrero::stats::median;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use trial::{Outcome, Subject};

/// Alignment without a hint.
#[derive(clap::Args)]
pub(crate) struct Alignment {
    /// Trials of each kind on each model.
    #[arg(long, default_value_t = 100)]
    trials: u64,
    /// Only models and kinds whose names contain one of these, as `bunny` or `bunny/third`.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    only: Vec<String>,
    /// Where the results are written, without the endings `.md` and `.json`.
    #[arg(long, default_value = "docs/alignment")]
    out: PathBuf,
}

const SEED: u64 = 1999;

/// `alignment.json`.
#[derive(Serialize)]
struct Report {
    seed: u64,
    trials: u64,
    rows: Vec<Row>,
}

/// One kind on one model.
#[derive(Serialize)]
struct Row {
    model: &'static str,
    kind: &'static str,
    trials: usize,
    right: usize,
    trusted: usize,
    right_untrusted: usize,
    wrong_trusted: usize,
    median_cpu_seconds: f64,
    median_wall_seconds: f64,
    median_hypotheses: f64,
    /// The trials that were not both right and trusted.
    exceptions: Vec<Outcome>,
}

pub(crate) fn run(args: &Alignment, folder: &Path) -> anyhow::Result<()> {
    let wanted =
        |name: &str| args.only.is_empty() || args.only.iter().any(|part| name.contains(part.as_str()));
    let others = others();
    let mut rows = Vec::new();
    for make in subjects(folder) {
        let (name, symmetric) = (make.0, make.1);
        let kinds: Vec<_> = KINDS.iter().filter(|k| wanted(&format!("{name}/{}", k.1))).collect();
        if kinds.is_empty() {
            continue;
        }
        let subject = Subject::new(name, (make.2)()?, symmetric)?;
        for &&(kind, label, _) in &kinds {
            // Each kind has random numbers of its own, whatever else is run.
            let stream = KINDS.iter().position(|k| k.0 == kind).unwrap_or(0) as u64;
            let bar = bar(args.trials, &format!("{name}, {label}"))?;
            let trials = (0..args.trials).map(|trial| {
                let mut rng = ChaCha8Rng::seed_from_u64(SEED);
                rng.set_stream(stream << 32 | trial);
                bar.inc(1);
                subject.trial(kind, trial, &others, &mut rng)
            });
            let outcomes = trials.collect::<anyhow::Result<Vec<_>>>()?;
            bar.finish_and_clear();
            let row = Row::new(name, label, outcomes);
            row.print();
            rows.push(row);
        }
    }
    if rows.is_empty() {
        bail!("nothing is called {:?}", args.only);
    }
    let report = Report { seed: SEED, trials: args.trials, rows };
    if let Some(parent) = args.out.parent() {
        std::fs::create_dir_all(parent)?;
    }
    std::fs::write(args.out.with_extension("md"), report.markdown())?;
    let json = serde_json::to_string_pretty(&report)? + "\n";
    Ok(std::fs::write(args.out.with_extension("json"), json)?)
}

fn bar(length: u64, what: &str) -> anyhow::Result<ProgressBar> {
    let template = format!("{{elapsed}} {{bar:40}} {{pos}}/{{len}} {what}, {{eta}} left");
    Ok(ProgressBar::new(length).with_style(ProgressStyle::with_template(&template)?))
}

impl Row {
    fn new(model: &'static str, kind: &'static str, outcomes: Vec<Outcome>) -> Self {
        let count = |keep: &dyn Fn(&Outcome) -> bool| outcomes.iter().filter(|o| keep(o)).count();
        let middle = |value: &dyn Fn(&Outcome) -> f64| {
            median(&outcomes.iter().map(value).collect::<Vec<_>>()).unwrap_or(0.0)
        };
        Self {
            model,
            kind,
            trials: outcomes.len(),
            right: count(&|o| o.right),
            trusted: count(&|o| o.trusted),
            right_untrusted: count(&|o| o.right && !o.trusted),
            wrong_trusted: count(&|o| !o.right && o.trusted),
            median_cpu_seconds: middle(&|o| o.cpu_seconds),
            median_wall_seconds: middle(&|o| o.wall_seconds),
            median_hypotheses: middle(&|o| o.hypotheses as f64),
            exceptions: outcomes.into_iter().filter(|o| !(o.right && o.trusted)).collect(),
        }
    }

    fn print(&self) {
        let Self { model, kind, trials, right, trusted, right_untrusted, wrong_trusted, .. } = self;
        println!(
            "{model:12} {kind:18} right {right}/{trials}, trusted {trusted}, right but untrusted \
             {right_untrusted}, wrong but trusted {wrong_trusted}, {:.2} s CPU, {:.2} s, {} poses",
            self.median_cpu_seconds, self.median_wall_seconds, self.median_hypotheses
        );
    }
}

impl Report {
    fn markdown(&self) -> String {
        let mut text = String::from(
            "# Alignment without a hint\n\n\
             Written by `cargo xtask alignment`. Right: no vertex of the original farther from its place than 1 % \
             of the largest side under one of the returned poses, or, for symmetric shapes, the first one puts the \
             shape onto itself. Seconds are medians of processor time, all threads, and of the clock.\n\n\
             | kind | what is done before the model is moved by a random similarity, scale 0.1 to 10 |\n|---|---|\n",
        );
        for (_, label, what) in KINDS {
            let _ = writeln!(text, "| {label} | {what} |");
        }
        text += "\n| model | kind | right | trusted | right, untrusted | wrong, trusted | poses | CPU s | s |\n\
                 |---|---|---|---|---|---|---|---|---|\n";
        for row in &self.rows {
            let Row { model, kind, trials, right, trusted, right_untrusted, wrong_trusted, .. } = row;
            let right = if *kind == "unrelated" { "–".into() } else { format!("{right} of {trials}") };
            let _ = writeln!(
                text,
                "| {model} | {kind} | {right} | {trusted} | {right_untrusted} | {wrong_trusted} | {} | {:.2} | {:.2} |",
                row.median_hypotheses, row.median_cpu_seconds, row.median_wall_seconds
            );
        }
        text
    }
}
