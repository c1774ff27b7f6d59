//! What a report says beside its figures so that others can find all of them again: files, settings, program.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use sombrero::DetectOptions;
use sombrero::io::Document;
use sombrero::watermark::{Key, OriginalDigest};

/// The program that makes reports, and its version.
pub const PROGRAM: &str = concat!("sombrero ", env!("CARGO_PKG_VERSION"));

/// The circumstances of a detection: program, files, settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// The program that made the detection, with its version.
    pub program: String,
    /// The files that it read.
    pub files: Files,
    /// The settings: everything that the figures depend on beside the files.
    pub settings: DetectOptions,
}

/// The files of a detection.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Files {
    /// The suspect, with the files that it refers to.
    pub suspect: FileHash,
    /// The original, with the files that it refers to.
    pub original: FileHash,
    /// The key.
    pub key: FileHash,
    /// [`Key::commitment`] in hexadecimal digits: the key, whatever timestamp is stored with it later.
    pub commitment: String,
}

/// A file as it was named, and the SHA-256 of what it held.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileHash {
    /// The name or path that people know it by; nothing is opened by it here.
    pub path: String,
    /// 64 hexadecimal digits.
    pub sha256: String,
}

impl FileHash {
    /// The hash of `content` under a name.
    pub fn new(path: impl Into<String>, content: &[u8]) -> Self {
        Self { path: path.into(), sha256: hex::encode(Sha256::digest(content)) }
    }

    /// The hash of a mesh with all files that belong to it, as keys have that of their original.
    pub fn of_mesh(path: impl Into<String>, mesh: &Document) -> Self {
        Self { path: path.into(), sha256: hex::encode(OriginalDigest::of(mesh.parts()).sha256()) }
    }
}

impl Evidence {
    /// The evidence of a detection by this program.
    pub fn new(
        suspect: FileHash,
        original: FileHash,
        key_file: FileHash,
        key: &Key,
        settings: DetectOptions,
    ) -> Self {
        let commitment = hex::encode(key.commitment());
        let files = Files { suspect, original, key: key_file, commitment };
        Self { program: PROGRAM.to_owned(), files, settings }
    }

    /// The command line that repeats the test, for a POSIX shell.
    pub fn command(&self) -> String {
        let Files { suspect, original, key, .. } = &self.files;
        let DetectOptions { method, registration, resampling, threshold, seed, budget } = self.settings;
        let budget = budget.map(|seconds| format!(" --budget {seconds}")).unwrap_or_default();
        format!(
            "sombrero detect {} --original {} --key {} --method {} --threshold {threshold:e} --registration {} --resampling {} --seed {seed}{budget}",
            quoted(&suspect.path),
            quoted(&original.path),
            quoted(&key.path),
            method.name(),
            registration.name(),
            resampling.name(),
        )
    }
}

/// A word for a POSIX shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-/+:".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_needs_it() {
        assert_eq!(quoted("scans/vase-2.obj"), "scans/vase-2.obj");
        assert_eq!(quoted("the vase's.obj"), "'the vase'\\''s.obj'");
        assert_eq!(quoted(""), "''");
    }
}
