//! Buffer views in streams of meshopt, and primitives in streams of Draco.

use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, FaceIndex, GeometryAttributeType, Mesh, MeshEncoder,
    PointAttribute, PointIndex,
};
use sombrero_mesh::Soup;

use super::*;
use crate::gltf::meshopt;

fn ball() -> Soup {
    sombrero_shapes::bumpy_sphere(300)
}

fn points_of(soup: &Soup) -> Vec<[f32; 3]> {
    soup.points.iter().map(|p| [p.x, p.y, p.z].map(|c| c as f32)).collect()
}

/// Indices as one sequence of differences.
fn sequence(soup: &Soup) -> Vec<u8> {
    let mut out = vec![0xd1];
    let mut last = 0_i64;
    for &corner in soup.triangles.iter().flatten() {
        let step = i64::from(corner) - last;
        last = corner.into();
        let mut value = (if step < 0 { !(step << 1) } else { step << 1 } as u64) << 1;
        while value > 0x7f {
            out.push(value as u8 | 0x80);
            value >>= 7;
        }
        out.push(value as u8);
    }
    out.extend([0; 4]);
    out
}

/// A model whose positions, of `stride` bytes each, indices and other numbers are in streams, with bytes of somebody else between
/// them.
fn packed(name: &str, rows: &[u8], stride: usize, component: u32) -> Model {
    let soup = ball();
    let count = soup.points.len();
    let header = if name.starts_with("KHR") { 0xa1 } else { 0xa0 };
    let heat: Vec<u8> = (0..count as u32).flat_map(|i| (i * i).to_le_bytes()).collect();
    let mut model = Model::empty();
    let mut plain = 0;
    for (mode, stream, stride, count) in [
        ("ATTRIBUTES", meshopt::encode(rows, stride, &[header]), stride, count),
        ("INDICES", sequence(&soup), 4, 3 * soup.triangles.len()),
        ("ATTRIBUTES", meshopt::encode(&heat, 4, &[header]), 4, count),
    ] {
        let view = model.view(&stream);
        let mut entry = model.json["bufferViews"][view].clone();
        entry["byteStride"] = stride.into();
        entry["count"] = count.into();
        entry["mode"] = mode.into();
        model.json["bufferViews"][view] = json!({
            "buffer": 1, "byteOffset": plain, "byteLength": stride * count, "extensions": {name: entry},
        });
        plain += stride * count;
        model.view(b"somebody else's");
    }
    model.push("buffers", json!({"byteLength": plain, "extensions": {name: {"fallback": true}}}));
    model.json["extensionsRequired"] = json!([name, "KHR_mesh_quantization"]);
    for (view, component, shape, count) in [
        (0, component, "VEC3", count),
        (2, 5125, "SCALAR", 3 * soup.triangles.len()),
        (4, 5125, "SCALAR", count),
    ] {
        let accessor = json!({"bufferView": view, "componentType": component, "type": shape, "count": count});
        model.push("accessors", accessor);
    }
    model.primitive(json!({"attributes": {"POSITION": 0, "_HEAT": 2}, "indices": 1}));
    model
}

fn with_floats(name: &str) -> Model {
    packed(name, &floats(&points_of(&ball())), 12, 5126)
}

/// What the bytes of somebody else are now, by their views.
fn others(glb: &[u8]) -> Vec<Vec<u8>> {
    let json = json_of(glb);
    let views = json["bufferViews"].as_array().unwrap().iter();
    let plain = views.filter(|view| view["extensions"].is_null());
    let number = |view: &Value, key: &str| view[key].as_u64().unwrap_or(0) as usize;
    plain.map(|v| bin_of(glb)[number(v, "byteOffset")..][..number(v, "byteLength")].to_vec()).collect()
}

