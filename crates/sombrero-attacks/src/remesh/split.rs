//! Splits of long edges, all at once, until none is left. A face falls into two, three or four according to
//! how many of its sides are split; of a quadrilateral the shorter diagonal is taken.

use crate::error::{AttackError, MOST_FACES};
use nalgebra::{Point3, center, distance};
use sombrero_mesh::{Edges, Soup};

/// Splits edges longer than `longest` in the middle.
pub(super) fn split(soup: &mut Soup, longest: f64) -> Result<(), AttackError> {
    loop {
        let edges = Edges::new(soup.points.len(), &soup.triangles);
        let points = &mut soup.points;
        let before = points.len();
        let mut middle = |&[a, b]: &[u32; 2]| {
            let [p, q] = [points[a as usize], points[b as usize]];
            (distance(&p, &q) > longest).then(|| {
                points.push(center(&p, &q));
                points.len() as u32 - 1
            })
        };
        let middles: Vec<Option<u32>> = edges.ends.iter().map(&mut middle).collect();
        if soup.points.len() == before {
            return Ok(());
        }
        let faces = soup.triangles.iter().zip(edges.of_side.chunks_exact(3));
        let pieces = |(corners, sides): (&[u32; 3], &[u32])| {
            pieces(*corners, [0, 1, 2].map(|k| middles[sides[k] as usize]), &soup.points)
        };
        soup.triangles = faces.flat_map(pieces).collect();
        if soup.triangles.len() > MOST_FACES {
            return Err(AttackError::TooManyFaces);
        }
    }
}

/// What becomes of a face with these vertices in the middles of its sides.
fn pieces([a, b, c]: [u32; 3], middles: [Option<u32>; 3], points: &[Point3<f64>]) -> Vec<[u32; 3]> {
    match middles {
        [None, None, None] => vec![[a, b, c]],
        [Some(m), None, None] => vec![[a, m, c], [m, b, c]],
        [Some(m), Some(n), None] => {
            let length = |u: u32, v: u32| distance(&points[u as usize], &points[v as usize]);
            let quad =
                if length(a, n) <= length(m, c) { [[a, m, n], [a, n, c]] } else { [[a, m, c], [m, n, c]] };
            vec![[m, b, n], quad[0], quad[1]]
        }
        [Some(ab), Some(bc), Some(ca)] => vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]],
        // The same with another first corner.
        [ab, bc, ca] => pieces([b, c, a], [bc, ca, ab], points),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_mesh::geometry::{area, mean_edge_length};
    use sombrero_mesh::repair;
    use sombrero_shapes as shapes;

    proptest! {
        #[test]
        fn no_edge_is_too_long_and_the_surface_is_the_same(part in 0.2..2.0) {
            let soup = shapes::bumpy_sphere(100);
            let before = repair(&soup);
            let longest = part * mean_edge_length(&before.mesh, &before.points);
            let mut fine = soup.clone();
            split(&mut fine, longest).unwrap();
            let after = repair(&fine);
            prop_assert!(after.report.is_clean());
            prop_assert!((area(&after.mesh, &after.points) / area(&before.mesh, &before.points) - 1.0).abs() < 1e-12);
            let ends = Edges::new(fine.points.len(), &fine.triangles).ends;
            prop_assert!(ends.iter().all(|[a, b]| distance(&fine.points[*a as usize], &fine.points[*b as usize]) <= longest));
        }
    }
}
