//! Area, centroid and second moments of a surface.
//!
//! For a triangle of area A with corners a, b, c and g = a + b + c,
//!
//! ```text
//! ∫ x dA = A g / 3,    ∫ x xᵀ dA = A (a aᵀ + b bᵀ + c cᵀ + g gᵀ) / 12,
//! ```
//!
//! exactly, so the sums belong to the surface and not to its tessellation: subdividing, reordering or
//! remeshing flat regions leaves them as they are.

use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};

/// Moments of a surface with area.
#[derive(Debug, Clone)]
pub(crate) struct Moments {
    pub(crate) area: f64,
    pub(crate) centroid: Point3<f64>,
    /// Root mean square distance of the surface from its centroid along each axis, descending.
    pub(crate) spreads: Vector3<f64>,
    /// The axes as columns, right-handed.
    pub(crate) axes: Matrix3<f64>,
}

impl Moments {
    /// Sums over all triangles, whose indices must be valid.
    pub(crate) fn new(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let mut area = 0.0;
        let mut first = Vector3::zeros();
        let mut second = Matrix3::zeros();
        for t in triangles {
            let [a, b, c] = t.map(|v| points[v as usize].coords);
            let share = (b - a).cross(&(c - a)).norm() / 2.0;
            let g = a + b + c;
            area += share;
            first += g * (share / 3.0);
            second += (a * a.transpose() + b * b.transpose() + c * c.transpose() + g * g.transpose())
                * (share / 12.0);
        }
        let per_area = if area > 0.0 { 1.0 / area } else { 0.0 };
        let centroid = first * per_area;
        let (spreads, axes) = principal(second * per_area - centroid * centroid.transpose());
        Self { area, centroid: Point3::from(centroid), spreads, axes }
    }

    /// Root mean square distance of the surface from its centroid.
    pub(crate) fn radius(&self) -> f64 {
        self.spreads.norm()
    }
}

/// Square roots of the eigenvalues in descending order, and the axes as a rotation matrix.
fn principal(covariance: Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let eigen = SymmetricEigen::new(covariance);
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    let spreads = Vector3::from(order.map(|i| eigen.eigenvalues[i].max(0.0).sqrt()));
    let [x, y] = [order[0], order[1]].map(|i| eigen.eigenvectors.column(i).into_owned());
    (spreads, Matrix3::from_columns(&[x, y, x.cross(&y)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_shapes as shapes;

    #[test]
    fn a_cube_is_known() {
        // [-1/2, 1/2]³ scaled to whatever the generator uses: compare with the sides.
        let cube = shapes::cube();
        let side = cube.bounding_box().unwrap().largest_side();
        let m = Moments::new(&cube.points, &cube.triangles);
        assert!((m.area - 6.0 * side * side).abs() < 1e-12 * m.area);
        // Along one axis: two faces at ±1/2 and four with the spread 1/12.
        let spread = side * ((2.0 / 4.0 + 4.0 / 12.0) / 6.0_f64).sqrt();
        assert!((m.spreads - Vector3::repeat(spread)).norm() < 1e-12 * side);
        assert!((m.axes.determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn subdivision_changes_nothing() {
        let soup = shapes::part(2);
        let mut points = soup.points.clone();
        let mut triangles = Vec::new();
        for t in &soup.triangles {
            let [a, b, c] = t.map(|v| soup.points[v as usize].coords);
            let centre = points.len() as u32;
            points.push(Point3::from((a + b + c) / 3.0));
            triangles.extend([[t[0], t[1], centre], [t[1], t[2], centre], [t[2], t[0], centre]]);
        }
        let (m, n) = (Moments::new(&soup.points, &soup.triangles), Moments::new(&points, &triangles));
        assert!((m.area - n.area).abs() < 1e-10 * m.area);
        assert!((m.centroid - n.centroid).norm() < 1e-10);
        assert!((m.spreads - n.spreads).norm() < 1e-10);
    }
}
