//! The two containers of a glTF: JSON text, and GLB with the JSON and one buffer in chunks of one binary file.

use std::ops::Range;

use super::error::{malformed, other_version};
use crate::error::{ParseError, Place};
use crate::format::Format;
use crate::text;

const MAGIC: &[u8] = b"glTF";
/// Magic, version and length.
const HEADER: usize = 12;
/// Length and kind.
const CHUNK_HEADER: usize = 8;
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");

/// Where in the file the JSON stands, and the first buffer if it is in the same file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Container {
    pub(super) format: Format,
    pub(super) json: Range<usize>,
    pub(super) bin: Option<Range<usize>>,
}

/// Whether the bytes begin as GLB or as a JSON object.
pub(super) fn is_gltf(bytes: &[u8]) -> bool {
    let text = &bytes[text::beginning(bytes)..];
    bytes.starts_with(MAGIC) || is_object(text)
}

/// Whether a brace and then a name or the other brace come first. (RTF begins with a brace, too.)
fn is_object(text: &[u8]) -> bool {
    let behind = text.trim_ascii_start().strip_prefix(b"{").map(<[u8]>::trim_ascii_start);
    behind.is_some_and(|behind| matches!(behind.first(), Some(b'"' | b'}')))
}

/// Finds the parts of the file.
pub(super) fn open(bytes: &[u8]) -> Result<Container, ParseError> {
    if bytes.starts_with(MAGIC) {
        return open_chunks(bytes);
    }
    let start = text::beginning(bytes);
    if !is_gltf(bytes) {
        let problem = "neither a GLB, which begins with `glTF`, nor JSON with an object";
        return Err(ParseError::Malformed { place: Place::Line(1), problem: problem.into() });
    }
    Ok(Container { format: Format::Gltf, json: start..bytes.len(), bin: None })
}

fn open_chunks(bytes: &[u8]) -> Result<Container, ParseError> {
    let cut = || ParseError::Truncated { element: "header".into(), index: 0 };
    let version = number(bytes, 4).ok_or_else(cut)?;
    if version != 2 {
        return Err(other_version(&version.to_string()));
    }
    let length = number(bytes, 8).ok_or_else(cut)?;
    let whole = bytes.get(..length as usize).ok_or_else(|| ParseError::Overclaimed {
        element: "byte".into(),
        count: length.into(),
        needed: length.into(),
        available: bytes.len() as u64,
    })?;
    // Each chunk tells its own length. Where those reach further than the header says, they are right.
    find_chunks(whole).or_else(|trouble| find_chunks(bytes).map_err(|_| trouble))
}

fn find_chunks(whole: &[u8]) -> Result<Container, ParseError> {
    let (kind, json) = chunk(whole, HEADER, 0)?;
    if kind != JSON {
        return Err(malformed("chunk", 0, "the first chunk of a GLB must be JSON"));
    }
    let bin = buffer_chunk(whole, json.end)?;
    Ok(Container { format: Format::Glb, json, bin })
}

/// The first chunk from `at` on that is a buffer; others mean nothing here.
fn buffer_chunk(bytes: &[u8], mut at: usize) -> Result<Option<Range<usize>>, ParseError> {
    let mut index = 1;
    while bytes.len() - at.min(bytes.len()) >= CHUNK_HEADER {
        let (kind, content) = chunk(bytes, at, index)?;
        if kind == BIN {
            return Ok(Some(content));
        }
        at = content.end;
        index += 1;
    }
    Ok(None)
}

/// Kind and content of the chunk that begins at `at`.
fn chunk(bytes: &[u8], at: usize, index: usize) -> Result<(u32, Range<usize>), ParseError> {
    let cut = || ParseError::Truncated { element: "chunk".into(), index };
    let length = number(bytes, at).ok_or_else(cut)? as usize;
    let kind = number(bytes, at + 4).ok_or_else(cut)?;
    let start = at + CHUNK_HEADER;
    let end = start.checked_add(length).filter(|end| *end <= bytes.len()).ok_or_else(cut)?;
    Ok((kind, start..end))
}

fn number(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|four| u32::from_le_bytes(*four))
}

impl Container {
    /// What is odd about the container, in a sentence.
    pub(super) fn note(&self, bytes: &[u8]) -> Option<String> {
        let told = number(bytes, 8).filter(|_| self.format == Format::Glb)? as usize;
        let ends = self.bin.as_ref().map_or(self.json.end, |bin| bin.end);
        (told < ends)
            .then(|| format!("The header says that the file has {told} bytes, but it has {}.", bytes.len()))
    }

