//! A portrait bust: a smooth body lofted through cross-sections, with features modelled onto it.

use core::f64::consts::PI;

use nalgebra::{Point3, Vector3};

use super::geodesic::geodesic;
use super::waves::Waves;
use sombrero_mesh::Soup;

/// The [`bust`] resolution that gives about 10 000 vertices.
pub const BUST_RESOLUTION: usize = 32;

/// A head on a draped pair of shoulders, closed underneath: 10 r² + 2 vertices, genus 0.
///
/// y is up and the face looks along +z; the bust is about 3.5 units high, of which the head takes 2.1.
/// Features come in all sizes: skull and jaw, nose, ears and eyes, lips and lids, curls of hair. Curls too
/// fine for the mesh are left out, so finer meshes show finer curls. `resolution` is moved into 1..=1024:
///
/// | resolution | vertices |
/// |---|---|
/// | 7 | 492 |
/// | 32 ([`BUST_RESOLUTION`]) | 10 242 |
/// | 100 | 100 002 |
/// | 224 | 501 762 |
///
/// ```
/// use sombrero_shapes as shapes;
/// assert_eq!(shapes::bust(shapes::BUST_RESOLUTION).points.len(), 10_242);
/// ```
pub fn bust(resolution: usize) -> Soup {
    let resolution = resolution.clamp(1, 1024);
    let mut soup = geodesic(resolution);
    let (body, relief) = (Body::new(), Relief::new(resolution));
    for p in &mut soup.points {
        let (base, forward) = body.at(p);
        *p = relief.shape(&base, forward);
    }
    soup
}

/// A cross-section of the body: an egg-shaped curve in a plane that holds the x direction.
#[derive(Clone, Copy)]
struct Section {
    /// Foremost and hindmost points (x = 0) as y and z.
    front: [f64; 2],
    back: [f64; 2],
    /// Largest |x|.
    half: f64,
}

const fn section(front: [f64; 2], back: [f64; 2], half: f64) -> Section {
    Section { front, back, half }
}

/// From the crown down to the middle of the base.
const SECTIONS: [Section; 20] = [
    section([1.04, -0.10], [1.04, -0.10], 0.0),
    section([0.99, 0.28], [0.97, -0.46], 0.38),
    section([0.80, 0.57], [0.74, -0.76], 0.585),
    section([0.50, 0.715], [0.42, -0.90], 0.675),
    section([0.20, 0.745], [0.10, -0.91], 0.69),
    section([-0.05, 0.72], [-0.18, -0.84], 0.675),
    section([-0.30, 0.715], [-0.40, -0.71], 0.635),
    section([-0.55, 0.715], [-0.58, -0.60], 0.575),
    section([-0.76, 0.69], [-0.72, -0.54], 0.495),
    section([-0.92, 0.62], [-0.84, -0.52], 0.43),
    section([-0.97, 0.44], [-0.95, -0.52], 0.385),
    section([-1.02, 0.24], [-1.07, -0.53], 0.37),
    section([-1.17, 0.12], [-1.20, -0.56], 0.375),
    section([-1.36, 0.11], [-1.34, -0.62], 0.44),
    section([-1.54, 0.20], [-1.48, -0.71], 0.66),
    section([-1.74, 0.36], [-1.66, -0.79], 0.95),
    section([-2.02, 0.47], [-1.98, -0.82], 1.10),
    section([-2.28, 0.45], [-2.26, -0.78], 1.09),
    section([-2.34, 0.24], [-2.34, -0.52], 0.62),
    section([-2.34, -0.15], [-2.34, -0.15], 0.0),
];

/// A section as one vector, so that sections can be blended.
type Row = nalgebra::SVector<f64, 5>;

/// The smooth body, as a map from the unit sphere.
struct Body {
    /// Positions of the sections along the body.
    knots: Vec<f64>,
    rows: Vec<Row>,
    /// Positions along the body at even steps of the polar angle.
    table: Vec<f64>,
}

/// Steps in the table of polar angles.
const STEPS: usize = 4096;

