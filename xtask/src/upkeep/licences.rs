//! The licences of all crates that go into what is handed out.

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

/// A page with one row for each foreign crate that these packages of ours are built of on this platform and in browsers.
pub(super) fn page(packages: &[&str]) -> anyhow::Result<String> {
    Ok(rows(
        &super::metadata(&["--filter-platform", &super::host()?, "--filter-platform", super::page::WASM])?,
        packages,
    ))
}

fn rows(metadata: &Value, packages: &[&str]) -> String {
    let known: BTreeMap<&str, &Value> =
        list(&metadata["packages"]).iter().map(|package| (text(&package["id"]), package)).collect();
    let nodes: BTreeMap<&str, &Value> =
        list(&metadata["resolve"]["nodes"]).iter().map(|node| (text(&node["id"]), node)).collect();
    let mut waiting: Vec<&str> =
        known.values().filter(|p| packages.contains(&text(&p["name"]))).map(|p| text(&p["id"])).collect();
    let mut found = BTreeSet::new();
    while let Some(id) = waiting.pop() {
        if found.insert(id)
            && let Some(node) = nodes.get(id)
        {
            waiting.extend(list(&node["deps"]).iter().filter(|d| goes_in(d)).map(|d| text(&d["pkg"])));
        }
    }
    // Ours have no source.
    let foreign = found.iter().filter_map(|id| known.get(id)).filter(|package| !package["source"].is_null());
    let mut rows: Vec<[&str; 4]> =
        foreign.map(|p| ["name", "version", "license", "repository"].map(|field| text(&p[field]))).collect();
    rows.sort_unstable();
    let mut page = format!("{HEAD}\n| crate | version | licence | source |\n|---|---|---|---|\n");
    for [name, version, licence, source] in rows {
        // Writing to a string cannot fail.
        let _ = writeln!(page, "| {name} | {version} | {licence} | {source} |");
    }
    page
}

const HEAD: &str = "# Licences\n\nsombrero is licensed under MIT or Apache-2.0, at your option. Reports embed three.js (MIT). \
The following crates are built into it, each under its own licence.\n";

/// Whether a dependency is built in: not those of tests or of build scripts alone.
fn goes_in(dependency: &Value) -> bool {
    list(&dependency["dep_kinds"]).iter().any(|kind| kind["kind"].is_null())
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_goes_in_is_listed_and_nothing_else() {
        let package = |name: &str, source: Value| json!({ "id": name, "name": name, "version": "1.0.0", "license": "MIT", "repository": "r", "source": source });
        let node = |id: &str, deps: &[(&str, Value)]| {
            let deps: Vec<Value> =
                deps.iter().map(|(to, kind)| json!({ "pkg": to, "dep_kinds": [{ "kind": kind }] })).collect();
            json!({ "id": id, "deps": deps })
        };
        let foreign = || json!("registry");
        let metadata = json!({
            "packages": [package("ours", Value::Null), package("a", foreign()), package("b", foreign()), package("tests", foreign())],
            "resolve": { "nodes": [
                node("ours", &[("a", Value::Null), ("tests", json!("dev"))]),
                node("a", &[("b", Value::Null)]), node("b", &[]), node("tests", &[]),
            ] },
        });
        let page = rows(&metadata, &["ours"]);
        let rows: Vec<&str> = page.lines().filter(|line| line.ends_with(" r |")).collect();
        assert_eq!(rows, ["| a | 1.0.0 | MIT | r |", "| b | 1.0.0 | MIT | r |"]);
    }
}
