//! The key file: a key as indented JSON.

use crate::derivation::{self, Derivation};
use crate::hash_tree::{self, Path, Sibling};
use crate::key::Key;
use crate::parameters::{COEFFICIENTS, EPSILONS, Parameters, Preset};
use crate::sequence::{Identity, Secret};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde::{Deserialize, Serialize};
use sombrero_basis::{Amplitudes, BasisFunction, BasisOptions};
use thiserror::Error;

const FORMAT: &str = "sombrero-key";
/// The version of key files that this program writes and reads.
pub const KEY_VERSION: u32 = 2;

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
        "the key has format version {found}, this program reads {KEY_VERSION}; {}", cure(*found)
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

/// Version 1 could be forged, and was never released.
fn cure(found: u32) -> &'static str {
    if found == 1 {
        "version 1 proves nothing and was never released: mark the original anew"
    } else {
        "use the program that wrote it"
    }
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
    preset: Option<String>,
    coefficients: usize,
    epsilon: f64,
    basis: String,
    amplitudes: String,
    derivation: Cost,
    original_sha256: String,
    basis_sha256: String,
    secret: String,
    watermark: Vec<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    path: Option<Vec<Step>>,
    /// In base64.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    timestamp: Option<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Cost {
    algorithm: String,
    memory_kib: u32,
    passes: u32,
    lanes: u32,
}

/// A sibling in the tree of commitments.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Step {
    Left(String),
    Right(String),
}

impl Key {
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
        if version != u64::from(KEY_VERSION) {
            return Err(KeyError::Version { found: u32::try_from(version).unwrap_or(u32::MAX) });
        }
        serde_json::from_slice::<File>(bytes).map_err(syntax)?.try_into()
    }

    /// The key file: indented JSON with a line end.
    pub fn to_json(&self) -> String {
        let file = File {
            format: FORMAT.into(),
            version: KEY_VERSION,
            created_by: concat!("sombrero ", env!("CARGO_PKG_VERSION")).into(),
            owner: self.identity.owner.clone(),
            recipient: self.identity.recipient.clone(),
            preset: self.parameters.preset.map(|preset| preset.to_string()),
            coefficients: self.parameters.basis.coefficients,
            epsilon: self.parameters.epsilon,
            basis: self.parameters.basis.function.to_string(),
            amplitudes: self.parameters.basis.amplitudes.to_string(),
            derivation: Cost {
                algorithm: derivation::ALGORITHM.to_owned(),
                memory_kib: self.derivation.memory_kib,
                passes: self.derivation.passes,
                lanes: self.derivation.lanes,
            },
            original_sha256: hex::encode(self.original_sha256),
            basis_sha256: hex::encode(self.basis_sha256),
            secret: self.secret.to_hex(),
            watermark: self.watermark.clone(),
            path: self.path.as_ref().map(|path| path.0.iter().map(Step::from).collect()),
            timestamp: self.timestamp.as_ref().map(|token| BASE64_STANDARD.encode(token)),
        };
        let text = serde_json::to_string_pretty(&file).expect("strings and finite numbers are JSON");
        text + "\n"
    }
}

impl From<&Sibling> for Step {
    fn from(sibling: &Sibling) -> Self {
        match sibling {
            Sibling::Left(hash) => Self::Left(hex::encode(hash)),
            Sibling::Right(hash) => Self::Right(hex::encode(hash)),
        }
    }
}

fn wrong(field: &'static str, detail: impl Into<String>) -> KeyError {
    KeyError::Field { field, detail: detail.into() }
}

fn hash(field: &'static str, text: &str) -> Result<[u8; 32], KeyError> {
    let mut bytes = [0; 32];
    hex::decode_to_slice(text, &mut bytes).map_err(|_| wrong(field, "it is not 64 hexadecimal digits"))?;
    Ok(bytes)
}

impl TryFrom<&Cost> for Derivation {
    type Error = KeyError;

