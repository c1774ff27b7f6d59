//! Suspects: what is done to an original, class by class.

use super::families::{MEMBERS, original};
use anyhow::Context;
use nalgebra::{Similarity3, Translation3, UnitQuaternion};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::{Simplification, apply_all, mirror, parse_list};
use sombrero::mesh::{Soup, connected, weld_and_repair};
use sombrero::spatial::sample_ball;
use sombrero_tests::joined;

/// What is asked about, and how it came to be.
pub(crate) struct Suspect {
    pub(crate) soup: Soup,
    /// What was made of the original alone, in the original's place; `None` where its parts were moved apart.
    pub(crate) own: Option<Soup>,
    /// Whether `own` is a mirror image of what was made of it.
    pub(crate) mirrored: bool,
    /// From the original's place to where it is in the suspect.
    pub(crate) pose: Similarity3<f64>,
}

/// A class of suspects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Class {
    Simplified,
    CutAndHalved,
    CropNoiseEighth,
    Isosurface,
    Remeshed,
    FreeForm,
    Scene,
    HalfKit,
    Mirrored,
}

impl Class {
    pub(crate) const ALL: [Self; 9] = [
        Self::Simplified,
        Self::CutAndHalved,
        Self::CropNoiseEighth,
        Self::Isosurface,
        Self::Remeshed,
        Self::FreeForm,
        Self::Scene,
        Self::HalfKit,
        Self::Mirrored,
    ];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Simplified => "simplified to 1/20",
            Self::CutAndHalved => "a third cut off by a random plane, halved",
            Self::CropNoiseEighth => "a third cut off, noise 0.3 %, 1/8",
            Self::Isosurface => "isosurface, 64 cells",
            Self::Remeshed => "remeshed",
            Self::FreeForm => "free form 2 %",
            Self::Scene => "one among five in a scene",
            Self::HalfKit => "half of a kit, parts moved",
            Self::Mirrored => "mirrored, halved",
        }
    }

    /// The suspect made of `soup`, in any pose and at any size; what is among it comes from originals that no catalogue holds.
    pub(crate) fn suspect(self, soup: &Soup, seed: u64) -> anyhow::Result<Suspect> {
        self.made(soup, seed).with_context(|| self.name())
    }

    fn made(self, soup: &Soup, seed: u64) -> anyhow::Result<Suspect> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let rng = &mut rng;
        let own = match self {
            Self::Simplified => simplified(soup, 0.05, rng)?,
            Self::CutAndHalved => simplified(&cut(soup, 1.0 / 3.0, rng), 0.5, rng)?,
            Self::CropNoiseEighth => {
                let noisy = attacked(&cut(soup, 1.0 / 3.0, rng), "noise:amplitude=0.003", rng)?;
                simplified(&noisy, 0.125, rng)?
            }
            Self::Isosurface => attacked(soup, "isosurface:resolution=64", rng)?,
            Self::Remeshed => attacked(soup, "remesh:length=1.5,iterations=3", rng)?,
            Self::FreeForm => attacked(soup, "ffd:strength=0.02,lattice=4", rng)?,
            Self::Mirrored => mirror(&simplified(soup, 0.5, rng)?),
            Self::Scene => {
                let (made, within) = scene(soup, seed, rng);
                let pose = any_pose(rng);
                return Ok(Suspect {
                    soup: moved(&made, &pose),
                    own: Some(soup.clone()),
                    mirrored: false,
                    pose: pose * within,
                });
            }
            Self::HalfKit => {
                let pose = any_pose(rng);
                return Ok(Suspect {
                    soup: moved(&half(soup, rng), &pose),
                    own: None,
                    mirrored: false,
                    pose,
                });
            }
        };
        let (pose, mirrored) = (any_pose(rng), self == Self::Mirrored);
        Ok(Suspect { soup: moved(&own, &pose), own: Some(own), mirrored, pose })
    }
}

