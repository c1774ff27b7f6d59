//! Attacks on files.

use rand::Rng;
use sombrero_attacks::{Attack, AttackError, apply_all};
use sombrero_io::{Document, WriteError, encode};
use sombrero_mesh::Soup;
use sombrero_search::Model;
use thiserror::Error;

/// The reason why a file cannot be attacked.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum AttackFileError {
    /// The attack cannot be made.
    #[error(transparent)]
    Attack(#[from] AttackError),
    /// The result cannot be stored in this format.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// An attacked file.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct AttackedFile {
    /// Its bytes, in the format of the attacked file.
    pub bytes: Vec<u8>,
    /// Points and triangles of the result; stored vertices of equal position are one.
    pub soup: Soup,
    /// Whether the file is the old one with new positions. Otherwise the attack changed the connectivity
    /// and the file holds the bare mesh.
    pub kept_file: bool,
}

/// Applies attacks in order. Vertices at equal positions move together.
///
/// # Errors
/// [`AttackFileError`] when an attack cannot be made or its result cannot be stored.
pub fn attack<R: Rng + ?Sized>(
    document: &Document,
    attacks: &[Attack],
    rng: &mut R,
) -> Result<AttackedFile, AttackFileError> {
    let model = Model::new(document.soup());
    let attacked = apply_all(attacks, model.soup(), rng)?;
    let in_place = attacked.soup.triangles == model.soup().triangles
        && attacked.source.iter().enumerate().all(|(i, s)| *s == u32::try_from(i).ok());
    let bytes = if in_place {
        document.with_points(&model.stored_from_points(&attacked.soup.points))?
    } else {
        encode(document.format(), &attacked.soup)?
    };
    Ok(AttackedFile { bytes, soup: attacked.soup, kept_file: in_place })
}
