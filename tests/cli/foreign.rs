//! Foreign text: names, recipients, owners and programs that try to be more than a part of a line.

use super::shared::{assert_holds, workshop};
use serde_json::Value;
use sombrero_tests::{Ran, Workshop};
use std::ffi::OsString;

/// A line that we never said, a terminal that is cleared, and a reading direction that is turned.
const EVIL: &str = "x\nSAID: by us\r\u{1b}[2J\u{9b}A\u{202e}jbo\u{2066}\u{2028}y";
/// The same as people may see it.
const SHOWN: &str = r"x\u{a}SAID: by us\u{d}\u{1b}[2J\u{9b}A\u{202e}jbo\u{2066}\u{2028}y";

/// Status and lines of a run, after checking that nothing but line ends moves a terminal.
fn lines(ran: &Ran) -> (Option<i32>, Vec<&str>) {
    let misleading = |c: char| c.is_control() || "\u{2028}\u{202e}\u{2066}".contains(c);
    let lines: Vec<&str> = ran.stdout.split('\n').chain(ran.stderr.split('\n')).collect();
    for line in &lines {
        assert!(!line.contains(misleading), "{line:?}");
        assert!(!line.starts_with("SAID"), "{line:?}");
    }
    (ran.status, lines)
}

fn run(workshop: &Workshop, arguments: &[&str]) -> Ran {
    workshop.run(arguments.iter().map(OsString::from))
}

/// Runs it for people, who must see `SHOWN`, and for programs, who get `EVIL` itself somewhere.
fn shown(workshop: &Workshop, arguments: &[&str], status: i32) -> Value {
    let ran = run(workshop, arguments);
    let (code, lines) = lines(&ran);
    assert_eq!(code, Some(status), "{arguments:?}: {}{}", ran.stdout, ran.stderr);
    assert!(lines.iter().any(|line| line.contains(SHOWN)), "{arguments:?}: {lines:?}");
    let json = run(workshop, &[arguments, &["--json"]].concat());
    serde_json::from_str(&json.stdout).unwrap_or_else(|e| panic!("{arguments:?}: {e}: {}", json.stdout))
}

#[test]
fn names_of_files_stay_in_their_line() {
    let workshop = workshop();
    let name = format!("{EVIL}.obj");
    let told = shown(&workshop, &["info", &name], 2);
    assert_holds(told["error"]["message"].as_str().unwrap(), &[EVIL]);
    workshop.write(&name, workshop.read("marked.obj"));
    shown(&workshop, &["info", &name], 0);
    let looked = shown(&workshop, &["detect", &name, "--original", "original.obj", "--key", "mark.key"], 0);
    assert_eq!(looked["suspect"], name.as_str());
    shown(&workshop, &["compare", "original.obj", &name], 0);
    let several = ["detect", &name, "missing.obj", "--original", "original.obj", "--key", "mark.key"];
    lines(&run(&workshop, &several));
}

#[test]
fn owners_and_recipients_stay_in_their_line() {
    let workshop = workshop();
    let marked = ["embed", "original.obj", "-o", "new.obj", "--key", "new.key"];
    let whose = ["--owner", EVIL, "--recipient", EVIL, "--secret-file", "secret"];
    assert_eq!(lines(&run(&workshop, &[&marked[..], &whose].concat())).0, Some(0));
    let verified = shown(&workshop, &["verify", "new.key", "--original", "original.obj"], 0);
    assert_eq!((&verified["owner"], &verified["recipient"]), (&EVIL.into(), &EVIL.into()));
    std::fs::create_dir(workshop.path("keys")).unwrap();
    workshop.write("keys/new.key", workshop.read("new.key"));
    let traced = shown(&workshop, &["trace", "new.obj", "--original", "original.obj", "--keys", "keys"], 0);
    assert_eq!(traced["recipients"][0]["recipient"], EVIL);
}

#[test]
fn lists_of_buyers_stay_in_their_lines() {
    let workshop = workshop();
    let list = |text: &str| workshop.write("buyers.csv", text);
    let line = ["embed", "original.obj", "--recipients", "buyers.csv", "--out-dir", "copies"];
    list(&format!("recipient\n\"{EVIL}\"\n\"{EVIL}\"\n"));
    shown(&workshop, &line, 2);
    list(&format!("recipient\n\"{EVIL}\"\n"));
    let all = [&line[..], &["--secret-file", "secret"]].concat();
    assert_eq!(lines(&run(&workshop, &all)).0, Some(0));
    // Another one's copy is in the way, which is told with the recipient's text.
    let other = [&all[..], &["--owner", "another"]].concat();
    let told = shown(&workshop, &other, 2);
    assert_eq!(told["copies"][0]["recipient"], EVIL);
}

#[test]
fn what_a_report_says_stays_in_its_line() {
    let workshop = workshop();
    let ran = workshop.line("detect marked.obj --original original.obj --key mark.key --json");
    let mut record = ran.json();
    record["program"] = EVIL.into();
    record["method"] = EVIL.into();
    workshop.write("report.json", record.to_string());
    let told = shown(&workshop, &["verify", "report.json"], 1);
    assert_eq!((&told["program"], &told["differences"][0]["recorded"]), (&EVIL.into(), &EVIL.into()));
}

#[test]
fn what_was_typed_stays_in_its_line() {
    let workshop = workshop();
    for arguments in
        [&["info", "--threads", EVIL][..], &[EVIL], &["attack", "original.obj", "-o", "a.obj", EVIL]]
    {
        assert_eq!(lines(&run(&workshop, arguments)).0, Some(2), "{arguments:?}");
    }
}
