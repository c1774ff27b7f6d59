//! `cargo xtask alignment`: how often a suspect is brought back onto the original without a hint, and how often
//! the answer says rightly whether it can be trusted.
//!
//! A trial damages a model, moves it by a random similarity (any rotation, scales from 0.1 to 10) and asks for
//! the way back. A pose is right when no vertex of the original ends up farther from its place than 1 % of
//! the largest side. Of a symmetric shape several poses look alike; a trial succeeds when one of those returned
//! is right, or when the best one puts the shape onto itself.

use anyhow::{Context, bail};
use indicatif::{ProgressBar, ProgressStyle};
use nalgebra::{Matrix3, Matrix4, Point3, Rotation3, Similarity3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use sombrero::attacks::{Attack, apply};
use sombrero::io::Document;
use sombrero::mesh::Soup;
use sombrero::registration::{
    AffinePose, AffineRegistration, Reference, RegisterOptions, Registration, register, register_affine,
};
use sombrero::shapes;
use sombrero::spatial::Surface;
use sombrero::stats::median;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Alignment without a hint.
#[derive(clap::Args)]
pub(crate) struct Alignment {
    /// Trials of each kind on each model.
    #[arg(long, default_value_t = 100)]
    trials: u64,
    /// Only models and kinds whose names contain one of these, as `bunny` or `bunny/third`.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    only: Vec<String>,
    /// Where the results are written, without the endings `.md` and `.json`.
    #[arg(long, default_value = "docs/alignment")]
    out: PathBuf,
}

const SEED: u64 = 1999;
/// Farthest that a vertex may be from its place, in largest sides.
const RIGHT: f64 = 0.01;

/// What is done to a model before it is moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Whole,
    Noise,
    ThirdCut,
    HalfCut,
    BasePlate,
    SecondObject,
    Affine,
    AffineThirdCut,
    Unrelated,
    Battered,
}

const KINDS: [(Kind, &str, &str); 10] = [
    (Kind::Whole, "whole", "nothing else"),
    (Kind::Noise, "noise", "noise of 0.2 % of the largest side"),
    (Kind::ThirdCut, "third cut", "simplified to half, and a plane cuts away a third of the area"),
    (Kind::HalfCut, "half cut", "a plane cuts away half of the area"),
    (Kind::BasePlate, "base plate", "stands on a box, 1.3 times as wide and a tenth as high as the model"),
    (Kind::SecondObject, "second object", "a box of the same area stands beside it, in some direction"),
    (Kind::Affine, "affine", "a random affine map of condition up to 1.5"),
    (Kind::AffineThirdCut, "affine, third cut", "simplified to half, a third cut away, then an affine map"),
    (Kind::Unrelated, "unrelated", "another model; no pose is right"),
    (Kind::Battered, "battered", "simplified to half, noise of 0.7 % of the largest side, a third cut away"),
];

/// A model and what is made of it once.
struct Subject {
    name: &'static str,
    soup: Soup,
    simplified: Soup,
    reference: Reference,
    surface: Surface,
    side: f64,
    symmetric: bool,
}

/// `alignment.json`.
#[derive(Serialize)]
struct Report {
    seed: u64,
    trials: u64,
    rows: Vec<Row>,
}

/// One kind on one model.
#[derive(Serialize)]
struct Row {
    model: &'static str,
    kind: &'static str,
    trials: usize,
    right: usize,
    trusted: usize,
    right_untrusted: usize,
    wrong_trusted: usize,
    median_cpu_seconds: f64,
    median_wall_seconds: f64,
    median_hypotheses: f64,
    /// The trials that were not both right and trusted.
    exceptions: Vec<Outcome>,
}

/// One trial.
#[derive(Debug, Clone, Serialize)]
struct Outcome {
    trial: u64,
    /// Largest error of a vertex, in largest sides, of the best returned pose in this respect.
    error: f64,
    /// Place of that pose among those returned.
    place: usize,
    /// Largest distance of a vertex from the original's surface under the first pose, in largest sides.
    surface: f64,
    hypotheses: usize,
    right: bool,
    trusted: bool,
    /// With the distance in largest sides.
    #[serde(flatten)]
    fit: Fit,
    cpu_seconds: f64,
    wall_seconds: f64,
}

