//! `cargo xtask ci`: each step as a person would type it.

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
    step("cargo clippy --workspace --all-targets -- -D warnings", &[])?;
    step(TEST_COMMAND, &[])?;
    step("cargo doc --workspace --no-deps", &[("RUSTDOCFLAGS", "-D warnings")])?;
    step(MAIN_COMMAND, &[])?;
    if knows_trimesh() {
        step("python3 tests/trimesh/roundtrip.py target/release/sombrero", &[])?;
    } else {
        println!("== no trimesh: files were not checked by an independent reader");
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
