//! The command and files that need care: buffers beside a glTF, limits, normals that follow.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![cfg(unix)]

use sombrero::io::{Document, Format, encode};
use sombrero::shapes;
use sombrero_tests::{Workshop, obj, ring, separate_gltf};

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
fn a_copys_buffer_never_replaces_the_originals() {
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
