//! Kits: bumpy balls, each stretched in its own way, in one file; each part laid elsewhere by itself, parts missing, others' parts
//! beside.

use super::owner::Owner;
use super::{Line, Suspects};
use nalgebra::{Point3, Rotation3, Vector3};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::mesh::{Soup, part, parts};
use sombrero::shapes;
use sombrero::spatial::sample_ball;
use sombrero::watermark::Preset;
use sombrero_tests::joined;

/// Parts of a kit.
const SIZES: [usize; 4] = [2, 6, 12, 24];
/// Vertices of parts of equal connectivity; of others the first has so many.
const VERTICES: usize = 642;
/// Dents and bosses of a part.
const BUMPS: usize = 40;
/// Between the middles of parts: none is wider than 40.
const APART: f64 = 50.0;

/// What lies in the suspect.
#[derive(Clone, Copy)]
enum Layout {
    Rearranged,
    /// A single part.
    One,
    /// Every other part.
    Half,
    /// Every other part and as many of another kit.
    HalfAndOthers,
    /// Every other part, each with half of its faces.
    HalfSimplified,
}

const LAYOUTS: [(&str, Layout); 5] = [
    ("all, rearranged", Layout::Rearranged),
    ("one", Layout::One),
    ("every other", Layout::Half),
    ("every other, others' parts beside", Layout::HalfAndOthers),
    ("every other, half of the faces", Layout::HalfSimplified),
];

pub(super) fn lines(args: &Suspects, preset: Preset) -> anyhow::Result<Vec<Line>> {
    let owner = Owner::new()?;
    let mut lines = Vec::new();
    for (count, alike) in SIZES.into_iter().flat_map(|count| [(count, true), (count, false)]) {
        let name = format!("{count} parts of {} connectivity", if alike { "like" } else { "different" });
        if args.asks_for(&name) {
            lines.extend(of_one(&owner, args, preset, (&name, count, alike))?);
        }
    }
    Ok(lines)
}

fn of_one(
    owner: &Owner,
    args: &Suspects,
    preset: Preset,
    (name, count, alike): (&str, usize, bool),
) -> anyhow::Result<Vec<Line>> {
    let mut lines = LAYOUTS.map(|(suspect, _)| Line::new("Kits", name, preset, suspect));
    for seed in 0..args.runs {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let [own, others] = [(); 2].map(|()| kit(count, alike, &mut rng));
        let original = owner.keep("original", &side_by_side(&own))?;
        let mark = owner.mark(&original, preset, seed)?;
        let mut marked: Vec<Soup> = parts(mark.copy.points.len(), &mark.copy.triangles)
            .iter()
            .map(|t| part(&mark.copy.points, t).0)
            .collect();
        marked.shuffle(&mut rng);
        for (line, (_, layout)) in lines.iter_mut().zip(LAYOUTS) {
            line.answers.push(mark.look(&layout.suspect(&marked, &others, &mut rng)?)?);
        }
    }
    Ok(lines.map(Line::print).into())
}

impl Layout {
    fn suspect(self, marked: &[Soup], others: &[Soup], rng: &mut ChaCha8Rng) -> anyhow::Result<Soup> {
        let half: Vec<Soup> = marked.iter().step_by(2).cloned().collect();
        let mut chosen = match self {
            Self::Rearranged => marked.to_vec(),
            Self::One => marked[..1].to_vec(),
            Self::Half => half,
            Self::HalfAndOthers => {
                let beside = others[..half.len()].to_vec();
                half.into_iter().zip(beside).flat_map(<[Soup; 2]>::from).collect()
            }
            Self::HalfSimplified => {
                let simplify = parse_list("simplify:ratio=0.5")?;
                let coarse = |soup: &Soup| Ok(apply_all(&simplify, soup, rng)?.soup);
                half.iter().map(coarse).collect::<anyhow::Result<_>>()?
            }
        };
        chosen.iter_mut().for_each(|part| turn(part, rng));
        Ok(side_by_side(&chosen))
    }
}

fn kit(count: usize, alike: bool, rng: &mut ChaCha8Rng) -> Vec<Soup> {
    (0..count).map(|at| bumpy(if alike { VERTICES } else { VERTICES + 100 * at }, rng)).collect()
}

fn bumpy(vertices: usize, rng: &mut ChaCha8Rng) -> Soup {
    let mut ball = shapes::bumpy_sphere(vertices);
    let bump = |_| (sample_ball(rng).normalize(), rng.random_range(-0.15..0.15));
    let bumps: Vec<_> = (0..BUMPS).map(bump).collect();
    let stretch = Vector3::from_fn(|_, _| rng.random_range(0.7..1.3)) * rng.random_range(8.0..14.0);
    for p in &mut ball.points {
        let near = |(at, height): &(Vector3<f64>, f64)| {
            height * (-(p.coords.normalize() - at).norm_squared() / 0.08).exp()
        };
        let relief = 1.0 + bumps.iter().map(near).sum::<f64>();
        *p = Point3::from(p.coords.component_mul(&stretch) * relief);
    }
    ball
}

fn turn(part: &mut Soup, rng: &mut ChaCha8Rng) {
    let by = Rotation3::new(sample_ball(rng) * std::f64::consts::PI);
    let centre = nalgebra::center(&part.points[0], &part.points[part.points.len() / 2]);
    part.points.iter_mut().for_each(|p| *p = by * (*p - centre.coords));
}

fn side_by_side(parts: &[Soup]) -> Soup {
    let shifted = |(at, part): (usize, &Soup)| {
        let shift = Vector3::new((at % 4) as f64, (at / 4) as f64, 0.0) * APART;
        Soup::new(part.points.iter().map(|p| p + shift).collect(), part.triangles.clone())
    };
    parts.iter().enumerate().map(shifted).fold(Soup::default(), |all, part| joined(&all, &part))
}
