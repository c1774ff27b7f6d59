//! The command as people and programs meet it: every answer, and every way of being asked nonsense.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![cfg(unix)]

use serde_json::Value;
use sha2::{Digest, Sha256};
use sombrero::basis::BasisFunction;
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero::watermark::Key;
use sombrero::{Detector, EmbedOptions, embed};
use sombrero_tests::{
    Workshop, ascii_stl, binary_stl, flat_sheet, mapped, marked, obj, off, ply, ring, samples,
};
use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::process::Stdio;
use std::sync::LazyLock;

const PROGRAM: &str = env!("CARGO_BIN_EXE_sombrero-under-test");

/// An original, its marked copy and the key.
static MADE: LazyLock<[Vec<u8>; 3]> = LazyLock::new(|| {
    let original = encode(Format::Obj, &shapes::bumpy_sphere(650)).unwrap();
    let mark = marked(&Document::parse(original.clone(), None).unwrap(), 1);
    [original, mark.bytes, mark.key.to_json().into_bytes()]
});

/// A folder with `original.obj`, `marked.obj`, `mark.key` and `secret`.
fn workshop() -> Workshop {
    let workshop = Workshop::new(PROGRAM);
    for (name, bytes) in ["original.obj", "marked.obj", "mark.key"].into_iter().zip(&*MADE) {
        workshop.write(name, bytes);
    }
    workshop.write("secret", "ab".repeat(32));
    workshop
}

fn arguments(line: &str) -> Vec<OsString> {
    line.split_whitespace().map(OsString::from).collect()
}

fn with_json(arguments: &[OsString]) -> Vec<OsString> {
    let mut arguments = arguments.to_vec();
    arguments.push("--json".into());
    arguments
}

/// What no message may hold.
fn assert_clean(message: &str) {
    for trace in ["panicked", "RUST_BACKTRACE", "backtrace", "NaN", "Some(", "Err(", "Error {", "src/"] {
        assert!(!message.contains(trace), "`{trace}` in: {message}");
    }
}

fn assert_holds(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "no `{word}` in: {message}");
    }
}

/// Runs what cannot be done: status 2, one sentence with these words for people and the same for programs, and the
/// folder as it was.
fn refused(workshop: &Workshop, arguments: &[OsString], words: &[&str]) -> String {
    let before = workshop.listing();
    let ran = workshop.run(arguments);
    assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""), "{arguments:?}: {}", ran.stderr);
    let message = ran.stderr.strip_prefix("sombrero: ").and_then(|text| text.strip_suffix('\n'));
    let message = message.unwrap_or_else(|| panic!("{arguments:?}: {}", ran.stderr));
    assert!(!message.contains('\n') && message.len() > 20, "{arguments:?}: not one sentence: {message}");
    assert_clean(message);
    assert_holds(message, words);
    assert!(workshop.listing() == before, "{arguments:?}: something was written");

    let told = for_programs(workshop, arguments);
    assert_eq!(told.message, message, "{arguments:?}");
    assert!(workshop.listing() == before, "{arguments:?} with --json: something was written");
    told.kind
}

/// Runs what the command line does not allow: status 2 and an explanation that holds these words.
fn misused(workshop: &Workshop, arguments: &[OsString], words: &[&str]) {
    let before = workshop.listing();
    let ran = workshop.run(arguments);
    assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""), "{arguments:?}: {}", ran.stderr);
    assert_clean(&ran.stderr);
    assert_holds(&ran.stderr, words);
    let told = for_programs(workshop, arguments);
    assert_eq!(told.kind, "usage", "{arguments:?}");
    assert_clean(&told.message);
    assert_holds(&told.message, words);
    assert!(workshop.listing() == before, "{arguments:?}: something was written");
}

struct Told {
    kind: String,
    message: String,
}

fn for_programs(workshop: &Workshop, arguments: &[OsString]) -> Told {
    let ran = workshop.run(with_json(arguments));
    assert_eq!(ran.status, Some(2), "{arguments:?}: {}", ran.stdout);
    let answer = ran.json();
    let error = answer["error"].as_object().unwrap_or_else(|| panic!("{arguments:?}: {answer}"));
    assert_eq!((answer.as_object().unwrap().len(), error.len()), (1, 2), "{answer}");
    let text = |name: &str| error[name].as_str().unwrap_or_else(|| panic!("{answer}")).to_owned();
    let told = Told { kind: text("kind"), message: text("message") };
    assert!(
        !told.kind.is_empty() && told.kind.bytes().all(|b| b == b'_' || b.is_ascii_lowercase()),
        "{answer}"
    );
    assert!(!told.message.contains('\n'), "{answer}");
    told
}

