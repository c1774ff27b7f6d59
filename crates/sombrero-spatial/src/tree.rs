//! A bounding volume hierarchy over triangles, four children a node.
//!
//! ```text
//!            node 0                      slots: triangles in tree order, copied
//!        ┌────┬──┴─┬────┐                ┌────┬────┬────┬────┬────┬────┬─
//!      node 1 2    3    4   adjacent     │ 17 │  3 │ 40 │  - │  5 │  9 │ …
//!      ┌─┴─┬─ …                          └────┴────┴────┴────┴────┴────┴─
//!    leaf: four slots, each with its own box
//! ```
//!
//! Each node keeps the boxes of its *children*, coordinate by coordinate, so that four distances are
//! computed at once by vector instructions; a leaf's children are single triangles, which are culled by
//! their own boxes. Children lie next to each other and after their parent.
//!
//! Splits are at the median along the widest side of the centroids, so the shape of the tree depends on
//! nothing but the number of triangles: blocks of four slots are halved, and halved again. Sorting a
//! half is then independent of the other half and runs in parallel, the boxes are filled bottom-up by
//! the same code that [`refit`](crate::refit) runs later, and the depth is at most 16.
//! Cost: O(n log n) to build, O(n) to refit.

use nalgebra::Point3;

use crate::limits::corners;

/// Children of a node, and slots of a leaf.
pub(crate) const WIDTH: usize = 4;

/// The face of a slot that holds no triangle.
pub(crate) const NO_FACE: u32 = u32::MAX;

/// Triangles fewer than this are sorted by one thread.
const SERIAL: usize = 4096;

/// Boxes of four children and where these are.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    /// `low[axis][child]`; `∞` for a child that is absent or empty.
    pub(crate) low: [[f64; WIDTH]; 3],
    /// `high[axis][child]`; `-∞` for a child that is absent or empty.
    pub(crate) high: [[f64; WIDTH]; 3],
    /// The first child: a slot in a leaf, otherwise a node. The others follow it.
    pub(crate) first: u32,
    /// Whether the children are slots.
    pub(crate) leaf: bool,
    /// How many children there are.
    pub(crate) children: u8,
}

/// Nodes and slots.
#[derive(Debug, Clone)]
pub(crate) struct Tree {
    /// The root is first; empty without triangles.
    pub(crate) nodes: Vec<Node>,
    /// Corners by slot; NaN where there is no triangle.
    pub(crate) triangles: Vec<[Point3<f64>; 3]>,
    /// The face by slot, [`NO_FACE`] where there is none.
    pub(crate) faces: Vec<u32>,
}

impl Tree {
    /// The tree of `triangles`. Those without usable corners get a slot but an empty box.
    pub(crate) fn new(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let mut items = centroids(points, triangles);
        sort(&mut items);
        let faces: Vec<u32> = items.iter().map(|item| item.face).collect();
        let hole = [Point3::new(f64::NAN, f64::NAN, f64::NAN); 3];
        let mut tree = Self { nodes: nodes(faces.len() / WIDTH), triangles: vec![hole; faces.len()], faces };
        tree.refit(points, triangles);
        tree
    }
}

/// What the order of slots is made from: 16 bytes, so that sorting moves little memory.
#[derive(Debug, Clone, Copy)]
struct Item {
    /// Centroid relative to the bounding box of all centroids; NaN where there is no triangle.
    centroid: [f32; 3],
    face: u32,
}

/// One item a face, and items without a face up to a whole number of blocks.
fn centroids(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<Item> {
    let centroid = |&triangle: &[u32; 3]| {
        let nowhere = Point3::new(f64::NAN, f64::NAN, f64::NAN);
        corners(points, triangle).map_or(nowhere, |[a, b, c]| (a + b.coords + c.coords) / 3.0)
    };
    let all: Vec<Point3<f64>> = triangles.iter().map(centroid).collect();
    let bounds = sombrero_mesh::BoundingBox::of(all.iter().filter(|p| !p.x.is_nan()));
    let (origin, size) = bounds.map_or((Point3::origin(), 0.0), |b| (b.min, b.largest_side()));
    let scale = if size > 0.0 { 1.0 / size } else { 0.0 };
    let relative = |p: &Point3<f64>| [0, 1, 2].map(|axis| ((p[axis] - origin[axis]) * scale) as f32);
    let mut items: Vec<Item> =
        all.iter().zip(0..NO_FACE).map(|(p, face)| Item { centroid: relative(p), face }).collect();
    items.resize(items.len().next_multiple_of(WIDTH), Item { centroid: [f32::NAN; 3], face: NO_FACE });
    items
}

/// Where a run of `blocks` blocks is cut: shared by [`sort`] and [`nodes`].
fn half(blocks: usize) -> usize {
    blocks / 2
}

/// Puts items that are near each other into the same block.
fn sort(items: &mut [Item]) {
    let blocks = items.len() / WIDTH;
    if blocks < 2 {
        return;
    }
    let axis = widest_axis(items);
    let middle = half(blocks) * WIDTH;
    // NaN is last in the total order; equal centroids go by face.
    items.select_nth_unstable_by(middle, |a, b| {
        a.centroid[axis].total_cmp(&b.centroid[axis]).then(a.face.cmp(&b.face))
    });
    let (left, right) = items.split_at_mut(middle);
    if right.len() < SERIAL {
        sort(left);
        sort(right);
    } else {
        rayon::join(|| sort(left), || sort(right));
    }
}

fn widest_axis(items: &[Item]) -> usize {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for item in items {
        for axis in 0..3 {
            // A comparison with NaN is false.
            let x = item.centroid[axis];
            low[axis] = if x < low[axis] { x } else { low[axis] };
            high[axis] = if x > high[axis] { x } else { high[axis] };
        }
    }
    let side = |axis: usize| high[axis] - low[axis];
    (1..3).fold(0, |best, axis| if side(axis) > side(best) { axis } else { best })
}

/// The nodes over a run of blocks, boxes still empty.
fn nodes(blocks: usize) -> Vec<Node> {
    let empty = Node {
        low: [[f64::INFINITY; WIDTH]; 3],
        high: [[f64::NEG_INFINITY; WIDTH]; 3],
        first: 0,
        leaf: false,
        children: 0,
    };
    if blocks == 0 {
        return Vec::new();
    }
    let mut nodes = vec![empty.clone()];
    let mut open = vec![(0, 0, blocks)];
    while let Some((node, first_block, blocks)) = open.pop() {
        if blocks == 1 {
            let first = (first_block * WIDTH) as u32;
            nodes[node] = Node { first, leaf: true, children: WIDTH as u8, ..empty.clone() };
            continue;
        }
        let first = nodes.len();
        let mut start = first_block;
        for part in quarters(blocks) {
            if part > 0 {
                open.push((nodes.len(), start, part));
                nodes.push(empty.clone());
                start += part;
            }
        }
        nodes[node].first = first as u32;
        nodes[node].children = (nodes.len() - first) as u8;
    }
    nodes
}

/// The two halves of each half.
fn quarters(blocks: usize) -> [usize; 4] {
    let left = half(blocks);
    let right = blocks - left;
    [half(left), left - half(left), half(right), right - half(right)]
}
