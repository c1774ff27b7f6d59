//! The command and files that need care: buffers beside a glTF, limits, normals that follow.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![cfg(unix)]

use nalgebra::{Isometry3, Point3, Vector3};
use serde_json::{Value, json};
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero_tests::{Workshop, obj, ring, separate_gltf};
use std::collections::BTreeMap;

const PROGRAM: &str = env!("CARGO_BIN_EXE_sombrero-under-test");

/// `vase.gltf` and its buffer.
fn workshop(buffer: &str) -> Workshop {
    let workshop = Workshop::new(PROGRAM);
    let [json, bin] = separate_gltf(&ring(), buffer);
    workshop.write("vase.gltf", json);
    workshop.write("vase data.bin", bin);
    workshop
}

#[test]
fn a_buffer_beside_a_gltf_gets_a_copy_beside_the_marked_one() {
    let workshop = workshop("vase%20data.bin");
    let before = workshop.listing();
    let ran = workshop.line("embed vase.gltf -o marked.gltf --key k --json");
    assert_eq!(ran.status, Some(0), "{}{}", ran.stdout, ran.stderr);
    for (path, content) in &before {
        assert_eq!(workshop.listing().get(path), Some(content), "{}: changed", path.display());
    }
    let marked = String::from_utf8(workshop.read("marked.gltf")).unwrap();
    assert!(marked.contains("\"uri\":\"marked.bin\"") && !marked.contains("vase"), "{marked}");
    assert_eq!(workshop.read("marked.bin").len(), workshop.read("vase data.bin").len());
    let found = workshop.line("detect marked.gltf --original vase.gltf --key k --json");
    assert_eq!(found.status, Some(0), "{}{}", found.stdout, found.stderr);
    // The buffer belongs to what was marked: without it, or with another one, the key does not fit.
    workshop.write("vase data.bin", workshop.read("marked.bin"));
    let other = workshop.line("verify k --original vase.gltf");
    assert_eq!(other.status, Some(2), "{}", other.stdout);
    std::fs::remove_file(workshop.path("vase data.bin")).unwrap();
    let missing = workshop.line("info vase.gltf");
    assert_eq!(missing.status, Some(2), "{}", missing.stdout);
    assert!(
        missing.stderr.contains("vase.gltf: the file it refers to, `vase data.bin`,"),
        "{}",
        missing.stderr
    );
}

#[test]
fn the_buffer_of_a_copy_never_replaces_the_originals() {
    let workshop = workshop("vase%20data.bin");
    for (output, words) in
        [("vase data.gltf", "would replace an input"), ("k.gltf", "two outputs have the same name")]
    {
        let key = if output == "k.gltf" { "k.bin" } else { "k" };
        let before = workshop.listing();
        let ran = workshop.run(["embed", "vase.gltf", "-o", output, "--key", key, "--force"]);
        assert_eq!(ran.status, Some(2), "{}", ran.stdout);
        assert!(ran.stderr.contains(words), "{}", ran.stderr);
        assert!(workshop.listing() == before, "something was written");
    }
}

#[test]
fn no_file_outside_the_models_folder_is_read() {
    for uri in [
        "../secret.bin",
        "/etc/hostname",
        "file:///etc/hostname",
        "%2e%2e/secret.bin",
        "sub/../../secret.bin",
        "/dev/zero",
    ] {
        let workshop = workshop(uri);
        let ran = workshop.line("info vase.gltf");
        assert_eq!(ran.status, Some(2), "{uri}: {}", ran.stdout);
        assert!(ran.stderr.contains("the file it refers to"), "{uri}: {}", ran.stderr);
    }
    let workshop = workshop("link.bin");
    std::os::unix::fs::symlink("/etc/hostname", workshop.path("link.bin")).unwrap();
    let ran = workshop.line("info vase.gltf");
    assert!(ran.status == Some(2) && ran.stderr.contains("link.bin"), "{}", ran.stderr);
}