pub(crate) fn run(args: &Alignment, folder: &Path) -> anyhow::Result<()> {
    let wanted =
        |name: &str| args.only.is_empty() || args.only.iter().any(|part| name.contains(part.as_str()));
    let others = others();
    let mut rows = Vec::new();
    for make in subjects(folder) {
        let (name, symmetric) = (make.0, make.1);
        let kinds: Vec<_> = KINDS.iter().filter(|k| wanted(&format!("{name}/{}", k.1))).collect();
        if kinds.is_empty() {
            continue;
        }
        let subject = Subject::new(name, (make.2)()?, symmetric)?;
        for &&(kind, label, _) in &kinds {
            // Each kind has random numbers of its own, whatever else is run.
            let stream = KINDS.iter().position(|k| k.0 == kind).unwrap_or(0) as u64;
            let bar = bar(args.trials, &format!("{name}, {label}"))?;
            let trials = (0..args.trials).map(|trial| {
                let mut rng = ChaCha8Rng::seed_from_u64(SEED);
                rng.set_stream(stream << 32 | trial);
                bar.inc(1);
                subject.trial(kind, trial, &others, &mut rng)
            });
            let outcomes = trials.collect::<anyhow::Result<Vec<_>>>()?;
            bar.finish_and_clear();
            let row = Row::new(name, label, outcomes);
            row.print();
            rows.push(row);
        }
    }
    if rows.is_empty() {
        bail!("nothing is called {:?}", args.only);
    }
    let report = Report { seed: SEED, trials: args.trials, rows };
    if let Some(parent) = args.out.parent() {
        std::fs::create_dir_all(parent)?;
    }
    std::fs::write(args.out.with_extension("md"), report.markdown())?;
    let json = serde_json::to_string_pretty(&report)? + "\n";
    Ok(std::fs::write(args.out.with_extension("json"), json)?)
}

fn bar(length: u64, what: &str) -> anyhow::Result<ProgressBar> {
    let template = format!("{{elapsed}} {{bar:40}} {{pos}}/{{len}} {what}, {{eta}} left");
    Ok(ProgressBar::new(length).with_style(ProgressStyle::with_template(&template)?))
}

type Make<'a> = (&'static str, bool, Box<dyn Fn() -> anyhow::Result<Soup> + 'a>);

/// Name, whether it is symmetric, and how to get it.
fn subjects(folder: &Path) -> Vec<Make<'_>> {
    let read = |name: &'static str, file: &'static str| -> Make<'_> {
        let path = folder.join(file);
        let make = move || {
            let document =
                Document::read(&path).with_context(|| format!("{} cannot be read", path.display()))?;
            Ok(sombrero::Model::new(&document.soup()).soup().clone())
        };
        (name, false, Box::new(make))
    };
    let generated =
        |name, symmetric, soup: fn() -> Soup| -> Make<'_> { (name, symmetric, Box::new(move || Ok(soup()))) };
    vec![
        read("fandisk", "fandisk.obj"),
        read("head", "head.obj"),
        read("dragon", "dragon.obj"),
        read("bunny", "bunny.ply"),
        generated("part", false, || shapes::part(4)),
        generated("bust", false, || shapes::bust(20)),
        generated("genus 3", true, || shapes::genus(3, 4)),
        generated("pretzel", true, || shapes::genus(1, 6)),
        generated("torus", true, || shapes::torus(60, 30, 2.0, 0.7)),
        generated("cube", true, || subdivided(shapes::cube(), 4)),
        generated("octahedron", true, || subdivided(shapes::octahedron(), 4)),
        generated("tetrahedron", true, || subdivided(shapes::tetrahedron(), 5)),
    ]
}

/// Shapes that are none of the models; a generated one is not compared with itself.
fn others() -> Vec<(&'static str, Soup)> {
    vec![
        ("bumpy sphere", shapes::bumpy_sphere(8_000)),
        ("torus", shapes::torus(120, 60, 2.0, 0.7)),
        ("icosahedron", subdivided(shapes::icosahedron(), 3)),
        ("cube", subdivided(shapes::cube(), 4)),
        ("bust", shapes::bust(30)),
        ("part", shapes::part(5)),
    ]
}

