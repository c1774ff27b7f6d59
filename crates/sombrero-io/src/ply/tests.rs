use nalgebra::Point3;

use crate::error::{ParseError, Place, WriteError};
use crate::format::Format;
use crate::testing::{moved, parse_error, read};

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const FACES: &str = "property list uchar int vertex_indices\n";

/// A text file of the given header lines and rows.
fn ascii(header: &str, rows: &str) -> String {
    format!("ply\nformat ascii 1.0\n{header}end_header\n{rows}")
}

#[test]
fn a_byte_order_mark_and_capitals_change_nothing() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    for text in [
        format!("\u{feff}{text}"),
        text.replacen("ply", "PLY", 1),
        format!("\u{feff}{}", text.replace('\n', "\r")),
    ] {
        for extension in ["ply", "obj"] {
            let document = read(&text, extension);
            assert_eq!(document.triangles(), [[0, 1, 2]]);
            let (bytes, points) = moved(&document);
            assert_eq!(read(&bytes, "ply").points(), points);
            assert!(bytes.starts_with(&text.as_bytes()[..20]));
        }
    }
}

fn malformed(line: usize, problem: &str) -> ParseError {
    ParseError::Malformed { place: Place::Line(line), problem: problem.into() }
}

/// A square with a property of every type, lists before and between the coordinates, an element before the
/// vertices and one after the faces.
fn elaborate(big: bool) -> Vec<u8> {
    fn push<const N: usize>(out: &mut Vec<u8>, mut bytes: [u8; N], big: bool) {
        if big {
            bytes.reverse();
        }
        out.extend_from_slice(&bytes);
    }
    let format = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut out = format!(
        "ply\r\nformat {format} 1.0\r\ncomment kept\r\nobj_info kept too\r\nelement camera 2\r\n\
         property short id\r\nproperty list ushort double view\r\nelement vertex 4\r\n\
         property list char short tags\r\nproperty double z\r\nproperty uchar red\r\nproperty float32 x\r\n\
         property list uint8 float weights\r\nproperty int8 y_sign\r\nproperty float64 y\r\n\
         property ushort end\r\n\
         element face 2\r\nproperty list int uint8 vertex_index\r\nproperty list uchar float texcoord\r\n\
         element edge 1\r\nproperty int vertex1\r\nproperty int vertex2\r\nend_header\r\n"
    )
    .into_bytes();
    for camera in 0..2_u16 {
        push(&mut out, (-1_i16).to_le_bytes(), big);
        push(&mut out, camera.to_le_bytes(), big);
        for view in 0..camera {
            push(&mut out, f64::from(view).to_le_bytes(), big);
        }
    }
    for (vertex, (x, y)) in [(0.0_f32, 0.0_f64), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].into_iter().enumerate() {
        out.push(vertex as u8);
        for tag in 0..vertex as i16 {
            push(&mut out, tag.to_le_bytes(), big);
        }
        push(&mut out, 0.1_f64.to_le_bytes(), big);
        out.push(200);
        push(&mut out, x.to_le_bytes(), big);
        out.push(1);
        push(&mut out, 0.25_f32.to_le_bytes(), big);
        out.push(0xff);
        push(&mut out, y.to_le_bytes(), big);
        push(&mut out, 7_u16.to_le_bytes(), big);
    }
    for corners in [&[0, 1, 2][..], &[0, 2, 3, 1]] {
        push(&mut out, (corners.len() as i32).to_le_bytes(), big);
        out.extend_from_slice(corners);
        out.push(0);
    }
    out.extend_from_slice(&[9; 8]);
    out
}

