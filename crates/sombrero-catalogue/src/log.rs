//! An append-only file of what was done: entries added with their portraits, and names removed.
//!
//! ```text
//! file   = MAGIC frame*
//! frame  = length (u32), CRC-32 of the body (u32), body
//! body   = 1 name place note (texts) digest (32 bytes) portrait | 2 name
//! ```
//!
//! A frame counts when it is whole; what stands behind the last whole frame was being written when its writer died.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::bytes::{Bytes, put_text};
use crate::entry::Entry;
use crate::error::CatalogueError;
use crate::portrait::Portrait;

pub(crate) const MAGIC: &[u8; 8] = b"sombrlg1";

/// Something that was done.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Step {
    Add(Entry, Portrait),
    Remove(String),
}

impl Step {
    /// The frame.
    pub(crate) fn frame(&self) -> Vec<u8> {
        let mut body = Vec::new();
        match self {
            Self::Add(entry, portrait) => {
                body.push(1);
                [&entry.name, &entry.place, &entry.note].iter().for_each(|text| put_text(&mut body, text));
                body.extend(entry.digest);
                portrait.put(&mut body);
            }
            Self::Remove(name) => {
                body.push(2);
                put_text(&mut body, name);
            }
        }
        let mut frame = (body.len() as u32).to_le_bytes().to_vec();
        frame.extend(crc32fast::hash(&body).to_le_bytes());
        frame.extend(body);
        frame
    }

    fn read(body: &[u8]) -> Option<Self> {
        let mut bytes = Bytes(body);
        match bytes.array()? {
            [1] => {
                let (name, place, note) = (bytes.text()?, bytes.text()?, bytes.text()?);
                let digest = bytes.array()?;
                Some(Self::Add(Entry { name, digest, place, note }, Portrait::read(bytes.0)?))
            }
            [2] => Some(Self::Remove(bytes.text()?)),
            _ => None,
        }
    }
}

/// All steps of a file, and the length up to which it is whole.
pub(crate) fn steps(path: &Path) -> Result<(Vec<Step>, u64), CatalogueError> {
    let mut content = Vec::new();
    let mut file = File::open(path).map_err(CatalogueError::io(path))?;
    file.read_to_end(&mut content).map_err(CatalogueError::io(path))?;
    let mut bytes = Bytes(&content);
    if bytes.array().as_ref() != Some(MAGIC) {
        return Err(CatalogueError::NotACatalogue { path: path.to_owned() });
    }
    let mut steps = Vec::new();
    let mut whole = content.len() - bytes.0.len();
    while let Some(step) = next(&mut bytes) {
        steps.push(step);
        whole = content.len() - bytes.0.len();
    }
    Ok((steps, whole as u64))
}

fn next(bytes: &mut Bytes<'_>) -> Option<Step> {
    let (length, sum) = (bytes.u32()?, bytes.u32()?);
    let body = bytes.take(length as usize)?;
    (crc32fast::hash(body) == sum).then(|| Step::read(body)).flatten()
}
