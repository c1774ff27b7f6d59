//! The originals of a catalogue and their keys, wherever they are.

use super::vault_of;
use crate::answer::Context;
use crate::desk::Desk;
use crate::failure::Failure;
use crate::files;
use crate::key_folder::KeyFolder;
use sombrero::io::{Document, Limits};
use sombrero::watermark::{Key, OriginalDigest};
use sombrero_catalogue::Entry;
use sombrero_vault::{KeptFile, Opened};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A key, and the file that holds it.
#[derive(Clone)]
pub(crate) struct KeptKey {
    pub(crate) path: PathBuf,
    /// The content of the key file.
    pub(crate) bytes: Vec<u8>,
    pub(crate) key: Key,
}

/// Where originals and keys of a catalogue are read from.
pub(crate) struct Originals {
    catalogue: PathBuf,
    opened: Option<Opened>,
    /// Keys of a folder, by the digest of their original; without one, those that are kept.
    folder: Option<BTreeMap<[u8; 32], Vec<KeptKey>>>,
    limits: Limits,
}

impl Originals {
    /// Those of this catalogue: of a vault that was opened, and with the keys of a folder instead of those that are kept.
    pub(crate) fn new(
        catalogue: &Path,
        opened: Option<Opened>,
        folder: Option<KeyFolder>,
        context: &Context,
    ) -> Result<Self, Failure> {
        let folder = folder.map(|folder| by_original(folder, context.desk)).transpose()?;
        Ok(Self { catalogue: catalogue.to_owned(), opened, folder, limits: context.limits })
    }

    /// The keys of an original, each once. Of one that is kept with and without a timestamp, that with it.
    pub(crate) fn keys(&self, entry: &Entry) -> Result<Vec<KeptKey>, Failure> {
        if let Some(folder) = &self.folder {
            return Ok(folder.get(&entry.digest).cloned().unwrap_or_default());
        }
        let Some(opened) = &self.opened else { return Ok(Vec::new()) };
        let limits = self.limits.with_max_bytes(files::LARGEST_KEY);
        let mut keys: BTreeMap<[u8; 32], KeptKey> = BTreeMap::new();
        for (path, bytes) in opened.keys(&entry.digest, limits)? {
            let key = files::parse_key(&path, &bytes)?;
            let new = KeptKey { path, bytes, key };
            let slot = keys.entry(new.key.commitment());
            let kept = slot.or_insert_with(|| new.clone());
            if kept.key.timestamp.is_none() && new.key.timestamp.is_some() {
                *kept = new;
            }
        }
        Ok(keys.into_values().collect())
    }

    /// The files of an original that is kept, exactly as they were.
    pub(crate) fn files(&self, entry: &Entry) -> Result<Vec<KeptFile>, Failure> {
        let Some(opened) = &self.opened else { return Err(self.nowhere(entry, "it is not kept")) };
        Ok(opened.original(&entry.digest, self.limits)?)
    }

    /// An original: as it is kept, or from where it was when it was added, if it is still the same.
    pub(crate) fn document(&self, entry: &Entry) -> Result<Document, Failure> {
        if let Some(opened) = &self.opened
            && let Ok(files) = opened.original(&entry.digest, self.limits)
        {
            return self.parsed(entry, files);
        }
        let path = Path::new(&entry.place);
        let found = Document::read_within(path, self.limits)
            .map_err(|_| self.nowhere(entry, "it is not where it was when it was added"))?;
        self.checked(entry, found)
    }

    /// The document of files that are kept.
    pub(crate) fn parsed(&self, entry: &Entry, mut files: Vec<KeptFile>) -> Result<Document, Failure> {
        let own = files.remove(0);
        let others: Vec<(String, Vec<u8>)> = files.into_iter().map(|file| (file.name, file.bytes)).collect();
        let extension = Path::new(&own.name).extension().and_then(|e| e.to_str()).map(str::to_owned);
        let document = Document::parse_together(own.bytes, extension.as_deref(), &others, self.limits);
        let vault = vault_of(&self.catalogue);
        self.checked(entry, document.map_err(|e| Failure::about("vault", &vault, &e))?)
    }

    fn checked(&self, entry: &Entry, found: Document) -> Result<Document, Failure> {
        if OriginalDigest::of(found.parts()).sha256() == entry.digest {
            return Ok(found);
        }
        Err(self.nowhere(entry, "its file was changed since it was added"))
    }

    fn nowhere(&self, entry: &Entry, why: &str) -> Failure {
        let Entry { name, place, .. } = entry;
        let message = format!(
            "{name}: the original cannot be had from {}: {why} ({place}); put the file there again, and add it with --keep",
            self.catalogue.display()
        );
        Failure::new("catalogue", message)
    }
}

fn by_original(folder: KeyFolder, desk: &Desk) -> Result<BTreeMap<[u8; 32], Vec<KeptKey>>, Failure> {
    let mut by_original: BTreeMap<[u8; 32], Vec<KeptKey>> = BTreeMap::new();
    for (path, key) in folder.paths.into_iter().zip(folder.keys) {
        let bytes = files::key_file(&path, desk)?;
        by_original.entry(key.original_sha256).or_default().push(KeptKey { path, bytes, key });
    }
    Ok(by_original)
}
