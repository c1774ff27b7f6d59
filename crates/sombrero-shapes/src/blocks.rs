//! Surfaces of solids made of blocks: the boundary of a union of cells of a rectangular lattice.

use nalgebra::Point3;

use sombrero_mesh::Soup;

/// One axis of the lattice: block borders, and the finer ticks that cut each block.
pub(super) struct Axis {
    /// Tick positions; block `b` spans the ticks `first[b]..=first[b + 1]`.
    ticks: Vec<f64>,
    first: Vec<usize>,
}

impl Axis {
    /// Cuts the intervals between `borders` (ascending) into pieces about `step` long, at least one each.
    ///
    /// `grade` is the share by which the first piece of an interval is longer than the mean and the last one
    /// shorter: 0 gives equal pieces.
    pub(super) fn new(borders: &[f64], step: f64, grade: f64) -> Self {
        let mut axis = Self { ticks: Vec::new(), first: Vec::with_capacity(borders.len()) };
        for pair in borders.windows(2) {
            let length = pair[1] - pair[0];
            let pieces = ((length / step).round() as usize).max(1);
            axis.first.push(axis.ticks.len());
            for piece in 0..pieces {
                let t = piece as f64 / pieces as f64;
                axis.ticks.push(pair[0] + length * (t + grade * t * (1.0 - t)));
            }
        }
        axis.first.push(axis.ticks.len());
        axis.ticks.extend(borders.last());
        axis
    }

    fn blocks(&self) -> usize {
        self.first.len() - 1
    }

    /// The centre of a block along this axis.
    fn middle(&self, block: usize) -> f64 {
        (self.ticks[self.first[block]] + self.ticks[self.first[block + 1]]) / 2.0
    }
}

/// A lattice node as tick numbers along x, y and z.
type Node = [u32; 3];

/// The boundary of the union of the blocks whose centres are `solid`, each node moved by `place`.
///
/// It is manifold if no two solid blocks meet only along an edge or in a corner, and `place` may fold, round
/// or bevel the lattice as long as it stays one-to-one.
pub(super) fn boundary(
    axes: &[Axis; 3],
    solid: impl Fn(Point3<f64>) -> bool,
    place: impl Fn(Point3<f64>) -> Point3<f64>,
) -> Soup {
    let quads = exposed_quads(axes, &solid);
    let mut nodes: Vec<Node> = quads.iter().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    let tick = |axis: usize, n: u32| axes[axis].ticks[n as usize];
    let points: Vec<_> =
        nodes.iter().map(|n| place(Point3::new(tick(0, n[0]), tick(1, n[1]), tick(2, n[2])))).collect();
    // Every corner of a quad is among the nodes, so the search always succeeds.
    let number = |node: Node| nodes.binary_search(&node).unwrap_or_default() as u32;
    let mut triangles = Vec::with_capacity(2 * quads.len());
    for quad in &quads {
        let even = quad[0].iter().sum::<u32>() % 2 == 0;
        triangles.extend(split(&points, quad.map(number), even));
    }
    Soup::new(points, triangles)
}

/// The fine quads between solid and empty blocks, counter-clockwise seen from the empty side.
fn exposed_quads(axes: &[Axis; 3], solid: &impl Fn(Point3<f64>) -> bool) -> Vec<[Node; 4]> {
    let count = [0, 1, 2].map(|a| axes[a].blocks());
    let is_solid = |b: [usize; 3]| {
        // A block below zero wraps around to a huge number and so is outside as well.
        let inside = (0..3).all(|a| b[a] < count[a]);
        inside && solid(Point3::new(axes[0].middle(b[0]), axes[1].middle(b[1]), axes[2].middle(b[2])))
    };
    let mut quads = Vec::new();
    for x in 0..count[0] {
        for y in 0..count[1] {
            for z in (0..count[2]).filter(|z| is_solid([x, y, *z])) {
                for axis in 0..3 {
                    for up in [false, true] {
                        let mut beyond = [x, y, z];
                        beyond[axis] = if up { beyond[axis] + 1 } else { beyond[axis].wrapping_sub(1) };
                        if !is_solid(beyond) {
                            push_side(axes, [x, y, z], axis, up, &mut quads);
                        }
                    }
                }
            }
        }
    }
    quads
}

/// Adds the fine quads of one side of a block.
fn push_side(axes: &[Axis; 3], block: [usize; 3], axis: usize, up: bool, quads: &mut Vec<[Node; 4]>) {
    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
    let range = |a: usize| axes[a].first[block[a]]..axes[a].first[block[a] + 1];
    let level = axes[axis].first[block[axis] + usize::from(up)];
    for i in range(b) {
        for j in range(c) {
            let node = |di: usize, dj: usize| {
                let mut node = [0; 3];
                node[axis] = level as u32;
                node[b] = (i + di) as u32;
                node[c] = (j + dj) as u32;
                node
            };
            // Along the axis, b before c turns counter-clockwise.
            let (second, fourth) = if up { (node(1, 0), node(0, 1)) } else { (node(0, 1), node(1, 0)) };
            quads.push([node(0, 0), second, node(1, 1), fourth]);
        }
    }
}

/// Cuts a quad along the diagonal that leaves the fairer triangles; `even` settles draws.
fn split(points: &[Point3<f64>], [a, b, c, d]: [u32; 4], even: bool) -> [[u32; 3]; 2] {
    let one = [[a, b, c], [a, c, d]];
    let other = [[a, b, d], [b, c, d]];
    let worst = |pair: &[[u32; 3]; 2]| fairness(points, pair[0]).min(fairness(points, pair[1]));
    let gain = worst(&one) - worst(&other);
    // Rectangles are draws up to rounding: alternating keeps all diagonals from running one way.
    let first = if gain.abs() < 1e-6 { even } else { gain > 0.0 };
    if first { one } else { other }
}

/// Twice the area over the sum of squared sides: largest for an equilateral triangle, 0 for a degenerate one.
fn fairness(points: &[Point3<f64>], triangle: [u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|v| points[v as usize]);
    let (u, v, w) = (b - a, c - b, a - c);
    u.cross(&v).norm() / (u.norm_squared() + v.norm_squared() + w.norm_squared())
}
