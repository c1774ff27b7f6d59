//! A machined part: flat and cylindrical regions bounded by sharp creases.

use nalgebra::{Point3, Vector2};

use super::blocks::{Axis, boundary};
use sombrero_mesh::Soup;

/// The [`part`] resolution that gives about 6 400 vertices.
pub const PART_RESOLUTION: usize = 10;

/// Coarsest resolution at which there is room for chamfers.
const CHAMFERED: usize = 6;

// Lengths are multiples of 1/8, so that sums and differences of them are exact and lattice nodes can be told
// apart by plain comparisons.

/// Depth of every chamfer.
const BEVEL: f64 = 0.25;

// The base plate: [0, 12] x [-3.125, 3.125] x [0, 1.25], with corners of radius 1.5 in plan.
const PLATE_TOP: f64 = 1.25;
const PLATE_RADIUS: f64 = 1.5;
/// Where the plate's corners have their centres.
const PLATE_CORE: [[f64; 2]; 2] = [[1.5, 10.5], [-1.625, 1.625]];

// A boss on the plate and a collar on the lug, with the same radii and bores.
const BORE: f64 = 1.0;
const BOSS: f64 = 1.625;
/// Half the side of the square in which the circles around a bore fade into the straight lattice.
const FADE: f64 = 2.125;
const BOSS_X: f64 = 8.375;
const BOSS_TOP: f64 = 2.25;

// The lug: an upright slab [1.5, 2.875] x [-2.375, 2.375] with a semicircular top.
const LUG: [f64; 2] = [1.5, 2.875];
const LUG_RADIUS: f64 = 2.375;
const LUG_Z: f64 = 5.375;
const COLLAR_X: f64 = 3.5;

// The rib between plate and lug: a triangle in the xz plane.
const RIB: f64 = 2.0;
const RIB_HALF: f64 = 0.375;

/// A groove across the bottom of the plate.
const GROOVE: [f64; 3] = [3.5, 4.875, 0.375];

/// A bearing bracket of genus 2: a rounded plate with a bored boss and a groove underneath, an upright lug
/// with a semicircular top and a bored collar, and a rib between them; many edges are chamfered.
///
/// It stands on z = 0 and measures 12 x 6.25 x 7.75. Every crease runs along mesh edges. `resolution` is
/// moved into 1..=250; below 6 the chamfers are left out:
///
/// | resolution | vertices |
/// |---|---|
/// | 1 | 650 |
/// | 10 ([`PART_RESOLUTION`]) | 6 406 |
/// | 100 | 615 592 |
///
/// ```
/// use sombrero_shapes as shapes;
/// let bracket = shapes::part(shapes::PART_RESOLUTION);
/// assert!((5_500..6_500).contains(&bracket.points.len()));
/// ```
pub fn part(resolution: usize) -> Soup {
    let resolution = resolution.clamp(1, 250);
    let bevel = if resolution < CHAMFERED { 0.0 } else { BEVEL };
    let step = 2.3 / resolution as f64;
    // Graded pieces: rows of slightly different widths, as no real part is an even lattice.
    let axes = borders(bevel).map(|b| Axis::new(&b, step, 0.08));
    boundary(&axes, is_solid, |p| place(p, bevel))
}

/// Lattice planes along x, y, z: one for each crease, and for each line where `place` changes its rule.
fn borders(bevel: f64) -> [Vec<f64>; 3] {
    let around = |centre: f64, half: f64| [centre - half, centre + half];
    let rings = |centre: f64| [BORE, BOSS, BOSS - bevel, FADE].map(|half| around(centre, half)).concat();
    let [x_core, y_core] = PLATE_CORE;
    let x_ends = [0.0, bevel, x_core[1] + PLATE_RADIUS - bevel, x_core[1] + PLATE_RADIUS];
    let x_lug = [LUG[0], LUG[0] + bevel, LUG[1] - bevel, LUG[1], COLLAR_X - bevel, COLLAR_X];
    let x = [&x_ends[..], &x_core, &x_lug, &rings(BOSS_X), &GROOVE[..2], &[LUG[1] + RIB]].concat();
    let half_width = y_core[1] + PLATE_RADIUS;
    let y_halves = [RIB_HALF, LUG_RADIUS - bevel, LUG_RADIUS, half_width - bevel, half_width];
    // The plane of symmetry as well, so that the lug has a vertex on its very top.
    let y =
        [y_halves.map(|half| around(0.0, half)).concat(), rings(0.0), y_core.to_vec(), vec![0.0]].concat();
    let z_plate = [0.0, GROOVE[2], PLATE_TOP - bevel, PLATE_TOP, BOSS_TOP - bevel, BOSS_TOP];
    let z_lug = [PLATE_TOP + RIB, LUG_Z, LUG_Z + LUG_RADIUS - bevel, LUG_Z + LUG_RADIUS];
    let z = [&z_plate[..], &z_lug, &rings(LUG_Z)].concat();
    [x, y, z].map(merged)
}

