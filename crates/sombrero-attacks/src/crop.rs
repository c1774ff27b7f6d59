//! Cropping (row K): all vertices in the right part of the bounding box go, and their faces with them.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use rand::Rng;
use sombrero_mesh::Soup;

/// Drops the `share` of the used vertices that lie furthest to the right, as the benchmark of Wang et al. (2010)
/// counts; with them the faces that lose a corner, and the vertices that no face uses any more.
///
/// # Errors
/// [`AttackError::NothingLeft`] when no face is left.
pub fn crop_vertices(soup: &Soup, share: f64) -> Result<Attacked, AttackError> {
    let used = soup.points.iter().zip(soup.used()).filter(|(_, used)| *used);
    let mut across: Vec<f64> = used.map(|(p, _)| p.x).collect();
    across.sort_by(f64::total_cmp);
    let kept = ((1.0 - share) * across.len() as f64).round() as usize;
    let limit = kept.checked_sub(1).and_then(|last| across.get(last)).ok_or(AttackError::NothingLeft)?;
    cut(soup, *limit)
}

/// Drops the vertices whose x lies in the right `fraction` of the bounding box, the faces that lose a
/// corner, and the vertices that no face uses any more.
///
/// # Errors
/// [`AttackError::NothingLeft`] when no face is left.
pub fn crop(soup: &Soup, fraction: f64) -> Result<Attacked, AttackError> {
    let bounds = soup.bounding_box().ok_or(AttackError::NothingLeft)?;
    cut(soup, bounds.max.x - fraction * bounds.sides().x)
}

/// Leaves what lies at x up to `limit`.
fn cut(soup: &Soup, limit: f64) -> Result<Attacked, AttackError> {
    let keeps = |v: u32| soup.points.get(v as usize).is_some_and(|p| p.x <= limit);
    let triangles: Vec<[u32; 3]> =
        soup.triangles.iter().copied().filter(|corners| corners.iter().all(|&v| keeps(v))).collect();
    if triangles.is_empty() {
        return Err(AttackError::NothingLeft);
    }
    let (left, source) = Soup::new(soup.points.clone(), triangles).compacted();
    Ok(Attacked::picked(left, source))
}

/// What goes of the right of the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Crop {
    /// The vertices in this fraction of the bounding box, and their faces.
    Fraction(f64),
    /// This fraction of the vertices, and their faces.
    Vertices(f64),
}

impl Operation for Crop {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        match given.number("vertices")? {
            Some(share) => Ok(Self::Vertices(share)),
            None => Ok(Self::Fraction(given.needed_number("fraction")?)),
        }
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Fraction(fraction) => vec![("fraction", fraction.to_string())],
            Self::Vertices(share) => vec![("vertices", share.to_string())],
        }
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, _rng: &mut R) -> Result<Attacked, AttackError> {
        match *self {
            Self::Fraction(fraction) => {
                in_range("fraction", fraction, (0.0, 1.0), "between 0 and 1")?;
                crop(soup, fraction)
            }
            Self::Vertices(share) => {
                in_range("vertices", share, (0.0, 1.0), "between 0 and 1")?;
                crop_vertices(soup, share)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_shapes as shapes;

    #[test]
    fn a_share_of_the_vertices_is_gone() {
        let soup = shapes::bumpy_sphere(2000);
        for share in [0.1, 0.3, 0.5] {
            let left = crop_vertices(&soup, share).unwrap().soup.points.len() as f64 / 2000.0;
            // Vertices that keep no face go too.
            assert!((left - (1.0 - share)).abs() < 0.03, "{left} for {share}");
        }
        assert_eq!(crop_vertices(&soup, 1.0), Err(AttackError::NothingLeft));
    }

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
