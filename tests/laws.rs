//! Law 1: nothing that computes the extracted coefficients can see the watermark. The crate graph decides.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use serde_json::Value;
use std::collections::BTreeMap;
use std::process::Command;

/// The crates of this workspace that each crate of it depends on, tests left out.
fn graph() -> BTreeMap<String, Vec<String>> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let arguments = ["metadata", "--format-version", "1", "--no-deps", "--offline"];
    let output = Command::new(cargo).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    let name = |package: &Value| package["name"].as_str().unwrap().to_owned();
    let known: Vec<String> = packages.iter().map(name).collect();
    let uses = |package: &Value| -> Vec<String> {
        let dependencies = package["dependencies"].as_array().unwrap().iter();
        dependencies.filter(|d| d["kind"].is_null()).map(name).filter(|d| known.contains(d)).collect()
    };
    packages.iter().map(|package| (name(package), uses(package))).collect()
}

fn reachable(graph: &BTreeMap<String, Vec<String>>, from: &str) -> Vec<String> {
    let mut found = vec![from.to_owned()];
    let mut next = 0;
    while next < found.len() {
        let new: Vec<String> = graph[&found[next]].iter().filter(|d| !found.contains(d)).cloned().collect();
        found.extend(new);
        next += 1;
    }
    found
}

#[test]
fn what_computes_coefficients_cannot_see_the_watermark() {
    let graph = graph();
    let blind_crates = [
        // It computes no coefficients, but a catalogue that knew keys could not be handed to anybody.
        "sombrero-catalogue",
        "sombrero-extraction",
        "sombrero-landmarks",
        "sombrero-registration",
        "sombrero-resampling",
        "sombrero-search",
        "sombrero-stats",
    ];
    for blind in blind_crates {
        let seen = reachable(&graph, blind);
        for secret in ["sombrero-watermark", "sombrero-attacks", "sombrero"] {
            assert!(!seen.iter().any(|name| name == secret), "{blind} reaches {secret} through {seen:?}");
        }
    }
    // The graph is read at all: the front door brings both sides together.
    let door = reachable(&graph, "sombrero");
    assert!(["sombrero-watermark", "sombrero-search"].iter().all(|name| door.iter().any(|d| d == name)));
}

/// What is kept is bytes: no key is looked into where it is stored.
#[test]
fn the_vault_knows_no_key() {
    let seen = reachable(&graph(), "sombrero-vault");
    assert!(!seen.iter().any(|name| name == "sombrero-watermark"), "{seen:?}");
}

#[test]
fn statistics_know_no_mesh() {
    assert_eq!(reachable(&graph(), "sombrero-stats"), ["sombrero-stats"]);
}
