//! Binary STL: 80 free bytes, a count, and for each facet twelve 32-bit floats and two attribute bytes.
//!
//! Programs that write as they go leave the count at 0 or at all ones. Where whole records follow to the end of the file, or
//! where the count is 0, there are as many facets as there are records, and a note says so. Fewer than the count and a piece
//! of one more are a file that was cut off.

use nalgebra::Point3;
use sombrero_mesh::Soup;

use super::ascii;
use super::facet::{normal, triangles};
use crate::attributes::Attributes;
use crate::coordinate;
use crate::error::{ParseError, Place, WriteError};
use crate::format::Format;
use crate::input::Source;
use crate::parsed::{self, Original, Parsed, Rewrite, Rewritten};

const HEADER: usize = 80;
/// Header and count.
const PREFIX: usize = HEADER + 4;
const RECORD: usize = 50;

/// The number of facets that the file says it has.
fn claimed(bytes: &[u8]) -> Option<u32> {
    bytes.get(HEADER..)?.first_chunk().map(|count| u32::from_le_bytes(*count))
}

/// Whether the file is exactly as long as a binary STL with its count of facets.
pub(super) fn has_exact_length(bytes: &[u8]) -> bool {
    claimed(bytes).is_some_and(|n| bytes.len() as u64 == PREFIX as u64 + RECORD as u64 * u64::from(n))
}

/// Whether the file is a binary STL by its length. One without facets says nothing: a text may be as long.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    claimed(bytes) != Some(0) && has_exact_length(bytes)
}

/// How many facets the file holds, if it can be a binary STL: as many as its count says, or as follow it.
fn facets(bytes: &[u8]) -> Option<usize> {
    let claimed = usize::try_from(claimed(bytes)?).ok()?;
    let (records, rest) = bytes.get(PREFIX..)?.as_chunks::<RECORD>();
    let whole = rest.is_empty() || claimed == 0;
    let held = if whole && records.len() != claimed { records.len() } else { claimed };
    (held <= records.len()).then_some(held)
}

/// Whether a file that is called STL may be a binary one with another count or with more behind its facets.
pub(super) fn may_be_binary(bytes: &[u8]) -> bool {
    has_nul(bytes) && facets(bytes).is_some_and(|facets| facets > 0)
}

/// Whether there is a zero where no position stands: in the first bytes, as in the count of most binary files, or in the
/// attribute of the first facet. Of a text, what stands behind the first facet's beginning changes with its numbers.
pub(super) fn has_nul(bytes: &[u8]) -> bool {
    let first = &bytes[..bytes.len().min(PREFIX + RECORD)];
    let steady = &first[..ascii::first_facet(first).unwrap_or(first.len())];
    let (header, record) = steady.split_at(steady.len().min(PREFIX));
    let attribute = record.get(RECORD - 2..).unwrap_or_default();
    memchr::memchr(0, header).is_some() || attribute.contains(&0)
}

/// Reads the whole file; bytes behind the last facet are passed over.
pub(super) fn parse(source: Source<'_>) -> Result<Parsed, ParseError> {
    let Source { bytes, limits, .. } = source;
    let Some(count) = claimed(bytes) else {
        return Err(ParseError::Truncated { element: "header".into(), index: 0 });
    };
    let records = records(bytes);
    let Some(records) = facets(bytes).and_then(|facets| records.get(..facets)) else {
        return Err(ParseError::Overclaimed {
            element: "facet".into(),
            count: count.into(),
            needed: RECORD as u64 * u64::from(count),
            available: (bytes.len() - PREFIX) as u64,
        });
    };
    limits.check_vertices(records.len().saturating_mul(3))?;
    let soup = Soup::new(points(records), triangles(records.len()));
    let mut parsed = Parsed::new(Format::StlBinary, soup, attributes(records), Layout);
    let held = records.len();
    if held as u64 != u64::from(count) {
        parsed
            .notes
            .push(format!("The header counts {count} facets, but {held} follow, and all of them are read."));
    }
    let behind = bytes.len() - PREFIX - RECORD * held;
    if behind >= RECORD {
        parsed.notes.push(format!(
            "UNMARKED: {behind} bytes behind the facets that the header counts are not read, and stay as they are."
        ));
    }
    Ok(parsed)
}

fn points(records: &[[u8; RECORD]]) -> Vec<Point3<f64>> {
    let corners = records.iter().flat_map(|record| vectors(record).into_iter().skip(1));
    corners.map(|corner| Point3::from(corner.map(f64::from))).collect()
}

fn attributes(records: &[[u8; RECORD]]) -> Attributes {
    let mut attributes = Attributes::default();
    attributes.note("facet normals");
    if records.iter().any(|r| !r.ends_with(&[0, 0])) {
        attributes.note("facet attributes");
    }
    attributes
}

/// The whole records of the file, including those that its count leaves out.
fn records(bytes: &[u8]) -> &[[u8; RECORD]] {
    bytes.get(PREFIX..).unwrap_or_default().as_chunks().0
}

