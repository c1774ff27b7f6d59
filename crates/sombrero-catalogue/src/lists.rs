//! Inverted lists: for each cell the landmarks that lie in it, four bytes each.
//!
//! ```text
//! file    = MAGIC, CRC-32 of the head (u32), CRC-32 of the postings (u32), head, postings
//! head    = entries, removed, pieces (u32 each), entry*, hash (u64)* of removed names, piece*, start (u32) of each cell and the end
//! entry   = hash of the name (u64), offset (u64) and length (u32) of the frame in the log; by hash
//! piece   = entry (u32), number within its portrait (u16), landmarks (u16)
//! posting = piece (u16), signature (u16); by cell, then by piece
//! ```
//!
//! They follow from the log and are made anew from it when they are damaged.

use std::fs::File;
use std::path::Path;

use rayon::prelude::*;

use crate::bytes::Bytes;
use crate::error::CatalogueError;
use crate::features::{CELLS, cell, signature};
use crate::portrait::Portrait;
use crate::positioned;

const MAGIC: &[u8; 8] = b"sombrls1";
/// Where the head starts.
const HEAD: u64 = 16;
/// Postings between two lists from which on it is quicker to read these apart.
const GAP: u32 = 4096;
/// Pieces that have lists in common at most.
pub(crate) const MOST: usize = 1 << 16;

/// Where an entry is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    /// Of the name.
    pub(crate) hash: u64,
    /// Of the frame in the log.
    pub(crate) offset: u64,
    pub(crate) length: u32,
}

/// A piece of an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PieceOf {
    /// Index into the entries.
    pub(crate) entry: u32,
    /// Which of the portrait's pieces.
    pub(crate) number: u16,
    pub(crate) landmarks: u16,
}

/// What is known of a log without reading it.
#[derive(Debug, Default)]
pub(crate) struct Head {
    pub(crate) entries: Vec<Place>,
    /// Hashes of names that the log removes from earlier ones.
    pub(crate) removed: Vec<u64>,
    pub(crate) pieces: Vec<PieceOf>,
    starts: Vec<u32>,
}

/// Head and postings.
#[derive(Debug)]
pub(crate) struct Lists {
    pub(crate) head: Head,
    stored: Stored,
}

/// Lists of some cells, read.
pub(crate) struct Postings {
    /// By cell; those of cells that were not read are empty.
    ranges: Vec<(u32, u32)>,
    pieces: Vec<u16>,
    signatures: Vec<u16>,
}

/// The landmarks of a cell: which pieces they are of, and their signatures.
pub(crate) struct List<'a> {
    pub(crate) pieces: &'a [u16],
    pub(crate) signatures: &'a [u16],
}

impl Postings {
    pub(crate) fn list(&self, cell: u16) -> List<'_> {
        let (start, end) = self.ranges[usize::from(cell)];
        let range = start as usize..end as usize;
        List { pieces: &self.pieces[range.clone()], signatures: &self.signatures[range] }
    }

    fn push(&mut self, cell: u16, bytes: &[u8]) {
        let number = |a, b| u16::from_le_bytes([a, b]);
        let start = self.pieces.len() as u32;
        self.pieces.extend(bytes.chunks_exact(4).map(|p| number(p[0], p[1])));
        self.signatures.extend(bytes.chunks_exact(4).map(|p| number(p[2], p[3])));
        self.ranges[usize::from(cell)] = (start, self.pieces.len() as u32);
    }
}

#[derive(Debug)]
enum Stored {
    Here(Vec<u8>),
    There(File, u64),
}

impl Lists {
    /// The lists of entries, each with its portrait, and of removed names.
    pub(crate) fn of(mut entries: Vec<(Place, Portrait)>, removed: Vec<u64>) -> Self {
        entries.sort_unstable_by_key(|(place, _)| *place);
        let mut pieces = Vec::new();
        let mut marks = Vec::new();
        for (entry, (_, portrait)) in (0..).zip(&entries) {
            for (number, piece) in (0..).zip(&portrait.pieces) {
                marks.extend(piece.marks.iter().map(|mark| (pieces.len() as u16, &mark.looks)));
                pieces.push(PieceOf { entry, number, landmarks: piece.marks.len() as u16 });
            }
        }
        let keyed = marks.into_par_iter().map(|(piece, looks)| {
            let cell = cell(looks);
            (cell, piece, signature(looks, cell))
        });
        let mut keyed: Vec<(u16, u16, u16)> = keyed.collect();
        keyed.sort_unstable();
        let starts = (0..=CELLS).map(|c| keyed.partition_point(|k| usize::from(k.0) < c) as u32).collect();
        let postings = keyed.iter().flat_map(|k| [k.1.to_le_bytes(), k.2.to_le_bytes()]).flatten().collect();
        let entries = entries.into_iter().map(|(place, _)| place).collect();
        Self { head: Head { entries, removed, pieces, starts }, stored: Stored::Here(postings) }
    }

    /// Opens a file; `None` when its head is damaged.
    pub(crate) fn open(path: &Path) -> Result<Option<Self>, CatalogueError> {
        let file = match File::open(path) {
            Ok(file) => file,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(CatalogueError::io(path)(e)),
        };
        Self::read(file).map_err(CatalogueError::io(path))
    }

