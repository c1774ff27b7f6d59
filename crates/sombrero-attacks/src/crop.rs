//! Cropping (row K): all vertices in the right part of the bounding box go, and their faces with them.

use crate::attack::{AttackError, Attacked};
use sombrero_mesh::Soup;

/// Drops the vertices whose x lies in the right `fraction` of the bounding box, the faces that lose a
/// corner, and the vertices that no face uses any more.
///
/// # Errors
/// [`AttackError::NothingLeft`] when no face is left.
pub fn crop(soup: &Soup, fraction: f64) -> Result<Attacked, AttackError> {
    let bounds = soup.bounding_box().ok_or(AttackError::NothingLeft)?;
    let limit = bounds.max.x - fraction * bounds.sides().x;
    let keeps = |v: u32| soup.points.get(v as usize).is_some_and(|p| p.x <= limit);
    let triangles: Vec<[u32; 3]> =
        soup.triangles.iter().copied().filter(|corners| corners.iter().all(|&v| keeps(v))).collect();
    if triangles.is_empty() {
        return Err(AttackError::NothingLeft);
    }
    Ok(compacted(Soup::new(soup.points.clone(), triangles)))
}

/// Leaves out the vertices that no face uses.
pub(crate) fn compacted(soup: Soup) -> Attacked {
    let mut place = vec![0u32; soup.points.len()];
    let mut source = Vec::new();
    for (v, _) in soup.used().into_iter().enumerate().filter(|(_, used)| *used) {
        place[v] = source.len() as u32;
        source.push(v as u32);
    }
    let triangles = soup.triangles.iter().map(|corners| corners.map(|v| place[v as usize])).collect();
    let points = source.iter().map(|&v| soup.points[v as usize]).collect();
    Attacked { soup: Soup::new(points, triangles), source: source.into_iter().map(Some).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_mesh::shapes;

    #[test]
    fn the_right_third_is_gone() {
        let soup = shapes::sphere(3);
        let cropped = crop(&soup, 1.0 / 3.0).unwrap();
        let limit = 1.0 - 2.0 / 3.0;
        assert!(cropped.soup.points.iter().all(|p| p.x <= limit + 1e-12));
        let kept = soup.points.iter().filter(|p| p.x <= limit).count();
        assert!(cropped.soup.points.len() <= kept && cropped.soup.points.len() + 20 > kept);
    }
}
