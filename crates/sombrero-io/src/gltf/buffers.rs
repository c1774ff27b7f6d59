//! The buffers: in the GLB itself, in data URIs, or in files beside the glTF.
//!
//! A file name comes from whoever made the glTF, so it must stay inside the glTF's folder: no scheme, no absolute
//! path, no way up, and what links lead to is looked at, too.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::io;
use std::ops::Range;
use std::path::{Component, Path, PathBuf};

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};

use super::container::Container;
use super::error::malformed;
use super::json::{Buffer, Root, Text, span};
use super::needed::Needed;
use super::packed::Packed;
use crate::error::{ParseError, ReadError};
use crate::input::{Beside, Limits, Source, is_plain_path, read_bytes};
use crate::parsed::Companion;

/// Where the bytes of a buffer are.
#[derive(Debug, Clone)]
pub(super) enum Origin {
    /// In the file itself.
    Chunk(Range<usize>),
    /// In the JSON.
    Inline(Inline),
    /// In a file of its own.
    Beside {
        /// Where in the JSON its name stands, with quotes.
        span: Range<usize>,
        /// Its number among the companions.
        companion: usize,
    },
    /// In a compressed buffer view.
    Packed(Box<Packed>),
    /// In a Draco stream, which is not written.
    Decoded(Vec<u8>),
}

/// A data URI.
#[derive(Debug, Clone)]
pub(super) struct Inline {
    /// Where it stands in the JSON, with quotes.
    pub(super) span: Range<usize>,
    /// All up to the comma, as new bytes need it: in base64, however these were written.
    head: String,
    /// Whether it is filled up with `=`.
    padded: bool,
    bytes: Vec<u8>,
}

impl Inline {
    /// The JSON string of this URI with other bytes.
    pub(super) fn uri(&self, bytes: &[u8]) -> String {
        quoted(&format!("{}{}", self.head, engine(self.padded).encode(bytes)))
    }
}

/// A string as JSON spells it.
pub(super) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// The JSON string of a data URI.
pub(super) fn data_uri(bytes: &[u8]) -> String {
    format!("\"data:application/octet-stream;base64,{}\"", engine(true).encode(bytes))
}

fn engine(padded: bool) -> GeneralPurpose {
    let config = GeneralPurposeConfig::new()
        .with_encode_padding(padded)
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true);
    GeneralPurpose::new(&STANDARD, config)
}

impl Origin {
    /// The buffer's bytes.
    pub(super) fn bytes<'a>(&'a self, source: &'a [u8], companions: &'a [Companion]) -> &'a [u8] {
        match self {
            Self::Chunk(range) => source.get(range.clone()).unwrap_or_default(),
            Self::Inline(inline) => &inline.bytes,
            Self::Beside { companion, .. } => companions.get(*companion).map_or(&[], |c| &c.bytes),
            Self::Packed(packed) => &packed.bytes,
            Self::Decoded(bytes) => bytes,
        }
    }
}

/// The buffers that were needed, in the order of the JSON, then other files. They get numbers of their own: stores.
#[derive(Debug)]
pub(super) struct Buffers<'a> {
    source: &'a [u8],
    pub(super) origins: Vec<Origin>,
    pub(super) companions: Vec<Companion>,
    stores: HashMap<u32, usize>,
    /// The stores of what compressed buffer views hold.
    packed: HashMap<u32, usize>,
}