/// Sorts borders and drops doubled ones.
fn merged(mut borders: Vec<f64>) -> Vec<f64> {
    borders.sort_unstable_by(f64::total_cmp);
    borders.dedup();
    borders
}

/// Whether a point, taken before rounding and bevelling, is inside the part.
fn is_solid(p: Point3<f64>) -> bool {
    let in_range = |v: f64, range: [f64; 2]| v > range[0] && v < range[1];
    let from_boss = square_norm(p.x - BOSS_X, p.y);
    let from_lug = square_norm(p.y, p.z - LUG_Z);
    if from_boss < BORE || (p.x < COLLAR_X && from_lug < BORE) {
        return false;
    }
    let groove = in_range(p.x, [GROOVE[0], GROOVE[1]]) && p.z < GROOVE[2];
    let plate = p.z < PLATE_TOP && !groove;
    let boss = p.z < BOSS_TOP && p.z > PLATE_TOP && from_boss < BOSS;
    let lug = in_range(p.x, LUG) && p.z > PLATE_TOP && p.y.abs() < LUG_RADIUS;
    let collar = in_range(p.x, [LUG[0], COLLAR_X]) && from_lug < BOSS;
    let rib_z = [PLATE_TOP, PLATE_TOP + RIB];
    let rib = in_range(p.x, [LUG[1], LUG[1] + RIB]) && in_range(p.z, rib_z) && p.y.abs() < RIB_HALF;
    plate || boss || lug || collar || rib
}

/// Moves a lattice node to its place on the part. The four rules act on disjoint nodes or agree where they
/// meet, so the result is one-to-one.
fn place(mut p: Point3<f64>, bevel: f64) -> Point3<f64> {
    if p.z <= PLATE_TOP {
        p = place_plate(p, bevel);
    }
    if p.z <= BOSS_TOP {
        p = place_boss(p, bevel);
    }
    if p.z >= PLATE_TOP && p.x >= LUG[0] && p.x <= COLLAR_X {
        p = place_lug(p, bevel);
    }
    place_rib(p)
}

/// Rounds the plate in plan and bevels its upper edge.
fn place_plate(p: Point3<f64>, bevel: f64) -> Point3<f64> {
    let [x_core, y_core] = PLATE_CORE;
    let core = Vector2::new(p.x.clamp(x_core[0], x_core[1]), p.y.clamp(y_core[0], y_core[1]));
    let from_core = Vector2::new(p.x, p.y) - core;
    let (out, up) = bevelled(square_norm(from_core.x, from_core.y), p.z, [PLATE_RADIUS, PLATE_TOP], bevel);
    let plan = core + resized(to_disc(from_core), out);
    Point3::new(plan.x, plan.y, up)
}

/// Makes squares around the boss's axis circles, and bevels the boss.
fn place_boss(p: Point3<f64>, bevel: f64) -> Point3<f64> {
    let d = Vector2::new(p.x - BOSS_X, p.y);
    let size = square_norm(d.x, d.y);
    if size >= FADE {
        return p;
    }
    let (out, up) = if size <= BOSS { bevelled(size, p.z, [BOSS, BOSS_TOP], bevel) } else { (size, p.z) };
    let d = faded(d * (out / size), out);
    Point3::new(BOSS_X + d.x, d.y, up)
}

