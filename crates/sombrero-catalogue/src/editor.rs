//! A catalogue that is being changed.

use std::collections::HashSet;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::catalogue::Catalogue;
use crate::entry::{Entry, LONGEST, hash};
use crate::error::CatalogueError;
use crate::log::{MAGIC, Step};
use crate::manifest::{Manifest, log_of, sync_folder};
use crate::merge;
use crate::portrait::Portrait;
use crate::segment::Segment;

const LOCK: &str = "lock";
/// Entries that are written before it is asked whether the log is full.
const CHUNK: usize = 256;

/// The one who may change a catalogue: held for as long as this value lives, freed by the system when its process ends.
#[derive(Debug)]
pub struct Editor {
    folder: PathBuf,
    manifest: Manifest,
    /// Hashes of the names that there are.
    names: HashSet<u64>,
    /// Entries added to the open log.
    fresh: usize,
    log: File,
    _lock: File,
}

impl Editor {
    /// Makes a new catalogue in `folder`, which is made too when there is none.
    ///
    /// # Errors
    /// [`CatalogueError::Exists`] when the folder holds anything, [`CatalogueError::Io`] when it cannot be written.
    pub fn create(folder: &Path) -> Result<Self, CatalogueError> {
        fs::create_dir_all(folder).map_err(CatalogueError::io(folder))?;
        if fs::read_dir(folder).map_err(CatalogueError::io(folder))?.next().is_some() {
            return Err(CatalogueError::Exists { path: folder.to_owned() });
        }
        new_log(folder, 0)?;
        Manifest::default().write(folder)?;
        Self::open(folder)
    }

    /// Opens a catalogue to change it. What a process that died had not finished to add is left out.
    ///
    /// # Errors
    /// [`CatalogueError::Busy`] when another one changes it, [`CatalogueError::NotACatalogue`] when it is none.
    pub fn open(folder: &Path) -> Result<Self, CatalogueError> {
        Manifest::read(folder)?;
        let held = folder.join(LOCK);
        let lock =
            OpenOptions::new().create(true).append(true).open(&held).map_err(CatalogueError::io(&held))?;
        lock.try_lock().map_err(|_| CatalogueError::Busy { path: folder.to_owned() })?;
        let manifest = Manifest::read(folder)?;
        let catalogue = Catalogue::open(folder)?;
        let names = hashes(&catalogue);
        let last = catalogue.segments.last();
        let (fresh, clean) = last.map_or((0, true), |s| (s.lists.head.entries.len(), s.clean));
        let path = log_of(folder, manifest.open);
        let log = OpenOptions::new().append(true).open(&path).map_err(CatalogueError::io(&path))?;
        let mut editor = Self { folder: folder.to_owned(), manifest, names, fresh, log, _lock: lock };
        if !clean {
            // Nothing is written behind what is not whole, and nothing is cut off: it may be damage.
            editor.seal()?;
        }
        Ok(editor)
    }

    /// Whether there is an entry of that name.
    pub fn contains(&self, name: &str) -> bool {
        self.names.contains(&hash(name))
    }

    /// Adds entries. When this returns they are on the disk, all of them; when it fails or the machine stops, none or the
    /// first few. Many at once cost one wait for the disk.
    ///
    /// # Errors
    /// [`CatalogueError::Taken`] when a name exists or comes twice, [`CatalogueError::Text`] when one cannot be a name,
    /// before anything is written; [`CatalogueError::Io`] when the disk refuses.
    pub fn add(&mut self, batch: Vec<(Entry, Portrait)>) -> Result<(), CatalogueError> {
        let mut names = HashSet::new();
        for (entry, _) in &batch {
            let texts = [&entry.name, &entry.place, &entry.note];
            if entry.name.is_empty() || texts.iter().any(|text| text.len() >= LONGEST) {
                return Err(CatalogueError::Text { name: entry.name.chars().take(80).collect() });
            }
            if self.contains(&entry.name) || !names.insert(hash(&entry.name)) {
                return Err(CatalogueError::Taken { name: entry.name.clone() });
            }
        }
        let mut batch = batch.into_iter();
        loop {
            let chunk: Vec<_> = batch.by_ref().take(CHUNK).map(|(entry, p)| Step::Add(entry, p)).collect();
            if chunk.is_empty() {
                return Ok(());
            }
            self.write(&chunk)?;
            self.fresh += chunk.len();
            let added = chunk.iter().filter_map(|step| match step {
                Step::Add(entry, _) => Some(hash(&entry.name)),
                Step::Remove(_) => None,
            });
            self.names.extend(added);
            if self.fresh >= merge::FULL {
                self.seal()?;
            }
        }
    }