#[test]
fn types_orders_lists_and_elements_of_every_kind() {
    for (big, format) in [(false, Format::PlyBinaryLittleEndian), (true, Format::PlyBinaryBigEndian)] {
        let source = elaborate(big);
        let document = read(&source, "ply");
        assert_eq!(document.format(), format);
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Point3::new(x, y, 0.1));
        assert_eq!(document.points(), square);
        assert_eq!(document.triangles(), [[0, 1, 2], [0, 2, 3], [0, 3, 1]]);
        let names = ["camera", "tags", "colours", "weights", "y_sign", "end", "texture coordinates", "edge"];
        assert_eq!(document.attributes(), names);
        assert_eq!(document.with_points(document.points()).unwrap(), source);
        let (bytes, points) = moved(&document);
        assert_eq!(bytes.len(), source.len());
        assert_eq!(read(&bytes, "ply").points(), points);
        let back = read(bytes, "ply").with_points(document.points()).unwrap();
        assert_eq!(back, source, "moved there and back, every byte is as it was");
    }
}

#[test]
fn binary_types_are_kept_and_doubles_stay_exact() {
    let document = read(elaborate(false), "ply");
    let mut points = document.points().to_vec();
    points[1] = Point3::new(0.1, 0.2, 0.3);
    let again = read(document.with_points(&points).unwrap(), "ply");
    assert_eq!(again.points()[1], Point3::new(f64::from(0.1_f32), 0.2, 0.3));
}

#[test]
fn text_keeps_all_but_the_coordinates() {
    let header = format!(
        "comment a\nelement vertex 2\nproperty list uchar int n\nproperty float z\nproperty uchar red\n\
         property float x\nproperty float y\nelement face 1\n{FACES}property uchar k\n"
    );
    let text = ascii(&header, "0 3.0 255  1.50 2.\r\n2 8 9\n3 0 1 2 \n3 0 1 0 77 \n\n");
    let document = read(&text, "ply");
    assert_eq!(document.format(), Format::PlyAscii);
    assert_eq!(document.points(), [Point3::new(1.5, 2.0, 3.0), Point3::new(1.0, 2.0, 3.0)]);
    assert_eq!(document.attributes(), ["n", "colours", "k"]);
    let bytes = document.with_points(&[Point3::new(1.5, 2.0, 0.25), Point3::new(1e-9, 2.0, 3.0)]).unwrap();
    let expected = text.replace("0 3.0 255", "0 0.25 255").replace("3 0 1 2 \n", "3 0 1e-9 2 \n");
    assert_eq!(String::from_utf8(bytes).unwrap(), expected);
}

#[test]
fn headers_end_their_lines_in_three_ways() {
    let text = ascii(&format!("element vertex 1\n{XYZ}"), "1 2 3\n");
    for end in ["\n", "\r\n", "\r"] {
        assert_eq!(read(text.replace('\n', end), "ply").points(), [Point3::new(1.0, 2.0, 3.0)]);
    }
}

#[test]
fn a_body_that_begins_with_a_line_feed_is_not_mistaken_for_a_line_end() {
    for end in ["\n", "\r\n", "\r"] {
        let header = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n\
                      property uchar x\nproperty uchar y\nproperty uchar z\nend_header\n";
        let mut bytes = header.replace('\n', end).into_bytes();
        bytes.extend_from_slice(b"\n\r\n");
        assert_eq!(read(bytes, "ply").points(), [Point3::new(10.0, 13.0, 10.0)]);
    }
}