impl<'a> Buffers<'a> {
    /// Gets hold of what is needed.
    pub(super) fn load(
        source: Source<'a>,
        container: &Container,
        text: &str,
        root: &Root<'_>,
        needed: &Needed,
    ) -> Result<Self, ParseError> {
        let mut loader = Loader {
            source,
            container,
            text,
            left: source.limits.max_bytes,
            companions: Vec::new(),
            paths: HashSet::new(),
        };
        let mut origins = Vec::new();
        let mut stores = HashMap::new();
        for &index in &needed.buffers {
            let buffer = root
                .buffers
                .get(index as usize)
                .ok_or_else(|| malformed("buffer", index as usize, "there is no such buffer"))?;
            let origin = loader.origin(index, buffer, true)?;
            let available = origin.bytes(source.bytes, &loader.companions).len() as u64;
            if available < buffer.byte_length {
                return Err(ParseError::Overclaimed {
                    element: format!("byte of buffer {index}"),
                    count: buffer.byte_length,
                    needed: buffer.byte_length,
                    available,
                });
            }
            stores.insert(index, origins.len());
            origins.push(origin);
        }
        // Files without geometry (animations, say) are taken along, so that a copy in another folder is whole; one
        // that cannot be read is nobody's loss here.
        for (index, buffer) in (0..).zip(&root.buffers).filter(|(index, _)| !needed.buffers.contains(index)) {
            let is_plain = needed.plain.contains(&index);
            let Ok(origin) = loader.origin(index, buffer, false) else { continue };
            if is_plain {
                stores.insert(index, origins.len());
            }
            if is_plain || matches!(origin, Origin::Beside { .. }) {
                origins.push(origin);
            }
        }
        let companions = loader.companions;
        let mut buffers = Self { source: source.bytes, origins, companions, stores, packed: HashMap::new() };
        let mut left = source.limits.unpacked(buffers.size());
        for &view in &needed.packed {
            let packed = Packed::unpack(root, &buffers, view, &mut left)?;
            buffers.packed.insert(view, buffers.origins.len());
            buffers.origins.push(Origin::Packed(Box::new(packed)));
        }
        Ok(buffers)
    }

    /// The store of what a compressed buffer view holds, if it was needed.
    pub(super) fn packed(&self, view: u32) -> Option<usize> {
        self.packed.get(&view).copied()
    }

    /// All bytes there are.
    pub(super) fn size(&self) -> usize {
        self.lengths().iter().sum::<usize>().max(self.source.len())
    }

    /// The store of a buffer, if it was loaded.
    pub(super) fn store(&self, buffer: u32) -> Option<usize> {
        self.stores.get(&buffer).copied()
    }

    /// The bytes of a store.
    pub(super) fn bytes(&self, store: usize) -> &[u8] {
        self.origins.get(store).map_or(&[], |origin| origin.bytes(self.source, &self.companions))
    }

    /// How many bytes every store has.
    pub(super) fn lengths(&self) -> Vec<usize> {
        (0..self.origins.len()).map(|store| self.bytes(store).len()).collect()
    }
}

struct Loader<'a, 'b> {
    source: Source<'a>,
    container: &'b Container,
    text: &'b str,
    /// How many bytes may still be taken in.
    left: u64,
    companions: Vec<Companion>,
    paths: HashSet<PathBuf>,
}

impl Loader<'_, '_> {
    fn origin(
        &mut self,
        index: u32,
        buffer: &Buffer<'_>,
        holds_geometry: bool,
    ) -> Result<Origin, ParseError> {
        let Some(raw) = buffer.uri else {
            let bin = self.container.bin.clone().filter(|_| index == 0);
            let problem = "a buffer without `uri` must be the first one of a GLB that has a binary chunk";
            return bin.map(Origin::Chunk).ok_or_else(|| malformed("buffer", index as usize, problem));
        };
        let wrong = |problem: &str| malformed("buffer", index as usize, problem);
        let Ok(Text(uri)) = serde_json::from_str(raw.get()) else {
            return Err(wrong("`uri` is no text"));
        };
        let span = span(self.text, raw.get()).ok_or_else(|| wrong("`uri` is no text"))?;
        if uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
            let inline = self
                .inline(span, &uri)
                .ok_or_else(|| wrong("its data URI has no comma, or what follows is not base64"))?;
            return Ok(Origin::Inline(inline));
        }
        let bytes = self.read(&uri)?;
        self.left = self.left.saturating_sub(bytes.len() as u64);
        let name = decoded(&uri).unwrap_or_default();
        self.companions.push(Companion { name, bytes, holds_geometry });
        Ok(Origin::Beside { span, companion: self.companions.len() - 1 })
    }

    fn inline(&mut self, span: Range<usize>, uri: &str) -> Option<Inline> {
        let (head, payload) = uri.split_at_checked(uri.find(',')? + 1)?;
        let head = head.trim_end_matches(',');
        let payload: Cow<'_, [u8]> = percent_decode_str(payload).into();
        let encoding = head.rsplit_once(';').map(|(_, encoding)| encoding);
        if !encoding.is_some_and(|encoding| encoding.eq_ignore_ascii_case("base64")) {
            let head = format!("{head};base64,");
            return Some(Inline { span, head, padded: true, bytes: payload.into_owned() });
        }
        let padded = payload.len().is_multiple_of(4);
        let bytes = engine(padded).decode(payload).ok()?;
        Some(Inline { span, head: format!("{head},"), padded, bytes })
    }

    fn read(&mut self, uri: &str) -> Result<Vec<u8>, ParseError> {
        let refused = |problem: String| ParseError::Companion { name: shortened(uri), problem };
        let name = decoded(uri)
            .filter(|name| is_plain_path(name))
            .ok_or_else(|| refused("is not named by a plain path inside the same folder".into()))?;
        let refused = |problem: String| ParseError::Companion { name: shortened(&name), problem };
        let path = match self.source.beside {
            Beside::Folder(folder) => inside(folder, &name).map_err(refused)?,
            _ => normal(&name),
        };
        if !self.paths.insert(path.clone()) {
            return Err(ParseError::Unsupported {
                what: format!("a glTF with two buffers in one file, `{}`,", shortened(uri)),
                cure: "export the model again, as GLB",
            });
        }
        let limits = Limits { max_bytes: self.left, ..self.source.limits };
        match self.source.beside {
            Beside::Folder(_) => read_bytes(&path, limits).map_err(|error| refused(problem_of(&error))),
            Beside::Files(files) => {
                let found = files.iter().find(|(given, _)| normal(given) == path);
                found.map(|(_, bytes)| bytes.clone()).ok_or_else(|| refused("was not given".into()))
            }
            Beside::Nothing => {
                Err(refused("cannot be looked for, because only the content of this file was given".into()))
            }
        }
    }
}

