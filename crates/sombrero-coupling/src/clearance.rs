//! Parts that stand clear of all larger ones: nothing of them comes near, and nothing cuts.

use crate::parts::Parts;
use crate::sites::Sites;
use sombrero_spatial::{Line, Surface};

/// Which of these parts neither come within `distance` of a larger part nor cut one; false for the others.
///
/// Vertices are compared with faces both ways, and edges with faces: two edges that pass each other are told where they cut. O(n log n)
/// as a rule.
pub(crate) fn clear(
    sites: &Sites,
    surface: &Surface,
    parts: &Parts,
    of: &[bool],
    distance: f64,
) -> Vec<bool> {
    let mut clear = of.to_vec();
    if !clear.contains(&true) {
        return clear;
    }
    let part_of = |face: u32| parts.of_triangle[sites.face[face as usize] as usize];
    for (p, &point) in sites.at.iter().zip(&sites.point) {
        let own = parts.of_point[point as usize];
        strike(&mut clear, own, part_of, |accept| {
            surface.closest_where(p, distance, accept).map(|closest| closest.face)
        });
    }
    for &[a, b] in &sites.segments {
        let [p, q] = [a, b].map(|site| sites.at[site as usize]);
        let own = parts.of_point[sites.point[a as usize] as usize];
        let line = Line { origin: p, direction: q - p };
        strike(&mut clear, own, part_of, |accept| {
            surface.nearest_each_way(&line, 1.0, accept)[1].map(|crossing| crossing.face)
        });
    }
    clear
}

/// Takes from those that are clear what `met` meets: `own` where it meets a larger part, and each smaller part that it meets.
fn strike(
    clear: &mut [bool],
    own: u32,
    part_of: impl Fn(u32) -> u32,
    met: impl Fn(&dyn Fn(u32) -> bool) -> Option<u32>,
) {
    if clear.get(own as usize).is_some_and(|clear| *clear) && met(&|face| part_of(face) < own).is_some() {
        clear[own as usize] = false;
    }
    while let Some(face) = met(&|face| part_of(face) > own && clear[part_of(face) as usize]) {
        clear[part_of(face) as usize] = false;
    }
}
