//! Does a report hold? The detection is made again, and from it the record and the page, and they are compared without
//! tolerance: all is deterministic to the bit.
//!
//! What the files cannot tell is taken from the record, in forms that leave no room for words of its own:
//!
//! - seconds: a number for each stage, and the stages have to be the same;
//! - the program's version: `sombrero` and a number;
//! - whether a prepared file was used, with a [`Remark`] about it;
//! - names and paths of the files, which the hashes bind to what was in them;
//! - the hash of the key's file, where the file was written anew since, with a timestamp; its commitment binds the key.

use crate::comparison::{Difference, compare, compare_pages};
use crate::evidence::{FileHash, PROGRAM};
use crate::page::{PageError, page};
use crate::record::{MEASURED, Record, record};
use crate::remark::Remark;
use crate::report::Report;
use serde_json::Value;
use sombrero::io::Document;
use sombrero::watermark::Key;
use sombrero::{Claim, Commitment, DetectError, DetectOptions, Detection, Detector, Stages};
use thiserror::Error;

/// The fields that a report by itself may have and a page has not: the name of the page that was written beside it, and why
/// a prepared file was not used.
const BESIDE: [(&str, &str); 2] =
    [("report", "the name of the page"), ("prepared_note", "why a prepared file was not used")];

/// The stage that comes before those of a detection.
const PREPARATION: &str = "preparation";

/// The reason why a report cannot be made again.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The files are those of the report, and yet no detection can be made.
    #[error(transparent)]
    Detection(#[from] DetectError),
    /// The page cannot be made.
    #[error(transparent)]
    Page(#[from] PageError),
}

/// The result of a replay.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Replay {
    /// Whether the files are those of the report; if not, nothing else was compared.
    pub same_files: bool,
    /// The number of values that were compared.
    pub compared: usize,
    /// Whether a page was compared too, byte for byte.
    pub page_compared: bool,
    /// The values that are others now, in the order of their names; the page comes last, with the first place.
    pub differences: Vec<Difference>,
    /// The parts that no file tells and that were therefore taken from the report, as phrases.
    pub taken_over: Vec<&'static str>,
}

impl Replay {
    /// Whether every value was found again.
    pub fn holds(&self) -> bool {
        self.differences.is_empty()
    }
}

/// Makes the detection of a report again, with its settings, and compares hashes, every figure, and the page if it is one.
/// `key_file` is what the key was read from, `commitment` what its timestamp proves by the authorities that the reader trusts.
///
/// # Errors
/// [`ReplayError`] when the files are those of the report and yet it cannot be made again.
pub fn replay(
    report: &Record,
    suspect: &Document,
    original: &Document,
    key: Key,
    key_file: &[u8],
    commitment: Option<Commitment>,
) -> Result<Replay, ReplayError> {
    let mut replay = compare_files(report, suspect, original, &key);
    // Of other files the figures would be others too.
    if !replay.same_files {
        return Ok(replay);
    }
    replay.taken_over = taken_over(report, &key, key_file);
    let detector = Detector::new(original, key)?;
    let suspect = detector.suspect(suspect);
    // What was over in time then need not be now.
    let spent = report.figures["budget_spent"] == true;
    let DetectOptions { budget, .. } = report.evidence.settings;
    let settings = DetectOptions { budget: budget.filter(|_| spent), ..report.evidence.settings };
    let mut detection = detector.detect(&suspect, &settings)?;
    complete(&mut detection, &report.figures);
    let commitment = claimed(commitment, &report.figures["claim"]);
    let Detection { detected, log10_p, .. } = detection;
    let claim = Claim::new(detected, log10_p, detector.key(), commitment, &report.evidence.settings);
    let again = Report {
        detection: &detection,
        claim: &claim,
        key: detector.key(),
        original: detector.model(),
        suspect: &suspect.soup,
        prepared: is_prepared(&report.figures),
        evidence: &report.evidence,
    };
    let (recorded, found) = comparable(report, record(&again));
    replay.compared += compare("", &recorded, &found, &mut replay.differences);
    if let Some(html) = &report.page {
        replay.page_compared = true;
        replay.differences.extend(compare_pages(html, &page(&again)?));
    }
    Ok(replay)
}