/// Each triangle cut into four, `times` times.
fn subdivided(mut soup: Soup, times: usize) -> Soup {
    for _ in 0..times {
        let mut middles = std::collections::BTreeMap::new();
        let mut triangles = Vec::with_capacity(4 * soup.triangles.len());
        for &[a, b, c] in &soup.triangles {
            let mut middle = |u: u32, v: u32| {
                *middles.entry((u.min(v), u.max(v))).or_insert_with(|| {
                    soup.points.push(nalgebra::center(&soup.points[u as usize], &soup.points[v as usize]));
                    soup.points.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        soup.triangles = triangles;
    }
    soup
}

impl Subject {
    fn new(name: &'static str, soup: Soup, symmetric: bool) -> anyhow::Result<Self> {
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let simplified = apply(&Attack::Simplify { ratio: 0.5 }, &soup, &mut rng)?.soup;
        let reference = Reference::new(&soup.points, &soup.triangles)?;
        let surface = Surface::new(&soup.points, &soup.triangles);
        let side = soup.bounding_box().context("no triangles")?.largest_side();
        Ok(Self { name, soup, simplified, reference, surface, side, symmetric })
    }

    fn trial(
        &self,
        kind: Kind,
        trial: u64,
        others: &[(&str, Soup)],
        rng: &mut ChaCha8Rng,
    ) -> anyhow::Result<Outcome> {
        let damaged = self.damaged(kind, trial, others, rng)?;
        let truth = match kind {
            Kind::Affine | Kind::AffineThirdCut => {
                random_similarity(rng).to_homogeneous() * random_affine(rng)
            }
            _ => random_similarity(rng).to_homogeneous(),
        };
        let points: Vec<_> = damaged.points.iter().map(|p| truth.transform_point(p)).collect();
        let (cpu, wall) = (cpu_seconds(), Instant::now());
        let answer = self.answer(kind, &points, &damaged.triangles)?;
        let (wall_seconds, cpu_seconds) = (wall.elapsed().as_secs_f64(), cpu_seconds() - cpu);
        let errors = answer.poses.iter().map(|pose| self.error(&(pose * truth)));
        let (place, error) =
            errors.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).context("no pose was returned")?;
        let surface = self.surface_error(&(answer.poses[0] * truth));
        Ok(Outcome {
            trial,
            error,
            place,
            surface,
            hypotheses: answer.poses.len(),
            right: kind != Kind::Unrelated && (error < RIGHT || self.symmetric && surface < RIGHT),
            trusted: answer.trusted,
            fit: Fit { rms: answer.fit.rms / self.side, ..answer.fit },
            cpu_seconds,
            wall_seconds,
        })
    }

    fn damaged(
        &self,
        kind: Kind,
        trial: u64,
        others: &[(&str, Soup)],
        rng: &mut ChaCha8Rng,
    ) -> anyhow::Result<Soup> {
        Ok(match kind {
            Kind::Whole | Kind::Affine => self.soup.clone(),
            Kind::Noise => apply(&Attack::Noise { amplitude: 0.002 }, &self.soup, rng)?.soup,
            Kind::ThirdCut | Kind::AffineThirdCut => cut(&self.simplified, 1.0 / 3.0, &random_direction(rng)),
            Kind::Battered => {
                let noisy = apply(&Attack::Noise { amplitude: 0.007 }, &self.simplified, rng)?.soup;
                cut(&noisy, 1.0 / 3.0, &random_direction(rng))
            }
            Kind::HalfCut => cut(&self.soup, 0.5, &random_direction(rng)),
            Kind::BasePlate => with_base_plate(&self.soup, rng)?,
            Kind::SecondObject => with_box(&self.soup, rng)?,
            Kind::Unrelated => {
                let choices: Vec<_> = others.iter().filter(|o| o.0 != self.name).collect();
                choices[trial as usize % choices.len()].1.clone()
            }
        })
    }

    fn answer(&self, kind: Kind, points: &[Point3<f64>], triangles: &[[u32; 3]]) -> anyhow::Result<Answer> {
        let (reference, options) = (&self.reference, RegisterOptions::default());
        if matches!(kind, Kind::Affine | Kind::AffineThirdCut) {
            let found = register_affine(reference, points, triangles, &options)?;
            let AffineRegistration { best, agreement, sharpness, trusted, alternatives, .. } = found;
            let AffinePose { score, overlap, suspect_overlap, rms, .. } = best;
            let poses = std::iter::once(&best).chain(&alternatives);
            let poses = poses.map(|pose| pose.reference_from_suspect.to_homogeneous()).collect();
            let fit = Fit { score, overlap, suspect_overlap, agreement, sharpness, rms };
            return Ok(Answer { poses, trusted, fit });
        }
        let found = register(reference, points, triangles, &options)?;
        let Registration { score, overlap, suspect_overlap, agreement, sharpness, rms, .. } = found;
        let others = found.alternatives.iter().map(|pose| &pose.reference_from_suspect);
        let poses = std::iter::once(&found.reference_from_suspect).chain(others);
        let poses = poses.map(Similarity3::to_homogeneous).collect();
        let fit = Fit { score, overlap, suspect_overlap, agreement, sharpness, rms };
        Ok(Answer { poses, trusted: found.trusted, fit })
    }

    /// Largest distance of a vertex from its place, in largest sides.
    fn error(&self, rest: &Matrix4<f64>) -> f64 {
        let distance = |p: &Point3<f64>| (rest.transform_point(p) - p).norm();
        self.soup.points.iter().map(distance).fold(0.0, f64::max) / self.side
    }

    /// Largest distance of a vertex from the surface, in largest sides.
    fn surface_error(&self, rest: &Matrix4<f64>) -> f64 {
        let there: Vec<_> = self.soup.points.iter().map(|p| rest.transform_point(p)).collect();
        let closest = self.surface.closest_many(&there);
        closest.iter().map(|c| c.map_or(f64::INFINITY, |c| c.distance())).fold(0.0, f64::max) / self.side
    }
}

/// What the search says.
struct Answer {
    poses: Vec<Matrix4<f64>>,
    trusted: bool,
    fit: Fit,
}

/// How well the pose fits, as registration tells it.
#[derive(Debug, Clone, Copy, Serialize)]
struct Fit {
    score: f64,
    overlap: f64,
    suspect_overlap: f64,
    agreement: f64,
    sharpness: f64,
    rms: f64,
}

fn random_direction(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    loop {
        let v = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        if (1e-3..=1.0).contains(&v.norm_squared()) {
            return v.normalize();
        }
    }
}

fn random_rotation(rng: &mut ChaCha8Rng) -> UnitQuaternion<f64> {
    loop {
        let q: [f64; 4] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
        let q = nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]);
        if (1e-3..=1.0).contains(&q.norm_squared()) {
            return UnitQuaternion::from_quaternion(q);
        }
    }
}

/// Any rotation, scales from 0.1 to 10, shifts up to 100.
fn random_similarity(rng: &mut ChaCha8Rng) -> Similarity3<f64> {
    let shift = Vector3::from_fn(|_, _| rng.random_range(-100.0..100.0));
    let scale = 10f64.powf(rng.random_range(-1.0..1.0));
    Similarity3::from_parts(Translation3::from(shift), random_rotation(rng), scale)
}

/// R diag(1, a, c) Rᵀ with 1 ≤ a ≤ c ≤ 1.5.
fn random_affine(rng: &mut ChaCha8Rng) -> Matrix4<f64> {
    let largest = rng.random_range(1.0..1.5);
    let stretch = Vector3::new(1.0, rng.random_range(1.0..=largest), largest);
    let axes: Rotation3<f64> = random_rotation(rng).to_rotation_matrix();
    let linear: Matrix3<f64> = axes.matrix() * Matrix3::from_diagonal(&stretch) * axes.matrix().transpose();
    linear.to_homogeneous()
}

/// Without the triangles beyond the plane that cuts away `share` of the area.
fn cut(soup: &Soup, share: f64, direction: &Vector3<f64>) -> Soup {
    let height = |t: &[u32; 3]| {
        t.iter().map(|&v| soup.points[v as usize].coords.dot(direction)).fold(f64::MIN, f64::max)
    };
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| soup.points[v as usize]);
        (b - a).cross(&(c - a)).norm()
    };
    let mut triangles: Vec<_> = soup.triangles.iter().map(|t| (height(t), *t)).collect();
    triangles.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = (1.0 - share) * soup.triangles.iter().map(area).sum::<f64>();
    triangles.retain(|(_, t)| {
        left -= area(t);
        left >= 0.0
    });
    Soup::new(soup.points.clone(), triangles.into_iter().map(|(_, t)| t).collect())
}

