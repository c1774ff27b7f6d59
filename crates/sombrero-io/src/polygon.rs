//! Polygons and strips split into triangles.

/// Appends the triangles of a polygon, as a fan around its first corner. Fewer than three corners make none.
pub(crate) fn fan(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    if let [hub, rim @ ..] = corners {
        triangles.extend(rim.windows(2).map(|pair| [*hub, pair[0], pair[1]]));
    }
}

/// Appends the triangles of a strip, every second one turned round so that all face the same way.
///
/// Triangles with a doubled corner are left out: strips use them as joints, not as surface.
pub(crate) fn strip(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    for (i, w) in corners.windows(3).enumerate() {
        let [a, b, c] = [w[0], w[1], w[2]];
        if a != b && b != c && c != a {
            triangles.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn collect(split: fn(&[u32], &mut Vec<[u32; 3]>), corners: &[u32]) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        split(corners, &mut triangles);
        triangles
    }

    #[test]
    fn a_pentagon_is_a_fan_of_three() {
        assert_eq!(collect(fan, &[4, 7, 9, 2, 3]), [[4, 7, 9], [4, 9, 2], [4, 2, 3]]);
    }

    #[test]
    fn too_few_corners_make_no_triangle() {
        for corners in [&[][..], &[1], &[1, 2]] {
            assert_eq!(collect(fan, corners), <[[u32; 3]; 0]>::default());
            assert_eq!(collect(strip, corners), <[[u32; 3]; 0]>::default());
        }
    }

    #[test]
    fn a_strip_alternates_and_skips_its_joints() {
        assert_eq!(collect(strip, &[0, 1, 2, 3]), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(collect(strip, &[0, 1, 2, 2, 3]), [[0, 1, 2]]);
    }
}
