//! Does a report hold? Detection, record and page are made again from the files that it names.

use super::args::Args;
use super::beside::Named;
use crate::answer::{Answer, Context};
use crate::failure::Failure;
use crate::files;
use crate::table::Table;
use crate::timestamp::{self, Stamp};
use serde::Serialize;
use sombrero_report::{Difference, PROGRAM, Record, replay};

/// The number of differences that are shown to people.
const MOST_SHOWN: usize = 12;

#[derive(Serialize)]
struct Report {
    holds: bool,
    /// Whether the files are those of the report; if not, nothing else was compared.
    same_files: bool,
    program: String,
    compared: usize,
    /// Whether the page was compared too, byte for byte.
    page_compared: bool,
    differences: Vec<Difference>,
    /// The parts that were taken from the report, since the files do not tell them.
    not_compared: Vec<String>,
    suspect: String,
    original: String,
    key: String,
    timestamp: Option<Stamp>,
}

pub(super) fn check(args: &Args, recorded: &Record, context: &Context) -> Result<Answer, Failure> {
    let named = &recorded.evidence.files;
    let named = [
        ("suspect", "--suspect", &args.suspect, &named.suspect),
        ("original", "--original", &args.original, &named.original),
        ("key", "--key", &args.key, &named.key),
    ];
    let named = named.map(|(role, option, given, file)| Named {
        role,
        option,
        given: given.as_deref(),
        path: &file.path,
    });
    let [suspect, original, key] = named.each_ref().map(|file| file.find(&args.file));
    let paths = [suspect?, original?, key?];
    let suspect = files::read_mesh(&paths[0], context)?;
    let original = files::read_mesh(&paths[1], context)?;
    let key_file = files::key_file(&paths[2], context.desk)?;
    let key = files::parse_key(&paths[2], &key_file)?;
    let timestamp = timestamp::of_key(&paths[2], &key, &timestamp::anchors(args.ca.as_deref())?)?;
    let replay =
        replay(recorded, &suspect, &original, key, &key_file, timestamp.as_ref().map(Stamp::commitment))
            .map_err(|e| Failure::about("report", &args.file, &e))?;
    let holds = replay.holds();
    let renamed = named.iter().filter(|_| replay.same_files).filter_map(Named::renamed);
    let not_compared = replay.taken_over.iter().map(|&part| part.to_owned()).chain(renamed).collect();
    let [suspect, original, key] = paths.each_ref().map(|path| path.display().to_string());
    let report = Report {
        holds,
        same_files: replay.same_files,
        program: recorded.evidence.program.clone(),
        compared: replay.compared,
        page_compared: replay.page_compared,
        differences: replay.differences,
        not_compared,
        suspect,
        original,
        key,
        timestamp,
    };
    Ok(Answer::new(text(args, recorded, &report), &report)?.found_if(holds))
}

fn text(args: &Args, recorded: &Record, report: &Report) -> Table {
    let file = args.file.display();
    let (page, all, too) = if report.page_compared {
        (" and every byte of its page", "all", ", and the page byte for byte")
    } else {
        ("", "every figure", "")
    };
    let verdict = match (report.holds, report.same_files) {
        (true, _) => format!("HOLDS: every figure of {file}{page} was found again"),
        (false, true) => format!("DOES NOT HOLD: not {all} of {file} was found again"),
        (false, false) => {
            format!("DOES NOT HOLD: the files are not those of {file}, so no figure was compared")
        }
    };
    let genuine = if report.same_files { " (genuine)" } else { "" };
    let found = if recorded.detected() { "found" } else { "not found" };
    let other = (report.program != PROGRAM).then(|| {
        let program = &report.program;
        format!("it was made by {program}, this is {PROGRAM}: only that version can tell whether what differs is due to it")
    });
    let shown = |d: &Difference| format!("{}: recorded {}, found {}", d.field, d.recorded, d.found);
    let more = report.differences.len().saturating_sub(MOST_SHOWN);
    Table::new(verdict)
        .row("compared", format!("{} values{too}", report.compared))
        .row("it says", format!("{found}, log10 p {:.1}", recorded.log10_p()))
        .row("suspect", &report.suspect)
        .row("original", &report.original)
        .row("key", format!("{}{genuine}", report.key))
        .and(report.timestamp.as_ref().map(Stamp::rows).unwrap_or_default())
        .rows("note", other)
        .rows("not compared", &report.not_compared)
        .rows("differs", report.differences.iter().take(MOST_SHOWN).map(shown))
        .rows("differs", (more > 0).then(|| format!("and {more} more; --json has all")))
}