/// The name of a field, and what its value has to be.
type Field = (&'static str, fn(&Value) -> bool);

fn assert_fields(answer: &Value, fields: &[Field]) {
    for (name, fits) in fields {
        let value = answer.get(name).unwrap_or_else(|| panic!("no `{name}` in {answer}"));
        assert!(fits(value), "`{name}` is {value}");
    }
}

fn count(value: &Value) -> bool {
    value.is_u64()
}

fn number(value: &Value) -> bool {
    value.as_f64().is_some_and(f64::is_finite)
}

fn text(value: &Value) -> bool {
    value.is_string()
}

fn object(value: &Value) -> bool {
    value.is_object()
}

fn null(value: &Value) -> bool {
    value.is_null()
}

fn yes(value: &Value) -> bool {
    *value == true
}

fn no(value: &Value) -> bool {
    *value == false
}

fn texts(value: &Value) -> bool {
    value.as_array().is_some_and(|list| list.iter().all(Value::is_string))
}

// What goes well.

#[test]
fn every_command_explains_itself() {
    let workshop = Workshop::new(PROGRAM);
    let commands: [(&str, &[&str]); 10] = [
        (
            "",
            &[
                "embed",
                "detect",
                "attack",
                "compare",
                "render",
                "info",
                "prepare",
                "verify",
                "demo",
                "Exit status",
                "--version",
            ],
        ),
        (
            "embed",
            &[
                "INPUT",
                "--output",
                "--key",
                "--owner",
                "--recipient",
                "--coefficients",
                "--epsilon",
                "--basis",
                "--secret-file",
                "--force",
            ],
        ),
        (
            "detect",
            &[
                "SUSPECT",
                "--original",
                "--key",
                "--method",
                "robust",
                "paper",
                "--registration",
                "--resampling",
                "auto",
                "always",
                "never",
                "--threshold",
                "--report",
                "--prepared",
            ],
        ),
        ("attack", &["INPUT", "--output", "SPEC", "--seed", "noise:amplitude", "crop:fraction", "--force"]),
        ("compare", &["<A>", "<B>"]),
        (
            "render",
            &["<MESH>", "--output", "--compare", "--size", "--up", "--wireframe", "--force", "Example"],
        ),
        ("info", &["MESH"]),
        ("prepare", &["--original", "--key", "--output", "--force", "Example"]),
        ("verify", &["KEY", "--original"]),
        ("demo", &["--output", "--seed", "--force"]),
    ];
    for (command, words) in commands {
        let help = workshop.line(&format!("{command} --help"));
        assert_holds(help.text(), words);
        assert_holds(help.text(), &["Usage: ", "--json", "--threads", "--help"]);
        assert_holds(workshop.line(&format!("help {command}")).text(), words);
        assert!(workshop.line(&format!("{command} -h")).text().contains("Usage: "), "{command}");
        let version = workshop.line(&format!("{command} --version"));
        assert!(version.text().trim_end().ends_with(env!("CARGO_PKG_VERSION")), "{}", version.stdout);
        assert!(version.text().starts_with("sombrero"), "{}", version.stdout);
    }
}

#[test]
fn embed_says_what_it_did() {
    let workshop = workshop();
    let line = "embed original.obj -o a.obj --key a.key --owner Alice --recipient Bob --secret-file secret";
    let said = workshop.line(line);
    assert_holds(
        said.text(),
        &["original.obj", "a.obj", "a.key", "642 vertices", "200 coefficients", "log10 p"],
    );
    assert_eq!(workshop.listing().len(), 6, "two files and no more");

    let line =
        "embed original.obj -o b.obj --key b.key --owner Alice --recipient Bob --secret-file secret --json";
    let answer = workshop.line(line).json();
    assert_fields(
        &answer,
        &[
            ("output", |v| v == "b.obj"),
            ("key", |v| v == "b.key"),
            ("vertices", |v| v == 642),
            ("faces", |v| v == 1280),
            ("coefficients", |v| v == 200),
            ("epsilon", |v| v == 0.0088),
            ("basis", |v| v == "sombrero"),
            ("distortion", object),
            ("seconds", |v| !v.is_null()),
        ],
    );
    let distortion: [Field; 4] =
        [("max", number), ("rms", number), ("relative_max", number), ("relative_rms", number)];
    assert_fields(&answer["distortion"], &distortion);
    assert!(workshop.read("a.obj") == workshop.read("b.obj"), "the same secret makes the same copy");
    assert!(workshop.read("a.key") == workshop.read("b.key"), "and the same key");

    for basis in ["sombrero", "derby", "hat"] {
        let line = format!(
            "embed original.obj -o {basis}.obj --key {basis}.key --basis {basis} --coefficients 20 --epsilon 0.02 --json"
        );
        let answer = workshop.line(&line).json();
        assert_eq!(
            (&answer["basis"], &answer["coefficients"], &answer["epsilon"]),
            (&basis.into(), &20.into(), &0.02.into())
        );
    }
}

#[test]
fn detect_finds_a_mark_with_status_0_and_none_with_status_1() {
    let workshop = workshop();
    let found = workshop.line("detect marked.obj --original original.obj --key mark.key --method paper --registration never --resampling never");
    assert_holds(found.text(), &["FOUND", "marked.obj", "log10 p", "correlation"]);
    let lost = workshop.line("detect original.obj --original original.obj --key mark.key --method paper --registration never --resampling never");
    assert_eq!((lost.status, lost.stderr.as_str()), (Some(1), ""));
    assert_holds(&lost.stdout, &["NOT FOUND", "original.obj"]);

    for (suspect, status) in [("marked.obj", 0), ("original.obj", 1)] {
        let line = format!(
            "detect {suspect} --original original.obj --key mark.key --method paper --registration never --resampling never --json"
        );
        let ran = workshop.line(&line);
        assert_eq!(ran.status, Some(status));
        let answer = ran.json();
        assert_fields(
            &answer,
            &[
                ("detected", if status == 0 { yes } else { no }),
                ("p_value", |v| v.as_f64().is_some_and(|p| (0.0..=1.0).contains(&p))),
                ("log10_p", |v| v.as_f64().is_some_and(|p| p.is_finite() && p <= 0.0)),
                ("threshold", |v| v == 1e-6),
                ("correlation", |v| v.as_f64().is_some_and(|r| (-1.0..=1.0).contains(&r))),
                ("coefficients_used", count),
                ("coverage", |v| v.as_f64().is_some_and(|share| (share - 1.0).abs() < 1e-9)),
                ("method", |v| v == "paper"),
                ("variant", |v| !v.is_null()),
                ("variants", |v| v.as_array().is_some_and(|list| !list.is_empty())),
                ("registration", |v| v.is_null() || v["matrix"].is_array()),
                ("seconds", |v| v.as_object().is_some_and(|o| !o.is_empty() && o.values().all(number))),
            ],
        );
        for variant in answer["variants"].as_array().unwrap() {
            assert_fields(
                variant,
                &[
                    ("registration", Value::is_boolean),
                    ("resampling", Value::is_boolean),
                    ("log10_p", number),
                    ("correlation", number),
                ],
            );
        }
    }
}

#[test]
fn the_threshold_decides() {
    let workshop = workshop();
    workshop.line("attack marked.obj -o noisy.obj noise:amplitude=0.004 --seed 3").text();
    let status = |threshold: f64| {
        let line = format!(
            "detect noisy.obj --original original.obj --key mark.key --method paper --registration never --resampling never --json --threshold {threshold}"
        );
        let ran = workshop.line(&line);
        (ran.status.unwrap(), ran.json()["log10_p"].as_f64().unwrap())
    };
    let (found, log10_p) = status(1.0);
    assert!(found == 0 && log10_p < -2.0, "{log10_p}");
    let p = 10_f64.powf(log10_p);
    assert_eq!([status(p * 1.1).0, status(p * 0.9).0, status(1e-300).0], [0, 1, 1]);
}

#[test]
fn attack_says_what_it_did() {
    let workshop = workshop();
    let said = workshop.line("attack marked.obj -o a.obj noise:amplitude=0.002 smooth:iterations=1 --seed 7");
    assert_holds(said.text(), &["marked.obj", "a.obj", "noise:amplitude=0.002", "642 points"]);
    let answer = workshop
        .line("attack marked.obj -o b.obj noise:amplitude=0.002 smooth:iterations=1 --seed 7 --json")
        .json();
    assert_fields(
        &answer,
        &[
            ("output", |v| v == "b.obj"),
            ("attacks", texts),
            ("seed", |v| v == 7),
            ("vertices", count),
            ("faces", count),
        ],
    );
    assert!(workshop.read("a.obj") == workshop.read("b.obj"), "one seed, one attack");
    workshop.line("attack marked.obj -o c.obj noise:amplitude=0.002 smooth:iterations=1 --seed 8").text();
    assert!(workshop.read("a.obj") != workshop.read("c.obj"), "two seeds, two attacks");
    let found = workshop.line("detect a.obj --original original.obj --key mark.key --method paper --registration never --resampling never --json");
    assert_eq!((found.status, &found.json()["detected"]), (Some(0), &true.into()));

    for spec in ["none", "reorder", "transform", "simplify:ratio=0.5", "watermark", "crop:fraction=0.333"] {
        workshop.line(&format!("attack marked.obj -o {spec}.obj {spec}")).text();
        let left = workshop.line(&format!("info {spec}.obj --json")).json();
        assert!(left["triangles"].as_u64().is_some_and(|n| n > 300), "{spec}: {left}");
    }
}

#[test]
fn compare_says_how_far_apart() {
    let workshop = workshop();
    assert_holds(
        workshop.line("compare original.obj marked.obj").text(),
        &["original.obj", "marked.obj", "Hausdorff", "rms"],
    );
    let lengths: [Field; 6] = [
        ("hausdorff", number),
        ("rms", number),
        ("mean", number),
        ("relative_hausdorff", number),
        ("relative_rms", number),
        ("vertex_rms", number),
    ];
    let apart = workshop.line("compare original.obj marked.obj --json").json();
    assert_fields(&apart, &lengths);
    for (name, _) in lengths {
        assert!(apart[name].as_f64().unwrap() > 0.0, "{name} in {apart}");
    }
    let same = workshop.line("compare original.obj original.obj --json").json();
    for (name, _) in lengths {
        assert!(same[name].as_f64().unwrap() < 1e-12, "{name} in {same}");
    }
    workshop.line("attack original.obj -o half.obj simplify:ratio=0.5").text();
    let other = workshop.line("compare original.obj half.obj --json").json();
    assert!(other.get("vertex_rms").is_none() && number(&other["rms"]), "{other}");
}

#[test]
fn info_says_what_a_mesh_is() {
    let workshop = workshop();
    assert_holds(
        workshop.line("info original.obj").text(),
        &["OBJ", "642", "1280", "closed", "genus 0", "markable"],
    );
    workshop.write("sheet.ply", ply(&shapes::open_sheet(12, 9), "binary_big_endian", true));
    let fields: [Field; 17] = [
        ("format", text),
        ("vertices", count),
        ("triangles", count),
        ("components", |v| v == 1),
        ("boundary_loops", count),
        ("boundary_edges", count),
        ("nonmanifold_edges", |v| v == 0),
        ("nonmanifold_vertices", |v| v == 0),
        ("degenerate_faces", |v| v == 0),
        ("unused_vertices", |v| v == 0),
        ("genus", |v| v.is_null() || v == 0),
        ("bounding_box", |v| {
            ["min", "max"]
                .iter()
                .all(|end| v[*end].as_array().is_some_and(|p| p.len() == 3 && p.iter().all(number)))
        }),
        ("area", number),
        ("volume", |v| v.is_null() || number(v)),
        ("attributes", texts),
        ("markable", Value::is_boolean),
        ("warnings", texts),
    ];
    let closed = workshop.line("info original.obj --json").json();
    assert_fields(&closed, &fields);
    assert_fields(
        &closed,
        &[("boundary_loops", |v| v == 0), ("genus", |v| v == 0), ("volume", number), ("markable", yes)],
    );
    let open = workshop.line("info sheet.ply --json").json();
    assert_fields(&open, &fields);
    let of_sheet: [Field; 6] = [
        ("vertices", |v| v == 130),
        ("triangles", |v| v == 216),
        ("boundary_loops", |v| v == 1),
        ("boundary_edges", |v| v == 42),
        ("genus", null),
        ("volume", null),
    ];
    assert_fields(&open, &of_sheet);
    let attributes: Vec<&str> =
        open["attributes"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    assert!(attributes.contains(&"confidence"), "{attributes:?}");
}

#[test]
fn info_looks_at_meshes_that_cannot_be_marked() {
    let workshop = Workshop::new(PROGRAM);
    let dirty = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 5 5 5\nf 1 2 3\nf 1 2 3\nf 1 1 2\nf 1 2 4\nf 2 1 5\n";
    let meshes = [
        ("points.obj", "v 0 0 0\nv 1 0 0\n".to_owned()),
        ("triangle.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_owned()),
        ("flat.off", off(&flat_sheet(20))),
        ("needle.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n".to_owned()),
        ("one-place.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n".to_owned()),
        ("dirty.obj", dirty.to_owned()),
    ];
    for (name, file) in meshes {
        workshop.write(name, file);
        let said = workshop.line(&format!("info {name}"));
        assert_clean(said.text());
        assert_holds(said.text(), &[name, "cannot be marked"]);
        let answer = workshop.line(&format!("info {name} --json")).json();
        assert_fields(
            &answer,
            &[("markable", no), ("area", number), ("warnings", |v| texts(v) && v[0].is_string())],
        );
    }
}

/// The answer of `detect` with these further words, and its status.
fn looked(workshop: &Workshop, words: &str) -> (i32, Value) {
    let ran = workshop.line(&format!("detect --original original.obj --key mark.key --json {words}"));
    (ran.status.unwrap(), ran.json())
}

/// What prepared files must not change.
fn verdict(mut answer: Value) -> Value {
    for name in ["seconds", "prepared", "warnings"] {
        answer.as_object_mut().unwrap().remove(name);
    }
    answer
}

#[test]
fn detect_uses_what_was_prepared() {
    let workshop = workshop();
    let suspects = ["marked.obj", "original.obj"];
    let plain = suspects.map(|suspect| looked(&workshop, suspect));
    assert!(plain.iter().all(|(_, answer)| no(&answer["prepared"])));

    let said = workshop.line("prepare --original original.obj --key mark.key");
    assert_holds(said.text(), &["original.obj", "mark.key.prepared", "200 coefficients", "private"]);
    let mode = workshop.path("mark.key.prepared").metadata().unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    let answer = workshop.line("prepare --original original.obj --key mark.key -o elsewhere --json").json();
    assert_fields(
        &answer,
        &[
            ("output", |v| v == "elsewhere"),
            ("vertices", |v| v == 642),
            ("coefficients", |v| v == 200),
            ("bytes", count),
        ],
    );
    assert!(workshop.read("elsewhere") == workshop.read("mark.key.prepared"), "one key, one prepared file");

    for (suspect, (status, answer)) in suspects.into_iter().zip(plain) {
        let warnings = answer["warnings"].clone();
        let expected = (status, verdict(answer));
        let (status, beside) = looked(&workshop, suspect);
        assert!(yes(&beside["prepared"]) && beside["warnings"] == warnings, "{beside}");
        assert_eq!((status, verdict(beside)), expected, "{suspect}");
        let (status, named) = looked(&workshop, &format!("{suspect} --prepared elsewhere"));
        assert!(yes(&named["prepared"]), "{named}");
        // Nobody shall take what was found for more than it is.
        let told = named["warnings"].to_string();
        assert_eq!(told.contains("elsewhere") && told.contains("verify"), status == 0, "{told}");
        assert_eq!((status, verdict(named)), expected, "{suspect}");
    }
}

#[test]
fn a_prepared_file_that_does_not_fit_is_left_aside_unless_it_was_asked_for() {
    let workshop = workshop();
    let expected = looked(&workshop, "marked.obj");
    let expected = (expected.0, verdict(expected.1));
    workshop.line("prepare --original original.obj --key mark.key").text();
    let whole = workshop.read("mark.key.prepared");
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    workshop.line("embed original.obj -o paper.obj --key paper.key --preset paper").text();
    workshop.line("prepare --original original.obj --key paper.key").text();
    let files = [
        ("empty", Vec::new(), "sombrero prepare"),
        ("truncated", whole[..whole.len() / 3].to_vec(), "damaged"),
        ("flipped", flipped, "damaged"),
        ("later", b"sombrero prepared 7\n".to_vec(), "version"),
        ("unrelated", workshop.read("paper.key.prepared"), "another key"),
        ("key", workshop.read("mark.key"), "not a prepared file"),
    ];
    for (name, bytes, word) in files {
        workshop.write("mark.key.prepared", &bytes);
        workshop.write(name, &bytes);
        let (status, answer) = looked(&workshop, "marked.obj");
        assert!(no(&answer["prepared"]), "{name}");
        let warnings = answer["warnings"].to_string();
        assert_clean(&warnings);
        assert_holds(&warnings, &["mark.key.prepared", word]);
        assert_eq!((status, verdict(answer)), expected, "{name}");
        let line = "detect marked.obj --original original.obj --key mark.key";
        assert_holds(workshop.line(line).text(), &["note", "mark.key.prepared", word]);
        let asked = arguments(&format!("{line} --prepared {name}"));
        assert_eq!(refused(&workshop, &asked, &[name, word, "sombrero prepare"]), "prepared");
    }
    std::fs::remove_file(workshop.path("mark.key.prepared")).unwrap();
    std::fs::create_dir(workshop.path("mark.key.prepared")).unwrap();
    let (status, answer) = looked(&workshop, "marked.obj");
    assert_holds(&answer["warnings"].to_string(), &["mark.key.prepared", "not a regular file"]);
    assert_eq!((status, verdict(answer)), expected);
    let asked = "detect marked.obj --original original.obj --key mark.key --prepared missing";
    assert_eq!(refused(&workshop, &arguments(asked), &["missing", "check the path"]), "read");
}

/// The same prepared file, as if made for this key.
fn forged_for(key: &Key, file: &[u8]) -> Vec<u8> {
    let options = key.parameters.basis;
    let parameters = format!("{} {} {}", options.coefficients, options.function, options.amplitudes);
    let identity = [&key.original_sha256[..], &key.basis_sha256, parameters.as_bytes()].concat();
    let mut forged = file[..file.len() - 32].to_vec();
    forged["sombrero prepared 1\n".len()..][..32].copy_from_slice(&Sha256::digest(identity));
    let hash = Sha256::digest(&forged);
    forged.extend(hash);
    forged
}

#[test]
fn prepared_files_vouch_for_nothing() {
    let workshop = workshop();
    workshop.line("prepare --original original.obj --key mark.key").text();
    // Another original is another original.
    let other = "detect marked.obj --original marked.obj --key mark.key";
    assert_eq!(refused(&workshop, &arguments(other), &["mark.key", "another original"]), "key");
    // A key and a prepared file that agree with each other, but not with the original.
    let original = Document::parse(workshop.read("original.obj"), None).unwrap();
    let key = Key::from_json(&workshop.read("mark.key")).unwrap();
    let derby = {
        let mut options = EmbedOptions::default();
        options.parameters.basis.function = BasisFunction::Derby;
        embed(&original, key.secret, &options).unwrap().key
    };
    let mut forged = derby.clone();
    forged.parameters.basis.function = BasisFunction::Sombrero;
    let file = Detector::new(&original, derby).unwrap().prepared_basis();
    workshop.write("forged.key", forged.to_json());
    workshop.write("forged.key.prepared", forged_for(&forged, &file));
    let asked = "detect marked.obj --original original.obj --key forged.key";
    assert_eq!(refused(&workshop, &arguments(asked), &["forged.key", "edited"]), "key");
}

#[test]
fn prepare_overwrites_nothing() {
    let workshop = workshop();
    workshop.line("prepare --original original.obj --key mark.key").text();
    let line = "prepare --original original.obj --key mark.key";
    assert_eq!(refused(&workshop, &arguments(line), &["mark.key.prepared", "exists", "--force"]), "write");
    assert_eq!(workshop.line(&format!("{line} --force")).status, Some(0));
    for input in ["original.obj", "mark.key"] {
        let line = format!("{line} -o {input} --force");
        assert_eq!(refused(&workshop, &arguments(&line), &[input, "input"]), "write");
    }
    let line = "prepare --original marked.obj --key mark.key -o new";
    assert_eq!(refused(&workshop, &arguments(line), &["mark.key", "another original"]), "key");
    let line = "detect marked.obj --original original.obj --key mark.key --report mark.key.prepared --force";
    assert_eq!(refused(&workshop, &arguments(line), &["mark.key.prepared", "input"]), "write");
}

#[test]
fn verify_tells_a_genuine_key() {
    let workshop = workshop();
    assert_holds(
        workshop.line("verify mark.key --original original.obj").text(),
        &["mark.key is genuine", "original.obj"],
    );
    let answer = workshop.line("verify mark.key --original original.obj --json").json();
    assert_fields(&answer, &[("genuine", yes), ("coefficients", |v| v == 200), ("epsilon", |v| v == 0.0088)]);
    assert!(!answer.to_string().contains(&"01".repeat(32)), "the secret stays in the key");
}

#[test]
fn demo_tells_the_whole_story() {
    let workshop = Workshop::new(PROGRAM);
    let answer = workshop.line("demo -o show --seed 4 --json").json();
    let rows = answer["rows"].as_array().unwrap();
    assert!(rows.iter().all(|row| number(&row["log10_p"])), "{rows:?}");
    assert!(rows.iter().filter(|row| row["marked"] == false).all(|row| row["detected"] == false), "{rows:?}");
    let copies = || rows.iter().filter(|row| row["suspect"] == "none");
    assert!(copies().count() == 2 && copies().all(|row| row["detected"] == true), "{rows:?}");
    let made = workshop.listing();
    assert!(made.len() > 10);
    for file in answer["files"].as_array().unwrap() {
        assert!(workshop.path(file.as_str().unwrap()).is_file(), "{file}");
    }
    let line = "detect show/part-marked.obj --original show/part.obj --key show/part.key --method paper --registration never --resampling never";
    assert!(workshop.line(line).text().contains("FOUND"));

    workshop.line("demo -o show --seed 4 --force --threads 1").text();
    assert!(workshop.listing() == made, "one seed, one demo, whatever the threads");
}

#[test]
fn a_demo_that_has_no_place_is_refused() {
    let workshop = Workshop::new(PROGRAM);
    workshop.write("file", "");
    refused(&workshop, &arguments("demo -o file"), &["file", "folder"]);
    std::fs::create_dir(workshop.path("show")).unwrap();
    workshop.write("show/part.key", "");
    refused(&workshop, &arguments("demo -o show"), &["show/part.key", "already exists", "--force"]);
}

/// A page without its programs and data.
fn without_scripts(page: &str) -> String {
    let mut parts = page.split("<script");
    let first = parts.next().unwrap_or_default().to_owned();
    first + &parts.map(|part| part.split_once("</script>").unwrap().1).collect::<String>()
}

#[test]
fn detect_writes_a_report_when_asked() {
    let workshop = workshop();
    let line =
        "detect marked.obj --original original.obj --key mark.key --registration never --resampling never";
    workshop.line(&format!("{line} --report page.html")).text();
    let page = String::from_utf8(workshop.read("page.html")).unwrap();
    assert!(page.to_ascii_lowercase().starts_with("<!doctype html>"), "{}", &page[..page.len().min(200)]);
    assert_holds(&page, &["original.obj", "marked.obj", "mark.key", "</html>"]);
    assert!(!page.contains(&"01".repeat(32)), "the secret stays in the key");
    // Any letters may stand in a picture.
    let text = without_scripts(&page);
    let words = text.split("base64,").map(|part| part.split_once('"').map_or(part, |(_, rest)| rest));
    words.skip(1).for_each(assert_clean);

    let report = |name: &str| arguments(&format!("{line} --report {name}"));
    let forced = |name: &str| arguments(&format!("{line} --report {name} --force"));
    assert_eq!(
        refused(&workshop, &report("page.html"), &["page.html", "already exists", "--force"]),
        "write"
    );
    for input in ["original.obj", "marked.obj", "mark.key", "./mark.key"] {
        assert_eq!(refused(&workshop, &forced(input), &[input, "input"]), "write");
    }
    assert_eq!(workshop.run(forced("page.html")).status, Some(0));
}

#[test]
fn a_suspect_that_was_turned_or_reordered_is_found_without_a_hint() {
    let workshop = workshop();
    for spec in ["transform", "reorder"] {
        workshop.line(&format!("attack marked.obj -o {spec}.obj {spec} --seed 2")).text();
        let ran = workshop.line(&format!("detect {spec}.obj --original original.obj --key mark.key --json"));
        assert_eq!(ran.status, Some(0), "{spec}: {}{}", ran.stdout, ran.stderr);
        let registration = &ran.json()["registration"];
        if spec == "transform" {
            let rows = registration["matrix"].as_array().unwrap();
            assert_eq!(rows.len(), 4);
            assert!(
                rows.iter().all(|row| row.as_array().is_some_and(|r| r.len() == 4 && r.iter().all(number)))
            );
            assert_eq!(rows[3], serde_json::json!([0.0, 0.0, 0.0, 1.0]));
            assert!(number(&registration["rms"]), "{registration}");
        }
    }
    let line = "detect reorder.obj --original original.obj --key mark.key --method paper --resampling never";
    refused(&workshop, &arguments(line), &["reorder.obj", "resampl"]);
}

#[test]
fn render_draws_a_mesh_and_how_far_it_is_from_another() {
    let workshop = workshop();
    let drawn = workshop.line("render marked.obj -o mesh.png --size 64 --json").json();
    assert_eq!((&drawn["width"], &drawn["height"]), (&64.into(), &64.into()));
    assert!(drawn.get("scale").is_none());
    let picture = workshop.read("mesh.png");
    assert!(picture.starts_with(b"\x89PNG"));

    let line = "render marked.obj -o heat.png --size 64 --compare original.obj";
    assert_holds(workshop.line(line).text(), &["heat.png", "original.obj", "distance"]);
    let heat = workshop.read("heat.png");
    assert_ne!(picture, heat);
    let again = workshop.line(&format!("{line} --force --json")).json();
    let far = again["scale"][1].as_f64().unwrap();
    let apart = workshop.line("compare marked.obj original.obj --json").json();
    // Vertices are no farther from the surface than where they came from.
    assert!(again["scale"][0] == 0.0 && far > 0.0 && far <= apart["vertex_max"].as_f64().unwrap(), "{again}");
    assert_eq!(workshop.read("heat.png"), heat, "the same picture again");
    refused(&workshop, &arguments(line), &["heat.png", "--force"]);

    let sideways = workshop.read("mesh.png");
    workshop.line("render marked.obj -o mesh.png --size 64 --up z --wireframe --force").text();
    assert_ne!(workshop.read("mesh.png"), sideways);
}

// Inputs that are no mesh.

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

// Meshes that cannot carry a mark.

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
        let line = format!(
            "detect {name} --original original.obj --key mark.key --method paper --registration never --resampling never"
        );
        refused(&workshop, &arguments(&line), &[name, "face"]);
    }
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
        assert!(capacity < 50 && info["markable"] == false, "{info}");
        let words = [name, "coefficients", &format!("can carry {capacity} "), "50"];
        refused(&workshop, &arguments(&format!("embed {name} -o out.obj --key out.key")), &words);
        let attack = arguments(&format!("attack {name} -o out.obj watermark"));
        refused(&workshop, &attack, &words);
        if capacity >= 10 {
            // What it says it can carry, it carries; one more, and it does not.
            let embed = |n: u64| format!("embed {name} -o {n}.obj --key {n}.key --coefficients {n}");
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

// Keys.

/// Both commands that read a key refuse this one.
fn assert_no_key(workshop: &Workshop, key: &str, words: &[&str]) -> [String; 2] {
    let mut words = words.to_vec();
    words.push(key);
    [
        format!("detect marked.obj --original original.obj --method paper --registration never --resampling never --key {key}"),
        format!("verify {key} --original original.obj"),
    ]
    .map(|line| refused(workshop, &arguments(&line), &words))
}

#[test]
fn a_key_of_another_original_is_refused() {
    let workshop = workshop();
    let other = encode(Format::Obj, &shapes::bumpy_sphere(1000)).unwrap();
    let key = marked(&Document::parse(other.clone(), None).unwrap(), 1).key;
    workshop.write("other.obj", other);
    workshop.write("other.key", key.to_json());
    assert_eq!(assert_no_key(&workshop, "other.key", &["another original", "SHA-256"]), ["key", "key"]);
    // A copy that says the same in other bytes is another file.
    let mut spaced = workshop.read("original.obj");
    spaced.extend(b"\n");
    workshop.write("spaced.obj", spaced);
    let line = "detect marked.obj --original spaced.obj --key mark.key --method paper --registration never --resampling never";
    refused(&workshop, &arguments(line), &["mark.key", "another original"]);
    refused(
        &workshop,
        &arguments("verify mark.key --original marked.obj"),
        &["mark.key", "another original"],
    );
}

#[test]
fn a_damaged_key_is_refused() {
    let workshop = workshop();
    let key = workshop.read("mark.key");
    let text = String::from_utf8(key.clone()).unwrap();
    let mut bits = key.clone();
    bits[40] ^= 0x80;
    let last = text.rfind("    ").unwrap();
    for (name, bytes, words) in [
        ("empty.key", Vec::new(), &["key"][..]),
        ("cut.key", key[..key.len() / 2].to_vec(), &["damaged"]),
        ("bits.key", bits, &["damaged"]),
        ("list.key", b"[1, 2, 3]".to_vec(), &["format"]),
        ("null.key", b"null".to_vec(), &["format"]),
        ("other.key", b"{\"format\": \"else\"}".to_vec(), &["format"]),
        ("mesh.key", workshop.read("original.obj"), &["not a sombrero key"]),
        ("deep.key", "[".repeat(100_000).into_bytes(), &["key"]),
        ("tail.key", [key.as_slice(), b"x"].concat(), &["damaged"]),
        (
            "fewer.key",
            (text[..last].trim_end().trim_end_matches(',').to_owned() + "\n  ]\n}\n").into_bytes(),
            &["watermark", "199"],
        ),
        ("later.key", text.replace("\"version\": 1", "\"version\": 2").into_bytes(), &["version 2"]),
        ("versionless.key", text.replace("\"version\": 1", "\"version\": -1").into_bytes(), &["key"]),
        (
            "extra.key",
            text.replace("\"version\": 1", "\"version\": 1, \"colour\": 3").into_bytes(),
            &["colour"],
        ),
        (
            "twice.key",
            text.replace("\"version\": 1", "\"version\": 1, \"version\": 1").into_bytes(),
            &["version"],
        ),
        (
            "many.key",
            text.replace("\"coefficients\": 200", "\"coefficients\": 4000000000").into_bytes(),
            &["coefficients"],
        ),
        (
            "none.key",
            text.replace("\"coefficients\": 200", "\"coefficients\": 0").into_bytes(),
            &["coefficients"],
        ),
        ("infinite.key", text.replace("\"epsilon\": 0.0088", "\"epsilon\": 1e999").into_bytes(), &["key"]),
        ("nothing.key", text.replace("\"epsilon\": 0.0088", "\"epsilon\": 0").into_bytes(), &["epsilon"]),
        ("nan.key", text.replace("\"epsilon\": 0.0088", "\"epsilon\": NaN").into_bytes(), &["key"]),
        ("cap.key", text.replace("\"basis\": \"sombrero\"", "\"basis\": \"cap\"").into_bytes(), &["basis"]),
    ] {
        assert!(bytes != key, "{name} is not damaged");
        workshop.write(name, bytes);
        assert_eq!(assert_no_key(&workshop, name, words), ["key", "key"], "{name}");
    }
}

#[test]
fn a_hand_edited_key_is_refused() {
    let workshop = workshop();
    let text = String::from_utf8(workshop.read("mark.key")).unwrap();
    let key: Value = serde_json::from_str(&text).unwrap();
    let edited = |field: &str, value: Value| {
        let mut key = key.clone();
        assert_ne!(key[field], value);
        key[field] = value;
        key.to_string()
    };
    let mut w = key["watermark"].clone();
    w[7] = (w[7].as_f64().unwrap() + 1e-9).into();
    for (name, file, words) in [
        ("epsilon.key", edited("epsilon", 0.011.into()), &["strength"][..]),
        ("watermark.key", edited("watermark", w), &["coefficient 7", "edited"]),
        ("owner.key", edited("owner", "Mallory".into()), &["watermark", "edited"]),
        ("recipient.key", edited("recipient", "Mallory".into()), &["watermark", "edited"]),
        ("basis.key", edited("basis", "hat".into()), &["basis", "edited"]),
        ("digest.key", edited("basis_sha256", "00".repeat(32).into()), &["basis"]),
        ("hash.key", edited("original_sha256", "00".repeat(32).into()), &["another original"]),
        ("secret.key", edited("secret", "00".repeat(32).into()), &["watermark", "edited"]),
    ] {
        workshop.write(name, file);
        assert_eq!(assert_no_key(&workshop, name, words), ["key", "key"], "{name}");
    }
    // Only the looks were changed, so it is the key that it was.
    workshop.write("dense.key", key.to_string());
    assert!(workshop.line("verify dense.key --original original.obj").text().contains("genuine"));
}

#[test]
fn a_key_that_is_no_small_file_is_refused() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("folder.key")).unwrap();
    std::fs::File::create(workshop.path("huge.key")).unwrap().set_len(1 << 40).unwrap();
    assert_no_key(&workshop, "folder.key", &["not a regular file"]);
    assert_no_key(&workshop, "huge.key", &["larger"]);
    assert_no_key(&workshop, "missing.key", &["check the path"]);
    assert_no_key(&workshop, "/dev/zero", &["not a regular file"]);
}

#[test]
fn a_secret_file_of_another_length_is_refused() {
    let workshop = workshop();
    let good = "0123456789abcdef".repeat(4);
    for (name, bytes) in [
        ("short", good.as_bytes()[1..].to_vec()),
        ("long", (good.clone() + "0").into_bytes()),
        ("empty", Vec::new()),
        ("letters", good.replace('a', "x").into_bytes()),
        ("raw", vec![7; 32]),
        ("two", (good.clone() + "\n" + &good).into_bytes()),
        ("huge", good.repeat(100_000).into_bytes()),
    ] {
        workshop.write(name, bytes);
        let line = format!("embed original.obj -o out.obj --key out.key --secret-file {name}");
        refused(&workshop, &arguments(&line), &[name]);
    }
    std::fs::create_dir(workshop.path("folder")).unwrap();
    for name in ["folder", "missing"] {
        let line = format!("embed original.obj -o out.obj --key out.key --secret-file {name}");
        assert_eq!(refused(&workshop, &arguments(&line), &[name]), "read");
    }
    // Its last line may end, and digits may be of either case.
    workshop.write("fine", good.to_uppercase() + "\r\n");
    workshop.line("embed original.obj -o out.obj --key out.key --secret-file fine").text();
    let key: Value = serde_json::from_slice(&workshop.read("out.key")).unwrap();
    assert_eq!(key["secret"], good);
}

// Outputs.

#[test]
fn an_existing_output_is_replaced_only_with_force() {
    let workshop = workshop();
    workshop.write("taken", "mine");
    for line in [
        "embed original.obj -o taken --key new.key",
        "embed original.obj -o new.obj --key taken",
        "attack original.obj -o taken none",
    ] {
        assert_eq!(refused(&workshop, &arguments(line), &["taken", "already exists", "--force"]), "write");
        let forced = workshop.line(&format!("{line} --force"));
        assert_eq!(forced.status, Some(0), "{line}: {}", forced.stderr);
        assert_ne!(workshop.read("taken"), b"mine");
        for name in ["new.obj", "new.key"] {
            let _ = std::fs::remove_file(workshop.path(name));
        }
        workshop.write("taken", "mine");
    }
    symlink("nowhere", workshop.path("dangling")).unwrap();
    refused(&workshop, &arguments("attack original.obj -o dangling none"), &["dangling", "already exists"]);
}

#[test]
fn an_input_is_never_an_output() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("sub")).unwrap();
    symlink("original.obj", workshop.path("link.obj")).unwrap();
    let absolute = workshop.path("original.obj").into_os_string().into_string().unwrap();
    for same in ["original.obj", "./original.obj", "sub/../original.obj", "link.obj", absolute.as_str()] {
        for line in [
            format!("embed original.obj -o {same} --key new.key --force"),
            format!("embed original.obj -o new.obj --key {same} --force"),
            format!("attack original.obj -o {same} none --force"),
            format!("embed {same} -o original.obj --key new.key --force"),
        ] {
            assert_eq!(refused(&workshop, &arguments(&line), &["obj", "input"]), "write", "{line}");
        }
    }
}