#[test]
fn limits_are_the_users() {
    let workshop = Workshop::new(PROGRAM);
    workshop.write("ball.obj", encode(Format::Obj, &shapes::bumpy_sphere(650)).unwrap());
    workshop.write("ball.3mf", encode(Format::ThreeMf, &shapes::bumpy_sphere(650)).unwrap());
    for file in ["ball.obj", "ball.3mf"] {
        let told = |options: &str| workshop.line(&format!("info {file} {options}"));
        assert_eq!(told("--max-vertices 700").status, Some(0));
        let few = told("--max-vertices 100");
        assert_eq!(few.status, Some(2));
        assert!(few.stderr.contains("holds more than 100 vertices"), "{}", few.stderr);
        let small = told("--max-bytes 1K");
        assert_eq!(small.status, Some(2));
        assert!(small.stderr.contains("1024 bytes"), "{}", small.stderr);
        assert_eq!(told("--max-bytes 1G").status, Some(0));
    }
    // The archive is small enough, what is in it is not.
    let unpacked = workshop.line("info ball.3mf --max-bytes 40K");
    assert!(unpacked.status == Some(2) && unpacked.stderr.contains("unpacks to more"), "{}", unpacked.stderr);
    let nonsense = workshop.line("info ball.obj --max-bytes 12X");
    assert!(
        nonsense.status == Some(2) && nonsense.stderr.contains("`12X` is not a size"),
        "{}",
        nonsense.stderr
    );
}

#[test]
fn normals_stay_unless_they_are_to_follow() {
    let workshop = Workshop::new(PROGRAM);
    // Every corner of the sample has one and the same normal, which then turns by the mean: hardly. Give each its own.
    let mut text = String::new();
    let soup = ring();
    for line in obj(&soup).lines().filter(|l| !l.starts_with("vn")) {
        let corners = |c: &str| c.split('/').next().map(|v| format!("{v}//{v}")).unwrap();
        match line.strip_prefix("f ") {
            Some(face) => {
                text += &format!("f {}\n", face.split(' ').map(corners).collect::<Vec<_>>().join(" "))
            }
            None => text += &format!("{line}\n"),
        }
    }
    soup.points
        .iter()
        .map(|p| p.coords.normalize())
        .for_each(|n| text += &format!("vn {} {} {}\n", n.x, n.y, n.z));
    workshop.write("vase.obj", &text);
    workshop.write("secret", "cd".repeat(32));
    let lines = |name: &str, word: &str| -> Vec<String> {
        let text = String::from_utf8(workshop.read(name)).unwrap();
        text.lines().filter(|l| l.starts_with(word)).map(str::to_owned).collect()
    };
    for (output, more) in [("kept.obj", ""), ("turned.obj", "--recompute-normals")] {
        let ran = workshop
            .line(&format!("embed vase.obj -o {output} --key {output}.key --secret-file secret {more}"));
        assert_eq!(ran.status, Some(0), "{}", ran.stderr);
    }
    assert_eq!(lines("kept.obj", "v "), lines("turned.obj", "v "));
    assert_eq!(lines("kept.obj", "vn "), lines("vase.obj", "vn "));
    let changed =
        lines("turned.obj", "vn ").iter().zip(lines("vase.obj", "vn ")).filter(|(a, b)| *a != b).count();
    assert!(changed > soup.points.len() / 2, "{changed}");
    assert_eq!(lines("turned.obj", "f "), lines("vase.obj", "f "));
    // They stay unit vectors, and near to what they were.
    let normal = |line: &str| -> Vec<f64> { line.split(' ').skip(1).map(|w| w.parse().unwrap()).collect() };
    for (a, b) in lines("turned.obj", "vn ").iter().zip(lines("vase.obj", "vn ")) {
        let (a, b) = (normal(a), normal(&b));
        let dot: f64 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
        assert!((0.9..1.0001).contains(&dot), "{a:?}, {b:?}");
    }
}

#[test]
fn a_key_is_no_mesh_and_a_document_is_no_model() {
    let workshop = workshop("vase%20data.bin");
    assert_eq!(workshop.line("embed vase.gltf -o m.gltf --key k").status, Some(0));
    let swapped = workshop.line("info k");
    assert!(swapped.status == Some(2) && swapped.stderr.contains("glTF"), "{}", swapped.stderr);
    assert!(Document::read(&workshop.path("m.gltf")).is_ok());
    workshop.write("letter.docx", b"PK\x05\x06\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0");
    let letter = workshop.line("info letter.docx");
    assert_eq!(letter.status, Some(2), "{}", letter.stdout);
}