/// A record's normal and three corners.
fn vectors(record: &[u8; RECORD]) -> [[f32; 3]; 4] {
    let (floats, _) = record.as_chunks::<4>();
    std::array::from_fn(|v| std::array::from_fn(|axis| f32::from_le_bytes(floats[3 * v + axis])))
}

/// Where the facets stand: records follow each other, so their number, known from the points, says all.
#[derive(Debug)]
struct Layout;

impl parsed::Layout for Layout {
    fn misplaced(&self, _: &[u8], vertex: usize) -> ParseError {
        ParseError::NonFinite { place: Place::Element { name: "facet".into(), index: vertex / 3 } }
    }

    fn steps(&self, soup: &Soup) -> Vec<f32> {
        coordinate::steps_of_singles(soup)
    }

    /// The file with new corners, and new normals where corners changed.
    fn rewrite(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
        _: &Rewrite,
    ) -> Result<Rewritten, WriteError> {
        let mut out = original.bytes.to_vec();
        let (records, _) = out.get_mut(PREFIX..).unwrap_or_default().as_chunks_mut::<RECORD>();
        let (facets, _) = points.as_chunks::<3>();
        for (facet, (record, corners)) in records.iter_mut().zip(facets).enumerate() {
            let [normal, old @ ..] = vectors(record);
            let corners = narrow(corners, [0, 1, 2].map(|corner| 3 * facet + corner))?;
            if old.map(|c| c.map(f32::to_bits)) != corners.map(|c| c.map(f32::to_bits)) {
                let normal = if normal == [0.0; 3] { normal } else { normal_of(&corners) };
                store(record, normal, corners);
            }
        }
        Ok(out.into())
    }
}

/// The corners of a facet as 32-bit floats; `vertices` are their numbers.
fn narrow(corners: &[Point3<f64>; 3], vertices: [usize; 3]) -> Result<[[f32; 3]; 3], WriteError> {
    let mut narrow = [[0.0; 3]; 3];
    for ((corner, vertex), narrow) in corners.iter().zip(vertices).zip(&mut narrow) {
        for (value, narrow) in corner.iter().zip(narrow) {
            *narrow = coordinate::narrow(vertex, *value)?;
        }
    }
    Ok(narrow)
}

/// The normal that a reader of the stored corners would find.
fn normal_of(corners: &[[f32; 3]; 3]) -> [f32; 3] {
    normal(corners.map(|c| Point3::from(c.map(f64::from)))).map(|c| c as f32)
}

fn store(record: &mut [u8; RECORD], normal: [f32; 3], corners: [[f32; 3]; 3]) {
    let (slots, _) = record.as_chunks_mut::<4>();
    let values = normal.into_iter().chain(corners.into_iter().flatten());
    for (slot, value) in slots.iter_mut().zip(values) {
        *slot = value.to_le_bytes();
    }
}

