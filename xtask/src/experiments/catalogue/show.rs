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
         entry. Opened in {open_seconds:.2} s; {peak_megabytes:.0} MB of memory at most while \
         one question after the other was made and asked. "
    );
    if let Some(seconds) = record.build_seconds {
        let each = 1e3 * seconds / *entries as f64;
        let _ = write!(text, "Built in {seconds:.0} s, {each:.0} ms an entry, making the shapes included. ");
    }
    text += "Suspects have any pose and size, each of another original as far as there are enough. *Others*: without those that lie \
             no farther from the right one than the attack moved it, or than a thousandth of its size; by surfaces, such \
             models are one. *Akin* first: the right one or one of its family. Seconds: one question by itself, the \
             second of three, all threads.\n\n\
             | suspect | asked | in the best ten | of others | first | of others | akin first | describe, s | search, s |\n\
             |---|---:|---:|---:|---:|---:|---:|---:|---:|\n";
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
            "| {name} | {} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {} | {} |",
            of.len(),
            share(of, |asked| asked.is_within(10)),
            share(of, |asked| asked.is_within_others(10)),
            share(of, |asked| asked.is_within(1)),
            share(of, |asked| asked.is_within_others(1)),
            share(of, |asked| akin(&asked.original, &asked.first)),
            seconds[0],
            seconds[1],
        );
    }
    text += "\n## Missed\n\nRight ones that were not among the best ten, and where they were lost: by votes (or no pose was \
             found of what they brought), by pairs of landmarks, by the rank that surfaces gave them. Attack: how far it \
             moved the surface, relative to the root of the suspect's area.\n\n\
             | suspect | original | lost | attack | first | its score |\n|---|---|---|---:|---|---:|\n";
    for asked in record.asked.iter().filter(|asked| !asked.is_within(10)) {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {:.4} | {} | {:.2} |",
            asked.class,
            asked.original,
            lost(asked),
            asked.attack,
            asked.first,
            asked.scores[0]
        );
    }
    text
}

/// Where the right one of a question was lost, and at which place.
fn lost(asked: &Asked) -> String {
    let rank = asked.rank.map(|rank| rank + 1);
    match (asked.fate, rank) {
        (_, Some(rank)) if asked.is_within_others(10) => format!("ambiguous, place {rank}"),
        (_, Some(rank)) => format!("by rank, place {rank}"),
        (Some([Some(votes), None, _]), _) => format!("by votes, place {}", votes + 1),
        (Some([_, Some(pairs), _]), _) => format!("by pairs, place {}", pairs + 1),
        _ => "without a vote".into(),
    }
}

/// Share of questions whose right answer is among the first so many.
fn panel(record: &Record) -> Panel {
    let series = Class::ALL.iter().map(|class| {
        let of: Vec<&Asked> = record.asked.iter().filter(|asked| asked.class == class.name()).collect();
        let within = |k: usize| share(&of, |asked| asked.is_within(k));
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
