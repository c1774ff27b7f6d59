//! What the surface looks like inside a cell, for each of the 256 ways in which its corners can lie inside.
//!
//! Nothing is tabulated. Go around each face of the cube, counter-clockwise seen from outside the cube: every run of
//! corners inside is entered over one edge and left over another, and the surface cuts the face between the two.
//! Where opposite corners are inside, each is cut off on its own. This depends on nothing but the face, so the
//! two cells beside it agree. An edge that is entered in one of its faces is left in the other: the cuts
//! chain up to closed polygons.
//!
//! A polygon is a fan of triangles from its first corner. The diagonals of the fan must not lie in a face of the
//! cube, where the neighbouring cell might have the same one; some corner to start from can always be found.

/// An edge of the cube: from `corner` along `axis`. Bits of a corner's number are its coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Crossing {
    pub(super) corner: usize,
    pub(super) axis: usize,
}

impl Crossing {
    fn between(p: usize, q: usize) -> Self {
        Self { corner: p & q, axis: (p ^ q).trailing_zeros() as usize }
    }

    /// Whether both edges are sides of one face: whether the four ends agree in a coordinate.
    fn shares_face(self, other: Self) -> bool {
        let [a, b] = [self, other].map(|c| [c.corner, c.corner | 1 << c.axis]);
        let ones = a[0] & a[1] & b[0] & b[1];
        let zeros = !(a[0] | a[1] | b[0] | b[1]) & 7;
        ones | zeros != 0
    }
}

/// The polygons of a case; bit i of `inside` tells whether corner i is. Seen from outside they are
/// counter-clockwise.
pub(super) fn polygons(inside: u8) -> Vec<Vec<Crossing>> {
    let mut cuts: Vec<[Crossing; 2]> = faces().flat_map(|face| cuts(face, inside)).collect();
    cuts.sort_unstable();
    let mut polygons = Vec::new();
    while let Some(&[first, mut at]) = cuts.first() {
        cuts.remove(0);
        let mut polygon = vec![first];
        while let Some(i) = cuts.iter().position(|cut| cut[0] == at) {
            polygon.push(at);
            at = cuts.remove(i)[1];
        }
        polygons.push(turned(polygon));
    }
    polygons
}

/// The corners of each face of the cube, counter-clockwise seen from outside.
fn faces() -> impl Iterator<Item = [usize; 4]> {
    (0..6).map(|f| {
        let (axis, side) = (f / 2, f % 2);
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let square = [0, u, u | v, v].map(|corner| corner | side << axis);
        if side == 1 { square } else { [square[3], square[2], square[1], square[0]] }
    })
}

/// From where the runs of inside corners of a face are entered to where they are left.
fn cuts(face: [usize; 4], inside: u8) -> Vec<[Crossing; 2]> {
    let is_inside = |k: usize| inside >> face[k % 4] & 1 == 1;
    let edge = |k: usize| Crossing::between(face[k % 4], face[(k + 1) % 4]);
    let leaves = |entered: usize| (entered + 1..).find(|&k| is_inside(k) && !is_inside(k + 1));
    let entered = (0..4).filter(|&k| !is_inside(k) && is_inside(k + 1));
    entered.filter_map(|k| leaves(k).map(|left| [edge(k), edge(left)])).collect()
}

/// The same polygon, from a corner whose fan has no diagonal in a face of the cube.
fn turned(mut polygon: Vec<Crossing>) -> Vec<Crossing> {
    for _ in 0..polygon.len() {
        let far = polygon.get(2..polygon.len() - 1).unwrap_or_default();
        if !far.iter().any(|c| c.shares_face(polygon[0])) {
            break;
        }
        polygon.rotate_left(1);
    }
    polygon
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_use_every_crossed_edge_once() {
        for inside in 0..=255u8 {
            let mut used: Vec<Crossing> = polygons(inside).concat();
            used.sort_unstable();
            let crossed = |c: &Crossing| (inside >> c.corner ^ inside >> (c.corner | 1 << c.axis)) & 1 == 1;
            let all = (0..8).flat_map(|corner| (0..3).map(move |axis| Crossing { corner, axis }));
            let edges = all.filter(|c| c.corner >> c.axis & 1 == 0);
            assert_eq!(used, edges.filter(crossed).collect::<Vec<_>>(), "case {inside:08b}");
        }
    }

    #[test]
    fn fans_stay_off_the_faces() {
        for polygon in (0..=255u8).flat_map(polygons) {
            assert!((3..=7).contains(&polygon.len()));
            assert!(!polygon[2..polygon.len() - 1].iter().any(|c| c.shares_face(polygon[0])), "{polygon:?}");
        }
    }

    #[test]
    fn a_single_corner_is_cut_off_facing_outwards() {
        let edge = |axis| Crossing { corner: 0, axis };
        assert_eq!(polygons(1), [[edge(0), edge(1), edge(2)]]);
        assert_eq!(polygons(0).len() + polygons(255).len(), 0);
        assert_eq!(polygons(0b1001_0110).len(), 4, "opposite corners of every face: four of them");
    }
}