/// Both surfaces as one.
fn joined(soup: &Soup, other: Soup) -> Soup {
    let first = soup.points.len() as u32;
    let mut both = soup.clone();
    both.points.extend(other.points);
    both.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    both
}

fn boxed(centre: &Point3<f64>, half: &Vector3<f64>) -> Soup {
    let mut cube = subdivided(shapes::cube(), 3);
    cube.points.iter_mut().for_each(|p| *p = centre + p.coords.component_mul(half));
    cube
}

fn with_base_plate(soup: &Soup, rng: &mut ChaCha8Rng) -> anyhow::Result<Soup> {
    let bounds = soup.bounding_box().context("no triangles")?;
    let axis = rng.random_range(0..3usize);
    let mut half = bounds.sides() * 0.65;
    let mut centre = nalgebra::center(&bounds.min, &bounds.max);
    half[axis] = 0.05 * bounds.sides()[axis];
    centre[axis] = bounds.min[axis] - 0.8 * half[axis];
    Ok(joined(soup, boxed(&centre, &half)))
}

fn with_box(soup: &Soup, rng: &mut ChaCha8Rng) -> anyhow::Result<Soup> {
    let bounds = soup.bounding_box().context("no triangles")?;
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| soup.points[v as usize]);
        (b - a).cross(&(c - a)).norm() / 2.0
    };
    let mut half = Vector3::new(1.0, 1.5, 2.2);
    let surface = 8.0 * (half.x * half.y + half.y * half.z + half.z * half.x);
    half *= (soup.triangles.iter().map(area).sum::<f64>() / surface).sqrt();
    let distance = bounds.sides().norm() / 2.0 + 1.05 * half.norm();
    let centre = nalgebra::center(&bounds.min, &bounds.max) + random_direction(rng) * distance;
    let turn = random_rotation(rng);
    let mut other = boxed(&Point3::origin(), &half);
    other.points.iter_mut().for_each(|p| *p = centre + turn * p.coords);
    Ok(joined(soup, other))
}

