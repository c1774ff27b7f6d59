//! A catalogue as it was when it was opened.

use std::collections::HashSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::candidate::Candidate;
use crate::entry::{Entry, hash};
use crate::error::{CatalogueError, Damage};
use crate::fate::{Fate, fate};
use crate::manifest::Manifest;
use crate::question::Question;
use crate::search::{SearchOptions, search};
use crate::segment::Segment;

/// How often files may be merged away while they are being opened.
const ATTEMPTS: usize = 20;

/// Originals on disk, opened for questions. What another process adds or removes later is seen by whoever opens it again;
/// any number of processes may read while one writes.
#[derive(Debug)]
pub struct Catalogue {
    folder: PathBuf,
    /// Oldest first.
    pub(crate) segments: Vec<Segment>,
}

impl Catalogue {
    /// Opens the folder of a catalogue: some milliseconds, and half a second for a million entries.
    ///
    /// # Errors
    /// [`CatalogueError::NotACatalogue`] when it is none, [`CatalogueError::Io`] when it cannot be read.
    pub fn open(folder: &Path) -> Result<Self, CatalogueError> {
        let mut attempts = 0;
        loop {
            let manifest = Manifest::read(folder)?;
            match Self::of(folder, &manifest) {
                // The writer has put others in the place of these files.
                Err(CatalogueError::Io { source, .. })
                    if source.kind() == ErrorKind::NotFound && attempts < ATTEMPTS =>
                {
                    attempts += 1;
                }
                opened => return opened,
            }
        }
    }

    fn of(folder: &Path, manifest: &Manifest) -> Result<Self, CatalogueError> {
        let sealed = manifest.sealed.iter().map(|&number| (number, true));
        let numbers: Vec<(u32, bool)> = sealed.chain([(manifest.open, false)]).collect();
        let open = |&(number, sealed): &(u32, bool)| Segment::open(folder, number, sealed);
        let mut segments: Vec<Segment> = numbers.par_iter().map(open).collect::<Result<_, _>>()?;
        let mut removed = HashSet::new();
        segments.iter_mut().rev().for_each(|segment| segment.remove(&mut removed));
        Ok(Self { folder: folder.to_owned(), segments })
    }

    /// How many entries there are.
    pub fn len(&self) -> usize {
        self.segments.iter().map(|segment| segment.living().count()).sum()
    }

    /// Whether there is no entry.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All entries, by name. Reads the whole catalogue.
    ///
    /// # Errors
    /// [`CatalogueError`] when they cannot be read.
    pub fn entries(&self) -> Result<Vec<Entry>, CatalogueError> {
        let living = |segment: &Segment| -> Result<Vec<Entry>, CatalogueError> {
            segment.living().map(|entry| Ok(segment.read(entry)?.0)).collect()
        };
        let found: Vec<Vec<Entry>> = self.segments.par_iter().map(living).collect::<Result<_, _>>()?;
        let mut entries = found.concat();
        entries.sort();
        Ok(entries)
    }

    /// The entry of a name.
    ///
    /// # Errors
    /// [`CatalogueError`] when it cannot be read.
    pub fn entry(&self, name: &str) -> Result<Option<Entry>, CatalogueError> {
        let hash = hash(name);
        let found = self.segments.iter().find_map(|segment| Some((segment, segment.find(hash)?)));
        let entry = found.map(|(segment, entry)| segment.read(entry)).transpose()?;
        Ok(entry.map(|(entry, _)| entry).filter(|entry| entry.name == name))
    }

    /// The models that a suspect may have been made from, best first. The same for any number of threads, any order in
    /// which entries were added, and however they lie in files.
    ///
    /// # Errors
    /// [`CatalogueError::Io`] when the catalogue cannot be read, [`CatalogueError::Damaged`] when an entry that would be
    /// compared is damaged.
    pub fn search(
        &self,
        question: &Question,
        options: &SearchOptions,
    ) -> Result<Vec<Candidate>, CatalogueError> {
        search(&self.segments, question, options)
    }

    /// How far the entry of a name comes in a search: for whoever asks why it was not found. As slow as a search.
    ///
    /// # Errors
    /// As [`Catalogue::search`].
    pub fn fate(&self, question: &Question, name: &str) -> Result<Fate, CatalogueError> {
        fate(&self.segments, question, name)
    }

    /// Reads everything and names what is damaged; nothing when all is well.
    ///
    /// # Errors
    /// [`CatalogueError::Io`] when it cannot be read.
    pub fn verify(&self) -> Result<Vec<Damage>, CatalogueError> {
        let found: Vec<Vec<Damage>> =
            self.segments.par_iter().map(|segment| segment.verify(&self.folder)).collect::<Result<_, _>>()?;
        Ok(found.concat())
    }
}