#[test]
fn strips_alternate_and_restart() {
    let header =
        format!("element vertex 5\n{XYZ}element tristrips 1\nproperty list int int vertex_indices\n");
    let text = ascii(&header, &format!("{}8 0 1 2 3 -1 2 3 4\n", "0 0 0\n".repeat(5)));
    assert_eq!(read(text, "ply").triangles(), [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
}

#[test]
fn faces_may_come_before_vertices() {
    let text =
        ascii(&format!("element face 1\n{FACES}element vertex 3\n{XYZ}"), "3 0 1 2\n0 0 0\n1 0 0\n0 1 0\n");
    assert_eq!(read(text, "ply").triangles(), [[0, 1, 2]]);
}

#[test]
fn positions_of_integer_types_can_be_read_but_not_moved() {
    let header = "element vertex 1\nproperty float x\nproperty int y\nproperty float z\n";
    let text = ascii(header, "1 -2 3\n");
    let document = read(&text, "ply");
    assert_eq!(document.points(), [Point3::new(1.0, -2.0, 3.0)]);
    assert_eq!(document.with_points(document.points()).unwrap(), text.as_bytes());
    let refused = document.with_points(&[Point3::new(1.0, -2.5, 3.0)]).unwrap_err();
    assert!(matches!(refused, WriteError::IntegerCoordinates { vertex: 0, property: "y" }));
    let moved = document.with_points(&[Point3::new(1.5, -2.0, 3.0)]).unwrap();
    assert!(moved.ends_with(b"\n1.5 -2 3\n"));
}

#[test]
fn coordinates_beyond_32_bit_floats_are_refused() {
    for text in [
        ascii(&format!("element vertex 1\n{XYZ}"), "1 2 3\n").into_bytes(),
        [
            ascii(&format!("element vertex 1\n{XYZ}"), "").replace("ascii", "binary_big_endian").as_bytes(),
            &[0; 12],
        ]
        .concat(),
    ] {
        let refused = read(text, "ply").with_points(&[Point3::new(0.0, 0.0, -1e39)]).unwrap_err();
        assert!(matches!(refused, WriteError::Overflow { vertex: 0, value: -1e39 }));
    }
}

#[test]
fn wrong_indices_are_named_with_their_place() {
    let header = format!("element vertex 1\n{XYZ}element face 2\n{FACES}");
    let out = |place, index| ParseError::IndexOutOfRange { place, index, first: 0, count: 1 };
    let text = ascii(&header, "0 0 0\n3 0 0 0\n3 0 1 0\n");
    assert_eq!(parse_error(text, "ply"), out(Place::Line(12), 1));
    let text = ascii(&header, "0 0 0\n3 0 0 0\n3 0 -1 0\n");
    assert_eq!(parse_error(text, "ply"), out(Place::Line(12), -1));
    let mut bytes = ascii(&header, "").replace("ascii", "binary_little_endian").into_bytes();
    bytes.extend_from_slice(&[0; 13]);
    bytes.extend_from_slice(&[1, 5, 0, 0, 0]);
    assert_eq!(parse_error(bytes, "ply"), out(Place::Element { name: "face".into(), index: 1 }, 5));
}

#[test]
fn values_that_are_no_numbers_are_named_with_their_place() {
    let header = format!("element vertex 2\n{XYZ}element face 1\n{FACES}");
    let not = ParseError::NotANumber { place: Place::Line(11), found: "?".into() };
    assert_eq!(parse_error(ascii(&header, "0 0 0\n0 ? 0\n3 0 0 1\n"), "ply"), not);
    for text in ["nan", "inf", "1e400", "-nan(ind)", "1.#INF"] {
        let text = ascii(&header, &format!("0 0 0\n0 {text} 0\n3 0 0 1\n"));
        assert_eq!(parse_error(text, "ply"), ParseError::NonFinite { place: Place::Line(11) });
    }
    let mut bytes = ascii(&header, "").replace("ascii", "binary_little_endian").into_bytes();
    bytes.extend_from_slice(&[0; 20]);
    bytes.extend_from_slice(&f32::INFINITY.to_le_bytes());
    bytes.extend_from_slice(&[3, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]);
    let place = Place::Element { name: "vertex".into(), index: 1 };
    assert_eq!(parse_error(bytes, "ply"), ParseError::NonFinite { place });
}

#[test]
fn list_lengths_must_be_counts() {
    let header = format!("element vertex 1\n{XYZ}element face 1\n{FACES}");
    let text = ascii(&header, "0 0 0\n-3 0 0 0\n");
    assert_eq!(parse_error(text, "ply"), malformed(11, "a list cannot have -3 items"));
    let text = ascii(&header, "0 0 0\n1.5 0 0 0\n");
    let problem = "expected a whole number of at most 32 bits, found 1.5";
    assert_eq!(parse_error(text, "ply"), malformed(11, problem));
}

#[test]
fn headers_that_break_the_rules_are_explained() {
    let vertex = format!("element vertex 1\n{XYZ}");
    for (header, expected) in [
        ("element vertex\n".into(), malformed(3, "an element needs a name and a count, a format its name")),
        ("element vertex many\n".into(), malformed(3, "`many` is no count of elements")),
        ("property float x\n".into(), malformed(3, "a property stands before the first element")),
        ("element vertex 1\nproperty\n".into(), malformed(4, "a property needs a type and a name")),
        ("element vertex 1\nproperty half x\n".into(), malformed(4, "the property type `half` is unknown")),
        ("format zip 1.0\n".into(), malformed(3, "the PLY format `zip` is unknown")),
        (format!("{vertex}{vertex}"), malformed(7, "the element `vertex` is declared twice")),
        ("element face 0\n".into(), malformed(4, "the header declares no element `vertex`")),
        (
            "element vertex 1\nproperty float x\nproperty float y\n".into(),
            malformed(6, "the element `vertex` must have one property `z` that is a number"),
        ),
        (
            format!("{vertex}property double x\n"),
            malformed(8, "the element `vertex` must have one property `x` that is a number"),
        ),
        (
            format!("{vertex}element face 1\nproperty int id\n"),
            malformed(9, "the element `face` has no list `vertex_indices`"),
        ),
    ] {
        assert_eq!(parse_error(ascii(&header, "0 0 0\n"), "ply"), expected, "{header}");
    }
    assert_eq!(parse_error("ply\nend_header\n", "ply"), malformed(2, "the header has no `format` line"));
    assert_eq!(
        parse_error("ply\nformat ascii 1.0", "ply"),
        malformed(3, "the file ends before `end_header`")
    );
    let problem = "a PLY file must begin with a line that says `ply`";
    assert_eq!(parse_error("\u{1}\u{2}\u{3}", "ply"), malformed(1, problem));
}

#[test]
fn promises_that_the_file_cannot_hold_are_refused_at_once() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (vertices, faces, name) in [(4_000_000_000_u64, 1, "vertex"), (1, 1_u64 << 60, "face")] {
            let header = format!("element vertex {vertices}\n{XYZ}element face {faces}\n{FACES}");
            let text = ascii(&header, "0 0 0 0 0 0\n").replace("ascii", format);
            let error = parse_error(text, "ply");
            assert!(
                matches!(&error, ParseError::Overclaimed { element, .. } if element == name),
                "{error:?}"
            );
        }
    }
    let text = ascii(&format!("element vertex 5000000000\n{XYZ}"), "0 0 0\n");
    assert!(matches!(parse_error(text, "ply"), ParseError::Overclaimed { count: 5_000_000_000, .. }));
}

