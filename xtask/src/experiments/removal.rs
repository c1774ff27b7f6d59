//! `cargo xtask removal`: what it costs to take a mark out without the original. Each attack is scaled to move vertices by
//! one, two and four times the mark's own root mean square; what is then left of the mark stands beside what is seen of the
//! attack (MSDM2 and normals, against the marked copy: the attacker has nothing else).

use super::case::{Case, Marked, read};
use super::plot::{self, Axis, Panel, Series};
use super::tables::paper::MODELS;
use anyhow::{Context, bail};
use nalgebra::{Point3, Rotation3, Vector3};
use plotters::chart::SeriesLabelPosition;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::mesh::{BoundingBox, Soup};
use sombrero::spatial::sample_ball;
use sombrero::stats::median;
use sombrero::watermark::Preset;
use sombrero::{DetectOptions, Suspect};
use sombrero_fidelity::Fidelity;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What to attack, and how often.
#[derive(clap::Args)]
pub(crate) struct Removal {
    /// Secrets for each model and preset.
    #[arg(long, default_value_t = 1)]
    runs: u64,
    /// Models, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "fandisk,head")]
    only: Vec<String>,
    /// Presets, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "faithful,robust")]
    presets: Vec<String>,
    /// Attacks whose names contain one of these, separated by commas. Default: all.
    #[arg(long, value_delimiter = ',')]
    rows: Vec<String>,
    /// Where `removal.md`, `removal.json` and `removal.svg` are written.
    #[arg(long, default_value = "docs/removal")]
    out: PathBuf,
}

/// How far vertices are moved, in root mean squares of the mark.
const STRENGTHS: [f64; 3] = [1.0, 2.0, 4.0];
/// Plane waves in a field.
const WAVES: usize = 24;
/// Pieces that are moved on their own, and how far their borders reach, in sides.
const PIECES: usize = 12;
const BORDER: f64 = 0.12;

/// How positions are moved; lengths in largest sides.
#[derive(Clone, Copy)]
enum Move {
    /// Each vertex by itself, along its normal.
    Noise,
    /// Along the normals by waves of this length.
    Bumps(f64),
    /// In all directions by waves of this length.
    Warp(f64),
    /// Along the surface by waves of this length.
    Slide(f64),
    /// Pieces turned, stretched and shifted a little, each by itself.
    Pieces,
    /// What lies beyond two thirds of the longest side turned about a line.
    Limb,
    /// Further marks.
    Marks(Preset, usize),
}

/// Moves, each with its part of the strength, and attacks on what comes of them.
struct Attack {
    family: &'static str,
    name: &'static str,
    moves: &'static [(Move, f64)],
    then: &'static str,
}

const fn attack(
    family: &'static str,
    name: &'static str,
    moves: &'static [(Move, f64)],
    then: &'static str,
) -> Attack {
    Attack { family, name, moves, then }
}

static ATTACKS: [Attack; 17] = [
    attack("noise", "noise", &[(Move::Noise, 1.0)], ""),
    attack("bumps", "bumps, 0.03 sides", &[(Move::Bumps(0.03), 1.0)], ""),
    attack("bumps", "bumps, 0.06 sides", &[(Move::Bumps(0.06), 1.0)], ""),
    attack("bumps", "bumps, 0.12 sides", &[(Move::Bumps(0.12), 1.0)], ""),
    attack("warps", "warp, 0.15 sides", &[(Move::Warp(0.15), 1.0)], ""),
    attack("warps", "warp, 0.3 sides", &[(Move::Warp(0.3), 1.0)], ""),
    attack("warps", "warp, 0.6 sides", &[(Move::Warp(0.6), 1.0)], ""),
    attack("warps", "warp, 0.3 sides, half the faces", &[(Move::Warp(0.3), 1.0)], "simplify:ratio=0.5"),
    attack("pieces", "affine and turned pieces", &[(Move::Pieces, 1.0)], ""),
    attack("pieces", "a limb turned", &[(Move::Limb, 1.0)], ""),
    attack("slides", "slides, 0.15 sides", &[(Move::Slide(0.15), 1.0)], ""),
    attack("marks", "one more mark, faithful", &[(Move::Marks(Preset::Faithful, 1), 1.0)], ""),
    attack("marks", "one more mark, robust", &[(Move::Marks(Preset::Robust, 1), 1.0)], ""),
    attack("marks", "one more mark, paper", &[(Move::Marks(Preset::Paper, 1), 1.0)], ""),
    attack("marks", "four more marks, robust", &[(Move::Marks(Preset::Robust, 4), 1.0)], ""),
    attack("marks", "eight more marks, robust", &[(Move::Marks(Preset::Robust, 8), 1.0)], ""),
    attack(
        "chain",
        "warp 0.3, bumps 0.06, 40 % of the faces, 10 bits",
        &[(Move::Warp(0.3), 1.0), (Move::Bumps(0.06), 1.0)],
        "simplify:ratio=0.4 quantize:bits=10",
    ),
];

