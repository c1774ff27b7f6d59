//! `sombrero demo`: the whole story on generated models.

use crate::args::Demo;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, files};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use sha2::{Digest, Sha256};
use sombrero::attacks::{Attack, Attacked, apply_all, noise};
use sombrero::io::{Access, Document, Format, Output, encode, write_together};
use sombrero::mesh::{Soup, shapes};
use sombrero::render::{Camera, HeatMap, Image, RenderOptions, render, used_points};
use sombrero::report::{DetectionReport, FileLabel, detection_report};
use sombrero::watermark::{Identity, Secret};
use sombrero::{DetectOptions, EmbedOptions, EmbedReport, Marked, Prepared, Stages, Suspect, Variant, embed};
use std::path::{Path, PathBuf};

/// The attacks of the table.
const BATTERY: [(&str, &str); 12] = [
    ("none", "none"),
    ("noise 0.2 %", "noise:amplitude=0.002"),
    ("noise 0.45 %", "noise:amplitude=0.0045"),
    ("noise 0.7 %", "noise:amplitude=0.007"),
    ("smoothing", "smooth:iterations=10"),
    ("second watermark", "watermark"),
    ("crop, right third", "crop:fraction=0.333"),
    ("turned, moved, scaled", "transform"),
    ("simplified to a half", "reorder simplify:ratio=0.5"),
    ("bent by 2 %, simplified", "simplify:ratio=0.5 ffd:strength=0.02"),
    ("marching cubes", "isosurface:resolution=96 transform"),
    (
        "all of the paper's",
        "reorder noise:amplitude=0.002 smooth:iterations=10 transform simplify:ratio=0.5 watermark crop:fraction=0.333",
    ),
];

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
    marked: bool,
    detected: bool,
    log10_p: f64,
    correlation: f64,
    registration: bool,
    resampling: bool,
}

/// A model with its mark.
struct Case {
    name: &'static str,
    extension: &'static str,
    original: Document,
    marked: Marked,
    prepared: Prepared,
}

/// A file to be written.
struct File {
    path: PathBuf,
    bytes: Vec<u8>,
    access: Access,
}

pub(crate) fn run(args: &Demo) -> Result<Answer, Failure> {
    check_folder(args)?;
    let _progress = Progress::new("making, marking, attacking and detecting");
    let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
    let cases = [
        Case::new("part", "obj", Format::Obj, &shapes::part(shapes::PART_RESOLUTION), &mut rng)?,
        Case::new(
            "bust",
            "ply",
            Format::PlyBinaryLittleEndian,
            &shapes::bust(shapes::BUST_RESOLUTION),
            &mut rng,
        )?,
    ];
    let (mut rows, mut files, mut strips) = (Vec::new(), Vec::new(), Vec::new());
    for case in &cases {
        let attacked = case.attacked(args.seed)?;
        rows.extend(case.rows(&attacked)?);
        files.extend(case.files(&args.output, &attacked)?);
        strips.push(case.pictures(&attacked));
        files.push(case.report(&args.output, &attacked[REPORTED])?);
    }
    let picture = Image::stacked(&strips, GAP, BACKGROUND);
    let png = picture.to_png().map_err(|e| Failure::new("internal", e.to_string()))?;
    files.push(File { path: args.output.join("demo.png"), bytes: png, access: Access::Usual });

    write(args, &files)?;
    let report = Report {
        output: args.output.display().to_string(),
        models: cases.iter().map(|c| ModelReport { name: c.name, embed: c.marked.report.clone() }).collect(),
        rows,
        files: files.iter().map(|f| f.path.display().to_string()).collect(),
    };
    Answer::new(text(&report), &report)
}

impl Case {
    fn new(
        name: &'static str,
        extension: &'static str,
        format: Format,
        soup: &Soup,
        rng: &mut ChaCha8Rng,
    ) -> Result<Self, Failure> {
        let failed = |e: &dyn std::error::Error| Failure::new("internal", format!("the {name}: {e}"));
        let original = Document::parse(encode(format, soup)?, Some(extension)).map_err(|e| failed(&e))?;
        let identity = Identity { owner: "the demo".into(), recipient: "nobody".into() };
        let options = EmbedOptions { identity, ..EmbedOptions::default() };
        let marked = embed(&original, Secret(rng.random()), &options).map_err(|e| failed(&e))?;
        let prepared = Prepared::new(&original, marked.key.clone()).map_err(|e| failed(&e))?;
        Ok(Self { name, extension, original, marked, prepared })
    }

