//! `cargo xtask tidy`: the repository's own rules, read off the files that git tracks.

use anyhow::{Context, bail};
use std::path::Path;
use std::process::Command;

/// Lines that a file of code may have, tests left out.
const LONGEST: usize = 500;

/// What no tracked file may hold, and why. Put together here, so that this file does not hold it itself.
fn forbidden() -> Vec<(String, &'static str)> {
    let joined = |a: &str, b: &str| format!("{a}{b}");
    vec![
        (joined("todo", "!("), "a stub"),
        (joined("unimplemented", "!("), "a stub"),
        (joined("dbg", "!("), "a leftover of debugging"),
        (joined("#[ign", "ore"), "a test that is not run"),
        (joined("/ro", "ot/"), "a path of one machine"),
    ]
}

pub(crate) fn run() -> anyhow::Result<()> {
    let mut faults = Vec::new();
    for path in tracked()? {
        let Ok(text) = std::fs::read_to_string(&path) else { continue };
        faults.extend(faults_of(&path, &text));
    }
    for fault in &faults {
        println!("{fault}");
    }
    if !faults.is_empty() {
        bail!("{} places break a rule of the repository", faults.len());
    }
    Ok(())
}

fn tracked() -> anyhow::Result<Vec<String>> {
    let output = Command::new("git").args(["ls-files", "*.rs", "*.md", "*.toml", "*.py"]).output()?;
    if !output.status.success() {
        bail!("git cannot list the files");
    }
    Ok(String::from_utf8(output.stdout).context("names of files")?.lines().map(str::to_owned).collect())
}

fn faults_of(path: &str, text: &str) -> Vec<String> {
    let mut faults = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let found = forbidden().into_iter().filter(|(what, _)| line.contains(what));
        faults.extend(found.map(|(what, why)| format!("{path}:{number}: `{what}` is {why}")));
    }
    let length = text.lines().take_while(|line| *line != "#[cfg(test)]").count();
    if is_code(path) && length > LONGEST {
        faults.push(format!("{path}: {length} lines; cut it by idea, {LONGEST} are the most"));
    }
    faults
}

/// Code outside of tests and benches.
fn is_code(path: &str) -> bool {
    let rust = Path::new(path).extension().is_some_and(|e| e == "rs");
    let test = path.starts_with("tests/") || path.contains("/tests/") || path.ends_with("/tests.rs");
    rust && !test && !path.starts_with("benches/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_rule_is_seen_when_it_is_broken() {
        for (what, _) in forbidden() {
            assert_eq!(
                faults_of("crates/a/src/lib.rs", &format!("fn a() {{}}\n{what}\n")).len(),
                1,
                "{what}"
            );
        }
        let long = "fn a() {}\n".repeat(LONGEST + 1);
        assert_eq!(faults_of("crates/a/src/lib.rs", &long).len(), 1);
        assert!(faults_of("crates/a/src/tests.rs", &long).is_empty());
        let tested =
            format!("{}#[cfg(test)]\n{}", "fn a() {}\n".repeat(LONGEST), "fn b() {}\n".repeat(LONGEST));
        assert!(faults_of("crates/a/src/lib.rs", &tested).is_empty());
    }
}
