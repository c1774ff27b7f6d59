//! A log with its inverted lists.

use std::collections::HashSet;
use std::fs::File;
use std::path::{Path, PathBuf};

use crate::entry::{Entry, hash};
use crate::error::{CatalogueError, Damage};
use crate::lists::{Lists, Place};
use crate::log::{Ending, Frame, Step, Walk, frame_at};
use crate::manifest::{lists_of, log_of};
use crate::portrait::Portrait;

/// One segment, opened for reading.
#[derive(Debug)]
pub(crate) struct Segment {
    pub(crate) number: u32,
    pub(crate) path: PathBuf,
    log: File,
    pub(crate) lists: Lists,
    /// By entry: whether a later log removes it.
    gone: Vec<bool>,
    /// Whether the file of the lists is missing or damaged, and these were made anew.
    mended: bool,
    /// Whether nothing but whole frames stands in the log; only known of one that was read.
    pub(crate) clean: bool,
}

/// What a log amounts to.
pub(crate) struct Content {
    pub(crate) entries: Vec<(Place, Portrait)>,
    pub(crate) removed: Vec<u64>,
    pub(crate) clean: bool,
}

impl Content {
    /// Reads a whole log. Damaged frames are passed over.
    pub(crate) fn read(path: &Path) -> Result<Self, CatalogueError> {
        let mut content = Self { entries: Vec::new(), removed: Vec::new(), clean: true };
        let mut walk = Walk::new(path)?;
        for (offset, length, frame) in &mut walk {
            match frame {
                Frame::Whole(Step::Add(entry, portrait)) => {
                    content.entries.push((Place { hash: hash(&entry.name), offset, length }, portrait));
                }
                Frame::Whole(Step::Remove(name)) => {
                    let hash = hash(&name);
                    content.entries.retain(|(place, _)| place.hash != hash);
                    content.removed.push(hash);
                }
                Frame::Damaged(_) => content.clean = false,
            }
        }
        content.clean &= walk.ending().1 == Ending::Whole;
        content.removed.sort_unstable();
        content.removed.dedup();
        Ok(content)
    }
}

impl Segment {
    /// Opens a segment. Lists are made of the log when it has none, as the open one, or they are damaged.
    pub(crate) fn open(folder: &Path, number: u32, sealed: bool) -> Result<Self, CatalogueError> {
        let path = log_of(folder, number);
        let log = File::open(&path).map_err(CatalogueError::io(&path))?;
        let stored = if sealed { Lists::open(&lists_of(folder, number))? } else { None };
        let mended = sealed && stored.is_none();
        let (lists, clean) = match stored {
            Some(lists) => (lists, true),
            None => {
                let content = Content::read(&path)?;
                (Lists::of(content.entries, content.removed), content.clean)
            }
        };
        let gone = vec![false; lists.head.entries.len()];
        Ok(Self { number, path, log, lists, gone, mended, clean })
    }

    /// Takes away what later logs removed, and adds what this one removes.
    pub(crate) fn remove(&mut self, removed: &mut HashSet<u64>) {
        if !removed.is_empty() {
            for (gone, place) in self.gone.iter_mut().zip(&self.lists.head.entries) {
                *gone = removed.contains(&place.hash);
            }
        }
        removed.extend(&self.lists.head.removed);
    }

    /// Whether an entry counts.
    pub(crate) fn alive(&self, entry: u32) -> bool {
        self.gone.get(entry as usize) == Some(&false)
    }

    /// Indices of the entries that count.
    pub(crate) fn living(&self) -> impl Iterator<Item = u32> {
        (0..self.gone.len() as u32).filter(|entry| self.alive(*entry))
    }

    /// The entry of a hash that counts, if there is one.
    pub(crate) fn find(&self, hash: u64) -> Option<u32> {
        let entries = &self.lists.head.entries;
        let first = entries.partition_point(|place| place.hash < hash);
        (first..entries.len())
            .take_while(|&k| entries[k].hash == hash)
            .map(|k| k as u32)
            .find(|k| self.alive(*k))
    }

    /// Reads an entry.
    pub(crate) fn read(&self, entry: u32) -> Result<(Entry, Portrait), CatalogueError> {
        let place = self.lists.head.entries[entry as usize];
        match self.frame(place)? {
            Frame::Whole(Step::Add(entry, portrait)) => Ok((entry, portrait)),
            Frame::Whole(_) => Err(CatalogueError::Damaged(self.damage(place.offset, None))),
            Frame::Damaged(entry) => Err(CatalogueError::Damaged(self.damage(place.offset, entry))),
        }
    }

    /// What stands at a place.
    pub(crate) fn frame(&self, place: Place) -> Result<Frame, CatalogueError> {
        frame_at(&self.log, place.offset, place.length).map_err(CatalogueError::io(&self.path))
    }

    pub(crate) fn damage(&self, offset: u64, entry: Option<Entry>) -> Damage {
        Damage { file: self.path.clone(), offset, entry: entry.map(|entry| entry.name) }
    }

    /// What is damaged.
    pub(crate) fn verify(&self, folder: &Path) -> Result<Vec<Damage>, CatalogueError> {
        let mut found = Vec::new();
        let file = lists_of(folder, self.number);
        if self.mended || !self.lists.is_whole().map_err(CatalogueError::io(&file))? {
            found.push(Damage { file, offset: 0, entry: None });
        }
        for entry in self.living() {
            match self.read(entry) {
                Err(CatalogueError::Damaged(damage)) => found.push(damage),
                other => drop(other?),
            }
        }
        // Entries that are damaged in an open log are in no list.
        let mut walk = Walk::new(&self.path)?;
        for (offset, _, frame) in &mut walk {
            let listed = found.iter().any(|damage| damage.offset == offset && damage.file == self.path);
            if let (Frame::Damaged(entry), false) = (frame, listed) {
                found.push(self.damage(offset, entry));
            }
        }
        if let (offset, Ending::Damaged) = walk.ending() {
            found.push(self.damage(offset, None));
        }
        Ok(found)
    }
}