fn attacked(soup: &Soup, specs: &str, rng: &mut ChaCha8Rng) -> anyhow::Result<Soup> {
    Ok(apply_all(&parse_list(specs)?, soup, rng)?.soup)
}

fn simplified(soup: &Soup, ratio: f64, rng: &mut ChaCha8Rng) -> anyhow::Result<Soup> {
    Ok(apply_all(&[Simplification { ratio }.into()], soup, rng)?.soup)
}

fn any_pose(rng: &mut impl Rng) -> Similarity3<f64> {
    let shift = sample_ball(rng) * 9.0;
    let turn = UnitQuaternion::new(sample_ball(rng).normalize() * rng.random_range(0.0..3.0));
    let scale = 10f64.powf(rng.random_range(-1.0..2.0));
    Similarity3::from_parts(Translation3::from(shift), turn, scale)
}

pub(crate) fn moved(soup: &Soup, pose: &Similarity3<f64>) -> Soup {
    Soup::new(soup.points.iter().map(|p| pose * p).collect(), soup.triangles.clone())
}

/// Without the triangles of the given share of the surface's area that lie farthest in a random direction.
fn cut(soup: &Soup, share: f64, rng: &mut impl Rng) -> Soup {
    let away = sample_ball(rng);
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| soup.points[v as usize]);
        (b - a).cross(&(c - a)).norm()
    };
    let far = |t: &[u32; 3]| t.iter().map(|&v| away.dot(&soup.points[v as usize].coords)).sum::<f64>();
    let mut sorted: Vec<(f64, [u32; 3])> = soup.triangles.iter().map(|t| (far(t), *t)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = (1.0 - share) * soup.triangles.iter().map(area).sum::<f64>();
    let within = sorted.into_iter().map(|s| s.1).take_while(|t| {
        left -= area(t);
        left >= 0.0
    });
    Soup::new(soup.points.clone(), within.collect()).compacted().0
}

/// Beside four other objects, each about as large; and from the original's place to where it is among them.
fn scene(soup: &Soup, seed: u64, rng: &mut impl Rng) -> (Soup, Similarity3<f64>) {
    let (mut all, mut within) = (Soup::new(Vec::new(), Vec::new()), Similarity3::identity());
    let place = rng.random_range(0..5u64);
    for k in 0..5u64 {
        // Families far beyond those of any catalogue here.
        let object = if k == place { soup.clone() } else { original((1 << 30) + (seed * 5 + k) * MEMBERS) };
        let pose = any_pose(rng);
        let Some(bounds) = moved(&object, &pose).bounding_box() else { continue };
        let size = rng.random_range(0.7..1.4) / bounds.diagonal();
        let shift =
            Translation3::new(1.6 * k as f64, 0.0, 0.0) * Translation3::from(-bounds.min.coords * size);
        let pose = shift * Similarity3::from_scaling(size) * pose;
        if k == place {
            within = pose;
        }
        all = joined(&all, &moved(&object, &pose));
    }
    (all, within)
}

/// Every second part, each moved and turned by itself.
fn half(soup: &Soup, rng: &mut impl Rng) -> Soup {
    let made = weld_and_repair(soup);
    let points = made.1.points;
    let triangles = made.1.mesh.triangles();
    let of = connected(points.len(), triangles.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]]]));
    let mut parts: Vec<u32> = triangles.iter().map(|t| of[t[0] as usize]).collect();
    parts.sort_unstable();
    parts.dedup();
    let mut all = Soup::new(Vec::new(), Vec::new());
    for part in parts.iter().step_by(2) {
        let own = triangles.iter().filter(|t| of[t[0] as usize] == *part).copied().collect();
        let own = Soup::new(points.clone(), own).compacted().0;
        let turn = UnitQuaternion::new(sample_ball(rng).normalize() * rng.random_range(0.0..3.0));
        let shift = Translation3::from(sample_ball(rng).normalize() * 12.0);
        all = joined(&all, &moved(&own, &Similarity3::from_parts(shift, turn, 1.0)));
    }
    all
}