/// Whether files and program are what the report says.
fn compare_files(report: &Record, suspect: &Document, original: &Document, key: &Key) -> Replay {
    let named = &report.evidence.files;
    let hash = |document: &Document| FileHash::of_mesh("", document).sha256;
    let checks = [
        ("files.suspect.sha256", &named.suspect.sha256, hash(suspect)),
        ("files.original.sha256", &named.original.sha256, hash(original)),
        // The file may hold a timestamp by now; the key is the same.
        ("files.commitment", &named.commitment, hex::encode(key.commitment())),
    ];
    let (mut differences, mut compared) = (Vec::new(), 0);
    for (field, recorded, found) in checks {
        compared += compare(field, &recorded.as_str().into(), &found.into(), &mut differences);
    }
    let same_files = differences.is_empty();
    let program = &report.evidence.program;
    if same_files && !is_program(program) {
        compared += compare("program", &program.as_str().into(), &PROGRAM.into(), &mut differences);
    }
    Replay { same_files, compared, page_compared: false, differences, taken_over: Vec::new() }
}

/// `sombrero` and a version of three numbers.
fn is_program(name: &str) -> bool {
    let number =
        |part: &str| (1..=4).contains(&part.len()) && part.bytes().all(|digit| digit.is_ascii_digit());
    name.strip_prefix("sombrero ")
        .is_some_and(|version| version.split('.').count() == 3 && version.split('.').all(number))
}

fn taken_over(report: &Record, key: &Key, key_file: &[u8]) -> Vec<&'static str> {
    let unstamped = Key { timestamp: None, path: None, ..key.clone() }.to_json();
    let written_anew = [key_file, unstamped.as_bytes()]
        .iter()
        .all(|content| FileHash::new("", content).sha256 != report.evidence.files.key.sha256);
    let anew = "the hash of the key's file, which was written anew since (its commitment was compared)";
    let mut parts = vec!["seconds", "whether a prepared file was used"];
    parts.extend(written_anew.then_some(anew));
    let beside =
        BESIDE.iter().filter(|(field, _)| report.page.is_none() && report.figures.get(field).is_some());
    parts.extend(beside.map(|(_, part)| part));
    parts
}

fn is_prepared(figures: &Value) -> bool {
    figures["prepared"] == true
}

/// Gives a detection the seconds of the report, and the remark that no file tells.
fn complete(detection: &mut Detection, figures: &Value) {
    let recorded = &figures["seconds"];
    let mut stages = std::mem::take(&mut detection.seconds).0;
    // A report may leave them out, so that it is the same whenever it is made, as those of the demo are.
    if recorded.as_object().is_some_and(|recorded| recorded.is_empty()) {
        stages.clear();
    }
    if recorded.get(PREPARATION).is_some() {
        stages.insert(0, (PREPARATION, 0.0));
    }
    // What is no number of seconds stays 0 and differs.
    let second = |stage: &str| recorded[stage].as_f64().filter(|seconds| *seconds >= 0.0).unwrap_or(0.0);
    detection.seconds = Stages(stages.into_iter().map(|(stage, _)| (stage, second(stage))).collect());
    let last = figures["warnings"].as_array().and_then(|warnings| warnings.get(detection.warnings.len()));
    let remark = last
        .and_then(Value::as_str)
        .and_then(|text| Remark::find(text, detection.detected, is_prepared(figures)));
    detection.warnings.extend(remark.map(|remark| remark.sentence().to_owned()));
}

/// The commitment as far as the report claims it: a timestamp may have been stored since, and the reader may trust more.
/// What it claims beyond what was found is a difference.
fn claimed(commitment: Option<Commitment>, claim: &Value) -> Option<Commitment> {
    let Commitment { time, trusted } = commitment.filter(|_| claim["committed_at"].is_string())?;
    Some(Commitment { time, trusted: trusted && claim["trusted"] == true })
}

/// Both sides without what a report by itself may have or not have.
fn comparable(report: &Record, mut found: Value) -> (Value, Value) {
    let mut recorded = report.figures.clone();
    if report.page.is_none() {
        if let Some(recorded) = recorded.as_object_mut() {
            BESIDE.iter().for_each(|(field, _)| {
                recorded.remove(*field);
            });
        }
        if let Some(found) = found.as_object_mut() {
            MEASURED.iter().filter(|field| report.figures.get(field).is_none()).for_each(|field| {
                found.remove(*field);
            });
        }
    }
    (recorded, found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_has_a_version_and_no_more() {
        for name in [PROGRAM, "sombrero 0.1.0", "sombrero 12.0.345"] {
            assert!(is_program(name), "{name}");
        }
        for name in
            ["", "sombrero", "sombrero 1.0", "sombrero 1.0.0, certified", "another 1.0.0", "sombrero 1.0.x"]
        {
            assert!(!is_program(name), "{name}");
        }
    }
}
