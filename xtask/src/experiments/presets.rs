//! `cargo xtask presets`: what the same distortion buys with other numbers of coefficients and other shares of the
//! energy; at equal root mean square displacement, and at equal root mean square change of face normals.

use super::case::{Case, Marked, read};
use super::tables::paper::MODELS;
use anyhow::Context;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::DetectOptions;
use sombrero::basis::{Amplitudes, BasisError, BasisOptions};
use sombrero::fidelity::normal_change;
use sombrero::io::Document;
use sombrero::stats::median;
use sombrero::watermark::{Parameters, Preset};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Coefficients and amplitudes, the paper's first.
const CANDIDATES: [(usize, Amplitudes); 6] = [
    (50, Amplitudes::Heights),
    (100, Amplitudes::Heights),
    (200, Amplitudes::Heights),
    (100, Amplitudes::RootHeights),
    (200, Amplitudes::RootHeights),
    (400, Amplitudes::RootHeights),
];

/// Attacks that leave little.
const ATTACKS: [(&str, &str); 5] = [
    ("noise 0.7 %", "noise:amplitude=0.007"),
    ("2nd mark", "watermark"),
    ("smoothing", "smooth:iterations=10"),
    ("simplify 1/20", "simplify:ratio=0.05"),
    (
        "R",
        "reorder noise:amplitude=0.002 smooth:iterations=10 transform simplify:ratio=0.5 watermark crop:fraction=0.333",
    ),
];

/// What to compare.
#[derive(clap::Args)]
pub(crate) struct Presets {
    /// Seeds for each cell.
    #[arg(long, default_value_t = 3)]
    runs: u64,
    /// Where `presets.md` and `presets.json` are written.
    #[arg(long, default_value = "docs/presets")]
    out: PathBuf,
}

/// What is held equal to the paper's preset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Equal {
    Displacement,
    Normals,
}

#[derive(Serialize)]
struct Line {
    model: &'static str,
    equal: Equal,
    coefficients: usize,
    amplitudes: String,
    epsilon: f64,
    relative_rms: f64,
    normals_rms: f64,
    /// Medians, in the order of the attacks.
    log10_p: Vec<f64>,
}

pub(crate) fn run(args: &Presets, folder: &Path) -> anyhow::Result<()> {
    let mut lines = Vec::new();
    for model in MODELS.iter().filter(|m| m.name != "dragon") {
        let document = read(folder, model.file)?;
        let paper = distortion(&marked(&document, &Preset::Paper.parameters(), args.runs)?)?;
        for equal in [Equal::Displacement, Equal::Normals] {
            let of = |&candidate: &(usize, Amplitudes)| {
                line(model.name, &document, equal, candidate, paper, args.runs)
            };
            lines.extend(
                CANDIDATES.par_iter().map(of).collect::<anyhow::Result<Vec<_>>>()?.into_iter().flatten(),
            );
        }
    }
    let text = markdown(args.runs, &lines);
    println!("{text}");
    std::fs::create_dir_all(&args.out)?;
    std::fs::write(args.out.join("presets.md"), text)?;
    Ok(std::fs::write(args.out.join("presets.json"), serde_json::to_string_pretty(&lines)? + "\n")?)
}

/// `None` when the mesh cannot carry as many coefficients.
fn line(
    model: &'static str,
    document: &Document,
    equal: Equal,
    (coefficients, amplitudes): (usize, Amplitudes),
    paper: [f64; 2],
    runs: u64,
) -> anyhow::Result<Option<Line>> {
    let Parameters { basis, epsilon, .. } = Preset::Paper.parameters();
    let basis = BasisOptions { coefficients, amplitudes, ..basis };
    let at = |epsilon| Parameters { preset: None, basis, epsilon };
    let usual = match marked(document, &at(epsilon), runs) {
        Err(error) if error.downcast_ref::<BasisError>().is_some() => return Ok(None),
        other => distortion(&other?)?,
    };
    let which = usize::from(equal == Equal::Normals);
    let parameters = at(epsilon * paper[which] / usual[which]);
    let marked = marked(document, &parameters, runs)?;
    let [relative_rms, normals_rms] = distortion(&marked)?;
    let log10_p = ATTACKS.iter().map(|(_, attack)| {
        let look = |(seed, marked): (u64, &Marked)| {
            let attacked = marked.attacked(attack, seed)?;
            Ok(marked.look(attacked, false, &DetectOptions::default()))
        };
        let p = (0..).zip(&marked).map(look).collect::<anyhow::Result<Vec<f64>>>()?;
        median(&p).context("a median of finite numbers")
    });
    Ok(Some(Line {
        model,
        equal,
        coefficients,
        amplitudes: amplitudes.to_string(),
        epsilon: parameters.epsilon,
        relative_rms,
        normals_rms,
        log10_p: log10_p.collect::<anyhow::Result<_>>()?,
    }))
}

/// A marked copy for each seed.
fn marked(document: &Document, parameters: &Parameters, runs: u64) -> anyhow::Result<Vec<Marked>> {
    Case::new(document.clone(), *parameters)?.marked_by_seeds(runs)
}

/// Root mean square displacement in largest sides and change of normals in radians, medians over marks.
fn distortion(marked: &[Marked]) -> anyhow::Result<[f64; 2]> {
    let of = |marked: &Marked| {
        let original = marked.detector.model().soup();
        let normals = normal_change(&original.points, &marked.copy.points, &original.triangles);
        [marked.distortion().rms, normals]
    };
    let all: Vec<[f64; 2]> = marked.iter().map(of).collect();
    let middle = |k: usize| {
        median(&all.iter().map(|d| d[k]).collect::<Vec<_>>()).context("a median of finite numbers")
    };
    Ok([middle(0)?, middle(1)?])
}

fn markdown(runs: u64, lines: &[Line]) -> String {
    let mut text = format!(
        "# Presets at equal distortion\n\nlog10 of the false-positive probability, `--method robust`, median of {runs} \
         seeds; ε is set so that either the root mean square displacement or the root mean square change of face normals \
         is that of the paper's preset (50 coefficients by their heights, ε = 0.01) on the same model.\n"
    );
    for (equal, title) in
        [(Equal::Displacement, "Equal displacement"), (Equal::Normals, "Equal change of normals")]
    {
        let names = ATTACKS.map(|a| a.0).join(" | ");
        let _ = writeln!(
            text,
            "\n## {title}\n\n| model | coefficients | rms / side | normals, degrees | {names} |"
        );
        let _ = writeln!(text, "|---|---|---:|---:|{}", "---:|".repeat(ATTACKS.len()));
        for line in lines.iter().filter(|line| line.equal == equal) {
            let figures = line.log10_p.iter().map(|p| format!("{p:.1}")).collect::<Vec<_>>().join(" | ");
            let (coefficients, amplitudes) = (line.coefficients, &line.amplitudes);
            let (rms, normals) = (line.relative_rms, line.normals_rms.to_degrees());
            let _ = writeln!(
                text,
                "| {} | {coefficients}, {amplitudes} | {rms:.5} | {normals:.2} | {figures} |",
                line.model
            );
        }
    }
    text
}
