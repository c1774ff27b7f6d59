//! Does every figure of a report hold? The detection is made again from the files that it names.

use crate::args::Verify;
use crate::commands::detect::figures;
use crate::evidence::{Evidence, FileHash, PROGRAM};
use crate::failure::Failure;
use crate::timestamp::{self, Stamp};
use crate::{Answer, Context, files};
use serde::Serialize;
use serde_json::Value;
use sha2::{Digest, Sha256};
use sombrero::io::Document;
use sombrero::report::evidence_of;
use std::path::{Path, PathBuf};

/// What a report says of itself rather than of the files, or what differs from run to run.
const NOT_FIGURES: [&str; 8] =
    ["seconds", "warnings", "prepared", "program", "files", "settings", "suspect", "report"];

/// So many differences are shown to people.
const MOST_SHOWN: usize = 12;

/// What a report holds, as `detect --json` printed it.
pub(super) struct Recorded {
    figures: Value,
    evidence: Evidence,
}

#[derive(Serialize)]
struct Report {
    holds: bool,
    /// Whether the files are those of the report; if not, nothing else was compared.
    same_files: bool,
    program: String,
    compared: usize,
    differences: Vec<Difference>,
    suspect: String,
    original: String,
    key: String,
    timestamp: Option<Stamp>,
}

/// A figure that is another one now.
#[derive(Serialize)]
struct Difference {
    field: String,
    recorded: Value,
    found: Value,
}

impl Recorded {
    /// In a page, or as JSON by itself; `None` for other files.
    pub(super) fn find(bytes: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(bytes).ok()?;
        let json = if text.trim_start().starts_with('{') { text } else { evidence_of(text)? };
        let figures: Value = serde_json::from_str(json).ok()?;
        let evidence = serde_json::from_value(figures.clone()).ok()?;
        figures.get("detected")?;
        Some(Self { figures, evidence })
    }
}

pub(super) fn replay(args: &Verify, recorded: &Recorded, context: &Context) -> Result<Answer, Failure> {
    let named = &recorded.evidence.files;
    let place =
        |given: &Option<PathBuf>, file: &FileHash| given.clone().unwrap_or_else(|| find(&args.file, file));
    let paths = [
        place(&args.suspect, &named.suspect),
        place(&args.original, &named.original),
        place(&args.key, &named.key),
    ];
    let suspect = files::read_mesh(&paths[0], context.limits)?;
    let original = files::read_mesh(&paths[1], context.limits)?;
    let key = files::read_key(&paths[2])?;
    let stamp = timestamp::of_key(&paths[2], &key, &timestamp::anchors(args.ca.as_deref())?)?;
    let hash = |document: &Document| hex::encode(Sha256::digest(document.content()));
    let checks = [
        ("suspect.sha256", &named.suspect.sha256, hash(&suspect)),
        ("original.sha256", &named.original.sha256, hash(&original)),
        // The file may hold a timestamp by now; the key is the same.
        ("commitment", &named.commitment, hex::encode(key.commitment())),
    ];
    let mut compared = checks.len();
    let mut differences = Vec::new();
    for (field, recorded, found) in checks {
        if *recorded != found {
            let (recorded, found) = (recorded.clone().into(), found.into());
            differences.push(Difference { field: format!("files.{field}"), recorded, found });
        }
    }
    // Of other files the figures would be others too.
    let same_files = differences.is_empty();
    if same_files {
        let options = recorded.evidence.settings.options();
        let found = figures(&suspect, &original, key, &options)
            .map_err(|e| Failure::about("report", &args.file, &e))?;
        compared += compare(&recorded.figures, &found, &mut differences);
    }
    let [suspect, original, key] = paths.each_ref().map(|path| path.display().to_string());
    let program = recorded.evidence.program.clone();
    let report = Report {
        holds: differences.is_empty(),
        same_files,
        program,
        compared,
        differences,
        suspect,
        original,
        key,
        timestamp: stamp,
    };
    let answer = Answer::new(text(args, recorded, &report), &report)?;
    Ok(answer.found_if(report.holds))
}

/// Where a file of the report is: as it was named, or beside the report.
fn find(report: &Path, file: &FileHash) -> PathBuf {
    let named = PathBuf::from(&file.path);
    let beside = named.file_name().map(|name| report.with_file_name(name));
    match beside {
        Some(beside) if !named.exists() && beside.exists() => beside,
        _ => named,
    }
}

/// Every figure of either side, to the last digit; gives how many there are.
fn compare(recorded: &Value, found: &Value, differences: &mut Vec<Difference>) -> usize {
    let mut fields: Vec<&String> =
        [recorded, found].iter().filter_map(|side| side.as_object()).flat_map(|side| side.keys()).collect();
    fields.sort();
    fields.dedup();
    fields.retain(|field| !NOT_FIGURES.contains(&field.as_str()));
    fields.into_iter().map(|field| compare_value(field, &recorded[field], &found[field], differences)).sum()
}

fn compare_value(field: &str, recorded: &Value, found: &Value, differences: &mut Vec<Difference>) -> usize {
    match (recorded, found) {
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => {
            a.keys().map(|k| compare_value(&format!("{field}.{k}"), &a[k], &b[k], differences)).sum()
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let pairs = a.iter().zip(b).enumerate();
            pairs.map(|(i, (a, b))| compare_value(&format!("{field}[{i}]"), a, b, differences)).sum()
        }
        _ => {
            if recorded != found {
                let (recorded, found) = (recorded.clone(), found.clone());
                differences.push(Difference { field: field.to_owned(), recorded, found });
            }
            1
        }
    }
}

fn text(args: &Verify, recorded: &Recorded, report: &Report) -> String {
    let file = args.file.display();
    let verdict = match (report.holds, report.same_files) {
        (true, _) => format!("HOLDS: every figure of {file} was found again"),
        (false, true) => format!("DOES NOT HOLD: not every figure of {file} was found again"),
        (false, false) => {
            format!("DOES NOT HOLD: the files are not those of {file}, so no figure was compared")
        }
    };
    let genuine = if report.same_files { " (genuine)" } else { "" };
    let mut lines = vec![
        verdict,
        format!("  compared      {} values", report.compared),
        format!("  it says       {}", verdict_of(&recorded.figures)),
        format!("  suspect       {}", report.suspect),
        format!("  original      {}", report.original),
        format!("  key           {}{genuine}", report.key),
    ];
    lines.extend(report.timestamp.iter().flat_map(Stamp::lines));
    if report.program != PROGRAM {
        lines.push(format!("  note          it was made by {}, this is {PROGRAM}", report.program));
    }
    let shown =
        |d: &Difference| format!("  differs       {}: recorded {}, found {}", d.field, d.recorded, d.found);
    lines.extend(report.differences.iter().take(MOST_SHOWN).map(shown));
    if report.differences.len() > MOST_SHOWN {
        lines.push(format!(
            "  differs       and {} more; --json has all",
            report.differences.len() - MOST_SHOWN
        ));
    }
    lines.join("\n")
}

/// What the report says.
fn verdict_of(figures: &Value) -> String {
    let found = if figures["detected"] == true { "found" } else { "not found" };
    format!("{found}, log10 p {:.1}", figures["log10_p"].as_f64().unwrap_or(0.0))
}
