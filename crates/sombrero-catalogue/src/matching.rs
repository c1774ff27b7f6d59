//! Whether the landmarks that look alike also lie alike: pairs of them give a pose, and the pose is counted.

use nalgebra::{Matrix3, Point3, Rotation3, Similarity3, Translation3, UnitQuaternion, Vector3};
use sombrero_landmarks::RUNG;
use sombrero_registration::similarity_of_pairs;

use crate::describe::Described;
use crate::features::{apart, telling};
use crate::portrait::Likeness;
use crate::question::MORE;

/// Squared distance of looks up to which two landmarks may be one.
const ALIKE: u32 = 800;
/// Matches that a landmark of the suspect has at most, and all together.
const MATCHES: usize = 3;
const MOST: usize = 160;
/// Matches from which pairs are made, and partners of each.
const SEEDS: usize = 8;
const PARTNERS: usize = 6;
/// How far a landmark may lie from its place, relative to the root of the suspect's area.
const NEAR: f64 = 0.05;
/// How much cosines may differ.
const TURNED: f64 = 0.3;
/// Ratio by which a match's rung and the pose's scale may differ.
const STRETCHED: f64 = 1.3;

/// How a likeness fits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit {
    /// Share of the suspect's landmarks that have a partner where they ought to, weighed by how much they look alike.
    pub(crate) score: f64,
    /// From the likeness to the suspect, in their units; applied after x was negated when `mirrored`.
    pub(crate) pose: Similarity3<f64>,
    pub(crate) mirrored: bool,
}

/// Two landmarks that look alike: q of the suspect, p of the likeness.
#[derive(Debug, Clone, Copy)]
struct Match {
    /// The suspect's landmark.
    index: usize,
    q: Point3<f64>,
    m: Vector3<f64>,
    p: Point3<f64>,
    n: Vector3<f64>,
    scale: f64,
    weight: f64,
}

/// A point of the likeness and its place on the suspect.
type Pair = (Point3<f64>, Point3<f64>);

/// A vector of the likeness, or of its mirror image.
pub(crate) fn flipped(v: Vector3<f64>, mirrored: bool) -> Vector3<f64> {
    if mirrored { Vector3::new(-v.x, v.y, v.z) } else { v }
}

/// The best ways to lay the likeness and its mirror image on the suspect, at about the ratio of sizes that `rung` stands for.
pub(crate) fn fits(asked: &Described, likeness: &Likeness, rung: usize) -> Vec<Fit> {
    let matches = matches(asked, likeness, rung);
    let seeds = seeds(&matches);
    let best = |mirrored: bool| {
        let mut best: Option<Fit> = None;
        for &(a, b) in &seeds {
            let Some(pose) = pose(&matches[a], &matches[b], mirrored) else { continue };
            let score = counted(&matches, asked, &pose, mirrored).0;
            if best.as_ref().is_none_or(|best| score > best.score) {
                best = Some(Fit { score, pose, mirrored });
            }
        }
        best.map(|fit| refit(&matches, asked, fit))
    };
    [false, true].into_iter().filter_map(best).collect()
}

/// Pairs of matches that agree with each other and with many others.
fn seeds(matches: &[Match]) -> Vec<(usize, usize)> {
    let agreeing = agreeing(matches);
    let degree: Vec<f64> =
        agreeing.iter().map(|with| with.iter().map(|&b| matches[b].weight).sum()).collect();
    let by_degree = |a: &usize, b: &usize| degree[*b].total_cmp(&degree[*a]).then(a.cmp(b));
    let mut order: Vec<usize> = (0..matches.len()).collect();
    order.sort_by(by_degree);
    let mut seeds = Vec::new();
    for &a in order.iter().take(SEEDS) {
        let mut partners = agreeing[a].clone();
        partners.sort_by(by_degree);
        seeds.extend(partners.into_iter().take(PARTNERS).map(|b| (a, b)));
    }
    seeds
}

