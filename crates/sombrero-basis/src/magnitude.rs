//! Which vertex splits change the shape most (the paper, section 3): the m of largest |h| carry the mark, and the direction
//! d of each is that in which coefficient i moves the vertices of its support (see
//! [`Magnitude`](sombrero_progressive::Magnitude)).

use sombrero_progressive::ProgressiveMesh;

/// h of all splits, in order of refinement.
pub(crate) fn heights(progressive: &ProgressiveMesh) -> Vec<f64> {
    (0..progressive.split_count()).filter_map(|i| progressive.height(i)).collect()
}

/// The `count` splits of largest |h| among those from `first` on, largest first; ties go to the coarser one.
///
/// The paper takes the largest of all. Splits below the [shape
/// level](sombrero_progressive::ProgressiveMesh::shape_level) are left out here: their heights are a large
/// part of the model's size, so a mark on them is visible and says little about the surface.
///
/// Splits whose height is no more than `least` are never taken, so there may be fewer than `count`: they are rounding
/// errors of a flat surface, or so little relief that a mark on them is none.
pub(crate) fn most_significant(heights: &[f64], first: usize, count: usize, least: f64) -> Vec<usize> {
    let usable = |h: f64| h.is_finite() && h.abs() > least;
    let mut order: Vec<usize> = (first..heights.len()).filter(|&i| usable(heights[i])).collect();
    order.sort_by(|&i, &j| heights[j].abs().total_cmp(&heights[i].abs()).then(i.cmp(&j)));
    order.truncate(count);
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_heights_come_first_and_flat_ones_never() {
        let all = [0.1, -2.0, 0.0, 0.5, 2.0, 1e-12];
        assert_eq!(most_significant(&all, 0, 3, 1e-9), [1, 4, 3]);
        assert_eq!(most_significant(&all, 0, 9, 1e-9), [1, 4, 3, 0]);
        assert_eq!(most_significant(&all, 2, 9, 1e-9), [4, 3]);
        assert_eq!(most_significant(&all, 0, 9, 0.5), [1, 4]);
    }
}
