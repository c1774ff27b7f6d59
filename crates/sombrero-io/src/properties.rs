//! Laws that hold for every format, tried on many meshes and on broken files.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use nalgebra::Point3;
use proptest::prelude::*;
use sombrero_mesh::Soup;

use crate::{Document, Format, Limits, ParseError, WriteError, encode};

const FORMATS: [(Format, &str); 10] = [
    (Format::Obj, "obj"),
    (Format::PlyAscii, "ply"),
    (Format::PlyBinaryLittleEndian, "ply"),
    (Format::PlyBinaryBigEndian, "ply"),
    (Format::Off, "off"),
    (Format::OffBinary, "off"),
    (Format::StlAscii, "stl"),
    (Format::StlBinary, "stl"),
    (Format::Gltf, "gltf"),
    (Format::Glb, "glb"),
];

fn any_format() -> impl Strategy<Value = (Format, &'static str)> {
    prop::sample::select(&FORMATS[..])
}

/// Any finite coordinate.
fn wide() -> impl Strategy<Value = f64> {
    prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO
}

/// Any finite coordinate that 32-bit floats hold.
fn narrow() -> impl Strategy<Value = f64> {
    (prop::num::f32::NORMAL | prop::num::f32::SUBNORMAL | prop::num::f32::ZERO).prop_map(f64::from)
}

fn points(coordinate: impl Strategy<Value = f64>, count: usize) -> impl Strategy<Value = Vec<Point3<f64>>> {
    prop::collection::vec(prop::array::uniform3(coordinate).prop_map(Point3::from), count)
}

/// A mesh and other positions for the points that a document of it has.
fn mesh_and_positions(format: Format) -> impl Strategy<Value = (Format, Soup, Vec<Point3<f64>>)> {
    let single = matches!(format, Format::OffBinary | Format::StlBinary | Format::Gltf | Format::Glb);
    let coordinate = move || if single { narrow().boxed() } else { wide().boxed() };
    (1..20_usize, 1..20_usize).prop_flat_map(move |(vertices, triangles)| {
        let corner = 0..vertices as u32;
        let triangles = prop::collection::vec(prop::array::uniform3(corner), triangles);
        (points(coordinate(), vertices), triangles, points(coordinate(), 60)).prop_map(
            move |(points, triangles, mut others)| {
                let stored = stored(format, &Soup::new(points.clone(), triangles.clone())).points.len();
                others.truncate(stored);
                (format, Soup::new(points, triangles), others)
            },
        )
    })
}

