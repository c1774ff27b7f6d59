//! The key file: everything that detection needs beside the original, as JSON.
//!
//! It is secret. It holds all parameters, the hashes of the original file and of the basis, the secret,
//! and w itself, so that a key can be read without this program; [`Key::check`] derives w again and tells
//! whether the file was edited.

use crate::Parameters;
use crate::sequence::{Identity, OriginalDigest, Secret};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use sombrero_basis::{Amplitudes, Basis, BasisFunction, BasisOptions};
use thiserror::Error;

const FORMAT: &str = "sombrero-key";
const VERSION: u32 = 1;
/// Nobody needs more, and a hostile key file shall not make us allocate.
const MOST_COEFFICIENTS: usize = 1_000_000;

/// A key that has been read or made.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// Whose mark it is.
    pub identity: Identity,
    /// The secret that w follows from.
    pub secret: Secret,
    /// How the mark was made.
    pub parameters: Parameters,
    /// SHA-256 of the original file.
    pub original_sha256: [u8; 32],
    /// SHA-256 of [`Basis::digest`] and ε: the matrix B.
    pub basis_sha256: [u8; 32],
    /// w, one entry a coefficient.
    pub watermark: Vec<f64>,
    /// An RFC 3161 token (DER) for [`Key::commitment`], if one was stored: it tells since when the key has existed.
    pub timestamp: Option<Vec<u8>>,
}

/// Why a file is not a key.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum KeyError {
    /// It is not JSON, or a field is missing, unknown or of the wrong kind.
    #[error("not a sombrero key, or a damaged one: {detail}; use the file that `embed` wrote, unchanged")]
    Syntax {
        /// What the reader of JSON says, with line and column.
        detail: String,
    },
    /// Another version of the format.
    #[error(
        "the key has format version {found}, this program reads {VERSION}; use the program that wrote it"
    )]
    Version {
        /// Its version.
        found: u32,
    },
    /// A field holds what no key can hold.
    #[error("the key's field `{field}` is not usable: {detail}; use the file that `embed` wrote, unchanged")]
    Field {
        /// The field.
        field: &'static str,
        /// What is wrong with it.
        detail: String,
    },
}

/// What does not fit together. All of it means: other file, or edited key.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Mismatch {
    /// The original's bytes are not those that were marked.
    #[error(
        "the key belongs to another original: it was made for a file with SHA-256 {expected}, this one has {found}; give the exact file that was marked"
    )]
    Original {
        /// The hash in the key.
        expected: String,
        /// The hash of the file.
        found: String,
    },
    /// w does not follow from original, identity and secret.
    #[error(
        "the key's watermark does not follow from its secret and the original (first at coefficient {coefficient}): the key was edited; use the file that `embed` wrote"
    )]
    Watermark {
        /// The first coefficient that differs.
        coefficient: usize,
    },
    /// The basis computed now is not the one that was marked with.
    #[error(
        "the basis or the strength of the mark is not the one in the key: the key was edited, or another version of the program computes it differently"
    )]
    Basis,
}

/// What tells whether the rest can be read. All else is passed over without being kept.
#[derive(Default, Deserialize)]
struct Head {
    format: Option<String>,
    version: Option<u64>,
}

/// The file, field by field.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u32,
    created_by: String,
    owner: String,
    recipient: String,
    coefficients: usize,
    epsilon: f64,
    basis: String,
    /// Keys that do not say are the paper's.
    #[serde(default = "paper_amplitudes")]
    amplitudes: String,
    original_sha256: String,
    basis_sha256: String,
    secret: String,
    watermark: Vec<f64>,
    /// In base64.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    timestamp: Option<String>,
}

fn paper_amplitudes() -> String {
    Amplitudes::Heights.to_string()
}

impl Key {
    /// Makes the key for marking `original` by `basis`, which was built with these `parameters`. (As many
    /// coefficients are noted as the basis has functions.)
    pub fn new(
        original: &OriginalDigest,
        identity: Identity,
        secret: Secret,
        parameters: &Parameters,
        basis: &Basis,
    ) -> Self {
        let coefficients = basis.functions().len();
        let basis_options = BasisOptions { coefficients, ..parameters.basis };
        let parameters = Parameters { basis: basis_options, ..*parameters };
        Self::with_digest(original, identity, secret, parameters, &basis.digest())
    }

    /// The same for those who make many keys for one basis, whose [`Basis::digest`] it takes; `parameters` must
    /// have as many coefficients as the basis has functions.
    pub fn with_digest(
        original: &OriginalDigest,
        identity: Identity,
        secret: Secret,
        parameters: Parameters,
        basis: &[u8; 32],
    ) -> Self {
        Self {
            watermark: original.watermark(&identity, &secret, parameters.basis.coefficients),
            identity,
            secret,
            parameters,
            original_sha256: original.sha256(),
            basis_sha256: matrix_digest(basis, parameters.epsilon),
            timestamp: None,
        }
    }

