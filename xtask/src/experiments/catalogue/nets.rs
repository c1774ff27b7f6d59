//! The zero surface of a function on a grid, by surface nets (Gibson 1998, "Constrained elastic surface nets"): a vertex in
//! each cell that the surface crosses, at the mean of the crossings of its edges, and a quadrilateral for each crossed edge
//! of the grid.

use nalgebra::{Point3, Vector3};
use sombrero::mesh::Soup;

/// The surface within [-1, 1]³ where `inside` is 0, on a grid of `cells` along each side; negative values are inside.
pub(crate) fn surface(cells: usize, inside: impl Fn(&Point3<f64>) -> f64) -> Soup {
    let n = cells + 1;
    let step = 2.0 / cells as f64;
    let place = |[x, y, z]: [usize; 3]| {
        Point3::new(x as f64 * step - 1.0, y as f64 * step - 1.0, z as f64 * step - 1.0)
    };
    let at = |[x, y, z]: [usize; 3]| (z * n + y) * n + x;
    let corners = |i: usize| [i % n, i / n % n, i / (n * n)];
    let values: Vec<f64> = (0..n * n * n).map(|i| inside(&place(corners(i)))).collect();
    let mut points = Vec::new();
    let mut vertex = vec![u32::MAX; values.len()];
    for (i, vertex) in vertex.iter_mut().enumerate() {
        let corner = corners(i);
        if corner.contains(&cells) {
            continue;
        }
        if let Some(p) = crossing(corner, |c| values[at(c)], place) {
            *vertex = points.len() as u32;
            points.push(p);
        }
    }
    let triangles = quads(n, &values, &vertex);
    Soup::new(points, triangles).compacted().0
}

/// Mean of the places where the surface crosses the edges of a cell.
fn crossing(
    [x, y, z]: [usize; 3],
    value: impl Fn([usize; 3]) -> f64,
    place: impl Fn([usize; 3]) -> Point3<f64>,
) -> Option<Point3<f64>> {
    let corner = |k: usize| [x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)];
    let (mut sum, mut count) = (Vector3::zeros(), 0.0);
    for a in 0..8 {
        for bit in [1, 2, 4] {
            let b = a | bit;
            let (va, vb) = (value(corner(a)), value(corner(b)));
            if a != b && (va < 0.0) != (vb < 0.0) {
                let t = va / (va - vb);
                sum += place(corner(a)).coords * (1.0 - t) + place(corner(b)).coords * t;
                count += 1.0;
            }
        }
    }
    (count > 0.0).then(|| Point3::from(sum / count))
}

/// Two triangles about each crossed edge that has four cells around it, outside up.
fn quads(n: usize, values: &[f64], vertex: &[u32]) -> Vec<[u32; 3]> {
    let strides = [1, n, n * n];
    let mut triangles = Vec::new();
    for i in 0..values.len() {
        let corner = [i % n, i / n % n, i / (n * n)];
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            if corner[axis] + 1 >= n || corner[u] == 0 || corner[v] == 0 {
                continue;
            }
            let (a, b) = (values[i] < 0.0, values[i + strides[axis]] < 0.0);
            if a == b {
                continue;
            }
            let (du, dv) = (strides[u], strides[v]);
            let [p, q, r, s] = [i - du - dv, i - dv, i, i - du].map(|cell| vertex[cell]);
            if [p, q, r, s].contains(&u32::MAX) {
                continue;
            }
            let quad = if a { [[p, q, r], [p, r, s]] } else { [[p, r, q], [p, s, r]] };
            triangles.extend(quad);
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero::mesh::{repair, topology};

    #[test]
    fn a_ball_is_closed_and_right_side_out() {
        let soup = surface(24, |p| p.coords.norm() - 0.7);
        let made = repair(&soup);
        assert!(made.report.is_clean());
        assert_eq!(topology::genus(&made.mesh), Some(0));
        assert!(soup.points.iter().all(|p| (p.coords.norm() - 0.7).abs() < 0.02));
        let [a, b, c] = soup.triangles[0].map(|v| soup.points[v as usize]);
        assert!((b - a).cross(&(c - a)).dot(&a.coords) > 0.0);
    }
}
