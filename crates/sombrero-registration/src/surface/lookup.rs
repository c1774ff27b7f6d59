//! The nearest sample of a surface, by table.
//!
//! Judging thousands of poses asks for millions of nearest points, none of which needs to be exact. Space
//! around the surface is cut into cells, and each holds the sample nearest to it. The table is filled as in
//! Danielsson's distance transform (1980, `danielsson1980`): cells with a sample know it; two sweeps, there and
//! back, hand on the best of the neighbours' samples. The answer is a nearest sample of the cell's centre up
//! to about the size of a cell. A look-up is one access to memory.

use nalgebra::{Point3, Vector3};

use crate::surface::sample::{Sample, samples};
use crate::surface::shape::Shape;

/// Side of a cell in units of the diagonal.
const CELL: f64 = 1.0 / 80.0;
/// Width of the space around the bounding box that the table covers.
const MARGIN: f64 = 0.1;
/// Samples of the surface.
const SAMPLES: usize = 8_000;
/// A cell that no sample has reached yet.
const NONE: u16 = u16::MAX;

/// A table over the unit frame of one surface.
#[derive(Debug, Clone)]
pub(crate) struct Lookup {
    low: Point3<f64>,
    counts: [usize; 3],
    nearest: Vec<u16>,
    samples: Vec<Sample>,
}

impl Lookup {
    pub(crate) fn new(shape: &Shape) -> Self {
        Self::of_samples(samples(shape, SAMPLES).into_iter().map(Sample::with_unit_normal).collect())
    }

    /// The table of at most [`SAMPLES`] samples with normals of length 1, in a space of about size 1.
    pub(crate) fn of_samples(samples: Vec<Sample>) -> Self {
        let mut low = Point3::from(Vector3::repeat(f64::INFINITY));
        let mut high = -low;
        for sample in &samples {
            low = low.inf(&sample.point);
            high = high.sup(&sample.point);
        }
        low -= Vector3::repeat(MARGIN);
        high += Vector3::repeat(MARGIN);
        let counts = [0, 1, 2].map(|k| ((high[k] - low[k]) / CELL) as usize + 1);
        let mut table = Self { low, counts, nearest: vec![NONE; counts.iter().product()], samples };
        table.seed();
        table.sweep();
        table
    }

    /// The sample nearest to `p`, about; `None` far from the surface.
    #[inline]
    pub(crate) fn nearest(&self, p: &Point3<f64>) -> Option<&Sample> {
        let cell = self.cell(p)?;
        self.samples.get(usize::from(self.nearest[cell]))
    }

    #[inline]
    fn cell(&self, p: &Point3<f64>) -> Option<usize> {
        let place = (p - self.low) / CELL;
        let [nx, ny, nz] = self.counts;
        let inside = |x: f64, n: usize| x >= 0.0 && x < n as f64;
        (inside(place.x, nx) && inside(place.y, ny) && inside(place.z, nz))
            .then(|| (place.z as usize * ny + place.y as usize) * nx + place.x as usize)
    }

    fn centre(&self, [x, y, z]: [usize; 3]) -> Point3<f64> {
        self.low + Vector3::new(x as f64 + 0.5, y as f64 + 0.5, z as f64 + 0.5) * CELL
    }

    /// Cells with samples get the one nearest to their centre.
    fn seed(&mut self) {
        for index in 0..self.samples.len() {
            let point = self.samples[index].point;
            let Some(cell) = self.cell(&point) else { continue };
            let [nx, ny, _] = self.counts;
            let centre = self.centre([cell % nx, cell / nx % ny, cell / (nx * ny)]);
            self.nearest[cell] = self.nearer(&centre, self.nearest[cell], [index as u16]);
        }
    }

    /// The first of these samples of which none is nearer to `centre`.
    #[inline]
    fn nearer(&self, centre: &Point3<f64>, first: u16, others: impl IntoIterator<Item = u16>) -> u16 {
        let distance = |s: u16| {
            self.samples.get(usize::from(s)).map_or(f64::INFINITY, |s| (s.point - centre).norm_squared())
        };
        let (mut best, mut least, mut last) = (first, distance(first), first);
        for other in others {
            // Neighbours mostly hold the same.
            if other == last || other == best {
                continue;
            }
            last = other;
            let apart = distance(other);
            if apart < least {
                (best, least) = (other, apart);
            }
        }
        best
    }

    /// Forwards along x, y, z from the 13 neighbours that come before a cell, then backwards from the others.
    fn sweep(&mut self) {
        let [nx, ny, nz] = self.counts;
        for sign in [1, -1] {
            let order = |count: usize| (0..count).map(move |i| if sign > 0 { i } else { count - 1 - i });
            let steps = EARLIER.map(|[x, y, z]| sign * ((z * ny as isize + y) * nx as isize + x));
            for z in order(nz) {
                for y in order(ny) {
                    for x in order(nx) {
                        let cell = (z * ny + y) * nx + x;
                        let centre = self.centre([x, y, z]);
                        let held = self.nearest[cell];
                        let inside = [(x, nx), (y, ny), (z, nz)].iter().all(|&(i, n)| i > 0 && i + 1 < n);
                        self.nearest[cell] = if inside {
                            let at = |step: isize| self.nearest[cell.wrapping_add_signed(step)];
                            self.nearer(&centre, held, steps.map(at))
                        } else {
                            let others = within([x, y, z], self.counts, sign);
                            self.nearer(&centre, held, others.map(|other| self.nearest[other]))
                        };
                    }
                }
            }
        }
    }
}

/// Where the neighbours of a cell are, of 26, that come before it: the first 13 of the 27 offsets in order.
const EARLIER: [[isize; 3]; 13] = {
    let mut offsets = [[0; 3]; 13];
    let mut k = 0;
    while k < 13 {
        let number = k as isize;
        offsets[k] = [number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1];
        k += 1;
    }
    offsets
};

/// Those of them that there are, of a cell at the border, and with `sign` -1 those that come after it.
fn within(at: [usize; 3], counts: [usize; 3], sign: isize) -> impl Iterator<Item = usize> {
    EARLIER.iter().filter_map(move |offset| {
        let mut place = [0; 3];
        for axis in 0..3 {
            place[axis] = at[axis].checked_add_signed(sign * offset[axis]).filter(|x| *x < counts[axis])?;
        }
        Some((place[2] * counts[1] + place[1]) * counts[0] + place[0])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Side;
    use sombrero_shapes as shapes;

    #[test]
    fn nearly_the_nearest_everywhere() {
        let soup = shapes::part(3);
        let shape = Shape::new(Side::Reference, &soup.points, &soup.triangles).unwrap();
        let table = Lookup::new(&shape);
        for i in 0..300 {
            let p = Point3::from([0.754, 0.569, 0.331].map(|step| (f64::from(i) * step).fract() - 0.5));
            let exact = table.samples.iter().map(|s| (s.point - p).norm()).fold(f64::INFINITY, f64::min);
            match table.nearest(&p) {
                Some(found) => assert!((found.point - p).norm() < exact + 2.0 * CELL),
                None => assert!(exact > MARGIN - 2.0 * CELL),
            }
        }
        assert!(table.nearest(&Point3::new(f64::NAN, 0.0, 0.0)).is_none());
    }
}
