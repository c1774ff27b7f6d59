//! Other positions in a file that was read, and new files.

use std::ops::Range;

use nalgebra::Point3;
use sombrero_mesh::Soup;

use super::archive::{Archive, Budget};
use super::build::build;
use super::xml;
use crate::coordinate::is_finite;
use crate::decimals::{Decimals, Spelling, Survey, respelled, rms};
use crate::error::{ParseError, WriteError};
use crate::format::Format;
use crate::parsed::{self, Original, Rewrite, Rewritten};
use crate::placement::Placement;
use crate::splice::Splice;
use crate::text;

/// Where the positions stand.
#[derive(Debug, Default)]
pub(super) struct Layout {
    pub(super) parts: Vec<PartLayout>,
}

/// Where the positions stand in one part.
#[derive(Debug, Clone)]
pub(super) struct PartLayout {
    /// The part's entry in the archive.
    pub(super) entry: usize,
    /// For each vertex the byte where its tag begins, in the unpacked text.
    pub(super) slots: Vec<usize>,
    /// How many of the vertices each mesh has, and where the scene puts it.
    pub(super) blocks: Vec<(usize, Placement)>,
}

impl parsed::Layout for Layout {
    fn misplaced(&self, bytes: &[u8], vertex: usize) -> ParseError {
        let slots = self.parts.iter().flat_map(|part| part.slots.iter().map(|slot| (part.entry, *slot)));
        let found = slots.zip(0..).find(|(_, number)| *number == vertex);
        let ((entry, slot), Ok(archive)) = (found.map_or((0, 0), |(found, _)| found), Archive::open(bytes))
        else {
            return ParseError::NoVertices;
        };
        let text = archive.unpack(entry, &mut Budget::new(u64::MAX)).unwrap_or_default();
        ParseError::NonFinite { place: xml::place(&archive.title(entry), &text, slot) }
    }

    /// The file with new positions.
    ///
    /// Texts were not kept, so those that change are unpacked again.
    fn rewrite(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
        how: &Rewrite,
    ) -> Result<Rewritten, WriteError> {
        let (source, all) = (original.bytes, &original.soup.points);
        if all.iter().zip(points).all(|(old, new)| text::same(old, new)) {
            return Ok(source.to_vec().into());
        }
        let mut archive = None;
        let alike = self.spelling(source, all, points, how)?;
        let (mut packed, mut start) = (Vec::new(), 0);
        for part in &self.parts {
            let range = start..start + part.slots.len();
            start = range.end;
            let (Some(old), Some(new)) = (all.get(range.clone()), points.get(range.clone())) else {
                continue;
            };
            if alike.is_none() && old.iter().zip(new).all(|(old, new)| text::same(old, new)) {
                continue;
            }
            if archive.is_none() {
                archive = Some(Archive::open(source).map_err(unreadable)?);
            }
            let Some(archive) = &archive else { continue };
            // It was within its limits when it was read first.
            let bytes = archive.unpack(part.entry, &mut Budget::new(u64::MAX)).map_err(unreadable)?;
            let exact = part.rewrite(&bytes, range.start, old, new)?;
            let text = match &alike {
                Some(alike) => part.respelled(&bytes, &exact, alike),
                None => exact,
            };
            packed.push(archive.pack(part.entry, &text));
        }
        match archive {
            Some(archive) => Ok(archive.replace(packed)?.into()),
            None => Ok(source.to_vec().into()),
        }
    }
}

impl Layout {
    /// How all coordinates are to be spelled; `None` for exactly.
    fn spelling(
        &self,
        source: &[u8],
        old: &[Point3<f64>],
        new: &[Point3<f64>],
        how: &Rewrite,
    ) -> Result<Option<Spelling>, WriteError> {
        if how.decimals == Decimals::Exact {
            return Ok(None);
        }
        let archive = Archive::open(source).map_err(unreadable)?;
        let mut survey = Survey::default();
        for part in &self.parts {
            let bytes = archive.unpack(part.entry, &mut Budget::new(u64::MAX)).map_err(unreadable)?;
            for span in part.slots.iter().flat_map(|&slot| coordinates(&bytes, slot)) {
                survey.add(bytes.get(span).unwrap_or_default());
            }
        }
        let rms = rms(self.stored(old).iter().zip(&self.stored(new)));
        Ok(Some(survey.spelling(how.decimals, rms, how.filling)))
    }

    /// Points as the file stores them.
    fn stored(&self, points: &[Point3<f64>]) -> Vec<Point3<f64>> {
        let blocks = self.parts.iter().flat_map(|part| &part.blocks);
        let placements = blocks.flat_map(|(count, place)| std::iter::repeat_n(place, *count));
        placements.zip(points).map(|(place, point)| place.stored(point)).collect()
    }
}

/// What was read once can be read again, so this does not happen.
fn unreadable(error: ParseError) -> WriteError {
    WriteError::Io { path: "3MF".into(), source: std::io::Error::other(error.to_string()) }
}

impl PartLayout {
    /// The part's text with new positions; `first` is the number of its first vertex.
    fn rewrite(
        &self,
        bytes: &[u8],
        first: usize,
        old: &[Point3<f64>],
        new: &[Point3<f64>],
    ) -> Result<Vec<u8>, WriteError> {
        let mut splice = Splice::new(bytes);
        let placements = self.blocks.iter().flat_map(|(count, place)| std::iter::repeat_n(place, *count));
        let vertices = self.slots.iter().zip(placements).zip(old.iter().zip(new)).enumerate();
        for (i, ((&slot, placement), (old, new))) in vertices {
            if !text::same(old, new) {
                let stored = placement.stored(new);
                if !is_finite(&stored) || !is_finite(&placement.world(&stored)) {
                    return Err(WriteError::NonFinite { vertex: first + i });
                }
                // What an axis would get for a vertex that stays is no reason to spell it anew.
                replace(&mut splice, bytes, slot, &placement.stored(old), &stored);
            }
        }
        Ok(splice.finish())
    }
}