impl Body {
    fn new() -> Self {
        // One more section beyond each pole: turned by half a circle it continues the loft smoothly.
        let turned = |s: Section| Section { front: s.back, back: s.front, half: -s.half };
        let last = SECTIONS.len() - 1;
        let mut sections = vec![turned(SECTIONS[1])];
        sections.extend(SECTIONS);
        sections.push(turned(SECTIONS[last - 1]));
        let row = |s: &Section| Row::new(s.front[0], s.front[1], s.back[0], s.back[1], s.half);
        let rows: Vec<Row> = sections.iter().map(row).collect();
        let mut knots = vec![0.0];
        for pair in rows.windows(2) {
            knots.push(knots[knots.len() - 1] + mean_length(&(pair[1] - pair[0])));
        }
        let mut body = Self { knots, rows, table: Vec::new() };
        body.table = body.fair_table();
        body
    }

    /// Chooses the position for each polar angle half-way between a map that keeps the shapes of triangles
    /// (and starves the shoulders) and one that keeps their sizes (and stretches them along the neck).
    fn fair_table(&self) -> Vec<f64> {
        let (first, last) = (self.knots[1], self.knots[self.knots.len() - 2]);
        let along = |part: f64| first + (last - first) * part;
        let finest = self.knots[FINEST];
        let body = shares(|part| {
            let finer = 1.0 + 1.8 * gauss((along(part) - finest) / 0.9);
            finer / mean_radius(&self.row(along(part))).sqrt()
        });
        let sphere = shares(|part| 1.0 / libm::sin(PI * part).sqrt());
        // Equal shares of the body and of the sphere belong together.
        let mut table = Vec::with_capacity(STEPS + 1);
        let mut step = 0;
        for share in sphere {
            while step + 2 < body.len() && body[step + 1] < share {
                step += 1;
            }
            let blend = (share - body[step]) / (body[step + 1] - body[step]);
            table.push(along((step as f64 + blend.clamp(0.0, 1.0)) / STEPS as f64));
        }
        table
    }

    /// The section at a position along the body from a cubic through the sections.
    fn row(&self, at: f64) -> Row {
        let (knots, rows) = (&self.knots, &self.rows);
        let i = knots.partition_point(|k| *k <= at).clamp(2, knots.len() - 2) - 1;
        let width = knots[i + 1] - knots[i];
        let chord = (rows[i + 1] - rows[i]) / width;
        let (from, to) = (self.tangent(i), self.tangent(i + 1));
        let t = (at - knots[i]) / width;
        let (bend, twist) = (from - chord, to - chord);
        rows[i] + (rows[i + 1] - rows[i]) * t + (bend * (1.0 - t) - twist * t) * (t * (1.0 - t) * width)
    }

    /// The slope at a knot of the parabola through it and its neighbours.
    fn tangent(&self, i: usize) -> Row {
        let before = self.knots[i] - self.knots[i - 1];
        let after = self.knots[i + 1] - self.knots[i];
        let slope_before = (self.rows[i] - self.rows[i - 1]) / before;
        let slope_after = (self.rows[i + 1] - self.rows[i]) / after;
        (slope_before * after + slope_after * before) / (before + after)
    }

    /// The point of the body for a point of the unit sphere, and how far it faces forward, from -1 to 1.
    fn at(&self, direction: &Point3<f64>) -> (Point3<f64>, f64) {
        let girth = (direction.x * direction.x + direction.z * direction.z).sqrt();
        let polar = libm::atan2(girth, direction.y) / PI * STEPS as f64;
        let step = (polar as usize).min(STEPS - 1);
        let blend = polar - step as f64;
        let row = self.row(self.table[step] * (1.0 - blend) + self.table[step + 1] * blend);
        let (side, forward) =
            if girth > 0.0 { (direction.x / girth, direction.z / girth) } else { (0.0, 1.0) };
        let (ahead, behind) = ((1.0 + forward) / 2.0, (1.0 - forward) / 2.0);
        let y = row[0] * ahead + row[2] * behind;
        let z = row[1] * ahead + row[3] * behind;
        (Point3::new(row[4] * side, y, z), forward)
    }
}

/// The knot around which vertices are densest: the height of the brow.
const FINEST: usize = 5;

/// Running integral of a density over 0..=1 in `STEPS` steps, scaled to end at 1.
fn shares(density: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut shares = vec![0.0];
    for step in 0..STEPS {
        sum += density((step as f64 + 0.5) / STEPS as f64);
        shares.push(sum);
    }
    shares.iter().map(|share| share / sum).collect()
}

/// How far a change of section moves its front, back and sides on average.
fn mean_length(change: &Row) -> f64 {
    let length = |y: f64, z: f64| (y * y + z * z).sqrt();
    let middle = length((change[0] + change[2]) / 2.0, (change[1] + change[3]) / 2.0);
    let side = length(change[4], middle);
    (length(change[0], change[1]) + length(change[2], change[3]) + 2.0 * side) / 4.0
}

