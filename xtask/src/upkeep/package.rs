//! `cargo xtask package`: the crates that are published, lowest first, and whether each can be packaged.

use anyhow::{Context, bail};
use serde_json::Value;
use std::collections::BTreeMap;
use std::process::Command;

pub(crate) fn run() -> anyhow::Result<()> {
    let order = in_order()?;
    println!("in this order: {}", order.join(", "));
    // All at once: a crate is checked against the packages of those below it, which no registry has yet.
    let mut command = Command::new("cargo");
    command.args(["package", "--locked", "--allow-dirty", "--no-verify"]);
    command.args(order.iter().flat_map(|name| ["--package", name]));
    if !command.status()?.success() {
        bail!("a crate cannot be packaged");
    }
    Ok(())
}

/// Names of the published crates, each after those that it depends on.
pub(crate) fn in_order() -> anyhow::Result<Vec<String>> {
    order(&published()?)
}

/// Published crates of this workspace, each with those of them that it depends on; tests left out.
fn published() -> anyhow::Result<BTreeMap<String, Vec<String>>> {
    let metadata = super::metadata(&["--no-deps", "--offline"])?;
    let name = |value: &Value| value["name"].as_str().unwrap_or_default().to_owned();
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let packages = list(&metadata["packages"]);
    let kept: Vec<&Value> = packages.iter().filter(|package| package["publish"].is_null()).collect();
    let names: Vec<String> = kept.iter().map(|package| name(package)).collect();
    let uses = |package: &Value| {
        let normal = list(&package["dependencies"]).into_iter().filter(|d| d["kind"].is_null());
        normal.map(|d| name(&d)).filter(|d| names.contains(d)).collect()
    };
    Ok(kept.iter().map(|package| (name(package), uses(package))).collect())
}

/// Each crate after all that it depends on, by name where either would do.
fn order(graph: &BTreeMap<String, Vec<String>>) -> anyhow::Result<Vec<String>> {
    let mut order: Vec<String> = Vec::new();
    while order.len() < graph.len() {
        let free =
            graph.iter().find(|(name, uses)| !order.contains(name) && uses.iter().all(|d| order.contains(d)));
        order.push(free.context("the crates depend on each other in a circle")?.0.clone());
    }
    Ok(order)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_crate_comes_after_what_it_depends_on() {
        let graph = published().unwrap_or_default();
        let order = order(&graph).unwrap_or_default();
        assert!(order.len() > 10, "{order:?}");
        let place = |name: &String| order.iter().position(|other| other == name);
        assert!(graph.iter().all(|(name, uses)| uses.iter().all(|d| place(d) < place(name))));
    }

    #[test]
    fn a_circle_is_told() {
        let circle = [("a", "b"), ("b", "a")].map(|(name, uses)| (name.to_owned(), vec![uses.to_owned()]));
        assert!(order(&circle.into()).is_err());
    }
}
