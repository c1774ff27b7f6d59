//! `cargo xtask calibrate`: whether the probability that detection tells is the rate at which it errs (the
//! paper, section 4: P_fp is the probability that a random watermark correlates as well).
//!
//! For each kind of suspect, none of which carries the mark, w* is extracted from several suspects, and very
//! many random watermarks are tested against it. Of them a share of p may have a false-positive probability of
//! p or less. With `--pipeline`, unmarked suspects also go through the whole detection, which picks the best of
//! its variants and has to correct p for that.

use crate::plot::{self, Axis, Panel, Series};
use crate::subject::Subject;
use crate::tables::Method;
use anyhow::{Context, bail};
use indicatif::{ProgressBar, ProgressStyle};
use nalgebra::{Point3, Similarity3};
use plotters::chart::SeriesLabelPosition;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::Serialize;
use sombrero::attacks::{Attack, apply_all};
use sombrero::extraction::{Deformation, Estimate, Nuisance};
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::Soup;
use sombrero::registration::{Reference, RegisterOptions, register};
use sombrero::resampling::{ResampleOptions, resample};
use sombrero::shapes;
use sombrero::stats::{Ellipsoid, LogProbability, WatermarkTestOptions, watermark_test, wilson_interval};
use sombrero::watermark::Preset;
use sombrero::{DetectOptions, FLOORS};
use std::path::{Path, PathBuf};

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

/// A kind of suspect.
struct Kind {
    name: &'static str,
    /// Whether somebody else's mark is in it.
    marked: bool,
    registration: bool,
    /// Whether surfaces are compared (the robust method only) rather than vertices.
    surface: bool,
    /// One suspect each, of every model.
    attacks: &'static [&'static str],
}

