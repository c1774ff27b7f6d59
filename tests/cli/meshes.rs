//! Inputs that are no mesh, and meshes that cannot carry a mark.

use super::shared::{arguments, assert_holds, refused, workshop};
use sombrero::io::{Format, encode};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero_tests::{Workshop, ascii_stl, binary_stl, flat_sheet, obj, off, ply, ring};
use std::ffi::OsString;
use std::os::unix::fs::symlink;

/// Every command that reads a mesh, with `bad` in the place of each mesh that it reads.
fn assert_unreadable(workshop: &Workshop, bad: &str, words: &[&str]) {
    let mut words = words.to_vec();
    words.push(bad);
    for line in [
        "info BAD",
        "embed BAD -o out --key new.key",
        "attack BAD -o out none",
        "compare BAD original.obj",
        "compare original.obj BAD",
        "render BAD -o out",
        "render original.obj -o out --compare BAD",
        "detect BAD --original original.obj --key mark.key --method paper --registration never --resampling never",
        "detect marked.obj --original BAD --key mark.key --method paper --registration never --resampling never",
        "prepare --original BAD --key mark.key",
        "verify mark.key --original BAD",
    ] {
        let arguments: Vec<OsString> =
            line.split(' ').map(|word| if word == "BAD" { bad.into() } else { word.into() }).collect();
        assert_eq!(refused(workshop, &arguments, &words), "read", "{line}: {bad}");
    }
}

#[test]
fn a_missing_file_and_a_directory_are_refused() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("folder.obj")).unwrap();
    symlink("nowhere.obj", workshop.path("dangling.obj")).unwrap();
    symlink("circle.obj", workshop.path("circle.obj")).unwrap();
    assert_unreadable(&workshop, "missing.obj", &["check the path"]);
    assert_unreadable(&workshop, "no/such/folder/mesh.obj", &["check the path"]);
    assert_unreadable(&workshop, "original.obj/mesh.obj", &["check the path"]);
    assert_unreadable(&workshop, "dangling.obj", &["check the path"]);
    assert_unreadable(&workshop, "circle.obj", &["check the path"]);
    assert_unreadable(&workshop, "folder.obj", &["not a regular file"]);
    assert_unreadable(&workshop, "/dev/zero", &["not a regular file"]);
}

