//! Lines as thin tubes, which a renderer of triangles can draw.

use nalgebra::{Point3, Vector3};
use sombrero::mesh::Soup;
use std::f64::consts::TAU;

/// Sides of a tube.
const SIDES: u32 = 6;

/// Adds a tube around each segment of a closed line, a little longer than the segment so that corners close.
pub(super) fn add_loop(soup: &mut Soup, line: &[Point3<f64>], radius: f64) {
    for (a, b) in line.iter().zip(line.iter().cycle().skip(1)) {
        if let Some(along) = (b - a).try_normalize(0.0) {
            add_tube(soup, [a - along * (0.5 * radius), b + along * (0.5 * radius)], along, radius);
        }
    }
}

fn add_tube(soup: &mut Soup, ends: [Point3<f64>; 2], along: Vector3<f64>, radius: f64) {
    let helper = if along.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let side = along.cross(&helper).normalize();
    let other = along.cross(&side);
    let first = soup.points.len() as u32;
    for i in 0..SIDES {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(SIDES)).sin_cos();
        let offset = (side * cos + other * sin) * radius;
        soup.points.extend(ends.map(|end| end + offset));
    }
    for i in 0..SIDES {
        let [a, b] = [i, (i + 1) % SIDES].map(|k| first + 2 * k);
        soup.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
    }
}