    /// The marked mesh after each attack of the battery; vertices stay recognisable.
    fn attacked(&self, seed: u64) -> Result<Vec<Attacked>, Failure> {
        let failed = |e: &dyn std::error::Error| Failure::new("internal", format!("the {}: {e}", self.name));
        let marked =
            Document::parse(self.marked.bytes.clone(), Some(self.extension)).map_err(|e| failed(&e))?;
        let attacks = BATTERY.iter().map(|(_, spec)| {
            let attacks: Result<Vec<Attack>, _> = spec.split(' ').map(str::parse).collect();
            apply_all(&attacks.map_err(|e| failed(&e))?, &marked.soup(), &mut ChaCha8Rng::seed_from_u64(seed))
                .map_err(|e| failed(&e))
        });
        attacks.collect()
    }

    fn rows(&self, attacked: &[Attacked]) -> Result<Vec<Row>, Failure> {
        let points = self.original.points().len();
        let mut rows = Vec::new();
        for ((suspect, _), attacked) in BATTERY.iter().zip(attacked) {
            // Files keep no correspondence when vertices are reordered, cropped or new.
            let same = attacked.soup.triangles == self.original.triangles();
            let correspondence = same.then(|| attacked.correspondence(points));
            rows.push(self.row(suspect, true, Suspect { soup: attacked.soup.clone(), correspondence })?);
        }
        let noise = noise(self.original.points(), 0.002 * self.size(), &mut ChaCha8Rng::seed_from_u64(1));
        let correspondence = Some(noise.iter().copied().map(Some).collect());
        let soup = Soup::new(noise, self.original.triangles().to_vec());
        rows.push(self.row("not marked, noise 0.2 %", false, Suspect { soup, correspondence })?);
        Ok(rows)
    }

    fn row(&self, name: &'static str, marked: bool, suspect: Suspect) -> Result<Row, Failure> {
        let detection = self.prepared.detect(&suspect, &DetectOptions::default());
        let detection = detection.map_err(|e| Failure::new("internal", format!("the {}: {e}", self.name)))?;
        let (detected, log10_p, correlation) = (detection.detected, detection.log10_p, detection.correlation);
        let Variant { registration, resampling, .. } = detection.variant;
        Ok(Row {
            model: self.name,
            suspect: name,
            marked,
            detected,
            log10_p,
            correlation,
            registration,
            resampling,
        })
    }

    fn size(&self) -> f64 {
        self.prepared.model().largest_side()
    }

    fn files(&self, folder: &Path, attacked: &[Attacked]) -> Result<Vec<File>, Failure> {
        let named = |suffix: &str, extension: &str| folder.join(format!("{}{suffix}.{extension}", self.name));
        let usual = |path, bytes| File { path, bytes, access: Access::Usual };
        let mut files = vec![
            usual(named("", self.extension), self.original.bytes().to_vec()),
            usual(named("-marked", self.extension), self.marked.bytes.clone()),
            File {
                path: named("", "key"),
                bytes: self.marked.key.to_json().into_bytes(),
                access: Access::Private,
            },
        ];
        for (i, attacked) in attacked.iter().enumerate().skip(1) {
            let bytes = encode(self.original.format(), &attacked.soup)?;
            files.push(usual(folder.join(slug(self.name, i, self.extension)), bytes));
        }
        Ok(files)
    }

    /// The report that `detect --report` would write for the suspect that was moved.
    fn report(&self, folder: &Path, attacked: &Attacked) -> Result<File, Failure> {
        let failed = |e: &dyn std::error::Error| Failure::new("internal", format!("the {}: {e}", self.name));
        let suspect = Suspect {
            soup: attacked.soup.clone(),
            correspondence: Some(attacked.correspondence(self.original.points().len())),
        };
        let mut detection =
            self.prepared.detect(&suspect, &DetectOptions::default()).map_err(|e| failed(&e))?;
        // One seed, one demo: times would differ from run to run.
        detection.seconds = Stages::default();
        let bytes = encode(self.original.format(), &attacked.soup)?;
        let names = [
            format!("{}.{}", self.name, self.extension),
            slug(self.name, REPORTED, self.extension),
            format!("{}.key", self.name),
        ];
        let key = self.marked.key.to_json();
        let hashes = [self.original.bytes(), &bytes, key.as_bytes()].map(|b| hex::encode(Sha256::digest(b)));
        let [original_file, suspect_file, key_file] =
            std::array::from_fn(|i| FileLabel { name: &names[i], sha256: &hashes[i] });
        let page = detection_report(&DetectionReport {
            detection: &detection,
            key: &self.marked.key,
            original: self.prepared.model(),
            suspect: &attacked.soup,
            found: Some(&detection.found),
            original_file,
            suspect_file,
            key_file,
            command: &format!("sombrero detect {} --original {} --key {}", names[1], names[0], names[2]),
            date: None,
            evidence: None,
        });
        let page = page.map_err(|e| failed(&e))?;
        let path = folder.join(format!("{}-report.html", self.name));
        Ok(File { path, bytes: page.into_bytes(), access: Access::Usual })
    }