const KINDS: [Kind; 8] = [
    Kind {
        name: "untouched original",
        marked: false,
        registration: false,
        surface: false,
        attacks: &["none"],
    },
    Kind {
        name: "original, noise",
        marked: false,
        registration: false,
        surface: false,
        attacks: &["noise:amplitude=0.002", "noise:amplitude=0.0045", "noise:amplitude=0.007"],
    },
    Kind {
        name: "original, smoothed",
        marked: false,
        registration: false,
        surface: false,
        attacks: &["smooth:iterations=5", "smooth:iterations=10", "smooth:iterations=20"],
    },
    Kind {
        name: "original, moved and registered",
        marked: false,
        registration: true,
        surface: false,
        attacks: &["transform", "noise:amplitude=0.002 transform", "smooth:iterations=10 transform"],
    },
    Kind {
        name: "marked by others",
        marked: true,
        registration: false,
        surface: false,
        attacks: &["none", "noise:amplitude=0.002", "smooth:iterations=10", "watermark"],
    },
    Kind {
        name: "original, simplified or remeshed",
        marked: false,
        registration: true,
        surface: true,
        attacks: &[
            "simplify:ratio=0.5",
            "simplify:ratio=0.05",
            "isosurface:resolution=64",
            "remesh:length=1",
        ],
    },
    Kind {
        name: "original, deformed or cropped",
        marked: false,
        registration: true,
        surface: true,
        attacks: &[
            "simplify:ratio=0.5 affine:strength=0.2",
            "simplify:ratio=0.5 ffd:strength=0.02",
            "simplify:ratio=0.5 crop:fraction=0.333",
        ],
    },
    Kind {
        name: "marked by others, simplified",
        marked: true,
        registration: true,
        surface: true,
        attacks: &[
            "simplify:ratio=0.5",
            "noise:amplitude=0.002 smooth:iterations=10 simplify:ratio=0.5 watermark",
        ],
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

/// A suspect, as one test sees it.
struct Extracted {
    name: String,
    judge: Judge,
}

/// The test of one suspect.
enum Judge {
    Correlation(Vec<Option<f64>>),
    /// With the distance that belongs to each rate.
    Ellipsoid(Box<Ellipsoid>, [f64; LAST as usize]),
}

impl Judge {
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

    fn length(&self) -> usize {
        match self {
            Self::Correlation(w) => w.len(),
            Self::Ellipsoid(ellipsoid, _) => ellipsoid.dimension(),
        }
    }

    /// How many of these rates p is at most.
    fn rates(&self, w: &[f64]) -> anyhow::Result<usize> {
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
fn judges(name: &str, estimate: &Estimate) -> anyhow::Result<Vec<Extracted>> {
    let mut judges =
        vec![Extracted { name: format!("{name}, correlation"), judge: Judge::Correlation(estimate.known()) }];
    for floor in FLOORS {
        let judge = Judge::ellipsoid(estimate, floor)?;
        judges.push(Extracted { name: format!("{name}, ellipsoid, floor {floor}"), judge });
    }
    Ok(judges)
}

impl Extracted {
    fn known(&self) -> Known {
        Known { suspect: self.name.clone(), coefficients: self.judge.coefficients() }
    }
}

pub(crate) fn run(args: &Calibrate, folder: &Path) -> anyhow::Result<()> {
    if args.keys < CHUNK || !args.keys.is_multiple_of(CHUNK) {
        bail!("the number of keys must be a multiple of {CHUNK}");
    }
    let suffix = args.method.suffix();
    let read = |file| Subject::read(folder, file, args.method.preset());
    let subjects = [("fandisk", read("fandisk.obj")?), ("head", read("head.obj")?)];
    let wanted = KINDS.iter().filter(|kind| args.method == Method::Robust || !kind.surface);
    let bar = bar((wanted.clone().count() as u64 + 1) * args.keys, "watermarks")?;
    let mut kinds = Vec::new();
    for (which, kind) in (0..).zip(wanted) {
        let suspects = kind.suspects(args.method, &subjects, &mut rng(which, STREAMS - 1))?;
        kinds.push(Calibrated::new(kind.name, which, &suspects, args.keys, &bar)?);
    }
    let which = KINDS.len() as u64;
    let suspects = other_models(args.method, &subjects, which)?;
    kinds.push(Calibrated::new(OTHER_MODEL, which, &suspects, args.keys, &bar)?);
    bar.finish_and_clear();
    kinds.iter().for_each(Calibrated::print);
    let pipeline = (args.pipeline > 0).then(|| Pipeline::run(args.method, args.pipeline)).transpose()?;
    std::fs::create_dir_all(&args.out)?;
    plot::write(&args.out.join(format!("calibration{suffix}.svg")), (760, 600), &[panel(&kinds)])?;
    let report = Report { seed: SEED, confidence: CONFIDENCE, keys: args.keys, kinds, pipeline };
    let text = serde_json::to_string_pretty(&report)? + "\n";
    Ok(std::fs::write(args.out.join(format!("calibration{suffix}.json")), text)?)
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
    fn suspects(
        &self,
        method: Method,
        subjects: &[(&str, Subject)],
        rng: &mut ChaCha8Rng,
    ) -> anyhow::Result<Vec<Extracted>> {
        let mut suspects = Vec::new();
        for (model, subject) in subjects {
            for specs in self.attacks {
                suspects.extend(self.extracted(method, subject, &format!("{model} {specs}"), specs, rng)?);
            }
        }
        Ok(suspects)
    }

    fn extracted(
        &self,
        method: Method,
        subject: &Subject,
        name: &str,
        specs: &str,
        rng: &mut ChaCha8Rng,
    ) -> anyhow::Result<Vec<Extracted>> {
        let soup = match self.marked {
            true => subject.marked(rng)?.1,
            false => subject.soup().clone(),
        };
        let attacked = apply_all(&attacks(specs)?, &soup, rng)?;
        let similarity = match self.registration {
            true => registered(subject, &attacked.soup)?,
            false => Similarity3::identity(),
        };
        if self.surface {
            return surface(subject, name, &moved(&attacked.soup, &similarity));
        }
        let known = attacked.correspondence(soup.points.len());
        let found: Vec<Option<Point3<f64>>> = known.iter().map(|p| p.map(|p| similarity * p)).collect();
        match method {
            Method::Paper => {
                let judge = Judge::Correlation(subject.extract(&found)?);
                Ok(vec![Extracted { name: name.into(), judge }])
            }
            Method::Robust => judges(name, &subject.extractor()?.estimate_from_vertices(&found, NUISANCE)?),
        }
    }
}

/// What is solved for beside the coefficients.
const NUISANCE: Nuisance = Nuisance { deformation: Deformation::Affine, smoothing: true };

fn surface(subject: &Subject, name: &str, suspect: &Soup) -> anyhow::Result<Vec<Extracted>> {
    judges(name, &subject.extractor()?.estimate_from_surface(suspect, NUISANCE)?)
}

fn moved(soup: &Soup, similarity: &Similarity3<f64>) -> Soup {
    Soup::new(soup.points.iter().map(|p| similarity * p).collect(), soup.triangles.clone())
}

fn registered(subject: &Subject, suspect: &Soup) -> anyhow::Result<Similarity3<f64>> {
    let original = subject.soup();
    let reference = Reference::new(&original.points, &original.triangles)?;
    let options = RegisterOptions::default();
    Ok(register(&reference, &suspect.points, &suspect.triangles, &options)?.reference_from_suspect)
}

/// Surfaces that have nothing to do with the original, as far as they can be laid over it.
fn other_models(method: Method, subjects: &[(&str, Subject)], which: u64) -> anyhow::Result<Vec<Extracted>> {
    let others: Vec<(&str, Soup)> = subjects
        .iter()
        .map(|(name, subject)| (*name, subject.soup().clone()))
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
        let moved = moved(other, &similarity);
        let name = format!("{model} against {name}");
        if method == Method::Robust {
            return surface(subject, &name, &moved);
        }
        let mut rng = rng(which, STREAMS - number);
        let found = resample(subject.soup(), &moved, &ResampleOptions::default(), &mut rng)?.positions;
        Ok(vec![Extracted { name, judge: Judge::Correlation(subject.extract(&found)?) }])
    });
    Ok(extracted.collect::<anyhow::Result<Vec<_>>>()?.into_iter().flatten().collect())
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
            let counts = count(&suspect.judge, &mut rng(which, chunk))?;
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

fn count(judge: &Judge, rng: &mut ChaCha8Rng) -> anyhow::Result<Counts> {
    let mut counts = Counts::default();
    let mut w = vec![0.0; judge.length()];
    for _ in 0..CHUNK {
        w.fill_with(|| StandardNormal.sample(rng));
        counts.iter_mut().take(judge.rates(&w)?).for_each(|count| *count += 1);
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
    fn run(method: Method, suspects: u64) -> anyhow::Result<Self> {
        let shapes = [
            ("bumpy sphere", shapes::bumpy_sphere(600)),
            ("bust", shapes::bust(8)),
            ("part", shapes::part(1)),
        ];
        let originals =
            shapes.iter().map(|(_, soup)| subject(soup, method.preset())).collect::<Result<Vec<_>, _>>()?;
        let bar = bar(suspects, "suspects")?;
        let p = (0..suspects).into_par_iter().map(|i| {
            let subject = &originals[i as usize % originals.len()];
            let p = detection(subject, method, &mut rng(KINDS.len() as u64 + 1, i), i);
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

/// With as many coefficients as a small shape carries.
fn subject(soup: &Soup, preset: Preset) -> anyhow::Result<Subject> {
    let document = document(soup)?;
    let mut parameters = preset.parameters();
    let capacity = sombrero::info(&document).capacity;
    parameters.basis.coefficients = parameters.basis.coefficients.min(capacity);
    Subject::new(document, parameters)
}

/// log10 of the corrected p for a fresh key and an unmarked suspect; `None` when nothing could be compared.
fn detection(
    subject: &Subject,
    method: Method,
    rng: &mut ChaCha8Rng,
    seed: u64,
) -> anyhow::Result<Option<f64>> {
    let detector = subject.key(rng)?;
    let suspect = detector.suspect(&document(&attacked(subject.soup(), rng))?);
    let options = DetectOptions { method: method.into(), seed, ..DetectOptions::default() };
    Ok(detector.detect(&suspect, &options).ok().map(|detection| detection.log10_p))
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
