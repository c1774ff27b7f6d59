//! A graph in space, and what of it lies in a ball about one of its vertices.

use crate::evenly::evenly;
use nalgebra::Point3;
use sombrero_mesh::Edges;

/// Vertices with their neighbours.
#[derive(Debug, Clone)]
pub(crate) struct Net {
    starts: Vec<u32>,
    /// The neighbour, and the edge to it.
    all: Vec<(u32, u32)>,
}

impl Net {
    /// The graph of edges, numbered as they come.
    pub(crate) fn new(vertices: usize, ends: &[[u32; 2]]) -> Self {
        let mut starts = vec![0u32; vertices + 1];
        ends.iter().flatten().for_each(|&v| starts[v as usize + 1] += 1);
        (0..vertices).for_each(|v| starts[v + 1] += starts[v]);
        let mut fill = starts.clone();
        let mut all = vec![(0, 0); 2 * ends.len()];
        for (edge, &[a, b]) in (0u32..).zip(ends) {
            for (from, to) in [(a, b), (b, a)] {
                let slot = &mut fill[from as usize];
                all[*slot as usize] = (to, edge);
                *slot += 1;
            }
        }
        Self { starts, all }
    }

    pub(crate) fn around(&self, vertex: u32) -> &[(u32, u32)] {
        let [start, end] = [0, 1].map(|k| self.starts[vertex as usize + k] as usize);
        &self.all[start..end]
    }

    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }
}

/// At most `most` of the vertices that have an edge, and the graph in which two are neighbours when the parts of the mesh
/// that are nearest to them, by the number of edges, touch. All of them, with the edges of the mesh, when there are no more.
pub(crate) fn thinned(net: &Net, edges: &Edges, most: usize) -> (Vec<u32>, Net) {
    let used = (0..net.len() as u32).filter(|v| !net.around(*v).is_empty());
    let used: Vec<u32> = used.collect();
    let sites: Vec<u32> = evenly(used.len(), most).map(|i| used[i]).collect();
    let owner = owners(net, &sites);
    let between = |&[a, b]: &[u32; 2]| {
        let [a, b] = [a, b].map(|v| owner[v as usize]);
        (a != b && a != u32::MAX && b != u32::MAX).then_some([a.min(b), a.max(b)])
    };
    let mut ends: Vec<[u32; 2]> = edges.ends.iter().filter_map(between).collect();
    ends.sort_unstable();
    ends.dedup();
    let net = Net::new(sites.len(), &ends);
    (sites, net)
}

/// The site that is fewest edges away from each vertex; `u32::MAX` where none can be reached.
fn owners(net: &Net, sites: &[u32]) -> Vec<u32> {
    let mut owner = vec![u32::MAX; net.len()];
    (0..).zip(sites).for_each(|(i, &v)| owner[v as usize] = i);
    let mut queue = sites.to_vec();
    let mut next = 0;
    while next < queue.len() {
        let v = queue[next];
        next += 1;
        for &(w, _) in net.around(v) {
            if owner[w as usize] == u32::MAX {
                owner[w as usize] = owner[v as usize];
                queue.push(w);
            }
        }
    }
    owner
}

/// A piece of an edge within a ball, from one of its ends inwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    pub(crate) from: u32,
    pub(crate) to: u32,
    pub(crate) edge: u32,
    /// How much of the edge lies within: 1 when both ends do.
    pub(crate) share: f64,
}

/// Looks around vertices of a net.
#[derive(Debug)]
pub(crate) struct Walker<'a> {
    net: &'a Net,
    /// In which round a vertex was last found inside.
    found: Vec<u32>,
    round: u32,
    /// The vertices of the last ball, the centre first.
    pub(crate) inside: Vec<u32>,
}

impl<'a> Walker<'a> {
    pub(crate) fn new(net: &'a Net) -> Self {
        Self { net, found: vec![0; net.len()], round: 0, inside: Vec::new() }
    }

    /// Visits what hangs together with `centre` inside the ball: each edge once, as far as it is inside. Those that are
    /// inside with both ends come from the end of the lower number.
    pub(crate) fn ball(
        &mut self,
        points: impl Fn(u32) -> Point3<f64>,
        centre: u32,
        radius: f64,
        mut visit: impl FnMut(Piece),
    ) {
        self.round += 1;
        self.inside.clear();
        self.inside.push(centre);
        self.found[centre as usize] = self.round;
        let middle = points(centre);
        let mut next = 0;
        while next < self.inside.len() {
            let from = self.inside[next];
            next += 1;
            let start = points(from) - middle;
            for &(to, edge) in self.net.around(from) {
                let end = points(to) - middle;
                if end.norm_squared() > radius * radius {
                    // |start + t (end - start)| = radius
                    let along = end - start;
                    let (a, b) = (along.norm_squared(), along.dot(&start));
                    let c = start.norm_squared() - radius * radius;
                    let share = ((b * b - a * c).max(0.0).sqrt() - b) / a;
                    visit(Piece { from, to, edge, share: share.clamp(0.0, 1.0) });
                    continue;
                }
                if self.found[to as usize] != self.round {
                    self.found[to as usize] = self.round;
                    self.inside.push(to);
                }
                if from < to {
                    visit(Piece { from, to, edge, share: 1.0 });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_shapes as shapes;

    #[test]
    fn a_ball_on_a_chain() {
        // 0 - 1 - 2 - 3 one apart, and 4 beside 2, not joined.
        let points =
            [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [3., 0., 0.], [2., 0.1, 0.]].map(Point3::from);
        let net = Net::new(5, &[[0, 1], [1, 2], [2, 3]]);
        let mut walker = Walker::new(&net);
        let mut pieces = Vec::new();
        walker.ball(|v| points[v as usize], 2, 1.25, |piece| pieces.push(piece));
        let mut inside = walker.inside.clone();
        inside.sort_unstable();
        assert_eq!(inside, [1, 2, 3]);
        pieces.sort_unstable_by_key(|piece| piece.edge);
        let piece = |from, to, edge, share| Piece { from, to, edge, share };
        assert_eq!(pieces, [piece(1, 0, 0, 0.25), piece(1, 2, 1, 1.0), piece(2, 3, 2, 1.0)]);
    }

    #[test]
    fn thinning_keeps_what_hangs_together() {
        let soup = shapes::torus(40, 30, 1.0, 0.4);
        let edges = Edges::new(soup.points.len(), &soup.triangles);
        let net = Net::new(soup.points.len(), &edges.ends);
        let (sites, all) = thinned(&net, &edges, 10_000);
        assert_eq!(sites, (0..1200).collect::<Vec<u32>>());
        assert!((0..1200).all(|v| all.around(v).len() == net.around(v).len()));
        let (sites, few) = thinned(&net, &edges, 100);
        assert!(sites.len().abs_diff(100) <= 2, "{}", sites.len());
        assert!(owners(&few, &[0]).iter().all(|owner| *owner == 0));
    }
}
