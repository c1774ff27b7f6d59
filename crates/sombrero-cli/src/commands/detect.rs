//! `sombrero detect`.

use crate::args::{Detect, Method, Step};
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, files};
use serde::Serialize;
use sha2::{Digest, Sha256};
use sombrero::io::{Document, Limits, write_atomically};
use sombrero::mesh::Soup;
use sombrero::report::{DetectionReport, FileLabel, detection_report};
use sombrero::watermark::Key;
use sombrero::{DetectError, DetectOptions, Detection, Prepared, StoredBasis};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// For programs.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    detection: &'a Detection,
    /// Whether the basis came from a prepared file.
    prepared: bool,
}

pub(crate) fn run(args: &Detect, limits: Limits) -> Result<Answer, Failure> {
    let outputs: Vec<&Path> = args.report.iter().map(PathBuf::as_path).collect();
    let beside = files::beside_key(&args.key);
    let prepared_file = args.prepared.as_deref().unwrap_or(&beside);
    let inputs = [&args.suspect, &args.original, &args.key].map(PathBuf::as_path);
    files::check_outputs(&outputs, &[&inputs[..], &[prepared_file]].concat(), args.force)?;
    let _progress = Progress::new(format!("looking at {}", args.suspect.display()));
    let key = files::read_key(&args.key)?;
    let original = Document::read_within(&args.original, limits)?;
    let suspect = Document::read_within(&args.suspect, limits)?;
    let options = DetectOptions {
        method: method(args.method),
        registration: step(args.registration),
        resampling: step(args.resampling),
        threshold: args.threshold,
        seed: args.seed,
    };
    let (stored, note) = stored(args, prepared_file, &key, limits)?;
    let from_file = stored.is_some();
    let start = Instant::now();
    let prepared = match stored {
        Some(stored) => Prepared::with_stored(&original, key, stored),
        None => Prepared::new(&original, key),
    };
    let prepared = prepared.map_err(|e| failure(args, &e))?;
    let preparation = ("preparation", start.elapsed().as_secs_f64());
    let suspect_sha256 = args.report.as_ref().map(|_| hex::encode(Sha256::digest(suspect.content())));
    let looked_at = prepared.suspect(&suspect);
    // Detection needs the memory.
    drop((original, suspect));
    let mut detection = prepared.detect(&looked_at, &options).map_err(|e| failure(args, &e))?;
    detection.seconds.0.insert(0, preparation);
    detection.warnings.extend(note);
    if detection.detected && from_file {
        detection.warnings.extend(vouch(args, &prepared)?);
    }
    if let Some((path, suspect_sha256)) = args.report.as_ref().zip(suspect_sha256) {
        let page = report(args, &prepared, &looked_at.soup, suspect_sha256, &detection)?;
        write_atomically(path, page.as_bytes(), files::overwrite(args.force))?;
    }
    let answer = Answer::new(text(args, &detection), &Report { detection: &detection, prepared: from_file })?;
    Ok(Answer { found: detection.detected, ..answer })
}

/// The stored basis where there is one to be used, or a sentence that says why the one beside the key is not.
fn stored(
    args: &Detect,
    path: &Path,
    key: &Key,
    limits: Limits,
) -> Result<(Option<StoredBasis>, Option<String>), Failure> {
    let asked = args.prepared.is_some();
    if !asked && path.symlink_metadata().is_err() {
        return Ok((None, None));
    }
    match files::read_prepared(path, key, limits) {
        Ok(stored) => Ok((Some(stored), None)),
        Err(failure) if asked => Err(failure),
        Err(failure) => Ok((None, Some(format!("The prepared file was not used: {}.", failure.message())))),
    }
}

/// Key and prepared file may have been made up together, and then any suspect has the mark. So what was found with a
/// file that happens to lie beside the key is confirmed without it; with one that the user vouches for, the answer says so.
fn vouch(args: &Detect, prepared: &Prepared) -> Result<Option<String>, Failure> {
    let Some(path) = &args.prepared else {
        prepared.confirm().map_err(|e| failure(args, &e))?;
        return Ok(None);
    };
    Ok(Some(format!(
        "The basis was taken from {} and not derived anew, which `sombrero verify` does.",
        path.display()
    )))
}

/// The report's page; hashes are those of the files as they were read.
fn report(
    args: &Detect,
    prepared: &Prepared,
    suspect: &Soup,
    suspect_sha256: String,
    detection: &Detection,
) -> Result<String, Failure> {
    let key = prepared.key();
    let hashes = [
        hex::encode(key.original_sha256),
        suspect_sha256,
        hex::encode(Sha256::digest(files::read_small(&args.key, files::LARGEST_KEY)?)),
    ];
    let names = [&args.original, &args.suspect, &args.key].map(|p| p.display().to_string());
    let [original_file, suspect_file, key_file] =
        std::array::from_fn(|i| FileLabel { name: &names[i], sha256: &hashes[i] });
    let command = format!(
        "sombrero detect {} --original {} --key {} --method {} --threshold {:e} --registration {} --resampling {} --seed {}",
        quoted(&names[1]),
        quoted(&names[0]),
        quoted(&names[2]),
        method(args.method).name(),
        args.threshold,
        word(args.registration),
        word(args.resampling),
        args.seed
    );
    let input = DetectionReport {
        detection,
        key,
        original: prepared.model(),
        suspect,
        found: Some(&detection.found),
        original_file,
        suspect_file,
        key_file,
        command: &command,
        date: None,
    };
    detection_report(&input).map_err(|e| Failure::new("internal", e.to_string()))
}

/// As the command line has it.
fn word(step: Step) -> &'static str {
    match step {
        Step::Auto => "auto",
        Step::Always => "always",
        Step::Never => "never",
    }
}

/// For a POSIX shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-/+:".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

fn method(method: Method) -> sombrero::Method {
    match method {
        Method::Robust => sombrero::Method::Robust,
        Method::Paper => sombrero::Method::Paper,
    }
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
        DetectError::NeedsResampling => Failure::about("needs_resampling", &args.suspect, error),
        DetectError::Threshold { .. } => Failure::new("usage", error.to_string()),
        _ => Failure::about("suspect", &args.suspect, error),
    }
}

fn text(args: &Detect, d: &Detection) -> String {
    let verdict = if d.detected { "FOUND: the mark is in" } else { "NOT FOUND: the mark was not found in" };
    let mut lines = vec![
        format!("{verdict} {}", args.suspect.display()),
        format!(
            "  log10 p       {:.1} (threshold {:.1}): the chance that an unmarked mesh matches as well",
            d.log10_p,
            d.threshold.log10()
        ),
        format!("  correlation   {:.4} over {} coefficients", d.correlation, d.coefficients_used),
        format!("  coverage      {:.1} % of the original's area", 100.0 * d.coverage),
        format!("  method        {}", how(d)),
        format!("  seconds       {:.2}", d.seconds.total()),
    ];
    lines.extend(d.warnings.iter().map(|w| format!("  note          {w}")));
    lines.join("\n")
}

/// The variant that won, in words.
fn how(d: &Detection) -> String {
    let v = &d.variant;
    let step = |yes: bool, name: &str| format!("{} {name}", if yes { "with" } else { "without" });
    let registration = step(v.registration, "registration");
    match d.method {
        sombrero::Method::Paper => format!("paper, {registration}, {}", step(v.resampling, "resampling")),
        _ => {
            let compared = if v.resampling { "surfaces" } else { "vertices" };
            format!(
                "robust, {registration}, {compared} compared; solved for: {}; best of {} variants",
                v.nuisance, d.variants_counted
            )
        }
    }
}
