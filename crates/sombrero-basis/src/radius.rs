//! The radius function over a support (the paper, section 3):
//!
//!   r(v) = d(v, centre) / (d(v, centre) + d(v, B)),
//!
//! 0 at the centre, 1 on and outside the boundary B. Distances are lengths of shortest paths along mesh
//! edges inside the support, by two searches with Dijkstra's algorithm; all of B is one source.

use crate::support::{Marks, NOWHERE, Support};
use nalgebra::Point3;
use sombrero_mesh::Mesh;
use sombrero_progressive::Queue;

/// r at each interior vertex of `support`, in its order. `points` are those of the full mesh.
pub fn radii(mesh: &Mesh, points: &[Point3<f64>], support: &Support, marks: &mut Marks) -> Vec<f64> {
    let graph = Graph::new(mesh, points, support, marks);
    let inside = support.interior.len();
    let to_centre = graph.distances(inside, 0..1);
    let to_boundary = graph.distances(inside, inside..inside + support.boundary.len());
    to_centre.into_iter().zip(to_boundary).map(|(centre, boundary)| ratio(centre, boundary)).collect()
}

fn ratio(to_centre: f64, to_boundary: f64) -> f64 {
    if to_centre == 0.0 {
        0.0
    } else if to_boundary == f64::INFINITY || to_centre == f64::INFINITY {
        // Cannot be reached inside: treated as boundary, so that nothing moves.
        1.0
    } else {
        to_centre / (to_centre + to_boundary)
    }
}

/// The edges that lead to interior vertices, from others of them and from the boundary, with their lengths. Vertices
/// have the numbers of their places in the support, interior first: a support may be a small part of a large mesh.
struct Graph {
    /// Where the edges of each vertex begin, and where those of the last end.
    starts: Vec<usize>,
    edges: Vec<(u32, f64)>,
}

impl Graph {
    fn new(mesh: &Mesh, points: &[Point3<f64>], support: &Support, marks: &mut Marks) -> Self {
        let Support { interior, boundary } = support;
        let all = || interior.iter().chain(boundary);
        for (i, v) in (0u32..).zip(interior) {
            marks.place[v.index()] = i;
        }
        let mut starts = Vec::with_capacity(interior.len() + boundary.len() + 1);
        let mut edges = Vec::with_capacity(7 * interior.len());
        for &v in all() {
            starts.push(edges.len());
            for w in mesh.vertices_around_vertex(v) {
                let place = marks.place[w.index()];
                if place != NOWHERE {
                    edges.push((place, (points[w.index()] - points[v.index()]).norm()));
                }
            }
        }
        starts.push(edges.len());
        interior.iter().for_each(|v| marks.place[v.index()] = NOWHERE);
        Self { starts, edges }
    }

    /// The length of the shortest path from any of `sources` to each of the first `inside` vertices.
    fn distances(&self, inside: usize, sources: std::ops::Range<usize>) -> Vec<f64> {
        let mut distances = vec![f64::INFINITY; inside];
        let mut queue = Queue::new(inside);
        for source in sources {
            if let Some(own) = distances.get_mut(source) {
                *own = 0.0;
            }
            self.relax(source, 0.0, &mut distances, &mut queue);
        }
        while let Some(vertex) = queue.pop() {
            self.relax(vertex, distances[vertex], &mut distances, &mut queue);
        }
        distances
    }

    /// Shortens the ways to the neighbours of a vertex at this distance.
    fn relax(&self, vertex: usize, distance: f64, distances: &mut [f64], queue: &mut Queue) {
        for &(neighbour, length) in &self.edges[self.starts[vertex]..self.starts[vertex + 1]] {
            let way = distance + length;
            let known = &mut distances[neighbour as usize];
            if way < *known {
                *known = way;
                queue.set(neighbour as usize, way);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use petgraph::algo::dijkstra;
    use petgraph::graph::DiGraph;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn distances_are_those_of_petgraph(
            edges in prop::collection::vec((0..20_u32, 0..12_u32, 0.0..1.0f64), 0..80), sources in 0..2_usize
        ) {
            // Twelve vertices inside, eight on the boundary.
            let sources = [0..1, 12..20][sources].clone();
            let mut sorted = edges.clone();
            sorted.sort_by_key(|edge| edge.0);
            let graph = Graph {
                starts: (0..=20).map(|v| sorted.partition_point(|edge| edge.0 < v)).collect(),
                edges: sorted.iter().map(|&(_, to, length)| (to, length)).collect(),
            };
            let mut theirs = DiGraph::<(), f64>::new();
            let nodes: Vec<_> = (0..21).map(|_| theirs.add_node(())).collect();
            for &(from, to, length) in &edges {
                theirs.add_edge(nodes[from as usize], nodes[to as usize], length);
            }
            // A search of petgraph has one source: one that is joined to all of ours at no cost.
            for source in sources.clone() {
                theirs.add_edge(nodes[20], nodes[source], 0.0);
            }
            let expected = dijkstra(&theirs, nodes[20], None, |edge| *edge.weight());
            for (vertex, distance) in graph.distances(12, sources).into_iter().enumerate() {
                let expected = expected.get(&nodes[vertex]).copied().unwrap_or(f64::INFINITY);
                prop_assert_eq!(distance.to_bits(), expected.to_bits());
            }
        }
    }
}
