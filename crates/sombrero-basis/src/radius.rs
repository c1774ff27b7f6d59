//! The radius function over a support (the paper, section 3):
//!
//!   r(v) = d(v, centre) / (d(v, centre) + d(v, B)),
//!
//! 0 at the centre, 1 on and outside the boundary B. Distances are lengths of shortest paths along mesh
//! edges inside the support, by two searches; all of B is one source.

use crate::support::{Edges, Support};

/// r at each interior vertex of `support`, in its order.
pub(crate) fn radii(support: &Support) -> Vec<f64> {
    let mut from_centre = vec![f64::INFINITY; support.interior.len()];
    from_centre[0] = 0.0;
    let to_centre = support.edges.shortest(from_centre);
    let to_boundary = support.edges.shortest(support.to_boundary.clone());
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

/// No more buckets than this at a time, whatever the lengths.
const MOST_BUCKETS: f64 = 64.0;

impl Edges {
    /// The length of the shortest path that ends in each vertex, when one of length `ways[v]` is known to begin with.
    ///
    /// Dijkstra's algorithm with buckets of about an edge's length in place of a priority queue (Meyer and Sanders
    /// 2003, Δ-stepping): a way may be followed before it is the shortest and again when it is. The answer is the
    /// same to the bit, since a longer way never becomes the shorter one by rounding.
    pub(crate) fn shortest(&self, mut ways: Vec<f64>) -> Vec<f64> {
        let lengths = || self.all.iter().map(|edge| edge.1);
        let longest = lengths().chain(ways.iter().copied().filter(|way| way.is_finite())).fold(0.0, f64::max);
        let mean = lengths().sum::<f64>() / self.all.len().max(1) as f64;
        let width = mean.max(longest / MOST_BUCKETS);
        let width = if width > 0.0 { width } else { 1.0 };
        let bucket = |way: f64| (way / width) as usize;
        // A way goes on by at most the longest edge, so buckets can be used again in turns.
        let mut buckets = vec![Vec::new(); bucket(longest) + 3];
        let turns = buckets.len();
        for (v, way) in (0u32..).zip(&ways).filter(|(_, way)| way.is_finite()) {
            buckets[bucket(*way) % turns].push(v);
        }
        let mut waiting: usize = buckets.iter().map(Vec::len).sum();
        let mut turn = 0;
        while waiting > 0 {
            while let Some(v) = buckets[turn % turns].pop() {
                waiting -= 1;
                let way = ways[v as usize];
                // Otherwise a shorter way was found since, and was followed from an earlier bucket.
                if bucket(way) == turn {
                    for &(w, length) in self.of(v as usize) {
                        let known = &mut ways[w as usize];
                        if way + length < *known {
                            *known = way + length;
                            buckets[bucket(*known) % turns].push(w);
                            waiting += 1;
                        }
                    }
                }
            }
            turn += 1;
        }
        ways
    }

    fn of(&self, v: usize) -> &[(u32, f64)] {
        let start = v.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.all[start..self.ends[v]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use petgraph::algo::dijkstra;
    use petgraph::graph::DiGraph;
    use proptest::prelude::*;

    /// Lengths of very different sizes, equal ones and zeros.
    fn length() -> impl Strategy<Value = f64> {
        prop_oneof![Just(0.0), Just(0.25), 0.0..1.0, 1e-6..1e-5, 1e3..1e4]
    }

    proptest! {
        #[test]
        fn distances_are_those_of_petgraph(
            edges in prop::collection::vec((0..12_u32, 0..12_u32, length()), 0..80),
            ways in prop::collection::vec(prop::option::of(length()), 12),
        ) {
            let mut sorted = edges.clone();
            sorted.sort_by_key(|edge| edge.0);
            let ours = Edges {
                ends: (0..12).map(|v| sorted.partition_point(|edge| edge.0 <= v)).collect(),
                all: sorted.iter().map(|&(_, to, length)| (to, length)).collect(),
            };
            let mut theirs = DiGraph::<(), f64>::new();
            let nodes: Vec<_> = (0..13).map(|_| theirs.add_node(())).collect();
            for &(from, to, length) in &edges {
                theirs.add_edge(nodes[from as usize], nodes[to as usize], length);
            }
            // A search of petgraph has one source: one from which the known ways lead.
            for (v, way) in ways.iter().enumerate() {
                if let Some(way) = way {
                    theirs.add_edge(nodes[12], nodes[v], *way);
                }
            }
            let expected = dijkstra(&theirs, nodes[12], None, |edge| *edge.weight());
            let known = ways.iter().map(|way| way.unwrap_or(f64::INFINITY)).collect();
            for (vertex, distance) in ours.shortest(known).into_iter().enumerate() {
                let expected = expected.get(&nodes[vertex]).copied().unwrap_or(f64::INFINITY);
                prop_assert_eq!(distance.to_bits(), expected.to_bits());
            }
        }
    }
}