fn mean_radius(row: &Row) -> f64 {
    let (y, z) = (row[0] - row[2], row[1] - row[3]);
    ((y * y + z * z).sqrt() / 2.0 + row[4].abs()) / 2.0
}

/// A bump on the face: centre, widths and height; negative heights are dents.
struct Bump {
    centre: [f64; 2],
    width: [f64; 2],
    height: f64,
}

const fn bump(centre: [f64; 2], width: [f64; 2], height: f64) -> Bump {
    Bump { centre, width, height }
}

/// The face as bumps in x and y that push along z. The left half; bumps off the middle have a twin.
const FACE: [Bump; 25] = [
    // Nose: bridge, back, tip, wing, nostril.
    bump([0.0, 0.03], [0.085, 0.12], 0.075),
    bump([0.0, -0.16], [0.09, 0.13], 0.125),
    bump([0.0, -0.275], [0.105, 0.085], 0.15),
    bump([0.115, -0.315], [0.06, 0.05], 0.075),
    bump([0.055, -0.375], [0.03, 0.022], -0.05),
    // Eyes: socket, inner corner, ball, upper lid, lower lid, iris.
    bump([0.27, 0.015], [0.16, 0.10], -0.115),
    bump([0.13, 0.01], [0.05, 0.06], -0.05),
    bump([0.275, 0.0], [0.10, 0.072], 0.095),
    bump([0.275, 0.062], [0.105, 0.02], 0.022),
    bump([0.275, -0.062], [0.095, 0.018], 0.018),
    bump([0.265, 0.0], [0.022, 0.022], -0.022),
    // Brow: ridges, and the dip between them.
    bump([0.26, 0.165], [0.19, 0.06], 0.05),
    bump([0.0, 0.16], [0.07, 0.07], 0.03),
    // Forehead, temple, cheekbone, cheek.
    bump([0.2, 0.42], [0.2, 0.14], 0.03),
    bump([0.56, 0.18], [0.1, 0.16], -0.06),
    bump([0.40, -0.16], [0.14, 0.09], 0.075),
    bump([0.38, -0.46], [0.11, 0.14], -0.06),
    // Mouth: mound, groove under the nose, upper lip, gap, lower lip, corner, dip below.
    bump([0.0, -0.54], [0.21, 0.13], 0.055),
    bump([0.0, -0.455], [0.026, 0.05], -0.022),
    bump([0.065, -0.53], [0.085, 0.03], 0.032),
    bump([0.0, -0.578], [0.175, 0.02], -0.035),
    bump([0.0, -0.628], [0.125, 0.036], 0.042),
    bump([0.215, -0.575], [0.035, 0.04], -0.035),
    bump([0.0, -0.705], [0.13, 0.04], -0.035),
    bump([0.0, -0.83], [0.14, 0.085], 0.075),
];

/// Everything modelled onto the body.
struct Relief {
    /// Long waves that bend locks of hair and folds of cloth.
    curls: Waves,
    /// The slight unevenness of all surfaces.
    skin: Waves,
    /// How much of each scale of hair the mesh is fine enough to carry, coarse to fine.
    carried: [f64; 3],
}

impl Relief {
    fn new(resolution: usize) -> Self {
        // The shortest wave of curls should span about four edges.
        let carried = [8.0, 16.0, 40.0].map(|needed| smooth_step(needed, 2.0 * needed, resolution as f64));
        Self {
            curls: Waves::new(1, 5.0, 0.22, 1.0, 1.0),
            skin: Waves::new(2, 9.0, 0.0022, 2.2, 0.5),
            carried,
        }
    }

    /// Moves a point of the body to the bust's surface.
    fn shape(&self, base: &Point3<f64>, forward: f64) -> Point3<f64> {
        let mut p = *base + self.ear(base);
        p.z += smooth_step(0.05, 0.55, forward) * face(base);
        let bare = 1.0 - smooth_step(0.25, 0.9, ear_presence(base));
        let hair = self.hair(base) * bare;
        // Hair grows away from the middle of the skull.
        let outward = (base - Point3::new(0.0, 0.1, -0.1)).normalize();
        let chest = smooth_step(-1.42, -1.62, base.y) * smooth_step(-2.3, -2.15, base.y);
        let folds = self.folds(base) * chest;
        let around = Vector3::new(base.x, 0.3, base.z + 0.15).normalize();
        p + outward * (hair + self.skin.at(base)) + around * folds
    }