#[test]
fn streams_are_read_and_written() {
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let source = with_floats(name).glb();
        let document = read(&source, "glb");
        let soup = ball();
        assert_eq!(document.triangles(), soup.triangles);
        assert!(close(document.points(), &soup.points));
        assert_eq!(document.fixed(), None);
        assert_eq!(document.with_points(document.points()).unwrap(), source);

        // Rounder numbers have a shorter stream, random ones a longer one.
        let rounder = lifted(&document, |p| p.map(|c| (c * 64.0).round() / 64.0));
        let longer = lifted(&document, |p| p.map(|c| f64::from((c + 0.1 * (c * 1e4).sin()) as f32)));
        for points in [rounder, longer] {
            let bytes = document.with_points(&points).unwrap();
            let again = read(&bytes, "glb");
            assert!(close(again.points(), &points), "{name}");
            assert_eq!(again.triangles(), soup.triangles);
            assert_eq!(others(&bytes), others(&source));
            let json = json_of(&bytes);
            let length = json["buffers"][0]["byteLength"].as_u64().unwrap() as usize;
            assert_eq!(length.next_multiple_of(4), bin_of(&bytes).len());
            assert_eq!(bytes.len() % 4, 0);
            // Nothing is left of where vertices were.
            let stream = &with_floats(name).bin[40..100];
            assert!(!bytes.windows(stream.len()).any(|window| window == stream));
            assert_eq!(read(&bytes, "glb").with_points(&points).unwrap(), bytes);
        }
    }
}

#[test]
fn whole_numbers_in_streams_are_moved_too() {
    let rows: Vec<u8> = points_of(&ball())
        .iter()
        .flat_map(|p| [p[0], p[1], p[2], 0.0].map(|c| ((c * 12000.0).round() as i16).to_le_bytes()))
        .flatten()
        .collect();
    let model = packed("EXT_meshopt_compression", &rows, 8, 5122);
    let model = model.with("/bufferViews/0/byteStride", 8.into());
    let document = read(model.glb(), "glb");
    let points = lifted(&document, |p| Point3::new(p.x + 7.0, p.y, p.z - 3.0));
    let again = read(document.with_points(&points).unwrap(), "glb");
    assert_eq!(again.points(), points);
}

