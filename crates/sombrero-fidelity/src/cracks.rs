//! Cracks: how far points that met come apart.
//!
//! Places that were nearer to each other than the tolerance are one group, and so are groups with places in common. A group is
//! found by cells of a grid as wide as the tolerance: places in one cell, or in cells that touch, met. So those within the
//! tolerance always did, and two that are 2√3 tolerances apart never did by themselves.

use nalgebra::Point3;
use sombrero_mesh::BoundingBox;

/// Points nearer than this share of the diagonal meet, unless another tolerance is given.
pub const MEETING: f64 = 1e-6;

/// The width of larger groups is taken between two places that are far apart, not searched for among all pairs.
const ALL_PAIRS: usize = 64;

/// Cells along the diagonal that indices have room for.
const MOST_CELLS: f64 = 1e15;

/// Points in the world, before and after: one for each place where a stored vertex is shown.
#[derive(Debug, Clone, Copy)]
pub struct Places<'a> {
    before: &'a [Point3<f64>],
    after: &'a [Point3<f64>],
    tolerance: f64,
}

impl<'a> Places<'a> {
    /// Places of which those nearer than [`MEETING`] of the diagonal met. What the longer slice has more is left out.
    pub fn new(before: &'a [Point3<f64>], after: &'a [Point3<f64>]) -> Self {
        let finite = before.iter().filter(|p| is_finite(p));
        let diagonal = BoundingBox::of(finite).map_or(0.0, |b| b.diagonal());
        Self { before, after, tolerance: MEETING * diagonal }
    }

    /// The same with another tolerance, in model units.
    #[must_use]
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }
}

/// The widest crack, in model units.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct Cracks {
    /// The longest distance between places that meet, before: 0 when none do.
    pub before: f64,
    /// And between the same places after.
    pub after: f64,
}

/// The widest crack between places that met. Groups of more than 64 places are measured from the place that is farthest
/// from their first one, which may fall short by half. O(n log n).
pub fn cracks(places: &Places<'_>) -> Cracks {
    let groups = groups(places);
    let widest = |points: &[Point3<f64>]| groups.iter().map(|group| width(points, group)).fold(0.0, f64::max);
    Cracks { before: widest(places.before), after: widest(places.after) }
}

fn is_finite(p: &Point3<f64>) -> bool {
    p.iter().all(|x| x.is_finite())
}

/// The longest distance between two of a group.
fn width(points: &[Point3<f64>], group: &[u32]) -> f64 {
    let at = |i: &u32| points[*i as usize];
    let from = |p: Point3<f64>| group.iter().map(move |i| (at(i) - p).norm());
    if group.len() <= ALL_PAIRS {
        return group.iter().map(|i| from(at(i)).fold(0.0, f64::max)).fold(0.0, f64::max);
    }
    let farthest = from(at(&group[0]))
        .zip(group)
        .fold((0.0, group[0]), |best, (d, i)| if d > best.0 { (d, *i) } else { best });
    from(at(&farthest.1)).fold(0.0, f64::max)
}

type Cell = [i64; 3];

/// Places that met, at least two each.
fn groups(places: &Places<'_>) -> Vec<Vec<u32>> {
    let Places { before, after, tolerance } = *places;
    let there = |(p, q): (&Point3<f64>, &Point3<f64>)| is_finite(p) && is_finite(q);
    let origin = BoundingBox::of(before.iter().filter(|p| is_finite(p)));
    let Some(BoundingBox { min, max }) = origin else { return Vec::new() };
    // Without a tolerance cells are as small as they can be.
    let width = tolerance.max((max - min).amax() / MOST_CELLS).max(f64::MIN_POSITIVE);
    let cell = |p: &Point3<f64>| [0, 1, 2].map(|axis| ((p[axis] - min[axis]) / width) as i64);
    let mut keyed: Vec<(Cell, u32)> = (0..)
        .zip(before.iter().zip(after))
        .filter(|(_, pair)| there(*pair))
        .map(|(i, (p, _))| (cell(p), i))
        .collect();
    keyed.sort_unstable();
    let occupied: Vec<&[(Cell, u32)]> = keyed.chunk_by(|a, b| a.0 == b.0).collect();
    let cells: Vec<Cell> = occupied.iter().map(|places| places[0].0).collect();
    let mut joined: Vec<(u32, u32)> = roots(&cells)
        .into_iter()
        .zip(&occupied)
        .flat_map(|(r, same)| same.iter().map(move |s| (r, s.1)))
        .collect();
    joined.sort_unstable();
    let several = joined.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1);
    several.map(|group| group.iter().map(|(_, i)| *i).collect()).collect()
}