/// What a document of the encoded mesh holds: STL gives every triangle corners of its own.
fn stored(format: Format, soup: &Soup) -> Soup {
    if !matches!(format, Format::StlAscii | Format::StlBinary) {
        return soup.clone();
    }
    let points: Vec<_> = soup.triangles.iter().flatten().map(|&v| soup.points[v as usize]).collect();
    let triangles = (0..soup.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Soup::new(points, triangles)
}

fn bits(points: &[Point3<f64>]) -> Vec<[u64; 3]> {
    points.iter().map(|p| [p.x, p.y, p.z].map(f64::to_bits)).collect()
}

/// Everything that is not a coordinate: text without the numbers, binary without the position bytes.
fn rest(format: Format, bytes: &[u8], vertices: usize) -> Vec<u8> {
    let text = || std::str::from_utf8(bytes).unwrap();
    match format {
        Format::Obj => without_lines(text(), |_, line| line.starts_with("v ")),
        Format::Off => without_lines(text(), |i, _| (2..2 + vertices).contains(&i)),
        Format::OffBinary => [&bytes[..23], &bytes[23 + 12 * vertices..]].concat(),
        Format::PlyAscii => without_lines(text(), |i, _| (9..9 + vertices).contains(&i)),
        Format::PlyBinaryLittleEndian | Format::PlyBinaryBigEndian => {
            let start = memchr::memmem::find(bytes, b"end_header\n").unwrap() + 11;
            [&bytes[..start], &bytes[start + 24 * vertices..]].concat()
        }
        // Normals follow from positions.
        Format::StlAscii => text()
            .split_inclusive([' ', '\n'])
            .filter(|w| w.trim().parse::<f64>().is_err())
            .collect::<String>()
            .into(),
        Format::StlBinary => {
            let attributes = bytes[84..].chunks(50).flat_map(|record| record[48..].to_vec());
            bytes[..84].iter().copied().chain(attributes).collect()
        }
        Format::Gltf => {
            let (before, uri) = text().split_once("base64,").unwrap();
            let (payload, behind) = uri.split_once('"').unwrap();
            let buffer = BASE64_STANDARD.decode(payload).unwrap();
            [without_bounds(before), behind.into(), buffer[12 * vertices..].to_vec()].concat()
        }
        Format::Glb => {
            let json = 20..20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
            let text = std::str::from_utf8(&bytes[json.clone()]).unwrap().trim_end();
            [
                without_bounds(text),
                bytes[json.end..][..8].to_vec(),
                bytes[json.end + 8 + 12 * vertices..].to_vec(),
            ]
            .concat()
        }
        Format::ThreeMf => unreachable!("containers have laws of their own"),
    }
}

fn without_lines(text: &str, leave_out: impl Fn(usize, &str) -> bool) -> Vec<u8> {
    let lines = text.split_inclusive('\n').enumerate();
    lines.filter(|(i, line)| !leave_out(*i, line)).map(|(_, line)| line).collect::<String>().into()
}

/// The JSON of a glTF without the bounds of its positions.
fn without_bounds(json: &str) -> Vec<u8> {
    let (before, bounds) = json.split_once(",\"min\"").unwrap();
    let (_, behind) = bounds.split_once('}').unwrap();
    format!("{before}{behind}").into()
}

/// A mesh to be written in some format, and other positions for what is read back.
fn any_mesh() -> impl Strategy<Value = (Format, Soup, Vec<Point3<f64>>)> {
    any_format().prop_flat_map(|(format, _)| mesh_and_positions(format))
}

#[test]
fn the_limit_of_vertices_is_exact_in_every_format() {
    let soup = sombrero_shapes::tetrahedron();
    for (format, extension) in FORMATS {
        let bytes = encode(format, &soup).unwrap();
        let count = Document::parse(bytes.clone(), Some(extension)).unwrap().points().len();
        let within = |limit| {
            let limits = Limits::default().with_max_vertices(limit);
            Document::parse_within(bytes.clone(), Some(extension), limits)
        };
        assert!(within(count).is_ok());
        assert_eq!(
            within(count - 1).unwrap_err(),
            ParseError::TooManyVertices { limit: count - 1 },
            "{format}"
        );
    }
}

proptest! {
    #[test]
    fn what_is_written_is_read_back((format, soup, _) in any_mesh()) {
        let document = Document::parse(encode(format, &soup).unwrap(), None).unwrap();
        let expected = stored(format, &soup);
        prop_assert_eq!(document.format(), format);
        prop_assert_eq!(bits(document.points()), bits(&expected.points));
        prop_assert_eq!(document.triangles(), &expected.triangles[..]);
        prop_assert_eq!(document.soup(), &expected);
    }

    #[test]
    fn only_positions_move((format, soup, new) in any_mesh()) {
        let source = encode(format, &soup).unwrap();
        let document = Document::parse(source.clone(), None).unwrap();
        prop_assert_eq!(document.with_points(document.points()).unwrap(), source.clone());
        let bytes = document.with_points(&new).unwrap();
        let vertices = new.len();
        prop_assert_eq!(rest(format, &bytes, vertices), rest(format, &source, vertices));
        let again = Document::parse(bytes, None).unwrap();
        prop_assert_eq!(bits(again.points()), bits(&new));
        prop_assert_eq!(again.triangles(), document.triangles());
        prop_assert_eq!(again.attributes(), document.attributes());
    }

    #[test]
    fn any_bytes_are_a_mesh_or_an_error(
        bytes in prop::collection::vec(any::<u8>(), 0..400),
        (_, extension) in any_format(),
        begin in prop::sample::select(&["", "ply\nformat ascii 1.0\n", "OFF\n", "solid\nfacet ", "v ", "glTF\x02\0\0\0"][..]),
    ) {
        survives([begin.as_bytes(), &bytes].concat(), extension);
    }

    #[test]
    fn any_words_are_a_mesh_or_an_error(
        words in prop::collection::vec(prop::sample::select(WORDS), 0..60),
        (_, extension) in any_format(),
    ) {
        survives(words.join(" ").into_bytes(), extension);
        survives(words.concat().into_bytes(), extension);
    }

    #[test]
    fn a_damaged_file_is_a_mesh_or_an_error(
        sample in prop::sample::select(&SAMPLES[..]),
        damage in prop::collection::vec((any::<prop::sample::Index>(), 0..4_u8, any::<u8>()), 1..6),
    ) {
        let (bytes, extension) = sample();
        survives(damaged(bytes, &damage), extension);
    }
}

/// Words that the text formats give a meaning to, and some that they should not.
const WORDS: &[&str] = &[
    "v",
    "f",
    "vn",
    "\n",
    "\r",
    "\\\n",
    "#",
    "0",
    "1",
    "-1",
    "3",
    "2/2/2",
    "4294967296",
    "99999999999999999999",
    "nan",
    "1e400",
    "1e-400",
    "OFF",
    "STCN4nOFF",
    "BINARY",
    "solid",
    "endsolid",
    "facet",
    "normal",
    "outer",
    "loop",
    "vertex",
    "endloop",
    "endfacet",
    "ply\n",
    "format ascii 1.0\n",
    "format binary_little_endian 1.0\n",
    "element vertex 2\n",
    "element face 1\n",
    "element tristrips 1\n",
    "element nothing 9223372036854775807\n",
    "property float x\n",
    "property float y\n",
    "property double z\n",
    "property list uchar int vertex_indices\n",
    "property list float double n\n",
    "end_header\n",
    "\0",
    "\u{feff}",
];

type Sample = fn() -> (Vec<u8>, &'static str);

const SAMPLES: [Sample; 12] = [
    || plain(0),
    || plain(1),
    || plain(2),
    || plain(3),
    || plain(4),
    || plain(5),
    || plain(6),
    || plain(7),
    || plain(8),
    || plain(9),
    || (b"o a\nv 0 0 0 1 1 1\r\nv 1 0 \\\n0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 -1/1\nl 1 2\n".to_vec(), "obj"),
    || {
        let header = b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty list uchar short n\n\
            property float x\nproperty uchar c\nproperty float y\nproperty float z\nelement tristrips 1\n\
            property list int int vertex_indices\nend_header\n";
        let vertex = [1, 0, 7, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0, 0];
        let strip = [0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2];
        ([&header[..], &vertex.repeat(3), &strip].concat(), "ply")
    },
];

fn plain(format: usize) -> (Vec<u8>, &'static str) {
    let (format, extension) = FORMATS[format];
    let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.5, 1.25)].map(|(x, y)| Point3::new(x, y, 0.5));
    (encode(format, &Soup::new(corners.to_vec(), vec![[0, 1, 2], [2, 1, 3]])).unwrap(), extension)
}

