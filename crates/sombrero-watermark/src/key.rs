//! A key: everything that detection needs beside the original. It is secret.
//!
//! w is bound to all that decides where the vertices go (the paper, section 4, non-invertible as it asks): digest =
//! SHA-256 over a tag and, each with its name, the parts of `Key::bound`, every string with its length in front; seed =
//! Argon2id of the digest ([`Derivation`]); w = the first m [`gaussians`] of the seed. So nothing can be chosen once w is
//! known, and to choose before costs a derivation a try.

use crate::derivation::{self, Derivation};
use crate::hash_tree::Path;
use crate::original::OriginalDigest;
use crate::parameters::{Parameters, Preset};
use crate::sequence::{Identity, Secret, gaussians, hash_part};
use sha2::{Digest, Sha256};
use sombrero_basis::{Basis, BasisOptions};
use thiserror::Error;

/// A key that has been read or made.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// Whose mark it is.
    pub identity: Identity,
    /// The secret that w follows from.
    pub secret: Secret,
    /// How the mark was made.
    pub parameters: Parameters,
    /// What w costs.
    pub derivation: Derivation,
    /// [`OriginalDigest::sha256`] of the original.
    pub original_sha256: [u8; 32],
    /// [`Basis::digest`].
    pub basis_sha256: [u8; 32],
    /// w, one entry a coefficient.
    pub watermark: Vec<f64>,
    /// The place of the commitment in a tree of many that share a timestamp; `None` when it has its own.
    pub path: Option<Path>,
    /// An RFC 3161 token (DER) for [`Key::stamped`], if one was stored: it tells since when the key has existed.
    pub timestamp: Option<Vec<u8>>,
}

/// What does not fit together. All of it means: other file, or edited key.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Mismatch {
    /// The original's bytes are not those that were marked.
    #[error(
        "the key belongs to another original: it was made for one with SHA-256 {expected}, this one has {found}; give the exact file that was marked, with the files that belong to it"
    )]
    Original {
        /// The hash in the key.
        expected: String,
        /// The hash of the file.
        found: String,
    },
    /// w does not follow from the secret and what the key says besides.
    #[error(
        "the key's watermark does not follow from its secret, texts, parameters and original (first at coefficient {coefficient}): the key was edited; use the file that `embed` wrote"
    )]
    Watermark {
        /// The first coefficient that differs.
        coefficient: usize,
    },
    /// The basis computed now is not the one that was marked with.
    #[error(
        "the basis of the mark is not the one in the key: the key was edited, or another version of the program computes it differently"
    )]
    Basis,
    /// w costs nearly nothing, or too much.
    #[error(
        "the key's watermark has a derivation ({derivation}) that no mark has outside of experiments; use the file that `embed` wrote"
    )]
    Derivation {
        /// The algorithm and its costs.
        derivation: String,
    },
}

impl Key {
    /// Makes the key for marking the original with `basis`, a [`Basis::digest`]; `parameters` must have as many
    /// coefficients as that has functions. Takes as long as the derivation costs: see [`Derivation`].
    pub fn new(
        original: &OriginalDigest,
        identity: Identity,
        secret: Secret,
        parameters: Parameters,
        basis: &[u8; 32],
        derivation: Derivation,
    ) -> Self {
        let mut key = Self {
            identity,
            secret,
            parameters,
            derivation,
            original_sha256: original.sha256(),
            basis_sha256: *basis,
            watermark: Vec::new(),
            path: None,
            timestamp: None,
        };
        key.watermark = key.derived();
        key
    }