#[test]
fn rows_of_nothing_cost_nothing() {
    let header = format!("element nothing 9000000000000000000\nelement vertex 1\n{XYZ}element face 0\n");
    assert_eq!(read(ascii(&header, "1 2 3"), "ply").points().len(), 1);
}

#[test]
fn a_file_that_was_cut_off_says_where() {
    let header = format!("element vertex 2\n{XYZ}element face 2\n{FACES}");
    let truncated = |element: &str, index| ParseError::Truncated { element: element.into(), index };
    assert_eq!(parse_error(ascii(&header, "0.000 0.000 0.000\n0.000"), "ply"), truncated("vertex", 1));
    assert_eq!(parse_error(ascii(&header, "0 0 0\n0 0 0\n3 0 1 0\n3 0"), "ply"), truncated("face", 1));
    let mut bytes = elaborate(false);
    bytes.truncate(bytes.len() - 9);
    assert_eq!(parse_error(bytes, "ply"), truncated("face", 1));
}

#[test]
fn a_file_without_vertices_is_no_mesh() {
    assert_eq!(parse_error(ascii(&format!("element vertex 0\n{XYZ}"), ""), "ply"), ParseError::NoVertices);
}

#[test]
fn a_header_line_of_a_programs_own_is_passed_over() {
    // Blender 2.47 writes `Created by Blender3D ...` without `comment`.
    let text = ascii(&format!("Created by Blender3D 247\nelement vertex 1\n{XYZ}"), "1 2 3\n");
    let document = read(&text, "ply");
    assert_eq!(document.points(), [Point3::new(1.0, 2.0, 3.0)]);
    let (bytes, _) = moved(&document);
    assert!(String::from_utf8(bytes).unwrap().contains("\nCreated by Blender3D 247\n"));
}