/// One attack of one strength, medians over secrets.
#[derive(Serialize)]
struct Line {
    model: String,
    preset: &'static str,
    family: &'static str,
    attack: &'static str,
    /// Root mean squares of the mark.
    strength: f64,
    log10_p: f64,
    /// Against the marked copy, before faces are taken away.
    msdm2: f64,
    normals_rms: f64,
}

pub(crate) fn run(args: &Removal, folder: &Path) -> anyhow::Result<()> {
    if args.runs == 0 {
        bail!("a table needs at least one secret");
    }
    let asked =
        |name: &str| args.rows.is_empty() || args.rows.iter().any(|part| name.contains(part.as_str()));
    let named = |name: &String| Preset::ALL.into_iter().find(|preset| preset.name() == name);
    let presets: Vec<Preset> = args.presets.iter().filter_map(named).collect();
    std::fs::create_dir_all(&args.out)?;
    let mut lines: Vec<Line> = Vec::new();
    for model in MODELS.iter().filter(|model| args.only.iter().any(|only| only == model.name)) {
        for &preset in &presets {
            let document = read(folder, model.file)?;
            let marked = Case::new(document, preset.parameters())?.marked_by_seeds(args.runs)?;
            let rows: Vec<(&Attack, f64)> = ATTACKS
                .iter()
                .filter(|attack| asked(attack.name))
                .flat_map(|attack| STRENGTHS.map(|strength| (attack, strength)))
                .collect();
            let made = rows.into_par_iter().map(|(attack, strength)| {
                let line = line(model.name, preset.name(), &marked, attack, strength)?;
                println!("{}", row(&line));
                Ok(line)
            });
            lines.extend(made.collect::<anyhow::Result<Vec<Line>>>()?);
        }
    }
    if lines.is_empty() {
        bail!("nothing is called so");
    }
    let panels: Vec<Panel> = presets.iter().map(|preset| panel(*preset, &lines)).collect();
    plot::write(&args.out.join("removal.svg"), (560 * panels.len() as u32, 520), &panels)?;
    std::fs::write(args.out.join("removal.md"), markdown(args.runs, &lines))?;
    Ok(std::fs::write(args.out.join("removal.json"), serde_json::to_string_pretty(&lines)? + "\n")?)
}

fn line(
    model: &str,
    preset: &'static str,
    marked: &[Marked],
    attack: &Attack,
    strength: f64,
) -> anyhow::Result<Line> {
    let mut tried = Vec::new();
    for (seed, marked) in (0..).zip(marked) {
        tried.push(tried_once(marked, attack, strength, seed)?);
    }
    let middle =
        |which: usize| median(&tried.iter().map(|t| t[which]).collect::<Vec<_>>()).context("some figures");
    Ok(Line {
        model: model.into(),
        preset,
        family: attack.family,
        attack: attack.name,
        strength,
        log10_p: middle(0)?,
        msdm2: middle(1)?,
        normals_rms: middle(2)?,
    })
}