#[test]
fn a_secret_file_is_an_input_too() {
    let workshop = workshop();
    for line in [
        "embed original.obj -o new.obj --key secret --secret-file secret --force",
        "embed original.obj -o secret --key new.key --secret-file secret --force",
    ] {
        refused(&workshop, &arguments(line), &["secret"]);
    }
}

#[test]
fn two_outputs_never_have_one_name() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("sub")).unwrap();
    workshop.write("old", "");
    for (one, other) in [("old", "./old"), ("sub/../old", "old"), ("old", "old")] {
        for force in ["", "--force"] {
            let line = format!("embed original.obj -o {one} --key {other} {force}");
            assert_eq!(refused(&workshop, &arguments(&line), &["old"]), "write", "{line}");
        }
    }
}

#[test]
fn two_new_outputs_never_have_one_name_however_it_is_spelled() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("sub")).unwrap();
    for (one, other) in [("new", "./new"), ("sub/../new", "new"), ("sub/new", "./sub/new")] {
        for force in ["", "--force"] {
            let line = format!("embed original.obj -o {one} --key {other} {force}");
            assert_eq!(refused(&workshop, &arguments(&line), &["new"]), "write", "{line}");
        }
    }
}

#[test]
fn an_output_that_cannot_be_written_leaves_nothing_behind() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("folder")).unwrap();
    for place in ["missing/out", "original.obj/out", "folder", "/dev/null", "/dev/null/out"] {
        for line in [
            "embed original.obj --key new.key --force -o",
            "embed original.obj -o new.obj --force --key",
            "attack original.obj none --force -o",
        ] {
            let mut arguments = arguments(line);
            arguments.push(place.into());
            assert_eq!(refused(&workshop, &arguments, &[place]), "write", "{line} {place}");
        }
    }
    let folder = workshop.path("locked");
    std::fs::create_dir(&folder).unwrap();
    std::fs::set_permissions(&folder, std::fs::Permissions::from_mode(0o555)).unwrap();
    // Permissions do not hold everybody back.
    if std::fs::write(folder.join("probe"), "").is_ok() {
        std::fs::remove_file(folder.join("probe")).unwrap();
    } else {
        let line = "embed original.obj -o new.obj --key locked/new.key";
        assert_eq!(refused(&workshop, &arguments(line), &["locked/new.key"]), "write");
    }
}

