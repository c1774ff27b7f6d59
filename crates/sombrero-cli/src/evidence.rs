//! What `detect` puts beside its figures so that `verify` can find all of them again: files, settings, program.

use crate::args::{Method, When};
use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use sombrero::DetectOptions;
use sombrero::report::FileLabel;
use std::path::Path;

/// This program and its version.
pub(crate) const PROGRAM: &str = concat!("sombrero ", env!("CARGO_PKG_VERSION"));

/// How a detection came about.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Evidence {
    pub(crate) program: String,
    pub(crate) files: Files,
    pub(crate) settings: Settings,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Files {
    pub(crate) suspect: FileHash,
    pub(crate) original: FileHash,
    pub(crate) key: FileHash,
    /// [`Key::commitment`](sombrero::watermark::Key::commitment) in hexadecimal digits: the key, whatever timestamp is
    /// stored with it later.
    pub(crate) commitment: String,
}

/// A file as it was named, and the SHA-256 of what it held.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct FileHash {
    pub(crate) path: String,
    pub(crate) sha256: String,
}

impl FileHash {
    pub(crate) fn new(path: &Path, content: &[u8]) -> Self {
        Self { path: path.display().to_string(), sha256: hex::encode(Sha256::digest(content)) }
    }

    pub(crate) fn label(&self) -> FileLabel<'_> {
        FileLabel { name: &self.path, sha256: &self.sha256 }
    }
}

/// Everything that the figures depend on beside the files.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Settings {
    pub(crate) method: Method,
    pub(crate) registration: When,
    pub(crate) resampling: When,
    pub(crate) threshold: f64,
    pub(crate) seed: u64,
}

impl Default for Settings {
    /// Those of `detect` when nothing else is asked for.
    fn default() -> Self {
        let DetectOptions { threshold, seed, .. } = DetectOptions::default();
        let (method, registration, resampling) = (Method::Robust, When::Auto, When::Auto);
        Self { method, registration, resampling, threshold, seed }
    }
}

impl Settings {
    pub(crate) fn options(&self) -> DetectOptions {
        DetectOptions {
            method: self.method.into(),
            registration: self.registration.into(),
            resampling: self.resampling.into(),
            threshold: self.threshold,
            seed: self.seed,
        }
    }
}

impl Evidence {
    /// The command line that repeats the test.
    pub(crate) fn command(&self) -> String {
        let Files { suspect, original, key, .. } = &self.files;
        let Settings { method, registration, resampling, threshold, seed } = self.settings;
        format!(
            "sombrero detect {} --original {} --key {} --method {} --threshold {threshold:e} --registration {} --resampling {} --seed {seed}",
            quoted(&suspect.path),
            quoted(&original.path),
            quoted(&key.path),
            name(method),
            name(registration),
            name(resampling),
        )
    }
}

/// As the command line has it.
fn name(value: impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

/// For a POSIX shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-/+:".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}