    /// Height of the hair: a cap with curls in three sizes.
    fn hair(&self, p: &Point3<f64>) -> f64 {
        // The hairline runs from the forehead over the ears down to the nape.
        let line = -0.16 + 0.93 * p.z + 0.10 * p.x * p.x;
        let cap = smooth_step(-0.02, 0.13, p.y - line);
        if cap == 0.0 {
            return 0.0;
        }
        // Warping the ground bends straight rows of waves into locks.
        let warp = self.curls.at(p);
        let around = libm::atan2(p.x, -(p.z + 0.1));
        let down = p.y + 0.25 * warp;
        // All the ways around meet at the crown, so nothing may depend on them there.
        let off_crown = smooth_step(0.0, 0.3, (p.x * p.x + (p.z + 0.1) * (p.z + 0.1)).sqrt());
        let lock = off_crown
            * libm::sin(7.0 * around + 3.0 * warp)
            * libm::sin(13.0 * down + 2.0 * libm::sin(5.0 * around));
        let curl = libm::sin(24.0 * down + 9.0 * warp + 4.0 * lock);
        let strand = libm::sin(70.0 * p.x + 14.0 * warp + 3.0 * curl) * libm::cos(64.0 * down - 5.0 * lock);
        let [a, b, c] = self.carried;
        cap * (0.075 + 0.030 * lock * a + 0.016 * curl * b + 0.004 * strand * c)
    }

    /// The ear's push: a flap with a rim and a hollow, leaning outward and back.
    fn ear(&self, p: &Point3<f64>) -> Vector3<f64> {
        let presence = ear_presence(p);
        if presence == 0.0 {
            return Vector3::zeros();
        }
        let q = ear_radius(p);
        let rim = gauss((q - 0.72) / 0.24);
        let hollow = gauss((ear_radius(&(p + Vector3::new(0.0, -0.02, -0.02))) - 0.05) / 0.42);
        let out = 0.075 * presence + 0.055 * rim * presence - 0.075 * hollow;
        Vector3::new(out * p.x.signum(), 0.0, -0.45 * out.max(0.0))
    }

    /// Folds of the drapery that fan out from the neck.
    fn folds(&self, p: &Point3<f64>) -> f64 {
        let around = libm::atan2(p.x, p.z + 0.15);
        let sway = 0.6 * libm::sin(3.0 * around + 1.0) + 1.2 * self.curls.at(p);
        0.028 * libm::sin(9.0 * around + 1.5 * p.y + 2.0 * sway)
            + 0.012 * libm::sin(14.0 * p.y + 6.0 * libm::cos(around) + 2.0 * sway) * self.carried[0]
    }
}

/// Height of the face's features above the body.
fn face(p: &Point3<f64>) -> f64 {
    let height = |b: &Bump| {
        let along_y = gauss((p.y - b.centre[1]) / b.width[1]);
        let left = gauss((p.x - b.centre[0]) / b.width[0]);
        let twin = if b.centre[0] > 0.0 { gauss((p.x + b.centre[0]) / b.width[0]) } else { 0.0 };
        b.height * along_y * (left + twin)
    };
    FACE.iter().map(height).sum()
}

/// Distance from the ear's middle on either side, in units of its outline.
fn ear_radius(p: &Point3<f64>) -> f64 {
    let (y, z) = (p.y + 0.06, p.z + 0.10);
    // Ears lean back at the top and are wider there.
    let (along, across) = (y - 0.25 * z, z + 0.25 * y);
    let width = 0.145 + 0.14 * along;
    let (a, b) = (along / 0.25, across / width.max(0.06));
    (a * a + b * b).sqrt()
}

/// 1 inside the ear, 0 outside, with a steep flank between.
fn ear_presence(p: &Point3<f64>) -> f64 {
    if p.x.abs() < 0.3 { 0.0 } else { smooth_step(1.12, 0.72, ear_radius(p)) }
}

fn gauss(t: f64) -> f64 {
    libm::exp(-t * t)
}

/// 0 before `from`, 1 past `to`, smooth between; `from` may be the larger one.
fn smooth_step(from: f64, to: f64, at: f64) -> f64 {
    let t = ((at - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
