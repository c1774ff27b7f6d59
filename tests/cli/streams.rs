//! Names, pipes and streams.

use super::shared::{arguments, assert_clean, assert_holds, refused, workshop};
use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;
use std::process::Stdio;

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