    fn try_from(cost: &Cost) -> Result<Self, KeyError> {
        let Cost { ref algorithm, memory_kib, passes, lanes } = *cost;
        if algorithm != derivation::ALGORITHM {
            return Err(wrong("derivation", format!("its algorithm is not {}", derivation::ALGORITHM)));
        }
        let derivation = Self { memory_kib, passes, lanes };
        if derivation.is_acceptable() {
            return Ok(derivation);
        }
        let standard = Self::STANDARD;
        Err(wrong("derivation", format!("{derivation} is cheaper than {standard}, or too dear")))
    }
}

fn path(steps: &[Step]) -> Result<Path, KeyError> {
    if steps.len() > hash_tree::DEEPEST {
        return Err(wrong("path", format!("it has more than {} steps", hash_tree::DEEPEST)));
    }
    let step = |step: &Step| {
        Ok(match step {
            Step::Left(text) => Sibling::Left(hash("path", text)?),
            Step::Right(text) => Sibling::Right(hash("path", text)?),
        })
    };
    steps.iter().map(step).collect::<Result<_, _>>().map(Path)
}

impl TryFrom<File> for Key {
    type Error = KeyError;

    fn try_from(file: File) -> Result<Self, KeyError> {
        let (m, epsilon) = (file.coefficients, file.epsilon);
        if !COEFFICIENTS.contains(&m) {
            let (fewest, most) = (COEFFICIENTS.start(), COEFFICIENTS.end());
            return Err(wrong("coefficients", format!("{m} is not between {fewest} and {most}")));
        }
        if file.watermark.len() != m {
            let detail = format!("it has {} numbers for {m} coefficients", file.watermark.len());
            return Err(wrong("watermark", detail));
        }
        if !EPSILONS.contains(&epsilon) {
            let (least, most) = (EPSILONS.start(), EPSILONS.end());
            return Err(wrong("epsilon", format!("{epsilon} is not between {least} and {most}")));
        }
        let preset = file.preset.map(|name| name.parse::<Preset>()).transpose();
        let function = file.basis.parse::<BasisFunction>().map_err(|e| wrong("basis", e.to_string()))?;
        let amplitudes =
            file.amplitudes.parse::<Amplitudes>().map_err(|e| wrong("amplitudes", e.to_string()))?;
        if !amplitudes.suit(function) {
            return Err(wrong("amplitudes", format!("functions `{function}` have none by that rule")));
        }
        let timestamp = file.timestamp.map(|text| BASE64_STANDARD.decode(text)).transpose();
        Ok(Self {
            path: file.path.as_deref().map(path).transpose()?,
            timestamp: timestamp.map_err(|e| wrong("timestamp", e.to_string()))?,
            derivation: Derivation::try_from(&file.derivation)?,
            original_sha256: hash("original_sha256", &file.original_sha256)?,
            basis_sha256: hash("basis_sha256", &file.basis_sha256)?,
            secret: Secret::from_hex(&file.secret).map_err(|e| wrong("secret", e.to_string()))?,
            identity: Identity { owner: file.owner, recipient: file.recipient },
            parameters: Parameters {
                preset: preset.map_err(|e| wrong("preset", e.to_string()))?,
                basis: BasisOptions { coefficients: m, function, amplitudes },
                epsilon,
            },
            watermark: file.watermark,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::OriginalDigest;

    fn key() -> Key {
        let identity = Identity { owner: "Alice, \"2026\"".into(), recipient: "№ 7".into() };
        let parameters = Preset::Paper.parameters();
        let stub = Derivation::stub_for_experiments();
        let file = OriginalDigest::of_file(b"file");
        let key = Key::new(&file, identity, Secret([9; 32]), parameters, &[1; 32], stub);
        // Reading does not derive the watermark again.
        Key { derivation: Derivation::STANDARD, ..key }
    }

    #[test]
    fn a_key_survives_its_file_to_the_bit() {
        let key = key();
        assert!(!key.to_json().contains("timestamp") && !key.to_json().contains("path"));
        let path = Some(Path(vec![Sibling::Left([7; 32]), Sibling::Right([8; 32])]));
        let stamped = Key { timestamp: Some(vec![0, 255, 7]), path, ..key.clone() };
        assert_eq!(Key::from_json(stamped.to_json().as_bytes()), Ok(stamped));
        let alone = Key { path: Some(Path::default()), ..key.clone() };
        assert_eq!(Key::from_json(alone.to_json().as_bytes()), Ok(alone));
        let parameters = Parameters { preset: None, ..key.parameters };
        let chosen = Key { parameters, ..key.clone() };
        assert_eq!(Key::from_json(chosen.to_json().as_bytes()), Ok(chosen));
        assert_eq!(Key::from_json(key.to_json().as_bytes()), Ok(key));
    }

    #[test]
    fn a_stub_is_no_key() {
        let stub = Key { derivation: Derivation::stub_for_experiments(), ..key() };
        let error = Key::from_json(stub.to_json().as_bytes()).unwrap_err();
        assert!(matches!(error, KeyError::Field { field: "derivation", .. }), "{error}");
    }

    #[test]
    fn keys_of_the_first_version_are_refused_with_the_reason() {
        let old = key().to_json().replacen("\"version\": 2", "\"version\": 1", 1);
        let error = Key::from_json(old.as_bytes()).unwrap_err();
        assert_eq!(error, KeyError::Version { found: 1 });
        assert!(error.to_string().ends_with("mark the original anew"), "{error}");
    }

    #[test]
    fn damaged_files_are_refused_with_the_field() {
        let stamped = Key { path: Some(Path(vec![Sibling::Left([7; 32])])), ..key() };
        let text = stamped.to_json();
        let refused = |from: &str, to: &str| {
            assert!(text.contains(from), "{from}");
            Key::from_json(text.replacen(from, to, 1).as_bytes()).unwrap_err()
        };
        assert!(matches!(Key::from_json(b""), Err(KeyError::Syntax { .. })));
        assert!(matches!(Key::from_json(&text.as_bytes()[..100]), Err(KeyError::Syntax { .. })));
        assert!(matches!(Key::from_json(b"{\"format\": \"other\"}"), Err(KeyError::Syntax { .. })));
        assert_eq!(refused("\"version\": 2", "\"version\": 9"), KeyError::Version { found: 9 });
        for (from, to, expected) in [
            ("\"epsilon\": 0.01", "\"epsilon\": -1", "epsilon"),
            ("\"epsilon\": 0.01", "\"epsilon\": 1e-9", "epsilon"),
            ("\"epsilon\": 0.01", "\"epsilon\": 0.11", "epsilon"),
            ("\"coefficients\": 50", "\"coefficients\": 51", "watermark"),
            ("\"coefficients\": 50", "\"coefficients\": 0", "coefficients"),
            ("\"coefficients\": 50", "\"coefficients\": 15", "coefficients"),
            ("\"coefficients\": 50", "\"coefficients\": 65537", "coefficients"),
            ("\"basis\": \"sombrero\"", "\"basis\": \"cap\"", "basis"),
            ("\"preset\": \"paper\"", "\"preset\": \"cheap\"", "preset"),
            ("\"amplitudes\": \"heights\"", "\"amplitudes\": \"widths\"", "amplitudes"),
            ("\"argon2id\"", "\"argon2i\"", "derivation"),
            ("\"memory_kib\": 65536", "\"memory_kib\": 65535", "derivation"),
            ("\"memory_kib\": 65536", "\"memory_kib\": 4294967295", "derivation"),
            ("\"passes\": 3", "\"passes\": 2", "derivation"),
            ("\"lanes\": 1", "\"lanes\": 4", "derivation"),
            ("0909", "09", "secret"),
            ("0707", "07", "path"),
        ] {
            let error = refused(from, to);
            assert!(matches!(&error, KeyError::Field { field, .. } if *field == expected), "{to}: {error}");
        }
        assert!(matches!(refused("\"owner\"", "\"owners\""), KeyError::Syntax { .. }));
        assert!(matches!(refused("\"lanes\": 1", "\"lanes\": -1"), KeyError::Syntax { .. }));
    }
}
