//! `cargo xtask calibrate`: whether the probability that detection tells is the rate at which it errs (the
//! paper, section 4: P_fp is the probability that a random watermark correlates as well).
//!
//! For each kind of suspect, none of which carries the mark, w* is extracted from several suspects, and very
//! many random watermarks are tested against it. Of them a share of p may have a false-positive probability of
//! p or less. With `--pipeline`, unmarked suspects also go through the whole detection, which picks the best of
//! its variants and has to correct p for that.

mod key_tests;
mod looks;
mod pipeline;
mod suspects;

use super::case::Case;
use super::plot::{self, Axis, Panel, Series};
use super::tables::Method;
use anyhow::{Context, bail};
use indicatif::{ProgressBar, ProgressStyle};
use key_tests::{Extracted, KeyTest, Known};
use looks::Innocent;
use pipeline::Pipeline;
use plotters::chart::SeriesLabelPosition;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::Serialize;
use sombrero::stats::wilson_interval;
use std::path::{Path, PathBuf};
use suspects::{KINDS, OTHER_MODEL, other_models};

/// Whether probabilities are rates.
#[derive(clap::Args)]
pub(crate) struct Calibrate {
    /// The method; with `paper` the preset is the paper's too.
    #[arg(long, value_enum, default_value_t = Method::Paper)]
    method: Method,
    /// Random watermarks for each kind of suspect.
    #[arg(long, default_value_t = 1_000_000)]
    keys: u64,
    /// Unmarked suspects for the whole detection; 1000 take some minutes, and 0 leaves this part out.
    #[arg(long, default_value_t = 0)]
    pipeline: u64,
    /// Only the looks at mirror images, kits, point clouds and warps, by the robust method: `calibration-looks.json` and `.svg`. The
    /// pipeline's suspects then ask for these looks, and half as many are kits.
    #[arg(long)]
    looks: bool,
    /// Where `calibration.json` and `calibration.svg` are written; with the robust method `calibration-robust`.
    #[arg(long, default_value = "docs")]
    out: PathBuf,
}

const CONFIDENCE: f64 = 0.99;
const SEED: u64 = 1999;
/// Watermarks that one stream of random numbers gives, whatever the number of threads.
const CHUNK: u64 = 10_000;
/// Streams of a kind; the last ones make its suspects.
const STREAMS: u64 = 1 << 32;
/// Rates from 10^-1 down to 10^-LAST.
const LAST: i32 = 6;

/// `calibration.json`.
#[derive(Serialize)]
struct Report {
    seed: u64,
    confidence: f64,
    keys: u64,
    kinds: Vec<Calibrated>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pipeline: Option<Pipeline>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    innocent: Vec<Innocent>,
}

/// What one kind of suspect gave.
#[derive(Serialize)]
struct Calibrated {
    kind: &'static str,
    suspects: Vec<Known>,
    rates: Vec<Rate>,
}

/// How often p was at most `theoretical`.
#[derive(Serialize)]
struct Rate {
    theoretical: f64,
    count: usize,
    empirical: f64,
    low: f64,
    high: f64,
}

impl Rate {
    fn new(theoretical: f64, count: usize, trials: usize) -> anyhow::Result<Self> {
        let interval = wilson_interval(count, trials, CONFIDENCE).context("nothing was tried")?;
        let empirical = count as f64 / trials as f64;
        Ok(Self { theoretical, count, empirical, low: interval.low, high: interval.high })
    }

    /// Those of whole detections, given the log10 p of those that could be made.
    fn all(theoretical: &[f64], log10_p: &[f64], trials: usize) -> anyhow::Result<Vec<Self>> {
        let rate = |&theoretical: &f64| {
            let count = log10_p.iter().filter(|p| **p <= theoretical.log10()).count();
            Self::new(theoretical, count, trials)
        };
        theoretical.iter().map(rate).collect()
    }

    fn print(&self) {
        let Self { theoretical, empirical, low, high, .. } = self;
        println!("  {theoretical}: {empirical:.4} ({low:.4} to {high:.4})");
    }
}

pub(crate) fn run(args: &Calibrate, folder: &Path) -> anyhow::Result<()> {
    if args.keys < CHUNK || !args.keys.is_multiple_of(CHUNK) {
        bail!("the number of keys must be a multiple of {CHUNK}");
    }
    let suffix = args.method.suffix();
    if args.looks {
        return run_looks(args, folder);
    }
    let read = |file| Case::read(folder, file, args.method.preset());
    let cases = [("fandisk", read("fandisk.obj")?), ("head", read("head.obj")?)];
    let wanted = KINDS.iter().filter(|kind| args.method == Method::Robust || !kind.surface);
    let bar = bar((wanted.clone().count() as u64 + 1) * args.keys, "watermarks")?;
    let mut kinds = Vec::new();
    for (which, kind) in (0..).zip(wanted) {
        let suspects = kind.suspects(args.method, &cases, &mut rng(which, STREAMS - 1))?;
        kinds.push(Calibrated::new(kind.name, which, &suspects, args.keys, &bar)?);
    }
    let which = KINDS.len() as u64;
    let suspects = other_models(args.method, &cases, which)?;
    kinds.push(Calibrated::new(OTHER_MODEL, which, &suspects, args.keys, &bar)?);
    bar.finish_and_clear();
    kinds.iter().for_each(Calibrated::print);
    let pipeline = (args.pipeline > 0).then(|| Pipeline::run(args.method, args.pipeline)).transpose()?;
    write(args, &format!("calibration{suffix}"), kinds, pipeline, Vec::new())
}

