//! Which files are the catalogue: a few lines of text that are replaced as a whole.
//!
//! ```text
//! sombrero-catalogue 2
//! 000000 sealed
//! 000003 open
//! sum 5d41402a
//! ```
//!
//! A segment is a log and, when it is sealed, the inverted lists that follow from it. Older ones come first. The sum is
//! the CRC-32 of what stands before it.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::error::CatalogueError;

const NAME: &str = "catalogue";
const TITLE: &str = "sombrero-catalogue 2\n";

/// The segments, by number.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Manifest {
    /// Oldest first.
    pub(crate) sealed: Vec<u32>,
    /// What is written to.
    pub(crate) open: u32,
}

impl Manifest {
    pub(crate) fn read(folder: &Path) -> Result<Self, CatalogueError> {
        let path = folder.join(NAME);
        let text = fs::read_to_string(&path).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound
            | std::io::ErrorKind::NotADirectory
            | std::io::ErrorKind::InvalidData => CatalogueError::NotACatalogue { path: folder.to_owned() },
            _ => CatalogueError::io(&path)(e),
        })?;
        Self::parse(&text).ok_or(CatalogueError::NotACatalogue { path })
    }

    /// Puts the manifest in place of the one that is there: a reader sees either.
    pub(crate) fn write(&self, folder: &Path) -> Result<(), CatalogueError> {
        let (path, fresh) = (folder.join(NAME), folder.join("catalogue.new"));
        let write = || {
            let mut file = File::create(&fresh)?;
            file.write_all(self.text().as_bytes())?;
            file.sync_all()?;
            fs::rename(&fresh, &path)?;
            sync_folder(folder)
        };
        write().map_err(CatalogueError::io(&path))
    }

    fn text(&self) -> String {
        let sealed = self.sealed.iter().map(|number| format!("{number:06} sealed\n"));
        let mut text = TITLE.to_owned() + &sealed.collect::<String>() + &format!("{:06} open\n", self.open);
        text += &format!("sum {:08x}\n", crc32fast::hash(text.as_bytes()));
        text
    }

    fn parse(text: &str) -> Option<Self> {
        let numbers = |kind: &str| -> Vec<u32> {
            text.lines().filter_map(|line| line.strip_suffix(kind)?.parse().ok()).collect()
        };
        let found = Self { sealed: numbers(" sealed"), open: *numbers(" open").first()? };
        (found.text() == text).then_some(found)
    }

    /// A number that no segment has.
    pub(crate) fn next(&self) -> u32 {
        self.sealed.iter().max().map_or(0, |last| last + 1).max(self.open + 1)
    }
}

pub(crate) fn log_of(folder: &Path, number: u32) -> PathBuf {
    folder.join(format!("{number:06}.log"))
}

pub(crate) fn lists_of(folder: &Path, number: u32) -> PathBuf {
    folder.join(format!("{number:06}.lists"))
}

/// Makes names of new files last.
#[cfg(unix)]
pub(crate) fn sync_folder(folder: &Path) -> std::io::Result<()> {
    File::open(folder)?.sync_all()
}

/// Windows writes names with their files.
#[cfg(not(unix))]
pub(crate) fn sync_folder(_: &Path) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_nothing_else() {
        let manifest = Manifest { sealed: vec![4, 7, 5], open: 9 };
        let text = manifest.text();
        assert_eq!(Manifest::parse(&text), Some(manifest));
        for at in 0..text.len() {
            let mut other = text.clone().into_bytes();
            other[at] ^= 1;
            assert_eq!(Manifest::parse(&String::from_utf8(other).unwrap()), None);
            assert_eq!(Manifest::parse(&text[..at]), None);
        }
    }
}
