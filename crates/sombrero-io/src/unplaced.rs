//! Vertices without a position: what stands for one that no face uses may be anything.

use nalgebra::Point3;
use sombrero_mesh::Soup;

use crate::coordinate::is_finite;
use crate::error::ParseError;

/// Gives the vertices whose coordinates are no finite numbers a place where they change nothing: that of another vertex.
/// Their numbers, for they must never be written; or an error, made by `misplaced`, for the first that a face uses.
pub(crate) fn settle(
    soup: &mut Soup,
    misplaced: impl FnOnce(usize) -> ParseError,
) -> Result<Vec<u32>, ParseError> {
    let Some(first) = soup.points.iter().position(|p| !is_finite(p)) else { return Ok(Vec::new()) };
    let used = soup.used();
    let mut points = soup.points.iter().zip(&used).enumerate();
    if let Some((vertex, _)) = points.find(|(_, (p, used))| **used && !is_finite(p)) {
        return Err(misplaced(vertex));
    }
    let placed = |wanted: bool| {
        let mut points = soup.points.iter().zip(&used);
        points.find(|(p, used)| (**used || !wanted) && is_finite(p)).map(|(p, _)| *p)
    };
    let Some(place) = placed(true).or_else(|| placed(false)) else { return Err(misplaced(first)) };
    let mut unplaced = Vec::new();
    for (vertex, point) in (0..).zip(&mut soup.points) {
        if !is_finite(point) {
            *point = place;
            unplaced.push(vertex);
        }
    }
    Ok(unplaced)
}

/// `points` with those vertices where the file put them.
pub(crate) fn kept(points: &[Point3<f64>], soup: &Soup, unplaced: &[u32]) -> Vec<Point3<f64>> {
    let mut points = points.to_vec();
    for &vertex in unplaced {
        if let (Some(point), Some(old)) = (points.get_mut(vertex as usize), soup.points.get(vertex as usize))
        {
            *point = *old;
        }
    }
    points
}

/// A sentence about them.
pub(crate) fn note(count: usize) -> String {
    match count {
        1 => "1 vertex that no face uses has no position, and stays as it is.".into(),
        _ => format!("{count} vertices that no face uses have no position, and stay as they are."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOWHERE: Point3<f64> = Point3::new(0.0, f64::NAN, f64::INFINITY);

    fn corner(x: f64) -> Point3<f64> {
        Point3::new(x, 0.0, 0.0)
    }

    #[test]
    fn they_go_where_a_face_is() {
        let mut soup = Soup::new(vec![corner(9.0), NOWHERE, corner(1.0), corner(2.0)], vec![[2, 3, 2]]);
        assert_eq!(settle(&mut soup, |_| ParseError::NoVertices), Ok(vec![1]));
        assert_eq!(soup.points[1], corner(1.0));
        assert_eq!(kept(&[corner(5.0); 4], &soup, &[1])[1], corner(1.0));
    }

    #[test]
    fn one_that_is_used_is_named_and_so_is_one_among_nothing_else() {
        let named = |vertex| ParseError::TooManyVertices { limit: vertex };
        let mut soup = Soup::new(vec![NOWHERE, corner(1.0), NOWHERE], vec![[1, 1, 2]]);
        assert_eq!(settle(&mut soup, named), Err(named(2)));
        let mut soup = Soup::new(vec![NOWHERE; 2], Vec::new());
        assert_eq!(settle(&mut soup, named), Err(named(0)));
    }
}
