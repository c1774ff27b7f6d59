use std::fs;
use std::path::Path;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use serde_json::{Value, json};
use sombrero_mesh::Soup;

use crate::testing::{lifted, moved, parse_error, read};
use crate::{Document, Format, Limits, ParseError, Place, ReadError, Rewrite, WriteError, encode};

mod compressed;

const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [1.5, 1.25, 0.5]];

/// A glTF in the making.
#[derive(Clone)]
struct Model {
    json: Value,
    bin: Vec<u8>,
}

impl Model {
    fn empty() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": []}], "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}],
        });
        Self { json, bin: Vec::new() }
    }

    /// Two triangles, with normals and an extra attribute.
    fn square() -> Self {
        let mut model = Self::empty();
        let positions = model.positions(&SQUARE);
        let normals = model.accessor(&floats(&[[0.0, 0.0, 1.0]; 4]), 5126, "VEC3", 4);
        let extra = model.accessor(&[1, 2, 3, 4], 5121, "SCALAR", 4);
        let indices = model.accessor(&[0, 0, 1, 0, 2, 0, 2, 0, 1, 0, 3, 0], 5123, "SCALAR", 6);
        model.primitive(json!({
            "attributes": {"NORMAL": normals, "POSITION": positions, "_HEAT": extra}, "indices": indices,
        }));
        model
    }

    fn push(&mut self, key: &str, value: Value) -> usize {
        let list = self.json[key].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0xEE);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, shape: &str, count: usize) -> usize {
        let view = self.view(bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "type": shape, "count": count}),
        )
    }

    fn positions(&mut self, points: &[[f32; 3]]) -> usize {
        let accessor = self.accessor(&floats(points), 5126, "VEC3", points.len());
        let extreme = |pick: fn(f32, f32) -> f32| {
            let at = |axis: usize| points.iter().map(|p| p[axis]).reduce(pick).unwrap();
            json!([at(0), at(1), at(2)])
        };
        self.json["accessors"][accessor]["min"] = extreme(f32::min);
        self.json["accessors"][accessor]["max"] = extreme(f32::max);
        accessor
    }

    fn primitive(&mut self, primitive: Value) {
        self.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    }

    fn with(mut self, pointer: &str, value: Value) -> Self {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = if parent.is_empty() { &mut self.json } else { self.json.pointer_mut(parent).unwrap() };
        match key.parse::<usize>() {
            Ok(index) if parent.is_array() => parent[index] = value,
            _ => parent[key] = value,
        }
        self
    }

    fn text_of(&self, uri: Option<Value>) -> String {
        let mut json = self.json.clone();
        json["buffers"][0]["byteLength"] = self.bin.len().into();
        if let Some(uri) = uri {
            json["buffers"][0]["uri"] = uri;
        }
        serde_json::to_string_pretty(&json).unwrap()
    }

    fn glb(&self) -> Vec<u8> {
        chunks(self.text_of(None).as_bytes(), Some(&self.bin))
    }

    fn text(&self) -> String {
        let uri = format!("data:application/gltf-buffer;base64,{}", BASE64_STANDARD.encode(&self.bin));
        self.text_of(Some(uri.into()))
    }

    fn document(&self) -> Document {
        read(self.glb(), "glb")
    }

    fn error(&self) -> ParseError {
        parse_error(self.glb(), "glb")
    }
}

/// A GLB by hand.
fn chunks(json: &[u8], bin: Option<&[u8]>) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, content, fill) in [(b"JSON", Some(json), b' '), (b"BIN\0", bin, 0)] {
        let Some(content) = content else { continue };
        let length = content.len().next_multiple_of(4);
        body.extend_from_slice(&(length as u32).to_le_bytes());
        body.extend_from_slice(kind);
        body.extend_from_slice(content);
        body.resize(body.len() + length - content.len(), fill);
    }
    header(2, &body)
}

fn header(version: u32, body: &[u8]) -> Vec<u8> {
    let length = (12 + body.len()) as u32;
    [&b"glTF"[..], &version.to_le_bytes(), &length.to_le_bytes(), body].concat()
}

fn floats(points: &[[f32; 3]]) -> Vec<u8> {
    points.iter().flatten().flat_map(|c| c.to_le_bytes()).collect()
}

fn shorts(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn json_of(glb: &[u8]) -> Value {
    serde_json::from_str(json_text(glb)).unwrap()
}

fn json_text(glb: &[u8]) -> &str {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    std::str::from_utf8(&glb[20..20 + length]).unwrap()
}

fn bin_of(glb: &[u8]) -> &[u8] {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    &glb[28 + length..]
}

fn close(a: &[Point3<f64>], b: &[Point3<f64>]) -> bool {
    let near = |a: &Point3<f64>, b: &Point3<f64>| (a - b).norm() <= 1e-6 * b.coords.norm().max(1.0);
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| near(a, b))
}

// Containers.