/// Two bodies in one accessor, each with its own mesh at its own node, and where the nodes put them.
fn shared_positions() -> (Vec<u8>, [Isometry3<f64>; 2]) {
    let mut bodies = [shapes::bumpy_sphere(650), shapes::bumpy_sphere(900)];
    bodies[1].points.iter_mut().for_each(|p| *p = Point3::new(1.3 * p.x, 0.7 * p.y, p.z));
    let places = [
        Isometry3::new(Vector3::new(-2.0, 0.5, 0.0), Vector3::new(0.3, -0.2, 0.9)),
        Isometry3::new(Vector3::new(2.5, 0.0, 1.0), Vector3::new(-1.1, 0.4, 0.2)),
    ];
    let mut bin: Vec<u8> = bodies
        .iter()
        .flat_map(|body| &body.points)
        .flat_map(|p| [p.x, p.y, p.z].map(|x| (x as f32).to_le_bytes()))
        .flatten()
        .collect();
    let count = bin.len() / 12;
    let mut views = vec![json!({"buffer": 0, "byteLength": bin.len()})];
    let mut accessors = vec![json!({"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"})];
    let (mut meshes, mut nodes, mut first) = (Vec::new(), Vec::new(), 0);
    for (body, place) in bodies.iter().zip(&places) {
        let start = bin.len();
        bin.extend(body.triangles.iter().flatten().flat_map(|v| (v + first).to_le_bytes()));
        first += body.points.len() as u32;
        views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": bin.len() - start}));
        let indices = json!({
            "bufferView": views.len() - 1, "componentType": 5125, "count": 3 * body.triangles.len(), "type": "SCALAR",
        });
        accessors.push(indices);
        meshes.push(json!({"primitives": [{"attributes": {"POSITION": 0}, "indices": accessors.len() - 1}]}));
        nodes.push(json!({"mesh": meshes.len() - 1, "matrix": place.to_homogeneous().as_slice()}));
    }
    let json = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}], "nodes": nodes, "meshes": meshes,
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": bin.len()}],
    });
    (glb(json.to_string().as_bytes(), &bin), places)
}

fn glb(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, content, fill) in [(b"JSON", json, b' '), (b"BIN\0", bin, 0)] {
        let length = content.len().next_multiple_of(4);
        body.extend((length as u32).to_le_bytes());
        body.extend(kind);
        body.extend(content);
        body.resize(body.len() + length - content.len(), fill);
    }
    let length = (12 + body.len()) as u32;
    [&b"glTF"[..], &2_u32.to_le_bytes(), &length.to_le_bytes(), &body].concat()
}

/// The scene of [`shared_positions`] as another program flattens it: from the bytes of the buffer alone.
fn flattened(file: &[u8], places: &[Isometry3<f64>; 2]) -> Soup {
    let length = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
    let json: Value = serde_json::from_slice(&file[20..20 + length]).unwrap();
    let bin = &file[28 + length..];
    let number = |value: &Value| value.as_u64().unwrap() as usize;
    let count = number(&json["accessors"][0]["count"]);
    let stored: Vec<Point3<f64>> = bin[..12 * count]
        .chunks(12)
        .map(|p| [0, 4, 8].map(|at| f64::from(f32::from_le_bytes(p[at..at + 4].try_into().unwrap()))).into())
        .collect();
    let mut soup = Soup::default();
    for (part, place) in places.iter().enumerate() {
        let view = &json["bufferViews"][part + 1];
        let (start, length) = (number(&view["byteOffset"]), number(&view["byteLength"]));
        for corners in bin[start..start + length].chunks(12) {
            let first = soup.points.len() as u32;
            for corner in corners.chunks(4) {
                let corner = u32::from_le_bytes(corner.try_into().unwrap());
                soup.points.push(place * stored[corner as usize]);
            }
            soup.triangles.push([first, first + 1, first + 2]);
        }
    }
    soup
}

