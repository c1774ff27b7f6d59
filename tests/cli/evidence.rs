//! Verification, the demo, reports and pictures.

use super::shared::{
    PROGRAM, arguments, assert_clean, assert_fields, assert_holds, number, refused, workshop, yes,
};
use sombrero_tests::Workshop;

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
    let answer = workshop.line("demo -o show --json").json();
    let rows = answer["rows"].as_array().unwrap();
    assert!(rows.iter().all(|row| number(&row["log10_p"])), "{rows:?}");
    // As the README shows it.
    let table = include_str!("../../README.md").lines().skip_while(|line| !line.starts_with("log10 p  "));
    let of = |model: &'static str| rows.iter().filter(move |row| row["model"] == model);
    for ((part, bust), line) in of("part").zip(of("bust")).zip(table.skip(1)) {
        let shown = line.strip_prefix(part["suspect"].as_str().unwrap()).unwrap_or_default();
        let figures: Vec<&str> = shown.split_whitespace().step_by(2).collect();
        assert_eq!(figures, [part, bust].map(|row| format!("{:.1}", row["log10_p"].as_f64().unwrap() + 0.0)));
    }
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

    // Without seconds, so that they are the same whenever they are made, whatever the threads; they hold all the same.
    for report in ["part-report.html", "bust-report.html"] {
        let verified = workshop.line(&format!("verify show/{report} --threads 1"));
        assert_holds(verified.text(), &["HOLDS: ", "every byte of its page"]);
    }
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

/// Readers of JSON differ in which of two fields of one name counts.
#[test]
fn a_report_with_a_field_twice_is_refused() {
    let workshop = workshop();
    let line = "detect marked.obj --original original.obj --key mark.key --report page.html --json";
    let json = workshop.line(line).stdout;
    workshop.write("sound.json", &json);
    assert_holds(workshop.line("verify sound.json").text(), &["HOLDS: "]);
    let page = String::from_utf8(workshop.read("page.html")).unwrap();
    for (was, twice, field) in [
        ("\"detected\":true", "\"detected\":false,\"detected\":true", "detected"),
        ("\"threshold\":", "\"threshold\":1.0,\"threshold\":", "threshold"),
        ("\"convinces\":", "\"convinces\":\"nobody\",\"convinces\":", "claim.convinces"),
        ("\"path\":", "\"path\":\"other.obj\",\"path\":", "path"),
    ] {
        for (name, text) in [("twice.json", &json), ("twice.html", &page)] {
            assert!(text.contains(was), "{was}");
            workshop.write(name, text.replacen(was, twice, 1));
            let told = ["the field", field, "is there twice", name];
            assert_eq!(refused(&workshop, &arguments(&format!("verify {name}")), &told), "report");
        }
    }
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
