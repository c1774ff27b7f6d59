//! `sombrero trace`.

use crate::answer::{Answer, Context};
use crate::args::Steps;
use crate::failure::Failure;
use crate::files;
use crate::progress::Progress;
use crate::table::Table;
use crate::terminal::visible;
use serde::Serialize;
use sombrero::watermark::{Key, KeyError};
use sombrero::{Alignment, DetectError, Named, SearchError, Stages, Trace, Tracer};
use std::path::{Path, PathBuf};
use std::time::Instant;

// What is typed after `sombrero trace`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The mesh to look at.
    suspect: PathBuf,
    /// The file that was marked, exactly.
    #[arg(long, value_name = "FILE")]
    original: PathBuf,
    /// The folder with the keys of all copies.
    #[arg(long, value_name = "DIR")]
    keys: PathBuf,
    #[command(flatten)]
    steps: Steps,
}

/// The number of keys that were left out which are shown to people.
const MOST_SHOWN: usize = 5;

/// Folders below the folder of keys are looked into this deep.
const DEEPEST: usize = 8;

/// For programs.
#[derive(Serialize)]
struct Report {
    found: bool,
    recipients: Vec<Recipient>,
    keys: usize,
    threshold: f64,
    variants_counted: usize,
    coverage: f64,
    registration: Option<Alignment>,
    skipped: Vec<Skipped>,
    seconds: Stages,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct Recipient {
    key: String,
    recipient: String,
    named: bool,
    log10_p: f64,
    correlation: f64,
    beside_others: bool,
}

/// A key that took no part.
#[derive(Serialize)]
struct Skipped {
    key: String,
    reason: String,
}

pub(crate) fn run(args: &Args, context: &Context) -> Result<Answer, Failure> {
    files::check_outputs(&[], &[&args.suspect, &args.original], false)?;
    let _progress = Progress::new(format!("tracing {}", args.suspect.display()));
    let start = Instant::now();
    let Keys { paths, keys, mut skipped } = read_keys(&args.keys)?;
    let recipients: Vec<String> = keys.iter().map(|key| key.identity.recipient.clone()).collect();
    let original = files::read_mesh(&args.original, context.limits)?;
    let suspect = files::read_mesh(&args.suspect, context.limits)?;
    let failed = |e: &DetectError| match e {
        DetectError::Basis(_) => Failure::about("keys", &args.keys, e),
        DetectError::NoFaces { which: "original" } => Failure::about("mesh", &args.original, e),
        DetectError::Search(SearchError::NeedsResampling) => {
            Failure::about("needs_resampling", &args.suspect, e)
        }
        DetectError::Threshold { .. } => Failure::new("usage", e.to_string()),
        _ => Failure::about("suspect", &args.suspect, e),
    };
    let (tracer, rejected) = Tracer::new(&original, keys).map_err(|e| failed(&e))?;
    drop(original);
    skipped.extend(
        rejected.iter().map(|r| Skipped { key: shown(&paths[r.index]), reason: r.reason.to_string() }),
    );
    if tracer.is_empty() {
        return Err(no_keys(&args.keys, &skipped));
    }
    let preparation = ("preparation", start.elapsed().as_secs_f64());
    let mut trace = tracer.trace(&suspect, &args.steps.options()).map_err(|e| failed(&e))?;
    trace.seconds.0.insert(0, preparation);
    let report = report(trace, &tracer, &paths, &recipients, skipped);
    Ok(Answer::new(text(args, &report), &report)?.found_if(report.found))
}

fn report(
    trace: Trace,
    tracer: &Tracer,
    paths: &[PathBuf],
    recipients: &[String],
    skipped: Vec<Skipped>,
) -> Report {
    let recipient = |&Named { index, named, log10_p, correlation, beside_others, .. }: &Named| Recipient {
        key: shown(&paths[index]),
        recipient: recipients[index].clone(),
        named,
        log10_p,
        correlation,
        beside_others,
    };
    Report {
        found: trace.found,
        recipients: trace.recipients.iter().map(recipient).collect(),
        keys: tracer.len(),
        threshold: trace.threshold,
        variants_counted: trace.variants_counted,
        coverage: trace.coverage,
        registration: trace.registration,
        skipped,
        seconds: trace.seconds,
        warnings: trace.warnings,
    }
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

/// The content of a folder: keys, each with its file, and those that could not be read.
struct Keys {
    paths: Vec<PathBuf>,
    keys: Vec<Key>,
    skipped: Vec<Skipped>,
}

/// Every key below `folder`, in the order of the names. Files that are no keys are passed over; damaged keys
/// are told of.
fn read_keys(folder: &Path) -> Result<Keys, Failure> {
    let mut files = Vec::new();
    list(folder, DEEPEST, &mut files)?;
    let (mut paths, mut keys, mut skipped) = (Vec::new(), Vec::new(), Vec::new());
    for path in files {
        let bytes = match files::read_small(&path, files::LARGEST_KEY) {
            Ok(bytes) if bytes.trim_ascii_start().starts_with(b"{") => bytes,
            // Meshes, pages, prepared files.
            Ok(_) => continue,
            Err(failure) => {
                skipped.push(Skipped { key: shown(&path), reason: failure.message().to_owned() });
                continue;
            }
        };
        match Key::from_json(&bytes) {
            Ok(key) => {
                keys.push(key);
                paths.push(path);
            }
            Err(error) => skipped.push(Skipped { key: shown(&path), reason: KeyError::to_string(&error) }),
        }
    }
    if keys.is_empty() {
        return Err(no_keys(folder, &skipped));
    }
    Ok(Keys { paths, keys, skipped })
}

/// Files below `folder` that may be keys by their extension.
fn list(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<(), Failure> {
    let is_key = |path: &Path| {
        path.extension().is_none_or(|e| e.eq_ignore_ascii_case("key") || e.eq_ignore_ascii_case("json"))
    };
    for path in files::entries(folder)? {
        if path.is_dir() && depth > 0 {
            list(&path, depth - 1, found)?;
        } else if path.is_file() && is_key(&path) {
            found.push(path);
        }
    }
    Ok(())
}

fn no_keys(folder: &Path, skipped: &[Skipped]) -> Failure {
    let first = skipped.first().map(|s| format!(" ({}: {})", s.key, s.reason));
    let message = format!(
        "{}: no key for this original in this folder{}; give the folder where `embed` wrote the keys",
        folder.display(),
        first.unwrap_or_default()
    );
    Failure::new("keys", message)
}

fn text(args: &Args, report: &Report) -> Table {
    let named = report.recipients.iter().filter(|r| r.named).count();
    let suspect = args.suspect.display();
    let mut table = Table::new(match named {
        0 => format!("NOBODY NAMED: no recipient's mark was found in {suspect}"),
        1 => format!("NAMED: {suspect} is the copy of one recipient"),
        _ => format!("NAMED: {suspect} was made of the copies of {named} recipients"),
    });
    for r in report.recipients.iter().take(named) {
        let name = if r.recipient.is_empty() { "(no recipient's text)" } else { &r.recipient };
        let figures = format!("log10 p {:.1}, correlation {:.3}", r.log10_p, r.correlation);
        // Its length must be known before it is padded.
        table = table.line(format!("  {:<28} {figures}   {}", visible(name), r.key));
    }
    let next = report.recipients.get(named).map(|next| {
        // A name at the level of chance would only be held against somebody.
        let name = if next.log10_p < -2.0 { format!("{}, ", next.recipient) } else { String::new() };
        format!("{name}log10 p {:.1}: not named", next.log10_p)
    });
    let chance = format!(
        "the chance that anybody without a part is named as surely; threshold {:.1}",
        report.threshold.log10()
    );
    let more = report.skipped.len().saturating_sub(MOST_SHOWN);
    table
        .rows("next best", next)
        .row("log10 p", chance)
        .row("keys", format!("{} of this original, {} tests in all", report.keys, report.variants_counted))
        .row("coverage", format!("{:.1} % of the original's area", 100.0 * report.coverage))
        .row("seconds", format!("{:.2}", report.seconds.total()))
        .rows("note", &report.warnings)
        .rows("left out", report.skipped.iter().take(MOST_SHOWN).map(|s| format!("{}: {}", s.key, s.reason)))
        .rows("left out", (more > 0).then(|| format!("and {more} more keys; --json has all")))
}
