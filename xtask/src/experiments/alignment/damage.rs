//! What is done to a model before it is moved.

use super::moves::{random_direction, random_rotation};
use super::shapes::subdivided;
use super::trial::Subject;
use anyhow::Context;
use nalgebra::{Point3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::{Noise, Operation};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero_tests::joined;

/// What is done to a model before it is moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
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

pub(super) const KINDS: [(Kind, &str, &str); 10] = [
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

impl Kind {
    /// The model after what this kind does to it.
    pub(super) fn damaged(
        self,
        subject: &Subject,
        trial: u64,
        others: &[(&str, Soup)],
        rng: &mut ChaCha8Rng,
    ) -> anyhow::Result<Soup> {
        Ok(match self {
            Self::Whole | Self::Affine => subject.soup.clone(),
            Self::Noise => Noise { amplitude: 0.002 }.apply(&subject.soup, rng)?.soup,
            Self::ThirdCut | Self::AffineThirdCut => {
                cut(&subject.simplified, 1.0 / 3.0, &random_direction(rng))
            }
            Self::Battered => {
                let noisy = Noise { amplitude: 0.007 }.apply(&subject.simplified, rng)?.soup;
                cut(&noisy, 1.0 / 3.0, &random_direction(rng))
            }
            Self::HalfCut => cut(&subject.soup, 0.5, &random_direction(rng)),
            Self::BasePlate => with_base_plate(&subject.soup, rng)?,
            Self::SecondObject => with_box(&subject.soup, rng)?,
            Self::Unrelated => {
                let choices: Vec<_> = others.iter().filter(|o| o.0 != subject.name).collect();
                choices[trial as usize % choices.len()].1.clone()
            }
        })
    }
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
    Ok(joined(soup, &boxed(&centre, &half)))
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
    Ok(joined(soup, &other))
}
