//! `sombrero demo`: the whole story on generated models.

mod case;
mod pictures;

use crate::answer::Answer;
use crate::failure::Failure;
use crate::files;
use crate::progress::Progress;
use crate::table::Table;
use case::{Case, File, Tried};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use sombrero::EmbedReport;
use sombrero::io::{Access, Format, Output};
use sombrero::shapes;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

// What is typed after `sombrero demo`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The folder to write to.
    #[arg(short, long, value_name = "DIR", default_value = "sombrero-demo")]
    output: PathBuf,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Replace files that exist.
    #[arg(long)]
    force: bool,
}

#[derive(Serialize)]
struct Report {
    output: String,
    models: Vec<ModelReport>,
    rows: Vec<Row>,
    files: Vec<String>,
}

#[derive(Serialize)]
struct ModelReport {
    name: &'static str,
    embed: EmbedReport,
}

#[derive(Serialize)]
struct Row {
    model: &'static str,
    suspect: &'static str,
    file: String,
    marked: bool,
    detected: bool,
    log10_p: f64,
    correlation: f64,
    registration: bool,
    resampling: bool,
}

pub(crate) fn run(args: &Args) -> Result<Answer, Failure> {
    check_folder(args)?;
    let progress = Progress::new("making, marking, attacking and detecting");
    let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
    let cases = [
        Case::new("part", Format::Obj, &shapes::part(shapes::PART_RESOLUTION), &mut rng)?,
        Case::new("bust", Format::PlyBinaryLittleEndian, &shapes::bust(shapes::BUST_RESOLUTION), &mut rng)?,
    ];
    let (mut rows, mut files, mut strips) = (Vec::new(), Vec::new(), Vec::new());
    let done = AtomicUsize::new(0);
    progress.count(0, cases.len() * Case::SUSPECTS);
    let count = || progress.count(done.fetch_add(1, Ordering::Relaxed) + 1, cases.len() * Case::SUSPECTS);
    for case in &cases {
        let tried = case.tried(args.seed, &count)?;
        strips.push(pictures::strip(case, &tried));
        files.extend(case.files(&tried)?);
        rows.extend(tried.iter().map(|tried| row(case, tried)));
    }
    let png = pictures::stacked(&strips)?;
    files.push(File { name: "demo.png".into(), bytes: png, access: Access::Usual });

    write(args, &files)?;
    let report = Report {
        output: args.output.display().to_string(),
        models: cases.iter().map(|c| ModelReport { name: c.name, embed: c.marked.report.clone() }).collect(),
        rows,
        files: files.iter().map(|f| args.output.join(&f.name).display().to_string()).collect(),
    };
    Answer::new(text(&report), &report)
}

fn row(case: &Case, tried: &Tried) -> Row {
    let detection = &tried.detection;
    Row {
        model: case.name,
        suspect: tried.name,
        file: tried.file.clone(),
        marked: tried.marked,
        detected: detection.detected,
        log10_p: detection.log10_p,
        correlation: detection.correlation,
        registration: detection.variant.is_some_and(|variant| variant.registration),
        resampling: detection.variant.is_some_and(|variant| variant.resampling),
    }
}

/// Before any work: the folder can be one, and nothing of ours is in it, unless it may be replaced.
fn check_folder(args: &Args) -> Result<(), Failure> {
    let folder = &args.output;
    if folder.exists() {
        files::make_folder(folder)?;
    }
    let names = ["part.obj", "part.key", "bust.ply", "bust.key", "demo.png"];
    let paths = names.map(|name| folder.join(name));
    files::check_outputs(&paths.each_ref().map(PathBuf::as_path), &[], args.force)
}

fn write(args: &Args, files: &[File]) -> Result<(), Failure> {
    let paths: Vec<PathBuf> = files.iter().map(|f| args.output.join(&f.name)).collect();
    files::check_outputs(&paths.iter().map(PathBuf::as_path).collect::<Vec<_>>(), &[], args.force)?;
    files::make_folder(&args.output)?;
    let outputs: Vec<Output<'_>> =
        paths.iter().zip(files).map(|(path, f)| Output { path, bytes: &f.bytes, access: f.access }).collect();
    files::write_all(&outputs, args.force)
}

fn text(report: &Report) -> Table {
    let mut table = Table::default();
    for model in &report.models {
        let e = &model.embed;
        table = table.line(format!(
            "{:<5} {} vertices; {} coefficients move vertices by {:.4} at most, {:.5} rms, of the largest side",
            model.name, e.vertices, e.coefficients, e.distortion.relative_max, e.distortion.relative_rms
        ));
    }
    table = table.line("").line(format!("{:<24}{:>12}{:>8}{:>12}{:>8}", "log10 p", "part", "", "bust", ""));
    let of = |name: &'static str| report.rows.iter().filter(move |r| r.model == name);
    for (part, bust) in of("part").zip(of("bust")) {
        let cell = |r: &Row| format!("{:>12.1}{:>8}", r.log10_p, if r.detected { "found" } else { "-" });
        table = table.line(format!("{:<24}{}{}", part.suspect, cell(part), cell(bust)));
    }
    table
        .line("")
        .line("log10 p: the chance that an unmarked mesh matches as well, as a power of ten; found: -6 or below.")
        .line(format!(
            "{} files in {}: meshes, keys, demo.png, part-report.html and bust-report.html to open in a browser",
            report.files.len(),
            report.output
        ))
}
