//! An owner who has the program: marks an original, and asks about suspects.

use crate::experiments::case::secret_of_seed;
use crate::experiments::program::Program;
use anyhow::Context;
use serde::Serialize;
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::Soup;
use sombrero::watermark::Preset;
use std::path::{Path, PathBuf};

/// The program and a folder for its files, which goes with it.
pub(super) struct Owner {
    program: Program,
    folder: PathBuf,
}

/// What the program answered, and what that took.
#[derive(Serialize)]
pub(super) struct Answer {
    pub(super) log10_p: f64,
    pub(super) seconds: f64,
    pub(super) cpu: f64,
    pub(super) megabytes: f64,
}

/// An original that was marked.
pub(super) struct Mark<'a> {
    owner: &'a Owner,
    original: PathBuf,
    key: PathBuf,
    pub(super) copy: Soup,
}

impl Owner {
    pub(super) fn new() -> anyhow::Result<Self> {
        let folder = std::env::temp_dir().join(format!("sombrero-suspects-{}", std::process::id()));
        std::fs::create_dir_all(&folder)?;
        Ok(Self { program: Program::build()?, folder })
    }

    /// Writes a mesh.
    pub(super) fn keep(&self, name: &str, soup: &Soup) -> anyhow::Result<PathBuf> {
        let path = self.folder.join(name).with_extension("ply");
        std::fs::write(&path, encode(Format::PlyBinaryLittleEndian, soup)?)?;
        Ok(path)
    }

    pub(super) fn mark(&self, original: &Path, preset: Preset, seed: u64) -> anyhow::Result<Mark<'_>> {
        let secret = self.folder.join("secret");
        std::fs::write(&secret, hex::encode(secret_of_seed(seed)?.0))?;
        let ending = original.extension().unwrap_or_default();
        let (copy, key) = (self.folder.join("marked").with_extension(ending), self.folder.join("key"));
        let paths = [original, &copy, &key, &secret].map(|path| path.display().to_string());
        let [from, to, key_path, secret] = &paths;
        let options = ["--key", key_path, "--secret-file", secret, "--preset", preset.name(), "--force"];
        self.program.run(&[&["embed", from, "-o", to], &options[..]].concat())?;
        let copy = Document::read(&copy)?.soup().clone();
        Ok(Mark { owner: self, original: original.to_owned(), key, copy })
    }
}

impl Drop for Owner {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

impl Mark<'_> {
    pub(super) fn look(&self, suspect: &Soup) -> anyhow::Result<Answer> {
        let suspect = self.owner.keep("suspect", suspect)?;
        let [suspect, original, key] =
            [&suspect, &self.original, &self.key].map(|path| path.display().to_string());
        let arguments = ["detect", &suspect, "--original", &original, "--key", &key];
        let (used, _) = self.owner.program.ask(&arguments)?;
        let log10_p = used.answer["log10_p"].as_f64().context("an answer has log10_p")?;
        Ok(Answer { log10_p, seconds: used.seconds, cpu: used.cpu, megabytes: used.megabytes })
    }
}
