//! A mesh of any size made small enough to be carried by a page and turned by a telephone.
//!
//! Edge collapse keeps the shape best but takes seconds per million triangles, so large meshes are thinned first:
//! points that share a cell of a grid become one, their mean. The cell is chosen such that several times more
//! triangles are left than are wanted in the end, and edge collapse then decides which of them matter.

use nalgebra::Point3;
use sombrero::mesh::geometry::area_vector;
use sombrero::mesh::{BoundingBox, Soup};
use sombrero::progressive::simplify;
use sombrero::spatial::Surface;

/// Edge collapse is given no more than this many triangles.
const THINNED: usize = 60_000;

/// A mesh with one number a point; NaN where there is none.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Valued {
    pub(super) soup: Soup,
    pub(super) values: Vec<f64>,
}

/// At most `most` triangles, none of them with a bad index, all points finite and used.
pub(super) fn decimated(mesh: Valued, most: usize) -> Valued {
    let mesh = usable(mesh);
    if mesh.soup.triangles.len() <= most {
        return mesh;
    }
    let thin = thinned(mesh, THINNED.max(most));
    let ratio = most as f64 / thin.soup.triangles.len().max(1) as f64;
    let soup = if ratio < 1.0 { simplify(&thin.soup, ratio) } else { thin.soup.clone() };
    let values = carried(&thin, &soup.points);
    // Thousands of loose pieces cannot be collapsed any further; a coarser grid joins them.
    thinned(usable(Valued { soup, values }), most)
}

/// Only what can be drawn: good triangles, and the points that they use.
fn usable(mesh: Valued) -> Valued {
    let Valued { soup: Soup { points, mut triangles }, values } = mesh;
    let finite = |&v: &u32| points.get(v as usize).is_some_and(|p| p.iter().all(|c| c.is_finite()));
    triangles.retain(|t| t.iter().all(finite) && t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
    let mut place = vec![u32::MAX; points.len()];
    let mut kept = Valued { soup: Soup::default(), values: Vec::new() };
    for corner in triangles.iter_mut().flatten() {
        let old = *corner as usize;
        if place[old] == u32::MAX {
            place[old] = kept.soup.points.len() as u32;
            kept.soup.points.push(points[old]);
            kept.values.push(values.get(old).copied().unwrap_or(f64::NAN));
        }
        *corner = place[old];
    }
    kept.soup.triangles = triangles;
    kept
}

/// The mesh with points of one cell joined; cells grow until at most `most` triangles are left.
fn thinned(mesh: Valued, most: usize) -> Valued {
    if mesh.soup.triangles.len() <= most {
        return mesh;
    }
    let extent = BoundingBox::of(&mesh.soup.points).map(|bounds| (bounds.min, bounds.largest_side()));
    let Some((origin, side)) = extent.filter(|(_, side)| *side > 0.0 && side.is_finite()) else {
        return Valued { soup: Soup::default(), values: Vec::new() };
    };
    let mut cell = first_cell(&mesh.soup, most).clamp(1e-4 * side, 0.02 * side);
    loop {
        let joined = joined(&mesh, &origin, cell);
        if joined.soup.triangles.len() <= most {
            return joined;
        }
        cell *= 1.2;
    }
}

/// A surface of area A meets about 1.5 A/c² cells of side c, and has twice as many triangles as points.
fn first_cell(soup: &Soup, most: usize) -> f64 {
    let area = |&[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|v| soup.points[v as usize]);
        0.5 * area_vector(&a, &b, &c).norm()
    };
    let total: f64 = soup.triangles.iter().map(area).sum();
    (3.0 * total / most as f64).sqrt()
}

fn joined(mesh: &Valued, origin: &Point3<f64>, cell: f64) -> Valued {
    let Soup { points, triangles } = &mesh.soup;
    // 21 bits an axis: the smallest cell is a ten thousandth of the side.
    let key = |p: &Point3<f64>| {
        let [x, y, z] = [0, 1, 2].map(|axis| ((p[axis] - origin[axis]) / cell) as u64 & 0x1f_ffff);
        x << 42 | y << 21 | z
    };
    let mut order: Vec<(u64, u32)> = points.iter().map(key).zip(0..).collect();
    order.sort_unstable();
    let mut place = vec![0; points.len()];
    let mut made = Valued { soup: Soup::default(), values: Vec::new() };
    for members in order.chunk_by(|a, b| a.0 == b.0) {
        members.iter().for_each(|&(_, v)| place[v as usize] = made.soup.points.len() as u32);
        let (point, value) = mean(mesh, members);
        made.soup.points.push(point);
        made.values.push(value);
    }
    let moved = triangles.iter().map(|t| t.map(|v| place[v as usize]));
    made.soup.triangles =
        moved.filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]).map(smallest_first).collect();
    made.soup.triangles.sort_unstable();
    made.soup.triangles.dedup();
    usable(made)
}

