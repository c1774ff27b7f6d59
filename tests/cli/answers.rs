//! What commands say when all goes well.

use super::shared::{
    Field, PROGRAM, assert_clean, assert_fields, assert_holds, count, no, null, number, object, text, texts,
    workshop, yes,
};
use serde_json::Value;
use sombrero::shapes;
use sombrero_tests::{Workshop, flat_sheet, off, ply};

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
        &["original.obj", "a.obj", "a.key", "642 vertices", "coefficients", "field basis", "log10 p"],
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
            ("coefficients", |v| v.as_u64().is_some_and(|m| (16..=1024).contains(&m))),
            ("epsilon", |v| v == 0.0038),
            ("basis", |v| v == "field"),
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
