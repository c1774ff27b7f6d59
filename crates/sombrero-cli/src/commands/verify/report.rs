//! Does every figure of a report hold? The detection is made again from the files that it names.

use super::args::Args;
use crate::answer::{Answer, Context};
use crate::failure::Failure;
use crate::files;
use crate::table::Table;
use crate::timestamp::{self, Stamp};
use serde::Serialize;
use sombrero_report::{Difference, FileHash, PROGRAM, Record, replay};
use std::path::{Path, PathBuf};

/// The number of differences that are shown to people.
const MOST_SHOWN: usize = 12;

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

pub(super) fn check(args: &Args, recorded: &Record, context: &Context) -> Result<Answer, Failure> {
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
    let timestamp = timestamp::of_key(&paths[2], &key, &timestamp::anchors(args.ca.as_deref())?)?;
    let replay =
        replay(recorded, &suspect, &original, key).map_err(|e| Failure::about("report", &args.file, &e))?;
    let holds = replay.holds();
    let [suspect, original, key] = paths.each_ref().map(|path| path.display().to_string());
    let report = Report {
        holds,
        same_files: replay.same_files,
        program: recorded.evidence.program.clone(),
        compared: replay.compared,
        differences: replay.differences,
        suspect,
        original,
        key,
        timestamp,
    };
    Ok(Answer::new(text(args, recorded, &report), &report)?.found_if(holds))
}

/// The place of a file of the report: as it was named, or beside the report.
fn find(report: &Path, file: &FileHash) -> PathBuf {
    let named = PathBuf::from(&file.path);
    let beside = named.file_name().map(|name| report.with_file_name(name));
    match beside {
        Some(beside) if !named.exists() && beside.exists() => beside,
        _ => named,
    }
}

fn text(args: &Args, recorded: &Record, report: &Report) -> Table {
    let file = args.file.display();
    let verdict = match (report.holds, report.same_files) {
        (true, _) => format!("HOLDS: every figure of {file} was found again"),
        (false, true) => format!("DOES NOT HOLD: not every figure of {file} was found again"),
        (false, false) => {
            format!("DOES NOT HOLD: the files are not those of {file}, so no figure was compared")
        }
    };
    let genuine = if report.same_files { " (genuine)" } else { "" };
    let found = if recorded.detected() { "found" } else { "not found" };
    let other =
        (report.program != PROGRAM).then(|| format!("it was made by {}, this is {PROGRAM}", report.program));
    let shown = |d: &Difference| format!("{}: recorded {}, found {}", d.field, d.recorded, d.found);
    let more = report.differences.len().saturating_sub(MOST_SHOWN);
    Table::new(verdict)
        .row("compared", format!("{} values", report.compared))
        .row("it says", format!("{found}, log10 p {:.1}", recorded.log10_p()))
        .row("suspect", &report.suspect)
        .row("original", &report.original)
        .row("key", format!("{}{genuine}", report.key))
        .and(report.timestamp.as_ref().map(Stamp::rows).unwrap_or_default())
        .rows("note", other)
        .rows("differs", report.differences.iter().take(MOST_SHOWN).map(shown))
        .rows("differs", (more > 0).then(|| format!("and {more} more; --json has all")))
}
