//! `sombrero detect`.

use crate::args::{Detect, Method, Step};
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, files};
use sombrero::io::Document;
use sombrero::{DetectError, DetectOptions, Detection, detect};

pub(crate) fn run(args: &Detect) -> Result<Answer, Failure> {
    if args.method == Method::Robust {
        let message = "--method robust is not there yet; this version has --method paper";
        return Err(Failure::new("unavailable", message));
    }
    let _progress = Progress::new(format!("looking at {}", args.suspect.display()));
    let key = files::read_key(&args.key)?;
    let original = Document::read(&args.original)?;
    let suspect = Document::read(&args.suspect)?;
    let options = DetectOptions {
        registration: step(args.registration),
        resampling: step(args.resampling),
        threshold: args.threshold,
    };
    let detection = detect(&suspect, &original, &key, &options).map_err(|e| failure(args, &e))?;
    let answer = Answer::new(text(args, &detection), &detection)?;
    Ok(Answer { found: detection.detected, ..answer })
}

fn step(step: Step) -> sombrero::Step {
    match step {
        Step::Auto => sombrero::Step::Auto,
        Step::Always => sombrero::Step::Always,
        Step::Never => sombrero::Step::Never,
    }
}

/// Names the file that the error is about.
fn failure(args: &Detect, error: &DetectError) -> Failure {
    match error {
        DetectError::Key(_) | DetectError::Basis(_) => Failure::about("key", &args.key, error),
        DetectError::NoFaces { which: "original" } => Failure::about("mesh", &args.original, error),
        DetectError::NeedsResampling { .. } => Failure::about("needs_resampling", &args.suspect, error),
        DetectError::NotAvailable { .. } => Failure::new("unavailable", error.to_string()),
        DetectError::Threshold { .. } => Failure::new("usage", error.to_string()),
        _ => Failure::about("suspect", &args.suspect, error),
    }
}

fn text(args: &Detect, d: &Detection) -> String {
    let verdict = if d.detected { "FOUND: the mark is in" } else { "NOT FOUND: no mark in" };
    let step = |yes: bool, name: &str| format!("{} {name}", if yes { "with" } else { "without" });
    let mut lines = vec![
        format!("{verdict} {}", args.suspect.display()),
        format!("  log10 p       {:.1} (threshold {:.1}): the chance that an unmarked mesh matches as well", d.log10_p, d.threshold.log10()),
        format!("  correlation   {:.4} over {} coefficients", d.correlation, d.coefficients_used),
        format!("  coverage      {:.1} % of the original's area", 100.0 * d.coverage),
        format!(
            "  method        {}, {}, {}",
            d.method,
            step(d.variant.registration, "registration"),
            step(d.variant.resampling, "resampling")
        ),
        format!("  seconds       {:.2}", d.seconds.total()),
    ];
    lines.extend(d.warnings.iter().map(|w| format!("  note          {w}")));
    lines.join("\n")
}
