//! `cargo xtask roc`: the paper's Figure 6, how often a mark is missed at each false-positive rate, for noise
//! of three amplitudes on the fandisk.
//!
//! Each trial marks the fandisk with a fresh secret, adds fresh noise, extracts with the known correspondence
//! and gives a false-positive probability P. A curve has a point for each trial k: (P_k, share of the trials
//! whose P is larger).

use super::case::{Case, Marked, random_secret};
use super::plot::{self, Axis, Panel, Series};
use super::tables::Method;
use anyhow::{Context, bail};
use indicatif::{ProgressBar, ProgressStyle};
use plotters::chart::SeriesLabelPosition;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::attacks::{Attack, Noise, Operation};
use sombrero::stats::{median, wilson_interval};
use sombrero::{DetectOptions, Suspect, When};
use std::path::{Path, PathBuf};

/// How often a mark is missed.
#[derive(clap::Args)]
pub(crate) struct Roc {
    /// Trials for each amplitude; the paper made 200.
    #[arg(long, default_value_t = 200)]
    trials: u32,
    /// The method; with `paper` the preset is the paper's too.
    #[arg(long, value_enum, default_value_t = Method::Paper)]
    method: Method,
    /// Where `roc.json` and `roc.svg` are written; with the robust method `roc-robust.json` and `roc-robust.svg`.
    #[arg(long, default_value = "docs")]
    out: PathBuf,
}

/// An amplitude of Figures 5 and 6: the row of Table 1, and the share of the largest side.
pub(crate) const AMPLITUDES: [(&str, f64); 3] = [("C", 0.002), ("D", 0.0045), ("E", 0.007)];
/// False-positive rates at which the false-negative rate is told.
const RATES: [f64; 2] = [1e-3, 1e-6];
const CONFIDENCE: f64 = 0.95;
const SEED: u64 = 6;

/// `roc.json`.
#[derive(Serialize)]
struct Report {
    figure: u32,
    model: &'static str,
    trials: u32,
    seed: u64,
    confidence: f64,
    curves: Vec<Curve>,
}

/// One amplitude.
#[derive(Serialize)]
struct Curve {
    row: &'static str,
    attack: String,
    amplitude: f64,
    median_log10_p: Option<f64>,
    false_negatives: Vec<Missed>,
    /// One a trial, most certain first.
    points: Vec<Point>,
}

/// How many marks are missed when `false_positive_rate` is the threshold.
#[derive(Serialize)]
struct Missed {
    false_positive_rate: f64,
    missed: usize,
    rate: f64,
    low: f64,
    high: f64,
    /// The paper's rate, where it names one.
    #[serde(skip_serializing_if = "Option::is_none")]
    paper_rate: Option<f64>,
}

#[derive(Serialize)]
struct Point {
    log10_false_positive: f64,
    false_negative: f64,
}

pub(crate) fn run(args: &Roc, folder: &Path) -> anyhow::Result<()> {
    if args.trials == 0 {
        bail!("a curve needs at least one trial");
    }
    let suffix = args.method.suffix();
    let fandisk = Case::read(folder, "fandisk.obj", args.method.preset())?;
    let bar = ProgressBar::new(u64::from(args.trials) * AMPLITUDES.len() as u64);
    bar.set_style(ProgressStyle::with_template("{elapsed} {bar:40} {pos}/{len} trials, {eta} left")?);
    let curves = (0..).zip(AMPLITUDES).map(|(which, (row, amplitude))| {
        let log10_p = (0..args.trials).into_par_iter().map(|k| {
            let stream = u64::from(which * args.trials + k);
            trial(&fandisk, args.method, amplitude, stream).inspect(|_| bar.inc(1))
        });
        Curve::new(row, amplitude, log10_p.collect::<anyhow::Result<_>>()?)
    });
    let curves = curves.collect::<anyhow::Result<Vec<Curve>>>()?;
    bar.finish_and_clear();
    curves.iter().for_each(Curve::print);
    std::fs::create_dir_all(&args.out)?;
    plot::write(&args.out.join(format!("roc{suffix}.svg")), (1000, 440), &panels(&curves))?;
    let (model, confidence) = ("fandisk", CONFIDENCE);
    let report = Report { figure: 6, model, trials: args.trials, seed: SEED, confidence, curves };
    let text = serde_json::to_string_pretty(&report)? + "\n";
    Ok(std::fs::write(args.out.join(format!("roc{suffix}.json")), text)?)
}

