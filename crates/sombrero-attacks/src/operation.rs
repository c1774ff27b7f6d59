//! What every attack is: parameters that a spec gives, and a mesh that becomes another.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError};
use crate::spec::Given;
use rand::Rng;
use sombrero_mesh::Soup;

/// An attack with its parameters, which are the fields of the type.
pub trait Operation: Sized {
    /// Reads the parameters of a spec: each is asked for by its name, and what is left at the end is an error.
    ///
    /// # Errors
    /// [`SpecError`] for a value that is missing or not of the right kind. Ranges are the matter of
    /// [`Operation::apply`].
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError>;

    /// The parameters by name, from which [`Operation::read`] makes the same attack again.
    fn parameters(&self) -> Vec<(&'static str, String)>;

    /// The mesh after the attack. All randomness comes from `rng`.
    ///
    /// # Errors
    /// [`AttackError`] when a parameter is out of range or nothing would be left.
    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError>;
}
