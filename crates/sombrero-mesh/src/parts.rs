//! The parts of a soup: what hangs together by triangles that share points.

use crate::connected::connected;
use crate::soup::Soup;
use nalgebra::Point3;

/// The triangles of each part, parts in the order of their first points and triangles as they were.
///
/// # Panics
/// When a corner index is out of range.
pub fn parts(points: usize, triangles: &[[u32; 3]]) -> Vec<Vec<[u32; 3]>> {
    let links = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c]]);
    let first = connected(points, links);
    let mut labelled: Vec<(u32, [u32; 3])> = triangles.iter().map(|t| (first[t[0] as usize], *t)).collect();
    // Stable, so that triangles stay in order.
    labelled.sort_by_key(|(first, _)| *first);
    let group = |of: &[(u32, [u32; 3])]| of.iter().map(|(_, corners)| *corners).collect();
    labelled.chunk_by(|a, b| a.0 == b.0).map(group).collect()
}

/// The soup of some triangles alone, and which of all points its own are, ascending. The time does not depend on how many
/// points there are besides.
///
/// # Panics
/// When a corner index is out of range.
pub fn part(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> (Soup, Vec<u32>) {
    let mut source: Vec<u32> = triangles.iter().flatten().copied().collect();
    source.sort_unstable();
    source.dedup();
    let place = |v: u32| source.partition_point(|&other| other < v) as u32;
    let triangles = triangles.iter().map(|corners| corners.map(place)).collect();
    (Soup::new(source.iter().map(|&v| points[v as usize]).collect(), triangles), source)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles_that_share_a_point_are_one_part() {
        let triangles = [[5, 6, 7], [0, 1, 2], [2, 3, 4], [7, 8, 5]];
        let groups = parts(9, &triangles);
        assert_eq!(groups, [vec![[0, 1, 2], [2, 3, 4]], vec![[5, 6, 7], [7, 8, 5]]]);
        let points: Vec<Point3<f64>> = (0..9).map(|i| Point3::new(f64::from(i), 0.0, 0.0)).collect();
        let (soup, source) = part(&points, &groups[1]);
        assert_eq!(source, [5, 6, 7, 8]);
        assert_eq!(soup, Soup::new(points[5..].to_vec(), vec![[0, 1, 2], [2, 3, 0]]));
        assert_eq!(parts(3, &[]), Vec::<Vec<[u32; 3]>>::new());
    }
}