#[test]
fn a_filter_is_undone_and_not_needed_again() {
    // Mantissas of 24 bits and an exponent of -20.
    let rows: Vec<u8> = points_of(&ball())
        .iter()
        .flatten()
        .flat_map(|c| {
            let mantissa = (f64::from(*c) * f64::from(1 << 20)).round() as i32;
            (mantissa & 0xff_ffff | -20 << 24).to_le_bytes()
        })
        .collect();
    let mut model = packed("EXT_meshopt_compression", &rows, 12, 5126);
    model.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["filter"] = "EXPONENTIAL".into();
    let document = read(model.glb(), "glb");
    let near = |(a, b): (&Point3<f64>, &Point3<f64>)| (a - b).norm() < 1e-6;
    assert!(document.points().iter().zip(&ball().points).all(near));
    let (bytes, points) = moved(&document);
    assert_eq!(json_of(&bytes)["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["filter"], "NONE");
    assert!(close(read(bytes, "glb").points(), &points));
}

#[test]
fn what_stands_uncompressed_too_moves_too() {
    let mut model = with_floats("EXT_meshopt_compression");
    let mut plain = floats(&points_of(&ball()));
    plain.resize(model.json["buffers"][1]["byteLength"].as_u64().unwrap() as usize, 7);
    let uri =
        |bytes: &[u8]| format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(bytes));
    model.json["buffers"][1]["uri"] = uri(&plain).into();
    let document = read(model.text(), "gltf");
    let (bytes, points) = moved(&document);
    let json: Value = serde_json::from_slice(&bytes).unwrap();
    let (_, base64) = json["buffers"][1]["uri"].as_str().unwrap().split_once(',').unwrap();
    let written = BASE64_STANDARD.decode(base64).unwrap();
    let expected: Vec<[f32; 3]> = points.iter().map(|p| [p.x, p.y, p.z].map(|c| c as f32)).collect();
    plain[..12 * points.len()].copy_from_slice(&floats(&expected));
    assert_eq!(written, plain);
    assert!(close(read(&bytes, "gltf").points(), &points));

    // It may be missing.
    model.json["buffers"][1]["uri"] = "nowhere.bin".into();
    assert_eq!(read(model.text(), "gltf").points(), document.points());
}

#[test]
fn streams_that_share_bytes_with_others_do_not_move() {
    let mut model = with_floats("EXT_meshopt_compression");
    let inside = model.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["byteOffset"].clone();
    model.push("bufferViews", json!({"buffer": 0, "byteOffset": inside, "byteLength": 4}));
    let document = model.document();
    assert!(
        document.fixed().is_some_and(|why| why.contains("unpack the file first")),
        "{:?}",
        document.fixed()
    );
    let error = document.with_points(&lifted(&document, |p| p * 2.0)).unwrap_err();
    assert!(matches!(error, WriteError::Fixed { .. }));
    assert_eq!(document.with_points(document.points()).unwrap(), model.glb());
}

#[test]
fn streams_among_what_stands_uncompressed_do_not_move() {
    // Found by mutation: the view says that its content stands where its stream does.
    let model = with_floats("EXT_meshopt_compression").with("/bufferViews/0/buffer", json!(0));
    let document = model.document();
    assert!(document.fixed().is_some_and(|why| why.contains("unpack the file first")));
    assert!(document.with_points(&lifted(&document, |p| p * 2.0)).is_err());
}

#[test]
fn streams_that_nothing_shown_needs_may_be_anything() {
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let elsewhere = Model::square().with("/bufferViews/2/extensions", json!({name: {"buffer": 7}}));
        assert_eq!(elsewhere.document().points().len(), 4);
        let here = Model::square().with("/bufferViews/0/extensions", json!({name: {"buffer": 0}}));
        assert!(here.error().to_string().contains("compression is of a kind"));
    }
    let draco = json!({"KHR_draco_mesh_compression": {}});
    let error = Model::square().with("/meshes/0/primitives/0/extensions", draco).error();
    assert!(error.to_string().contains("does not say where its positions are"), "{error}");
}

#[test]
fn streams_that_are_not_what_is_said_are_refused() {
    let stream = "/bufferViews/0/extensions/EXT_meshopt_compression";
    for (key, value, words) in [
        ("byteStride", json!(8), "not that of what"),
        ("byteStride", json!(6), "does not know"),
        ("mode", json!("CURVES"), "does not know"),
        ("filter", json!("OCTAHEDRAL"), "does not know"),
        ("mode", json!("TRIANGLES"), "does not know"),
        ("byteLength", json!(100), "damaged"),
        ("byteLength", json!(1 << 30), "do not fit"),
        ("buffer", json!(9), "no such buffer"),
    ] {
        let model = with_floats("EXT_meshopt_compression").with(&format!("{stream}/{key}"), value);
        let message = model.error().to_string();
        assert!(message.contains(words), "{key}: {message}");
    }
    // Two bits for 256 zeros.
    let count = 1_u64 << 32;
    let model = with_floats("EXT_meshopt_compression")
        .with(&format!("{stream}/count"), count.into())
        .with("/bufferViews/0/byteLength", (12 * count).into());
    assert!(model.error().to_string().contains("unpacks to more than"), "{}", model.error());
}

/// A model in a Draco stream.
fn in_draco(options: &EncoderOptions) -> Model {
    let soup = ball();
    let points = points_of(&soup);
    let mut mesh = Mesh::new();
    let mut position = PointAttribute::new();
    position.init(GeometryAttributeType::Position, 3, DataType::Float32, false, points.len());
    position.buffer_mut().write(0, &floats(&points));
    let number = mesh.add_attribute(position);
    mesh.set_num_points(points.len());
    mesh.set_num_faces(soup.triangles.len());
    for (face, corners) in (0..).zip(&soup.triangles) {
        mesh.set_face(FaceIndex(face), corners.map(PointIndex));
    }
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut stream = EncoderBuffer::new();
    encoder.encode(options, &mut stream).unwrap();
    let mut model = Model::empty();
    let view = model.view(stream.data());
    let corners = 3 * soup.triangles.len();
    model.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": points.len()}));
    model.push("accessors", json!({"componentType": 5123, "type": "SCALAR", "count": corners}));
    let draco = json!({"bufferView": view, "attributes": {"POSITION": number}});
    model.primitive(json!({
        "attributes": {"POSITION": 0}, "indices": 1, "extensions": {"KHR_draco_mesh_compression": draco},
    }));
    model.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    model
}

