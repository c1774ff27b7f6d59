//! `cargo xtask visibility`: what a mark of each preset does to a model, what it survives, and pictures beside the
//! original where it shows most.

use super::case::{Case, Marked, read};
use super::tables::paper::MODELS;
use anyhow::Context;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use serde::Serialize;
use sombrero::DetectOptions;
use sombrero::io::{Document, Format, encode};
use sombrero::render::{Camera, Image, RenderOptions, Shading, render};
use sombrero::stats::median;
use sombrero::watermark::{Parameters, Preset};
use sombrero_fidelity::Fidelity;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What a mark is to withstand, and how.
const ATTACKS: [(&str, &str); 14] = [
    ("none", "none"),
    ("reorder", "reorder"),
    ("transform", "transform"),
    ("noise 0.2 %", "noise:amplitude=0.002"),
    ("smoothing", "smooth:iterations=10"),
    ("1/2", "simplify:ratio=0.5 transform"),
    ("1/8 moved", "simplify:ratio=0.125 transform"),
    ("crop 1/2", "crop:fraction=0.333 simplify:ratio=0.5 transform"),
    ("9 bits", "quantize:bits=9"),
    ("iso 128", "isosurface:resolution=128"),
    ("free form 2 %", "ffd:strength=0.02 simplify:ratio=0.5"),
    ("2nd mark robust", "watermark:preset=robust"),
    ("2nd mark same", "watermark:preset=faithful"),
    (
        "R",
        "reorder noise:amplitude=0.002 smooth:iterations=10 transform simplify:ratio=0.5 watermark crop:fraction=0.333",
    ),
];

/// What to measure.
#[derive(clap::Args)]
pub(crate) struct Visibility {
    /// Secrets for each model and preset.
    #[arg(long, default_value_t = 3)]
    runs: u64,
    /// Models, separated by commas. Default: the paper's four and the demo's part.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Presets, separated by commas. Default: all, and faithful at the strength at which it turns normals as robust does.
    #[arg(long, value_delimiter = ',')]
    presets: Vec<String>,
    /// Attacks by their names in the table, separated by commas. Default: all.
    #[arg(long, value_delimiter = ',')]
    rows: Vec<String>,
    /// Where `visibility.md`, `visibility.json` and the pictures are written.
    #[arg(long, default_value = "docs/visibility")]
    out: PathBuf,
}

/// Preset faithful as strong as robust is, by how far it turns normals (1.2 degrees).
const LOUD: &str = "faithful, 1.2°";
const LOUD_EPSILON: f64 = 0.0209;

/// One model under one preset, medians over secrets.
#[derive(Serialize)]
struct Line {
    model: String,
    preset: String,
    coefficients: usize,
    epsilon: f64,
    /// Shares of the diagonal.
    mrms: f64,
    /// Degrees.
    normals_rms: f64,
    normals_p99: f64,
    msdm2: f64,
    /// Degrees.
    flat_dihedral: Option<f64>,
    /// Share of the largest side.
    flatness: Option<f64>,
    new_intersections: f64,
    /// In the order of the attacks.
    log10_p: Vec<f64>,
}

pub(crate) fn run(args: &Visibility, folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(&args.out)?;
    let asked = |name: &str| args.rows.is_empty() || args.rows.iter().any(|row| row == name);
    let attacks: Vec<_> = ATTACKS.into_iter().filter(|(name, _)| asked(name)).collect();
    let mut lines = Vec::new();
    for (name, document) in documents(args, folder)? {
        for (preset, parameters) in presets(&args.presets) {
            let marked = Case::new(document.clone(), parameters)?.marked_by_seeds(args.runs)?;
            let line = line(&name, preset, &marked, &attacks)?;
            println!("{}", row(&line));
            lines.push(line);
            let picture = beside(&marked[0])?.to_png()?;
            let file = preset.replace([',', ' ', '°'], "");
            std::fs::write(args.out.join(format!("{name}-{file}.png")), picture)?;
        }
    }
    std::fs::write(args.out.join("visibility.md"), markdown(args.runs, &attacks, &lines))?;
    Ok(std::fs::write(args.out.join("visibility.json"), serde_json::to_string_pretty(&lines)? + "\n")?)
}

fn documents(args: &Visibility, folder: &Path) -> anyhow::Result<Vec<(String, Document)>> {
    let asked = |name: &str| args.only.is_empty() || args.only.iter().any(|only| only == name);
    let mut documents = Vec::new();
    for model in MODELS.iter().filter(|model| asked(model.name)) {
        documents.push((model.name.to_owned(), read(folder, model.file)?));
    }
    if asked("part") {
        let part = encode(Format::Obj, &sombrero::shapes::part(16))?;
        documents.push(("part".to_owned(), Document::parse(part, None)?));
    }
    Ok(documents)
}

fn presets(only: &[String]) -> Vec<(&'static str, Parameters)> {
    let loud = Parameters { preset: None, epsilon: LOUD_EPSILON, ..Preset::Faithful.parameters() };
    let all = Preset::ALL.map(|preset| (preset.name(), preset.parameters()));
    let asked = |name: &str| only.is_empty() || only.iter().any(|only| only == name);
    all.into_iter().chain([(LOUD, loud)]).filter(|(name, _)| asked(name)).collect()
}