/// log10 p, MSDM2 and degrees of one mark.
fn tried_once(marked: &Marked, attack: &Attack, strength: f64, seed: u64) -> anyhow::Result<[f64; 3]> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (copy, side) = (&marked.copy, marked.detector.model().largest_side());
    let own = marked.distortion().rms * side;
    let mut moved = copy.clone();
    for (how, part) in attack.moves {
        let field = how.field(&moved, side, &mut rng)?;
        moved = scaled(&moved, &field, strength * part * own);
    }
    let seen = Fidelity::between(&copy.points, &moved.points, &copy.triangles, None);
    let attacked = apply_all(&parse_list(attack.then)?, &moved, &mut rng)?;
    let same = attacked.soup.triangles == copy.triangles;
    let correspondence = same.then(|| attacked.correspondence(copy.points.len()));
    let suspect = Suspect { soup: attacked.soup, correspondence, cloud: false };
    let found = marked.detector.detect(&suspect, &DetectOptions::default());
    Ok([found.map_or(0.0, |detection| detection.log10_p), seen.msdm2, seen.normals_rms])
}

/// A copy bent by waves of this length that move its vertices by `rms`, both in largest sides.
pub(super) fn warped(soup: &Soup, length: f64, rms: f64, rng: &mut ChaCha8Rng) -> Soup {
    let side = BoundingBox::of(&soup.points).map_or(0.0, |around| around.largest_side());
    scaled(soup, &waves(&soup.points, length * side, rng), rms * side)
}

/// The points moved along the field, by `rms` of the vertices with a face.
fn scaled(soup: &Soup, field: &[Vector3<f64>], rms: f64) -> Soup {
    let used = soup.used();
    let squares: Vec<f64> =
        field.iter().zip(&used).filter(|(_, used)| **used).map(|(d, _)| d.norm_squared()).collect();
    let own = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
    let factor = if own > 0.0 { rms / own } else { 0.0 };
    let points = soup.points.iter().zip(field).map(|(p, d)| p + d * factor).collect();
    Soup::new(points, soup.triangles.clone())
}

impl Move {
    /// Where each vertex goes, in any unit.
    fn field(self, soup: &Soup, side: f64, rng: &mut ChaCha8Rng) -> anyhow::Result<Vec<Vector3<f64>>> {
        let points = &soup.points;
        Ok(match self {
            Self::Noise => {
                let heights: Vec<f64> = points.iter().map(|_| rng.random_range(-1.0..1.0)).collect();
                soup.vertex_normals().iter().zip(heights).map(|(n, h)| n * h).collect()
            }
            Self::Bumps(length) => {
                let waves = waves(points, length * side, rng);
                soup.vertex_normals().iter().zip(waves).map(|(n, w)| n * w.x).collect()
            }
            Self::Warp(length) => waves(points, length * side, rng),
            Self::Slide(length) => {
                let waves = waves(points, length * side, rng);
                soup.vertex_normals().iter().zip(waves).map(|(n, w)| w - n * n.dot(&w)).collect()
            }
            Self::Pieces => pieces(points, side, rng),
            Self::Limb => limb(points, side, rng),
            Self::Marks(preset, count) => {
                let spec = format!("watermark:preset={}", preset.name());
                let attacked = apply_all(&parse_list(&vec![spec; count].join(" "))?, soup, rng)?;
                let found = attacked.correspondence(points.len());
                found.iter().zip(points).map(|(q, p)| q.map_or(Vector3::zeros(), |q| q - p)).collect()
            }
        })
    }
}

fn direction(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    sample_ball(rng).try_normalize(0.0).unwrap_or_else(Vector3::x)
}

/// A sum of plane waves of one length, each with its own direction, phase and displacement:
///
/// ```text
/// d(p) = Σ_k a_k sin(2π u_k · p / λ + φ_k)
/// ```
fn waves(points: &[Point3<f64>], length: f64, rng: &mut ChaCha8Rng) -> Vec<Vector3<f64>> {
    let waves: Vec<_> = (0..WAVES)
        .map(|_| (direction(rng) * (TAU / length), direction(rng), rng.random_range(0.0..TAU)))
        .collect();
    let at = |p: &Point3<f64>| -> Vector3<f64> {
        waves.iter().map(|(k, a, phase)| a * (k.dot(&p.coords) + phase).sin()).sum()
    };
    points.iter().map(at).collect()
}