/// For each cell, which are in order, the first of those that it hangs together with.
fn roots(cells: &[Cell]) -> Vec<u32> {
    /// The rows of neighbours that come later, each of so many cells to both sides of the middle, but for the own row.
    const ROWS: [[i64; 2]; 4] = [[0, 1], [1, -1], [1, 0], [1, 1]];
    let mut parent: Vec<u32> = (0..cells.len() as u32).collect();
    let mut join = |a: usize, b: usize| {
        let [a, b] = [a, b].map(|i| root(&mut parent, i as u32));
        parent[a.max(b) as usize] = a.min(b);
    };
    for i in 1..cells.len() {
        let ([x, y, z], next) = (cells[i - 1], cells[i]);
        if next == [x, y, z + 1] {
            join(i - 1, i);
        }
    }
    for [dx, dy] in ROWS {
        // Rows are in order as cells are: where one begins moves on only.
        let mut start = 0;
        for (i, [x, y, z]) in cells.iter().enumerate() {
            let [first, last] = [z - 1, z + 1].map(|z| [x + dx, y + dy, z]);
            while cells.get(start).is_some_and(|c| *c < first) {
                start += 1;
            }
            let row = cells[start..].iter().take_while(|c| **c <= last);
            row.enumerate().for_each(|(k, _)| join(i, start + k));
        }
    }
    (0..cells.len() as u32).map(|i| root(&mut parent, i)).collect()
}

fn root(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    fn on_line(x: &[f64]) -> Vec<Point3<f64>> {
        x.iter().map(|x| Point3::new(*x, 0.0, 0.0)).collect()
    }

    #[test]
    fn a_split_seam() {
        // Two sheets that share the seam x = 1; in the world its copies differ by 4e-8.
        let before = on_line(&[0.0, 1.0, 1.0 + 4e-8, 2.0]);
        let mut after = before.clone();
        after[2] += Vector3::new(0.0, 0.003, 0.0);
        after[0].y = 5.0;
        let found = cracks(&Places::new(&before, &after));
        assert!((found.before - 4e-8).abs() < 1e-15 && (found.after - 0.003).abs() < 1e-10, "{found:?}");
        // With a smaller tolerance they never met.
        let none = cracks(&Places::new(&before, &after).with_tolerance(1e-8));
        assert_eq!(none, Cracks::default());
        let equal = on_line(&[0.0, 1.0, 1.0]);
        let apart = on_line(&[0.0, 1.0, 1.25]);
        assert_eq!(
            cracks(&Places::new(&equal, &apart).with_tolerance(0.0)),
            Cracks { before: 0.0, after: 0.25 }
        );
    }

    #[test]
    fn nothing_meets() {
        assert_eq!(cracks(&Places::new(&[], &[])), Cracks::default());
        let before = on_line(&[0.0, f64::NAN, 1.0, 2.0]);
        assert_eq!(cracks(&Places::new(&before, &before)), Cracks::default());
        assert_eq!(cracks(&Places::new(&before, &before).with_tolerance(f64::NAN)), Cracks::default());
    }

    #[test]
    fn a_thousand_in_one_place() {
        let before = vec![Point3::new(1.0, 2.0, 3.0); 1000];
        let after: Vec<_> = (0..1000).map(|k| before[0] + Vector3::x() * f64::from(k)).collect();
        assert_eq!(cracks(&Places::new(&before, &after)), Cracks { before: 0.0, after: 999.0 });
    }

    proptest! {
        #[test]
        fn groups_are_those_of_all_pairs(
            coarse in prop::collection::vec([0u8..4, 0..4, 0..4], 1..60),
            fine in prop::collection::vec([0.0..1e-3, 0.0..1e-3, 0.0..1e-3], 60)
        ) {
            // Clusters a thousandth wide, one apart.
            let before: Vec<_> = coarse.iter().zip(&fine)
                .map(|(c, f)| Point3::from([0, 1, 2].map(|k| f64::from(c[k]) + f[k]))).collect();
            let found = cracks(&Places::new(&before, &before).with_tolerance(2e-3));
            let mut widest = 0.0_f64;
            for (i, p) in before.iter().enumerate() {
                for (j, q) in before.iter().enumerate() {
                    if coarse[i] == coarse[j] { widest = widest.max((p - q).norm()); }
                }
            }
            prop_assert_eq!(found, Cracks { before: widest, after: widest });
        }

        #[test]
        fn what_is_within_the_tolerance_meets(
            points in prop::collection::vec([0.0..1.0, 0.0..1.0, 0.0..1.0], 2..80), tolerance in 0.01..0.2f64
        ) {
            let points: Vec<_> = points.into_iter().map(Point3::from).collect();
            let groups = groups(&Places::new(&points, &points).with_tolerance(tolerance));
            let of = |i: usize| groups.iter().position(|g| g.contains(&(i as u32)));
            for i in 0..points.len() {
                for j in 0..i {
                    if (points[i] - points[j]).norm() < tolerance {
                        prop_assert!(of(i).is_some() && of(i) == of(j));
                    }
                }
            }
        }
    }
}
