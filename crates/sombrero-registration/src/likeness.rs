//! Three numbers by which surfaces of other shape are told apart at once, whatever their pose, size, chirality and tessellation.

use crate::surface::moments::Moments;
use nalgebra::Point3;

/// The root of the area, and the two smaller spreads along the principal axes, over the root mean square distance from the
/// centroid: the same for a surface moved, scaled, mirrored or tessellated anew.
///
/// `None` of no surface, or one with a corner that is not there or not finite.
pub fn likeness(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Option<[f64; 3]> {
    let usable = |&v: &u32| points.get(v as usize).is_some_and(|p| p.iter().all(|x| x.is_finite()));
    if !triangles.iter().flatten().all(usable) {
        return None;
    }
    let moments = Moments::new(points, triangles);
    let numbers = [moments.area.sqrt(), moments.spreads.y, moments.spreads.z].map(|x| x / moments.radius());
    numbers.iter().all(|x| x.is_finite()).then_some(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Similarity3, Vector3};
    use sombrero_shapes as shapes;

    fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn motions_and_mirrors_change_nothing_and_other_shapes_do() {
        let part = shapes::part(3);
        let own = likeness(&part.points, &part.triangles).unwrap();
        let turn = Similarity3::new(Vector3::new(3.0, 2.0, 1.0), Vector3::new(-1.0, 2.0, 0.5), 4.0);
        let moved: Vec<_> = part.points.iter().map(|p| turn * Point3::new(p.x, -p.y, p.z)).collect();
        assert!(apart(own, likeness(&moved, &part.triangles).unwrap()) < 1e-9);
        for other in [shapes::bust(6), shapes::torus(24, 12, 2.0, 0.7), shapes::cube()] {
            assert!(apart(own, likeness(&other.points, &other.triangles).unwrap()) > 0.05);
        }
    }

    #[test]
    fn a_cube_is_known() {
        // Sides of 1: area 6, each spread √(5 / 36), the radius √3 times that.
        let cube = shapes::cube();
        let [area, second, third] = likeness(&cube.points, &cube.triangles).unwrap();
        assert!((area - 6.0_f64.sqrt() / (15.0_f64 / 36.0).sqrt()).abs() < 1e-12);
        assert!(
            (second - (1.0_f64 / 3.0).sqrt()).abs() < 1e-9 && (third - (1.0_f64 / 3.0).sqrt()).abs() < 1e-9
        );
    }

    #[test]
    fn no_surface_is_like_nothing() {
        let spot = vec![Point3::new(1.0, 2.0, 3.0); 3];
        assert_eq!(likeness(&spot, &[[0, 1, 2]]), None);
        assert_eq!(likeness(&[], &[]), None);
        assert_eq!(likeness(&spot, &[[0, 1, 3]]), None);
        let broken = vec![Point3::origin(), Point3::new(f64::NAN, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        assert_eq!(likeness(&broken, &[[0, 1, 2]]), None);
    }
}