#[test]
fn whole_numbers_say_that_they_cannot_move() {
    let header = format!("element vertex 1\n{}", XYZ.replace("float", "int"));
    assert!(read(ascii(&header, "1 2 3\n"), "ply").fixed().is_some_and(|why| why.contains("whole numbers")));
    assert_eq!(read(ascii(&format!("element vertex 1\n{XYZ}"), "1 2 3\n"), "ply").fixed(), None);
}

#[test]
fn lines_that_hold_more_than_the_header_declares_are_read_as_lines() {
    let header = format!("element vertex 3\n{XYZ}element face 1\n{FACES}");
    for rows in [
        "0 0 0 255\n1 0 0 255\n0 1 0 255\n3 0 1 2\n",
        "0 0 0\n1 0 0 0.5 0.5\n0 1 0\n3 0 1 2\n",
        "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n",
        "0 0 0 # one\n\n1 0 0 # two\n\n0 1 0\t\n3 0 1 2 # a face",
        "0 0 0 9\n1 0\n0 9\n0 1 0\n3 0 1\n2 8\n",
    ] {
        for end in ["\n", "\r\n", "\r"] {
            let text = ascii(&header, rows).replace('\n', end);
            let document = read(&text, "ply");
            assert_eq!(document.triangles(), [[0, 1, 2]], "{rows}");
            assert_eq!(document.points()[1], Point3::new(1.0, 0.0, 0.0), "{rows}");
            assert_eq!(document.attributes(), ["undeclared values"], "{rows}");
            let (bytes, points) = moved(&document);
            assert_eq!(read(bytes, "ply").points(), points);
        }
    }
}

#[test]
fn rows_need_no_lines_of_their_own_where_nothing_is_undeclared() {
    let header = format!("element vertex 3\n{XYZ}element face 2\n{FACES}");
    for rows in [
        "0 0 0 1 0 0 0 1 0\n3 0 1 2 3 2 1 0\n",
        "0 0 0 1 0 0 0 1 0 3 0 1 2 3 2 1 0",
        "0 0\n0 1 0\n0 0 1 0\n3 0 1 2 3 2 1 0\n",
    ] {
        let document = read(ascii(&header, rows), "ply");
        assert_eq!(document.triangles(), [[0, 1, 2], [2, 1, 0]], "{rows}");
        assert!(document.attributes().is_empty(), "{rows}");
    }
}

#[test]
fn unused_vertices_may_be_anything() {
    let header = format!("element vertex 4\n{XYZ}element face 1\n{FACES}");
    let text = ascii(&header, "nan nan nan\n0 0 0\n1 0 0\n0 1 0\n3 1 2 3\n");
    let document = read(&text, "ply");
    assert_eq!(document.points()[0], document.points()[1]);
    let (bytes, points) = moved(&document);
    assert!(String::from_utf8_lossy(&bytes).contains("\nnan nan nan\n"));
    assert_eq!(read(bytes, "ply").points()[1..], points[1..]);
    for format in ["binary_little_endian", "binary_big_endian"] {
        let mut bytes = ascii(&header, "").replace("ascii", format).into_bytes();
        bytes.extend_from_slice(&[0xff; 12]);
        bytes.extend_from_slice(&[0; 36]);
        bytes.push(3);
        let big = format.contains("big");
        for corner in 1..4_i32 {
            bytes.extend(if big { corner.to_be_bytes() } else { corner.to_le_bytes() });
        }
        let document = read(&bytes, "ply");
        let (written, points) = moved(&document);
        assert_eq!(read(&written, "ply").points()[1..], points[1..]);
        let start = bytes.len() - 61;
        assert_eq!(written[start..start + 12], [0xff; 12]);
    }
}