impl PartLayout {
    /// The `exact` text of the part with all coordinates spelled alike. Tags are where they were in `before`, but for what
    /// coordinates before them have become longer.
    fn respelled(&self, before: &[u8], exact: &[u8], alike: &Spelling) -> Vec<u8> {
        let (mut words, mut longer) = (Vec::new(), 0_isize);
        // Vertices of a part may be shown in another order than they are stored.
        let mut slots = self.slots.clone();
        slots.sort_unstable();
        for slot in slots {
            let Some(moved) = slot.checked_add_signed(longer) else { break };
            let spans = coordinates(exact, moved);
            let length = |spans: &[Range<usize>]| spans.iter().map(|span| span.len() as isize).sum::<isize>();
            longer += length(&spans) - length(&coordinates(before, slot));
            words.extend(spans.into_iter().map(|span| (span, alike)));
        }
        respelled(exact, &words)
    }
}

/// Where the coordinates of the tag at `slot` stand, in order.
fn coordinates(bytes: &[u8], slot: usize) -> Vec<Range<usize>> {
    let Some((start, body)) = tag(bytes, slot) else { return Vec::new() };
    let spans = xml::pick(body, ["x", "y", "z"]).unwrap_or_default();
    let mut spans: Vec<_> = spans.into_iter().flatten().map(|s| start + s.start..start + s.end).collect();
    spans.sort_by_key(|span| span.start);
    spans
}

/// Puts the coordinates that changed into the tag at `slot`.
fn replace(splice: &mut Splice<'_>, bytes: &[u8], slot: usize, old: &Point3<f64>, new: &Point3<f64>) {
    let Some((start, body)) = tag(bytes, slot) else {
        debug_assert!(false, "the tag was read before");
        return;
    };
    let spans = xml::pick(body, ["x", "y", "z"]).unwrap_or_default();
    let changed = old.iter().zip(new.iter()).map(|(old, new)| old.to_bits() != new.to_bits());
    let mut values: Vec<_> = spans.into_iter().zip(new.iter().zip(changed)).collect();
    values.retain(|(_, (_, changed))| *changed);
    // Attributes come in any order.
    values.sort_by_key(|(span, _)| span.as_ref().map(|span| span.start));
    for (span, (value, _)) in values {
        if let Some(span) = span {
            let decimals = body.get(span.clone()).map_or(0, |word| text::decimals(word.as_bytes()));
            let span = start + span.start..start + span.end;
            splice.replace(span, |out| text::push_number_with(out, *value, decimals));
        }
    }
}

/// The body of the tag at `slot`, and where it begins.
fn tag(bytes: &[u8], slot: usize) -> Option<(usize, &str)> {
    let start = slot + 1;
    let rest = bytes.get(start..)?;
    let mut quote = None;
    let length = rest.iter().position(|&byte| match quote {
        Some(open) => {
            quote = quote.filter(|_| byte != open);
            false
        }
        None => {
            quote = matches!(byte, b'"' | b'\'').then_some(byte);
            byte == b'>'
        }
    })?;
    let body = rest.get(..length)?;
    let body = body.strip_suffix(b"/").unwrap_or(body);
    Some((start, std::str::from_utf8(body).ok()?))
}

const TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
  <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
  <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"#;

const RELATIONSHIPS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
  <Relationship Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel" Target="/3D/3dmodel.model"/>
</Relationships>
"#;

const HEAD: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
  <resources>
    <object id="1" type="model">
      <mesh>
        <vertices>
"#;

const MIDDLE: &str = "        </vertices>\n        <triangles>\n";

const FOOT: &str = r#"        </triangles>
      </mesh>
    </object>
  </resources>
  <build>
    <item objectid="1"/>
  </build>
</model>
"#;

/// A new file with one object. The same mesh always gives the same bytes.
pub(super) fn encode(soup: &Soup) -> Result<Vec<u8>, WriteError> {
    let parts = [
        ("[Content_Types].xml", TYPES.into()),
        ("_rels/.rels", RELATIONSHIPS.into()),
        ("3D/3dmodel.model", model(soup)),
    ];
    build(&parts).ok_or(WriteError::TooMany { format: Format::ThreeMf, count: soup.triangles.len() })
}

fn model(soup: &Soup) -> Vec<u8> {
    let mut out = HEAD.as_bytes().to_vec();
    for point in &soup.points {
        out.extend_from_slice(b"          <vertex");
        for (name, &value) in ["x", "y", "z"].into_iter().zip(point.iter()) {
            push_attribute(&mut out, name, |out| text::push_number(out, value));
        }
        out.extend_from_slice(b"/>\n");
    }
    out.extend_from_slice(MIDDLE.as_bytes());
    for triangle in &soup.triangles {
        out.extend_from_slice(b"          <triangle");
        for (name, &corner) in ["v1", "v2", "v3"].into_iter().zip(triangle) {
            push_attribute(&mut out, name, |out| text::push_integer(out, corner.into()));
        }
        out.extend_from_slice(b"/>\n");
    }
    out.extend_from_slice(FOOT.as_bytes());
    out
}

fn push_attribute(out: &mut Vec<u8>, name: &str, value: impl FnOnce(&mut Vec<u8>)) {
    out.push(b' ');
    out.extend_from_slice(name.as_bytes());
    out.extend_from_slice(b"=\"");
    value(out);
    out.push(b'"');
}