/// Makes squares around the bore of the lug circles, rounds the lug's top, bevels lug and collar.
fn place_lug(p: Point3<f64>, bevel: f64) -> Point3<f64> {
    let d = Vector2::new(p.y, p.z - LUG_Z);
    let size = square_norm(d.x, d.y);
    let (upper, collar) = (d.y >= 0.0, p.x > LUG[1] && size <= BOSS);
    // Below the bore the lug's edge runs straight down.
    let edge = if upper { size } else { d.x.abs() };
    let (mut d, mut x) = (d, p.x);
    if collar {
        let (out, moved) = bevelled(size, p.x, [BOSS, COLLAR_X], bevel);
        (d, x) = (d * (out / size), moved);
    } else if edge > LUG_RADIUS - bevel && edge <= LUG_RADIUS && p.x <= LUG[1] {
        // One bevel on the front, its mirror image on the back.
        let middle = (LUG[0] + LUG[1]) / 2.0;
        let (out, depth) = bevelled(edge, (p.x - middle).abs(), [LUG_RADIUS, LUG[1] - middle], bevel);
        x = if p.x < middle { middle - depth } else { middle + depth };
        d = if upper { d * (out / edge) } else { Vector2::new(d.x * (out / edge), d.y) };
    }
    let size = square_norm(d.x, d.y);
    let d = if upper { resized(to_disc(d), size) } else { faded(d, size) };
    Point3::new(x, d.x, LUG_Z + d.y)
}

/// Folds the square block between plate and lug down to a triangle.
fn place_rib(p: Point3<f64>) -> Point3<f64> {
    let d = Vector2::new(p.x - LUG[1], p.z - PLATE_TOP);
    let inside = d.x > 0.0 && d.y > 0.0 && square_norm(d.x, d.y) <= RIB;
    if !inside || p.y.abs() > RIB_HALF {
        return p;
    }
    let d = to_diamond(d);
    Point3::new(LUG[1] + d.x, p.y, PLATE_TOP + d.y)
}

/// The larger of two lengths: squares are the circles of this norm.
fn square_norm(x: f64, y: f64) -> f64 {
    x.abs().max(y.abs())
}

/// Bevels the edge where `out` and `up` both reach their `rim`, and gives their new values.
fn bevelled(out: f64, up: f64, rim: [f64; 2], bevel: f64) -> (f64, f64) {
    let start = [rim[0] - bevel, rim[1] - bevel];
    if out <= start[0] || up <= start[1] {
        return (out, up);
    }
    let d = to_diamond(Vector2::new(out - start[0], up - start[1]));
    (start[0] + d.x, start[1] + d.y)
}

/// Maps squares with a corner on the diagonal to diamonds, in the first quadrant.
fn to_diamond(d: Vector2<f64>) -> Vector2<f64> {
    d * (square_norm(d.x, d.y) / (d.x + d.y))
}

/// Maps squares about the origin to circles, sides at even angles; points on the axes stay.
fn to_disc(d: Vector2<f64>) -> Vector2<f64> {
    let size = square_norm(d.x, d.y);
    if d.x == 0.0 || d.y == 0.0 {
        return d;
    }
    let eighth = core::f64::consts::FRAC_PI_4;
    if d.x.abs() >= d.y.abs() {
        let (sin, cos) = libm::sincos(eighth * d.y / d.x.abs());
        Vector2::new(size * cos * d.x.signum(), size * sin)
    } else {
        let (sin, cos) = libm::sincos(eighth * d.x / d.y.abs());
        Vector2::new(size * sin, size * cos * d.y.signum())
    }
}

/// `d` with the length `size`; the zero vector stays.
fn resized(d: Vector2<f64>, size: f64) -> Vector2<f64> {
    let norm = d.norm();
    if norm == 0.0 { d } else { d * (size / norm) }
}

/// [`to_disc`] up to the boss's radius, nothing from [`FADE`] on, and a blend between.
fn faded(d: Vector2<f64>, size: f64) -> Vector2<f64> {
    let weight = ((FADE - size) / (FADE - BOSS)).clamp(0.0, 1.0);
    d * (1.0 - weight) + to_disc(d) * weight
}