fn damaged(mut bytes: Vec<u8>, damage: &[(prop::sample::Index, u8, u8)]) -> Vec<u8> {
    for (at, kind, value) in damage {
        if bytes.is_empty() {
            break;
        }
        let at = at.index(bytes.len());
        match kind {
            0 => bytes[at] = *value,
            1 => bytes[at] ^= 1 << (value % 8),
            2 => bytes.truncate(at),
            _ => drop(
                bytes.splice(at..at, [b"0-/9 \n.e"[usize::from(value % 8)]].repeat(usize::from(value / 8))),
            ),
        }
    }
    bytes
}

/// Whatever parses must also be rewritten: to itself where nothing moves, and to a file of the same shape.
fn survives(bytes: Vec<u8>, extension: &str) {
    let Ok(document) = Document::parse(bytes.clone(), Some(extension)) else {
        return;
    };
    let count = document.points().len();
    assert!(document.triangles().iter().flatten().all(|&corner| (corner as usize) < count));
    assert!(count <= bytes.len(), "{count} vertices of {} bytes", bytes.len());
    assert_eq!(document.with_points(document.points()).unwrap(), bytes);
    let new: Vec<_> =
        document.points().iter().map(|p| p.map(|c| f64::from((c / 2.0) as f32) + 1.0)).collect();
    match document.with_points(&new) {
        Ok(moved) => {
            let again = Document::parse(moved, Some(extension)).unwrap();
            assert_eq!(again.points().len(), count);
            assert_eq!(again.soup_like(document.triangles()).triangles, document.triangles());
        }
        Err(error) => {
            assert!(matches!(
                error,
                WriteError::IntegerCoordinates { .. }
                    | WriteError::OffGrid { .. }
                    | WriteError::NotStored { .. }
                    | WriteError::Overflow { .. }
                    | WriteError::NonFinite { .. }
            ));
        }
    }
}

#[test]
fn positions_must_be_finite_and_as_many_as_there_are() {
    for format in 0..FORMATS.len() {
        let (bytes, extension) = plain(format);
        let document = Document::parse(bytes, Some(extension)).unwrap();
        let mut points = document.points().to_vec();
        points[1].z = f64::NAN;
        assert!(matches!(document.with_points(&points), Err(WriteError::NonFinite { vertex: 1 })));
        points.pop();
        let message = document.with_points(&points).unwrap_err().to_string();
        let expected = format!("{} positions for a file of {} vertices", points.len(), points.len() + 1);
        assert!(message.starts_with(&expected), "{message}");
    }
}

#[test]
fn unusable_meshes_are_not_encoded() {
    let points = vec![Point3::origin(); 3];
    for (format, _) in FORMATS {
        assert!(matches!(encode(format, &Soup::default()), Err(WriteError::Nothing { .. })));
        let soup = Soup::new(points.clone(), vec![[0, 1, 2], [0, 3, 1]]);
        let refused = encode(format, &soup);
        assert!(matches!(refused, Err(WriteError::IndexOutOfRange { triangle: 1, index: 3, count: 3 })));
        let soup = Soup::new(vec![Point3::new(0.0, f64::INFINITY, 0.0); 3], vec![[0, 1, 2]]);
        assert!(matches!(encode(format, &soup), Err(WriteError::NonFinite { vertex: 0 })));
    }
}

#[test]
fn an_empty_file_is_refused() {
    assert_eq!(Document::parse(Vec::new(), Some("obj")).unwrap_err(), crate::ParseError::Empty);
}

#[test]
fn files_are_read_by_path_and_errors_name_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("thing.off");
    std::fs::write(&path, "1 0 0\n1 2 3\n").unwrap();
    assert_eq!(Document::read(&path).unwrap().points(), [Point3::new(1.0, 2.0, 3.0)]);
    std::fs::write(&path, "1 0 0\n1 2 x\n").unwrap();
    let error = Document::read(&path).unwrap_err();
    assert!(error.to_string().ends_with(
        "thing.off, line 2: expected a number, found `x`; correct this or export the model again"
    ));
}