/// A new file with an empty header.
pub(super) fn encode(soup: &Soup) -> Result<Vec<u8>, WriteError> {
    let too_many = |_| WriteError::TooMany { format: Format::StlBinary, count: soup.triangles.len() };
    let count = u32::try_from(soup.triangles.len()).map_err(too_many)?;
    let mut out = vec![0; HEADER];
    out.reserve(4 + RECORD * soup.triangles.len());
    out.extend_from_slice(&count.to_le_bytes());
    for triangle in &soup.triangles {
        let corners = triangle.map(|corner| soup.points[corner as usize]);
        let corners = narrow(&corners, triangle.map(|corner| corner as usize))?;
        let mut record = [0; RECORD];
        store(&mut record, normal_of(&corners), corners);
        out.extend_from_slice(&record);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{moved, parse_error, read};

    fn file(header: &[u8], facets: u32) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(HEADER, b' ');
        bytes.extend_from_slice(&facets.to_le_bytes());
        for facet in 0..facets {
            let mut record = [0; RECORD];
            let z = facet as f32;
            store(&mut record, [0.5, 0.5, 0.5], [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]]);
            record[48..].copy_from_slice(&[1, 2]);
            bytes.extend_from_slice(&record);
        }
        bytes
    }

    #[test]
    fn a_header_that_begins_with_solid_is_still_binary() {
        let document = read(file(b"solid made by a CAD\nfacet normal", 2), "stl");
        assert_eq!(document.format(), Format::StlBinary);
        assert_eq!(document.triangles(), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(document.attributes(), ["facet normals", "facet attributes"]);
    }

    #[test]
    fn only_facets_that_moved_change_and_their_normals_follow() {
        let source = file(b"header", 3);
        let document = read(source.clone(), "stl");
        let mut points = document.points().to_vec();
        points[4] = Point3::new(0.0, 0.0, 2.0);
        points[5] = Point3::new(0.0, 3.0, 1.0);
        let bytes = document.with_points(&points).unwrap();
        assert_eq!(bytes[..PREFIX + RECORD], source[..PREFIX + RECORD]);
        assert_eq!(bytes[PREFIX + 2 * RECORD..], source[PREFIX + 2 * RECORD..]);
        let record = records(&bytes)[1];
        assert_eq!(vectors(&record)[0], [-1.0, 0.0, 0.0]);
        assert_eq!(record[48..], [1, 2]);
        assert_eq!(read(bytes, "stl").points(), points);
    }

    #[test]
    fn a_zero_normal_stays_zero() {
        let mut source = file(b"header", 1);
        source[PREFIX..PREFIX + 12].fill(0);
        let (bytes, _) = moved(&read(source, "stl"));
        assert_eq!(bytes[PREFIX..PREFIX + 12], [0; 12]);
    }

    #[test]
    fn bytes_behind_the_last_facet_are_kept() {
        let mut source = file(b"header", 1);
        source.extend_from_slice(b"tail");
        let (bytes, points) = moved(&read(source, "stl"));
        assert!(bytes.ends_with(b"\x01\x02tail"));
        assert_eq!(read(bytes, "stl").points(), points);
    }

    #[test]
    fn a_file_that_was_cut_off_is_refused() {
        let mut source = file(b"solid", 3);
        source.truncate(PREFIX + 2 * RECORD + 7);
        let expected =
            ParseError::Overclaimed { element: "facet".into(), count: 3, needed: 150, available: 107 };
        assert_eq!(parse_error(source.clone(), "stl"), expected);
        source.truncate(70);
        source[10] = 0;
        let expected = ParseError::Truncated { element: "header".into(), index: 0 };
        assert_eq!(parse_error(source, "stl"), expected);
    }

    #[test]
    fn a_count_that_disagrees_with_whole_facets_is_told() {
        for (count, facets) in [(0, 3), (1, 3), (2, 3), (4, 3), (u32::MAX, 2), (0x0101_0101, 1)] {
            for header in ["solid", "", "# a remark", "v 1 2 3"] {
                let mut source = file(header.as_bytes(), facets);
                source[HEADER..PREFIX].copy_from_slice(&count.to_le_bytes());
                source[PREFIX + RECORD - 2] = 0;
                let document = read(source.clone(), "stl");
                assert_eq!(document.triangles().len(), facets as usize, "{count} {header}");
                let note = format!(
                    "The header counts {count} facets, but {facets} follow, and all of them are read."
                );
                assert_eq!(document.notes(), [note]);
                let (bytes, points) = moved(&document);
                assert_eq!(bytes[..PREFIX], source[..PREFIX]);
                assert_eq!(read(bytes, "stl").points(), points);
            }
        }
    }

    #[test]
    fn a_count_of_zero_counts_nothing() {
        let mut source = file(b"header", 2);
        source[HEADER..PREFIX].fill(0);
        source.extend_from_slice(b"tail");
        assert_eq!(read(source.clone(), "stl").triangles().len(), 2);
        assert_eq!(parse_error(&source[..PREFIX], "stl"), ParseError::NoVertices);
    }

    #[test]
    fn what_could_be_more_facets_behind_the_last_is_told() {
        let one = file(b"header", 3);
        let document = read([one.clone(), one.clone()].concat(), "stl");
        assert_eq!(document.triangles().len(), 3);
        let note = "UNMARKED: 234 bytes behind the facets that the header counts are not read, and stay as they are.";
        assert_eq!(document.notes(), [note]);
        assert!(read([one.as_slice(), &[7; 49]].concat(), "stl").notes().is_empty());
    }

    #[test]
    fn an_empty_solid_is_no_mesh() {
        assert_eq!(parse_error(file(b"header", 0), "stl"), ParseError::NoVertices);
    }

    #[test]
    fn a_corner_that_is_not_finite_is_named() {
        let mut source = file(b"header", 2);
        source[PREFIX + RECORD + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        let place = Place::Element { name: "facet".into(), index: 1 };
        assert_eq!(parse_error(source, "stl"), ParseError::NonFinite { place });
    }

    #[test]
    fn a_normal_that_is_not_finite_is_kept_until_the_facet_moves() {
        let mut source = file(b"header", 1);
        source[PREFIX..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        let document = read(source.clone(), "stl");
        assert_eq!(document.with_points(document.points()).unwrap(), source);
        let mut points = document.points().to_vec();
        points[0].x = -1.0;
        let bytes = document.with_points(&points).unwrap();
        assert_eq!(vectors(&records(&bytes)[0])[0], [0.0, 0.0, 1.0]);
    }

    #[test]
    fn coordinates_beyond_32_bit_floats_are_refused() {
        let document = read(file(b"header", 1), "stl");
        let mut points = document.points().to_vec();
        points[2].y = 1e39;
        let refused = document.with_points(&points).unwrap_err();
        assert!(matches!(refused, WriteError::Overflow { vertex: 2, value: 1e39 }));
        let soup = Soup::new(points, vec![[2, 1, 0]]);
        assert!(matches!(encode(&soup), Err(WriteError::Overflow { vertex: 2, .. })));
    }
}