#[test]
fn a_key_is_readable_by_its_owner_alone() {
    let workshop = workshop();
    let mode = |name: &str| workshop.path(name).metadata().unwrap().permissions().mode() & 0o777;
    for umask in ["000", "022", "077"] {
        // The program inherits the shell's mask.
        let script = format!("umask {umask}; exec \"$0\" \"$@\"");
        let mut shell = std::process::Command::new("sh");
        let (copy, key) = (format!("{umask}.obj"), format!("{umask}.key"));
        shell.args(["-c", &script, PROGRAM, "embed", "original.obj", "-o", &copy, "--key", &key]);
        let output = shell.current_dir(workshop.path("")).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let open = 0o666 & !u32::from_str_radix(umask, 8).unwrap();
        assert_eq!((mode(&key), mode(&copy)), (0o600, open), "umask {umask}");
    }
}

#[test]
fn a_key_that_replaces_an_open_file_is_readable_by_its_owner_alone() {
    let workshop = workshop();
    workshop.write("open.key", "");
    std::fs::set_permissions(workshop.path("open.key"), std::fs::Permissions::from_mode(0o644)).unwrap();
    workshop.line("embed original.obj -o new.obj --key open.key --force").text();
    let mode = workshop.path("open.key").metadata().unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600, "a new secret in a file for everybody");
}

