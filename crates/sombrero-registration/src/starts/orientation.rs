//! Whether the normals of two surfaces point to the same side.
//!
//! The integral of (x - c) · n over a closed surface is three times its volume, positive where the normals point
//! outwards. The mean of (x - c) · n / |x - c|, with c the centroid, is the same without units, and a large cut
//! leaves its sign. Where it is near 0, as for a thin open sheet, it tells nothing.

use nalgebra::Vector3;

use crate::surface::sample::samples;
use crate::surface::shape::Shape;

/// Means beyond this have a sign to rely on.
const CLEAR: f64 = 0.15;
const SAMPLES: usize = 2_000;

/// The factors, 1 or -1, that may turn the suspect's normals to those of the reference; likelier first.
pub(crate) fn orientations(reference: &Shape, suspect: &Shape) -> &'static [f64] {
    match (sign(reference), sign(suspect)) {
        (Some(a), Some(b)) if a == b => &[1.0],
        (Some(_), Some(_)) => &[-1.0],
        _ => &[1.0, -1.0],
    }
}

/// Whether normals point outwards; `None` when that is not clear.
fn sign(shape: &Shape) -> Option<bool> {
    let outwards: f64 = samples(shape, SAMPLES)
        .into_iter()
        .map(|s| {
            let direction =
                (s.point - shape.moments.centroid).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
            direction.dot(&s.with_unit_normal().normal)
        })
        .sum();
    let mean = outwards / SAMPLES as f64;
    (mean.abs() > CLEAR).then_some(mean > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Side;
    use sombrero_mesh::Soup;
    use sombrero_shapes as shapes;

    fn shape(soup: &Soup) -> Shape {
        Shape::new(Side::Reference, &soup.points, &soup.triangles).unwrap()
    }

    #[test]
    fn turned_normals_are_seen() {
        for soup in [shapes::part(2), shapes::bust(12), shapes::torus(24, 12, 2.0, 0.7)] {
            let mut turned = soup.clone();
            turned.triangles.iter_mut().for_each(|t| t.swap(0, 1));
            assert_eq!(orientations(&shape(&soup), &shape(&soup)), [1.0]);
            assert_eq!(orientations(&shape(&soup), &shape(&turned)), [-1.0]);
            assert_eq!(orientations(&shape(&turned), &shape(&turned)), [1.0]);
        }
    }

    #[test]
    fn a_sheet_may_be_either() {
        let mut sheet = shapes::open_sheet(12, 8);
        sheet.points.iter_mut().for_each(|p| p.z *= 0.05);
        let sheet = shape(&sheet);
        assert_eq!(orientations(&sheet, &sheet), [1.0, -1.0]);
    }
}
