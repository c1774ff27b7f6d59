//! Which triangle is seen where: a z-buffer.
//!
//! A sample (x, y) lies in a triangle when its barycentric coordinates
//!
//! ```text
//! λᵢ(x, y) = aᵢ x + bᵢ y + cᵢ,   λ₀ + λ₁ + λ₂ = 1
//! ```
//!
//! are not negative. Nearness interpolates linearly with them; the nearest triangle wins, of equals the first in the
//! list. Only the winner's index is stored, and shading comes later, once per visible sample. Cost: the samples in
//! the bounding boxes of the triangles.

use crate::camera::Projected;

/// No triangle.
pub(crate) const NONE: u32 = u32::MAX;

/// A sample this far outside an edge still counts: neighbours must not leave a gap through rounding.
const EDGE_SLACK: f64 = -1e-9;

/// A triangle in the picture.
#[derive(Debug, Clone)]
pub(crate) struct Facet {
    /// Coefficients of the barycentric coordinates.
    lambda: [[f64; 3]; 3],
    nearness: [f64; 3],
    weight: [f64; 3],
    /// Length in samples by which λᵢ falls from 1 to 0.
    pub(crate) heights: [f64; 3],
    /// Whether the corners run counter-clockwise in the picture, as seen from outside.
    pub(crate) front: bool,
    /// Columns from, to, rows from, to; ends not included.
    bounds: [usize; 4],
}

impl Facet {
    /// From corners whose x and y are in samples, y downwards; `None` when it has no area or no sample inside.
    pub(crate) fn new(corners: &[Projected; 3], width: usize, height: usize) -> Option<Self> {
        let [p, q, r] = corners;
        let doubled = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
        if !doubled.is_finite() || doubled == 0.0 {
            return None;
        }
        // λ of a corner is the area of the triangle that the sample forms with the opposite edge.
        let line = |from: &Projected, to: &Projected| {
            let (a, b) = ((from.y - to.y) / doubled, (to.x - from.x) / doubled);
            [a, b, -(a * from.x + b * from.y)]
        };
        let lambda = [line(q, r), line(r, p), line(p, q)];
        if !lambda.iter().flatten().all(|c| c.is_finite()) {
            return None;
        }
        let [left, right] = span(corners.map(|c| c.x), width);
        let [top, bottom] = span(corners.map(|c| c.y), height);
        if left >= right || top >= bottom {
            return None;
        }
        Some(Self {
            lambda,
            nearness: corners.map(|c| c.nearness),
            weight: corners.map(|c| c.weight),
            heights: lambda.map(|[a, b, _]| 1.0 / (a * a + b * b).sqrt()),
            // Rows run downwards, which turns the sense around.
            front: doubled < 0.0,
            bounds: [left, right, top, bottom],
        })
    }

    /// Barycentric coordinates in the picture.
    pub(crate) fn lambda(&self, x: f64, y: f64) -> [f64; 3] {
        self.lambda.map(|[a, b, c]| a * x + b * y + c)
    }

    /// Barycentric coordinates in space, perspective undone, for a λ of [`lambda`](Self::lambda).
    pub(crate) fn in_space(&self, lambda: &[f64; 3]) -> [f64; 3] {
        let parts: [f64; 3] = std::array::from_fn(|i| lambda[i] * self.weight[i]);
        let sum = parts[0] + parts[1] + parts[2];
        parts.map(|part| part / sum)
    }
}

/// First sample and the one after the last whose centre lies between the smallest and the largest value.
fn span(values: [f64; 3], count: usize) -> [usize; 2] {
    let low = values[0].min(values[1]).min(values[2]);
    let high = values[0].max(values[1]).max(values[2]);
    // Casts saturate; negative values become 0.
    [(low - 0.5).ceil() as usize, ((high - 0.5).floor() + 1.0).max(0.0).min(count as f64) as usize]
}

/// The winner at each sample.
pub(crate) struct Buffer {
    width: usize,
    nearness: Vec<f64>,
    winner: Vec<u32>,
}