#[test]
fn an_output_goes_through_a_link() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("elsewhere")).unwrap();
    workshop.write("elsewhere/target.obj", "old");
    symlink("elsewhere/target.obj", workshop.path("link.obj")).unwrap();
    symlink("elsewhere", workshop.path("way")).unwrap();
    refused(&workshop, &arguments("attack original.obj -o link.obj none"), &["link.obj", "already exists"]);
    workshop.line("attack original.obj -o link.obj none --force").text();
    assert!(workshop.path("link.obj").is_symlink());
    assert!(workshop.read("elsewhere/target.obj") == workshop.read("original.obj"));
    workshop.line("embed original.obj -o way/new.obj --key way/new.key").text();
    assert!(workshop.path("elsewhere/new.obj").is_file() && workshop.path("elsewhere/new.key").is_file());
}

// The command line.

#[test]
fn attacks_that_make_no_sense_are_refused() {
    let workshop = workshop();
    for (spec, words) in [
        ("explode", &["explode", "noise"][..]),
        ("", &["no attack"]),
        ("Noise:amplitude=1", &["Noise"]),
        ("noise", &["amplitude"]),
        ("noise:", &["amplitude"]),
        ("noise:amplitude", &["amplitude"]),
        ("noise:amplitude=", &["amplitude"]),
        ("noise:amplitude=much", &["much"]),
        ("noise:amplitude=inf", &["amplitude", "inf"]),
        ("noise:amplitude=0.1,amplitude=0.2", &["amplitude"]),
        ("noise:amplitude=0.1,colour=2", &["colour"]),
        ("none:strength=1", &["strength"]),
        ("smooth:iterations=-1", &["iterations"]),
        ("smooth:iterations=1.5", &["iterations"]),
        ("smooth:iterations=99999999999999999999", &["iterations"]),
        ("watermark:basis=cap", &["basis"]),
        ("watermark:coefficients=-3", &["coefficients"]),
        ("simplify", &["ratio"]),
        ("crop", &["fraction"]),
    ] {
        let mut arguments = arguments("attack original.obj -o out.obj");
        arguments.push(spec.into());
        misused(&workshop, &arguments, words);
    }
    for (spec, words) in [
        ("noise:amplitude=-0.1", &["amplitude"][..]),
        ("noise:amplitude=1e300", &["amplitude"]),
        ("smooth:lambda=2", &["lambda"]),
        ("smooth:mu=1", &["mu"]),
        ("simplify:ratio=-1", &["ratio"]),
        ("simplify:ratio=2", &["ratio"]),
        ("crop:fraction=-1", &["fraction"]),
        ("crop:fraction=1.5", &["fraction"]),
        ("transform:scale=0", &["scale"]),
        ("transform:scale=-1", &["scale"]),
        ("transform:rotation=1e9", &["rotation"]),
        ("transform:translation=-1", &["translation"]),
        ("watermark:coefficients=100000", &["coefficients"]),
        ("watermark:coefficients=1000000000000", &["coefficients"]),
        ("crop:fraction=1", &["no face"]),
        ("crop:fraction=0.9999", &["no face"]),
    ] {
        let line = format!("attack original.obj -o out.obj none {spec} none");
        assert_eq!(
            refused(&workshop, &arguments(&line), &[&["original.obj"], words].concat()),
            "attack",
            "{spec}"
        );
    }
}