    /// Reads a key file.
    ///
    /// # Errors
    /// [`KeyError`] when it is not one, or is damaged.
    pub fn from_json(bytes: &[u8]) -> Result<Self, KeyError> {
        let syntax = |e: serde_json::Error| KeyError::Syntax { detail: e.to_string() };
        let head = match serde_json::from_slice::<Head>(bytes) {
            Ok(head) => head,
            // Other JSON, a list say.
            Err(e) if e.is_data() && !bytes.trim_ascii_start().starts_with(b"{") => Head::default(),
            Err(e) => return Err(syntax(e)),
        };
        if head.format.as_deref() != Some(FORMAT) {
            return Err(KeyError::Syntax { detail: format!("the field `format` is not \"{FORMAT}\"") });
        }
        let version = head.version.unwrap_or(0);
        if version != u64::from(VERSION) {
            return Err(KeyError::Version { found: u32::try_from(version).unwrap_or(u32::MAX) });
        }
        serde_json::from_slice::<File>(bytes).map_err(syntax)?.try_into()
    }

    /// The key file: indented JSON with a line end.
    pub fn to_json(&self) -> String {
        let file = File {
            format: FORMAT.into(),
            version: VERSION,
            created_by: concat!("sombrero ", env!("CARGO_PKG_VERSION")).into(),
            owner: self.identity.owner.clone(),
            recipient: self.identity.recipient.clone(),
            coefficients: self.parameters.basis.coefficients,
            epsilon: self.parameters.epsilon,
            basis: self.parameters.basis.function.to_string(),
            amplitudes: self.parameters.basis.amplitudes.to_string(),
            original_sha256: hex::encode(self.original_sha256),
            basis_sha256: hex::encode(self.basis_sha256),
            secret: self.secret.to_hex(),
            watermark: self.watermark.clone(),
            timestamp: self.timestamp.as_ref().map(|token| BASE64_STANDARD.encode(token)),
        };
        let text = serde_json::to_string_pretty(&file).expect("strings and finite numbers are JSON");
        text + "\n"
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

    /// Whether the key is genuine: made for this original, its w derived from its secret, and its basis the
    /// one that is computed now.
    ///
    /// # Errors
    /// The first [`Mismatch`].
    pub fn check(&self, original: &OriginalDigest, basis: &Basis) -> Result<(), Mismatch> {
        self.check_watermark(original)?;
        self.check_basis(&basis.digest())
    }

    /// Whether the key was made for this original, and its w derived from its secret.
    ///
    /// # Errors
    /// [`Mismatch::Original`] or [`Mismatch::Watermark`].
    pub fn check_watermark(&self, original: &OriginalDigest) -> Result<(), Mismatch> {
        self.check_original(original)?;
        let derived = original.watermark(&self.identity, &self.secret, self.watermark.len());
        match derived.iter().zip(&self.watermark).position(|(a, b)| a != b) {
            Some(coefficient) => Err(Mismatch::Watermark { coefficient }),
            None => Ok(()),
        }
    }

    /// Whether the basis with this [`Basis::digest`], with the key's strength, is what was marked with.
    ///
    /// # Errors
    /// [`Mismatch::Basis`] when it is not.
    pub fn check_basis(&self, basis: &[u8; 32]) -> Result<(), Mismatch> {
        let digest = matrix_digest(basis, self.parameters.epsilon);
        if digest == self.basis_sha256 { Ok(()) } else { Err(Mismatch::Basis) }
    }
}

fn matrix_digest(basis: &[u8; 32], epsilon: f64) -> [u8; 32] {
    let mut hash = Sha256::new();
    hash.update(basis);
    hash.update(epsilon.to_le_bytes());
    hash.finalize().into()
}

impl TryFrom<File> for Key {
    type Error = KeyError;

