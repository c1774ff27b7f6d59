//! `cargo xtask benchmark`: the protocol of Wang, Lavoué, Denis, Baskurt and He, "A Benchmark for 3D Mesh Watermarking"
//! (Shape Modeling International 2010).
//!
//! Its attacks at its strengths, five keys a cell, distortion as it measures it. It was made for blind and non-blind
//! schemes; ours is non-blind.

use super::case::{Case, Marked};
use super::tables::paper::MODELS;
use anyhow::{Context, bail};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use serde::Serialize;
use sombrero::DetectOptions;
use sombrero::spatial::{DistanceOptions, compare};
use sombrero::stats::median;
use sombrero::watermark::Preset;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Name and attack of each cell.
const CELLS: [(&str, &str); 32] = [
    ("similarity transform", "transform"),
    ("reordering", "reorder"),
    ("reordering and similarity", "reorder transform"),
    ("noise 0.05 %", "coordinate-noise:amplitude=0.0005"),
    ("noise 0.10 %", "coordinate-noise:amplitude=0.001"),
    ("noise 0.30 %", "coordinate-noise:amplitude=0.003"),
    ("noise 0.50 %", "coordinate-noise:amplitude=0.005"),
    ("noise 0.50 %, reordered", "coordinate-noise:amplitude=0.005 reorder"),
    ("Laplacian smoothing, 5", "laplacian:iterations=5,lambda=0.1"),
    ("Laplacian smoothing, 10", "laplacian:iterations=10,lambda=0.1"),
    ("Laplacian smoothing, 30", "laplacian:iterations=30,lambda=0.1"),
    ("Laplacian smoothing, 50", "laplacian:iterations=50,lambda=0.1"),
    ("quantization, 11 bits", "quantize:bits=11"),
    ("quantization, 10 bits", "quantize:bits=10"),
    ("quantization, 9 bits", "quantize:bits=9"),
    ("quantization, 8 bits", "quantize:bits=8"),
    ("quantization, 7 bits", "quantize:bits=7"),
    ("subdivision, midpoint", "subdivide:scheme=midpoint"),
    ("subdivision, Loop", "subdivide:scheme=loop"),
    ("simplification 10 %", "simplify:ratio=0.9"),
    ("simplification 30 %", "simplify:ratio=0.7"),
    ("simplification 50 %", "simplify:ratio=0.5"),
    ("simplification 70 %", "simplify:ratio=0.3"),
    ("simplification 90 %", "simplify:ratio=0.1"),
    ("simplification 95 %", "simplify:ratio=0.05"),
    ("simplification 97.5 %", "simplify:ratio=0.025"),
    ("cropping 10 %", "crop:vertices=0.1"),
    ("cropping 30 %", "crop:vertices=0.3"),
    ("cropping 50 %", "crop:vertices=0.5"),
    ("cropping 10 %, simplified 50 %", "crop:vertices=0.1 simplify:ratio=0.5"),
    ("cropping 30 %, simplified 50 %", "crop:vertices=0.3 simplify:ratio=0.5"),
    ("cropping 50 %, simplified 50 %", "crop:vertices=0.5 simplify:ratio=0.5"),
];

/// What to run.
#[derive(clap::Args)]
pub(crate) struct Benchmark {
    /// Keys for each cell.
    #[arg(long, default_value_t = 5)]
    keys: u64,
    /// Models, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "bunny,dragon")]
    only: Vec<String>,
    /// Where the results are written.
    #[arg(long, default_value = "docs/benchmark")]
    out: PathBuf,
}

#[derive(Serialize)]
struct Cell {
    model: &'static str,
    name: &'static str,
    attack: &'static str,
    /// One for each key.
    log10_p: Vec<f64>,
    median_log10_p: f64,
}

/// How far the mark moved the surface, medians over keys.
#[derive(Serialize)]
struct Distortion {
    model: &'static str,
    /// Root mean square distance between the surfaces, the larger of both ways, over the diagonal of the bounding box.
    mrms_over_diagonal: f64,
    /// The Hausdorff distance over the diagonal.
    hausdorff_over_diagonal: f64,
    /// Root mean square displacement of vertices over the diagonal.
    rms_over_diagonal: f64,
}