#[test]
fn second_marks_obey_the_rules_of_first_ones() {
    let workshop = workshop();
    for (spec, word) in [
        ("watermark:epsilon=0", "epsilon"),
        ("watermark:epsilon=-0.01", "epsilon"),
        ("watermark:epsilon=1e300", "epsilon"),
        ("watermark:coefficients=0", "coefficients"),
    ] {
        let line = format!("attack original.obj -o out.obj {spec}");
        refused(&workshop, &arguments(&line), &["original.obj", word]);
    }
}

#[test]
fn an_attack_parameter_that_is_no_number_is_quoted_as_it_was_given() {
    let workshop = workshop();
    misused(
        &workshop,
        &arguments("attack original.obj -o out.obj noise:amplitude=nan"),
        &["amplitude", "nan"],
    );
}

#[test]
fn wrong_usage_is_explained() {
    let workshop = workshop();
    for (line, words) in [
        ("embed original.obj -o out.obj --key out.key --threads 0", &["threads", "0"][..]),
        ("embed original.obj -o out.obj --key out.key --threads -1", &["-1"]),
        ("embed original.obj -o out.obj --key out.key --threads many", &["threads", "many"]),
        ("embed original.obj -o out.obj --key out.key --threads 1000000", &["threads", "1000000"]),
        ("embed original.obj -o out.obj --key out.key --coefficients many", &["coefficients", "many"]),
        ("embed original.obj -o out.obj --key out.key --coefficients 1.5", &["coefficients", "1.5"]),
        (
            "embed original.obj -o out.obj --key out.key --coefficients 99999999999999999999",
            &["coefficients"],
        ),
        ("embed original.obj -o out.obj --key out.key --epsilon small", &["epsilon", "small"]),
        ("embed original.obj -o out.obj --key out.key --basis cap", &["basis", "cap"]),
        ("embed original.obj -o out.obj --key out.key --secret 00", &["--secret"]),
        ("embed original.obj -o out.obj --key out.key --owner", &["--owner"]),
        ("embed original.obj -o out.obj --key out.key --key b.key", &["--key"]),
        ("embed original.obj extra.obj -o out.obj --key out.key", &["extra.obj"]),
        ("detect marked.obj --original original.obj --key mark.key --method magic", &["method", "magic"]),
        (
            "detect marked.obj --original original.obj --key mark.key --registration maybe",
            &["registration", "maybe"],
        ),
        ("detect marked.obj --original original.obj --key mark.key --threshold low", &["threshold", "low"]),
        ("attack original.obj -o out.obj none --seed -1", &["-1"]),
        ("attack original.obj -o out.obj none --seed 18446744073709551616", &["seed"]),
        ("frobnicate original.obj", &["frobnicate"]),
        ("info original.obj marked.obj", &["marked.obj"]),
        ("info --colour original.obj", &["--colour"]),
    ] {
        misused(&workshop, &arguments(line), words);
    }
}

