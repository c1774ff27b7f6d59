//! Putting originals into a catalogue.

use super::LockArgs;
use crate::failure::Failure;
use serde::Serialize;
use sombrero::io::Document;
use sombrero::watermark::OriginalDigest;
use sombrero_catalogue::{CatalogueError, Editor, Entry, Portrait};
use sombrero_vault::Vault;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Another run that adds is waited for this long.
const PATIENCE: Duration = Duration::from_secs(20);

/// An original as a catalogue takes it.
pub(crate) struct Described {
    document: Document,
    path: PathBuf,
    name: String,
    pub(crate) digest: [u8; 32],
    portrait: Option<Portrait>,
}

impl Described {
    /// The file that was read from `path`, called `name`; its shape is described unless `known` has its digest.
    pub(crate) fn new(
        document: Document,
        path: &Path,
        name: String,
        known: &BTreeMap<[u8; 32], String>,
    ) -> Result<Self, Failure> {
        let digest = OriginalDigest::of(document.parts()).sha256();
        let portrait = match known.contains_key(&digest) {
            true => None,
            false => Some(
                Portrait::of(document.points(), document.triangles())
                    .map_err(|e| Failure::about("mesh", path, &e))?,
            ),
        };
        Ok(Self { document, path: path.to_owned(), name, digest, portrait })
    }

    /// The files to keep: its own under its name, then all that it refers to.
    fn files(&self) -> Vec<(&str, &[u8])> {
        let own = Path::new(&self.name).file_name().and_then(|name| name.to_str()).unwrap_or("original");
        let others =
            self.document.companions().iter().map(|other| (other.name.as_str(), other.bytes.as_slice()));
        std::iter::once((own, self.document.bytes())).chain(others).collect()
    }
}

/// What became of an original.
#[derive(Debug, Serialize)]
pub(crate) struct Added {
    /// Its name in the catalogue.
    pub(crate) original: String,
    sha256: String,
    /// Whether it was in the catalogue before.
    pub(crate) kept: bool,
    /// What is new among what is kept encrypted; `None` where nothing is to be.
    pub(crate) encrypted: Option<Encrypted>,
}

#[derive(Debug, Serialize)]
pub(crate) struct Encrypted {
    /// Whether the original was not there before.
    pub(crate) original: bool,
    /// The number of keys that were not there before.
    pub(crate) keys: usize,
}

impl Added {
    /// What was kept, in words.
    pub(crate) fn encrypted_in_words(&self) -> Option<String> {
        let Encrypted { original, keys } = self.encrypted.as_ref()?;
        let keys = match keys {
            1 => "1 key".to_owned(),
            keys => format!("{keys} keys"),
        };
        Some(match original {
            true => format!("the original and {keys}, encrypted"),
            false => format!("{keys} that were not kept before, encrypted"),
        })
    }
}

/// A catalogue that originals are put into.
pub(crate) struct Adding {
    editor: Editor,
    /// The names of what is there, by digest.
    pub(crate) known: BTreeMap<[u8; 32], String>,
    vault: Option<Vault>,
}

impl Adding {
    /// The catalogue in this folder, or a new one. With a lock, originals and keys are kept in it. Asks for a passphrase
    /// where one is to be chosen.
    pub(crate) fn open(folder: &Path, lock: Option<&LockArgs>) -> Result<Self, Failure> {
        let editor = editor(folder)?;
        let entries = editor.catalogue()?.entries()?;
        let known = entries.into_iter().map(|entry| (entry.digest, entry.name)).collect();
        let vault = lock.map(|lock| lock.vault(folder)).transpose()?;
        Ok(Self { editor, known, vault })
    }

    /// Adds an original, and keeps it with these contents of key files. What is there already is passed over.
    ///
    /// The index comes last: what it names is kept.
    pub(crate) fn add(&mut self, described: Described, keys: &[Vec<u8>]) -> Result<Added, Failure> {
        let digest = described.digest;
        let encrypted = match &self.vault {
            Some(vault) => {
                let original = vault.keep_original(&digest, &described.files())?;
                let new =
                    keys.iter().map(|key| vault.keep_key(&digest, key)).collect::<Result<Vec<_>, _>>()?;
                Some(Encrypted { original, keys: new.into_iter().filter(|new| *new).count() })
            }
            None => None,
        };
        let sha256 = hex::encode(digest);
        let (original, kept) = match (self.known.get(&digest), described.portrait) {
            (Some(name), _) => (name.clone(), true),
            // Described as known, and not known any more: nobody else may change a catalogue that is held.
            (None, None) => return Err(Failure::new("internal", "an original was not described")),
            (None, Some(portrait)) => {
                let name = self.free(described.name, &sha256);
                let place = described.path.canonicalize().unwrap_or(described.path).display().to_string();
                let entry = Entry { name: name.clone(), digest, place, note: String::new() };
                self.editor.add(vec![(entry, portrait)])?;
                self.known.insert(digest, name.clone());
                (name, false)
            }
        };
        Ok(Added { original, sha256, kept, encrypted })
    }

    /// The name, or where another original has it, the name with the beginning of the digest.
    fn free(&self, name: String, sha256: &str) -> String {
        if self.editor.contains(&name) { format!("{name}#{}", &sha256[..8]) } else { name }
    }
}

/// The one who changes the catalogue in this folder, which is made if there is none. Waits a while for another run.
fn editor(folder: &Path) -> Result<Editor, Failure> {
    let start = Instant::now();
    let is_there = fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
    if !is_there {
        make(folder)?;
    }
    loop {
        match Editor::open(folder) {
            Err(CatalogueError::Busy { .. }) if start.elapsed() < PATIENCE => {
                std::thread::sleep(Duration::from_millis(100));
            }
            opened => return Ok(opened?),
        }
    }
}

/// Makes a catalogue under another name, then names it: one that was half made would be none. Where another run named
/// its own first, that one stays.
fn make(folder: &Path) -> Result<(), Failure> {
    let Some(own) = folder.file_name() else {
        Editor::create(folder)?;
        return Ok(());
    };
    let mut name = OsString::from(format!(".sombrero-{}-", std::process::id()));
    name.push(own);
    let made = folder.with_file_name(name);
    Editor::create(&made)?;
    // Some systems do not put a folder in the place of an empty one.
    let _ = fs::remove_dir(folder);
    let named = fs::rename(&made, folder);
    if named.is_err() {
        // Nothing is in it that anybody would miss.
        let _ = fs::remove_dir_all(&made);
    }
    match named {
        Err(e) if !folder.is_dir() => {
            let message =
                format!("{}: the catalogue cannot be made ({e}); choose another place", folder.display());
            Err(Failure::new("write", message))
        }
        _ => Ok(()),
    }
}