    fn try_from(file: File) -> Result<Self, KeyError> {
        let wrong = |field, detail: String| KeyError::Field { field, detail };
        let m = file.coefficients;
        if m == 0 || m > MOST_COEFFICIENTS {
            return Err(wrong("coefficients", format!("{m} is not between 1 and {MOST_COEFFICIENTS}")));
        }
        if file.watermark.len() != m {
            return Err(wrong(
                "watermark",
                format!("it has {} numbers for {m} coefficients", file.watermark.len()),
            ));
        }
        if !(file.epsilon > 0.0 && file.epsilon.is_finite()) {
            return Err(wrong("epsilon", format!("{} is not a positive number", file.epsilon)));
        }
        let hash = |field, text: &str| {
            let mut bytes = [0; 32];
            hex::decode_to_slice(text, &mut bytes)
                .map_err(|_| wrong(field, "it is not 64 hexadecimal digits".into()))?;
            Ok(bytes)
        };
        let function = file.basis.parse::<BasisFunction>().map_err(|e| wrong("basis", e.to_string()))?;
        let amplitudes =
            file.amplitudes.parse::<Amplitudes>().map_err(|e| wrong("amplitudes", e.to_string()))?;
        let timestamp = file.timestamp.map(|text| BASE64_STANDARD.decode(text)).transpose();
        Ok(Self {
            timestamp: timestamp.map_err(|e| wrong("timestamp", e.to_string()))?,
            original_sha256: hash("original_sha256", &file.original_sha256)?,
            basis_sha256: hash("basis_sha256", &file.basis_sha256)?,
            secret: Secret::from_hex(&file.secret).map_err(|e| wrong("secret", e.to_string()))?,
            identity: Identity { owner: file.owner, recipient: file.recipient },
            parameters: Parameters {
                basis: BasisOptions { coefficients: m, function, amplitudes },
                epsilon: file.epsilon,
            },
            watermark: file.watermark,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;
    use sombrero_mesh::repair;
    use sombrero_progressive::ProgressiveMesh;
    use sombrero_shapes as shapes;

    fn basis(coefficients: usize) -> Basis {
        let made = repair(&shapes::bumpy_sphere(300));
        let mut progressive =
            ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite");
        Basis::new(&mut progressive, &made.points, &BasisOptions { coefficients, ..Default::default() })
            .unwrap()
    }

    fn key() -> Key {
        let identity = Identity { owner: "Alice, \"2026\"".into(), recipient: "№ 7".into() };
        Key::new(
            &OriginalDigest::of(b"file"),
            identity,
            Secret([9; 32]),
            &Preset::Paper.parameters(),
            &basis(5),
        )
    }

    #[test]
    fn a_key_survives_its_file_to_the_bit() {
        let key = key();
        assert!(!key.to_json().contains("timestamp"));
        let stamped = Key { timestamp: Some(vec![0, 255, 7]), ..key.clone() };
        assert_eq!(Key::from_json(stamped.to_json().as_bytes()), Ok(stamped));
        assert_eq!(Key::from_json(key.to_json().as_bytes()), Ok(key));
    }

    #[test]
    fn a_key_that_does_not_say_how_the_energy_is_shared_is_the_papers() {
        let key = key();
        let older = key.to_json().replacen("  \"amplitudes\": \"heights\",\n", "", 1);
        assert!(!older.contains("amplitudes"));
        assert_eq!(Key::from_json(older.as_bytes()), Ok(key));
    }

    #[test]
    fn a_genuine_key_is_told_from_edited_ones() {
        let (key, basis, file) = (key(), basis(5), OriginalDigest::of(b"file"));
        assert_eq!(key.check(&file, &basis), Ok(()));
        assert_eq!((key.check_watermark(&file), key.check_basis(&basis.digest())), (Ok(()), Ok(())));
        assert!(matches!(key.check(&OriginalDigest::of(b"other"), &basis), Err(Mismatch::Original { .. })));
        let mut edited = key.clone();
        edited.watermark[3] += 0.5;
        assert_eq!(edited.check(&file, &basis), Err(Mismatch::Watermark { coefficient: 3 }));
        let mut edited = key.clone();
        edited.identity.owner = "Mallory".into();
        assert_eq!(edited.check(&file, &basis), Err(Mismatch::Watermark { coefficient: 0 }));
        let mut edited = key;
        edited.parameters.epsilon *= 2.0;
        assert_eq!(edited.check(&file, &basis), Err(Mismatch::Basis));
    }

    #[test]
    fn damaged_files_are_refused_with_the_field() {
        let text = key().to_json();
        let refused = |from: &str, to: &str| {
            assert!(text.contains(from), "{from}");
            Key::from_json(text.replacen(from, to, 1).as_bytes()).unwrap_err()
        };
        assert!(matches!(Key::from_json(b""), Err(KeyError::Syntax { .. })));
        assert!(matches!(Key::from_json(&text.as_bytes()[..100]), Err(KeyError::Syntax { .. })));
        assert!(matches!(Key::from_json(b"{\"format\": \"other\"}"), Err(KeyError::Syntax { .. })));
        assert_eq!(refused("\"version\": 1", "\"version\": 9"), KeyError::Version { found: 9 });
        assert!(matches!(
            refused("\"epsilon\": 0.01", "\"epsilon\": -1"),
            KeyError::Field { field: "epsilon", .. }
        ));
        assert!(matches!(
            refused("\"coefficients\": 5", "\"coefficients\": 6"),
            KeyError::Field { field: "watermark", .. }
        ));
        assert!(matches!(
            refused("\"coefficients\": 5", "\"coefficients\": 0"),
            KeyError::Field { field: "coefficients", .. }
        ));
        assert!(matches!(
            refused("\"basis\": \"sombrero\"", "\"basis\": \"cap\""),
            KeyError::Field { field: "basis", .. }
        ));
        assert!(matches!(
            refused("\"amplitudes\": \"heights\"", "\"amplitudes\": \"widths\""),
            KeyError::Field { field: "amplitudes", .. }
        ));
        assert!(matches!(refused("0909", "09"), KeyError::Field { field: "secret", .. }));
        assert!(matches!(refused("\"owner\"", "\"owners\""), KeyError::Syntax { .. }));
    }
}
