//! `cargo xtask forgery`: what it buys to try keys, for somebody who claims a mesh that he never marked.
//!
//! The suspect is an unmarked mesh with noise. The claimant has a copy without noise as his "original" and makes keys of
//! the fewest coefficients, one secret after the other, with a derivation that costs nothing. By Law 1 every p is uniform,
//! so of k tries k p should get below p. What the real derivation adds is the time that a try takes.

use super::case::Case;
use anyhow::ensure;
use nalgebra::Point3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::attacks::noise;
use sombrero::basis::BasisOptions;
use sombrero::io::{Document, Format, encode};
use sombrero::shapes;
use sombrero::stats::{WatermarkTestOptions, watermark_test, wilson_interval};
use sombrero::watermark::{
    COEFFICIENTS, Derivation, Identity, Key, OriginalDigest, Parameters, Preset, Secret,
};
use std::path::PathBuf;
use std::time::Instant;

/// How far tries lead.
#[derive(clap::Args)]
pub(crate) struct Forgery {
    /// Keys that the claimant tries.
    #[arg(long, default_value_t = 10_000_000)]
    tries: usize,
    /// Where `forgery.json` is written.
    #[arg(long, default_value = "docs")]
    out: PathBuf,
}

/// p of 10 to minus these are counted.
const EXPONENTS: [i32; 7] = [1, 2, 3, 4, 5, 6, 7];
/// What a claimant may want to reach.
const WANTED: [i32; 4] = [-6, -9, -12, -20];
const CONFIDENCE: f64 = 0.999;
/// Derivations that are timed.
const TIMED: u8 = 20;

/// `forgery.json`.
#[derive(Serialize)]
struct Report {
    coefficients: usize,
    tries: usize,
    best_log10_p: f64,
    reached: Vec<Reached>,
    derivation: String,
    derivations_per_second_and_core: f64,
    cost: Vec<Cost>,
}

/// How many tries got below one p.
#[derive(Serialize)]
struct Reached {
    log10_p: i32,
    hits: usize,
    expected: f64,
    within_interval: bool,
}

/// What it costs to reach one p.
#[derive(Serialize)]
struct Cost {
    log10_p: i32,
    core_years: f64,
}

pub(crate) fn run(args: &Forgery) -> anyhow::Result<()> {
    let log10_p = tried(args.tries)?;
    let reached: Vec<Reached> = EXPONENTS.iter().map(|&k| reached(&log10_p, -k)).collect();
    let rate = derivations_per_second();
    let years = |log10_p: i32| 10_f64.powi(-log10_p) / rate / (365.25 * 86_400.0);
    let report = Report {
        coefficients: *COEFFICIENTS.start(),
        tries: args.tries,
        best_log10_p: log10_p.iter().copied().fold(0.0, f64::min),
        reached,
        derivation: Derivation::STANDARD.to_string(),
        derivations_per_second_and_core: rate,
        cost: WANTED.iter().map(|&log10_p| Cost { log10_p, core_years: years(log10_p) }).collect(),
    };
    println!("{}", markdown(&report));
    std::fs::create_dir_all(&args.out)?;
    std::fs::write(args.out.join("forgery.json"), serde_json::to_string_pretty(&report)? + "\n")?;
    ensure!(report.reached.iter().all(|r| r.within_interval), "tries reach something else than chance says");
    Ok(())
}

/// log10 p of every try.
fn tried(tries: usize) -> anyhow::Result<Vec<f64>> {
    let document = Document::parse(encode(Format::Obj, &shapes::bumpy_sphere(700))?, None)?;
    let preset = Preset::Paper.parameters();
    let basis = BasisOptions { coefficients: *COEFFICIENTS.start(), ..preset.basis };
    let case = Case::new(document, Parameters { preset: None, basis, ..preset })?;
    let points = &case.soup().points;
    let suspect: Vec<Option<Point3<f64>>> =
        noise(points, 0.01, &mut ChaCha8Rng::seed_from_u64(1)).into_iter().map(Some).collect();
    let found = case.extract(&suspect)?;
    let original = OriginalDigest::of(case.document.parts());
    let (digest, stub) = (case.detector.basis().digest(), Derivation::stub_for_experiments());
    let one = |number: usize| {
        let mut secret = Secret([0; 32]);
        secret.0[..8].copy_from_slice(&(number as u64).to_le_bytes());
        let key = Key::new(&original, Identity::default(), secret, case.parameters, &digest, stub);
        Ok(watermark_test(&key.watermark, &found, &WatermarkTestOptions::default())?.log10_p())
    };
    (0..tries).into_par_iter().map(one).collect()
}

fn reached(all: &[f64], log10_p: i32) -> Reached {
    let hits = all.iter().filter(|p| **p <= f64::from(log10_p)).count();
    let chance = 10_f64.powi(log10_p);
    let within_interval =
        wilson_interval(hits, all.len(), CONFIDENCE).is_some_and(|interval| interval.contains(chance));
    Reached { log10_p, hits, expected: chance * all.len() as f64, within_interval }
}

/// On one core, other work aside.
fn derivations_per_second() -> f64 {
    let original = OriginalDigest::of_file(b"");
    let start = Instant::now();
    for number in 0..TIMED {
        let (secret, parameters) = (Secret([number; 32]), Preset::Paper.parameters());
        Key::new(&original, Identity::default(), secret, parameters, &[0; 32], Derivation::STANDARD);
    }
    f64::from(TIMED) / start.elapsed().as_secs_f64()
}

fn markdown(report: &Report) -> String {
    let mut lines = vec![
        format!(
            "{} tries at {} coefficients, best log10 p {:.2}",
            report.tries, report.coefficients, report.best_log10_p
        ),
        String::new(),
        "| log10 p | reached | expected |".into(),
        "|---:|---:|---:|".into(),
    ];
    lines.extend(report.reached.iter().map(|r| format!("| {} | {} | {} |", r.log10_p, r.hits, r.expected)));
    lines.push(format!(
        "\n{:.2} derivations ({}) a second and core\n\n| log10 p | core-years |\n|---:|---:|",
        report.derivations_per_second_and_core, report.derivation
    ));
    lines.extend(report.cost.iter().map(|c| format!("| {} | {:.2e} |", c.log10_p, c.core_years)));
    lines.join("\n")
}