#[test]
fn files_that_are_no_mesh_are_refused() {
    let workshop = workshop();
    let png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01\x08\x06\0\0\0\x1f\x15\xc4\x89".as_slice();
    let noise: Vec<u8> = (0..3000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let prose = b"It was a dark and stormy night;\nthe rain fell in torrents.\n".as_slice();
    for extension in ["obj", "ply", "off", "stl", "txt"] {
        for (name, bytes) in [
            ("empty", b"".as_slice()),
            ("png", png),
            ("prose", prose),
            ("noise", &noise),
            ("blank", b"\n \n"),
        ] {
            let name = format!("{name}.{extension}");
            workshop.write(&name, bytes);
            refused(&workshop, &arguments(&format!("info {name}")), &[&name]);
        }
    }
    for name in ["empty.obj", "png.ply", "prose.off", "noise.stl", "blank.txt"] {
        assert_unreadable(&workshop, name, &["export"]);
    }
}

#[test]
fn truncated_files_are_refused() {
    let workshop = workshop();
    let soup = ring();
    for (name, extension, whole) in [
        ("text", "obj", obj(&soup).into_bytes()),
        ("text", "off", off(&soup).into_bytes()),
        ("text", "stl", ascii_stl(&soup).into_bytes()),
        ("binary", "stl", binary_stl(&soup)),
        ("text", "ply", ply(&soup, "ascii", true)),
        ("little", "ply", ply(&soup, "binary_little_endian", false)),
        ("big", "ply", ply(&soup, "binary_big_endian", true)),
    ] {
        // Inside the header or the first lines, inside vertices, inside faces, and just before the end.
        for (share, part) in [(0.001, "start"), (0.3, "middle"), (0.9, "late"), (0.9999, "end")] {
            if extension == "obj" && share > 0.7 {
                // An OBJ that was cut inside its faces is another OBJ, and a face has no fixed length.
                continue;
            }
            let mut bytes = whole[..(whole.len() as f64 * share) as usize].to_vec();
            if extension == "obj" {
                // Cut inside a vertex.
                while !bytes.ends_with(b"\nv ") {
                    bytes.pop();
                }
                bytes.extend(b"0.5 0.2");
            }
            let name = format!("{name}-{part}.{extension}");
            workshop.write(&name, &bytes);
            refused(&workshop, &arguments(&format!("info {name}")), &[&name]);
            refused(&workshop, &arguments(&format!("embed {name} -o out --key out.key")), &[&name]);
        }
    }
    assert_unreadable(&workshop, "big-late.ply", &["cut off"]);
}

#[test]
fn coordinates_that_are_no_numbers_are_refused_with_their_place() {
    let workshop = workshop();
    for bad in ["nan", "-NaN", "inf", "-Infinity", "1e999", "1.2.3", "0x10", "1,5", "--1"] {
        let file = format!("v 0 0 0\nv 1 {bad} 0\nv 0 1 0\nf 1 2 3\n");
        workshop.write("bad.obj", &file);
        workshop.write("bad.off", format!("OFF\n3 1 0\n0 0 0\n1 {bad} 0\n0 1 0\n3 0 1 2\n"));
        let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                      element face 1\nproperty list uchar int vertex_indices\nend_header\n";
        workshop.write("bad.ply", format!("{header}0 0 0\n1 {bad} 0\n0 1 0\n3 0 1 2\n"));
        workshop.write(
            "bad.stl",
            format!("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 {bad} 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"),
        );
        for (name, line) in [("bad.obj", "line 2"), ("bad.off", "line 4"), ("bad.stl", "line 5")] {
            refused(&workshop, &arguments(&format!("info {name}")), &[name, line]);
        }
        refused(&workshop, &arguments("info bad.ply"), &["bad.ply"]);
    }
    let soup = shapes::icosahedron();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut bytes = binary_stl(&soup);
        bytes[84 + 50 * 2 + 12 + 4..][..4].copy_from_slice(&bad.to_le_bytes());
        workshop.write("bad-binary.stl", bytes);
        refused(&workshop, &arguments("info bad-binary.stl"), &["bad-binary.stl", "not finite"]);
        let mut bytes = ply(&soup, "binary_big_endian", false);
        let body = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        bytes[body + 17 * 5 + 8..][..4].copy_from_slice(&bad.to_be_bytes());
        workshop.write("bad-binary.ply", bytes);
        refused(&workshop, &arguments("info bad-binary.ply"), &["bad-binary.ply", "vertex 5", "not finite"]);
    }
    assert_unreadable(&workshop, "bad.obj", &["line 2"]);
    assert_unreadable(&workshop, "bad-binary.ply", &["not finite"]);
}

#[test]
fn faces_that_name_no_vertex_are_refused_with_their_place() {
    let workshop = workshop();
    for index in ["4", "0", "-4", "99999999999", "4294967297", "-9223372036854775808", "18446744073709551617"]
    {
        workshop.write("bad.obj", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {index}\n"));
        refused(&workshop, &arguments("info bad.obj"), &["bad.obj", "line 4"]);
    }
    for index in ["3", "-1", "99999999999", "18446744073709551617"] {
        workshop.write("bad.off", format!("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 {index}\n"));
        refused(&workshop, &arguments("info bad.off"), &["bad.off", "line 6"]);
    }
    for index in [3, -1, i32::MAX, i32::MIN] {
        let mut bytes = ply(&shapes::icosahedron(), "binary_little_endian", true);
        let light = bytes.len() - 8;
        let last = if index == 3 { 12 } else { index };
        bytes[light - 4..light].copy_from_slice(&last.to_le_bytes());
        workshop.write("bad.ply", bytes);
        refused(&workshop, &arguments("info bad.ply"), &["bad.ply", "face", "vertex"]);
    }
    assert_unreadable(&workshop, "bad.obj", &["line 4"]);
    assert_unreadable(&workshop, "bad.ply", &["vertex"]);
}

#[test]
fn headers_that_promise_too_much_are_refused() {
    let workshop = workshop();
    workshop.write("big.off", "OFF\n4000000000 4000000000 0\n0 0 0\n");
    let claim = |count: &str| {
        format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
        )
    };
    workshop.write("big.ply", claim("4000000000"));
    workshop.write("bigger.ply", claim("18446744073709551615"));
    workshop.write("negative.ply", claim("-1"));
    let mut stl = vec![0; 84];
    stl[80..].fill(0xff);
    workshop.write("big.stl", stl);
    for name in ["big.off", "big.ply", "bigger.ply", "negative.ply", "big.stl"] {
        refused(&workshop, &arguments(&format!("info {name}")), &[name]);
    }
}

