//! Points that are one point but for rounding.

use crate::pairs::{Pair, close_pairs};
use nalgebra::Point3;
use sombrero_mesh::{Edges, connected, geometry};

/// Differences of rounding, in sizes of the model.
const ROUNDING: f64 = 1e-6;

/// Two corners of a cube of one step are a little less than this apart, in steps.
const DIAGONAL: f64 = 1.8;

/// A point does not reach further than this share of the triangles around it: what is small is not rounding.
const SHARE: f64 = 0.1;

/// Points of a group are at most so many reaches apart.
const WIDEST: f64 = 2.0;

/// How far each point reaches for others that may be the same: a millionth of the model, or one step of the grid that it
/// was rounded to (`steps`, in model units; empty when it is small), but never more than a tenth of the longest side of
/// any triangle around it.
pub fn reach(points: &[Point3<f64>], triangles: &[[u32; 3]], steps: &[f32]) -> Vec<f64> {
    let rounding = ROUNDING * size(points, triangles);
    let mut reach: Vec<f64> = (0..points.len())
        .map(|v| rounding.max(DIAGONAL * steps.get(v).copied().map_or(0.0, f64::from)))
        .collect();
    for corners in triangles {
        let longest = geometry::longest_side(&corners.map(|v| points[v as usize]));
        corners.iter().for_each(|&v| reach[v as usize] = reach[v as usize].min(SHARE * longest));
    }
    reach
}

/// The largest side of the box around all corners but the outermost fiftieth on each side, so that a stray triangle does
/// not count.
fn size(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> f64 {
    let corners = || {
        triangles.iter().flatten().map(|&v| points[v as usize]).filter(|p| p.iter().all(|x| x.is_finite()))
    };
    let side = |axis: usize| {
        let mut all: Vec<f64> = corners().map(|p| p[axis]).collect();
        let Some(last) = all.len().checked_sub(1) else { return 0.0 };
        let cut = last / 50;
        let low = *all.select_nth_unstable_by(cut, f64::total_cmp).1;
        let high = *all.select_nth_unstable_by(last - cut, f64::total_cmp).1;
        high - low
    };
    (0..3).map(side).fold(0.0, f64::max)
}

/// For each point the first of those that it is one with; `None` when each is alone, as in most meshes.
///
/// Two points are joined when they are within the [`reach`] of one of them and of all triangles around both, nearest ones
/// first, unless
///
/// - a triangle has both, or has points that were joined with them,
/// - a group would become wider than two reaches: chains of points do not run together,
/// - both are inside one surface, where nothing is open that could be closed.
///
/// ```
/// use nalgebra::Point3;
/// use sombrero_coupling::{join, reach};
///
/// // Two triangles with an edge in common, but for rounding.
/// let points = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1e-7, 0.], [1., 1., 0.], [0., 1., 1e-7]].map(Point3::from);
/// let triangles = [[0, 1, 2], [3, 4, 5]];
/// let reach = reach(&points, &triangles, &[]);
/// assert_eq!(join(&points, &triangles, &reach), Some(vec![0, 1, 2, 1, 4, 2]));
/// ```
///
/// # Panics
/// When a corner is not below the number of points, or `reach` is shorter.
pub fn join(points: &[Point3<f64>], triangles: &[[u32; 3]], reach: &[f64]) -> Option<Vec<u32>> {
    let mut pairs = close_pairs(points, reach);
    if pairs.is_empty() {
        return None;
    }
    let guard = guards(points, triangles);
    pairs.retain(|pair| pair.ends.iter().all(|&v| pair.squared_distance <= square(guard[v as usize])));
    let surfaces = Surfaces::new(points.len(), triangles);
    pairs.retain(|pair| !surfaces.inside_one(pair.ends));
    if pairs.is_empty() {
        return None;
    }
    let mut groups = Groups::new(points, triangles);
    for pair in &pairs {
        groups.join(pair, reach);
    }
    let leaders: Vec<u32> = groups.leader;
    (0..).zip(&leaders).any(|(v, &leader)| v != leader).then_some(leaders)
}

fn square(x: f64) -> f64 {
    x * x
}

/// What a point must not reach beyond, whoever reaches for it.
fn guards(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<f64> {
    // A step beyond all limits leaves the limit of the triangles.
    reach(points, triangles, &vec![f32::INFINITY; points.len()])
}

/// Which points are inside a surface, and of which.
struct Surfaces {
    /// Whether some edge at the point has one side, or it has none.
    open: Vec<bool>,
    of_point: Vec<u32>,
}

impl Surfaces {
    fn new(count: usize, triangles: &[[u32; 3]]) -> Self {
        let edges = Edges::new(count, triangles);
        let mut open = vec![true; count];
        triangles.iter().flatten().for_each(|&v| open[v as usize] = false);
        for (ends, sides) in edges.ends.iter().zip(&edges.sides) {
            if *sides == 1 {
                ends.iter().for_each(|&v| open[v as usize] = true);
            }
        }
        Self { open, of_point: connected(count, edges.ends.iter().copied()) }
    }

    fn inside_one(&self, [a, b]: [u32; 2]) -> bool {
        let [a, b] = [a as usize, b as usize];
        !self.open[a] && !self.open[b] && self.of_point[a] == self.of_point[b]
    }
}

/// Points that were joined so far.
struct Groups<'a> {
    points: &'a [Point3<f64>],
    /// The smallest number in each point's group.
    leader: Vec<u32>,
    /// The others of a group, by leader.
    followers: std::collections::BTreeMap<u32, Vec<u32>>,
    /// The points that share a triangle with those that are close to another.
    triangles: &'a [[u32; 3]],
    around: Vec<Vec<u32>>,
}

impl<'a> Groups<'a> {
    fn new(points: &'a [Point3<f64>], triangles: &'a [[u32; 3]]) -> Self {
        let mut around = vec![Vec::new(); points.len()];
        for (face, corners) in (0..).zip(triangles) {
            corners.iter().for_each(|&v| around[v as usize].push(face));
        }
        let leader = (0..points.len() as u32).collect();
        Self { points, leader, followers: std::collections::BTreeMap::new(), triangles, around }
    }

    fn members(&self, leader: u32) -> impl Iterator<Item = u32> + '_ {
        std::iter::once(leader).chain(self.followers.get(&leader).into_iter().flatten().copied())
    }

    fn join(&mut self, pair: &Pair, reach: &[f64]) {
        let [a, b] = pair.ends.map(|v| self.leader[v as usize]);
        if a == b || self.share_a_triangle(a, b) {
            return;
        }
        let longest = pair.ends.map(|v| reach[v as usize]);
        let widest = square(WIDEST * longest[0].max(longest[1]));
        let apart = |v: u32, u: u32| (self.points[v as usize] - self.points[u as usize]).norm_squared();
        if self.members(a).any(|v| self.members(b).any(|u| apart(v, u) > widest)) {
            return;
        }
        let (first, second) = (a.min(b), a.max(b));
        let joined: Vec<u32> = self.members(second).collect();
        self.followers.remove(&second);
        joined.iter().for_each(|&v| self.leader[v as usize] = first);
        self.followers.entry(first).or_default().extend(joined);
    }

    fn share_a_triangle(&self, a: u32, b: u32) -> bool {
        let mut corners = self
            .members(a)
            .flat_map(|v| &self.around[v as usize])
            .flat_map(|&face| self.triangles[face as usize]);
        corners.any(|v| self.leader[v as usize] == b)
    }
}