    fn read(file: File) -> std::io::Result<Option<Self>> {
        let length = file.metadata()?.len();
        let mut first = [0; HEAD as usize + 12];
        if length < first.len() as u64 {
            return Ok(None);
        }
        positioned::read(&file, &mut first, 0)?;
        let Some((sum, bytes)) = head_length(&first).filter(|(_, bytes)| *bytes <= length - HEAD) else {
            return Ok(None);
        };
        let mut head = vec![0; bytes as usize];
        positioned::read(&file, &mut head, HEAD)?;
        if crc32fast::hash(&head) != sum {
            return Ok(None);
        }
        let head = Head::read(&head).filter(|head| {
            let end = head.starts.last().copied().unwrap_or(0);
            length == HEAD + bytes + 4 * u64::from(end)
        });
        Ok(head.map(|head| Self { head, stored: Stored::There(file, HEAD + bytes) }))
    }

    /// The bytes of the file.
    pub(crate) fn bytes(&self) -> std::io::Result<Vec<u8>> {
        let head = self.head.bytes();
        let postings = self.all()?;
        let mut bytes = MAGIC.to_vec();
        bytes.extend(crc32fast::hash(&head).to_le_bytes());
        bytes.extend(crc32fast::hash(&postings).to_le_bytes());
        bytes.extend(head);
        bytes.extend(postings);
        Ok(bytes)
    }

    /// Whether the postings are what was written.
    pub(crate) fn is_whole(&self) -> std::io::Result<bool> {
        let Stored::There(file, _) = &self.stored else { return Ok(true) };
        let mut sum = [0; 4];
        positioned::read(file, &mut sum, 12)?;
        Ok(crc32fast::hash(&self.all()?) == u32::from_le_bytes(sum))
    }

    fn all(&self) -> std::io::Result<Vec<u8>> {
        self.bytes_between(0, self.head.starts.last().copied().unwrap_or(0))
    }

    /// The lists of `cells`, which ascend. Those that lie near each other are read at once.
    pub(crate) fn postings(&self, cells: &[u16]) -> std::io::Result<Postings> {
        let mut postings =
            Postings { ranges: vec![(0, 0); CELLS], pieces: Vec::new(), signatures: Vec::new() };
        let [start, end] = [0, 1].map(|k| move |cell: u16| self.head.starts[usize::from(cell) + k]);
        for run in cells.chunk_by(|a, b| start(*b) - end(*a) < GAP) {
            let first = start(run[0]);
            let bytes = self.bytes_between(first, end(run[run.len() - 1]))?;
            let at = |posting: u32| 4 * (posting - first) as usize;
            run.iter().for_each(|&cell| postings.push(cell, &bytes[at(start(cell))..at(end(cell))]));
        }
        Ok(postings)
    }

    fn bytes_between(&self, start: u32, end: u32) -> std::io::Result<Vec<u8>> {
        match &self.stored {
            Stored::Here(bytes) => Ok(bytes[4 * start as usize..4 * end as usize].to_vec()),
            Stored::There(file, offset) => {
                let mut bytes = vec![0; 4 * (end - start) as usize];
                positioned::read(file, &mut bytes, offset + 4 * u64::from(start))?;
                Ok(bytes)
            }
        }
    }
}

/// Checksum and length of the head.
fn head_length(first: &[u8]) -> Option<(u32, u64)> {
    let mut bytes = Bytes(first);
    let magic: [u8; 8] = bytes.array()?;
    let (sum, _) = (bytes.u32()?, bytes.u32()?);
    let [entries, removed, pieces] = [bytes.u32()?, bytes.u32()?, bytes.u32()?].map(u64::from);
    (magic == *MAGIC).then_some((sum, 12 + 20 * entries + 8 * removed + 8 * pieces + 4 * (CELLS as u64 + 1)))
}

impl Head {
    fn bytes(&self) -> Vec<u8> {
        let counts = [self.entries.len(), self.removed.len(), self.pieces.len()];
        let mut bytes: Vec<u8> = counts.iter().flat_map(|n| (*n as u32).to_le_bytes()).collect();
        for place in &self.entries {
            bytes.extend(place.hash.to_le_bytes());
            bytes.extend(place.offset.to_le_bytes());
            bytes.extend(place.length.to_le_bytes());
        }
        bytes.extend(self.removed.iter().flat_map(|hash| hash.to_le_bytes()));
        for piece in &self.pieces {
            bytes.extend(piece.entry.to_le_bytes());
            bytes.extend(piece.number.to_le_bytes());
            bytes.extend(piece.landmarks.to_le_bytes());
        }
        bytes.extend(self.starts.iter().flat_map(|start| start.to_le_bytes()));
        bytes
    }

    fn read(bytes: &[u8]) -> Option<Self> {
        let mut bytes = Bytes(bytes);
        let [entries, removed, pieces] = [bytes.u32()?, bytes.u32()?, bytes.u32()?];
        let place = |bytes: &mut Bytes<'_>| {
            Some(Place { hash: bytes.u64()?, offset: bytes.u64()?, length: bytes.u32()? })
        };
        let entries: Vec<Place> = (0..entries).map(|_| place(&mut bytes)).collect::<Option<_>>()?;
        let removed = (0..removed).map(|_| bytes.u64()).collect::<Option<_>>()?;
        let piece = |bytes: &mut Bytes<'_>| {
            let entry = bytes.u32().filter(|e| (*e as usize) < entries.len())?;
            let [number, landmarks] = [bytes.array()?, bytes.array()?].map(u16::from_le_bytes);
            Some(PieceOf { entry, number, landmarks })
        };
        let pieces = (0..pieces).map(|_| piece(&mut bytes)).collect::<Option<_>>()?;
        let starts: Vec<u32> = (0..=CELLS).map(|_| bytes.u32()).collect::<Option<_>>()?;
        (bytes.0.is_empty() && starts.is_sorted()).then_some(Self { entries, removed, pieces, starts })
    }
}