#[test]
fn a_file_without_faces_cannot_be_marked() {
    let workshop = workshop();
    let cloud = Soup::new(shapes::bumpy_sphere(300).points, Vec::new());
    workshop.write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nl 1 2\n");
    workshop.write("points.ply", encode(Format::PlyBinaryLittleEndian, &cloud).unwrap());
    workshop.write("points.off", encode(Format::Off, &cloud).unwrap());
    workshop.write("thin.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2\nf 1 1 1\n");
    for name in ["points.obj", "points.ply", "points.off", "thin.obj"] {
        refused(&workshop, &arguments(&format!("embed {name} -o out --key out.key")), &[name, "face"]);
        refused(&workshop, &arguments(&format!("compare original.obj {name}")), &[name, "face"]);
    }
    for name in ["points.obj", "points.ply", "points.off"] {
        refused(&workshop, &arguments(&format!("attack {name} -o out noise:amplitude=0.1")), &[name, "face"]);
    }
    // Points are a cloud, which the method of the paper has no use for; a few of them are nothing at all.
    let line = "detect points.obj --original original.obj --key mark.key";
    refused(&workshop, &arguments(line), &["points.obj", "face"]);
}

#[test]
fn a_comparison_names_the_file_that_has_no_face() {
    let workshop = workshop();
    workshop.write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    refused(&workshop, &arguments("compare points.obj original.obj"), &["points.obj: ", "face"]);
}

#[test]
fn a_mesh_that_is_too_small_says_how_many_coefficients_it_could_carry() {
    let workshop = workshop();
    for (name, soup) in [
        ("ball.obj", shapes::bumpy_sphere(50)),
        ("sheet.obj", shapes::open_sheet(5, 4)),
        ("tetrahedron.obj", shapes::tetrahedron()),
        ("flat.obj", flat_sheet(30)),
        ("cube.obj", shapes::cube()),
    ] {
        workshop.write(name, encode(Format::Obj, &soup).unwrap());
        let info = workshop.line(&format!("info {name} --json")).json();
        let capacity = info["capacity"].as_u64().unwrap();
        assert!(capacity < 50, "{info}");
        assert_eq!(info["markable"], capacity >= 16, "{info}");
        let embed = format!("embed {name} -o {name}.out.obj --key {name}.out.key");
        if capacity >= 16 {
            let few = format!("{capacity} coefficients");
            assert_holds(workshop.line(&embed).text(), &["mark", &few, "small", "16"]);
        } else {
            let words = [name, "coefficients", &format!("can carry {capacity} "), "16"];
            refused(&workshop, &arguments(&embed), &words);
        }
        let words = [name, "coefficients", &format!("can carry {capacity} "), "50"];
        let attack = arguments(&format!("attack {name} -o out.obj watermark"));
        refused(&workshop, &attack, &words);
        if capacity >= 16 {
            // What it says it can carry, it carries; one more, and it does not.
            let embed =
                |n: u64| format!("embed {name} -o {n}.obj --key {n}.key --preset robust --coefficients {n}");
            refused(&workshop, &arguments(&embed(capacity + 1)), &words[..3]);
            workshop.line(&embed(capacity)).text();
            let line = format!(
                "detect {capacity}.obj --original {name} --key {capacity}.key --method paper --registration never --resampling never"
            );
            assert_eq!(workshop.line(&line).status, Some(0), "{name}: {capacity} coefficients");
        }
    }
    assert_eq!(workshop.line("info flat.obj --json").json()["capacity"], 0);
}