#[test]
fn positions_that_several_nodes_share_are_marked_where_they_are_shown() {
    let (file, places) = shared_positions();
    let shown = flattened(&file, &places).bounding_box().unwrap();
    let document = Document::parse(file.clone(), None).unwrap();
    let read = document.soup().bounding_box().unwrap();
    assert!((read.min - shown.min).norm() < 1e-5 && (read.max - shown.max).norm() < 1e-5);
    let workshop = Workshop::new(PROGRAM);
    workshop.write("scene.glb", &file);
    workshop.line("embed scene.glb --preset robust").text();
    let marked = workshop.read("scene-marked.glb");
    workshop.write("flat.stl", encode(Format::StlBinary, &flattened(&marked, &places)).unwrap());
    let plain = encode(Format::StlBinary, &flattened(&file, &places)).unwrap();
    workshop.write("plain.stl", plain);
    let detect = |suspect: &str| {
        let ran = workshop.line(&format!("detect {suspect} --original scene.glb --key scene.key --json"));
        (ran.status.unwrap(), ran.json()["log10_p"].as_f64().unwrap())
    };
    let [whole, flat, plain] = ["scene-marked.glb", "flat.stl", "plain.stl"].map(detect);
    assert!(whole.0 == 0 && whole.1 < -100.0, "{whole:?}");
    assert!(flat.0 == 0 && flat.1 < 0.5 * whole.1, "{flat:?} of {whole:?}");
    assert_eq!(plain.0, 1, "{plain:?}");
}

#[test]
fn concave_polygons_are_marked_and_found_as_the_surface_that_they_are() {
    // Vertices pushed about on the surface, and pairs of triangles made quadrilaterals that begin at an outer corner: a
    // fan of a concave one covers what is outside.
    let mut soup = shapes::bumpy_sphere(1500);
    for (i, p) in soup.points.iter_mut().enumerate() {
        let angle = (i * i % 97) as f64;
        let aside = Vector3::new(angle.cos(), angle.sin(), (3.0 * angle).sin()) * 0.035;
        *p += aside - p.coords.normalize() * p.coords.normalize().dot(&aside);
    }
    let mut single: BTreeMap<[u32; 2], [u32; 3]> = BTreeMap::new();
    let mut quads: Vec<[u32; 4]> = Vec::new();
    for &[a, b, c] in &soup.triangles {
        let turns = [[a, b, c], [b, c, a], [c, a, b]];
        let quad = turns.into_iter().find_map(|[p, q, r]| {
            let [_, _, other] = single.remove(&[q, p])?;
            Some([r, p, other, q])
        });
        match quad {
            Some(quad) => {
                single.retain(|_, triangle| !triangle.iter().all(|v| quad.contains(v)));
                quads.push(quad);
            }
            None => single.extend(turns.map(|[p, q, r]| ([p, q], [p, q, r]))),
        }
    }
    let mut text = String::new();
    soup.points.iter().for_each(|p| text += &format!("v {:.6} {:.6} {:.6}\n", p.x, p.y, p.z));
    let line = |corners: &[u32]| {
        let names: Vec<String> = corners.iter().map(|v| (v + 1).to_string()).collect();
        format!("f {}\n", names.join(" "))
    };
    quads.iter().for_each(|quad| text += &line(quad));
    let left = single.values().filter(|t| t[0] < t[1] && t[0] < t[2]);
    left.for_each(|triangle| text += &line(triangle));
    let document = Document::parse(text.clone().into_bytes(), Some("obj")).unwrap();
    assert_eq!(document.triangles().len(), soup.triangles.len());
    let pairs = quads.iter().zip(document.triangles().chunks(2));
    let clipped = pairs.filter(|(quad, pair)| pair.iter().any(|triangle| !triangle.contains(&quad[0])));
    assert!(clipped.count() > 20);
    let workshop = Workshop::new(PROGRAM);
    workshop.write("quads.obj", &text);
    workshop.line("embed quads.obj --preset robust").text();
    let detect = |suspect: &str| {
        let line = format!("detect {suspect} --original quads.obj --key quads.key --json");
        let answer = workshop.line(&line).json();
        (answer["log10_p"].as_f64().unwrap(), answer["variant"]["resampling"] == true)
    };
    // The same polygons are the same connectivity, however positions would have them split.
    let (log10_p, by_surface) = detect("quads-marked.obj");
    assert!(log10_p < -100.0 && !by_surface, "{log10_p} {by_surface}");
    // Somebody else splits them the other way.
    workshop.line("attack quads-marked.obj -o triangles.stl reorder").text();
    assert!(detect("triangles.stl").0 < -30.0);
    let compared = workshop.line("compare quads.obj quads-marked.obj --json").json();
    assert!(compared["vertex_rms"].is_number(), "{compared}");
}