#[test]
fn what_is_missing_is_named() {
    let workshop = workshop();
    for (line, words) in [
        ("embed", &["INPUT"][..]),
        ("embed original.obj", &["--output", "--key", "--out-dir"]),
        ("embed original.obj --recipients list.csv", &["--out-dir"]),
        ("embed original.obj -o out.obj", &["--key"]),
        ("detect marked.obj", &["--original", "--key"]),
        ("attack original.obj -o out.obj", &["SPEC"]),
        ("attack original.obj none", &["--output"]),
        ("compare original.obj", &["<B>"]),
        ("info", &["MESH"]),
        ("verify mark.key", &["--original"]),
    ] {
        misused(&workshop, &arguments(line), words);
    }
}

#[test]
fn no_command_at_all_is_wrong_usage() {
    let workshop = workshop();
    let ran = workshop.line("");
    assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""));
    assert_holds(&ran.stderr, &["Usage: ", "embed", "detect"]);
    let told = for_programs(&workshop, &[]);
    assert_eq!(told.kind, "usage");
    assert_holds(&told.message, &["command"]);
}

#[test]
fn numbers_out_of_range_are_refused() {
    let workshop = workshop();
    for epsilon in ["0", "-0.0", "1e9", "1.0001", "inf", "1e-400"] {
        let line = format!("embed original.obj -o out.obj --key out.key --epsilon={epsilon}");
        refused(&workshop, &arguments(&line), &["epsilon"]);
    }
    refused(
        &workshop,
        &arguments("embed original.obj -o out.obj --key out.key --epsilon=-1"),
        &["epsilon", "-1"],
    );
    for (coefficients, words) in [
        ("0", &["0"][..]),
        ("1", &["4"]),
        ("3", &["4"]),
        ("1000000000", &["can carry"]),
        ("18446744073709551615", &["can carry"]),
    ] {
        let line = format!("embed original.obj -o out.obj --key out.key --coefficients {coefficients}");
        refused(&workshop, &arguments(&line), &[&["coefficients"], words].concat());
    }
    for threshold in ["0", "2", "inf", "1e-400", "-0.5"] {
        let line = format!(
            "detect marked.obj --original original.obj --key mark.key --method paper --registration never --resampling never --threshold={threshold}"
        );
        assert_eq!(refused(&workshop, &arguments(&line), &["threshold"]), "usage");
    }
}

#[test]
fn an_option_that_is_no_number_is_quoted_as_it_was_given() {
    let workshop = workshop();
    for line in [
        "embed original.obj -o out.obj --key out.key --epsilon nan",
        "detect marked.obj --original original.obj --key mark.key --method paper --registration never --resampling never --threshold nan",
    ] {
        let before = workshop.listing();
        let (ran, told) = (workshop.line(line), for_programs(&workshop, &arguments(line)));
        assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""), "{line}");
        for message in [&ran.stderr, &told.message] {
            assert_clean(message);
            assert_holds(message, &["nan"]);
        }
        assert!(workshop.listing() == before, "{line}: something was written");
    }
}

#[test]
fn a_negative_option_is_refused_by_its_name() {
    let workshop = workshop();
    refused(
        &workshop,
        &arguments("embed original.obj -o out.obj --key out.key --epsilon -1"),
        &["epsilon", "-1"],
    );
    let line = "detect marked.obj --original original.obj --key mark.key --method paper --registration never --resampling never --threshold -1";
    refused(&workshop, &arguments(line), &["threshold", "-1"]);
}

// Names, pipes and streams.

#[test]
fn paths_with_spaces_quotes_and_other_scripts_work() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("my \"models\"")).unwrap();
    let names = [
        "my \"models\"/a vase.obj",
        "my \"models\"/\u{82b1}\u{74f6} marked.obj",
        "my \"models\"/the 'key'.json",
    ];
    workshop.write(names[0], workshop.read("original.obj"));
    let [input, output, key] = names;
    let answer = workshop.run(["embed", input, "-o", output, "--key", key, "--json"]).json();
    assert_eq!((&answer["output"], &answer["key"]), (&output.into(), &key.into()));
    let found = workshop.run(["detect", output, "--original", input, "--key", key]);
    assert_holds(found.text(), &["FOUND", output]);
    workshop.write("-dash.obj", workshop.read("original.obj"));
    assert!(workshop.run(["info", "--", "-dash.obj"]).text().contains("-dash.obj"));
}

fn not_unicode(name: &[u8]) -> OsString {
    OsStr::from_bytes(name).to_owned()
}

#[test]
fn file_names_that_are_not_unicode_work() {
    let workshop = workshop();
    let [input, output, key] =
        [b"v\xe4se.obj".as_slice(), b"v\xe4se-marked.obj", b"v\xe4se.key"].map(not_unicode);
    workshop.write(&input, workshop.read("original.obj"));
    workshop.run([OsStr::new("info"), &input]).text();
    let json = workshop.run([OsStr::new("info"), &input, OsStr::new("--json")]).json();
    assert_eq!(json["vertices"], 642);
    let words = ["detect", "--original", "--key"].map(OsString::from);
    let [detect, original, with_key] = words;
    let ran = workshop.run([
        OsString::from("embed"),
        input.clone(),
        "-o".into(),
        output.clone(),
        "--key".into(),
        key.clone(),
    ]);
    assert_eq!(ran.status, Some(0), "{}", ran.stderr);
    let found = workshop.run([detect, output.clone(), original, input.clone(), with_key, key]);
    assert_eq!(found.status, Some(0), "{}", found.stderr);
    let attacked = [
        OsString::from("attack"),
        output,
        "-o".into(),
        not_unicode(b"\xff\xfe.obj"),
        "none".into(),
        "--json".into(),
    ];
    let ran = workshop.run(attacked);
    assert_eq!(ran.status, Some(0), "{}", ran.stdout);
    assert!(ran.json()["output"].is_string());
    refused(
        &workshop,
        &[OsString::from("info"), not_unicode(b"mis\xffsing.obj")],
        &["mis", "check the path"],
    );
}