/// The kinds of suspects that have looks of their own.
fn run_looks(args: &Calibrate, folder: &Path) -> anyhow::Result<()> {
    if args.method == Method::Paper {
        bail!("the paper's method has one look; ask with --method robust or faithful");
    }
    let read = |file| Case::read(folder, file, args.method.preset());
    let cases = [("fandisk", read("fandisk.obj")?), ("head", read("head.obj")?)];
    let bar = bar(looks::KINDS.len() as u64 * args.keys, "watermarks")?;
    let mut kinds = Vec::new();
    for which in 0..looks::KINDS.len() {
        let suspects = looks::suspects(which, args.method.preset(), &cases)?;
        if suspects.is_empty() {
            bail!("the search showed nothing of {}", looks::KINDS[which].name);
        }
        // Streams beside those of the usual kinds.
        let stream = 200 + which as u64;
        kinds.push(Calibrated::new(looks::KINDS[which].name, stream, &suspects, args.keys, &bar)?);
    }
    bar.finish_and_clear();
    kinds.iter().for_each(Calibrated::print);
    let innocent = if args.pipeline > 0 { Innocent::run(args.method, args.pipeline)? } else { Vec::new() };
    write(args, "calibration-looks", kinds, None, innocent)
}

/// `name.svg` and `name.json`.
fn write(
    args: &Calibrate,
    name: &str,
    kinds: Vec<Calibrated>,
    pipeline: Option<Pipeline>,
    innocent: Vec<Innocent>,
) -> anyhow::Result<()> {
    std::fs::create_dir_all(&args.out)?;
    plot::write(&args.out.join(format!("{name}.svg")), (760, 600), &[panel(&kinds)])?;
    let report = Report { seed: SEED, confidence: CONFIDENCE, keys: args.keys, kinds, pipeline, innocent };
    let text = serde_json::to_string_pretty(&report)? + "\n";
    Ok(std::fs::write(args.out.join(format!("{name}.json")), text)?)
}

fn bar(length: u64, what: &str) -> anyhow::Result<ProgressBar> {
    let template = format!("{{elapsed}} {{bar:40}} {{human_pos}}/{{human_len}} {what}, {{eta}} left");
    Ok(ProgressBar::new(length).with_style(ProgressStyle::with_template(&template)?))
}

/// Random numbers of their own for each stream of each kind.
fn rng(kind: u64, stream: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    rng.set_stream(kind * STREAMS + stream);
    rng
}

impl Calibrated {
    /// Tests `keys` random watermarks, a chunk against one suspect each, in turn.
    fn new(
        kind: &'static str,
        which: u64,
        suspects: &[Extracted],
        keys: u64,
        bar: &ProgressBar,
    ) -> anyhow::Result<Self> {
        let chunks = (0..keys / CHUNK).into_par_iter().map(|chunk| {
            let suspect = &suspects[chunk as usize % suspects.len()];
            let counts = count(&suspect.test, &mut rng(which, chunk))?;
            bar.inc(CHUNK);
            Ok(counts)
        });
        let sum = |a: Counts, b: Counts| Ok(std::array::from_fn(|i| a[i] + b[i]));
        let counts: Counts = chunks.try_reduce(Counts::default, sum).map_err(|e: anyhow::Error| e)?;
        let rates = (1..=LAST).zip(counts).map(|(k, count)| Rate::new(level(k), count, keys as usize));
        let suspects = suspects.iter().map(Extracted::known).collect();
        Ok(Self { kind, suspects, rates: rates.collect::<anyhow::Result<_>>()? })
    }

    fn print(&self) {
        println!("{} ({} suspects)", self.kind, self.suspects.len());
        for Rate { theoretical, empirical, low, high, .. } in &self.rates {
            println!("  {theoretical:e}: {empirical:.2e} ({low:.2e} to {high:.2e})");
        }
    }
}

/// 10^-k, to the digit.
fn level(k: i32) -> f64 {
    1.0 / 10f64.powi(k)
}

/// How many watermarks had p of at most 10^-1, 10^-2 and so on.
type Counts = [usize; LAST as usize];

fn count(test: &KeyTest, rng: &mut ChaCha8Rng) -> anyhow::Result<Counts> {
    let mut counts = Counts::default();
    let mut w = vec![0.0; test.length()];
    for _ in 0..CHUNK {
        w.fill_with(|| StandardNormal.sample(rng));
        counts.iter_mut().take(test.rates(&w)?).for_each(|count| *count += 1);
    }
    Ok(counts)
}

/// Rates against rates, both logarithmic.
fn panel(kinds: &[Calibrated]) -> Panel {
    const LEAST: f64 = -7.0;
    let log = |rate: f64| rate.log10().max(LEAST);
    let middle = 0.5 * (kinds.len() as f64 - 1.0);
    let series = (0..).zip(kinds).map(|(i, kind)| {
        // Side by side, so that intervals do not hide each other.
        let x = |rate: &Rate| rate.theoretical.log10() + 0.07 * (f64::from(i) - middle);
        let seen = kind.rates.iter().filter(|rate| rate.count > 0);
        Series {
            name: kind.kind.into(),
            points: seen.map(|rate| (x(rate), log(rate.empirical))).collect(),
            intervals: kind.rates.iter().map(|rate| (x(rate), log(rate.low), log(rate.high))).collect(),
            dots: true,
        }
    });
    let rate = |label| Axis { label, range: LEAST..0.0, powers: true, ticks: 8 };
    Panel {
        caption: "Random watermarks whose false-positive probability is at most p",
        x: rate("p"),
        y: rate("share of the watermarks, with 99 % intervals"),
        series: series.collect(),
        diagonal: true,
        legend: Some(SeriesLabelPosition::UpperLeft),
    }
}
