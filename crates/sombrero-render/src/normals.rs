//! Normals for shading.
//!
//! A corner's normal is the sum of its neighbouring triangles' area vectors ½ (b - a) × (c - a), hence weighted by
//! area. With creases, only those neighbours count whose normal is within 55° of the corner's own triangle, so that
//! round parts look round and sharp edges stay sharp.

use nalgebra::Vector3;

/// How the surface is shaded between vertices.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Shading {
    /// Each triangle in one tone, as the facets are.
    Flat,
    /// Normals blend across all edges.
    Smooth,
    /// Normals blend except across edges sharper than 55°.
    #[default]
    Creased,
}

/// Cosine of 55°.
const CREASE: f64 = 0.573_576_436_351_046;

/// Corners with more triangles than this blend all of them: comparing each with each would take too long.
const LARGEST_FAN: usize = 64;

/// Unit normals of the three corners of each triangle; zero where there is no area. `triangles` index into `points`.
pub(crate) fn corner_normals(
    points: &[Vector3<f64>],
    triangles: &[[usize; 3]],
    shading: Shading,
) -> Vec<[Vector3<f64>; 3]> {
    let areas: Vec<_> = triangles.iter().map(|t| area_vector(points, t)).collect();
    match shading {
        Shading::Flat => areas.iter().map(|n| [unit_or_zero(n); 3]).collect(),
        Shading::Smooth => {
            let sums = vertex_sums(points.len(), triangles, &areas);
            triangles.iter().map(|t| t.map(|v| unit_or_zero(&sums[v]))).collect()
        }
        Shading::Creased => creased(points.len(), triangles, &areas),
    }
}

fn area_vector(points: &[Vector3<f64>], &[a, b, c]: &[usize; 3]) -> Vector3<f64> {
    (points[b] - points[a]).cross(&(points[c] - points[a])) * 0.5
}

fn vertex_sums(vertices: usize, triangles: &[[usize; 3]], areas: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut sums = vec![Vector3::zeros(); vertices];
    for (triangle, area) in triangles.iter().zip(areas) {
        triangle.iter().for_each(|&v| sums[v] += area);
    }
    sums
}

fn creased(vertices: usize, triangles: &[[usize; 3]], areas: &[Vector3<f64>]) -> Vec<[Vector3<f64>; 3]> {
    let sums = vertex_sums(vertices, triangles, areas);
    let fans = Fans::new(vertices, triangles);
    let units: Vec<_> = areas.iter().map(unit_or_zero).collect();
    let corner = |face: usize, vertex: usize| {
        let fan = fans.around(vertex);
        if fan.len() > LARGEST_FAN {
            return unit_or_zero(&sums[vertex]);
        }
        let near = fan.iter().filter(|&&other| units[other].dot(&units[face]) >= CREASE);
        unit_or_zero(&near.fold(Vector3::zeros(), |sum, &other| sum + areas[other]))
    };
    triangles.iter().enumerate().map(|(face, t)| t.map(|v| corner(face, v))).collect()
}

/// The triangles at each vertex: those of vertex v are `faces[starts[v]..starts[v + 1]]`.
struct Fans {
    starts: Vec<usize>,
    faces: Vec<usize>,
}

impl Fans {
    fn new(vertices: usize, triangles: &[[usize; 3]]) -> Self {
        let mut starts = vec![0; vertices + 1];
        triangles.iter().flatten().for_each(|&v| starts[v + 1] += 1);
        for v in 0..vertices {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut faces = vec![0; 3 * triangles.len()];
        for (face, triangle) in triangles.iter().enumerate() {
            for &v in triangle {
                faces[next[v]] = face;
                next[v] += 1;
            }
        }
        Self { starts, faces }
    }

    fn around(&self, vertex: usize) -> &[usize] {
        &self.faces[self.starts[vertex]..self.starts[vertex + 1]]
    }
}

/// The vector at length one, or zero where it has no direction. Tiny triangles keep theirs.
pub(crate) fn unit_or_zero(v: &Vector3<f64>) -> Vector3<f64> {
    let largest = v.amax();
    if !(largest > 0.0 && largest.is_finite()) {
        return Vector3::zeros();
    }
    let v = v / largest;
    v / v.norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles that share an edge along y, folded by the given slope.
    ///
    /// ```text
    ///   0---1---2     heights: 0 at 0 and 2, `rise` along 1-3
    ///    \  |  /
    ///     \ | /
    ///       3
    /// ```
    fn tent(rise: f64) -> (Vec<Vector3<f64>>, [[usize; 3]; 2]) {
        let points = [[-1.0, 1.0, 0.0], [0.0, 1.0, rise], [1.0, 1.0, 0.0], [0.0, 0.0, rise]];
        (points.map(Vector3::from).to_vec(), [[0, 3, 1], [1, 3, 2]])
    }

    #[test]
    fn flat_smooth_and_creased() {
        let (points, triangles) = tent(1.0);
        let s = 0.5_f64.sqrt();
        let left = Vector3::new(-s, 0.0, s);
        let close = |a: Vector3<f64>, b: Vector3<f64>| assert!((a - b).norm() < 1e-12, "{a} {b}");
        close(corner_normals(&points, &triangles, Shading::Flat)[0][1], left);
        close(corner_normals(&points, &triangles, Shading::Smooth)[0][1], Vector3::z());
        close(corner_normals(&points, &triangles, Shading::Creased)[0][1], left);
        let (points, triangles) = tent(0.1);
        close(corner_normals(&points, &triangles, Shading::Creased)[0][1], Vector3::z());
    }

    #[test]
    fn no_area_no_normal() {
        let points = vec![Vector3::zeros(); 3];
        for shading in [Shading::Flat, Shading::Smooth, Shading::Creased] {
            assert_eq!(corner_normals(&points, &[[0, 1, 2]], shading), [[Vector3::zeros(); 3]]);
        }
        assert!((unit_or_zero(&Vector3::new(1e-200, 0.0, 0.0)) - Vector3::x()).norm() < 1e-15);
    }
}
