//! Pairs of points that are close to each other, each within its own reach.
//!
//! Points are sorted into the cells of a grid, one grid for each order of magnitude of a reach. Cells are many times as
//! wide as the reach, so that a ball around a point hardly ever leaves its cell. Cost: O(n log n).

use nalgebra::Point3;
use std::ops::Range;

/// Widths of cells, in reaches.
const CELL: f64 = 32.0;

/// Coordinates of cells beyond this are not told apart by an `f64`.
const FARTHEST: f64 = 1e15;

/// Two points and the square of their distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pair {
    pub(crate) squared_distance: f64,
    /// The smaller number first.
    pub(crate) ends: [u32; 2],
}

/// All pairs that are at most `reach` of one of the two apart, nearest first, equally near ones by number. Points whose
/// reach is not above 0 or that are not finite reach nothing.
pub(crate) fn close_pairs(points: &[Point3<f64>], reach: &[f64]) -> Vec<Pair> {
    let mut levels: Vec<i32> = reach.iter().copied().filter_map(level).collect();
    levels.sort_unstable();
    levels.dedup();
    let mut pairs = Vec::new();
    for of_grid in levels {
        let grid = Grid::new(points, CELL * width(of_grid));
        for (i, p) in (0..).zip(points) {
            let reach = reach[i as usize];
            if level(reach) == Some(of_grid) {
                grid.around(p, reach, |j| {
                    let squared_distance = (points[j as usize] - p).norm_squared();
                    if i != j && squared_distance <= reach * reach {
                        pairs.push(Pair { squared_distance, ends: [i.min(j), i.max(j)] });
                    }
                });
            }
        }
    }
    pairs
        .sort_unstable_by(|a, b| a.squared_distance.total_cmp(&b.squared_distance).then(a.ends.cmp(&b.ends)));
    pairs.dedup();
    pairs
}

/// The power of 16 that a reach is at most, as an exponent of 2.
fn level(reach: f64) -> Option<i32> {
    let usable = reach >= f64::MIN_POSITIVE && reach.is_finite();
    // The exponent of a float, rounded up.
    usable.then(|| (((reach.to_bits() >> 52) & 0x7ff) as i32 - 1022).next_multiple_of_signed(4))
}

/// The largest reach of a level.
fn width(level: i32) -> f64 {
    let step = if level < 0 { 0.0625 } else { 16.0 };
    (0..level.abs() / 4).fold(1.0, |width, _| width * step)
}

trait NextMultiple {
    fn next_multiple_of_signed(self, of: Self) -> Self;
}

impl NextMultiple for i32 {
    fn next_multiple_of_signed(self, of: Self) -> Self {
        self + (of - self.rem_euclid(of)).rem_euclid(of)
    }
}

/// Points by cell.
struct Grid {
    width: f64,
    /// In the order of cells, then of points.
    sorted: Vec<([i64; 3], u32)>,
}

impl Grid {
    fn new(points: &[Point3<f64>], width: f64) -> Self {
        let mut sorted: Vec<([i64; 3], u32)> =
            points.iter().zip(0..).filter_map(|(p, i)| Some((cell(p, width)?, i))).collect();
        sorted.sort_unstable();
        Self { width, sorted }
    }

    /// Calls `found` with each point in a cell that the ball around `p` touches, and some others.
    fn around(&self, p: &Point3<f64>, reach: f64, mut found: impl FnMut(u32)) {
        let corner = |sign: f64| cell(&p.map(|x| x + sign * reach), self.width);
        let (Some(low), Some(high)) = (corner(-1.0), corner(1.0)) else { return };
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                // Cells along z lie one after the other.
                let run = self.run([x, y, low[2]], [x, y, high[2]]);
                self.sorted[run].iter().for_each(|(_, point)| found(*point));
            }
        }
    }

    fn run(&self, first: [i64; 3], last: [i64; 3]) -> Range<usize> {
        let start = self.sorted.partition_point(|(cell, _)| *cell < first);
        let count = self.sorted[start..].iter().take_while(|(cell, _)| *cell <= last).count();
        start..start + count
    }
}

fn cell(p: &Point3<f64>, width: f64) -> Option<[i64; 3]> {
    let at = p.map(|x| (x / width).floor());
    at.iter().all(|x| x.abs() < FARTHEST).then(|| [at.x as i64, at.y as i64, at.z as i64])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![
            6 => (-3i32..=3).prop_map(f64::from),
            6 => -1.0..1.0,
            3 => (-3i32..=3).prop_map(|x| f64::from(x) * 1e-7),
            1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY)],
        ]
    }

    proptest! {
        #[test]
        fn agrees_with_brute_force(
            points in prop::collection::vec(([coordinate(), coordinate(), coordinate()],
                prop_oneof![Just(0.0), Just(f64::NAN), 1e-9..1e-6, 1e-3..1.0]), 0..60)
        ) {
            let reach: Vec<f64> = points.iter().map(|(_, r)| *r).collect();
            let points: Vec<Point3<f64>> = points.iter().map(|(p, _)| Point3::from(*p)).collect();
            let mut expected = Vec::new();
            for j in 0..points.len() {
                for i in 0..j {
                    let distance = (points[i] - points[j]).norm_squared();
                    if distance <= reach[i] * reach[i] || distance <= reach[j] * reach[j] {
                        expected.push((distance, [i as u32, j as u32]));
                    }
                }
            }
            expected.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let found: Vec<_> = close_pairs(&points, &reach).iter().map(|p| (p.squared_distance, p.ends)).collect();
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn levels_hold_what_they_say() {
        for reach in [1e-300, 1e-9, 0.9, 1.0, 1.1, 15.9, 16.0, 17.0, 1e200] {
            let level = level(reach).unwrap();
            assert!(reach <= width(level) && width(level) <= 256.0 * reach, "{reach} {level}");
        }
        assert_eq!([0.0, -1.0, f64::NAN, f64::INFINITY].map(level), [None; 4]);
    }
}