/// About random vertices: each piece is turned, stretched and shifted by itself, and they blend where they meet.
fn pieces(points: &[Point3<f64>], side: f64, rng: &mut ChaCha8Rng) -> Vec<Vector3<f64>> {
    let piece = |_| {
        let centre = points[rng.random_range(0..points.len())];
        let linear = nalgebra::Matrix3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        (centre, linear, direction(rng) * (0.3 * side))
    };
    let pieces: Vec<_> = (0..PIECES).map(piece).collect();
    let at = |p: &Point3<f64>| {
        let (mut sum, mut total) = (Vector3::zeros(), 1e-300);
        for (centre, linear, shift) in &pieces {
            let from = p - centre;
            let weight = (-from.norm_squared() / (2.0 * (BORDER * side).powi(2))).exp();
            sum += (linear * from + shift) * weight;
            total += weight;
        }
        sum / total
    };
    points.iter().map(at).collect()
}

/// A smooth hinge: beyond two thirds of the longest axis points turn about a line across it.
fn limb(points: &[Point3<f64>], side: f64, rng: &mut ChaCha8Rng) -> Vec<Vector3<f64>> {
    let Some(around) = BoundingBox::of(points) else { return Vec::new() };
    let axis = around.sides().imax();
    let joint = around.min[axis] + around.sides()[axis] * 2.0 / 3.0;
    let mut across = direction(rng);
    across[axis] = 0.0;
    let across = nalgebra::Unit::try_new(across, 1e-6).unwrap_or(Vector3::ith_axis((axis + 1) % 3));
    let mut pivot = nalgebra::center(&around.min, &around.max);
    pivot[axis] = joint;
    let turn = Rotation3::from_axis_angle(&across, 0.05);
    let at = |p: &Point3<f64>| {
        let reach = ((p[axis] - joint) / (0.1 * side)).clamp(0.0, 1.0);
        let share = reach * reach * (3.0 - 2.0 * reach);
        (turn * (p - pivot) - (p - pivot)) * share
    };
    points.iter().map(at).collect()
}

fn row(line: &Line) -> String {
    let Line { model, preset, attack, strength, log10_p, msdm2, normals_rms, .. } = line;
    format!("| {model} | {preset} | {attack} | {strength} | {log10_p:.1} | {msdm2:.3} | {normals_rms:.2} |")
}

/// Of each family what leaves least of the mark at each strength, over what is seen of it.
fn panel(preset: Preset, lines: &[Line]) -> Panel {
    const LEAST: f64 = -100.0;
    let mut families: Vec<&'static str> = Vec::new();
    for attack in &ATTACKS {
        if !families.contains(&attack.family) {
            families.push(attack.family);
        }
    }
    let series = families.into_iter().map(|family| {
        let cheapest = |strength: f64| {
            let own = |l: &&Line| l.preset == preset.name() && l.family == family && l.strength == strength;
            lines.iter().filter(own).max_by(|a, b| a.log10_p.total_cmp(&b.log10_p))
        };
        let mut points: Vec<(f64, f64)> = STRENGTHS
            .into_iter()
            .filter_map(cheapest)
            .map(|line| (line.msdm2.min(0.8), line.log10_p.max(LEAST)))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Series { name: family.into(), points, intervals: Vec::new(), dots: true }
    });
    Panel {
        caption: preset.name(),
        x: Axis { label: "MSDM2 of the attack", range: 0.0..0.8, powers: false, ticks: 9 },
        y: Axis { label: "log10 p that is left, at worst", range: LEAST..0.0, powers: false, ticks: 11 },
        series: series.collect(),
        diagonal: false,
        legend: Some(SeriesLabelPosition::LowerRight),
    }
}

fn markdown(runs: u64, lines: &[Line]) -> String {
    let mut text = format!(
        "# What removal costs\n\nWritten by `cargo xtask removal`; {runs} secret(s) for each model and preset, medians. An \
         attacker without the original moves vertices by so many root mean squares of the mark; MSDM2 and degrees (root mean \
         square) say what is seen of that, against the marked copy and before faces are taken away. In chains each move has \
         the whole strength. Plot: `removal.svg`, of each family what leaves least.\n\n\
         | model | preset | attack | times the mark | log10 p | MSDM2 | normals, degrees |\n|---|---|---|---:|---:|---:|---:|\n"
    );
    lines.iter().for_each(|line| {
        let _ = writeln!(text, "{}", row(line));
    });
    text
}
