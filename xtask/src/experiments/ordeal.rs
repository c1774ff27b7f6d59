//! `cargo xtask ordeal`: random originals of all kinds, marked, attacked at random, and looked at by the whole detection.
//! How often the mark is found matters less here than that every question gets an answer: whatever fails must be about
//! the file.

use super::case::{random_secret, read};
use clap::Args;
use nalgebra::Point3;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::io::{Document, Format, Rewrite, encode};
use sombrero::mesh::Soup;
use sombrero::watermark::{Derivation, Identity, Preset};
use sombrero::{DetectError, DetectOptions, Detector, EmbedError, Embedder, shapes};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// How many, and of what.
#[derive(Args)]
pub(crate) struct Ordeal {
    /// Random originals.
    #[arg(long, default_value_t = 1000)]
    originals: u64,
    /// The number of the first: what fails is found again by its number.
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// A folder of printed parts or other real files, some of which take part. Default: `prints` beside the models, where it
    /// exists.
    #[arg(long, value_name = "DIR")]
    prints: Option<PathBuf>,
    /// Where `ordeal.md` and `ordeal.json` are written.
    #[arg(long, default_value = "docs/evidence")]
    out: PathBuf,
}

/// Vertices of generated originals.
const SMALLEST: f64 = 100.0;
const LARGEST: f64 = 5000.0;

/// What became of one.
#[derive(Serialize, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Fate {
    Found,
    NotFound,
    /// The original carries no mark, and it was said why.
    NotMarked(String),
    /// The attack left nothing.
    NothingLeft(String),
    /// The suspect cannot be compared, and it was said why.
    NotCompared(String),
    /// The program's fault.
    Failed(String),
}

#[derive(Serialize)]
struct Report {
    from: u64,
    originals: u64,
    /// Numbers by kind of original, then by fate.
    kinds: BTreeMap<String, BTreeMap<String, u64>>,
    /// The number and what was done, of all that failed.
    failed: Vec<String>,
}

pub(crate) fn run(args: &Ordeal, folder: &Path) -> anyhow::Result<()> {
    let real = real(args, folder)?;
    let numbers = args.from..args.from + args.originals;
    let ran: Vec<(u64, String, String, Fate)> = numbers
        .into_par_iter()
        .map(|number| {
            let (kind, specs, fate) = ordeal(number, &real);
            if matches!(fate, Fate::Failed(_)) {
                eprintln!("{number}: {kind}, {specs}: {}", fate.words());
            }
            (number, kind, specs, fate)
        })
        .collect();
    let mut report =
        Report { from: args.from, originals: args.originals, kinds: BTreeMap::new(), failed: Vec::new() };
    for (number, kind, specs, fate) in ran {
        if matches!(fate, Fate::Failed(_)) {
            report.failed.push(format!("{number}: {kind}, {specs}: {}", fate.words()));
        }
        *report.kinds.entry(kind).or_default().entry(fate.words()).or_insert(0) += 1;
    }
    let text = markdown(&report);
    println!("{text}");
    std::fs::create_dir_all(&args.out)?;
    std::fs::write(args.out.join("ordeal.md"), text)?;
    std::fs::write(args.out.join("ordeal.json"), serde_json::to_string_pretty(&report)? + "\n")?;
    let failed = report.failed.len();
    anyhow::ensure!(failed == 0, "{failed} of {} failed, which is the program's fault", report.originals);
    Ok(())
}

/// Files that take part, by name.
fn real(args: &Ordeal, folder: &Path) -> anyhow::Result<Vec<(String, Document)>> {
    let mut real = Vec::new();
    for file in ["fandisk.obj", "head.obj"] {
        if folder.join(file).exists() {
            real.push((file.to_owned(), read(folder, file)?));
        }
    }
    let prints = args.prints.clone().unwrap_or_else(|| folder.join("prints"));
    if prints.exists() {
        let mut paths: Vec<PathBuf> =
            std::fs::read_dir(&prints)?.map(|entry| Ok(entry?.path())).collect::<anyhow::Result<_>>()?;
        paths.sort();
        for path in paths.iter().filter(|path| path.is_file()) {
            real.push(("print".to_owned(), Document::read(path)?));
        }
    }
    Ok(real)
}

/// The kind of original, the attacks, and what became of it.
fn ordeal(number: u64, real: &[(String, Document)]) -> (String, String, Fate) {
    let mut rng = ChaCha8Rng::seed_from_u64(number);
    let specs = attacks(&mut rng);
    let picked = if rng.random_bool(0.15) { real.choose(&mut rng) } else { None };
    let (kind, document) = match picked {
        Some((kind, document)) => (kind.clone(), document.clone()),
        None => match generated(&mut rng) {
            Ok((kind, document)) => (kind.to_owned(), document),
            Err(error) => return ("generated".to_owned(), specs, Fate::Failed(error.to_string())),
        },
    };
    let tried = catch_unwind(AssertUnwindSafe(|| put_to_it(&document, &specs, &mut rng)));
    let fate = tried.unwrap_or_else(|_| Fate::Failed("panic".to_owned()));
    (kind, specs, fate)
}

