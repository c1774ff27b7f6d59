//! The nearest of a set of points.
//!
//! The search is kiddo's k-d tree; this file keeps its traps away. An empty tree would answer item 0, a
//! NaN would be taken as a coordinate, a crowd of equal positions would be searched one by one by every
//! query, and of equally near points any could be the answer.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::Point3;
use rayon::prelude::*;

use crate::limits::usable;
use crate::morton;

/// Queries that one task answers in a row.
const CHUNK: usize = 256;

/// A set of points prepared for nearest-neighbour queries.
///
/// Points that are not finite (or beyond 1e70) are left out. Of equally near points the one with the
/// smallest index is the answer.
#[derive(Debug)]
pub struct NearestVertex {
    /// `None` without points. Items are places in `kept`.
    tree: Option<ImmutableKdTree<f64, 3>>,
    /// The first index at each position, ascending.
    kept: Vec<u32>,
}

impl NearestVertex {
    /// Prepares the set: O(n log n).
    pub fn new(points: &[Point3<f64>]) -> Self {
        let kept = first_of_each_position(points);
        let positions: Vec<[f64; 3]> = kept.iter().map(|&i| points[i as usize].coords.into()).collect();
        let tree = if positions.is_empty() { None } else { ImmutableKdTree::new_from_slice(&positions).ok() };
        Self { tree, kept }
    }

    /// Index of the point nearest to `p` and its distance in model units; `None` when there are no points
    /// or `p` is not finite.
    pub fn nearest(&self, p: &Point3<f64>) -> Option<(u32, f64)> {
        let tree = self.tree.as_ref().filter(|_| usable(p))?;
        let query: [f64; 3] = p.coords.into();
        let any = tree.query(&query).nearest_one::<SquaredEuclidean<f64>>().execute();
        let radius = any.distance;
        let first = tree
            .query(&query)
            .best_n_within::<SquaredEuclidean<f64>>(radius, NonZero::<usize>::MIN)
            .execute();
        let item = first.into_iter().map(|found| found.item).fold(any.item, u32::min);
        Some((self.kept[item as usize], radius.sqrt()))
    }

    /// Indices of the points closer to `p` than `reach`, and their distances in model units, by index; of several at one
    /// position the first. None where `p` is not finite.
    pub fn within(&self, p: &Point3<f64>, reach: f64) -> Vec<(u32, f64)> {
        let Some(tree) = self.tree.as_ref().filter(|_| usable(p)) else { return Vec::new() };
        let query: [f64; 3] = p.coords.into();
        let found = tree.query(&query).within::<SquaredEuclidean<f64>>(reach * reach).unsorted().execute();
        let mut near: Vec<(u32, f64)> =
            found.into_iter().map(|f| (self.kept[f.item as usize], f.distance.sqrt())).collect();
        near.retain(|&(_, distance)| distance < reach);
        near.sort_unstable_by_key(|&(index, _)| index);
        near
    }

    /// [`NearestVertex::nearest`] of each point, in parallel; the same for any number of threads.
    pub fn nearest_many(&self, points: &[Point3<f64>]) -> Vec<Option<(u32, f64)>> {
        let order = morton::order(points);
        let answers: Vec<_> =
            order.par_iter().with_min_len(CHUNK).map(|&i| self.nearest(&points[i as usize])).collect();
        morton::scatter(&order, answers, None)
    }
}

/// Usable points, one a position.
pub(crate) fn first_of_each_position(points: &[Point3<f64>]) -> Vec<u32> {
    // Adding zero makes -0 and 0 the same.
    let key = |i: u32| points[i as usize].coords.map(|x| (x + 0.0).to_bits()).data.0[0];
    let mut keyed: Vec<([u64; 3], u32)> =
        points.iter().zip(0..).filter(|(p, _)| usable(p)).map(|(_, i)| (key(i), i)).collect();
    keyed.sort_unstable();
    keyed.dedup_by_key(|(key, _)| *key);
    let mut kept: Vec<u32> = keyed.into_iter().map(|(_, i)| i).collect();
    kept.sort_unstable();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![
            6 => (-3i32..=3).prop_map(f64::from),
            6 => -3.0..3.0,
            1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::MAX), Just(-0.0), Just(1e69)],
        ]
    }

    fn point() -> impl Strategy<Value = Point3<f64>> {
        [coordinate(), coordinate(), coordinate()].prop_map(Point3::from)
    }

    fn brute_force(points: &[Point3<f64>], p: &Point3<f64>) -> Option<(u32, f64)> {
        let candidates = points.iter().zip(0..).filter(|(q, _)| usable(q) && usable(p));
        let distance = candidates.map(|(q, i)| (i, (q - p).norm_squared()));
        distance.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0))).map(|(i, d)| (i, d.sqrt()))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]

        #[test]
        fn agrees_with_brute_force(
            points in prop::collection::vec(point(), 0..300),
            queries in prop::collection::vec(point(), 1..30)
        ) {
            let set = NearestVertex::new(&points);
            let expected: Vec<_> = queries.iter().map(|p| brute_force(&points, p)).collect();
            let single: Vec<_> = queries.iter().map(|p| set.nearest(p)).collect();
            prop_assert_eq!(&single, &expected);
            prop_assert_eq!(set.nearest_many(&queries), expected);
        }
    }

    #[test]
    fn crowds_are_searched_quickly() {
        let same = vec![Point3::new(1.0, 2.0, 3.0); 50_000];
        assert_eq!(NearestVertex::new(&same).nearest_many(&same), vec![Some((0, 0.0)); 50_000]);
        // Many points with equal coordinates on one and on two axes.
        let plane: Vec<_> =
            (0..50_000).map(|i| Point3::new(f64::from(i % 200), 7.0, f64::from(i / 200))).collect();
        let line: Vec<_> = (0..50_000).map(|i| Point3::new(0.0, f64::from(i), 0.0)).collect();
        for points in [plane, line] {
            let expected: Vec<_> = (0..50_000).map(|i| Some((i, 0.0))).collect();
            assert_eq!(NearestVertex::new(&points).nearest_many(&points), expected);
        }
    }

    #[test]
    fn same_for_one_and_two_threads() {
        let points: Vec<_> = (0..5000u32)
            .map(|k| Point3::from([0.754, 0.569, 0.331].map(|step| (f64::from(k) * step).fract())))
            .collect();
        let queries: Vec<_> = points.iter().map(|p| p * 1.1).collect();
        let answers = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| NearestVertex::new(&points).nearest_many(&queries))
        };
        assert_eq!(answers(1), answers(2));
    }
}