impl Buffer {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let samples = width * height;
        Self { width, nearness: vec![f64::NEG_INFINITY; samples], winner: vec![NONE; samples] }
    }

    /// Draws a triangle under the given index.
    pub(crate) fn draw(&mut self, facet: &Facet, index: u32) {
        let [left, right, top, bottom] = facet.bounds;
        let [l0, l1, l2] = facet.lambda;
        let [n0, n1, n2] = facet.nearness;
        for row in top..bottom {
            let y = row as f64 + 0.5;
            let [r0, r1, r2] = [l0, l1, l2].map(|[_, b, c]| b * y + c);
            let start = row * self.width;
            let nearness = &mut self.nearness[start + left..start + right];
            let winner = &mut self.winner[start + left..start + right];
            for (column, (best, winner)) in nearness.iter_mut().zip(winner).enumerate() {
                let x = (left + column) as f64 + 0.5;
                let (a, b, c) = (l0[0] * x + r0, l1[0] * x + r1, l2[0] * x + r2);
                if a >= EDGE_SLACK && b >= EDGE_SLACK && c >= EDGE_SLACK {
                    let here = a * n0 + b * n1 + c * n2;
                    if here > *best {
                        (*best, *winner) = (here, index);
                    }
                }
            }
        }
    }

    /// Index of the triangle seen at a sample, or [`NONE`].
    pub(crate) fn winner(&self, column: usize, row: usize) -> u32 {
        self.winner[row * self.width + column]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64, nearness: f64) -> Projected {
        Projected { x, y, nearness, weight: 1.0 }
    }

    fn count(buffer: &Buffer, index: u32) -> usize {
        buffer.winner.iter().filter(|w| **w == index).count()
    }

    #[test]
    fn two_halves_fill_a_square_without_gaps() {
        let (a, b, c, d) = (at(1.0, 1.0, 0.0), at(9.0, 1.0, 0.0), at(9.0, 9.0, 0.0), at(1.0, 9.0, 0.0));
        let mut buffer = Buffer::new(10, 10);
        buffer.draw(&Facet::new(&[a, b, c], 10, 10).unwrap(), 0);
        buffer.draw(&Facet::new(&[a, c, d], 10, 10).unwrap(), 1);
        // The diagonal's eight samples belong to the first triangle.
        assert_eq!([count(&buffer, 0), count(&buffer, 1), count(&buffer, NONE)], [36, 28, 36]);
    }

    #[test]
    fn the_nearest_wins_in_any_order() {
        let big = |nearness| [at(0.0, 0.0, nearness), at(0.0, 20.0, nearness), at(20.0, 0.0, nearness)];
        for (first, second) in [(1.0, 2.0), (2.0, 1.0)] {
            let mut buffer = Buffer::new(8, 8);
            buffer.draw(&Facet::new(&big(first), 8, 8).unwrap(), 0);
            buffer.draw(&Facet::new(&big(second), 8, 8).unwrap(), 1);
            assert_eq!(buffer.winner(3, 3), u32::from(second > first));
        }
    }

    #[test]
    fn barycentric_coordinates_and_perspective() {
        let mut corners = [at(0.0, 0.0, 0.0), at(0.0, 10.0, 0.0), at(10.0, 0.0, 0.0)];
        let facet = Facet::new(&corners, 10, 10).unwrap();
        assert!(facet.front);
        assert_eq!(facet.lambda(0.0, 10.0), [0.0, 1.0, 0.0]);
        assert!((facet.heights[1] - 10.0).abs() < 1e-12);
        // Half way in the picture is nearer to the far end in space: weights 1 : 1/3 give 3/4 to the near one.
        corners[1].weight = 1.0 / 3.0;
        let facet = Facet::new(&corners, 10, 10).unwrap();
        let [near, far, _] = facet.in_space(&facet.lambda(0.0, 5.0));
        assert!((near - 0.75).abs() < 1e-12 && (far - 0.25).abs() < 1e-12);
    }

    #[test]
    fn nothing_to_draw() {
        let none = |corners: [Projected; 3]| assert!(Facet::new(&corners, 10, 10).is_none());
        none([at(0.0, 0.0, 0.0), at(1.0, 1.0, 0.0), at(2.0, 2.0, 0.0)]);
        none([at(20.0, 0.0, 0.0), at(30.0, 0.0, 0.0), at(20.0, 9.0, 0.0)]);
        none([at(-9.0, 0.0, 0.0), at(-3.0, 0.0, 0.0), at(-9.0, 9.0, 0.0)]);
        none([at(0.0, f64::MAX, 0.0), at(f64::MAX, 0.0, 0.0), at(-f64::MAX, 0.0, 0.0)]);
        none([at(3.1, 3.1, 0.0), at(3.2, 3.1, 0.0), at(3.1, 3.2, 0.0)]);
    }
}