#[test]
fn a_glb_keeps_every_byte_but_positions_and_their_bounds() {
    let model = Model::square();
    let source = model.glb();
    let document = read(&source, "glb");
    assert_eq!(document.format(), Format::Glb);
    assert_eq!(document.triangles(), [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(document.attributes(), ["normals", "_HEAT"]);
    assert_eq!(document.with_points(document.points()).unwrap(), source);

    let (bytes, points) = moved(&document);
    assert_eq!(bytes.len() % 4, 0);
    assert_eq!(u32::from_le_bytes(bytes[8..12].try_into().unwrap()) as usize, bytes.len());
    assert_eq!(bin_of(&bytes)[48..], bin_of(&source)[48..]);
    let mut json = json_of(&bytes);
    let expected = json!([[0.5, -1.25, 1024.5], [2.0, 0.0, 1024.5]]);
    assert_eq!(json!([json["accessors"][0]["min"], json["accessors"][0]["max"]]), expected);
    let old = json_of(&source);
    json["accessors"][0] = old["accessors"][0].clone();
    assert_eq!(json, old);
    let again = read(bytes, "glb");
    assert_eq!(again.points(), points);
    assert_eq!(again.triangles(), document.triangles());
    assert_eq!(again.attributes(), document.attributes());
}

#[test]
fn json_that_does_not_change_keeps_the_file_as_long_as_it_is() {
    let source = Model::square().glb();
    let document = read(&source, "glb");
    let mut points = document.points().to_vec();
    // Inside the bounds on both sides of the change.
    points[1] = Point3::new(0.75, 0.25, 0.5);
    let bytes = document.with_points(&points).unwrap();
    let changed: Vec<_> = (0..bytes.len()).filter(|i| bytes[*i] != source[*i]).collect();
    let bin = source.len() - bin_of(&source).len();
    assert!(changed.iter().all(|i| (bin + 12..bin + 24).contains(i)), "{changed:?}");
    assert_eq!(bytes.len(), source.len());
    assert_eq!(read(bytes, "glb").points(), points);
}

#[test]
fn unknown_chunks_and_bytes_behind_the_last_are_kept() {
    let mut source = Model::square().glb();
    source.extend_from_slice(b"\x05\0\0\0ABCDhello");
    let length = source.len() as u32;
    source[8..12].copy_from_slice(&length.to_le_bytes());
    source.extend_from_slice(b"tail");
    let (bytes, points) = moved(&read(&source, "glb"));
    assert!(bytes.ends_with(b"\x05\0\0\0ABCDhellotail"));
    assert_eq!(read(bytes, "glb").points(), points);
}

#[test]
fn a_data_uri_is_replaced_in_place() {
    let model = Model::square();
    let source = format!("\u{feff}{}\n", model.text());
    let document = read(&source, "gltf");
    assert_eq!(document.format(), Format::Gltf);
    assert_eq!(document.with_points(document.points()).unwrap(), source.as_bytes());
    let (bytes, points) = moved(&document);
    let text = String::from_utf8(bytes.clone()).unwrap();
    assert_eq!(text.lines().count(), source.lines().count());
    for (new, old) in text.lines().zip(source.lines()) {
        if !old.contains("uri") && old.trim_end_matches(',').trim().parse::<f64>().is_err() {
            assert_eq!(new, old);
        }
    }
    assert!(text.contains(r#""uri": "data:application/gltf-buffer;base64,"#));
    assert_eq!(read(bytes, "gltf").points(), points);
}

#[test]
fn a_data_uri_may_be_escaped_or_unpadded() {
    let mut model = Model::square();
    model.bin.resize(model.bin.len().next_multiple_of(3) + 1, 7);
    for payload in [BASE64_STANDARD.encode(&model.bin), engine_without_padding(&model.bin)] {
        let text = model.text_of(Some("@".into()));
        let uri = format!("DATA:application\\/octet-stream;charset=x;Base64,{}", payload.replace('/', "\\/"));
        let source = text.replace('@', &uri);
        let document = read(&source, "gltf");
        assert_eq!(document.with_points(document.points()).unwrap(), source.as_bytes());
        let (bytes, points) = moved(&document);
        let again = read(&bytes, "gltf");
        assert_eq!(again.points(), points);
        assert_eq!(String::from_utf8(bytes).unwrap().contains("=\""), payload.ends_with('='));
    }
}

fn engine_without_padding(bytes: &[u8]) -> String {
    base64::prelude::BASE64_STANDARD_NO_PAD.encode(bytes)
}

#[test]
fn numbers_that_stay_true_keep_their_spelling() {
    let mut model = Model::empty();
    let positions = model.positions(&[[0.1, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 2.0], [0.3, 0.3, 0.3]]);
    model.primitive(json!({"attributes": {"POSITION": positions}}));
    let glb = model.glb();
    let json = json_text(&glb).replace("1.0,\n        1.0,\n        2.0", "1.0e0,\n        1.00,\n  2.000");
    assert_ne!(json, json_text(&glb));
    let document = read(chunks(json.as_bytes(), Some(&model.bin)), "glb");
    let mut points = document.points().to_vec();
    points[2].z = f64::from(0.1_f32) * 64.0;
    let bytes = document.with_points(&points).unwrap();
    let text = json_text(&bytes);
    assert!(text.contains("1.0e0,\n        1.00,\n  6.400000095367432\n"), "{text}");
    // The shortest decimal that is the stored number to the last digit.
    assert_eq!("6.400000095367432".parse::<f64>().unwrap(), points[2].z);
}

#[test]
fn bounds_that_were_never_true_stay_unless_they_must_follow() {
    let model = Model::square().with("/accessors/0/min", json!([-9.0, -9.0, -9.0]));
    let document = model.document();
    let mut points = document.points().to_vec();
    points[3].x = 1.25;
    let bytes = document.with_points(&points).unwrap();
    let accessor = &json_of(&bytes)["accessors"][0];
    assert_eq!(accessor["min"], json!([-9.0, -9.0, -9.0]));
    assert_eq!(accessor["max"], json!([1.25, 1.25, 0.5]));
}

#[test]
fn a_cut_or_wrong_glb_is_refused() {
    let source = Model::square().glb();
    for length in 0..source.len() {
        assert!(Document::parse(source[..length].to_vec(), Some("glb")).is_err());
    }
    let mut longer = source.clone();
    longer[8..12].fill(255);
    assert!(matches!(parse_error(longer, "glb"), ParseError::Overclaimed { count: 0xFFFF_FFFF, .. }));
    let mut chunk = source.clone();
    chunk[12..16].fill(255);
    assert!(matches!(parse_error(chunk, "glb"), ParseError::Truncated { index: 0, .. }));
    let mut kind = source.clone();
    kind[16] = b'X';
    assert!(matches!(parse_error(kind, "glb"), ParseError::Malformed { .. }));
    let no_bin = chunks(Model::square().text_of(None).as_bytes(), None);
    assert!(matches!(parse_error(no_bin, "glb"), ParseError::Malformed { .. }));
}

#[test]
fn chunks_that_reach_beyond_the_length_in_the_header_are_right() {
    let source = Model::square().glb();
    for told in [0, 12, source.len() as u32 - 4] {
        let mut short = source.clone();
        short[8..12].copy_from_slice(&told.to_le_bytes());
        let document = read(&short, "glb");
        assert_eq!(document.points(), read(&source, "glb").points());
        let note = format!("The header says that the file has {told} bytes, but it has {}.", source.len());
        assert_eq!(document.notes(), [note]);
        let (bytes, points) = moved(&document);
        assert_eq!(read(bytes, "glb").points(), points);
    }
}

#[test]
fn data_uris_may_be_written_in_percent_signs() {
    let model = Model::square();
    let spelled = |bytes: &[u8]| bytes.iter().map(|byte| format!("%{byte:02X}")).collect::<String>();
    for uri in [
        format!("data:application/octet-stream,{}", spelled(&model.bin)),
        format!("data:;base64,{}", spelled(BASE64_STANDARD.encode(&model.bin).as_bytes())),
    ] {
        let text = model.text_of(Some(uri.clone().into()));
        let document = read(&text, "gltf");
        assert_eq!(document.points(), read(model.glb(), "glb").points());
        assert_eq!(document.with_points(document.points()).unwrap(), text.as_bytes());
        let (bytes, points) = moved(&document);
        assert_eq!(read(&bytes, "gltf").points(), points);
        let head = uri.split(',').next().unwrap().trim_end_matches(";base64");
        assert!(String::from_utf8(bytes).unwrap().contains(&format!("\"{head};base64,")), "{head}");
    }
}

#[test]
fn what_is_no_gltf_2_says_so() {
    let key = r#"{"format": "some key", "secret": [1, 2, 3], "nodes": 5}"#;
    let message = parse_error(key, "json").to_string();
    assert!(message.contains("no glTF 2.0") && message.contains("key file"), "{message}");
    let old = parse_error(r#"{"asset": {"version": "1.0"}, "meshes": {}}"#, "gltf");
    assert_eq!(old.to_string(), "glTF 1.0 is not supported; export the model again as glTF 2.0");
    let old = parse_error(header(1, b"\0\0\0\0\0\0\0\0{}"), "glb");
    assert!(old.to_string().starts_with("glTF 1.0 is not supported"));
    let broken = parse_error("{\n\"asset\": {\"version\": \"2.0\"},\n x", "gltf");
    assert_eq!(broken.place(), Some(&Place::Line(3)));
    assert!(matches!(parse_error(b"{\"a\": \"\xff\"}", "gltf"), ParseError::Malformed { .. }));
    let deep = [b"{\"asset\": ".to_vec(), vec![b'['; 100_000]].concat();
    assert!(matches!(parse_error(deep, "gltf"), ParseError::Malformed { .. }));
}

// Geometry.

#[test]
fn indices_come_in_three_sizes_or_not_at_all() {
    for (component, size) in [(5121, 1), (5123, 2), (5125, 4)] {
        let bytes = |i: u32| i.to_le_bytes()[..size].to_vec();
        let mut model = Model::empty();
        let positions = model.positions(&SQUARE);
        let list: Vec<u8> = [0, 1, 2, 2, 1, 3, 0, 1].into_iter().flat_map(bytes).collect();
        let indices = model.accessor(&list, component, "SCALAR", 8);
        model.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
        // The two that are left over make no triangle.
        assert_eq!(model.document().triangles(), [[0, 1, 2], [2, 1, 3]]);
    }
    let mut model = Model::empty();
    let positions = model.positions(&SQUARE);
    model.primitive(json!({"attributes": {"POSITION": positions}}));
    assert_eq!(model.document().triangles(), [[0, 1, 2]]);
    assert_eq!(model.document().points().len(), 4);
}

#[test]
fn strips_and_fans_are_split_and_points_and_lines_are_kept() {
    let mut model = Model::empty();
    let positions = model.positions(&SQUARE);
    for mode in [0, 1, 2, 3, 5, 6] {
        model.primitive(json!({"attributes": {"POSITION": positions}, "mode": mode}));
    }
    let document = model.document();
    assert_eq!(document.triangles(), [[0, 1, 2], [2, 1, 3], [0, 1, 2], [0, 2, 3]]);
    assert_eq!(document.attributes(), ["points", "lines"]);
    model.primitive(json!({"attributes": {"POSITION": positions}, "mode": 7}));
    assert!(matches!(model.error(), ParseError::Malformed { .. }));
}

#[test]
fn interleaved_positions_leave_their_neighbours_alone() {
    let mut model = Model::empty();
    let vertices: Vec<u8> =
        SQUARE.iter().flat_map(|p| [vec![0xAB; 4], floats(&[*p]), vec![0xCD; 8]].concat()).collect();
    let accessor = model.accessor(&vertices, 5126, "VEC3", 4);
    model.json["bufferViews"][0]["byteStride"] = 24.into();
    model.json["accessors"][accessor]["byteOffset"] = 4.into();
    let uv = json!({"bufferView": 0, "byteOffset": 16, "componentType": 5126, "type": "VEC2", "count": 4});
    let uv = model.push("accessors", uv);
    model.primitive(json!({"attributes": {"POSITION": accessor, "TEXCOORD_0": uv}, "mode": 5}));
    let document = model.document();
    assert_eq!(document.points()[3], Point3::new(1.5, 1.25, 0.5));
    assert_eq!(document.attributes(), ["texture coordinates"]);
    let (bytes, points) = moved(&document);
    for vertex in bin_of(&bytes).chunks(24) {
        assert_eq!(vertex[..4], [0xAB; 4]);
        assert_eq!(vertex[16..], [0xCD; 8]);
    }
    assert_eq!(read(bytes, "glb").points(), points);
}

#[test]
fn sparse_positions_are_read_and_written_where_they_stand() {
    for component in [5121, 5123, 5125_u32] {
        let mut model = Model::empty();
        let accessor = model.positions(&SQUARE);
        let list: Vec<u8> = [1_u32, 3]
            .into_iter()
            .flat_map(|i| i.to_le_bytes()[..[1, 0, 2, 0, 4][component as usize - 5121]].to_vec())
            .collect();
        let places = model.view(&list);
        let values = model.view(&floats(&[[5.0, 5.0, 5.0], [6.0, 6.0, 6.0]]));
        model.json["accessors"][accessor]["sparse"] = json!({
            "count": 2,
            "indices": {"bufferView": places, "componentType": component},
            "values": {"bufferView": values},
        });
        model.primitive(json!({"attributes": {"POSITION": accessor}, "mode": 5}));
        let document = model.document();
        assert_eq!(document.points()[1], Point3::new(5.0, 5.0, 5.0));
        assert_eq!(document.points()[2], Point3::new(0.0, 1.0, 0.5));
        let source = bin_of(document.bytes()).to_vec();
        let (bytes, points) = moved(&document);
        // What the sparse elements hide is not touched.
        assert_eq!(bin_of(&bytes)[12..24], source[12..24]);
        assert_ne!(bin_of(&bytes)[..12], source[..12]);
        assert_eq!(json_of(&bytes)["accessors"][0]["max"], json!([6.5, 4.75, 1030.0]));
        assert_eq!(read(bytes, "glb").points(), points);
    }
}

#[test]
fn positions_that_are_not_stored_can_stay_but_not_move() {
    let mut model = Model::empty();
    model.bin = vec![0; 64];
    let accessor = model.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": 3}));
    let places = model.view(&[1]);
    let values = model.view(&floats(&[[5.0, 5.0, 5.0]]));
    model.json["accessors"][accessor]["sparse"] = json!({
        "count": 1,
        "indices": {"bufferView": places, "componentType": 5121},
        "values": {"bufferView": values},
    });
    model.primitive(json!({"attributes": {"POSITION": accessor}}));
    let document = model.document();
    assert_eq!(document.points(), [Point3::origin(), Point3::new(5.0, 5.0, 5.0), Point3::origin()]);
    let mut points = document.points().to_vec();
    points[1].x = 4.0;
    assert_eq!(read(document.with_points(&points).unwrap(), "glb").points(), points);
    points[2].x = 1.0;
    assert!(matches!(document.with_points(&points), Err(WriteError::NotStored { vertex: 2 })));
    let claims = model.with("/accessors/0/count", json!(4_000_000_000_u64));
    assert!(matches!(claims.error(), ParseError::Overclaimed { .. }));
}

#[test]
fn quantised_positions_are_rounded_and_must_fit() {
    let cases: [(u32, bool, &[u8], f64, f64); 5] = [
        (5120, false, &[1, 2, 253, 99], -3.0, 127.0),
        (5120, true, &[1, 2, 129, 99], -1.0, 1.0),
        (5121, true, &[1, 2, 51, 99], 0.2, 1.0),
        (5122, false, &[1, 0, 2, 0, 0, 128, 99, 99], -32768.0, 32767.0),
        (5123, true, &[1, 0, 2, 0, 255, 255, 99, 99], 1.0, 1.0),
    ];
    for (component, normalized, vertex, z, largest) in cases {
        let mut model = Model::empty();
        let accessor = model.accessor(&vertex.repeat(3), component, "VEC3", 3);
        model.json["bufferViews"][0]["byteStride"] = vertex.len().into();
        model.json["accessors"][accessor]["normalized"] = normalized.into();
        model.json["accessors"][accessor]["max"] = json!([1, 2, 9]);
        model.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        model.primitive(json!({"attributes": {"POSITION": accessor}}));
        let document = model.document();
        assert!((document.points()[0].z - z).abs() < 1e-12, "{:?}", document.points());
        assert!(document.notes()[0].contains("rounded"));
        assert_eq!(document.with_points(document.points()).unwrap(), document.bytes());
        let mut points = document.points().to_vec();
        points[1].x = largest;
        let bytes = document.with_points(&points).unwrap();
        let top = if normalized { [127, 255, 0, 65535][component as usize - 5120] } else { largest as i64 };
        assert_eq!(json_of(&bytes)["accessors"][0]["max"], json!([top, 2, 9]));
        assert_eq!(read(bytes, "glb").points(), points);
        points[1].x = largest * 1.005;
        assert_eq!(
            read(document.with_points(&points).unwrap(), "glb").points()[1].x,
            largest,
            "held at the end"
        );
        points[1].x = largest * 1.1 + 0.6;
        assert!(matches!(document.with_points(&points), Err(WriteError::OffGrid { vertex: 1, .. })));
    }
}

#[test]
fn primitives_that_share_positions_are_one_block() {
    let mut model = Model::empty();
    let positions = model.positions(&SQUARE);
    // The same accessor under another number, with bounds of its own.
    let copy = model.json["accessors"][positions].clone();
    let same = model.push("accessors", copy);
    let first = model.accessor(&shorts(&[0, 1, 2]), 5123, "SCALAR", 3);
    let second = model.accessor(&shorts(&[2, 1, 3]), 5123, "SCALAR", 3);
    model.primitive(json!({"attributes": {"POSITION": positions}, "indices": first, "material": 0}));
    model.primitive(json!({"attributes": {"POSITION": same}, "indices": second}));
    model.primitive(json!({"attributes": {"POSITION": same}, "indices": first}));
    let document = model.document();
    assert_eq!(document.points().len(), 4);
    assert_eq!(document.triangles(), [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(document.triangles_with_instances(), 3);
    let (bytes, points) = moved(&document);
    let json = json_of(&bytes);
    assert_eq!(json["accessors"][0]["min"], json!([0.5, -1.25, 1024.5]));
    assert_eq!(json["accessors"][1]["min"], json!([0.5, -1.25, 1024.5]));
    assert_eq!(read(bytes, "glb").points(), points);
}

#[test]
fn positions_that_overlap_with_anything_are_refused() {
    let windows = |offset: u64| {
        let mut model = Model::empty();
        let first = model.positions(&SQUARE);
        model.json["accessors"][first]["count"] = 3.into();
        let second = json!({
            "bufferView": 0, "byteOffset": offset, "componentType": 5126, "type": "VEC3", "count": 3,
        });
        model.bin.resize(120, 0);
        model.json["bufferViews"][0]["byteLength"] = 120.into();
        let second = model.push("accessors", second);
        model.primitive(json!({"attributes": {"POSITION": first}}));
        model.primitive(json!({"attributes": {"POSITION": second}}));
        model
    };
    assert_eq!(windows(36).document().points().len(), 6);
    // The same bytes are the same points.
    let document = windows(24).document();
    assert_eq!(document.points().len(), 5);
    assert_eq!(document.triangles(), [[0, 1, 2], [2, 3, 4]]);
    assert!(windows(4).error().to_string().contains("position data that overlap"));

    // Stored as positions and used as colours: changing the one would change the other.
    let mut model = Model::square();
    let colours = json!({"bufferView": 0, "componentType": 5121, "type": "VEC4", "count": 4});
    model.push("accessors", colours);
    assert!(model.error().to_string().contains("position data that overlap"));
    // The numbers of sparse elements, within the very positions.
    let mut model = Model::square();
    let values = model.view(&floats(&[[1.0, 1.0, 1.0]]));
    let sparse = json!({
        "count": 1, "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": values},
    });
    model.json["accessors"][0]["sparse"] = sparse;
    model.bin[..12].copy_from_slice(&[3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert!(model.error().to_string().contains("position data that overlap"));
    let image = Model::square().with("/images", json!([{"bufferView": 0}]));
    assert!(image.error().to_string().contains("position data that overlap"));
    let narrow = Model::square().with("/bufferViews/0/byteStride", json!(8));
    assert!(narrow.error().to_string().contains("position data that overlap"));
}

#[test]
fn wrong_coordinates_and_indices_are_named() {
    let mut model = Model::square();
    model.bin[16..20].copy_from_slice(&f32::NAN.to_le_bytes());
    let place = Place::Element { name: "accessor 0, position".into(), index: 1 };
    assert_eq!(model.error(), ParseError::NonFinite { place });
    let mut model = Model::square();
    let end = model.bin.len();
    model.bin[end - 2..].fill(255);
    let place = Place::Element { name: "accessor 3, index".into(), index: 5 };
    let expected = ParseError::IndexOutOfRange { place, index: 65535, first: 0, count: 4 };
    assert_eq!(model.error(), expected);
}

#[test]
fn coordinates_beyond_32_bit_floats_are_refused() {
    let document = Model::square().document();
    let mut points = document.points().to_vec();
    points[2].y = 1e39;
    let refused = document.with_points(&points).unwrap_err();
    assert!(matches!(refused, WriteError::Overflow { vertex: 2, value: 1e39 }));
}

// The scene.

#[test]
fn nodes_place_meshes_and_world_positions_come_back() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let trs = json!({
        "mesh": 0, "translation": [1.0, 2.0, 3.0], "rotation": [0.0, 0.0, half, half], "scale": [2.0, 3.0, 4.0],
    });
    let cases = [
        (json!([trs]), Point3::new(1.0, 4.0, 5.0)),
        (
            json!([{"mesh": 0, "matrix": [2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 4, 0, 7, 8, 9, 1]}]),
            Point3::new(9.0, 8.0, 11.0),
        ),
        (
            json!([
                {"children": [1], "scale": [2.0, 1.0, 0.1]},
                {"children": [2], "rotation": [0.0, 0.0, half, half]},
                {"mesh": 0, "translation": [10.0, 0.0, 0.0]},
            ]),
            Point3::new(0.0, 11.0, 0.05),
        ),
        (json!([{"mesh": 0, "scale": [-1.0, 1.0, 1.0]}]), Point3::new(-1.0, 0.0, 0.5)),
    ];
    for (nodes, expected) in cases {
        let document = Model::square().with("/nodes", nodes).document();
        assert!((document.points()[1] - expected).norm() < 1e-12, "{:?}", document.points());
        assert_eq!(document.with_points(document.points()).unwrap(), document.bytes());
        let points = lifted(&document, |p| p + Vector3::new(0.1, p.x * 0.01, -0.2));
        let again = read(document.with_points(&points).unwrap(), "glb");
        assert!(close(again.points(), &points), "{:?}\n{points:?}", again.points());
        assert_eq!(again.triangles(), document.triangles());
    }
}

#[test]
fn instances_are_counted_and_marked_once() {
    let nodes = json!([
        {"mesh": 0, "translation": [5.0, 0.0, 0.0]},
        {"mesh": 0, "translation": [9.0, 0.0, 0.0]},
        {"mesh": 0},
    ]);
    let model = Model::square().with("/nodes", nodes).with("/scenes/0/nodes", json!([1, 0, 2]));
    let document = model.document();
    assert_eq!(document.points().len(), 4);
    assert_eq!(document.points()[0], Point3::new(9.0, 0.0, 0.5));
    assert_eq!(document.triangles().len(), 2);
    assert_eq!(document.triangles_with_instances(), 6);
}

#[test]
fn a_skinned_mesh_is_placed_by_its_bones_alone() {
    let nodes = json!([{"mesh": 0, "skin": 0, "translation": [5.0, 0.0, 0.0]}]);
    let document = Model::square().with("/nodes", nodes).document();
    assert_eq!(document.points()[0], Point3::new(0.0, 0.0, 0.5));
    assert_eq!(document.attributes(), ["normals", "_HEAT", "skins"]);
}

#[test]
fn the_default_scene_counts_then_the_first_then_the_roots() {
    let nodes = json!([{"mesh": 0, "translation": [1, 0, 0]}, {"mesh": 0, "translation": [2, 0, 0]}]);
    let model = Model::square().with("/nodes", nodes);
    let first = |model: Model| model.document().points()[0].x;
    let two = model.with("/scenes", json!([{"nodes": [0]}, {"nodes": [1]}]));
    assert_eq!(first(two.clone().with("/scene", json!(1))), 2.0);
    assert_eq!(first(two.clone().with("/scene", json!(null))), 1.0);
    let none = two.clone().with("/scenes", json!([])).with("/nodes/0/children", json!([]));
    assert_eq!(none.document().triangles_with_instances(), 4);
    let bare = two.clone().with("/scenes", json!([])).with("/nodes", json!([]));
    assert_eq!(first(bare), 0.0);
    assert!(matches!(two.with("/scene", json!(7)).error(), ParseError::Malformed { .. }));
}

#[test]
fn meshes_without_a_place_stay_and_are_noted() {
    let mut model = Model::square();
    let mesh = json!({"primitives": [{"attributes": {"POSITION": 77}}]});
    model.push("meshes", mesh.clone());
    model.push("meshes", mesh);
    assert_eq!(model.document().notes(), ["UNMARKED: 2 meshes that no scene shows stay as they are."]);
    let nodes = json!([{"mesh": 0, "children": [1]}, {"mesh": 1, "scale": [1, 1, 0]}]);
    let document = model.with("/nodes", nodes).document();
    assert_eq!(
        document.notes(),
        [
            "UNMARKED: 1 mesh that no scene shows stays as it is.",
            "UNMARKED: 1 mesh that a node scales to nothing or beyond all numbers stays as it is."
        ]
    );
    let unseen = Model::square().with("/scenes/0/nodes", json!([]));
    assert_eq!(unseen.error(), ParseError::NothingShown);
}

#[test]
fn a_scene_that_is_no_tree_is_refused() {
    let cases = [
        json!([{"children": [1]}, {"children": [0]}]),
        json!([{"children": [0]}]),
        json!([{"children": [1, 1]}, {"mesh": 0}]),
        json!([{"children": [1]}]),
        json!([{"mesh": 5}]),
    ];
    for nodes in cases {
        let error = Model::square().with("/nodes", nodes).error();
        assert!(
            matches!(&error, ParseError::Malformed { place: Place::Element { name, .. }, .. } if name == "node")
        );
    }
}

#[test]
fn nodes_may_nest_as_deep_as_they_like() {
    const DEPTH: usize = 20_000;
    let mut nodes: Vec<Value> =
        (1..DEPTH).map(|i| json!({"children": [i], "translation": [0, 0, 1]})).collect();
    nodes.push(json!({"mesh": 0}));
    let document = Model::square().with("/nodes", json!(nodes)).document();
    assert_eq!(document.points()[0].z, 0.5 + (DEPTH - 1) as f64);
}

#[test]
fn everything_else_is_named() {
    let document = Model::square()
        .with("/meshes/0/primitives/0/targets", json!([{}]))
        .with("/meshes/0/primitives/0/attributes/JOINTS_0", json!(9))
        .with("/meshes/0/primitives/0/attributes/COLOR_0", json!(9))
        .with("/materials", json!([{}]))
        .with("/animations", json!([{}]))
        .with("/cameras", json!([{}]))
        .with("/images", json!([{"uri": "../../secret.png"}]))
        .with("/extensions", json!({"KHR_lights_punctual": {}}))
        .with("/nodes/0/extensions", json!({"EXT_mesh_gpu_instancing": {}}))
        .with("/extensionsRequired", json!(["KHR_texture_transform", "EXT_mesh_gpu_instancing"]))
        .document();
    let mut names = document.attributes().to_vec();
    names.sort();
    let expected = [
        "_HEAT",
        "animations",
        "cameras",
        "colours",
        "images",
        "instances",
        "lights",
        "materials",
        "morph targets",
        "normals",
        "skins",
    ];
    assert_eq!(names, expected);
}

#[test]
fn a_required_extension_that_is_not_known_is_named() {
    let required = |names: Value| Model::square().with("/extensionsRequired", names);
    assert_eq!(required(json!(["KHR_materials_unlit"])).document().points().len(), 4);
    let message = required(json!(["KHR_materials_unlit", "ACME_spline_patches"])).error().to_string();
    assert!(message.contains("`ACME_spline_patches`, which the file requires"), "{message}");
    // Used, but not required: what is read is what there is without it.
    let used = Model::square().with("/extensionsUsed", json!(["ACME_spline_patches"]));
    assert_eq!(used.document().points().len(), 4);
}

#[test]
fn whole_numbers_may_be_written_as_floats() {
    let model = Model::square();
    let as_float = |text: &str| {
        let mut out = String::new();
        for line in text.lines() {
            let digits = line.trim_end_matches(',');
            let is_whole = digits.ends_with(|c: char| c.is_ascii_digit()) && !digits.contains('.');
            out.push_str(&if is_whole && line.ends_with(',') {
                format!("{digits}.0,\n")
            } else if is_whole {
                format!("{digits}e0\n")
            } else {
                format!("{line}\n")
            });
        }
        out
    };
    let json = as_float(&model.text_of(None));
    assert!(json.contains("\"count\": 4.0,") && json.contains("\"mesh\": 0e0"), "{json}");
    let document = read(chunks(json.as_bytes(), Some(&model.bin)), "glb");
    assert_eq!(document.triangles(), model.document().triangles());
    let (bytes, points) = moved(&document);
    assert_eq!(read(bytes, "glb").points(), points);
}

/// Two windows on the same positions, each with its own mesh at its own node.
fn two_windows(first: [usize; 2], second: [usize; 2]) -> Model {
    let mut model = Model::empty();
    let points: Vec<[f32; 3]> = (0..6_u8).map(|i| [f32::from(i), f32::from(i * i), 0.5]).collect();
    let view = model.view(&floats(&points));
    model.json["meshes"] = json!([]);
    for [start, count] in [first, second] {
        let accessor = model.push(
            "accessors",
            json!({
                "bufferView": view, "byteOffset": 12 * start, "componentType": 5126, "type": "VEC3",
                "count": count, "min": [0, 0, 0], "max": [9, 99, 1],
            }),
        );
        model.push("meshes", json!({"primitives": [{"attributes": {"POSITION": accessor}}]}));
    }
    model.json["nodes"] = json!([{"mesh": 0}, {"mesh": 1, "translation": [100, 0, 0]}]);
    model.json["scenes"] = json!([{"nodes": [0, 1]}]);
    model
}

#[test]
fn every_point_stands_where_it_is_shown_first() {
    for (first, second, expected, shared) in [
        ([0, 3], [3, 3], [0.0, 1.0, 2.0, 103.0, 104.0, 105.0], 0..0),
        ([0, 3], [2, 3], [0.0, 1.0, 2.0, 103.0, 104.0, f64::NAN], 2..3),
        ([0, 3], [0, 6], [0.0, 1.0, 2.0, 103.0, 104.0, 105.0], 0..3),
        ([1, 3], [0, 6], [100.0, 1.0, 2.0, 3.0, 104.0, 105.0], 1..4),
        ([0, 6], [3, 3], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0], 3..6),
    ] {
        let model = two_windows(first, second);
        let document = model.document();
        let expected: Vec<f64> = expected.into_iter().filter(|x| !x.is_nan()).collect();
        assert_eq!(
            document.points().iter().map(|p| p.x).collect::<Vec<_>>(),
            expected,
            "{first:?} {second:?}"
        );
        // What the second one shows of the first one's points, it shows elsewhere.
        let places: Vec<_> =
            document.scene().places.into_iter().filter(|place| !place.vertices.is_empty()).collect();
        let found: Vec<_> = places.iter().map(|place| (place.vertices.clone(), place.shift.x)).collect();
        let wanted: Vec<_> = (!shared.is_empty()).then_some((shared, 100.0)).into_iter().collect();
        assert_eq!(found, wanted, "{first:?} {second:?}");
        let (bytes, points) = moved(&document);
        let again = read(&bytes, "glb");
        assert!(close(again.points(), &points), "{:?} {points:?}", again.points());
        // Each accessor's own bounds follow.
        let json = json_of(&bytes);
        let largest = |[start, count]: [usize; 2]| (start + count - 1) as f64 + 0.5;
        assert_eq!(json["accessors"][0]["max"][0], largest(first));
        assert_eq!(json["accessors"][1]["max"][0], largest(second));
    }
}

#[test]
fn a_skin_stands_where_its_bones_took_it() {
    let scale = [0.01_f32, 0.0, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.0, 1.0];
    let mut model = Model::square();
    let bytes: Vec<u8> = scale.iter().flat_map(|x| x.to_le_bytes()).collect();
    let bind = model.accessor(&bytes, 5126, "MAT4", 1);
    let skins = json!([{"joints": [2], "inverseBindMatrices": bind}]);
    // The node of the mesh itself has no say.
    let nodes = json!([
        {"mesh": 0, "skin": 0, "translation": [500, 0, 0]},
        {"children": [2], "translation": [0, 0, 7]},
        {"scale": [10, 10, 10]},
    ]);
    let model = model.with("/skins", skins).with("/nodes", nodes).with("/scenes/0/nodes", json!([0, 1]));
    let expected: Vec<_> =
        SQUARE.iter().map(|p| Point3::from(p.map(f64::from)) * 0.1 + Vector3::new(0.0, 0.0, 7.0)).collect();
    assert!(close(model.document().points(), &expected), "{:?}", model.document().points());
    // Without bones in the scene, or without matrices, it is where that leaves it.
    let lost = model.clone().with("/scenes/0/nodes", json!([0])).document();
    assert_eq!(lost.points()[3], Point3::new(1.5, 1.25, 0.5));
    let plain = model.with("/skins", json!([{"joints": [2]}])).document();
    assert_eq!(plain.points()[3], Point3::new(15.0, 12.5, 12.0));
}

#[test]
fn copies_by_accessors_are_where_they_are_shown() {
    let mut model = Model::square();
    let shift = model.accessor(&floats(&[[10.0, 0.0, 0.0], [0.0, 20.0, 0.0]]), 5126, "VEC3", 2);
    let sizes = model.accessor(&floats(&[[2.0; 3], [3.0; 3]]), 5126, "VEC3", 2);
    let copies = json!({"attributes": {"TRANSLATION": shift, "SCALE": sizes}});
    let model = model.with("/nodes/0/extensions", json!({"EXT_mesh_gpu_instancing": copies}));
    let document = model.document();
    assert_eq!(document.points()[3], Point3::new(13.0, 2.5, 1.0));
    assert_eq!(document.triangles_with_instances(), 4);
    let places = document.scene().places;
    assert_eq!(places.len(), 1);
    assert!((places[0].at(&document.points()[3]) - Point3::new(4.5, 23.75, 1.5)).norm() < 1e-12);
}

#[test]
fn what_a_node_hides_is_not_shown() {
    let hidden = json!({"KHR_node_visibility": {"visible": false}});
    let nodes = json!([{"mesh": 0}, {"children": [2], "extensions": hidden}, {"mesh": 1}]);
    let mut model = Model::square();
    let meshes = json!([model.json["meshes"][0].clone(), model.json["meshes"][0].clone()]);
    model = model.with("/meshes", meshes).with("/nodes", nodes).with("/scenes/0/nodes", json!([0, 1]));
    let document = model.document();
    assert_eq!(document.triangles_with_instances(), 2);
    assert_eq!(document.notes(), ["UNMARKED: 1 mesh that no scene shows stays as it is."]);
}

#[test]
fn unused_positions_may_be_anything() {
    let mut model = Model::empty();
    let positions = model.positions(&[[f32::NAN, 1.0, 2.0], [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let indices = model.accessor(&[1, 2, 3], 5121, "SCALAR", 3);
    model.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    let document = model.document();
    assert_eq!(document.points()[0], document.points()[1]);
    let (bytes, points) = moved(&document);
    assert_eq!(bin_of(&bytes)[..12], bin_of(document.bytes())[..12]);
    assert_eq!(read(bytes, "glb").points()[1..], points[1..]);
}

// Compression.

// Files beside the glTF.

fn beside(folder: &Path, model: &Model, uri: &str) -> Result<Document, ReadError> {
    let path = folder.join("model.gltf");
    fs::write(&path, model.text_of(Some(uri.into()))).unwrap();
    Document::read(&path)
}

#[test]
fn buffers_beside_the_file_are_read_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut model = Model::square();
    model.push("buffers", json!({"byteLength": 5, "uri": "absent animation.bin"}));
    fs::create_dir(folder.path().join("sub dir")).unwrap();
    fs::write(folder.path().join("sub dir/a.bin"), &model.bin).unwrap();
    let document = beside(folder.path(), &model, "sub%20dir/a.bin").unwrap();
    let parts: Vec<(&str, &[u8])> = document.parts().collect();
    assert_eq!(parts[0], ("", document.bytes()));
    assert!(parts.len() == 2 && !parts[1].0.is_empty() && parts[1].1 == model.bin);
    let files = [("", document.bytes()), ("sub dir/a.bin", &model.bin)];
    assert_eq!(document.parts().collect::<Vec<_>>(), files);
    // The same without a disk.
    let given = [("other.bin".to_owned(), vec![0]), ("./sub dir/a.bin".to_owned(), model.bin.clone())];
    let together =
        |others| Document::parse_together(document.bytes().to_vec(), Some("gltf"), others, Limits::default());
    let again = together(&given).unwrap();
    assert!(again.parts().eq(document.parts()) && again.points() == document.points());
    let error = together(&given[..1]).unwrap_err().to_string();
    assert!(error.contains("`sub dir/a.bin`, was not given"), "{error}");

    let (bytes, points) = moved(&document);
    let text = String::from_utf8(bytes.clone()).unwrap();
    assert!(text.contains("data:application/octet-stream;base64,"));
    assert!(text.contains("absent animation.bin"));
    assert_eq!(read(bytes, "gltf").points(), points);

    let how = Rewrite::default().with_stem("new name");
    let written = document.rewrite(&points, &how).unwrap();
    assert_eq!(written.companions.len(), 1);
    assert_eq!(written.companions[0].name, "new name.bin");
    assert_eq!(written.companions[0].bytes[48..], model.bin[48..]);
    assert!(String::from_utf8(written.bytes.clone()).unwrap().contains(r#""uri": "new%20name.bin""#));
    let out = tempfile::tempdir().unwrap();
    fs::write(out.path().join("new name.gltf"), &written.bytes).unwrap();
    fs::write(out.path().join("new name.bin"), &written.companions[0].bytes).unwrap();
    let again = Document::read(&out.path().join("new name.gltf")).unwrap();
    assert_eq!(again.points(), points);
    assert_eq!(again.triangles(), document.triangles());
}

#[test]
fn several_buffers_are_numbered() {
    let folder = tempfile::tempdir().unwrap();
    let model = two_buffers("b.bin");
    fs::write(folder.path().join("a.bin"), &model.bin).unwrap();
    fs::write(folder.path().join("b.bin"), [0, 1, 2, 2, 1, 3]).unwrap();
    let document = beside(folder.path(), &model, "a.bin").unwrap();
    assert_eq!(document.triangles(), [[0, 1, 2], [2, 1, 3]]);
    let written = document.rewrite(document.points(), &Rewrite::default().with_stem("x")).unwrap();
    let names: Vec<_> = written.companions.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["x-0.bin", "x-1.bin"]);
    assert_eq!(written.companions[1].bytes, [0, 1, 2, 2, 1, 3]);
    let files = [("", document.bytes()), ("a.bin", &model.bin), ("b.bin", &[0, 1, 2, 2, 1, 3])];
    assert_eq!(document.parts().collect::<Vec<_>>(), files);
    let twice = beside(folder.path(), &two_buffers("./a.bin"), "a.bin").unwrap_err();
    assert!(twice.to_string().contains("two buffers in one file"), "{twice}");
}

fn two_buffers(second: &str) -> Model {
    let mut model = Model::empty();
    let positions = model.positions(&SQUARE);
    model.push("buffers", json!({"byteLength": 6, "uri": second}));
    let view = model.push("bufferViews", json!({"buffer": 1, "byteLength": 6}));
    let indices = model
        .push("accessors", json!({"bufferView": view, "componentType": 5121, "type": "SCALAR", "count": 6}));
    model.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    model
}

fn refused(folder: &Path, uri: &str) -> String {
    match beside(folder, &Model::square(), uri).unwrap_err() {
        ReadError::Parse { source: ParseError::Companion { name, problem }, .. } => {
            assert_eq!(name, uri);
            problem
        }
        other => panic!("{uri}: {other}"),
    }
}

#[test]
fn names_that_lead_out_of_the_folder_are_refused() {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("inner");
    fs::create_dir_all(folder.join("directory")).unwrap();
    fs::write(outer.path().join("x"), &Model::square().bin).unwrap();
    let absolute = outer.path().join("x");
    let unsafe_names = [
        "../x",
        "..%2Fx",
        "%2e%2e/x",
        "directory/../../x",
        "..\\x",
        absolute.to_str().unwrap(),
        "/dev/zero",
        "file:///etc/passwd",
        "http://example.org/x",
        "",
        "%ff",
        "a%00",
    ];
    for name in unsafe_names {
        assert!(refused(&folder, name).contains("not named by a plain path"), "{name}");
    }
    assert_eq!(refused(&folder, "absent.bin"), "is not there");
    assert_eq!(refused(&folder, "directory"), "is not a regular file");
    let alone = parse_error(Model::square().text_of(Some("x".into())), "gltf");
    assert!(alone.to_string().contains("cannot be looked for"), "{alone}");
}

#[cfg(unix)]
#[test]
fn links_that_lead_out_of_the_folder_are_refused() {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("inner");
    fs::create_dir(&folder).unwrap();
    fs::write(outer.path().join("x"), &Model::square().bin).unwrap();
    std::os::unix::fs::symlink(outer.path().join("x"), folder.join("link.bin")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.join("zero.bin")).unwrap();
    std::os::unix::fs::symlink(outer.path(), folder.join("up")).unwrap();
    for name in ["link.bin", "zero.bin", "up/x"] {
        assert_eq!(refused(&folder, name), "leads out of the folder");
    }
    fs::write(folder.join("y"), &Model::square().bin).unwrap();
    std::os::unix::fs::symlink("y", folder.join("inside.bin")).unwrap();
    assert!(beside(&folder, &Model::square(), "inside.bin").is_ok());
}

#[test]
fn buffers_count_for_the_limit_of_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let model = Model::square();
    let path = folder.path().join("model.gltf");
    fs::write(&path, model.text_of(Some("a.bin".into()))).unwrap();
    fs::write(folder.path().join("a.bin"), [model.bin.clone(), vec![0; 100_000]].concat()).unwrap();
    let limits = Limits::default().with_max_bytes(100_000);
    let error = Document::read_within(&path, limits).unwrap_err().to_string();
    assert!(error.contains("`a.bin`, is larger than the limit allows"), "{error}");
    fs::write(folder.path().join("a.bin"), &model.bin[1..]).unwrap();
    let error = Document::read_within(&path, limits).unwrap_err().to_string();
    assert!(error.contains("byte of buffer 0"), "{error}");
}

// Normals.

#[test]
fn normals_and_tangents_turn_only_when_asked_and_only_where_the_surface_does() {
    let still = [[9.0, 9.0, 9.0], [10.0, 9.0, 9.0], [9.0, 10.0, 9.0]];
    for (node, scale) in [(json!({"mesh": 0}), 1.0), (json!({"mesh": 0, "scale": [1, 1, 2]}), 2.0)] {
        let mut model = Model::empty();
        let positions =
            model.positions(&[&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &still[..]].concat());
        let normals = model.accessor(&floats(&[[0.0, 0.0, 1.0]; 6]), 5126, "VEC3", 6);
        let tangent: Vec<u8> = [1.0_f32, 0.0, 0.0, -1.0].iter().flat_map(|c| c.to_le_bytes()).collect();
        let tangents = model.accessor(&tangent.repeat(6), 5126, "VEC4", 6);
        let attributes = json!({"POSITION": positions, "NORMAL": normals, "TANGENT": tangents});
        model.primitive(json!({"attributes": attributes}));
        let model = model.with("/nodes/0", node);
        let document = model.document();
        let mut points = document.points().to_vec();
        points[1].z += 1.0;
        let kept = document.with_points(&points).unwrap();
        assert_eq!(bin_of(&kept)[72..], bin_of(document.bytes())[72..]);
        let how = Rewrite::default().with_renewed_normals(true);
        let bytes = document.rewrite(&points, &how).unwrap().bytes;
        let bin = bin_of(&bytes);
        assert_eq!(json_of(&kept), json_of(&bytes));
        let vector = |at: usize| {
            Vector3::from_fn(|axis, _| {
                f64::from(f32::from_le_bytes(bin[at + 4 * axis..][..4].try_into().unwrap()))
            })
        };
        // The world sees a slope of 45 degrees; the file keeps it before the node's scale.
        let normal = Vector3::new(-1.0, 0.0, scale).normalize();
        let tangent = Vector3::new(1.0, 0.0, 1.0 / scale).normalize();
        for element in 0..3 {
            assert!((vector(72 + 12 * element) - normal).norm() < 1e-6, "{}", vector(72));
            assert!((vector(144 + 16 * element) - tangent).norm() < 1e-6, "{}", vector(144));
        }
        let old = bin_of(document.bytes());
        assert_eq!(bin[72 + 36..144], old[72 + 36..144]);
        assert_eq!(bin[144 + 48..], old[144 + 48..]);
        assert_eq!(bin[144 + 12..160], (-1.0_f32).to_le_bytes());
    }
}

#[test]
fn whole_normals_turn_too() {
    let mut model = Model::empty();
    let positions = model.positions(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let normals = model.accessor(&[0, 0, 127, 55].repeat(3), 5120, "VEC3", 3);
    model.json["bufferViews"][1]["byteStride"] = 4.into();
    model.json["accessors"][normals]["normalized"] = true.into();
    model.primitive(json!({"attributes": {"POSITION": positions, "NORMAL": normals}}));
    let document = model.document();
    let points = lifted(&document, |p| Point3::new(p.x, p.y, p.x));
    let how = Rewrite::default().with_renewed_normals(true);
    let bytes = document.rewrite(&points, &how).unwrap().bytes;
    assert_eq!(bin_of(&bytes)[36..], [166, 0, 90, 55].repeat(3));
}

#[test]
fn normals_that_are_something_else_too_are_left_alone() {
    let mut model = Model::square();
    model.push("accessors", json!({"bufferView": 1, "componentType": 5126, "type": "VEC2", "count": 6}));
    let document = model.document();
    assert!(document.notes()[0].starts_with("Normals share bytes"));
    let points = lifted(&document, |p| Point3::new(p.x, p.y, p.x));
    let how = Rewrite::default().with_renewed_normals(true);
    assert_eq!(document.rewrite(&points, &how).unwrap().bytes, document.with_points(&points).unwrap());
    // A ball around the origin may use its positions as normals.
    let ball = Model::square().with("/meshes/0/primitives/0/attributes/NORMAL", json!(0));
    let document = ball.document();
    assert_eq!(document.rewrite(&points, &how).unwrap().bytes, document.with_points(&points).unwrap());
}

// Claims.

#[test]
fn claims_that_the_bytes_do_not_bear_out_are_refused() {
    let huge = u64::MAX;
    let cases = [
        ("/accessors/0/count", json!(4_000_000_000_u64)),
        ("/accessors/0/count", json!(huge)),
        ("/accessors/3/count", json!(4_000_000_000_u64)),
        ("/accessors/1/count", json!(4_000_000_000_u64)),
        ("/accessors/0/count", json!(-1)),
        ("/accessors/0/count", json!(4.5)),
        ("/accessors/0/byteOffset", json!(huge)),
        ("/accessors/0/byteOffset", json!(huge - 47)),
        ("/accessors/0/componentType", json!(5125)),
        ("/accessors/0/componentType", json!(1)),
        ("/accessors/0/type", json!("VEC4")),
        ("/accessors/0/type", json!("WORD")),
        ("/accessors/3/componentType", json!(5126)),
        ("/accessors/3/componentType", json!(5122)),
        ("/accessors/3/type", json!("VEC2")),
        ("/accessors/0/bufferView", json!(99)),
        ("/accessors/0/bufferView", json!(4_294_967_296_u64)),
        ("/bufferViews/0/byteOffset", json!(huge)),
        ("/bufferViews/0/byteLength", json!(huge)),
        ("/bufferViews/0/byteLength", json!(47)),
        ("/bufferViews/0/byteStride", json!(huge)),
        ("/bufferViews/0/byteStride", json!(16)),
        ("/bufferViews/0/buffer", json!(7)),
        ("/meshes/0/primitives/0/indices", json!(99)),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(99)),
        ("/meshes/0/primitives/0/attributes/NORMAL", json!(99)),
        ("/meshes/0/primitives/0/mode", json!(-1)),
        ("/nodes/0/matrix", json!([1, 2, 3])),
        ("/scenes", json!({})),
        (
            "/accessors/0/sparse",
            json!({"count": huge, "indices": {"bufferView": 3, "componentType": 5121}, "values": {"bufferView": 1}}),
        ),
        (
            "/accessors/0/sparse",
            json!({"count": 3, "indices": {"bufferView": 3, "componentType": 5121}, "values": {"bufferView": 1}}),
        ),
        (
            "/accessors/0/sparse",
            json!({"count": 1, "indices": {"bufferView": 3, "componentType": 5126}, "values": {"bufferView": 1}}),
        ),
    ];
    for (pointer, value) in cases {
        let error = Model::square().with(pointer, value.clone()).error();
        let good = matches!(error, ParseError::Overclaimed { .. } | ParseError::Malformed { .. });
        assert!(good, "{pointer} {value}: {error:?}");
    }
    let twice = Model::square().text().replacen("\"count\": 4", "\"count\": 4, \"count\": 4", 1);
    assert!(matches!(parse_error(twice, "gltf"), ParseError::Malformed { .. }));
}

#[test]
fn the_same_indices_cannot_be_used_without_end() {
    let mut model = Model::empty();
    let indices = model.accessor(&[0; 3000], 5121, "SCALAR", 3000);
    for _ in 0..100 {
        let positions = model.positions(&SQUARE);
        model.primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    }
    assert!(matches!(model.error(), ParseError::Overclaimed { .. }));
    let mut model = Model::square();
    for i in 0..2000 {
        model.push(
            "accessors",
            json!({"bufferView": 1, "byteOffset": i % 8, "componentType": 5121, "type": "SCALAR", "count": 40 - i / 50}),
        );
    }
    assert!(model.document().notes()[0].starts_with("Normals share bytes"));
}

// New files.

#[test]
fn a_new_file_says_what_it_holds() {
    let points = vec![Point3::new(0.1, -2.0, 3.0), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
    let soup = Soup::new(points, vec![[0, 1, 2], [2, 1, 0]]);
    for format in [Format::Gltf, Format::Glb] {
        let bytes = encode(format, &soup).unwrap();
        let document = read(&bytes, "glb");
        assert_eq!(document.format(), format);
        assert_eq!(document.triangles(), soup.triangles);
        assert_eq!(document.points()[0], Point3::new(f64::from(0.1_f32), -2.0, 3.0));
        assert_eq!(document.attributes(), <[String; 0]>::default());
        let text =
            if format == Format::Glb { json_text(&bytes) } else { std::str::from_utf8(&bytes).unwrap() };
        let json: Value = serde_json::from_str(text).unwrap();
        assert_eq!(json["asset"], json!({"version": "2.0", "generator": "sombrero"}));
        assert_eq!(json["accessors"][0]["min"], json!([0.0, -2.0, 0.0]));
        assert_eq!(json["accessors"][0]["max"], json!([1.0, 1.0, 3.0]));
        let far = Soup::new(vec![Point3::new(0.0, 1e39, 0.0); 3], vec![[0, 1, 2]]);
        assert!(matches!(encode(format, &far), Err(WriteError::Overflow { vertex: 0, value: 1e39 })));
        let bare = Soup::new(soup.points.clone(), Vec::new());
        assert!(matches!(encode(format, &bare), Err(WriteError::Nothing { .. })));
    }
}

// Broken files.

/// A file with a bit of everything.
fn rich() -> Model {
    let mut model = Model::square();
    let other = model.positions(&[[4.0, 0.0, 0.0], [5.0, 0.0, 0.0], [4.0, 1.0, 0.0]]);
    let places = model.view(&[0, 2]);
    let values = model.view(&floats(&[[7.0, 0.0, 0.0], [7.0, 1.0, 0.0]]));
    model.json["accessors"][other]["sparse"] = json!({
        "count": 2, "indices": {"bufferView": places, "componentType": 5121}, "values": {"bufferView": values},
    });
    let small = model.accessor(&[1, 2, 3, 9, 9, 3, 2, 8, 5, 5, 5, 7], 5121, "VEC3", 3);
    model.json["bufferViews"][7]["byteStride"] = 4.into();
    let mesh = json!({"primitives": [
        {"attributes": {"POSITION": other}},
        {"attributes": {"POSITION": small, "NORMAL": 1}, "mode": 5},
    ]});
    model.push("meshes", mesh);
    model.with("/nodes", json!([{"mesh": 0, "children": [1]}, {"mesh": 1, "translation": [1, 2, 3]}]))
}

fn survives(bytes: Vec<u8>) {
    let Ok(document) = Document::parse(bytes.clone(), Some("gltf")) else { return };
    let count = document.points().len();
    assert!(count <= bytes.len(), "{count} vertices of {} bytes", bytes.len());
    assert!(document.triangles().iter().flatten().all(|&corner| (corner as usize) < count));
    assert_eq!(document.with_points(document.points()).unwrap(), bytes);
    let how = Rewrite::default().with_renewed_normals(true);
    let new = lifted(&document, |p| p.map(|c| f64::from((c / 2.0) as f32)) + Vector3::new(1.0, p.x, 1.0));
    for new in [new, lifted(&document, |p| Point3::new(p.x, p.y.floor(), p.z))] {
        for how in [how.clone(), Rewrite::default()] {
            let Ok(written) = document.rewrite(&new, &how) else { continue };
            assert!(written.companions.is_empty());
            let again = Document::parse(written.bytes, Some("gltf")).unwrap();
            assert_eq!(again.points().len(), count);
            assert_eq!(again.triangles(), document.triangles());
            assert_eq!(again.attributes(), document.attributes());
        }
    }
}

/// Numbers of the JSON that claims hang on.
const NUMBERS: [&str; 14] = [
    "0",
    "1",
    "2",
    "3",
    "4",
    "5",
    "6",
    "7",
    "-1",
    "12",
    "5121",
    "5126",
    "4294967295",
    "18446744073709551615",
];

#[test]
fn the_sample_of_the_broken_files_is_sound() {
    for bytes in [rich().glb(), rich().text().into_bytes()] {
        let document = read(bytes, "gltf");
        assert_eq!(document.points().len(), 10);
        assert_eq!(document.triangles().len(), 4);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn damaged_bytes_are_a_mesh_or_an_error(
        text in any::<bool>(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), 0..4_u8, any::<u8>()), 1..4),
    ) {
        let mut bytes = if text { rich().text().into_bytes() } else { rich().glb() };
        for (at, kind, value) in damage {
            let at = at.index(bytes.len());
            match kind {
                0 => bytes[at] = value,
                1 => bytes[at] ^= 1 << (value % 8),
                2 => bytes[at] = b"0123456789-.e ,\"[]{}"[usize::from(value % 20)],
                _ => drop(bytes.remove(at)),
            }
        }
        survives(bytes);
    }

    #[test]
    fn any_claims_are_a_mesh_or_an_error(
        text in any::<bool>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(&NUMBERS[..])), 1..4),
    ) {
        let model = rich();
        let json = if text { model.text() } else { model.text_of(None) };
        let mut json = json;
        for (at, number) in changes {
            let spots: Vec<_> = json.match_indices(|c: char| c.is_ascii_digit()).map(|(i, _)| i).collect();
            // Not in the payload of the buffer.
            let payload = json.find("base64,").map_or(0..0, |i| i..i + json[i..].find('"').unwrap());
            let spots: Vec<_> = spots.into_iter().filter(|i| !payload.contains(i)).collect();
            let start = spots[at.index(spots.len())];
            let length = json[start..].bytes().take_while(u8::is_ascii_digit).count();
            json.replace_range(start..start + length, number);
        }
        survives(if text { json.into_bytes() } else { chunks(json.as_bytes(), Some(&model.bin)) });
    }
}

#[test]
fn buffers_without_geometry_come_along() {
    let folder = tempfile::tempdir().unwrap();
    let model = Model::square();
    let name = "\"buffers\":[";
    let text = model.text_of(Some("x.bin".into())).replace("\"buffers\": [", name);
    let text = text.replacen(
        name,
        "\"buffers\":[{\"uri\":\"x.bin\",\"byteLength\":4},{\"uri\":\"absent.bin\",\"byteLength\":4},",
        1,
    );
    // The geometry's buffer is number 2 now; `x.bin` may not be named twice.
    let text = text.replace("\"buffer\":0", "\"buffer\":2").replace("\"buffer\": 0", "\"buffer\": 2");
    let text = text.replacen("x.bin", "moves.bin", 1);
    fs::write(folder.path().join("moves.bin"), b"....").unwrap();
    fs::write(folder.path().join("x.bin"), &model.bin).unwrap();
    let path = folder.path().join("model.gltf");
    fs::write(&path, &text).unwrap();
    let document = Document::read(&path).unwrap();
    let files = [("", document.bytes()), ("x.bin", &model.bin)];
    assert_eq!(document.parts().collect::<Vec<_>>(), files);
    let how = Rewrite::default().with_stem("copy");
    let written = document.rewrite(document.points(), &how).unwrap();
    let names: Vec<&str> = written.companions.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["copy-0.bin", "copy-1.bin"]);
    assert_eq!(written.companions[1].bytes, b"....");
    let text = String::from_utf8(written.bytes).unwrap();
    assert!(
        text.contains("copy-1.bin") && text.contains("absent.bin") && !text.contains("moves.bin"),
        "{text}"
    );
}
