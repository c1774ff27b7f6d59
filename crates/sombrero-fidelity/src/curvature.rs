//! The curvature that balls about vertices see.
//!
//! The curvature tensor of a mesh, averaged over a ball of radius r about a vertex (Cohen-Steiner and Morvan 2003, as Alliez
//! et al. 2003 use it), is
//!
//! ```text
//! T = 1/(π r²) Σ over edges of β |e ∩ ball| ē ēᵀ,
//! ```
//!
//! β the dihedral angle at the edge, ē its direction. Within the tangent plane its eigenvalues k₁, k₂ are the principal
//! curvatures. What MSDM2 compares is their mean size, with H = (k₁ + k₂)/2 and D = (k₁ - k₂)/2:
//!
//! ```text
//! (|k₁| + |k₂|)/2 = max(|H|, |D|).
//! ```

use crate::Change;
use crate::net::{Net, Walker};
use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;
use sombrero_mesh::Edges;

/// Vertices that one task looks at.
const CHUNK: usize = 512;

/// One side of a change, as curvature sees it.
pub(crate) struct Bent<'a> {
    points: &'a [Point3<f64>],
    /// Of the vertices.
    normals: Vec<Vector3<f64>>,
    /// The dihedral angle at each edge; 0 at rims, and where more than two faces meet.
    bends: Vec<f64>,
}

impl<'a> Bent<'a> {
    pub(crate) fn new(change: &Change<'a>, side: usize, edges: &Edges) -> Self {
        let points = change.sides()[side];
        // Hinges are in the order of edges.
        let mut hinges = change.hinges.iter().zip(&change.angles[side]).peekable();
        let bend = |ends: &[u32; 2]| {
            let (_, angle) = hinges.next_if(|(hinge, _)| hinge.ends == *ends)?;
            *angle
        };
        let bends = edges.ends.iter().map(bend).map(|angle| angle.unwrap_or(0.0)).collect();
        Self { points, normals: change.vertex_normals(side), bends }
    }

    /// (|k₁| + |k₂|)/2 in balls of `radius` about `vertices`, over one unit of length.
    pub(crate) fn curvatures(&self, net: &Net, vertices: &[u32], radius: f64) -> Vec<f64> {
        let at = |walker: &mut Walker<'_>, v: &u32| self.curvature(walker, *v, radius);
        vertices.par_iter().with_min_len(CHUNK).map_init(|| Walker::new(net), at).collect()
    }

    fn curvature(&self, walker: &mut Walker<'_>, vertex: u32, radius: f64) -> f64 {
        let points = |v: u32| self.points[v as usize];
        let mut tensor = Matrix3::zeros();
        walker.ball(points, vertex, radius, |piece| {
            let bend = self.bends[piece.edge as usize];
            let along = points(piece.to) - points(piece.from);
            let length = along.norm();
            if bend != 0.0 && length > 0.0 {
                tensor += along * along.transpose() * (bend * piece.share / length);
            }
        });
        mean_size(&tensor, &self.normals[vertex as usize]) / (std::f64::consts::PI * radius * radius)
    }
}

/// (|k₁| + |k₂|)/2 of a tensor within the plane perpendicular to `normal`.
fn mean_size(tensor: &Matrix3<f64>, normal: &Vector3<f64>) -> f64 {
    // The axis that is least along the normal gives a good first tangent.
    let mut axis = Vector3::zeros();
    axis[normal.iamin()] = 1.0;
    let Some(s) = normal.cross(&axis).try_normalize(0.0) else { return 0.0 };
    let t = normal.cross(&s);
    let (a, b, c) = (s.dot(&(tensor * s)), s.dot(&(tensor * t)), t.dot(&(tensor * t)));
    let (mean, difference) = ((a + c) / 2.0, (a - c) / 2.0);
    mean.abs().max((difference * difference + b * b).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_shapes as shapes;

    fn curvatures(soup: &sombrero_mesh::Soup, radius: f64) -> Vec<f64> {
        let edges = Edges::new(soup.points.len(), &soup.triangles);
        let net = Net::new(soup.points.len(), &edges.ends);
        let change = Change::new(&soup.points, &soup.points, &soup.triangles);
        let all: Vec<u32> = (0..soup.points.len() as u32).collect();
        Bent::new(&change, 0, &edges).curvatures(&net, &all, radius)
    }

    #[test]
    fn a_sphere_is_curved_evenly() {
        // Unit sphere: k₁ = k₂ = 1. The ball of radius r cuts a cap of area π r² out of it.
        for k in curvatures(&shapes::sphere(5), 0.3) {
            assert!((k - 1.0).abs() < 0.1, "{k}");
        }
    }

    #[test]
    fn a_crease_is_curved_across() {
        // At the middle of an edge of a cube, a crease of length 2 r bends by π/2: k₁ = 2 r π/2 / (π r²), k₂ = 0.
        let cube = shapes::cube();
        let [a, b] = [cube.points[0], cube.points[1]];
        assert_eq!((a - b).iter().filter(|x| **x != 0.0).count(), 1, "0 and 1 share an edge");
        let middle = nalgebra::center(&a, &b);
        let mut points = cube.points.clone();
        points.push(middle);
        let split = |t: &[u32; 3]| -> Vec<[u32; 3]> {
            match (0..3).find(|&k| !t.contains(&0) || !t.contains(&1) || ![0, 1].contains(&t[k])) {
                Some(k) if t.contains(&0) && t.contains(&1) => {
                    let [apex, p, q] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
                    vec![[apex, p, 8], [apex, 8, q]]
                }
                _ => vec![*t],
            }
        };
        let triangles = cube.triangles.iter().flat_map(split).collect();
        let radius = 0.1;
        let k = curvatures(&sombrero_mesh::Soup::new(points, triangles), radius)[8];
        assert!((k - 0.5 / radius).abs() < 1e-12, "{k}");
    }

    #[test]
    fn sizes_of_eigenvalues() {
        let normal = Vector3::new(1.0, -2.0, 0.5).normalize();
        let s = normal.cross(&Vector3::x()).normalize();
        let t = normal.cross(&s);
        for [k1, k2] in [[3.0, 1.0], [3.0, -1.0], [-3.0, -3.0], [2.0, 0.0]] {
            let tensor = s * s.transpose() * k1 + t * t.transpose() * k2 + normal * normal.transpose() * 9.0;
            let expected = (f64::abs(k1) + f64::abs(k2)) / 2.0;
            assert!((mean_size(&tensor, &normal) - expected).abs() < 1e-12);
        }
        assert_eq!(mean_size(&Matrix3::identity(), &Vector3::zeros()), 0.0);
    }
}
