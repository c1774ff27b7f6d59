//! `cargo xtask scaling`: time by stage and memory from a thousand to ten million triangles.

use super::plot::{self, Axis, Panel, Series};
use super::program::{Program, Used};
use anyhow::Context;
use plotters::prelude::SeriesLabelPosition;
use serde::Serialize;
use sombrero::io::{Format, encode};
use sombrero::shapes;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What to measure.
#[derive(clap::Args)]
pub(crate) struct Scaling {
    /// Vertices of the surfaces, separated by commas; twice as many triangles.
    #[arg(long, value_delimiter = ',', default_values_t = [500, 5_000, 50_000, 500_000, 5_000_000])]
    vertices: Vec<usize>,
    /// Where the figures and the plot are written.
    #[arg(long, value_name = "DIR", default_value = "docs/performance")]
    out: PathBuf,
}

/// One size: marked, then found in a copy that was moved and simplified to a half.
#[derive(Serialize)]
struct Size {
    vertices: usize,
    triangles: usize,
    embed: Job,
    detect: Job,
}

#[derive(Serialize)]
struct Job {
    /// Wall and CPU seconds of the whole process.
    seconds: f64,
    cpu: f64,
    megabytes: f64,
    log10_p: f64,
    /// Wall seconds by stage.
    stages: BTreeMap<String, f64>,
}

pub(crate) fn run(args: &Scaling) -> anyhow::Result<()> {
    let program = Program::build()?;
    let folder = Path::new("target/scaling");
    std::fs::create_dir_all(folder)?;
    let sizes: Vec<Size> =
        args.vertices.iter().map(|&n| measure(&program, folder, n)).collect::<anyhow::Result<_>>()?;
    std::fs::remove_dir_all(folder)?;
    std::fs::create_dir_all(&args.out)?;
    std::fs::write(args.out.join("scaling.json"), serde_json::to_string_pretty(&sizes)? + "\n")?;
    plot::write(&args.out.join("scaling.svg"), (1200, 460), &panels(&sizes))
}

fn measure(program: &Program, folder: &Path, vertices: usize) -> anyhow::Result<Size> {
    let [original, copy, key, suspect] = ["original.ply", "copy.ply", "key", "suspect.ply"]
        .map(|name| folder.join(name).display().to_string());
    let soup = shapes::bumpy_sphere(vertices);
    std::fs::write(&original, encode(Format::PlyBinaryLittleEndian, &soup)?)?;
    let (vertices, triangles) = (soup.points.len(), soup.triangles.len());
    drop(soup);
    let embed = job(program.run(&["embed", &original, "-o", &copy, "--key", &key, "--force"])?)?;
    program.run(&["attack", &copy, "-o", &suspect, "transform", "simplify:ratio=0.5", "--force"])?;
    let detect = job(program.run(&["detect", &suspect, "--original", &original, "--key", &key])?)?;
    println!(
        "{triangles} triangles: embed {:.2} s, {:.0} MB; detect {:.2} s, {:.0} MB, log10 p {:.0}",
        embed.seconds, embed.megabytes, detect.seconds, detect.megabytes, detect.log10_p
    );
    Ok(Size { vertices, triangles, embed, detect })
}

fn job(used: Used) -> anyhow::Result<Job> {
    let Used { seconds, cpu, megabytes, answer } = used;
    let stages = serde_json::from_value(answer["seconds"].clone())?;
    let log10_p = answer["log10_p"].as_f64().context("an answer without log10 p")?;
    Ok(Job { seconds, cpu, megabytes, log10_p, stages })
}

fn panels(sizes: &[Size]) -> [Panel; 2] {
    let line = |name: &str, value: &dyn Fn(&Size) -> f64| Series {
        name: name.to_owned(),
        points: sizes.iter().map(|s| ((s.triangles as f64).log10(), value(s).log10())).collect(),
        intervals: Vec::new(),
        dots: true,
    };
    let stage = |name: &str, key: &'static str, of: fn(&Size) -> &Job| {
        line(name, &|s| 1e6 * of(s).stages.get(key).copied().unwrap_or(0.0).max(1e-5) / s.vertices as f64)
    };
    let whole = |name: &str, of: fn(&Size) -> &Job| line(name, &|s| 1e6 * of(s).seconds / s.vertices as f64);
    let memory = |name: &str, of: fn(&Size) -> &Job| line(name, &|s| of(s).megabytes);
    let triangles = || Axis { label: "triangles", range: 2.9..7.1, powers: true, ticks: 5 };
    [
        Panel {
            caption: "Time",
            x: triangles(),
            y: Axis { label: "microseconds per vertex", range: -1.0..4.0, powers: true, ticks: 6 },
            series: vec![
                whole("embed, whole process", |s| &s.embed),
                whole("detect, whole process", |s| &s.detect),
                stage("conversion", "conversion", |s| &s.embed),
                stage("basis", "basis", |s| &s.embed),
                stage("repair", "repair", |s| &s.embed),
                stage("registration", "registration", |s| &s.detect),
                stage("extraction", "extraction", |s| &s.detect),
            ],
            diagonal: false,
            legend: Some(SeriesLabelPosition::UpperRight),
        },
        Panel {
            caption: "Memory",
            x: triangles(),
            y: Axis { label: "megabytes, peak", range: 0.0..4.5, powers: true, ticks: 5 },
            series: vec![memory("embed", |s| &s.embed), memory("detect", |s| &s.detect)],
            diagonal: false,
            legend: Some(SeriesLabelPosition::UpperLeft),
        },
    ]
}
