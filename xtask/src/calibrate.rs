//! `cargo xtask calibrate`: whether the probability that detection tells is the rate at which it errs (the
//! paper, section 4: P_fp is the probability that a random watermark correlates as well).
//!
//! For each kind of suspect, none of which carries the mark, w* is extracted from several suspects, and very
//! many random watermarks are tested against it. Of them a share of p may have a false-positive probability of
//! p or less. With `--pipeline`, unmarked suspects also go through the whole detection, which picks the best of
//! its variants and has to correct p for that.

use crate::plot::{self, Axis, Panel, Series};
use crate::roc::Subject;
use anyhow::{Context, bail};
use indicatif::{ProgressBar, ProgressStyle};
use nalgebra::{Point3, Similarity3};
use plotters::chart::SeriesLabelPosition;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::Serialize;
use sombrero::attacks::{Attack, apply_all};
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::{Soup, shapes};
use sombrero::registration::{Reference, RegisterOptions, register};
use sombrero::resampling::{ResampleOptions, resample};
use sombrero::stats::{WatermarkTestOptions, watermark_test, wilson_interval};
use sombrero::watermark::{Identity, Key, Preset, Secret};
use sombrero::{DetectOptions, Prepared};
use std::path::{Path, PathBuf};

/// Whether probabilities are rates.
#[derive(clap::Args)]
pub(crate) struct Calibrate {
    /// Random watermarks for each kind of suspect.
    #[arg(long, default_value_t = 1_000_000)]
    keys: u64,
    /// Unmarked suspects for the whole detection; 1000 take some minutes, and 0 leaves this part out.
    #[arg(long, default_value_t = 0)]
    pipeline: u64,
    /// Where `calibration.json` and `calibration.svg` are written.
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

/// A kind of suspect that corresponds to the original vertex by vertex.
struct Kind {
    name: &'static str,
    /// Whether somebody else's mark is in it.
    marked: bool,
    registration: bool,
    /// One suspect each, of every model.
    attacks: &'static [&'static str],
}

const KINDS: [Kind; 5] = [
    Kind { name: "untouched original", marked: false, registration: false, attacks: &["none"] },
    Kind {
        name: "original, noise",
        marked: false,
        registration: false,
        attacks: &["noise:amplitude=0.002", "noise:amplitude=0.0045", "noise:amplitude=0.007"],
    },
    Kind {
        name: "original, smoothed",
        marked: false,
        registration: false,
        attacks: &["smooth:iterations=5", "smooth:iterations=10", "smooth:iterations=20"],
    },
    Kind {
        name: "original, moved and registered",
        marked: false,
        registration: true,
        attacks: &["transform", "noise:amplitude=0.002 transform", "smooth:iterations=10 transform"],
    },
    Kind {
        name: "marked by others",
        marked: true,
        registration: false,
        attacks: &["none", "noise:amplitude=0.002", "smooth:iterations=10", "watermark"],
    },
];
const OTHER_MODEL: &str = "another model, registered and resampled";

/// `calibration.json`.
#[derive(Serialize)]
struct Report {
    seed: u64,
    confidence: f64,
    keys: u64,
    kinds: Vec<Calibrated>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pipeline: Option<Pipeline>,
}

/// What one kind of suspect gave.
#[derive(Serialize)]
struct Calibrated {
    kind: &'static str,
    suspects: Vec<Known>,
    rates: Vec<Rate>,
}

/// A suspect by name, and how many coefficients could be extracted from it. The test leaves out those beyond 2.5;
/// with fewer than three left, as another model may have, p is 1 for every watermark.
#[derive(Serialize)]
struct Known {
    suspect: String,
    coefficients: usize,
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
}

/// A suspect, as the test sees it.
struct Extracted {
    name: String,
    coefficients: Vec<Option<f64>>,
}

impl Extracted {
    fn known(&self) -> Known {
        let coefficients = self.coefficients.iter().flatten().count();
        Known { suspect: self.name.clone(), coefficients }
    }
}

