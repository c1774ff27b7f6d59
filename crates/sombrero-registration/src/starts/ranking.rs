//! Many maps, how well a few samples support each, and the best that differ.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::refinement::motion::Motion;
use crate::surface::sample::Sample;

/// Samples by which two maps are compared.
const PROBES: usize = 12;

/// A map and its support, the larger the better.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ranked<M> {
    pub(crate) pose: M,
    pub(crate) support: f64,
}

/// `poses` and their support.
pub(crate) fn looked<M: Motion>(poses: Vec<M>, support: impl Fn(&M) -> f64 + Sync) -> Vec<Ranked<M>> {
    poses.into_par_iter().map(|pose| Ranked { support: support(&pose), pose }).collect()
}

/// All of `poses`, best first; of equals the earlier one.
pub(crate) fn ranked<M: Motion>(poses: Vec<M>, support: impl Fn(&M) -> f64 + Sync) -> Vec<Ranked<M>> {
    let mut found = looked(poses, support);
    found.sort_by(|a, b| b.support.total_cmp(&a.support));
    found
}

/// The `most` best, in their order; of equals the earlier ones.
pub(crate) fn best<M: Motion>(found: Vec<Ranked<M>>, most: usize) -> Vec<M> {
    let mut chosen: Vec<usize> = (0..found.len()).collect();
    if found.len() > most {
        let better = |a: &usize, b: &usize| found[*b].support.total_cmp(&found[*a].support).then(a.cmp(b));
        chosen.select_nth_unstable_by(most, better);
        chosen.truncate(most);
        chosen.sort_unstable();
    }
    chosen.into_iter().map(|index| found[index].pose).collect()
}

/// The first `most` that do not put the samples about where an earlier one puts them: RMS distance up to `same`.
pub(crate) fn distinct<M: Motion>(
    found: &[Ranked<M>],
    samples: &[Sample],
    same: f64,
    most: usize,
) -> Vec<Ranked<M>> {
    let probes = &samples[..samples.len().min(PROBES)];
    let limit = same * same * probes.len() as f64;
    let mut kept: Vec<(Ranked<M>, Vec<Point3<f64>>)> = Vec::new();
    for ranked in found {
        if kept.len() == most {
            break;
        }
        let map = ranked.pose.map();
        let here: Vec<_> = probes.iter().map(|s| map.point(&s.point)).collect();
        let squared =
            |there: &[Point3<f64>]| here.iter().zip(there).map(|(a, b)| (a - b).norm_squared()).sum::<f64>();
        if kept.iter().all(|(_, there)| squared(there) > limit) {
            kept.push((*ranked, here));
        }
    }
    kept.into_iter().map(|(ranked, _)| ranked).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Similarity3, Vector3};

    #[test]
    fn the_best_that_differ() {
        let shift = |x: f64| Similarity3::new(Vector3::new(x, 0.0, 0.0), Vector3::zeros(), 1.0);
        let point = Sample { point: Point3::origin(), normal: Vector3::x(), face_normal: Vector3::x() };
        let found = ranked(vec![shift(0.0), shift(1.0), shift(1.05), shift(3.0)], |pose| {
            1.0 - (pose.isometry.translation.x - 1.04).abs()
        });
        let x = |r: &Ranked<Similarity3<f64>>| r.pose.isometry.translation.x;
        assert_eq!(found.iter().map(x).collect::<Vec<_>>(), [1.05, 1.0, 0.0, 3.0]);
        assert_eq!(best(found.clone(), 2).len(), 2);
        let (all, some) = (found.iter().map(|r| r.pose), best(found.clone(), 3));
        assert_eq!(some, all.take(3).collect::<Vec<_>>());
        let kept = distinct(&found, &[point], 0.1, 2);
        assert_eq!(kept.iter().map(x).collect::<Vec<_>>(), [1.05, 0.0]);
        assert!(distinct(&found, &[point], 0.1, 9).len() == 3);
    }
}