#[test]
fn a_closed_pipe_is_no_reason_to_panic() {
    let workshop = workshop();
    for (line, status) in [
        ("info original.obj", 0),
        ("info original.obj --json", 0),
        (
            "detect marked.obj --original original.obj --key mark.key --method paper --registration never --resampling never",
            0,
        ),
        (
            "detect original.obj --original original.obj --key mark.key --method paper --registration never --resampling never --json",
            1,
        ),
        ("info missing.obj --json", 2),
        ("--help", 0),
        ("embed --help", 0),
        ("--version", 0),
    ] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output =
            workshop.command(arguments(line)).stdout(writer).stderr(Stdio::piped()).output().unwrap();
        assert_eq!(String::from_utf8_lossy(&output.stderr), "", "{line}");
        assert_eq!(output.status.code(), Some(status), "{line}");
    }
}

#[test]
fn an_error_that_nobody_hears_is_still_status_2() {
    let workshop = workshop();
    for line in ["info missing.obj", "info --colour", "embed"] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = workshop.command(arguments(line)).stderr(writer).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{line}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn an_answer_that_cannot_be_written_is_a_failure_with_a_reason() {
    let workshop = workshop();
    for line in ["info original.obj", "info original.obj --json"] {
        let full = std::fs::File::create("/dev/full").unwrap();
        let output = workshop.command(arguments(line)).stdout(full).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{line}");
        let message = String::from_utf8(output.stderr).unwrap();
        assert_clean(&message);
        assert_eq!(message.lines().count(), 1, "{line}: {message:?}");
    }
}

// Sizes and places.

/// Marks `name` and finds the mark again, in numbers that are all finite.
fn assert_whole_story(workshop: &Workshop, name: &str) {
    workshop.write("secret", "cd".repeat(32));
    let embedded = workshop
        .line(&format!("embed {name} -o copy --key copy.key --secret-file secret --force --json"))
        .json();
    assert!(embedded["distortion"].as_object().is_some_and(|d| d.values().all(number)), "{name}: {embedded}");
    let relative = embedded["distortion"]["relative_max"].as_f64().unwrap();
    assert!(relative > 1e-4 && relative < 0.02, "{name}: {relative}");
    workshop.line("attack copy -o noisy noise:amplitude=0.001 --force").text();
    for suspect in ["copy", "noisy"] {
        let ran = workshop
            .line(&format!("detect {suspect} --original {name} --key copy.key --method paper --registration never --resampling never --json"));
        assert_eq!(ran.status, Some(0), "{name}, {suspect}: {}", ran.stdout);
    }
    let apart = workshop.line(&format!("compare {name} copy --json")).json();
    assert!(apart.as_object().unwrap().values().all(number), "{name}: {apart}");
    assert!(apart["relative_hausdorff"].as_f64().is_some_and(|d| d > 0.0 && d < 0.02), "{name}: {apart}");
    let info = workshop.line(&format!("info {name} --json")).json();
    assert!(
        ["area", "volume"]
            .iter()
            .all(|field| info[*field].as_f64().is_some_and(|x| x.is_finite() && x > 0.0)),
        "{info}"
    );
    assert_clean(workshop.line(&format!("info {name}")).text());
}

#[test]
fn any_unit_of_length_will_do() {
    let workshop = Workshop::new(PROGRAM);
    let ball = shapes::bumpy_sphere(650);
    for scale in [1e-12, 1e-6, 1e3, 1e12] {
        let soup = mapped(&ball, |p| p * scale);
        for (name, format) in [
            ("ball.obj", Format::Obj),
            ("ball.ply", Format::PlyBinaryBigEndian),
            ("ball.stl", Format::StlBinary),
        ] {
            workshop.write(name, encode(format, &soup).unwrap());
            assert_whole_story(&workshop, name);
        }
    }
}

#[test]
fn the_unit_of_length_changes_nothing() {
    let workshop = Workshop::new(PROGRAM);
    let ball = shapes::bumpy_sphere(650);
    let capacity_and_mark = |scale: f64| {
        workshop.write("ball.obj", encode(Format::Obj, &mapped(&ball, |p| p * scale)).unwrap());
        let capacity = workshop.line("info ball.obj --json").json()["capacity"].as_u64().unwrap();
        workshop.write("secret", "cd".repeat(32));
        workshop.line("embed ball.obj -o copy.obj --key copy.key --secret-file secret --force").text();
        let answer = workshop.line("compare ball.obj copy.obj --json").json();
        (capacity, answer["relative_rms"].as_f64().unwrap())
    };
    let (capacity, _) = capacity_and_mark(1.0);
    // Powers of two change no digit, so that even ties are broken alike.
    for exponent in [-40, -10, 10, 40] {
        let (scaled, relative_rms) = capacity_and_mark(f64::powi(2.0, exponent));
        assert_eq!(scaled, capacity, "2^{exponent}");
        assert!(relative_rms > 1e-5 && relative_rms < 0.004, "2^{exponent}: {relative_rms}");
    }
}

#[test]
fn far_from_the_origin_a_mark_is_stored_or_refused() {
    let workshop = Workshop::new(PROGRAM);
    let ball = shapes::bumpy_sphere(650);
    let far = mapped(&ball, |p| p + nalgebra::Vector3::new(1e6, -1e6, 1e6));
    workshop.write("far.obj", encode(Format::Obj, &far).unwrap());
    assert_whole_story(&workshop, "far.obj");
    for sample in samples(&far).iter().filter(|sample| !sample.exact) {
        let name = format!("far.{}", sample.extension);
        workshop.write(&name, &sample.bytes);
        let line = format!("embed {name} -o far-copy --key far.key --secret-file secret");
        let ran = workshop.line(&line);
        if ran.status == Some(0) {
            let line = format!(
                "detect far-copy --original {name} --key far.key --method paper --registration never --resampling never"
            );
            assert_eq!(workshop.line(&line).status, Some(0), "{}", sample.name);
            for made in ["far-copy", "far.key"] {
                std::fs::remove_file(workshop.path(made)).unwrap();
            }
        } else {
            refused(&workshop, &arguments(&line), &[&name]);
        }
    }
    // Two metres away from a model of a metre, 32-bit floats are fine.
    let near = mapped(&ball, |p| p + nalgebra::Vector3::new(2.0, -2.0, 2.0));
    workshop.write("near.stl", encode(Format::StlBinary, &near).unwrap());
    assert_whole_story(&workshop, "near.stl");
}

#[test]
fn what_the_floats_of_a_file_cannot_hold_is_refused() {
    let workshop = Workshop::new(PROGRAM);
    // A unit ball a million units away: floats come in steps of 1/16, far coarser than the mark.
    let far = mapped(&shapes::bumpy_sphere(2000), |p| p + nalgebra::Vector3::new(1e6, 1e6, 1e6));
    workshop.write("far.ply", ply(&far, "binary_little_endian", false));
    workshop.write("secret", "cd".repeat(32));
    let line = "embed far.ply -o copy.ply --key copy.key --secret-file secret";
    refused(&workshop, &arguments(line), &["far.ply", "does not survive being stored", "double precision"]);
}

#[test]
fn a_size_beyond_all_numbers_is_not_shown_as_one() {
    let workshop = Workshop::new(PROGRAM);
    let ball = shapes::bumpy_sphere(650);
    for scale in [1e-300, 1e-110, 1e110, 1e160, 1e300] {
        workshop.write("ball.obj", encode(Format::Obj, &mapped(&ball, |p| p * scale)).unwrap());
        let said = workshop.line("info ball.obj");
        assert_clean(said.text());
        assert!(!said.text().contains("inf"), "{}", said.stdout);
        assert_eq!(workshop.line("info ball.obj --json").json()["vertices"], 642);
        // Whatever comes of it, it is an answer or a sentence.
        let embedded = workshop.line("embed ball.obj -o copy.obj --key copy.key");
        assert!(matches!(embedded.status, Some(0 | 2)), "{scale:e}: {}", embedded.stderr);
        assert_clean(&embedded.stderr);
        assert_clean(&embedded.stdout);
    }
}
