//! What keeps the repository in order.

mod blender;
pub(crate) mod ci;
pub(crate) mod dist;
pub(crate) mod hostile;
mod licences;
pub(crate) mod models;
pub(crate) mod package;
mod page;
mod python;
pub(crate) mod tidy;

use anyhow::Context;
use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;

/// What cargo knows of the workspace.
fn metadata(arguments: &[&str]) -> anyhow::Result<Value> {
    let output = Command::new("cargo")
        .args(["metadata", "--format-version", "1", "--locked"])
        .args(arguments)
        .output()?;
    serde_json::from_slice(&output.stdout).context("cargo metadata")
}

/// The folder where cargo builds.
fn target() -> anyhow::Result<PathBuf> {
    let metadata = metadata(&["--no-deps"])?;
    Ok(PathBuf::from(metadata["target_directory"].as_str().context("cargo names no target directory")?))
}

/// The platform that is built for, as rustc calls it.
fn host() -> anyhow::Result<String> {
    let said = Command::new("rustc").arg("-vV").output()?;
    let said = String::from_utf8(said.stdout).context("rustc -vV")?;
    let host = said.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(host.context("rustc names no host")?.to_owned())
}
