//! A surface made ready to be described: vertices joined, the whole, and each part that hangs together.

use nalgebra::Point3;
use sombrero_landmarks::area;
use sombrero_mesh::{Soup, Weld, part, parts};

use crate::error::ShapeError;

/// Parts that are described on their own at most, largest first.
const PARTS: usize = 24;
/// Least area of a part that is described on its own, relative to the whole.
const SMALLEST: f64 = 0.002;
/// The largest coordinate: squares of areas must not overflow.
const FARTHEST: f64 = 1e60;

/// A surface to be described.
#[derive(Debug, Clone)]
pub(crate) struct Piece {
    pub(crate) points: Vec<Point3<f64>>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Root of the area, in the unit of the points: what lengths are measured in.
    pub(crate) size: f64,
}

impl Piece {
    fn new(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let size = area(points, triangles).sqrt();
        let (Soup { points, triangles }, _) = part(points, triangles);
        Self { points, triangles, size }
    }
}

/// The whole surface first, then its parts, largest first, when it has several.
///
/// # Errors
/// [`ShapeError`] when it is none.
pub(crate) fn pieces(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Result<Vec<Piece>, ShapeError> {
    check(points, triangles)?;
    let (points, triangles) = joined(points, triangles);
    if area(&points, &triangles) <= 0.0 {
        return Err(ShapeError::NoArea);
    }
    let whole = Piece::new(&points, &triangles);
    let parts = parts(points.len(), &triangles);
    if parts.len() < 2 {
        return Ok(vec![whole]);
    }
    let least = whole.size * SMALLEST.sqrt();
    let sized = parts.iter().map(|triangles| (area(&points, triangles).sqrt(), triangles));
    let mut sized: Vec<(f64, &Vec<[u32; 3]>)> = sized.filter(|(size, _)| *size >= least).collect();
    sized.sort_by(|a, b| b.0.total_cmp(&a.0));
    let largest = sized.iter().take(PARTS).map(|(_, triangles)| Piece::new(&points, triangles));
    Ok([whole].into_iter().chain(largest).collect())
}

fn check(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Result<(), ShapeError> {
    if triangles.is_empty() {
        return Err(ShapeError::Empty);
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        for &vertex in corners {
            let vertices = points.len();
            let missing = ShapeError::MissingVertex { triangle, vertex, vertices };
            let point = points.get(vertex as usize).ok_or(missing)?;
            if !point.iter().all(|x| x.abs() <= FARTHEST) {
                return Err(ShapeError::NotFinite { vertex: vertex as usize });
            }
        }
    }
    Ok(())
}

/// Vertices at equal positions as one, and no triangle that names one twice.
fn joined(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let weld = Weld::new(points);
    let mut triangles = weld.triangles(triangles);
    triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    (weld.points, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_shapes as shapes;

    #[test]
    fn parts_are_told_apart_though_corners_are_apart() {
        let (mut points, mut triangles) = (Vec::new(), Vec::new());
        for (soup, shift) in [(shapes::cube(), 0.0), (shapes::torus(24, 12, 2.0, 0.7), 9.0)] {
            for corner in soup.triangles.iter().flatten() {
                points.push(soup.points[*corner as usize] + nalgebra::Vector3::new(shift, 0.0, 0.0));
            }
        }
        triangles.extend((0..points.len() as u32 / 3).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]));
        let found = pieces(&points, &triangles).unwrap();
        let counts: Vec<usize> = found.iter().map(|piece| piece.triangles.len()).collect();
        assert_eq!(counts, [12 + 2 * 24 * 12, 2 * 24 * 12, 12]);
        assert_eq!(found[2].points.len(), 8);
    }

    #[test]
    fn what_is_no_surface_is_told() {
        let p = Point3::new(0.0, 0.0, 0.0);
        let far = Point3::new(f64::NAN, 0.0, 0.0);
        assert_eq!(pieces(&[p], &[]).unwrap_err(), ShapeError::Empty);
        assert_eq!(pieces(&[p], &[[0, 0, 0]]).unwrap_err(), ShapeError::NoArea);
        assert_eq!(pieces(&[p, far], &[[0, 1, 0]]).unwrap_err(), ShapeError::NotFinite { vertex: 1 });
        let missing = ShapeError::MissingVertex { triangle: 0, vertex: 4, vertices: 1 };
        assert_eq!(pieces(&[p], &[[0, 4, 0]]).unwrap_err(), missing);
    }
}
