//! The header: `ply`, `format`, then `element` and `property` lines up to `end_header`.

use super::element::{AXES, Element, Kind, Property, is_corners};
use super::scalar::Scalar;
use crate::error::{ParseError, Place};
use crate::text;

/// How the rows are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

impl Encoding {
    const NAMES: [(&'static str, Self); 3] = [
        ("ascii", Self::Ascii),
        ("binary_little_endian", Self::LittleEndian),
        ("binary_big_endian", Self::BigEndian),
    ];

    fn from_name(name: &[u8]) -> Option<Self> {
        Self::NAMES.into_iter().find(|(known, _)| known.as_bytes() == name).map(|(_, encoding)| encoding)
    }

    fn name(self) -> &'static str {
        Self::NAMES.into_iter().find(|(_, encoding)| *encoding == self).map_or("ascii", |(name, _)| name)
    }
}

/// What the header says.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Which element is `vertex`.
    pub(super) vertex: usize,
    /// The byte where the rows begin.
    pub(super) start: usize,
}

impl Header {
    pub(super) fn vertex(&self) -> &Element {
        &self.elements[self.vertex]
    }
}

/// The first word.
const MAGIC: &[u8] = b"ply";

/// Whether the first line says `ply`.
pub(super) fn is_ply(bytes: &[u8]) -> bool {
    let line = bytes[text::beginning(bytes)..].split_at_checked(MAGIC.len());
    line.is_some_and(|(word, rest)| {
        word.eq_ignore_ascii_case(MAGIC) && rest.first().is_some_and(|end| text::is_space(*end))
    })
}

/// Reads the header.
pub(super) fn parse(bytes: &[u8]) -> Result<Header, ParseError> {
    let mut reader =
        Reader { lines: HeaderLines::new(bytes), number: 0, encoding: None, elements: Vec::new() };
    let first = reader.next()?;
    if !first.first().is_some_and(|word| word.eq_ignore_ascii_case(MAGIC)) {
        return Err(reader.malformed("a PLY file must begin with a line that says `ply`".into()));
    }
    loop {
        let words = reader.next()?;
        match words.as_slice() {
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"format", name, ..] => reader.format(name)?,
            [b"element", name, count] => reader.element(name, count)?,
            [b"property", rest @ ..] => reader.property(rest)?,
            [b"end_header"] => return reader.finish(),
            [b"element" | b"format", ..] => {
                return Err(reader.malformed("an element needs a name and a count, a format its name".into()));
            }
            // Old versions of Blender write a line of their own without `comment` before it.
            _ => {}
        }
    }
}

/// The lines of the header, which end as the first one does.
struct HeaderLines<'a> {
    bytes: &'a [u8],
    at: usize,
    end: u8,
}

impl<'a> HeaderLines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        // A binary body may begin with any byte, LF too: only the first line can tell what a lone CR means.
        let end = match memchr::memchr2(b'\n', b'\r', bytes) {
            Some(i) if bytes[i] == b'\r' && bytes.get(i + 1) != Some(&b'\n') => b'\r',
            _ => b'\n',
        };
        Self { bytes, at: text::beginning(bytes), end }
    }

    /// The next line; `None` when no line end follows any more.
    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.bytes.get(self.at..)?;
        let length = match memchr::memchr(self.end, rest) {
            Some(length) => length,
            None if rest.is_empty() => return None,
            None => rest.len(),
        };
        self.at += length + 1;
        Some(&rest[..length])
    }
}

struct Reader<'a> {
    lines: HeaderLines<'a>,
    number: usize,
    encoding: Option<Encoding>,
    elements: Vec<Element>,
}

impl<'a> Reader<'a> {
    fn next(&mut self) -> Result<Vec<&'a [u8]>, ParseError> {
        self.number += 1;
        let Some(line) = self.lines.next() else {
            return Err(self.malformed("the file ends before `end_header`".into()));
        };
        Ok(line.split(|&b| text::is_space(b)).filter(|word| !word.is_empty()).collect())
    }

    fn format(&mut self, name: &[u8]) -> Result<(), ParseError> {
        let Some(encoding) = Encoding::from_name(name) else {
            return Err(self.malformed(format!("the PLY format `{}` is unknown", text::quoted(name))));
        };
        self.encoding = Some(encoding);
        Ok(())
    }

    fn element(&mut self, name: &[u8], count: &[u8]) -> Result<(), ParseError> {
        let number = text::integer(count).and_then(|n| usize::try_from(n).ok());
        let Some(count) = number else {
            return Err(self.malformed(format!("`{}` is no count of elements", text::quoted(count))));
        };
        let name = String::from_utf8_lossy(name).into_owned();
        if name == "vertex" && self.elements.iter().any(|e| e.name == name) {
            return Err(self.malformed("the element `vertex` is declared twice".into()));
        }
        self.elements.push(Element { name, count, properties: Vec::new() });
        Ok(())
    }

    fn property(&mut self, words: &[&[u8]]) -> Result<(), ParseError> {
        let (kind, name) = match words {
            [b"list", count, item, name] => {
                (Kind::List { count: self.scalar(count)?, item: self.scalar(item)? }, name)
            }
            [scalar, name] => (Kind::One(self.scalar(scalar)?), name),
            _ => return Err(self.malformed("a property needs a type and a name".into())),
        };
        let name = String::from_utf8_lossy(name).into_owned();
        let Some(element) = self.elements.last_mut() else {
            return Err(self.malformed("a property stands before the first element".into()));
        };
        element.properties.push(Property { name, kind });
        Ok(())
    }

    fn scalar(&self, name: &[u8]) -> Result<Scalar, ParseError> {
        Scalar::from_name(name)
            .ok_or_else(|| self.malformed(format!("the property type `{}` is unknown", text::quoted(name))))
    }

    /// What must be true of a whole header.
    fn finish(self) -> Result<Header, ParseError> {
        let Some(encoding) = self.encoding else {
            return Err(self.malformed("the header has no `format` line".into()));
        };
        let Some(vertex) = self.elements.iter().position(|e| e.name == "vertex") else {
            return Err(self.malformed("the header declares no element `vertex`".into()));
        };
        let element = &self.elements[vertex];
        for axis in AXES {
            let mut named = element.properties.iter().filter(|p| p.name == axis);
            if !matches!((named.next().map(|p| p.kind), named.next()), (Some(Kind::One(_)), None)) {
                let problem =
                    format!("the element `vertex` must have one property `{axis}` that is a number");
                return Err(self.malformed(problem));
            }
        }
        for element in self.elements.iter().filter(|e| e.is_faces() && e.count > 0) {
            if !element.properties.iter().any(is_corners) {
                let problem = format!("the element `{}` has no list `vertex_indices`", element.name);
                return Err(self.malformed(problem));
            }
        }
        Ok(Header { encoding, vertex, start: self.lines.at, elements: self.elements })
    }

    fn malformed(&self, problem: String) -> ParseError {
        ParseError::Malformed { place: Place::Line(self.number), problem }
    }
}

/// The header of a plain file with 64-bit positions and triangles.
pub(super) fn plain(encoding: Encoding, points: usize, triangles: usize) -> Vec<u8> {
    format!(
        "ply\nformat {} 1.0\nelement vertex {points}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {triangles}\nproperty list uchar uint vertex_indices\nend_header\n",
        encoding.name()
    )
    .into_bytes()
}