pub(crate) fn run(args: &Calibrate, folder: &Path) -> anyhow::Result<()> {
    if args.keys < CHUNK || !args.keys.is_multiple_of(CHUNK) {
        bail!("the number of keys must be a multiple of {CHUNK}");
    }
    let subjects =
        [("fandisk", Subject::read(folder, "fandisk.obj")?), ("head", Subject::read(folder, "head.obj")?)];
    let bar = bar((KINDS.len() as u64 + 1) * args.keys, "watermarks")?;
    let mut kinds = Vec::new();
    for (which, kind) in (0..).zip(&KINDS) {
        let suspects = kind.suspects(&subjects, &mut rng(which, STREAMS - 1))?;
        kinds.push(Calibrated::new(kind.name, which, &suspects, args.keys, &bar)?);
    }
    let which = KINDS.len() as u64;
    let suspects = other_models(&subjects, which)?;
    kinds.push(Calibrated::new(OTHER_MODEL, which, &suspects, args.keys, &bar)?);
    bar.finish_and_clear();
    kinds.iter().for_each(Calibrated::print);
    let pipeline = (args.pipeline > 0).then(|| Pipeline::run(args.pipeline)).transpose()?;
    std::fs::create_dir_all(&args.out)?;
    plot::write(&args.out.join("calibration.svg"), (760, 600), &[panel(&kinds)])?;
    let report = Report { seed: SEED, confidence: CONFIDENCE, keys: args.keys, kinds, pipeline };
    let text = serde_json::to_string_pretty(&report)? + "\n";
    Ok(std::fs::write(args.out.join("calibration.json"), text)?)
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

fn attacks(specs: &str) -> anyhow::Result<Vec<Attack>> {
    Ok(specs.split(' ').map(str::parse).collect::<Result<_, _>>()?)
}

impl Kind {
    fn suspects(&self, subjects: &[(&str, Subject)], rng: &mut ChaCha8Rng) -> anyhow::Result<Vec<Extracted>> {
        let mut suspects = Vec::new();
        for (model, subject) in subjects {
            for specs in self.attacks {
                let coefficients = self.extracted(subject, specs, rng)?;
                suspects.push(Extracted { name: format!("{model} {specs}"), coefficients });
            }
        }
        Ok(suspects)
    }

    fn extracted(
        &self,
        subject: &Subject,
        specs: &str,
        rng: &mut ChaCha8Rng,
    ) -> anyhow::Result<Vec<Option<f64>>> {
        let soup = match self.marked {
            true => subject.marked(&subject.watermark(rng)),
            false => subject.model.soup().clone(),
        };
        let attacked = apply_all(&attacks(specs)?, &soup, rng)?;
        let similarity = match self.registration {
            true => registered(subject, &attacked.soup)?,
            false => Similarity3::identity(),
        };
        let known = attacked.correspondence(soup.points.len());
        let found: Vec<Option<Point3<f64>>> = known.iter().map(|p| p.map(|p| similarity * p)).collect();
        subject.extract(&found)
    }
}

fn registered(subject: &Subject, suspect: &Soup) -> anyhow::Result<Similarity3<f64>> {
    let original = subject.model.soup();
    let reference = Reference::new(&original.points, &original.triangles)?;
    let options = RegisterOptions::default();
    Ok(register(&reference, &suspect.points, &suspect.triangles, &options)?.reference_from_suspect)
}

/// Surfaces that have nothing to do with the original, as far as they can be laid over it.
fn other_models(subjects: &[(&str, Subject)], which: u64) -> anyhow::Result<Vec<Extracted>> {
    let others: Vec<(&str, Soup)> = subjects
        .iter()
        .map(|(name, subject)| (*name, subject.model.soup().clone()))
        .chain([("bumpy sphere", shapes::bumpy_sphere(4000)), ("torus", shapes::torus(80, 50, 1.0, 0.4))])
        .collect();
    let pairs: Vec<(u64, _, _)> = subjects
        .iter()
        .flat_map(|subject| others.iter().map(move |other| (subject, other)))
        .filter(|(subject, other)| subject.0 != other.0)
        .zip(1..)
        .map(|((subject, other), number)| (number, subject, other))
        .collect();
    let extracted = pairs.into_par_iter().map(|(number, (model, subject), (name, other))| {
        let similarity = registered(subject, other)?;
        let moved = other.points.iter().map(|p| similarity * p).collect();
        let moved = Soup::new(moved, other.triangles.clone());
        let mut rng = rng(which, STREAMS - number);
        let found = resample(subject.model.soup(), &moved, &ResampleOptions::default(), &mut rng)?.positions;
        Ok(Extracted { name: format!("{model} against {name}"), coefficients: subject.extract(&found)? })
    });
    extracted.collect()
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
            let counts = count(&suspect.coefficients, &mut rng(which, chunk))?;
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

fn count(extracted: &[Option<f64>], rng: &mut ChaCha8Rng) -> anyhow::Result<Counts> {
    let mut counts = Counts::default();
    let options = WatermarkTestOptions::default();
    let mut w = vec![0.0; extracted.len()];
    for _ in 0..CHUNK {
        w.fill_with(|| StandardNormal.sample(rng));
        let log10_p = watermark_test(&w, extracted, &options)?.log10_p();
        for (k, count) in (1..).zip(&mut counts) {
            *count += usize::from(log10_p <= -f64::from(k));
        }
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

/// What the whole detection made of suspects without a mark.
#[derive(Serialize)]
struct Pipeline {
    suspects: u64,
    shapes: Vec<&'static str>,
    attacks: &'static [&'static str],
    /// Suspects that could not be compared at all; they count as not found.
    failed: usize,
    /// The corrected p.
    rates: Vec<Rate>,
}

/// Of these one to three are drawn.
const BATTERY: [&str; 10] = [
    "none",
    "reorder",
    "noise:amplitude=0.002",
    "noise:amplitude=0.007",
    "smooth:iterations=10",
    "transform",
    "simplify:ratio=0.5",
    "simplify:ratio=0.25",
    "watermark",
    "crop:fraction=0.333",
];

impl Pipeline {
    fn run(suspects: u64) -> anyhow::Result<Self> {
        let shapes = [
            ("bumpy sphere", shapes::bumpy_sphere(600)),
            ("bust", shapes::bust(8)),
            ("part", shapes::part(1)),
        ];
        let originals = shapes
            .iter()
            .map(|(_, soup)| document(soup).and_then(Subject::new))
            .collect::<Result<Vec<_>, _>>()?;
        let bar = bar(suspects, "suspects")?;
        let p = (0..suspects).into_par_iter().map(|i| {
            let subject = &originals[i as usize % originals.len()];
            let p = detection(subject, &mut rng(KINDS.len() as u64 + 1, i), i);
            bar.inc(1);
            p
        });
        let p = p.collect::<anyhow::Result<Vec<Option<f64>>>>()?;
        bar.finish_and_clear();
        let failed = p.iter().filter(|p| p.is_none()).count();
        let rate = |theoretical: f64| {
            let count = p.iter().flatten().filter(|&&log10_p| log10_p <= theoretical.log10()).count();
            Rate::new(theoretical, count, p.len())
        };
        let rates = [0.1, 0.01].into_iter().map(rate).collect::<anyhow::Result<_>>()?;
        let shapes = shapes.iter().map(|(name, _)| *name).collect();
        let pipeline = Self { suspects, shapes, attacks: &BATTERY, failed, rates };
        pipeline.print();
        Ok(pipeline)
    }

    fn print(&self) {
        println!("the whole detection, {} suspects, {} not comparable", self.suspects, self.failed);
        for Rate { theoretical, empirical, low, high, .. } in &self.rates {
            println!("  {theoretical}: {empirical:.4} ({low:.4} to {high:.4})");
        }
    }
}

fn document(soup: &Soup) -> anyhow::Result<Document> {
    Ok(Document::parse(encode(Format::PlyBinaryLittleEndian, soup)?, Some("ply"))?)
}

/// log10 of the corrected p for a fresh key and an unmarked suspect; `None` when nothing could be compared.
fn detection(subject: &Subject, rng: &mut ChaCha8Rng, seed: u64) -> anyhow::Result<Option<f64>> {
    let mut secret = Secret([0; 32]);
    rng.fill_bytes(&mut secret.0);
    let parameters = Preset::Paper.parameters();
    let key = Key::new(subject.document.bytes(), Identity::default(), secret, &parameters, &subject.basis);
    let prepared = Prepared::new(&subject.document, key)?;
    let suspect = prepared.suspect(&document(&attacked(&subject.document.soup(), rng))?);
    let options = DetectOptions { seed, ..DetectOptions::default() };
    Ok(prepared.detect(&suspect, &options).ok().map(|detection| detection.log10_p))
}

/// The surface after one to three attacks of the battery; combinations that leave too little are drawn again.
fn attacked(soup: &Soup, rng: &mut ChaCha8Rng) -> Soup {
    loop {
        let count = rng.random_range(1..=3);
        let specs: Vec<&str> = (0..count).map(|_| BATTERY[rng.random_range(0..BATTERY.len())]).collect();
        let made = attacks(&specs.join(" ")).and_then(|attacks| Ok(apply_all(&attacks, soup, rng)?));
        if let Ok(attacked) = made {
            return attacked.soup;
        }
    }
}