/// Processor time of this process so far, all threads; 0 where the system does not tell.
fn cpu_seconds() -> f64 {
    const TICKS_PER_SECOND: f64 = 100.0;
    let told = || {
        let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
        // The name in brackets may hold spaces; user and system time are the 12th and 13th after it.
        let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
        let ticks: f64 = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
        Some(ticks / TICKS_PER_SECOND)
    };
    told().unwrap_or(0.0)
}

impl Row {
    fn new(model: &'static str, kind: &'static str, outcomes: Vec<Outcome>) -> Self {
        let count = |keep: &dyn Fn(&Outcome) -> bool| outcomes.iter().filter(|o| keep(o)).count();
        let middle = |value: &dyn Fn(&Outcome) -> f64| {
            median(&outcomes.iter().map(value).collect::<Vec<_>>()).unwrap_or(0.0)
        };
        Self {
            model,
            kind,
            trials: outcomes.len(),
            right: count(&|o| o.right),
            trusted: count(&|o| o.trusted),
            right_untrusted: count(&|o| o.right && !o.trusted),
            wrong_trusted: count(&|o| !o.right && o.trusted),
            median_cpu_seconds: middle(&|o| o.cpu_seconds),
            median_wall_seconds: middle(&|o| o.wall_seconds),
            median_hypotheses: middle(&|o| o.hypotheses as f64),
            exceptions: outcomes.into_iter().filter(|o| !(o.right && o.trusted)).collect(),
        }
    }

    fn print(&self) {
        let Self { model, kind, trials, right, trusted, right_untrusted, wrong_trusted, .. } = self;
        println!(
            "{model:12} {kind:18} right {right}/{trials}, trusted {trusted}, right but untrusted \
             {right_untrusted}, wrong but trusted {wrong_trusted}, {:.2} s CPU, {:.2} s, {} poses",
            self.median_cpu_seconds, self.median_wall_seconds, self.median_hypotheses
        );
    }
}

impl Report {
    fn markdown(&self) -> String {
        let mut text = String::from(
            "# Alignment without a hint\n\n\
             Written by `cargo xtask alignment`. Right: no vertex of the original farther from its place than 1 % \
             of the largest side under one of the returned poses, or, for symmetric shapes, the first one puts the \
             shape onto itself. Seconds are medians of processor time, all threads, and of the clock.\n\n\
             | kind | what is done before the model is moved by a random similarity, scale 0.1 to 10 |\n|---|---|\n",
        );
        for (_, label, what) in KINDS {
            let _ = writeln!(text, "| {label} | {what} |");
        }
        text += "\n| model | kind | right | trusted | right, untrusted | wrong, trusted | poses | CPU s | s |\n\
                 |---|---|---|---|---|---|---|---|---|\n";
        for row in &self.rows {
            let Row { model, kind, trials, right, trusted, right_untrusted, wrong_trusted, .. } = row;
            let right = if *kind == "unrelated" { "–".into() } else { format!("{right} of {trials}") };
            let _ = writeln!(
                text,
                "| {model} | {kind} | {right} | {trusted} | {right_untrusted} | {wrong_trusted} | {} | {:.2} | {:.2} |",
                row.median_hypotheses, row.median_cpu_seconds, row.median_wall_seconds
            );
        }
        text
    }
}