/// The path of a file that must be inside the folder, wherever links lead.
fn inside(folder: &Path, name: &str) -> Result<PathBuf, String> {
    let failed = |error: io::Error| match error.kind() {
        io::ErrorKind::NotFound => "is not there".to_owned(),
        _ => format!("cannot be read ({error})"),
    };
    let folder = folder.canonicalize().map_err(failed)?;
    let path = folder.join(name).canonicalize().map_err(failed)?;
    if path.starts_with(&folder) { Ok(path) } else { Err("leads out of the folder".to_owned()) }
}

fn problem_of(error: &ReadError) -> String {
    match error {
        ReadError::NotAFile { .. } => "is not a regular file".to_owned(),
        ReadError::TooLarge { .. } => "is larger than the limit allows".to_owned(),
        ReadError::Io { source, .. } => format!("cannot be read ({source})"),
        ReadError::Parse { .. } => "cannot be read".to_owned(),
    }
}

/// A plain path without what leads nowhere: `./a` is `a`.
fn normal(name: &str) -> PathBuf {
    Path::new(name).components().filter(|part| matches!(part, Component::Normal(_))).collect()
}

/// A URI with its percent signs resolved.
fn decoded(uri: &str) -> Option<String> {
    percent_decode_str(uri).decode_utf8().ok().map(Cow::into_owned)
}

/// A file name as a URI.
pub(super) fn encoded(name: &str) -> String {
    const SPECIAL: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'~');
    utf8_percent_encode(name, SPECIAL).to_string()
}

/// As much of a name as a message can take.
fn shortened(name: &str) -> String {
    const LONGEST: usize = 80;
    if name.chars().count() <= LONGEST {
        return name.to_owned();
    }
    name.chars().take(LONGEST).chain("...".chars()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_elsewhere_are_not_plain() {
        for name in
            ["", "/etc/passwd", "../a", "a/../../b", "a\\b", "c:a", "file:///etc/passwd", "a\0b", ".."]
        {
            assert!(!is_plain_path(name), "{name}");
        }
        for name in ["a.bin", "./a.bin", "a/b.bin", "a b.bin", "..a"] {
            assert!(is_plain_path(name), "{name}");
        }
    }

    #[test]
    fn percent_signs_go_there_and_back() {
        assert_eq!(decoded("a%20b%C3%A9.bin").as_deref(), Some("a b\u{e9}.bin"));
        assert_eq!(encoded("a b\u{e9}.bin"), "a%20b%C3%A9.bin");
        assert_eq!(decoded("%ff"), None);
        assert_eq!(decoded("%2e%2e/x").as_deref(), Some("../x"));
    }
}
