//! Tables as Markdown for people and JSON for programs.

use super::beyond::BEYOND;
use super::cell::Cell;
use super::paper::{MODELS, ROWS, Row};
use super::times::{STAGES, Times};
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

pub(crate) fn write(
    folder: &Path,
    method: &str,
    runs: u64,
    [table1, table2, beyond]: [&[Cell]; 3],
    table3: &[Times],
) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    let recorded = |table, cells: &[Cell]| {
        let cells = cells.to_vec();
        serde_json::to_string_pretty(&Recorded { table, method: method.into(), runs, cells })
    };
    let times = serde_json::json!({ "table": 3, "stages": STAGES, "models": table3 });
    let mut tables = vec![
        ("table1", first(method, runs, table1), recorded(1, table1)?),
        ("table2", second(runs, table2), recorded(2, table2)?),
        ("table3", third(table3), serde_json::to_string_pretty(&times)?),
    ];
    if !beyond.is_empty() {
        tables.push(("beyond", further(method, runs, beyond), recorded(4, beyond)?));
    }
    for (name, text, json) in tables {
        println!("{text}");
        for (extension, content) in [("md", text), ("json", json + "\n")] {
            let path = folder.join(format!("{name}.{extension}"));
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

/// What the figures are, in words.
fn median_of(runs: u64) -> String {
    match runs {
        1 => "of one seed".to_owned(),
        _ => format!("median of {runs} seeds"),
    }
}

fn first(method: &str, runs: u64, cells: &[Cell]) -> String {
    let how = match method {
        "paper" => {
            "50 coefficients, ε = 0.01, sombrero, `--method paper`: registered and resampled where the paper did so."
        }
        "faithful" => {
            "The preset faithful, `--method robust`, which is told nothing about the attack; corrected for all variants tried."
        }
        _ => {
            "The robust preset at the paper's root mean square displacement, `--method robust`, which is told nothing \
              about the attack; corrected for all variants tried."
        }
    };
    let mut text = format!(
        "# Table 1\n\nlog10 of the false-positive probability, {}; the paper's in brackets. ▲: ours is \
         worse. {how} Rows K and O know the correspondence, as the paper did; K' and O' do not.\n\n",
        median_of(runs)
    );
    rows(&mut text, ROWS.iter(), cells);
    text
}

fn further(preset: &str, runs: u64, cells: &[Cell]) -> String {
    let mut text = format!(
        "# Beyond the paper's table\n\nlog10 of the false-positive probability, {}, preset {preset}, robust method. Nothing is \
         known about the suspect: no vertex, no pose, no scale.\n\n",
        median_of(runs)
    );
    rows(&mut text, BEYOND.iter(), cells);
    text
}

/// One line a row, one column a model, and the displacements.
fn rows<'a>(text: &mut String, all: impl Iterator<Item = &'a Row>, cells: &[Cell]) {
    let models: Vec<&str> =
        MODELS.iter().map(|m| m.name).filter(|m| cells.iter().any(|c| c.model == *m)).collect();
    let _ = writeln!(
        text,
        "| row | attack | {} |\n|---|---|{}",
        models.join(" | "),
        "---:|".repeat(models.len())
    );
    for row in all.filter(|row| cells.iter().any(|c| c.row == row.letter)) {
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
}

fn second(runs: u64, cells: &[Cell]) -> String {
    let names = BasisFunction::PROFILES.map(BasisFunction::name);
    let mut text = format!(
        "# Table 2\n\nlog10 of the false-positive probability by basis function, {}; the paper's in brackets. ▲: ours \
         is worse.\n\n| model | row | {} |\n|---|---|---:|---:|---:|\n",
        median_of(runs),
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

fn third(times: &[Times]) -> String {
    let mut text = String::from(
        "# Table 3\n\nSeconds by stage, one run each on two cores of a shared machine. The paper has minutes on a 195 \
         MHz R10000, of which only two survive: 24 for the bunny's conversion, 15 for a resampling.\n\n",
    );
    let names = times.iter().map(|t| format!("{} ({} vertices)", t.model, t.vertices)).collect::<Vec<_>>();
    let _ = writeln!(text, "| stage | {} |\n|---|{}", names.join(" | "), "---:|".repeat(times.len()));
    for (i, stage) in STAGES.iter().enumerate() {
        let seconds = times.iter().map(|t| format!("{:.3}", t.seconds[i])).collect::<Vec<_>>();
        let _ = writeln!(text, "| {stage} | {} |", seconds.join(" | "));
    }
    text
}
