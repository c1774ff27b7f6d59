//! `cargo xtask tables --check`: fails where a recomputed cell is worse than the recorded one.

use super::cell::Cell;
use super::paper::Row;
use super::show::Recorded;
use anyhow::{Context, bail};
use std::path::Path;

/// Recomputation gives the same figures on the same code; a change of the method may cost this many orders
/// of magnitude before CI asks for the tables to be recorded again.
const TOLERANCE: f64 = 1.0;

/// Rows that take CI seconds, not minutes.
pub(crate) fn is_quick(row: &Row) -> bool {
    !row.registration && !row.resampling
}

pub(crate) fn check(folder: &Path, table1: &[Cell], table2: &[Cell]) -> anyhow::Result<()> {
    let mut worse = Vec::new();
    let mut compared = 0;
    for (number, cells) in [(1, table1), (2, table2)] {
        let path = folder.join(format!("table{number}.json"));
        let text = std::fs::read(&path).with_context(|| format!("{} cannot be read", path.display()))?;
        let recorded: Recorded =
            serde_json::from_slice(&text).with_context(|| format!("{} is damaged", path.display()))?;
        for cell in cells {
            let same = |c: &&Cell| c.model == cell.model && c.row == cell.row && c.basis == cell.basis;
            let Some(before) = recorded.cells.iter().find(same) else {
                worse.push(format!(
                    "table {number}, {} {} {}: not recorded",
                    cell.model, cell.row, cell.basis
                ));
                continue;
            };
            compared += 1;
            let (now, then) = (cell.median_log10_p, before.median_log10_p);
            // Beyond -100 the figure measures rounding, and nobody needs it.
            if now.max(-100.0) > then.max(-100.0) + TOLERANCE {
                worse.push(format!(
                    "table {number}, {} {} {}: {now:.1}, recorded {then:.1}",
                    cell.model, cell.row, cell.basis
                ));
            }
        }
    }
    if worse.is_empty() {
        println!("{compared} cells as recorded, or better");
        return Ok(());
    }
    bail!("worse than recorded by more than {TOLERANCE}:\n  {}", worse.join("\n  "))
}