/// The mean place; the mean value of those that have one, if those are at least half.
fn mean(mesh: &Valued, members: &[(u64, u32)]) -> (Point3<f64>, f64) {
    let (mut sum, mut total, mut known) = (nalgebra::Vector3::zeros(), 0.0, 0_usize);
    for &(_, v) in members {
        sum += mesh.soup.points[v as usize].coords;
        let value = mesh.values[v as usize];
        if value.is_finite() {
            total += value;
            known += 1;
        }
    }
    let value = if 2 * known >= members.len() { total / known as f64 } else { f64::NAN };
    (Point3::from(sum / members.len() as f64), value)
}

/// The same triangle, turned.
fn smallest_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// The values at points near the mesh: at the closest point of its surface, blended from the corners.
fn carried(from: &Valued, points: &[Point3<f64>]) -> Vec<f64> {
    if from.values.iter().all(|value| value.is_nan()) {
        return vec![f64::NAN; points.len()];
    }
    let surface = Surface::new(&from.soup.points, &from.soup.triangles);
    let value = |closest: sombrero::spatial::Closest| -> f64 {
        let corners = from.soup.triangles[closest.face as usize];
        // A corner without weight has no say, even when its value is missing.
        let weighed = corners.iter().zip(closest.barycentric).filter(|(_, weight)| *weight > 0.0);
        weighed.map(|(&v, weight)| weight * from.values[v as usize]).sum()
    };
    surface.closest_many(points).into_iter().map(|closest| closest.map_or(f64::NAN, value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero::shapes;

    /// A mesh whose value is the height of each point.
    fn heights(soup: Soup) -> Valued {
        let values = soup.points.iter().map(|p| p.y).collect();
        Valued { soup, values }
    }

    #[test]
    fn a_large_sphere_becomes_a_small_one_with_its_values() {
        let sphere = heights(shapes::sphere(7));
        assert!(sphere.soup.triangles.len() > 2 * THINNED);
        let small = decimated(sphere.clone(), 4000);
        assert!((2000..=4000).contains(&small.soup.triangles.len()), "{}", small.soup.triangles.len());
        for (point, value) in small.soup.points.iter().zip(&small.values) {
            assert!(
                (point.coords.norm() - 1.0).abs() < 0.01 && (point.y - value).abs() < 0.02,
                "{point} {value}"
            );
        }
        assert_eq!(small, decimated(sphere, 4000));
    }

    #[test]
    fn what_is_missing_stays_missing() {
        let mut sphere = heights(shapes::sphere(5));
        for (point, value) in sphere.soup.points.iter().zip(&mut sphere.values) {
            if point.x > 0.0 {
                *value = f64::NAN;
            }
        }
        let small = decimated(sphere, 1000);
        for (point, value) in small.soup.points.iter().zip(&small.values) {
            assert!(point.x.abs() < 0.15 || value.is_nan() == (point.x > 0.0), "{point} {value}");
        }
    }

    #[test]
    fn small_meshes_keep_every_triangle() {
        let sphere = heights(shapes::sphere(2));
        assert_eq!(decimated(sphere.clone(), 10_000).soup.triangles.len(), sphere.soup.triangles.len());
    }

    #[test]
    fn loose_pieces_are_thinned_too() {
        let mut soup = Soup::default();
        for i in 0..20_000_u32 {
            let [x, y] = [f64::from(i % 150), f64::from(i / 150)];
            for corner in [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]] {
                soup.points.push(Point3::new(x + corner[0], y + corner[1], 0.0));
            }
            soup.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        let small = decimated(heights(soup), 5000);
        assert!(small.soup.triangles.len() <= 5000);
    }

    #[test]
    fn what_has_no_extent_ends_too() {
        let soup = Soup::new(vec![Point3::origin(); 3], vec![[0, 1, 2]; 100]);
        assert!(decimated(heights(soup), 10).soup.triangles.len() <= 10);
    }

    #[test]
    fn nonsense_is_left_out() {
        let points = vec![Point3::origin(), Point3::new(f64::NAN, 0.0, 0.0), Point3::new(1.0, 0.0, 0.0)];
        let soup = Soup::new(points, vec![[0, 1, 2], [0, 2, 9], [0, 0, 2]]);
        for most in [0, 1, 10] {
            let left = decimated(Valued { soup: soup.clone(), values: vec![] }, most);
            assert_eq!((left.soup, left.values), (Soup::default(), vec![]));
        }
    }
}
