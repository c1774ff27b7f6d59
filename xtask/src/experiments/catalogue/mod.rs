//! `cargo xtask catalogue`: builds a catalogue of generated originals with hard siblings and of real ones from a folder, makes
//! suspects of every class, asks, and writes how often the right one is found, how large the catalogue is and how long it takes.

pub(crate) mod families;
mod jitter;
mod marked;
mod measure;
mod nearer;
mod nets;
mod queries;
mod show;
mod train;

use anyhow::{Context, bail};
use measure::{Asked, Original, ask, build};
use queries::Class;
use serde::Serialize;
use sha2::{Digest, Sha256};
use sombrero::io::Document;
use sombrero_catalogue::{Catalogue, Question, SearchOptions};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What to put in, and what to ask.
#[derive(clap::Args)]
pub(crate) struct CatalogueArgs {
    /// Generated originals, in families of ten.
    #[arg(long, default_value_t = 10_000)]
    originals: u64,
    /// Questions of each class.
    #[arg(long, default_value_t = 350)]
    questions: usize,
    /// Classes of suspects whose names contain one of these, separated by commas. Default: all.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// A folder of real meshes that are originals too; may be given several times.
    #[arg(long, value_name = "DIR")]
    real: Vec<PathBuf>,
    /// Times that each portrait is put in again with its landmarks shaken, to fill the index.
    #[arg(long, default_value_t = 0)]
    jitter: u64,
    /// Where the catalogue is built; one that is there is used. Default: a temporary folder.
    #[arg(long, value_name = "DIR")]
    work: Option<PathBuf>,
    /// Only marks so many originals, makes suspects of the copies, and looks whether `search` names owner and buyer.
    #[arg(long, value_name = "N")]
    marked: Option<u64>,
    /// With --marked: so many suspects besides that carry no mark.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "marked")]
    foreign: u64,
    /// Only trains the table of features anew, from generated shapes, and writes it here.
    #[arg(long, value_name = "FILE")]
    train: Option<PathBuf>,
    /// Where `catalogue.md`, `catalogue.json` and `catalogue.svg` are written.
    #[arg(long, default_value = "docs/catalogue")]
    out: PathBuf,
}

/// All figures of a run.
#[derive(Serialize)]
struct Record {
    generated: u64,
    real: usize,
    entries: usize,
    megabytes: f64,
    bytes_an_entry: f64,
    build_seconds: Option<f64>,
    open_seconds: f64,
    /// One after the other, nothing else of ours running: descriptors included.
    alone: Vec<Alone>,
    peak_megabytes: f64,
    asked: Vec<Asked>,
}

/// Seconds of one question by itself.
#[derive(Serialize)]
struct Alone {
    class: &'static str,
    describe_seconds: f64,
    search_seconds: f64,
}

pub(crate) fn run(args: &CatalogueArgs) -> anyhow::Result<()> {
    if let Some(file) = &args.train {
        return train::run(file);
    }
    let temporary = std::env::temp_dir().join(format!("sombrero-catalogue-{}", std::process::id()));
    let folder = args.work.clone().unwrap_or_else(|| temporary.clone());
    match args.marked {
        Some(copies) => marked::run(&folder, copies, args.foreign, &args.out)?,
        None => recalled(args, &folder)?,
    }
    if args.work.is_none() {
        std::fs::remove_dir_all(&temporary)?;
    }
    Ok(())
}

/// How often the right one is found, written down.
fn recalled(args: &CatalogueArgs, folder: &Path) -> anyhow::Result<()> {
    let mut originals: Vec<Original> = (0..args.originals).map(Original::generated).collect();
    for folder in &args.real {
        originals.extend(real(folder)?);
    }
    if originals.is_empty() {
        bail!("a catalogue of nothing answers nothing");
    }
    let build_seconds = (!folder.exists()).then(|| build(folder, &originals, args.jitter)).transpose()?;
    let record = measured(args, folder, &originals, build_seconds)?;
    std::fs::create_dir_all(&args.out)?;
    show::write(&args.out, &record)
}

fn measured(
    args: &CatalogueArgs,
    folder: &Path,
    originals: &[Original],
    build_seconds: Option<f64>,
) -> anyhow::Result<Record> {
    let start = Instant::now();
    let catalogue = Catalogue::open(folder)?;
    let open_seconds = start.elapsed().as_secs_f64();
    let wanted = |class: &Class| {
        args.only.is_empty() || args.only.iter().any(|part| class.name().contains(part.as_str()))
    };
    let classes: Vec<Class> = Class::ALL.into_iter().filter(wanted).collect();
    let asked = ask(&catalogue, originals, args.questions, &classes);
    forget_peak();
    let alone = alone(&catalogue, originals, &classes)?;
    let sizes = std::fs::read_dir(folder)?.map(|file| Ok(file?.metadata()?.len()));
    let bytes = sizes.sum::<std::io::Result<u64>>()? as f64;
    let generated = args.originals;
    Ok(Record {
        generated,
        real: originals.len() - generated as usize,
        entries: catalogue.len(),
        megabytes: bytes / 1e6,
        bytes_an_entry: bytes / catalogue.len() as f64,
        build_seconds,
        open_seconds,
        alone,
        peak_megabytes: peak_megabytes(),
        asked,
    })
}

/// Three questions of each class, one after the other; the second of three by time.
fn alone(catalogue: &Catalogue, originals: &[Original], classes: &[Class]) -> anyhow::Result<Vec<Alone>> {
    let mut times = Vec::new();
    for &class in classes {
        let fit: Vec<&Original> = originals.iter().filter(|original| original.suits(class)).collect();
        let mut own = Vec::new();
        for k in 0..3.min(fit.len()) {
            let suspect = class.suspect(&fit[k * fit.len() / 3].soup(), k as u64)?.soup;
            let start = Instant::now();
            let question = Question::of(&suspect.points, &suspect.triangles)?;
            let described = start.elapsed().as_secs_f64();
            catalogue.search(&question, &SearchOptions::default())?;
            own.push((described, start.elapsed().as_secs_f64() - described));
        }
        own.sort_by(|a, b| (a.0 + a.1).total_cmp(&(b.0 + b.1)));
        if let Some(&(describe_seconds, search_seconds)) = own.get(own.len() / 2) {
            times.push(Alone { class: class.name(), describe_seconds, search_seconds });
        }
    }
    Ok(times)
}

/// From here on the most memory is counted anew, where the system can do so.
fn forget_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// The most memory that this process had since then; 0 where the system does not tell.
fn peak_megabytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok()).unwrap_or(0.0) / 1e3
}

/// The meshes of a folder, by name; what cannot be read or has no surface is passed over, and what is there twice.
fn real(folder: &Path) -> anyhow::Result<Vec<Original>> {
    let files = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths = files.map(|file| Ok(file?.path())).collect::<std::io::Result<Vec<PathBuf>>>()?;
    paths.sort();
    let mut known = std::collections::BTreeSet::new();
    let mut found = Vec::new();
    for path in paths {
        let Ok(document) = Document::read(&path) else { continue };
        let soup = document.soup();
        let bits: Vec<u8> = soup.points.iter().flat_map(|p| p.iter().flat_map(|x| x.to_le_bytes())).collect();
        let usable = (100..400_000).contains(&soup.triangles.len())
            && sombrero_catalogue::Portrait::of(&soup.points, &soup.triangles).is_ok();
        if usable && known.insert(Sha256::digest(&bits)) {
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
            found.push(Original::real(name.unwrap_or_default(), path));
        }
    }
    Ok(found)
}
