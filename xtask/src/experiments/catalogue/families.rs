//! Generated originals with hard siblings: solids put together of boxes, cylinders, balls, rings and cones, or of blobs; and of each
//! some with parameters a little apart, some with a small edit, and the mirror image.

use super::nets::surface;
use nalgebra::{Matrix3, Point3, Unit, UnitQuaternion, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sombrero::mesh::Soup;
use sombrero_tests::joined;

/// Members of a family.
pub(crate) const MEMBERS: u64 = 10;
/// Cells of the grid along a side.
const CELLS: usize = 52;

/// How a member differs from the first one of its family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kinship {
    First,
    /// All sizes and places by up to three hundredths.
    Near,
    /// By up to a tenth.
    Far,
    /// One more hole or boss.
    Edited,
    Mirrored,
}

/// Who is the `index`-th original, of families of [`MEMBERS`].
pub(crate) fn kinship(index: u64) -> Kinship {
    match index % MEMBERS {
        0 => Kinship::First,
        1..=3 => Kinship::Near,
        4..=6 => Kinship::Far,
        7..=8 => Kinship::Edited,
        _ => Kinship::Mirrored,
    }
}

/// Every sixth family is a kit of several parts.
pub(crate) fn is_kit(index: u64) -> bool {
    (index / MEMBERS) % 6 == 5
}

/// The `index`-th original: the same for the same index.
pub(crate) fn original(index: u64) -> Soup {
    let family = index / MEMBERS;
    let parts = if is_kit(index) { 4 + family % 3 } else { 1 };
    let mut all = Soup::new(Vec::new(), Vec::new());
    for part in 0..parts {
        let mut soup = single(family * 16 + part, index);
        let shift = Vector3::new(2.2 * (part % 3) as f64, 2.2 * (part / 3) as f64, 0.0);
        soup.points.iter_mut().for_each(|p| *p += shift);
        all = joined(&all, &soup);
    }
    if kinship(index) == Kinship::Mirrored {
        all.points.iter_mut().for_each(|p| p.x = -p.x);
        all.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    }
    all
}

fn single(seed: u64, index: u64) -> Soup {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let blobby = rng.random_bool(0.3);
    let count = rng.random_range(4..10);
    let mut solids: Vec<Solid> = (0..count).map(|k| Solid::random(&mut rng, k == 0, blobby)).collect();
    let mut own = ChaCha8Rng::seed_from_u64(index + (1 << 40));
    match kinship(index) {
        Kinship::First | Kinship::Mirrored => {}
        Kinship::Near => solids.iter_mut().for_each(|s| s.jitter(&mut own, 0.03)),
        Kinship::Far => solids.iter_mut().for_each(|s| s.jitter(&mut own, 0.1)),
        Kinship::Edited => {
            let mut edit = Solid::random(&mut own, false, false);
            edit.sizes *= 0.6;
            solids.push(edit);
        }
    }
    // Half-bumps, so that no blob is perfectly smooth.
    let soft = if blobby { 0.12 } else { 0.0 };
    let shape = |p: &Point3<f64>| {
        let solid = solids.iter().fold(f64::INFINITY, |sofar, solid| solid.add(sofar, p, soft));
        // Nothing leaves the grid.
        solid.max(p.coords.amax() - 0.96)
    };
    surface(CELLS, shape)
}

/// A simple solid that is added or taken away.
struct Solid {
    kind: u32,
    removed: bool,
    centre: Point3<f64>,
    turn: Matrix3<f64>,
    sizes: Vector3<f64>,
}

impl Solid {
    fn random(rng: &mut impl Rng, first: bool, blobby: bool) -> Self {
        let mut within = |low: f64, high: f64| rng.random_range(low..high);
        let reach = if first { 0.15 } else { 0.6 };
        let centre = Point3::new(within(-reach, reach), within(-reach, reach), within(-reach, reach));
        let (low, high) = if first { (0.3, 0.8) } else { (0.08, 0.45) };
        let sizes = Vector3::new(within(low, high), within(low, high), within(low, high));
        let axis = Vector3::new(within(-1.0, 1.0), within(-1.0, 1.0), within(-1.0, 1.0));
        let turned = blobby || within(0.0, 1.0) < 0.2;
        let turn = if turned {
            UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), within(0.0, 3.0))
        } else {
            UnitQuaternion::identity()
        };
        let kind = if blobby { 2 } else { rng.random_range(0..5) };
        let removed = !first && !blobby && rng.random_bool(0.4);
        Self { kind, removed, centre, turn: turn.to_rotation_matrix().into_inner().transpose(), sizes }
    }

    fn jitter(&mut self, rng: &mut impl Rng, strength: f64) {
        for k in 0..3 {
            self.sizes[k] *= 1.0 + rng.random_range(-strength..strength);
            self.centre[k] += rng.random_range(-strength..strength) * 0.5;
        }
    }

    /// About the distance from the solid, negative inside.
    fn distance(&self, p: &Point3<f64>) -> f64 {
        let q = self.turn * (p - self.centre);
        let s = self.sizes;
        match self.kind {
            0 => (q.abs() - s).max(),
            1 => (q.xy().norm() - s.x).max(q.z.abs() - s.z),
            2 => (q.component_div(&s).norm() - 1.0) * s.min(),
            3 => (q.xy().norm() - s.x).hypot(q.z) - 0.4 * s.y.min(s.x),
            _ => (q.xy().norm() - s.x * (0.5 - 0.5 * q.z / s.z)).max(q.z.abs() - s.z) * 0.8,
        }
    }

    /// `sofar` with this solid added, blended over `soft`, or taken away.
    fn add(&self, sofar: f64, p: &Point3<f64>, soft: f64) -> f64 {
        let d = self.distance(p);
        if self.removed {
            return sofar.max(-d);
        }
        let blend = (soft - (sofar - d).abs()).max(0.0);
        let rounded = if soft > 0.0 { blend * blend / (4.0 * soft) } else { 0.0 };
        sofar.min(d) - rounded
    }
}
