//! A folder of keys.

use crate::desk::Desk;
use crate::failure::Failure;
use crate::files;
use crate::table::Table;
use serde::Serialize;
use sombrero::watermark::Key;
use std::collections::HashMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// Folders below the folder of keys are looked into this deep.
const DEEPEST: usize = 8;

/// The number of keys that were left out which are shown to people.
const MOST_SHOWN: usize = 5;

/// A key that took no part.
#[derive(Serialize)]
pub(crate) struct Skipped {
    key: String,
    reason: String,
}

impl Skipped {
    pub(crate) fn new(path: &Path, reason: &dyn Display) -> Self {
        Self { key: path.display().to_string(), reason: reason.to_string() }
    }

    fn sentence(&self) -> String {
        format!("{}: {}", self.key, self.reason)
    }

    /// For people: keys that were left out for the same reason are one line.
    pub(crate) fn rows(skipped: &[Self]) -> Table {
        let reasons = reasons(skipped);
        let more: usize = reasons.iter().skip(MOST_SHOWN).map(|(_, keys)| keys.len()).sum();
        let line = |(reason, keys): &(&str, Vec<&str>)| match keys.as_slice() {
            [key] => skipped.iter().find(|s| s.key == **key).map_or_else(String::new, Self::sentence),
            keys => format!("{} keys: {reason}", keys.len()),
        };
        Table::default()
            .rows("left out", reasons.iter().take(MOST_SHOWN).map(line))
            .rows("left out", (more > 0).then(|| format!("and {more} more keys; --json has all")))
    }
}

/// The reasons, each with the keys that it holds for, in the order of the first. What follows a colon is of one key alone.
fn reasons(skipped: &[Skipped]) -> Vec<(&str, Vec<&str>)> {
    let mut places: HashMap<&str, usize> = HashMap::new();
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for Skipped { key, reason } in skipped {
        let reason = reason.split(": ").next().unwrap_or(reason);
        let place = *places.entry(reason).or_insert(reasons.len());
        match reasons.get_mut(place) {
            Some((_, keys)) => keys.push(key),
            None => reasons.push((reason, vec![key])),
        }
    }
    reasons
}

/// The content of a folder: keys, each with its file, and those that could not be read.
pub(crate) struct KeyFolder {
    pub(crate) paths: Vec<PathBuf>,
    pub(crate) keys: Vec<Key>,
    pub(crate) skipped: Vec<Skipped>,
}

impl KeyFolder {
    /// Every key below `folder`, in the order of the names. Files that are no keys are passed over; damaged keys
    /// are told of.
    pub(crate) fn read(folder: &Path, desk: &Desk) -> Result<Self, Failure> {
        let mut files = desk.folder(folder).unwrap_or_default();
        if files.is_empty() {
            list(folder, DEEPEST, &mut files)?;
        }
        let (mut paths, mut keys, mut skipped) = (Vec::new(), Vec::new(), Vec::new());
        for path in files {
            let bytes = match files::key_file(&path, desk) {
                Ok(bytes) if bytes.trim_ascii_start().starts_with(b"{") => bytes,
                // Meshes, pages, prepared files.
                Ok(_) => continue,
                Err(failure) => {
                    skipped.push(Skipped::new(&path, &failure.message()));
                    continue;
                }
            };
            match Key::from_json(&bytes) {
                Ok(key) => {
                    keys.push(key);
                    paths.push(path);
                }
                Err(error) => skipped.push(Skipped::new(&path, &error)),
            }
        }
        if keys.is_empty() { Err(no_keys(folder, &skipped)) } else { Ok(Self { paths, keys, skipped }) }
    }
}

/// Files below `folder` that may be keys by their extension.
fn list(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<(), Failure> {
    let is_key = |path: &Path| {
        path.extension().is_none_or(|e| e.eq_ignore_ascii_case("key") || e.eq_ignore_ascii_case("json"))
    };
    for path in files::entries(folder)? {
        if path.is_dir() && depth > 0 {
            list(&path, depth - 1, found)?;
        } else if path.is_file() && is_key(&path) {
            found.push(path);
        }
    }
    Ok(())
}

pub(crate) fn no_keys(folder: &Path, skipped: &[Skipped]) -> Failure {
    let why = match (skipped, reasons(skipped).as_slice()) {
        ([], _) => String::new(),
        ([only], _) => format!(" ({}: {})", only.key, only.reason),
        (all, [(reason, _)]) => format!(" (all {} keys in it: {reason})", all.len()),
        ([first, rest @ ..], _) => format!(" ({}: {}; and {} more)", first.key, first.reason, rest.len()),
    };
    let message = format!(
        "{}: no key for this original in this folder{why}; give the folder where `embed` wrote the keys",
        folder.display(),
    );
    Failure::new("keys", message)
}
