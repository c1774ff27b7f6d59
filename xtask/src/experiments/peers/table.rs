//! The measurements as JSON, and as a table in the document between two comments.

use super::measure::{OURS, Row};
use anyhow::Context;
use serde_json::Value;
use std::path::Path;

const BEGIN: &str = "<!-- begin: cargo xtask bench-peers -->";
const END: &str = "<!-- end: cargo xtask bench-peers -->";

/// Replaces the rows of the stages and models that were measured now, and keeps the others.
pub(crate) fn write(document: &Path, measured: Vec<Row>) -> anyhow::Result<()> {
    let data = document.with_extension("json");
    let same = |a: &Row, b: &Row| a.stage == b.stage && a.model == b.model;
    let mut rows: Vec<Row> = match std::fs::read(&data) {
        Ok(bytes) => serde_json::from_slice(&bytes).with_context(|| data.display().to_string())?,
        Err(_) => Vec::new(),
    };
    rows.retain(|old| !measured.iter().any(|new| same(old, new)));
    rows.extend(measured);
    // A row without figures comes last in its group.
    let order = |r: &Row| (r.stage.clone(), r.model == "big", r.error.is_some());
    rows.sort_by(|a, b| order(a).cmp(&order(b)).then(a.cpu.total_cmp(&b.cpu)));
    std::fs::write(&data, serde_json::to_string_pretty(&rows)? + "\n")?;
    let table = table(&rows);
    print!("{table}");
    let text = std::fs::read_to_string(document).with_context(|| document.display().to_string())?;
    let (before, rest) = text.split_once(BEGIN).context("the document has no place for the table")?;
    let (_, after) = rest.split_once(END).context("the place for the table does not end")?;
    Ok(std::fs::write(document, format!("{before}{BEGIN}\n\n{table}\n{END}{after}"))?)
}

fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| stage | model | who | version | wall s | CPU s | CPU, ours = 1 | memory MB | answer |\n|---|---|---|---|--:|--:|--:|--:|---|\n",
    );
    for row in rows {
        let name = if row.peer.starts_with(OURS) { format!("**{}**", row.peer) } else { row.peer.clone() };
        let head = format!("| {} | {} | {name} | {} ", row.stage, row.model, row.version);
        let line = match &row.error {
            Some(error) => format!("| - | - | - | - | {} |", error.replace('|', "/")),
            None => format!(
                "| {:.3} | {:.3} | {} | {} | {} |",
                row.median,
                row.cpu,
                ratio(row, rows),
                row.extra_mb.map_or_else(String::new, |mb| format!("{mb:.0}")),
                answer(row)
            ),
        };
        text += &(head + &line + "\n");
    }
    text
}

/// How many times our CPU time the row took, by our fastest row of the same stage and model.
fn ratio(row: &Row, rows: &[Row]) -> String {
    let ours =
        rows.iter().filter(|o| o.stage == row.stage && o.model == row.model && o.peer.starts_with(OURS));
    match ours.map(|o| o.cpu).min_by(f64::total_cmp) {
        Some(ours) if ours > 0.0 => format!("{:.1}", row.cpu / ours),
        _ => String::new(),
    }
}

fn answer(row: &Row) -> String {
    let number = |value: &Value| match value.as_f64() {
        Some(x) if x != 0.0 && (x.abs() < 1e-2 || x.abs() >= 1e7) => format!("{x:.1e}"),
        Some(x) if x.fract() != 0.0 => format!("{x:.3}"),
        _ => value.to_string(),
    };
    row.acc.iter().map(|(name, value)| format!("{name} {}", number(value))).collect::<Vec<_>>().join(", ")
}
