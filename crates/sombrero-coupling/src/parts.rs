//! Parts: triangles that hang together by edges.

use nalgebra::Point3;
use sombrero_mesh::{BoundingBox, Edges, connected, geometry};

/// The parts of a surface, largest area first.
#[derive(Debug, Clone)]
pub(crate) struct Parts {
    /// The part of each triangle: 0 is the largest.
    pub(crate) of_triangle: Vec<u32>,
    /// The largest part at each point; `u32::MAX` for a point without a triangle.
    pub(crate) of_point: Vec<u32>,
    /// The largest side of the largest part's box, in model units.
    pub(crate) side: f64,
    pub(crate) count: usize,
}

impl Parts {
    pub(crate) fn new(points: &[Point3<f64>], triangles: &[[u32; 3]], edges: &Edges) -> Self {
        // Triangles are connected through the first triangle on each of their edges.
        let mut first = vec![u32::MAX; edges.len()];
        let mut links = Vec::new();
        for (side, &edge) in (0..).zip(&edges.of_side) {
            let (face, first) = (side / 3, &mut first[edge as usize]);
            if *first == u32::MAX {
                *first = face;
            } else {
                links.push([*first, face]);
            }
        }
        let root = connected(triangles.len(), links);
        let mut area = vec![0.0; triangles.len()];
        for (corners, &root) in triangles.iter().zip(&root) {
            let [a, b, c] = corners.map(|v| &points[v as usize]);
            area[root as usize] += geometry::area_vector(a, b, c).norm();
        }
        let mut order: Vec<u32> = (0..triangles.len() as u32).filter(|&t| root[t as usize] == t).collect();
        order.sort_by(|&a, &b| area[b as usize].total_cmp(&area[a as usize]).then(a.cmp(&b)));
        let mut rank = vec![0; triangles.len()];
        (0..).zip(&order).for_each(|(place, &root)| rank[root as usize] = place);
        let of_triangle: Vec<u32> = root.iter().map(|&root| rank[root as usize]).collect();
        let mut of_point = vec![u32::MAX; points.len()];
        for (corners, &part) in triangles.iter().zip(&of_triangle) {
            corners.iter().for_each(|&v| of_point[v as usize] = of_point[v as usize].min(part));
        }
        let largest = (0..points.len()).filter(|&v| of_point[v] == 0).map(|v| &points[v]);
        let side = BoundingBox::of(largest).map_or(0.0, |b| b.largest_side());
        Self { of_triangle, of_point, side, count: order.len() }
    }
}