fn put_to_it(document: &Document, specs: &str, rng: &mut ChaCha8Rng) -> Fate {
    let preset = *Preset::ALL.choose(rng).unwrap_or(&Preset::Robust);
    let embedder = match Embedder::new(document, preset.parameters(), true) {
        Ok(embedder) => embedder.with_derivation(Derivation::stub_for_experiments()),
        Err(error) => return not_marked(&error),
    };
    let marked = match embedder.mark(Identity::default(), random_secret(rng), &Rewrite::default()) {
        Ok(marked) => marked,
        Err(error) => return not_marked(&error),
    };
    let attacked = parse_list(specs).map_err(|e| e.to_string()).and_then(|attacks| {
        let copy = Soup::new(marked.points, document.triangles().to_vec());
        apply_all(&attacks, &copy, rng).map_err(|e| e.to_string())
    });
    let suspect = match attacked {
        Ok(attacked) => attacked.soup,
        Err(reason) => return Fate::NothingLeft(without_numbers(&reason)),
    };
    let detector = match Detector::trusting(document, marked.key) {
        Ok(detector) => detector,
        Err(error) => return Fate::Failed(error.to_string()),
    };
    let written = encode(Format::PlyBinaryLittleEndian, &suspect).map_err(|e| e.to_string());
    let suspect = match written.and_then(|bytes| Document::parse(bytes, None).map_err(|e| e.to_string())) {
        Ok(suspect) => suspect,
        Err(reason) => return Fate::NothingLeft(without_numbers(&reason)),
    };
    match detector.detect(&detector.suspect(&suspect), &DetectOptions::default()) {
        Ok(detection) if !detection.log10_p.is_finite() => Fate::Failed("p is not finite".to_owned()),
        Ok(detection) if detection.detected => Fate::Found,
        Ok(_) => Fate::NotFound,
        Err(error @ (DetectError::NoFaces { .. } | DetectError::Search(_))) => {
            let reason = error.to_string();
            // What registration says of a shape is about the file; what a solver says of a matrix is not.
            match &error {
                DetectError::Search(sombrero::SearchError::Estimate(_)) => Fate::Failed(reason),
                _ => Fate::NotCompared(without_numbers(&reason)),
            }
        }
        Err(error) => Fate::Failed(error.to_string()),
    }
}

fn not_marked(error: &EmbedError) -> Fate {
    match error {
        EmbedError::Extract(_) | EmbedError::ReadBack(_) => Fate::Failed(error.to_string()),
        _ => Fate::NotMarked(without_numbers(&error.to_string())),
    }
}

/// So that reasons can be counted.
fn without_numbers(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '0'..='9' if out.ends_with('N') => {}
            '0'..='9' => out.push('N'),
            c => out.push(c),
        }
    }
    out
}

/// One to three of the battery, with any strength that it may have.
fn attacks(rng: &mut ChaCha8Rng) -> String {
    let mut one = || match rng.random_range(0..16) {
        0 => "reorder".to_owned(),
        1 => format!("noise:amplitude={}", rng.random_range(0.0..0.01)),
        2 => format!("smooth:iterations={}", rng.random_range(1..30)),
        3 | 4 => "transform".to_owned(),
        5 => format!("simplify:ratio={}", rng.random_range(0.1..0.9)),
        6 => "watermark".to_owned(),
        7 => format!("crop:fraction={}", rng.random_range(0.0..0.7)),
        8 => format!("quantize:bits={}", rng.random_range(6..16)),
        9 => "subdivide:scheme=midpoint".to_owned(),
        10 => format!("affine:strength={}", rng.random_range(0.0..0.3)),
        11 => format!("projective:strength={}", rng.random_range(0.0..0.2)),
        12 => format!("ffd:strength={}", rng.random_range(0.0..0.05)),
        13 => format!("isosurface:resolution={}", rng.random_range(16..64)),
        14 => format!("remesh:length={}", rng.random_range(0.7..1.5)),
        _ => format!("laplacian:iterations={}", rng.random_range(1..20)),
    };
    let first = one();
    let further: Vec<String> = (0..2).map(|_| one()).collect();
    let count = rng.random_range(0..3);
    [first].into_iter().chain(further).take(count + 1).collect::<Vec<_>>().join(" ")
}

