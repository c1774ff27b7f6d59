//! No attack at all (row A).

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError};
use crate::operation::Operation;
use crate::spec::Given;
use rand::Rng;
use sombrero_mesh::Soup;

/// The attack that leaves the mesh as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nothing;

impl Operation for Nothing {
    fn read(_given: &mut Given<'_>) -> Result<Self, SpecError> {
        Ok(Self)
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        Vec::new()
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, _rng: &mut R) -> Result<Attacked, AttackError> {
        Ok(Attacked::in_place(soup.clone()))
    }
}
