//! A ball with relief, in any size.

use super::geodesic::{frequency_for, geodesic};
use super::waves::Waves;
use sombrero_mesh::Soup;

/// A sphere of mean radius 1 with relief at six scales, with about `vertices` vertices.
///
/// The count is the nearest 10 f² + 2: 1 002 for 1 000, 10 242 for 10 000, 100 002 for 100 000, 501 762 for
/// 500 000. It lies in 12..=10 485 762. The surface is star-shaped about the origin, and the same at every
/// size.
///
/// ```
/// assert_eq!(sombrero_shapes::bumpy_sphere(1_000).points.len(), 1_002);
/// ```
pub fn bumpy_sphere(vertices: usize) -> Soup {
    let mut soup = geodesic(frequency_for(vertices));
    let relief = Waves::new(6, 2.6, 0.045, 1.9, 0.5);
    for p in &mut soup.points {
        *p *= 1.0 + relief.at(p);
    }
    soup
}