fn line(model: &str, preset: &str, marked: &[Marked], attacks: &[(&str, &str)]) -> anyhow::Result<Line> {
    let measure = |marked: &Marked| {
        let original = marked.detector.model().soup();
        Fidelity::between(&original.points, &marked.copy.points, &original.triangles, None)
    };
    let all: Vec<Fidelity> = marked.iter().map(measure).collect();
    let middle = |figure: &dyn Fn(&Fidelity) -> f64| {
        median(&all.iter().map(figure).collect::<Vec<_>>()).context("a median of finite numbers")
    };
    let known = |figure: &dyn Fn(&Fidelity) -> Option<f64>| {
        median(&all.iter().filter_map(figure).collect::<Vec<_>>())
    };
    let survival = |(_, attack): &(&str, &str)| {
        let look = |(seed, marked): (u64, &Marked)| {
            Ok(marked.look(marked.attacked(attack, seed)?, false, &DetectOptions::default()))
        };
        let p = (0..).zip(marked).map(look).collect::<anyhow::Result<Vec<f64>>>()?;
        median(&p).context("a median of finite numbers")
    };
    let parameters = marked[0].detector.key().parameters;
    Ok(Line {
        model: model.into(),
        preset: preset.into(),
        coefficients: marked[0].detector.basis().functions().len(),
        epsilon: parameters.epsilon,
        mrms: middle(&|f| f.mrms)?,
        normals_rms: middle(&|f| f.normals_rms)?,
        normals_p99: middle(&|f| f.normals_p99)?,
        msdm2: middle(&|f| f.msdm2)?,
        flat_dihedral: known(&|f| f.flat_dihedral),
        flatness: known(&|f| f.flatness),
        new_intersections: middle(&|f| f.new_intersections as f64)?,
        log10_p: attacks.par_iter().map(survival).collect::<anyhow::Result<_>>()?,
    })
}

/// Original and copy, whole and where normals turned most.
fn beside(marked: &Marked) -> anyhow::Result<Image> {
    let original = marked.detector.model().soup();
    let (points, moved, triangles) = (&original.points, &marked.copy.points, &original.triangles);
    let (centre, normal) = worst(points, moved, triangles).context("a mesh has faces")?;
    let whole = Camera::framing(points, Vector3::new(-0.5, -0.4, -1.0), Vector3::y());
    let up = if normal.y.abs() > 0.9 { Vector3::x() } else { Vector3::y() };
    let towards = -(normal + Vector3::new(0.25, 0.3, 0.2)).normalize();
    let close = Camera::framing(points, towards, up).close_up(centre, 5.0);
    let view = |camera: &Camera, points: &[Point3<f64>]| {
        let options = RenderOptions {
            width: 560,
            height: 560,
            camera: Some(*camera),
            shading: Shading::default(),
            ..RenderOptions::default()
        };
        render(points, triangles, &options)
    };
    let images = [view(&whole, points), view(&whole, moved), view(&close, points), view(&close, moved)];
    Ok(Image::grid(&images, 2, 6, [255; 4]))
}

/// The centre and normal of the face that turned most, of those that are not tiny.
fn worst(
    points: &[Point3<f64>],
    moved: &[Point3<f64>],
    triangles: &[[u32; 3]],
) -> Option<(Point3<f64>, Vector3<f64>)> {
    let normal = |points: &[Point3<f64>], t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| points[v as usize]);
        (b - a).cross(&(c - a))
    };
    let areas: Vec<f64> = triangles.iter().map(|t| normal(points, t).norm()).collect();
    let mean = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
    let large = triangles.iter().zip(&areas).filter(|(_, area)| **area > 0.5 * mean);
    let turned = large.map(|(t, _)| {
        let [n, m] = [points, moved].map(|p| normal(p, t).normalize());
        (n.dot(&m), t, n)
    });
    let (_, t, n) = turned.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let [a, b, c] = t.map(|v| points[v as usize].coords);
    Some((Point3::from((a + b + c) / 3.0), n))
}

fn row(line: &Line) -> String {
    let of = |figure: Option<f64>, shown: &dyn Fn(f64) -> String| figure.map_or("–".to_owned(), shown);
    format!(
        "| {} | {} | {} | {:.4} | {:.3} | {:.2} | {:.3} | {} | {} | {:.0} |",
        line.model,
        line.preset,
        line.coefficients,
        100.0 * line.mrms,
        line.normals_rms,
        line.normals_p99,
        line.msdm2,
        of(line.flat_dihedral, &|x| format!("{x:.3}")),
        of(line.flatness, &|x| format!("{x:.1e}")),
        line.new_intersections,
    )
}

fn markdown(runs: u64, attacks: &[(&str, &str)], lines: &[Line]) -> String {
    let mut text = format!(
        "# What is seen of a mark, and what it survives\n\nWritten by `cargo xtask visibility`; medians of {runs} secrets. \
         The pictures beside this file show original and copy, whole and where normals turned most.\n\n\
         | model | preset | coefficients | MRMS, % of the diagonal | normals, degrees rms | 99th percentile | MSDM2 | \
         flat edges, degrees rms | flatness, share of the side | new intersections |\n|---|---|{}\n",
        "---:|".repeat(8)
    );
    lines.iter().for_each(|line| {
        let _ = writeln!(text, "{}", row(line));
    });
    let names = attacks.iter().map(|attack| attack.0).collect::<Vec<_>>().join(" | ");
    let _ = writeln!(
        text,
        "\nlog10 p of the robust method, which is told nothing:\n\n| model | preset | {names} |\n|---|---|{}",
        "---:|".repeat(attacks.len())
    );
    for line in lines {
        let figures = line.log10_p.iter().map(|p| format!("{p:.1}")).collect::<Vec<_>>().join(" | ");
        let _ = writeln!(text, "| {} | {} | {figures} |", line.model, line.preset);
    }
    let _ = writeln!(text, "\n| attack | spec |\n|---|---|");
    for (name, spec) in attacks {
        let _ = writeln!(text, "| {name} | `{spec}` |");
    }
    text
}
