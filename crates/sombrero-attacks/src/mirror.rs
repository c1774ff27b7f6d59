//! The mirror image, as a click makes it: x' = -x, with the faces turned round so that the same side is out.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError};
use crate::operation::Operation;
use crate::spec::Given;
use nalgebra::Point3;
use rand::Rng;
use sombrero_mesh::Soup;

/// The mesh in the mirror.
pub fn mirror(soup: &Soup) -> Soup {
    let points = soup.points.iter().map(|p| Point3::new(-p.x, p.y, p.z)).collect();
    Soup::new(points, soup.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect())
}

/// The attack that mirrors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mirroring;

impl Operation for Mirroring {
    fn read(_given: &mut Given<'_>) -> Result<Self, SpecError> {
        Ok(Self)
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        Vec::new()
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, _rng: &mut R) -> Result<Attacked, AttackError> {
        Ok(Attacked::in_place(mirror(soup)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_mesh::{geometry, repair};
    use sombrero_shapes as shapes;

    #[test]
    fn twice_is_nothing_and_once_keeps_the_outside_out() {
        let soup = shapes::bust(8);
        assert_eq!(mirror(&mirror(&soup)), soup);
        let volume = |soup: &Soup| {
            let made = repair(soup);
            geometry::volume(&made.mesh, &made.points)
        };
        assert!((volume(&mirror(&soup)) / volume(&soup) - 1.0).abs() < 1e-12);
    }
}
