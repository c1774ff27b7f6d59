//! The cells that triangles touch, and their corners.
//!
//! Cells and corners are numbered alike, x fastest: cell i has the corner i as its smallest. With at most 1031
//! corners along an axis, numbers fit into 32 bits. Both lists are sorted, which is all the structure needed:
//! the eight corners of the cells are eight walks through the list of corners.

use crate::error::{AttackError, MOST_FACES};
use nalgebra::{Point3, Vector3};

/// Cells are taken to be this much larger on each side, for rounding.
const SLACK: f64 = 1e-6;

pub(super) struct Band {
    /// Touched cells, ascending.
    cells: Vec<u32>,
    /// Corners of touched cells, ascending.
    corners: Vec<u32>,
    /// Steps of the numbers along the axes.
    strides: [u32; 3],
}

impl Band {
    /// The cells that `triangles` touch; a unit of length is a cell, and all lies within `sides` corners.
    pub(super) fn new(
        points: &[Point3<f64>],
        triangles: &[[u32; 3]],
        sides: [u32; 3],
    ) -> Result<Self, AttackError> {
        let strides = [1, sides[0], sides[0] * sides[1]];
        let mut touched = Touched { cells: Vec::new(), strides, unsorted_limit: MOST_FACES };
        for corners in triangles {
            touched.add(&corners.map(|v| points[v as usize]))?;
        }
        touched.tidy()?;
        let cells = touched.cells;
        let mut corners = cells.clone();
        for step in strides {
            corners.extend_from_within(..);
            let half = corners.len() / 2;
            corners[half..].iter_mut().for_each(|c| *c += step);
            corners.sort_unstable();
            corners.dedup();
        }
        Ok(Self { cells, corners, strides })
    }

    /// All corners, in order.
    pub(super) fn corner_points(&self) -> Vec<Point3<f64>> {
        (0..self.corners.len()).map(|i| self.corner_point(i)).collect()
    }

    /// Where the i-th corner is.
    pub(super) fn corner_point(&self, i: usize) -> Point3<f64> {
        let (number, [_, y, z]) = (self.corners[i], self.strides);
        Point3::new(f64::from(number % y), f64::from(number % z / y), f64::from(number / z))
    }

    /// Calls `visit` with the places of the corners of each cell in the list of corners.
    pub(super) fn each_cell(&self, mut visit: impl FnMut([usize; 8])) {
        let strides = self.strides;
        let offsets: [u32; 8] =
            std::array::from_fn(|i| (0..3).map(|k| (i as u32 >> k & 1) * strides[k]).sum());
        let mut places = [0; 8];
        for &cell in &self.cells {
            for (place, offset) in places.iter_mut().zip(offsets) {
                while self.corners[*place] < cell + offset {
                    *place += 1;
                }
            }
            visit(places);
        }
    }
}

/// Cells found so far, some of them more than once.
struct Touched {
    cells: Vec<u32>,
    strides: [u32; 3],
    unsorted_limit: usize,
}

/// A block of cells: its smallest cell, and how many there are along each axis.
type Block = ([u32; 3], [u32; 3]);

impl Touched {
    fn add(&mut self, triangle: &[Point3<f64>; 3]) -> Result<(), AttackError> {
        let [a, b, c] = triangle;
        let (low, high) = (a.inf(b).inf(c), a.sup(b).sup(c));
        let first = [0, 1, 2].map(|k| (low[k] - SLACK) as u32);
        let count = [0, 1, 2].map(|k| (high[k] + SLACK) as u32 - first[k] + 1);
        self.within(triangle, (first, count));
        if self.cells.len() > self.unsorted_limit { self.tidy() } else { Ok(()) }
    }

    /// Halves a block until its cells are touched one by one.
    fn within(&mut self, triangle: &[Point3<f64>; 3], (first, count): Block) {
        if !touches(triangle, (first, count)) {
            return;
        }
        let longest =
            if count[0] >= count[1].max(count[2]) { 0 } else { 1 + usize::from(count[2] > count[1]) };
        if count[longest] == 1 {
            self.cells.push((0..3).map(|k| first[k] * self.strides[k]).sum());
            return;
        }
        let (mut near, mut far, mut middle) = (count, count, first);
        near[longest] = count[longest] / 2;
        far[longest] -= near[longest];
        middle[longest] += near[longest];
        self.within(triangle, (first, near));
        self.within(triangle, (middle, far));
    }

    fn tidy(&mut self) -> Result<(), AttackError> {
        self.cells.sort_unstable();
        self.cells.dedup();
        self.unsorted_limit = self.cells.len() + MOST_FACES;
        if self.cells.len() > MOST_FACES { Err(AttackError::TooManyFaces) } else { Ok(()) }
    }
}

/// Whether a triangle and a block have a point in common: none of the 13 axes that could part them does
/// (Akenine-Möller 2001).
fn touches(triangle: &[Point3<f64>; 3], (first, count): Block) -> bool {
    let half = Vector3::from(count.map(f64::from)) / 2.0;
    let centre = Point3::from(first.map(f64::from)) + half;
    let half = half.add_scalar(SLACK);
    let [a, b, c] = triangle.map(|p| p - centre);
    let parts = |axis: Vector3<f64>| {
        let [x, y, z] = [a, b, c].map(|p| p.dot(&axis));
        let reach = half.dot(&axis.abs());
        x.min(y).min(z) > reach || x.max(y).max(z) < -reach
    };
    let sides = [b - a, c - b, a - c];
    let units = [Vector3::x(), Vector3::y(), Vector3::z()];
    let crossed = || sides.iter().flat_map(|side| units.iter().map(move |unit| unit.cross(side)));
    !(units.iter().any(|unit| parts(*unit)) || parts(sides[0].cross(&sides[1])) || crossed().any(parts))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point3<f64>> {
        [1.0..9.0, 1.0..9.0, 1.0..9.0].prop_map(Point3::from)
    }

    proptest! {
        #[test]
        fn a_band_holds_every_point_of_its_triangles(a in point(), b in point(), c in point(), u in 0.0..1.0, v in 0.0..1.0) {
            let band = Band::new(&[a, b, c], &[[0, 1, 2]], [11; 3]).unwrap();
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let p: Point3<f64> = a + (b - a) * u + (c - a) * v;
            let cell = p.x as u32 + 11 * (p.y as u32) + 121 * (p.z as u32);
            prop_assert!(band.cells.binary_search(&cell).is_ok());
            band.each_cell(|corners| {
                let places = corners.map(|i| band.corner_point(i));
                for (i, place) in places.iter().enumerate() {
                    let offset = Vector3::new(i & 1, i >> 1 & 1, i >> 2 & 1).map(|x| x as f64);
                    assert_eq!(*place, places[0] + offset);
                }
            });
        }

        #[test]
        fn cells_of_a_band_are_near(a in point(), b in point(), c in point()) {
            let band = Band::new(&[a, b, c], &[[0, 1, 2]], [11; 3]).unwrap();
            let surface = sombrero_spatial::Surface::new(&[a, b, c], &[[0, 1, 2]]);
            for &cell in &band.cells {
                let centre = Point3::new(cell % 11, cell / 11 % 11, cell / 121).map(|x| f64::from(x) + 0.5);
                prop_assert!(surface.closest(&centre).unwrap().distance() <= 0.75f64.sqrt() + 1e-5);
            }
        }
    }
}