    /// Everything that decides the mark, by name. Texts as they are, numbers as decimals that read back to the bit, hashes
    /// in hexadecimal digits.
    pub(crate) fn bound(&self) -> [(&'static str, String); 11] {
        let Parameters { preset, basis, epsilon } = self.parameters;
        let BasisOptions { coefficients, function, amplitudes } = basis;
        [
            ("original_sha256", hex::encode(self.original_sha256)),
            ("basis_sha256", hex::encode(self.basis_sha256)),
            ("preset", preset.map_or("none", Preset::name).to_owned()),
            ("coefficients", coefficients.to_string()),
            ("epsilon", epsilon.to_string()),
            ("basis", function.to_string()),
            ("amplitudes", amplitudes.to_string()),
            ("derivation", self.derivation.to_string()),
            ("owner", self.identity.owner.clone()),
            ("recipient", self.identity.recipient.clone()),
            ("secret", self.secret.to_hex()),
        ]
    }

    /// The watermark that follows from everything else.
    fn derived(&self) -> Vec<f64> {
        let mut hash = Sha256::new();
        hash_part(&mut hash, derivation::TAG);
        for (name, value) in self.bound() {
            hash_part(&mut hash, name.as_bytes());
            hash_part(&mut hash, value.as_bytes());
        }
        gaussians(self.derivation.seed(&hash.finalize().into()), self.parameters.basis.coefficients)
    }

    /// Whether `original` is the file that was marked.
    ///
    /// # Errors
    /// [`Mismatch::Original`] when it is not.
    pub fn check_original(&self, original: &OriginalDigest) -> Result<(), Mismatch> {
        if original.sha256() == self.original_sha256 {
            return Ok(());
        }
        let [expected, found] = [self.original_sha256, original.sha256()].map(hex::encode);
        Err(Mismatch::Original { expected, found })
    }

    /// Whether the key is genuine: made for this original, its basis the one that is computed now, and its w derived from
    /// its secret.
    ///
    /// # Errors
    /// The first [`Mismatch`].
    pub fn check(&self, original: &OriginalDigest, basis: &Basis) -> Result<(), Mismatch> {
        self.check_original(original)?;
        self.check_basis(&basis.digest())?;
        self.check_watermark()
    }

    /// Whether w follows from the secret and everything else that the key says, at a cost that keys have. Takes as long as
    /// the derivation costs.
    ///
    /// # Errors
    /// [`Mismatch::Derivation`] or [`Mismatch::Watermark`].
    pub fn check_watermark(&self) -> Result<(), Mismatch> {
        if !self.derivation.is_acceptable() {
            return Err(Mismatch::Derivation { derivation: self.derivation.to_string() });
        }
        let derived = self.derived();
        match derived.iter().zip(&self.watermark).position(|(a, b)| a != b) {
            Some(coefficient) => Err(Mismatch::Watermark { coefficient }),
            None if derived.len() != self.watermark.len() => {
                Err(Mismatch::Watermark { coefficient: derived.len().min(self.watermark.len()) })
            }
            None => Ok(()),
        }
    }

    /// Whether the basis with this [`Basis::digest`] is what was marked with.
    ///
    /// # Errors
    /// [`Mismatch::Basis`] when it is not.
    pub fn check_basis(&self, basis: &[u8; 32]) -> Result<(), Mismatch> {
        if *basis == self.basis_sha256 { Ok(()) } else { Err(Mismatch::Basis) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_mesh::repair;
    use sombrero_progressive::ProgressiveMesh;
    use sombrero_shapes as shapes;

    fn identity() -> Identity {
        Identity { owner: "Alice".into(), recipient: "Bob".into() }
    }

    fn made(identity: Identity, parameters: Parameters) -> Key {
        let stub = Derivation::stub_for_experiments();
        let file = OriginalDigest::of_file(b"file");
        Key::new(&file, identity, Secret([9; 32]), parameters, &[1; 32], stub)
    }

    /// Keys must stay good in every version.
    #[test]
    fn the_watermark_is_pinned() {
        let file = OriginalDigest::of_file(b"file");
        let parameters = Preset::Paper.parameters();
        let key = Key::new(&file, identity(), Secret([9; 32]), parameters, &[1; 32], Derivation::STANDARD);
        assert_eq!(key.watermark.len(), 50);
        assert_eq!(key.watermark[..4], GOLDEN);
        assert_eq!(key.check_watermark(), Ok(()));
    }

    const GOLDEN: [f64; 4] =
        [1.2132955785127706, -1.020422253979632, -0.16127693407906918, 0.21650932870034012];

    #[test]
    fn everything_that_decides_the_mark_changes_the_watermark() {
        let parameters = Preset::Paper.parameters();
        let first = made(identity(), parameters);
        // The lengths keep texts from running into each other.
        let shifted = Identity { owner: "AliceB".into(), recipient: "ob".into() };
        assert_ne!(made(shifted, parameters).watermark, first.watermark);
        let edits: [fn(&mut Key); 9] = [
            |key| key.secret.0[31] ^= 1,
            |key| key.original_sha256[0] ^= 1,
            |key| key.basis_sha256[31] ^= 1,
            |key| key.parameters.epsilon *= 1.000_000_000_1,
            |key| key.parameters.preset = None,
            |key| key.parameters.basis.function = sombrero_basis::BasisFunction::Hat,
            |key| key.parameters.basis.amplitudes = sombrero_basis::Amplitudes::RootHeights,
            |key| key.derivation.passes += 1,
            |key| key.parameters.basis.coefficients += 1,
        ];
        for (number, edit) in edits.into_iter().enumerate() {
            let mut other = first.clone();
            edit(&mut other);
            assert!(other.derived().iter().zip(&first.watermark).all(|(a, b)| a != b), "edit {number}");
        }
        let stamped = Key { timestamp: Some(vec![1]), path: Some(Path::default()), ..first.clone() };
        assert_eq!(stamped.derived(), first.watermark);
    }

    #[test]
    fn a_genuine_key_is_told_from_edited_ones() {
        let surface = repair(&shapes::bumpy_sphere(300));
        let progressive = ProgressiveMesh::new(surface.mesh, &surface.points).unwrap();
        let parameters = Preset::Paper.parameters();
        let options = BasisOptions { coefficients: 16, ..parameters.basis };
        let basis = Basis::new(progressive, &surface.points, &options).unwrap();
        let parameters = Parameters { basis: options, ..parameters };
        let file = OriginalDigest::of_file(b"file");
        let key =
            Key::new(&file, identity(), Secret([9; 32]), parameters, &basis.digest(), Derivation::STANDARD);
        assert_eq!(key.check(&file, &basis), Ok(()));
        let other = OriginalDigest::of_file(b"other");
        assert!(matches!(key.check(&other, &basis), Err(Mismatch::Original { .. })));
        let mut edited = key.clone();
        edited.watermark[3] += 0.5;
        assert_eq!(edited.check(&file, &basis), Err(Mismatch::Watermark { coefficient: 3 }));
        let mut edited = key.clone();
        edited.watermark.truncate(10);
        assert_eq!(edited.check(&file, &basis), Err(Mismatch::Watermark { coefficient: 10 }));
        let mut edited = key.clone();
        edited.identity.owner = "Mallory".into();
        assert_eq!(edited.check(&file, &basis), Err(Mismatch::Watermark { coefficient: 0 }));
        let mut edited = key.clone();
        edited.parameters.epsilon *= 2.0;
        assert_eq!(edited.check(&file, &basis), Err(Mismatch::Watermark { coefficient: 0 }));
        let edited = Key { basis_sha256: [0; 32], ..key };
        assert_eq!(edited.check(&file, &basis), Err(Mismatch::Basis));
    }

    #[test]
    fn a_stub_is_not_genuine() {
        let key = made(identity(), Preset::Paper.parameters());
        assert!(matches!(key.check_watermark(), Err(Mismatch::Derivation { .. })));
    }
}
