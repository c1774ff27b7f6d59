//! What people type, and what they meant by it: names that follow from others, words that are nearly right, folders and lists
//! as they have them.

use super::shared::{MADE, arguments, assert_holds, misused, refused, workshop};
use serde_json::{Value, json};
use sombrero::io::{Document, Format, encode};
use sombrero::shapes;
use sombrero_tests::{Workshop, marked};
use std::fs;

/// The JSON objects that a run with several inputs printed, one a line.
fn lines(workshop: &Workshop, line: &str, status: i32) -> Vec<Value> {
    let ran = workshop.line(&format!("{line} --json"));
    assert_eq!((ran.status, ran.stderr.as_str()), (Some(status), ""), "{line}: {}", ran.stdout);
    ran.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn an_input_alone_names_its_copy_and_its_key() {
    let workshop = workshop();
    workshop.line("embed original.obj --secret-file secret").text();
    workshop.line("embed original.obj -o named.obj --key named.key --secret-file secret").text();
    assert_eq!(workshop.read("original-marked.obj"), workshop.read("named.obj"));
    assert_eq!(workshop.read("original.key"), workshop.read("named.key"));
    refused(&workshop, &arguments("embed original.obj"), &["original.key", "already exists", "--force"]);
    // One name is enough, the other follows.
    fs::create_dir(workshop.path("sub")).unwrap();
    workshop.write("sub/a.b.OBJ", &MADE[0]);
    workshop.line("embed sub/a.b.OBJ --key elsewhere.key").text();
    assert!(workshop.path("sub/a.b-marked.OBJ").exists() && workshop.path("elsewhere.key").exists());
    workshop.line("embed sub/a.b.OBJ -o copy.obj").text();
    assert!(workshop.path("sub/a.b.key").exists() && workshop.path("copy.obj").exists());
    refused(&workshop, &arguments("embed -"), &["standard input", "--output", "--key"]);
}

#[test]
fn a_name_of_another_format_is_refused_with_one_that_would_do() {
    let workshop = workshop();
    let glb = encode(Format::Glb, &shapes::bumpy_sphere(650)).unwrap();
    workshop.write("model.glb", &glb);
    workshop.write("called.stl", &glb);
    for (line, name) in [
        ("embed model.glb -o d.stl --key k", "d.glb"),
        ("embed model.glb -o d.GLTF --key k", "d.glb"),
        ("embed original.obj -o d.ply --key k", "d.obj"),
        ("embed called.stl -o called-marked.stl --key k", "called-marked.glb"),
    ] {
        assert_eq!(refused(&workshop, &arguments(line), &["such as", name]), "usage", "{line}");
    }
    // A name that says nothing is taken, and the default is right whatever the input is called.
    workshop.line("embed model.glb -o d.part --key d.key").text();
    workshop.line("embed called.stl").text();
    assert!(workshop.path("called-marked.glb").exists());
    assert_eq!(Document::read(&workshop.path("called-marked.glb")).unwrap().format(), Format::Glb);
    let told = workshop.line("embed called.stl --out-dir out");
    assert_eq!(told.status, Some(2));
    assert_holds(&told.stderr, &["out/called.stl", "out/called.glb"]);
    workshop.write("buyers.csv", "recipient\nAlice\n");
    let words = ["called.stl", "glTF (binary)", ".glb"];
    refused(&workshop, &arguments("embed called.stl --recipients buyers.csv --out-dir out"), &words);
}

#[test]
fn an_attack_is_written_as_its_name_says() {
    let workshop = workshop();
    for (name, format) in
        [("a.stl", Format::StlBinary), ("a.ply", Format::PlyBinaryLittleEndian), ("a.glb", Format::Glb)]
    {
        let ran = workshop.line(&format!("attack marked.obj -o {name} noise:amplitude=0.001"));
        assert!(ran.text().contains(&format!("(bare mesh, as {format})")), "{}", ran.stdout);
        let document = Document::read(&workshop.path(name)).unwrap();
        assert_eq!(document.format(), format);
        assert_eq!(document.triangles().len(), 1280);
    }
    assert!(workshop.line("attack marked.obj -o a.obj none").text().contains("all but positions kept"));
}

#[test]
fn a_word_that_is_nearly_a_command_suggests_it() {
    let workshop = workshop();
    for (typed, meant) in [
        ("emebd original.obj", "embed"),
        ("detekt original.obj", "detect"),
        ("watermark original.obj", "embed"),
        ("extract marked.obj", "detect"),
        ("Mark original.obj", "embed"),
        ("diff original.obj marked.obj", "compare"),
        ("embed original.obj --epsilom 0.01", "--epsilon"),
    ] {
        misused(&workshop, &arguments(typed), &[&format!("did you mean `{meant}`?")]);
    }
    misused(&workshop, &arguments("qqqqqq"), &["see --help"]);
}

#[test]
fn folders_are_walked_and_summed_up() {
    let workshop = workshop();
    for folder in ["models", "models/parts", "models/parts/deep", "models/empty"] {
        fs::create_dir(workshop.path(folder)).unwrap();
    }
    for name in ["models/a.obj", "models/parts/a.obj", "models/parts/deep/b.OBJ"] {
        workshop.write(name, &MADE[0]);
    }
    workshop.write("models/readme.txt", "not a mesh");
    workshop.write("models/parts/broken.ply", "ply\n");
    // Copies go into the folder itself, and are no inputs of the next run.
    let first = lines(&workshop, "embed models --out-dir models/marked --secret-file secret", 2);
    assert_eq!(first.len(), 5);
    assert_eq!(first[4], json!({"summary": {"files": 4, "marked": 3, "kept": 0, "refused": 1}}));
    for name in ["a.obj", "parts/a.obj", "parts/deep/b.OBJ"] {
        assert!(workshop.path(format!("models/marked/{name}")).exists(), "{name}");
        assert!(workshop.path(format!("models/marked/keys/{name}.key")).exists(), "{name}");
    }
    let again = lines(&workshop, "embed models --out-dir models/marked --secret-file secret", 2);
    assert_eq!(again[4], json!({"summary": {"files": 4, "marked": 0, "kept": 3, "refused": 1}}));
    let told = workshop.line("embed models --out-dir models/marked --secret-file secret");
    assert!(told.stdout.ends_with("4 files: 0 marked, 3 kept, 1 refused\n"), "{}", told.stdout);
}

#[test]
fn the_status_of_several_suspects_tells_some_from_none() {
    let workshop = workshop();
    for folder in ["found", "found/below", "lost"] {
        fs::create_dir(workshop.path(folder)).unwrap();
    }
    workshop.write("found/below/copy.obj", &MADE[1]);
    workshop.write("found/other.obj", &MADE[0]);
    workshop.write("lost/one.obj", &MADE[0]);
    workshop.write("lost/two.obj", &MADE[0]);
    let detect = |what: &str| format!("detect {what} --original original.obj --key mark.key");
    let some = lines(&workshop, &detect("found --report pages"), 0);
    assert_eq!(some[2], json!({"summary": {"files": 2, "found": 1, "not_found": 1, "refused": 0}}));
    assert!(workshop.path("pages/below/copy.obj.html").exists());
    let none = lines(&workshop, &detect("lost"), 1);
    assert_eq!(none[2], json!({"summary": {"files": 2, "found": 0, "not_found": 2, "refused": 0}}));
    workshop.write("lost/three.obj", "v 0 0 x\nf 1 1 1\n");
    let ran = workshop.line(&detect("lost"));
    assert_eq!(ran.status, Some(2));
    assert!(ran.stdout.ends_with("3 files: 0 found, 2 not found, 1 refused\n"), "{}", ran.stdout);
}

#[test]
fn lists_may_have_semicolons_or_tabs() {
    let workshop = workshop();
    for (number, list) in [
        "recipient;file\nAlice, Ltd.;one\nBob;two\n",
        "Recipient\tfile\r\nAlice, Ltd.\tone\r\nBob\ttwo\r\n",
        "\u{feff}\"recipient\";\"file\"\n\"Alice, Ltd.\";one\nBob;two\n",
        "file,recipient\none,\"Alice, Ltd.\"\ntwo,Bob\n",
    ]
    .into_iter()
    .enumerate()
    {
        workshop.write("buyers.csv", list);
        let line = format!("embed original.obj --recipients buyers.csv --out-dir {number} --json");
        let answer = workshop.line(&line).json();
        assert_eq!(answer["written"], 2, "{list}");
        assert_eq!(answer["copies"][0]["recipient"], "Alice, Ltd.", "{list}");
        assert!(workshop.path(format!("{number}/two.obj")).exists());
    }
    for (list, separator) in
        [("name;file\nA;b\n", "semicolons"), ("name\tfile\nA\tb\n", "tabs"), ("name\nA\n", "commas")]
    {
        workshop.write("buyers.csv", list);
        let line = arguments("embed original.obj --recipients buyers.csv --out-dir out");
        assert_eq!(refused(&workshop, &line, &["`recipient`", separator]), "recipients");
    }
}

#[test]
fn what_is_no_file_of_its_kind_is_called_what_it_is() {
    let workshop = workshop();
    fs::create_dir(workshop.path("folder")).unwrap();
    for (line, words) in [
        ("detect marked.obj --original original.obj --key folder", ["folder: a folder", "`embed` wrote"]),
        ("verify folder --original original.obj", ["folder: a folder", "a key or a report"]),
        ("embed original.obj --secret-file folder", ["folder: a folder", "64 hexadecimal digits"]),
        ("embed original.obj --recipients folder --out-dir out", ["folder: a folder", "column `recipient`"]),
    ] {
        refused(&workshop, &arguments(line), &words);
    }
}

#[test]
fn keys_of_other_originals_are_one_line() {
    let workshop = workshop();
    fs::create_dir(workshop.path("keys")).unwrap();
    let other = Document::parse(encode(Format::Obj, &shapes::bumpy_sphere(900)).unwrap(), None).unwrap();
    for number in 0..7 {
        let key = marked(&other, 100 + number).key.to_json();
        workshop.write(format!("keys/{number}.key"), key);
    }
    let line = arguments("trace marked.obj --original original.obj --keys keys");
    refused(&workshop, &line, &["keys: no key for this original", "all 7 keys in it"]);
    workshop.write("keys/own.key", &MADE[2]);
    let told = workshop.line("trace marked.obj --original original.obj --keys keys");
    assert_eq!(told.status, Some(0));
    let left_out: Vec<&str> = told.stdout.lines().filter(|line| line.contains("left out")).collect();
    assert_eq!(left_out.len(), 1, "{}", told.stdout);
    assert_holds(left_out[0], &["7 keys: "]);
}

#[test]
fn triangles_that_only_seem_to_meet_are_told_so() {
    let workshop = workshop();
    // Every facet a thousandth smaller about its middle: nothing meets well enough to be joined.
    let sphere = shapes::bumpy_sphere(650);
    let mut soup = sombrero::mesh::Soup::default();
    for (triangle, corners) in (0_u32..).zip(&sphere.triangles) {
        let corners = corners.map(|v| sphere.points[v as usize]);
        let middle = (corners[0].coords + corners[1].coords + corners[2].coords) / 3.0;
        soup.points.extend(corners.map(|p| nalgebra::Point3::from(middle + (p.coords - middle) * 0.99)));
        soup.triangles.push([3 * triangle, 3 * triangle + 1, 3 * triangle + 2]);
    }
    workshop.write("unwelded.stl", encode(Format::StlBinary, &soup).unwrap());
    let words = ["unwelded.stl", "1280 triangles share an edge", "merge vertices"];
    refused(&workshop, &arguments("embed unwelded.stl"), &words);
    // UTF-16, as some editors save texts.
    let text = "solid a\nfacet normal 0 0 1\n";
    let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    workshop.write("wide.stl", [&[0xff, 0xfe][..], &wide].concat());
    refused(&workshop, &arguments("info wide.stl"), &["UTF-16 text", "UTF-8"]);
    workshop.write("bare.stl", wide);
    refused(&workshop, &arguments("info bare.stl"), &["UTF-16 text", "UTF-8"]);
}
