//! `sombrero trace`.

use crate::answer::{Answer, Context};
use crate::args::Steps;
use crate::failure::Failure;
use crate::files;
use crate::key_folder::{KeyFolder, Skipped, no_keys};
use crate::progress::Progress;
use crate::table::Table;
use crate::terminal::visible;
use crate::timestamp::{self, Stamp};
use serde::Serialize;
use sombrero::{Alignment, Claim, DetectError, Named, SearchError, Stages, Trace, Tracer};
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
    /// Certificates (PEM) of the timestamping authorities that you trust, for the timestamps in the keys.
    #[arg(long, value_name = "FILE")]
    ca: Option<PathBuf>,
    #[command(flatten)]
    steps: Steps,
}

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
    budget_spent: bool,
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
    /// Whom it convinces; only of those who are named.
    #[serde(skip_serializing_if = "Option::is_none")]
    claim: Option<Claim>,
}

pub(crate) fn run(args: &Args, context: &Context) -> Result<Answer, Failure> {
    files::check_outputs(&[], &[&args.suspect, &args.original], false)?;
    let _progress = Progress::new(format!("tracing {}", args.suspect.display()));
    let start = Instant::now();
    let KeyFolder { paths, keys, mut skipped } = KeyFolder::read(&args.keys, context.desk)?;
    let recipients: Vec<String> = keys.iter().map(|key| key.identity.recipient.clone()).collect();
    let original = files::read_mesh(&args.original, context)?;
    let suspect = files::read_mesh(&args.suspect, context)?;
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
    skipped.extend(rejected.iter().map(|r| Skipped::new(&paths[r.index], &r.reason)));
    if tracer.is_empty() {
        return Err(no_keys(&args.keys, &skipped));
    }
    let preparation = ("preparation", start.elapsed().as_secs_f64());
    let options = args.steps.options();
    let mut trace = tracer.trace(&suspect, &options).map_err(|e| failed(&e))?;
    trace.seconds.0.insert(0, preparation);
    skipped.extend(trace.rejected.iter().map(|r| Skipped::new(&paths[r.index], &r.reason)));
    let anchors = timestamp::anchors(args.ca.as_deref())?;
    let mut claims = Vec::new();
    for named in trace.recipients.iter().filter(|named| named.named) {
        let key = tracer.key(named.index);
        let stamp = timestamp::of_key(&paths[named.index], key, &anchors)?;
        let commitment = stamp.as_ref().map(Stamp::commitment);
        claims.push(Claim::new(true, named.log10_p, key, commitment, &options));
    }
    let report = report(trace, &tracer, &paths, &recipients, claims, skipped);
    Ok(Answer::new(text(args, &report), &report)?.found_if(report.found))
}

fn report(
    trace: Trace,
    tracer: &Tracer,
    paths: &[PathBuf],
    recipients: &[String],
    claims: Vec<Claim>,
    skipped: Vec<Skipped>,
) -> Report {
    // The named come first.
    let claims = claims.into_iter().map(Some).chain(std::iter::repeat(None));
    let recipient = |(&Named { index, named, log10_p, correlation, beside_others, .. }, claim)| Recipient {
        claim,
        key: shown(&paths[index]),
        recipient: recipients[index].clone(),
        named,
        log10_p,
        correlation,
        beside_others,
    };
    Report {
        found: trace.found,
        recipients: trace.recipients.iter().zip(claims).map(recipient).collect(),
        keys: tracer.len(),
        threshold: trace.threshold,
        variants_counted: trace.variants_counted,
        coverage: trace.coverage,
        registration: trace.registration,
        skipped,
        budget_spent: trace.budget_spent,
        seconds: trace.seconds,
        warnings: trace.warnings,
    }
}

fn shown(path: &Path) -> String {
    path.display().to_string()
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
    let claims = report.recipients.iter().filter_map(|r| r.claim.as_ref());
    let weakest = claims.max_by(|a, b| a.log10_p_claimant.total_cmp(&b.log10_p_claimant));
    let of = if named > 1 { " (the weakest)" } else { "" };
    let next = report.recipients.get(named).map(|next| {
        // A name at the level of chance would only be held against somebody.
        let name = if next.log10_p < -2.0 { format!("{}, ", next.recipient) } else { String::new() };
        format!("{name}log10 p {:.1}: not named", next.log10_p)
    });
    let chance = format!(
        "the chance that anybody without a part is named as surely; threshold {:.1}",
        report.threshold.log10()
    );
    table
        .rows("convinces", weakest.map(|claim| format!("{}{of}", claim.sentence())))
        .rows("next best", next)
        .row("log10 p", chance)
        .row("keys", format!("{} of this original, {} tests in all", report.keys, report.variants_counted))
        .row("coverage", format!("{:.1} % of the original's area", 100.0 * report.coverage))
        .row("seconds", format!("{:.2}", report.seconds.total()))
        .rows("note", &report.warnings)
        .and(Skipped::rows(&report.skipped))
}