/// The area and the number of triangles.
fn measure(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> (f64, usize) {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| points[v as usize]);
        (b - a).cross(&(c - a)).norm() / 2.0
    };
    (triangles.iter().map(area).sum(), triangles.len())
}

#[test]
fn draco_is_read_and_not_written() {
    let soup = ball();
    let (area, count) = measure(&soup.points, &soup.triangles);
    for level in [0, 5, 7, 10] {
        let mut options = EncoderOptions::new();
        options.set_compression_level(level);
        let model = in_draco(&options);
        let document = model.document();
        let (read_area, read_count) = measure(document.points(), document.triangles());
        assert_eq!(read_count, count, "level {level}");
        assert!((read_area / area - 1.0).abs() < 1e-3, "level {level}: {read_area} is not {area}");
        assert!(
            document
                .fixed()
                .is_some_and(|why| why.contains("Draco") && why.contains("unpack the file first"))
        );
        assert_eq!(document.with_points(document.points()).unwrap(), model.glb());
        let error = document.with_points(&lifted(&document, |p| p * 2.0)).unwrap_err();
        assert!(error.to_string().starts_with("positions are compressed with Draco"), "{error}");
    }
}

/// Two triangles that Google's encoder packed.
const SQUARE_IN_DRACO: &str = "RFJBQ08CAgEBAAAABAIAAgAAAR//AREB/wAAAQAJAwAAAgEBAQAPAwEQLwEwAwAoggDAqgoArKqsKgCgqlZVAAAAAAAAAP8/AAAAAAAAAAAAAAAAAD8AAMA/Dg==";

#[test]
fn draco_of_another_encoder_is_read() {
    let stream = BASE64_STANDARD.decode(SQUARE_IN_DRACO).unwrap();
    let mut model = Model::empty();
    let view = model.view(&stream);
    model.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": 4}));
    model.push("accessors", json!({"componentType": 5121, "type": "SCALAR", "count": 6}));
    let draco = json!({"bufferView": view, "attributes": {"POSITION": 0}});
    model.primitive(json!({
        "attributes": {"POSITION": 0}, "indices": 1, "extensions": {"KHR_draco_mesh_compression": draco},
    }));
    let document = model.document();
    let mut found: Vec<[f64; 3]> = document.points().iter().map(|p| [p.x, p.y, p.z]).collect();
    found.sort_by(|a, b| a.partial_cmp(b).unwrap());
    let mut expected: Vec<[f64; 3]> = SQUARE.iter().map(|p| p.map(f64::from)).collect();
    expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
    let near = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).all(|i| (a[i] - b[i]).abs() < 1e-3);
    assert!(found.len() == 4 && found.iter().zip(&expected).all(near), "{found:?}");
    assert_eq!(document.triangles().len(), 2);
}

#[test]
fn damaged_draco_is_refused() {
    let mut model = in_draco(&EncoderOptions::new());
    model.bin.truncate(60);
    model.json["bufferViews"][0]["byteLength"] = 60.into();
    let message = model.error().to_string();
    assert!(
        message.starts_with("buffer view 0") && message.contains("Draco stream cannot be read"),
        "{message}"
    );
    let missing = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression/attributes/POSITION";
    let message = in_draco(&EncoderOptions::new()).with(missing, 7.into()).error().to_string();
    assert!(message.contains("no such attribute"), "{message}");
}