pub(crate) fn run(args: &Benchmark, folder: &Path) -> anyhow::Result<()> {
    let known: Vec<&str> = MODELS.iter().map(|m| m.name).collect();
    if let Some(unknown) = args.only.iter().find(|name| !known.contains(&name.as_str())) {
        bail!("`{unknown}` is none of the models; known are {}", known.join(", "));
    }
    let models = MODELS.iter().filter(|m| args.only.iter().any(|name| name == m.name));
    let (mut cells, mut distortions) = (Vec::new(), Vec::new());
    for model in models {
        let case = Case::read(folder, model.file, Preset::Robust)?;
        let marked = case.marked_by_seeds(args.keys)?;
        distortions.push(distortion(model.name, &marked)?);
        cells.extend(model_cells(model.name, &marked)?);
    }
    let text = markdown(&args.only, args.keys, &cells, &distortions);
    println!("{text}");
    std::fs::create_dir_all(&args.out)?;
    let json = serde_json::json!({ "keys": args.keys, "distortion": distortions, "cells": cells });
    for (name, content) in
        [("benchmark.md", text), ("benchmark.json", serde_json::to_string_pretty(&json)? + "\n")]
    {
        let path = args.out.join(name);
        std::fs::write(&path, content).with_context(|| format!("{} cannot be written", path.display()))?;
    }
    Ok(())
}

fn model_cells(model: &'static str, marked: &[Marked]) -> anyhow::Result<Vec<Cell>> {
    let bar = ProgressBar::new((CELLS.len() * marked.len()) as u64);
    bar.set_style(ProgressStyle::with_template("{elapsed} {msg} {bar:40} {pos}/{len}, {eta} left")?);
    bar.set_message(model);
    let cell = |&(name, attack): &(&'static str, &'static str)| {
        let log10_p = (0..).zip(marked).map(|(seed, marked)| {
            let attacked = marked.attacked(attack, seed)?;
            let p = marked.look(attacked, false, &DetectOptions::default());
            bar.inc(1);
            Ok(p)
        });
        let log10_p = log10_p.collect::<anyhow::Result<Vec<f64>>>()?;
        let median_log10_p = median(&log10_p).context("a median of finite numbers")?;
        Ok(Cell { model, name, attack, log10_p, median_log10_p })
    };
    let cells = CELLS.par_iter().map(cell).collect();
    bar.finish_and_clear();
    cells
}

fn distortion(model: &'static str, marked: &[Marked]) -> anyhow::Result<Distortion> {
    let of = |marked: &Marked| {
        let original = marked.detector.model().soup();
        let bounds = original.bounding_box().context("a model has an extent")?;
        let apart = compare(original, &marked.copy, &DistanceOptions::default());
        let apart = apart.context("a model has a surface")?;
        let per_side = bounds.largest_side() / bounds.diagonal();
        let rms = apart.forward.rms.max(apart.backward.rms);
        Ok([rms / bounds.diagonal(), apart.hausdorff / bounds.diagonal(), marked.distortion().rms * per_side])
    };
    let all = marked.iter().map(of).collect::<anyhow::Result<Vec<_>>>()?;
    let middle = |k: usize| {
        median(&all.iter().map(|d| d[k]).collect::<Vec<_>>()).context("a median of finite numbers")
    };
    Ok(Distortion {
        model,
        mrms_over_diagonal: middle(0)?,
        hausdorff_over_diagonal: middle(1)?,
        rms_over_diagonal: middle(2)?,
    })
}

fn markdown(models: &[String], keys: u64, cells: &[Cell], distortions: &[Distortion]) -> String {
    let mut text = format!(
        "# The benchmark of Wang, Lavoué, Denis, Baskurt and He (2010)\n\nlog10 of the false-positive probability, median \
         of {keys} keys, corrected for all variants tried; the worst key in brackets. The scheme is **non-blind**: \
         detection has the original, so these figures say nothing against blind schemes. Nothing else is known about \
         the suspect. Noise: each coordinate by at most so much of the mean distance from the centre. Cropping counts \
         vertices.\n\n"
    );
    let _ = writeln!(text, "| attack | {} |\n|---|{}", models.join(" | "), "---:|".repeat(models.len()));
    for (name, _) in CELLS {
        let figure = |model: &String| {
            let cell = cells.iter().find(|c| c.model == model && c.name == name);
            cell.map_or(String::new(), |c| {
                let worst = c.log10_p.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                format!("{:.1} ({worst:.1})", c.median_log10_p)
            })
        };
        let _ = writeln!(text, "| {name} | {} |", models.iter().map(figure).collect::<Vec<_>>().join(" | "));
    }
    let rows = [
        "MRMS between the surfaces / diagonal",
        "Hausdorff distance / diagonal",
        "rms displacement of vertices / diagonal",
    ];
    for (i, name) in rows.iter().enumerate() {
        let figure = |model: &String| {
            let found = distortions.iter().find(|d| d.model == model);
            let value =
                |d: &Distortion| [d.mrms_over_diagonal, d.hausdorff_over_diagonal, d.rms_over_diagonal][i];
            found.map_or(String::new(), |d| format!("{:.2e}", value(d)))
        };
        let _ = writeln!(text, "| {name} | {} |", models.iter().map(figure).collect::<Vec<_>>().join(" | "));
    }
    text
}
