//! The table and the plot.

use super::Record;
use super::measure::Asked;
use super::queries::Class;
use crate::experiments::plot::{self, Axis, Panel, Series};
use plotters::chart::SeriesLabelPosition;
use std::fmt::Write;
use std::path::Path;

pub(super) fn write(out: &Path, record: &Record) -> anyhow::Result<()> {
    plot::write(&out.join("catalogue.svg"), (760, 560), &[panel(record)])?;
    std::fs::write(out.join("catalogue.md"), markdown(record))?;
    Ok(std::fs::write(out.join("catalogue.json"), serde_json::to_string_pretty(record)? + "\n")?)
}

/// Whether two originals are of one family, or the same.
fn akin(a: &str, b: &str) -> bool {
    a == b
        || (a.starts_with("generated ")
            && b.starts_with("generated ")
            && a[..a.len() - 1] == b[..b.len() - 1])
}

fn share(of: &[&Asked], which: impl Fn(&Asked) -> bool) -> f64 {
    of.iter().filter(|asked| which(asked)).count() as f64 / of.len().max(1) as f64
}

fn markdown(record: &Record) -> String {
    let Record { generated, real, entries, megabytes, bytes_an_entry, open_seconds, peak_megabytes, .. } =
        record;
    let mut text = format!(
        "# How often the right model is found\n\nWritten by `cargo xtask catalogue`. {generated} generated originals in families \
         of ten (the first, three whose sizes and places differ by up to 3 %, three by up to 10 %, two with one more hole or \
         boss, the mirror image) and {real} real ones; {entries} entries, {megabytes:.0} MB, {bytes_an_entry:.0} bytes an \
         entry. Opened in {open_seconds:.2} s; {peak_megabytes:.0} MB of memory at most, questions included. "
    );
    if let Some(seconds) = record.build_seconds {
        let each = 1e3 * seconds / *entries as f64;
        let _ = write!(text, "Built in {seconds:.0} s, {each:.0} ms an entry, making the shapes included. ");
    }
    text += "Suspects have any pose and size. *Akin* first: the right one or one of its family. Seconds: one question by itself, \
             the second of three, all threads.\n\n\
             | suspect | asked | in the best ten | first | akin first | describe, s | search, s |\n|---|---:|---:|---:|---:|---:|---:|\n";
    let mut rows: Vec<(&str, Vec<&Asked>)> = Class::ALL
        .iter()
        .map(|class| {
            (class.name(), record.asked.iter().filter(|asked| asked.class == class.name()).collect())
        })
        .collect();
    rows.push(("all", record.asked.iter().collect()));
    for (name, of) in &rows {
        let alone = record.alone.iter().find(|alone| alone.class == *name);
        let seconds = alone.map_or(["-".into(), "-".into()], |a| {
            [a.describe_seconds, a.search_seconds].map(|s| format!("{s:.2}"))
        });
        let _ = writeln!(
            text,
            "| {name} | {} | {:.3} | {:.3} | {:.3} | {} | {} |",
            of.len(),
            share(of, |asked| asked.rank.is_some()),
            share(of, |asked| asked.rank == Some(0)),
            share(of, |asked| akin(&asked.original, &asked.first)),
            seconds[0],
            seconds[1],
        );
    }
    text += "\n## Missed\n\nRight ones that were not among the best ten.\n\n| suspect | original | first | its score |\n|---|---|---|---:|\n";
    for asked in record.asked.iter().filter(|asked| asked.rank.is_none()) {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {:.2} |",
            asked.class, asked.original, asked.first, asked.scores[0]
        );
    }
    text
}

/// Share of questions whose right answer is among the first so many.
fn panel(record: &Record) -> Panel {
    let series = Class::ALL.iter().map(|class| {
        let of: Vec<&Asked> = record.asked.iter().filter(|asked| asked.class == class.name()).collect();
        let within = |k: usize| share(&of, |asked| asked.rank.is_some_and(|rank| rank < k));
        let points = (1..=10).map(|k| (k as f64, within(k))).collect();
        Series { name: class.name().into(), points, intervals: Vec::new(), dots: true }
    });
    Panel {
        caption: "the right one among the first",
        x: Axis { label: "candidates", range: 1.0..10.0, powers: false, ticks: 10 },
        y: Axis { label: "share of the questions", range: 0.5..1.0, powers: false, ticks: 11 },
        series: series.collect(),
        diagonal: false,
        legend: Some(SeriesLabelPosition::LowerRight),
    }
}
