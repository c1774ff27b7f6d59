//! Tables as Markdown for people and JSON for programs.

use super::cell::Cell;
use super::paper::{MODELS, ROWS};
use anyhow::Context;
use serde::{Deserialize, Serialize};
use sombrero::basis::BasisFunction;
use std::fmt::Write;
use std::path::Path;

/// A recorded table.
#[derive(Serialize, Deserialize)]
pub(crate) struct Recorded {
    pub(crate) table: u32,
    pub(crate) method: String,
    pub(crate) runs: u64,
    pub(crate) cells: Vec<Cell>,
}

pub(crate) fn write(folder: &Path, runs: u64, table1: &[Cell], table2: &[Cell]) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    for (number, text, cells) in [(1, first(table1), table1), (2, second(table2), table2)] {
        print!("{text}\n");
        let recorded = Recorded { table: number, method: "paper".into(), runs, cells: cells.to_vec() };
        let json = serde_json::to_string_pretty(&recorded)? + "\n";
        for (extension, content) in [("md", &text), ("json", &json)] {
            let path = folder.join(format!("table{number}.{extension}"));
            std::fs::write(&path, content)
                .with_context(|| format!("{} cannot be written", path.display()))?;
        }
    }
    Ok(())
}

/// Ours, and the paper's in brackets; cells where ours is worse are marked.
fn figure(cell: &Cell) -> String {
    let paper = cell.paper_log10_p.map_or(String::new(), |p| match p {
        -38.0 => " (≤ -38)".to_owned(),
        p => format!(" ({p:.0})"),
    });
    let worse = cell.paper_log10_p.is_some_and(|p| cell.median_log10_p > p);
    format!("{:.1}{paper}{}", cell.median_log10_p, if worse { " ▲" } else { "" })
}

fn first(cells: &[Cell]) -> String {
    let mut text = String::from(
        "# Table 1\n\nlog10 of the false-positive probability, median of 5 seeds; the paper's in brackets. ▲: ours is \
         worse. 50 coefficients, ε = 0.01, sombrero. Rows without registration and resampling, correspondence known.\n\n",
    );
    let models: Vec<&str> =
        MODELS.iter().map(|m| m.name).filter(|m| cells.iter().any(|c| c.model == *m)).collect();
    let _ = writeln!(
        text,
        "| row | attack | {} |\n|---|---|{}",
        models.join(" | "),
        "---:|".repeat(models.len())
    );
    for row in ROWS.iter().filter(|row| cells.iter().any(|c| c.row == row.letter)) {
        let figures = models.iter().map(|model| {
            cells.iter().find(|c| c.model == *model && c.row == row.letter).map_or(String::new(), figure)
        });
        let _ =
            writeln!(text, "| {} | {} | {} |", row.letter, row.name, figures.collect::<Vec<_>>().join(" | "));
    }
    let shown = |value: fn(&Cell) -> f64| {
        let cell = |model: &&str| cells.iter().find(|c| c.model == **model).map_or(0.0, value);
        models.iter().map(|m| format!("{:.5}", cell(m))).collect::<Vec<_>>().join(" | ")
    };
    let _ = writeln!(text, "| | largest displacement / largest side | {} |", shown(|c| c.relative_max));
    let _ = writeln!(text, "| | rms displacement / largest side | {} |", shown(|c| c.relative_rms));
    text
}

fn second(cells: &[Cell]) -> String {
    let names = BasisFunction::ALL.map(BasisFunction::name);
    let mut text = format!(
        "# Table 2\n\nlog10 of the false-positive probability by basis function, median of 5 seeds; the paper's in \
         brackets. ▲: ours is worse.\n\n| model | row | {} |\n|---|---|---:|---:|---:|\n",
        names.join(" | ")
    );
    for model in MODELS.iter().map(|m| m.name) {
        for row in &ROWS {
            let cell = |basis: &&str| {
                cells
                    .iter()
                    .find(|c| c.model == model && c.row == row.letter && c.basis == **basis)
                    .map(figure)
            };
            let figures: Vec<String> = names.iter().filter_map(cell).collect();
            if !figures.is_empty() {
                let _ = writeln!(text, "| {model} | {} {} | {} |", row.letter, row.name, figures.join(" | "));
            }
        }
    }
    text
}