    /// The JSON, without what fills its chunk up.
    pub(super) fn text<'a>(&self, bytes: &'a [u8]) -> Result<&'a str, ParseError> {
        let json = bytes.get(self.json.clone()).unwrap_or_default();
        let text = std::str::from_utf8(json).map_err(|error| {
            malformed("byte of the JSON", error.valid_up_to(), "the JSON is not UTF-8 text")
        })?;
        Ok(text.trim_end_matches(['\0', ' ', '\t', '\r', '\n']))
    }

    /// What the JSON reader found wrong.
    pub(super) fn json_error(&self, error: &serde_json::Error) -> ParseError {
        let whole = error.to_string();
        let suffix = format!(" at line {} column {}", error.line(), error.column());
        let detail = whole.strip_suffix(&suffix).unwrap_or(&whole);
        let problem = format!("the JSON is not as glTF has it ({detail})");
        let place = match self.format {
            Format::Glb if error.line() <= 1 => {
                Place::Element { name: "byte of the JSON".into(), index: error.column().saturating_sub(1) }
            }
            _ => Place::Line(error.line()),
        };
        ParseError::Malformed { place, problem }
    }

    /// `source` with other JSON or another buffer in its chunk, where they are given. `None` when a GLB would be longer than its
    /// header can say.
    pub(super) fn with_content(
        &self,
        source: &[u8],
        json: Option<Vec<u8>>,
        bin: Option<&[u8]>,
    ) -> Option<Vec<u8>> {
        let is_binary = self.format == Format::Glb;
        let json = json.map(|mut json| {
            if is_binary {
                fill_up(&mut json);
            }
            json
        });
        let old_bin = self.bin.clone().unwrap_or(source.len()..source.len());
        let json = json.as_deref().map_or_else(|| source.get(self.json.clone()), Some)?;
        let bin = bin.map_or_else(|| source.get(old_bin.clone()), Some)?;
        let parts = [
            source.get(..self.json.start)?,
            json,
            source.get(self.json.end..old_bin.start)?,
            bin,
            source.get(old_bin.end..)?,
        ];
        let mut out = parts.concat();
        if is_binary {
            let grown = out.len() as u64 + u64::from(number(source, 8)?);
            put(&mut out, 8, grown.saturating_sub(source.len() as u64))?;
            put(&mut out, HEADER, json.len() as u64)?;
            if self.bin.is_some() {
                let header = self.json.start + json.len() + (old_bin.start - self.json.end);
                put(&mut out, header.checked_sub(CHUNK_HEADER)?, bin.len() as u64)?;
            }
        }
        Some(out)
    }
}

/// Writes a number of the header.
fn put(bytes: &mut [u8], at: usize, value: u64) -> Option<()> {
    let slot: &mut [u8; 4] = bytes.get_mut(at..)?.first_chunk_mut()?;
    *slot = u32::try_from(value).ok()?.to_le_bytes();
    Some(())
}

/// Brings a chunk of JSON to a multiple of four bytes: by taking spaces away if it ends with enough, else by
/// adding some.
fn fill_up(json: &mut Vec<u8>) {
    let over = json.len() % 4;
    let spare = json.iter().rev().take(over).all(|b| matches!(b, b' ' | b'\0'));
    if spare {
        json.truncate(json.len() - over);
    } else {
        json.resize(json.len().next_multiple_of(4), b' ');
    }
}

/// A new GLB. `None` when it is too long for its header.
pub(super) fn pack(json: &str, buffer: &[u8]) -> Option<Vec<u8>> {
    let mut text = json.as_bytes().to_vec();
    fill_up(&mut text);
    let padding = buffer.len().next_multiple_of(4) - buffer.len();
    let chunks = [(JSON, text.as_slice(), 0), (BIN, buffer, padding)];
    let length = HEADER + 2 * CHUNK_HEADER + text.len() + buffer.len() + padding;
    let mut out = Vec::with_capacity(length);
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&2_u32.to_le_bytes());
    out.extend_from_slice(&u32::try_from(length).ok()?.to_le_bytes());
    for (kind, content, padding) in chunks {
        out.extend_from_slice(&u32::try_from(content.len() + padding).ok()?.to_le_bytes());
        out.extend_from_slice(&kind.to_le_bytes());
        out.extend_from_slice(content);
        out.resize(out.len() + padding, 0);
    }
    Some(out)
}
