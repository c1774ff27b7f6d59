//! `cargo xtask ci`: each step as a person would type it.

use super::page::{self, WASM};
use crate::experiments::tables::{Method, Tables};
use anyhow::{Context, bail};
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// The README's two commands stand here as they stand there; a test compares them.
pub(crate) const TEST_COMMAND: &str = "cargo test --workspace";
pub(crate) const MAIN_COMMAND: &str = "cargo run --release --bin sombrero -- demo --force";

pub(crate) fn run(models: &Path) -> anyhow::Result<()> {
    step("cargo fmt --all --check", &[])?;
    super::tidy::run()?;
    step("cargo clippy --workspace --all-targets -- -D warnings", &[])?;
    step(TEST_COMMAND, &[])?;
    step("cargo doc --workspace --no-deps", &[("RUSTDOCFLAGS", "-D warnings")])?;
    step("cargo check --manifest-path fuzz/Cargo.toml --target-dir target", &[])?;
    println!("== the page for browsers");
    let start = Instant::now();
    match page::check(RELEASE)? {
        // It is built of the library crates, which need no other check then.
        Ok(()) => println!("== {:.0} s", start.elapsed().as_secs_f64()),
        Err(why) => {
            println!("== {why}: the page was not visited");
            if page::has_target() {
                step(&wasm_check()?, &[])?;
            } else {
                println!("== no target {WASM}: nothing was checked for it (`rustup target add {WASM}`)");
            }
        }
    }
    for (tool, line) in UPKEEP {
        if has(tool) {
            step(line, &[])?;
        } else {
            println!("== no {tool}: `{line}` was not run");
        }
    }
    let program = if RELEASE { "target/release/sombrero" } else { "target/debug/sombrero-under-test" };
    if RELEASE {
        step(MAIN_COMMAND, &[])?;
    } else {
        println!("== no release build: the main command was run by the tests alone");
    }
    if knows_trimesh() {
        step(&format!("python3 tests/trimesh/roundtrip.py {program}"), &[])?;
    } else {
        println!("== no trimesh: files were not checked by an independent reader");
    }
    println!("== the Python package");
    let start = Instant::now();
    match super::python::check(RELEASE)? {
        Ok(()) => println!("== {:.0} s", start.elapsed().as_secs_f64()),
        Err(why) => println!("== {why}: the Python package was not checked"),
    }
    if models.join("fandisk.obj").exists() {
        for method in [Method::Paper, Method::Robust] {
            crate::experiments::tables::run(&Tables::check(method), models)?;
        }
    } else {
        println!("== no models in {}: the tables were not checked", models.display());
    }
    Ok(())
}

/// Whether this program was built for release, as `cargo xtask` builds it. Building everything for the tests and for release
/// takes a quarter of CI's time.
const RELEASE: bool = !cfg!(debug_assertions);

/// Checks of others, run where they are installed. Advisories need a network and are the forge's business.
const UPKEEP: [(&str, &str); 3] = [
    ("cargo-deny", "cargo deny check bans licenses sources"),
    ("typos", "typos"),
    ("cargo-machete", "cargo machete"),
];

/// What cannot run in a browser: the command, signatures, which need a C compiler, and what is kept in folders.
const NOT_FOR_WASM: [&str; 4] =
    ["sombrero-cli", "sombrero-timestamp", "sombrero-catalogue", "sombrero-vault"];

fn has(tool: &str) -> bool {
    Command::new(tool).arg("--version").output().is_ok_and(|done| done.status.success())
}

fn wasm_check() -> anyhow::Result<String> {
    let crates = super::package::in_order()?;
    let kept = crates.iter().filter(|name| !NOT_FOR_WASM.contains(&name.as_str()));
    let packages: String = kept.map(|name| format!(" --package {name}")).collect();
    Ok(format!("cargo check --target {WASM}{packages} --package sombrero-web"))
}

fn knows_trimesh() -> bool {
    let import = Command::new("python3").args(["-c", "import trimesh"]).output();
    import.is_ok_and(|done| done.status.success())
}

fn step(line: &str, environment: &[(&str, &str)]) -> anyhow::Result<()> {
    println!("== {line}");
    let start = Instant::now();
    let mut words = line.split(' ');
    let program = words.next().context("a command has a first word")?;
    let status = Command::new(program).args(words).envs(environment.iter().copied()).status();
    if !status.with_context(|| format!("{program} cannot be started"))?.success() {
        bail!("`{line}` failed");
    }
    println!("== {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_readme_gives_the_commands_that_ci_runs() {
        let readme = include_str!("../../../README.md");
        for command in [TEST_COMMAND, MAIN_COMMAND] {
            assert!(readme.lines().any(|line| line == command), "the README has no line `{command}`");
        }
    }
}
