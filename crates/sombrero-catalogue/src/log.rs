//! An append-only file of what was done: entries added with their portraits, and names removed.
//!
//! ```text
//! file  = MAGIC frame*
//! frame = length of the body, CRC-32 of the body, CRC-32 of these two (u32 each), body
//! body  = 1, length of the words (u32), CRC-32 of the words (u32), words, portrait | 2 name
//! words = name place note (texts) digest (32 bytes)
//! ```
//!
//! A frame counts when it is whole. One that promises more bytes than there are was being written when its writer died. Words
//! have a checksum of their own, so that an entry whose portrait is damaged can still be named.

use std::fs::File;
use std::path::Path;

use crate::bytes::{Bytes, put_text};
use crate::entry::Entry;
use crate::error::CatalogueError;
use crate::portrait::Portrait;
use crate::positioned;

pub(crate) const MAGIC: &[u8; 8] = b"sombrlg1";
/// Bytes of a frame before its body.
const HEAD: usize = 12;

/// Something that was done.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Step {
    Add(Entry, Portrait),
    Remove(String),
}

/// What stands at a place of a log.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Frame {
    Whole(Step),
    /// Its length makes sense and its content does not; the entry, when its words are whole.
    Damaged(Option<Entry>),
}

impl Step {
    /// The frame.
    pub(crate) fn frame(&self) -> Vec<u8> {
        let mut body = Vec::new();
        match self {
            Self::Add(entry, portrait) => {
                let mut words = Vec::new();
                [&entry.name, &entry.place, &entry.note].iter().for_each(|text| put_text(&mut words, text));
                words.extend(entry.digest);
                body.push(1);
                body.extend((words.len() as u32).to_le_bytes());
                body.extend(crc32fast::hash(&words).to_le_bytes());
                body.extend(words);
                portrait.put(&mut body);
            }
            Self::Remove(name) => {
                body.push(2);
                put_text(&mut body, name);
            }
        }
        let mut frame = (body.len() as u32).to_le_bytes().to_vec();
        frame.extend(crc32fast::hash(&body).to_le_bytes());
        frame.extend(crc32fast::hash(&frame).to_le_bytes());
        frame.extend(body);
        frame
    }

    fn read(body: &[u8]) -> Option<Self> {
        let mut bytes = Bytes(body);
        match bytes.array()? {
            [1] => Some(Self::Add(entry(&mut bytes)?, Portrait::read(bytes.0)?)),
            [2] => Some(Self::Remove(bytes.text()?)),
            _ => None,
        }
    }
}

/// The words of a body behind its kind.
fn entry(bytes: &mut Bytes<'_>) -> Option<Entry> {
    let (length, sum) = (bytes.u32()?, bytes.u32()?);
    let words = bytes.take(length as usize)?;
    let mut words = Bytes((crc32fast::hash(words) == sum).then_some(words)?);
    let (name, place, note) = (words.text()?, words.text()?, words.text()?);
    Some(Entry { name, digest: words.array()?, place, note })
}

/// Length and checksum of the body, when the bytes start with a whole head.
fn head(bytes: &[u8]) -> Option<(usize, u32)> {
    let (numbers, sum) = bytes.get(..HEAD)?.split_at(8);
    let mut numbers_read = Bytes(numbers);
    let found = (numbers_read.u32()? as usize, numbers_read.u32()?);
    (Bytes(sum).u32()? == crc32fast::hash(numbers)).then_some(found)
}

/// A frame from all its bytes.
pub(crate) fn frame(bytes: &[u8]) -> Frame {
    let body = bytes.get(HEAD..).unwrap_or_default();
    let sum = head(bytes).map(|(_, sum)| sum);
    match Step::read(body).filter(|_| Some(crc32fast::hash(body)) == sum) {
        Some(step) => Frame::Whole(step),
        None => Frame::Damaged(body.split_first().and_then(|(_, words)| entry(&mut Bytes(words)))),
    }
}

/// The frame at a place of a log.
pub(crate) fn frame_at(file: &File, offset: u64, length: u32) -> std::io::Result<Frame> {
    let mut bytes = vec![0; length as usize];
    positioned::read(file, &mut bytes, offset)?;
    Ok(frame(&bytes))
}

/// How a log ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ending {
    /// With a whole frame.
    Whole,
    /// In the middle of a frame: its writer died.
    Torn,
    /// With bytes that say nothing.
    Damaged,
}

/// A whole log in memory, frame after frame, until the bytes make no more sense.
pub(crate) struct Walk {
    content: Vec<u8>,
    at: usize,
}

impl Walk {
    pub(crate) fn new(path: &Path) -> Result<Self, CatalogueError> {
        let content = std::fs::read(path).map_err(CatalogueError::io(path))?;
        if !content.starts_with(MAGIC) {
            return Err(CatalogueError::NotACatalogue { path: path.to_owned() });
        }
        Ok(Self { content, at: MAGIC.len() })
    }

    /// Where the walk stands, and what the bytes there are.
    pub(crate) fn ending(&self) -> (u64, Ending) {
        let rest = &self.content[self.at..];
        let ending = match rest.len() {
            0 => Ending::Whole,
            short if short < HEAD || head(rest).is_some() => Ending::Torn,
            _ => Ending::Damaged,
        };
        (self.at as u64, ending)
    }
}

impl Iterator for Walk {
    /// Offset and length, and what stands there.
    type Item = (u64, u32, Frame);

    fn next(&mut self) -> Option<Self::Item> {
        let rest = &self.content[self.at..];
        let bytes = rest.get(..HEAD.checked_add(head(rest)?.0)?)?;
        let item = (self.at as u64, bytes.len() as u32, frame(bytes));
        self.at += bytes.len();
        Some(item)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cut_is_torn_and_every_flipped_bit_of_a_head_is_damage() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        let mut bytes = MAGIC.to_vec();
        bytes.extend(Step::Remove("a name".into()).frame());
        let ends = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            let mut walk = Walk::new(&path).unwrap();
            let frames: Vec<Frame> = (&mut walk).map(|found| found.2).collect();
            (frames, walk.ending().1)
        };
        assert_eq!(ends(&bytes), (vec![Frame::Whole(Step::Remove("a name".into()))], Ending::Whole));
        for length in MAGIC.len() + 1..bytes.len() {
            assert_eq!(ends(&bytes[..length]), (vec![], Ending::Torn));
        }
        for at in MAGIC.len()..bytes.len() {
            let mut other = bytes.clone();
            other[at] ^= 4;
            let of_head = at < MAGIC.len() + HEAD;
            let expected =
                if of_head { (vec![], Ending::Damaged) } else { (vec![Frame::Damaged(None)], Ending::Whole) };
            assert_eq!(ends(&other), expected);
        }
    }
}
