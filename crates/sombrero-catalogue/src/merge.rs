//! Segments are sealed when they are full, and several small ones become a larger one.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use crate::catalogue::Catalogue;
use crate::entry::{Entry, hash};
use crate::error::CatalogueError;
use crate::lists::{Lists, MOST, Place};
use crate::log::{Frame, MAGIC, Step, Walk};
use crate::manifest::{Manifest, lists_of, log_of, sync_folder};
use crate::portrait::Portrait;
use crate::segment::{Content, Segment};

/// Entries of a log that is sealed.
pub(crate) const FULL: usize = 256;
/// So many segments of one class are merged into one of the next.
const FAN: usize = 8;

/// Writes the lists of a log.
pub(crate) fn seal(folder: &Path, number: u32) -> Result<(), CatalogueError> {
    let content = Content::read(&log_of(folder, number))?;
    write_lists(folder, number, &Lists::of(content.entries, content.removed))
}

fn write_lists(folder: &Path, number: u32, lists: &Lists) -> Result<(), CatalogueError> {
    let path = lists_of(folder, number);
    let write = || {
        let mut file = File::create(&path)?;
        file.write_all(&lists.bytes()?)?;
        file.sync_all()?;
        sync_folder(folder)
    };
    write().map_err(CatalogueError::io(&path))
}

/// Merges the last segments for as long as there are enough of one class.
pub(crate) fn merge(folder: &Path, manifest: &mut Manifest) -> Result<(), CatalogueError> {
    loop {
        let catalogue = Catalogue::open(folder)?;
        let sealed = &catalogue.segments[..manifest.sealed.len()];
        let class = |segment: &Segment| (segment.lists.head.entries.len() / FULL).max(1).ilog(FAN);
        let last = sealed.last().map(class);
        let run = sealed.iter().rev().take_while(|segment| Some(class(segment)) <= last).count();
        let merged = &sealed[sealed.len() - run..];
        let pieces: usize = merged.iter().map(|segment| segment.lists.head.pieces.len()).sum();
        if run < FAN || pieces > MOST {
            return Ok(());
        }
        match replace(folder, manifest, sealed.len() - run, merged, None) {
            Ok(_) => {}
            // Nothing that is damaged is given up without being asked.
            Err(CatalogueError::Damaged(_)) => return Ok(()),
            Err(other) => return Err(other),
        }
    }
}

/// How portraits that are damaged are made anew.
type Again<'a> = &'a mut dyn FnMut(&Entry) -> Option<Portrait>;

/// Puts one segment in the place of those that start with the `first`; names of entries that could not be kept. Without a way
/// to make portraits `again`, a damaged one is an error.
fn replace(
    folder: &Path,
    manifest: &mut Manifest,
    first: usize,
    segments: &[Segment],
    mut again: Option<Again<'_>>,
) -> Result<Vec<String>, CatalogueError> {
    let number = manifest.next();
    let path = log_of(folder, number);
    let mut writer = LogWriter::new(&path)?;
    let mut dropped = Vec::new();
    let mut removed = Vec::new();
    for segment in segments {
        for place in frames(segment)? {
            match segment.frame(place)? {
                Frame::Whole(Step::Add(entry, portrait)) => writer.add(entry, portrait)?,
                Frame::Whole(Step::Remove(_)) => {}
                Frame::Damaged(entry) => {
                    let damage = segment.damage(place.offset, entry.clone());
                    let Some(again) = again.as_mut() else { return Err(CatalogueError::Damaged(damage)) };
                    match entry.as_ref().and_then(&mut **again).zip(entry) {
                        Some((portrait, entry)) => writer.add(entry, portrait)?,
                        None => dropped.push(damage.entry.clone().unwrap_or_else(|| damage.to_string())),
                    }
                }
            }
        }
        removed.extend(&segment.lists.head.removed);
    }
    if first == 0 {
        // There is nothing older that could be removed.
        removed.clear();
    }
    removed.sort_unstable();
    removed.dedup();
    let entries = writer.finish()?;
    write_lists(folder, number, &Lists::of(entries, removed))?;
    let old: Vec<u32> = manifest.sealed.splice(first..first + segments.len(), [number]).collect();
    manifest.write(folder)?;
    for number in old {
        // What cannot be deleted is in nobody's way.
        let _ = fs::remove_file(log_of(folder, number));
        let _ = fs::remove_file(lists_of(folder, number));
    }
    Ok(dropped)
}

/// Where the entries of a segment stand that are to be kept: those in its lists, and damaged ones that no list has.
fn frames(segment: &Segment) -> Result<Vec<Place>, CatalogueError> {
    let mut places: Vec<Place> =
        segment.living().map(|entry| segment.lists.head.entries[entry as usize]).collect();
    if !segment.clean {
        for (offset, length, frame) in Walk::new(&segment.path)? {
            if let Frame::Damaged(Some(entry)) = frame {
                places.push(Place { hash: hash(&entry.name), offset, length });
            }
        }
    }
    places.sort_by_key(|place| place.offset);
    places.dedup_by_key(|place| place.offset);
    Ok(places)
}

/// A log that is written anew.
struct LogWriter<'a> {
    path: &'a Path,
    file: BufWriter<File>,
    offset: u64,
    entries: Vec<(Place, Portrait)>,
}

impl<'a> LogWriter<'a> {
    fn new(path: &'a Path) -> Result<Self, CatalogueError> {
        let mut file = BufWriter::new(File::create(path).map_err(CatalogueError::io(path))?);
        file.write_all(MAGIC).map_err(CatalogueError::io(path))?;
        Ok(Self { path, file, offset: MAGIC.len() as u64, entries: Vec::new() })
    }

    fn add(&mut self, entry: Entry, portrait: Portrait) -> Result<(), CatalogueError> {
        let hash = hash(&entry.name);
        let step = Step::Add(entry, portrait);
        let frame = step.frame();
        self.file.write_all(&frame).map_err(CatalogueError::io(self.path))?;
        if let Step::Add(_, portrait) = step {
            self.entries.push((Place { hash, offset: self.offset, length: frame.len() as u32 }, portrait));
        }
        self.offset += frame.len() as u64;
        Ok(())
    }

    fn finish(self) -> Result<Vec<(Place, Portrait)>, CatalogueError> {
        let file = self.file.into_inner().map_err(|e| CatalogueError::io(self.path)(e.into_error()))?;
        file.sync_all().map_err(CatalogueError::io(self.path))?;
        Ok(self.entries)
    }
}

/// Writes every segment anew in which something is damaged; names of entries that could not be kept.
pub(crate) fn rebuild(
    folder: &Path,
    manifest: &mut Manifest,
    again: Again<'_>,
) -> Result<Vec<String>, CatalogueError> {
    let mut dropped = Vec::new();
    for index in 0..manifest.sealed.len() {
        let catalogue = Catalogue::open(folder)?;
        let segment = &catalogue.segments[index];
        if !segment.verify(folder)?.is_empty() {
            dropped.extend(replace(
                folder,
                manifest,
                index,
                &catalogue.segments[index..=index],
                Some(again),
            )?);
        }
    }
    Ok(dropped)
}