fn matches(asked: &Described, likeness: &Likeness, rung: usize) -> Vec<Match> {
    let mut found = Vec::new();
    for (index, landmark) in asked.landmarks.iter().enumerate() {
        let mut alike: Vec<(u32, usize, usize)> = Vec::new();
        for (rung, looks) in landmark.looks.iter().enumerate().take(rung + 2).skip(rung.saturating_sub(1)) {
            let near =
                likeness.marks.iter().enumerate().map(|(j, mark)| (apart(looks, &mark.looks), rung, j));
            alike.extend(near.filter(|near| near.0 < ALIKE));
        }
        alike.sort_unstable();
        alike.truncate(MATCHES);
        found.extend(alike.into_iter().map(|(distance, rung, j)| Match {
            index,
            q: landmark.point,
            m: landmark.normal,
            p: likeness.marks[j].point(),
            n: likeness.marks[j].normal(),
            scale: RUNG.powi(rung as i32 - MORE as i32),
            weight: (1.0 - f64::from(distance) / f64::from(ALIKE))
                * f64::from(telling(&likeness.marks[j].looks)),
        }));
    }
    found.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    found.truncate(MOST);
    found
}

/// For each match those that lie to it on the suspect as they do on the likeness.
fn agreeing(matches: &[Match]) -> Vec<Vec<usize>> {
    let mut with = vec![Vec::new(); matches.len()];
    for a in 0..matches.len() {
        for b in 0..a {
            if agree(&matches[a], &matches[b]) {
                with[a].push(b);
                with[b].push(a);
            }
        }
    }
    with
}

fn agree(a: &Match, b: &Match) -> bool {
    if a.index == b.index {
        return false;
    }
    let (dq, dp) = (b.q - a.q, b.p - a.p);
    let (long, other) = (dq.norm(), dp.norm());
    let scale = (a.scale * b.scale).sqrt();
    if other * scale < 2.0 * NEAR || (long - other * scale).abs() > NEAR + 0.1 * long || long <= 0.0 {
        return false;
    }
    let close = |x: f64, y: f64| (x - y).abs() < TURNED;
    close(a.m.dot(&b.m), a.n.dot(&b.n))
        && close(a.m.dot(&dq) / long, a.n.dot(&dp) / other)
        && close(b.m.dot(&dq) / long, b.n.dot(&dp) / other)
}

/// The similarity that brings the p of two matches to their q, and the mean of their normals with them.
fn pose(a: &Match, b: &Match, mirrored: bool) -> Option<Similarity3<f64>> {
    let flip = |v| flipped(v, mirrored);
    let axes = |d: Vector3<f64>, n: Vector3<f64>| {
        let x = d.try_normalize(0.0)?;
        let z = (n - x * x.dot(&n)).try_normalize(0.1)?;
        Some(Matrix3::from_columns(&[x, z.cross(&x), z]))
    };
    let (dq, dp) = (b.q - a.q, flip(b.p - a.p));
    let rotation = axes(dq, a.m + b.m)? * axes(dp, flip(a.n + b.n))?.transpose();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    let scale = dq.norm() / dp.norm();
    let middle = (a.q.coords + b.q.coords) / 2.0;
    let shift = middle - rotation * flip(a.p.coords + b.p.coords) / 2.0 * scale;
    Some(Similarity3::from_parts(Translation3::from(shift), rotation, scale))
}

/// Which matches the pose bears out: the share of the suspect's landmarks, and the pairs.
fn counted(
    matches: &[Match],
    asked: &Described,
    pose: &Similarity3<f64>,
    mirrored: bool,
) -> (f64, Vec<Pair>) {
    let flip = |v| flipped(v, mirrored);
    let mut weights = vec![0.0f64; asked.landmarks.len()];
    let mut pairs = Vec::new();
    for found in matches {
        let ratio = pose.scaling() / found.scale;
        if ratio >= STRETCHED || ratio <= 1.0 / STRETCHED {
            continue;
        }
        let p = Point3::from(flip(found.p.coords));
        let near = (pose * p - found.q).norm() < NEAR;
        if near && (pose.isometry.rotation * flip(found.n)).dot(&found.m) > 1.0 - TURNED {
            weights[found.index] = weights[found.index].max(found.weight);
            pairs.push((p, found.q));
        }
    }
    (weights.iter().sum::<f64>() / weights.len().max(1) as f64, pairs)
}

/// The pose of all matches that bear it out, when that is borne out by more.
fn refit(matches: &[Match], asked: &Described, fit: Fit) -> Fit {
    let (_, pairs) = counted(matches, asked, &fit.pose, fit.mirrored);
    let Some(pose) = similarity_of_pairs(&pairs) else { return fit };
    let (score, _) = counted(matches, asked, &pose, fit.mirrored);
    if score > fit.score { Fit { score, pose, ..fit } } else { fit }
}
