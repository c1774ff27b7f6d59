//! Simplification (rows H and I): full edge collapses, the merged vertex at the quadric optimum.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use rand::Rng;
use sombrero_mesh::Soup;
use sombrero_progressive::simplify;

/// Fewer faces on nearly the same surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Simplification {
    /// Fraction of the faces that stays, between 0 and 1.
    pub ratio: f64,
}

impl Operation for Simplification {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        Ok(Self { ratio: given.needed_number("ratio")? })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("ratio", self.ratio.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, _rng: &mut R) -> Result<Attacked, AttackError> {
        in_range("ratio", self.ratio, (0.0, 1.0), "between 0 and 1")?;
        let simplified = simplify(soup, self.ratio);
        if simplified.triangles.is_empty() {
            Err(AttackError::NothingLeft)
        } else {
            Ok(Attacked::anew(simplified))
        }
    }
}