/// A shape of random parameters and size, as a file.
fn generated(rng: &mut ChaCha8Rng) -> anyhow::Result<(&'static str, Document)> {
    let vertices = SMALLEST * (LARGEST / SMALLEST).powf(rng.random::<f64>());
    let side = |share: f64| (vertices / share).sqrt().max(1.0) as usize;
    let (kind, mut soup) = match rng.random_range(0..8) {
        0 => ("bust", shapes::bust(side(10.0))),
        1 => ("part", shapes::part(side(60.0).max(2))),
        2 => ("bumpy sphere", shapes::bumpy_sphere(vertices as usize)),
        3 => ("torus", shapes::torus(side(0.5), side(2.0).max(3), 2.0, rng.random_range(0.2..1.5))),
        4 => {
            let holes = rng.random_range(1..5);
            ("genus", shapes::genus(holes, side(18.0 * holes as f64 + 14.0)))
        }
        5 => ("sheet", shapes::open_sheet(side(1.0), side(1.0))),
        6 => ("sheet with a hole", shapes::sheet_with_hole(side(1.0), side(1.0))),
        _ => ("plate", plate(side(2.0), rng)),
    };
    let bent = rng.random_range(0.0..0.05);
    let specs = match (kind, rng.random_range(0..3)) {
        ("plate", _) | (_, 0) => "none".to_owned(),
        (_, 1) => format!("affine:strength={}", rng.random_range(0.0..1.0)),
        _ => format!("ffd:strength={bent} noise:amplitude={}", rng.random_range(0.0..0.003)),
    };
    soup = apply_all(&parse_list(&specs)?, &soup, rng)?.soup;
    let scale = 10f64.powf(rng.random_range(-3.0..3.0));
    soup.points.iter_mut().for_each(|p| *p *= scale);
    let formats = [Format::PlyBinaryLittleEndian, Format::Obj, Format::StlBinary, Format::Off];
    let format = *formats.choose(rng).unwrap_or(&Format::Obj);
    Ok((kind, Document::parse(encode(format, &soup)?, None)?))
}

/// A flat plate with a thickness, as CAD exports: nothing but planes, cut into squares.
fn plate(side: usize, rng: &mut ChaCha8Rng) -> Soup {
    let sheet = shapes::open_sheet(side, side);
    let thickness = rng.random_range(0.01..0.3);
    let count = sheet.points.len() as u32;
    let flat = |z: f64| sheet.points.iter().map(move |p| Point3::new(p.x, p.y, z));
    let points: Vec<Point3<f64>> = flat(0.0).chain(flat(thickness)).collect();
    let mut triangles: Vec<[u32; 3]> = sheet.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    triangles.extend(sheet.triangles.iter().map(|corners| corners.map(|v| v + count)));
    // Edges that one triangle alone has are the rim.
    let edges: Vec<(u32, u32)> =
        sheet.triangles.iter().flat_map(|[a, b, c]| [(*a, *b), (*b, *c), (*c, *a)]).collect();
    let all: std::collections::BTreeSet<(u32, u32)> = edges.iter().copied().collect();
    for (a, b) in edges.into_iter().filter(|(a, b)| !all.contains(&(*b, *a))) {
        triangles.push([a, b, b + count]);
        triangles.push([a, b + count, a + count]);
    }
    Soup::new(points, triangles)
}

impl Fate {
    fn words(&self) -> String {
        match self {
            Self::Found => "found".to_owned(),
            Self::NotFound => "not found".to_owned(),
            Self::NotMarked(reason) => format!("not marked: {reason}"),
            Self::NothingLeft(reason) => format!("nothing to look at: {reason}"),
            Self::NotCompared(reason) => format!("not compared: {reason}"),
            Self::Failed(reason) => format!("FAILED: {reason}"),
        }
    }
}

fn markdown(report: &Report) -> String {
    let mut out = String::from(
        "# Random originals through the whole detection\n\nWritten by `cargo xtask ordeal`. Each original is marked, attacked \
         by one to three attacks of random kind and strength, written, read and looked at with the defaults.\n\n",
    );
    let mut fates: BTreeMap<&str, u64> = BTreeMap::new();
    for (fate, count) in report.kinds.values().flatten() {
        *fates.entry(fate).or_default() += count;
    }
    let mut line = |text: String| writeln!(out, "{text}").expect("text can be written to a string");
    line(format!("{} originals, {} failures of the program.\n", report.originals, report.failed.len()));
    line("| original | number | found | not found | other |\n|---|---|---|---|---|".to_owned());
    for (kind, counts) in &report.kinds {
        let of = |fate: &str| counts.get(fate).copied().unwrap_or(0);
        let all: u64 = counts.values().sum();
        let (found, not) = (of("found"), of("not found"));
        line(format!("| {kind} | {all} | {found} | {not} | {} |", all - found - not));
    }
    line("\n| fate | number |\n|---|---|".to_owned());
    fates.iter().for_each(|(fate, count)| line(format!("| {fate} | {count} |")));
    if !report.failed.is_empty() {
        line("\nFailures:\n".to_owned());
        report.failed.iter().for_each(|failure| line(format!("- {failure}")));
    }
    out
}