    /// Removes the entry of a name; whether there was one.
    ///
    /// # Errors
    /// [`CatalogueError::Io`] when the disk refuses.
    pub fn remove(&mut self, name: &str) -> Result<bool, CatalogueError> {
        let known = self.contains(name);
        if known {
            self.write(&[Step::Remove(name.to_owned())])?;
            self.names.remove(&hash(name));
        }
        Ok(known)
    }

    /// Mends what is damaged. Inverted lists are made anew from the portraits; a portrait that is damaged is asked of
    /// `again`, which is told the entry and may answer `None`: then the entry is dropped. Names of the entries that were
    /// dropped, or where they stood when the name is damaged too.
    ///
    /// # Errors
    /// [`CatalogueError::Io`] when the disk refuses.
    pub fn rebuild(
        &mut self,
        again: &mut dyn FnMut(&Entry) -> Option<Portrait>,
    ) -> Result<Vec<String>, CatalogueError> {
        self.seal()?;
        let dropped = merge::rebuild(&self.folder, &mut self.manifest, again)?;
        self.names = hashes(&self.catalogue()?);
        Ok(dropped)
    }

    /// The catalogue as it is now.
    ///
    /// # Errors
    /// As [`Catalogue::open`].
    pub fn catalogue(&self) -> Result<Catalogue, CatalogueError> {
        Catalogue::open(&self.folder)
    }

    fn write(&mut self, steps: &[Step]) -> Result<(), CatalogueError> {
        let bytes: Vec<u8> = steps.iter().flat_map(Step::frame).collect();
        let path = log_of(&self.folder, self.manifest.open);
        let written = self.log.write_all(&bytes).and_then(|()| self.log.sync_data());
        if let Err(source) = written {
            // A full disk may have taken a part of it, behind which nothing must be written.
            let _ = self.seal();
            return Err(CatalogueError::Io { path, source });
        }
        Ok(())
    }

    /// Ends the open log and begins another one.
    fn seal(&mut self) -> Result<(), CatalogueError> {
        let mut manifest = self.manifest.clone();
        merge::seal(&self.folder, manifest.open)?;
        manifest.sealed.push(manifest.open);
        manifest.open = manifest.next();
        let log = new_log(&self.folder, manifest.open)?;
        manifest.write(&self.folder)?;
        (self.log, self.fresh, self.manifest) = (log, 0, manifest);
        merge::merge(&self.folder, &mut self.manifest)
    }
}

/// Hashes of the names that a catalogue has.
fn hashes(catalogue: &Catalogue) -> HashSet<u64> {
    let of = |segment: &Segment| -> Vec<u64> {
        segment.living().map(|entry| segment.lists.head.entries[entry as usize].hash).collect()
    };
    catalogue.segments.iter().flat_map(of).collect()
}

fn new_log(folder: &Path, number: u32) -> Result<File, CatalogueError> {
    let path = log_of(folder, number);
    let make = || {
        // One of the same number was begun by a process that died before it could be told of.
        let mut log = File::create(&path)?;
        log.write_all(MAGIC)?;
        log.sync_all()?;
        sync_folder(folder)?;
        OpenOptions::new().append(true).open(&path)
    };
    make().map_err(CatalogueError::io(&path))
}