    /// Original, marked, displacement as a heat map, strong noise, smoothed, cropped; from one camera.
    fn pictures(&self, attacked: &[Attacked]) -> Image {
        let soup = self.original.soup();
        let direction =
            if self.name == "bust" { Vector3::new(-0.5, -0.15, -1.0) } else { Vector3::new(-0.7, 1.0, -0.6) };
        let up = if self.name == "bust" { Vector3::y() } else { Vector3::z() };
        let camera = Camera::framing(&used_points(&soup.points, &soup.triangles), direction, up);
        let options = RenderOptions {
            width: SIZE,
            height: SIZE,
            camera: Some(camera),
            background: BACKGROUND,
            ..RenderOptions::default()
        };
        let shaded = |soup: &Soup| render(&soup.points, &soup.triangles, &options);
        let marked = &attacked[0].soup;
        let moved = soup.points.iter().zip(&marked.points).map(|(p, q)| (q - p).norm()).collect();
        let heat = RenderOptions { heat_map: Some(HeatMap::new(moved)), ..options.clone() };
        let pictures = [
            shaded(&soup),
            shaded(marked),
            render(&marked.points, &marked.triangles, &heat),
            shaded(&attacked[3].soup),
            shaded(&attacked[4].soup),
            shaded(&attacked[6].soup),
        ];
        Image::beside(&pictures, GAP, BACKGROUND)
    }
}

/// The row of the battery whose detection is reported: turned, moved, scaled.
const REPORTED: usize = 7;

/// The file name of an attacked model.
fn slug(model: &str, row: usize, extension: &str) -> String {
    let words: String = BATTERY[row].0.chars().filter(|c| c.is_alphanumeric() || *c == '.').collect();
    format!("{model}-{words}.{extension}")
}

const SIZE: u32 = 360;
const GAP: u32 = 8;
const BACKGROUND: [u8; 4] = [255; 4];

/// Before any work: the folder can be one, and nothing of ours is in it, unless it may be replaced.
fn check_folder(args: &Demo) -> Result<(), Failure> {
    let folder = &args.output;
    if folder.exists() && !folder.is_dir() {
        let message = format!("{}: not a folder; choose another name", folder.display());
        return Err(Failure::new("write", message));
    }
    let names = ["part.obj", "part.key", "bust.ply", "bust.key", "demo.png"];
    let paths = names.map(|name| folder.join(name));
    files::check_outputs(&paths.each_ref().map(PathBuf::as_path), &[], args.force)
}

fn write(args: &Demo, files: &[File]) -> Result<(), Failure> {
    let paths: Vec<&Path> = files.iter().map(|f| f.path.as_path()).collect();
    files::check_outputs(&paths, &[], args.force)?;
    std::fs::create_dir_all(&args.output).map_err(|e| Failure::about("write", &args.output, &e))?;
    let outputs: Vec<Output<'_>> =
        files.iter().map(|f| Output { path: &f.path, bytes: &f.bytes, access: f.access }).collect();
    Ok(write_together(&outputs, files::overwrite(args.force))?)
}

fn text(report: &Report) -> String {
    let mut lines = Vec::new();
    for model in &report.models {
        let e = &model.embed;
        lines.push(format!(
            "{:<5} {} vertices; {} coefficients move vertices by {:.4} at most, {:.5} rms, of the largest side",
            model.name, e.vertices, e.coefficients, e.distortion.relative_max, e.distortion.relative_rms
        ));
    }
    lines.push(String::new());
    lines.push(format!("{:<24}{:>12}{:>8}{:>12}{:>8}", "log10 p", "part", "", "bust", ""));
    let of = |name: &'static str| report.rows.iter().filter(move |r| r.model == name);
    for (part, bust) in of("part").zip(of("bust")) {
        let cell = |r: &Row| format!("{:>12.1}{:>8}", r.log10_p, if r.detected { "found" } else { "-" });
        lines.push(format!("{:<24}{}{}", part.suspect, cell(part), cell(bust)));
    }
    lines.push(String::new());
    lines.push(
        "log10 p: the chance that an unmarked mesh matches as well, as a power of ten; found: -6 or below."
            .into(),
    );
    lines.push(format!(
        "{} files in {}: meshes, keys, demo.png and two reports",
        report.files.len(),
        report.output
    ));
    lines.join("\n")
}