/// log10 of the false-positive probability of a fresh mark under fresh noise.
fn trial(case: &Case, method: Method, amplitude: f64, stream: u64) -> anyhow::Result<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    rng.set_stream(stream);
    let Marked { detector, copy } = case.marked(random_secret(&mut rng))?;
    let attacked = Noise { amplitude }.apply(&copy, &mut rng)?;
    let correspondence = Some(attacked.correspondence(copy.points.len()));
    let suspect = Suspect { soup: attacked.soup, correspondence, cloud: false };
    let usual = DetectOptions { method: method.into(), ..DetectOptions::default() };
    // The paper looked once, at the vertices where they are.
    let options = match method {
        Method::Paper => DetectOptions { registration: When::Never, resampling: When::Never, ..usual },
        Method::Robust | Method::Faithful => usual,
    };
    Ok(detector.detect(&suspect, &options)?.log10_p)
}

impl Curve {
    fn new(row: &'static str, amplitude: f64, mut log10_p: Vec<f64>) -> anyhow::Result<Self> {
        log10_p.sort_by(f64::total_cmp);
        let larger = |p: f64| log10_p.len() - log10_p.partition_point(|&other| other <= p);
        let share = |count: usize| count as f64 / log10_p.len() as f64;
        let missed = |rate: f64| {
            let missed = larger(rate.log10());
            let interval = wilson_interval(missed, log10_p.len(), CONFIDENCE).context("no trials")?;
            let paper_rate = (row == "E" && rate == 1e-3).then_some(0.37);
            let (low, high) = (interval.low, interval.high);
            Ok(Missed { false_positive_rate: rate, missed, rate: share(missed), low, high, paper_rate })
        };
        let point = |&p: &f64| Point { log10_false_positive: p, false_negative: share(larger(p)) };
        Ok(Self {
            row,
            attack: Attack::from(Noise { amplitude }).to_string(),
            amplitude,
            median_log10_p: median(&log10_p),
            false_negatives: RATES.into_iter().map(missed).collect::<anyhow::Result<_>>()?,
            points: log10_p.iter().map(point).collect(),
        })
    }

    fn print(&self) {
        println!("{}: noise of {:.2} %", self.row, 100.0 * self.amplitude);
        for Missed { false_positive_rate, rate, low, high, paper_rate, .. } in &self.false_negatives {
            let [rate, low, high] = [rate, low, high].map(|r| 100.0 * r);
            print!("  missed at {false_positive_rate:e}: {rate:.1} % ({low:.1} to {high:.1})");
            println!("{}", paper_rate.map_or(String::new(), |p| format!(", the paper {:.0} %", 100.0 * p)));
        }
    }

    /// The curve with x as `position` puts it.
    fn series(&self, position: impl Fn(f64) -> f64) -> Series {
        let points = self.points.iter().map(|p| (position(p.log10_false_positive), p.false_negative));
        let name = format!("noise {} %", (1e4 * self.amplitude).round() / 100.0);
        Series { name, points: points.collect(), intervals: Vec::new(), dots: false }
    }
}

/// The paper's two panels: the same curves over a linear and over a logarithmic axis.
fn panels(curves: &[Curve]) -> [Panel; 2] {
    const LEAST: f64 = -30.0;
    const MOST: f64 = 0.02;
    let share = || Axis { label: "false negatives", range: 0.0..1.0, powers: false, ticks: 6 };
    let linear = curves.iter().map(|curve| {
        let mut series = curve.series(|log10_p| 10f64.powf(log10_p));
        // What lies between the smallest P and 0 is too narrow to be seen.
        series.points.insert(0, (0.0, 1.0));
        series.points.retain(|p| p.0 <= MOST);
        series
    });
    let logarithmic = curves.iter().map(|curve| {
        let mut series = curve.series(|log10_p| log10_p);
        series.points.retain(|p| p.0 >= LEAST);
        series
    });
    [
        Panel {
            caption: "Linear axis",
            x: Axis { label: "false positives", range: 0.0..MOST, powers: false, ticks: 5 },
            y: share(),
            series: linear.collect(),
            diagonal: false,
            legend: Some(SeriesLabelPosition::UpperRight),
        },
        Panel {
            caption: "Logarithmic axis",
            x: Axis { label: "false positives", range: LEAST..0.0, powers: true, ticks: 7 },
            y: share(),
            series: logarithmic.collect(),
            diagonal: false,
            legend: None,
        },
    ]
}
