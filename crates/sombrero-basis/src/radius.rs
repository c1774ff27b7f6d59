//! The radius function over a support (the paper, section 3):
//!
//!   r(v) = d(v, centre) / (d(v, centre) + d(v, B)),
//!
//! 0 at the centre, 1 on and outside the boundary B. Distances are lengths of shortest paths along mesh
//! edges inside the support, by two searches with Dijkstra's algorithm; all of B is one source.

use crate::support::{Marks, NOWHERE, Support};
use nalgebra::Point3;
use petgraph::algo::dijkstra;
use petgraph::csr::Csr;
use sombrero_mesh::Mesh;

/// r at each interior vertex of `support`, in its order. `points` are those of the full mesh.
pub fn radii(mesh: &Mesh, points: &[Point3<f64>], support: &Support, marks: &mut Marks) -> Vec<f64> {
    let graph = inward_graph(mesh, points, support, marks);
    let inside = support.interior.len();
    let outside = (inside + support.boundary.len()) as u32;
    let distances = |from: u32| {
        let found = dijkstra(&graph, from, None, |edge| *edge.weight());
        (0..inside as u32).map(move |i| found.get(&i).copied().unwrap_or(f64::INFINITY))
    };
    distances(0)
        .zip(distances(outside))
        .map(|(to_centre, to_boundary)| ratio(to_centre, to_boundary))
        .collect()
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

/// Edges between interior vertices (both ways) and from the boundary inwards, weighted by length, with one
/// more node that is joined to all of the boundary at no cost: petgraph's search takes a single source.
fn inward_graph(mesh: &Mesh, points: &[Point3<f64>], support: &Support, marks: &mut Marks) -> Csr<(), f64> {
    let Support { interior, boundary } = support;
    let all = || interior.iter().chain(boundary);
    for (i, v) in (0u32..).zip(all()) {
        marks.place[v.index()] = i;
    }
    let inside = interior.len() as u32;
    let mut edges: Vec<(u32, u32, f64)> = Vec::with_capacity(7 * interior.len());
    for (i, &v) in (0u32..).zip(all()) {
        let begin = edges.len();
        for w in mesh.vertices_around_vertex(v) {
            let j = marks.place[w.index()];
            if j != NOWHERE && j < inside {
                edges.push((i, j, (points[w.index()] - points[v.index()]).norm()));
            }
        }
        edges[begin..].sort_unstable_by_key(|edge| edge.1);
    }
    let hub = inside + boundary.len() as u32;
    edges.extend((inside..hub).map(|b| (hub, b, 0.0)));
    all().for_each(|v| marks.place[v.index()] = NOWHERE);
    let mut graph = Csr::from_sorted_edges(&edges).unwrap_or_default();
    while graph.node_count() <= hub as usize {
        graph.add_node(());
    }
    graph
}
