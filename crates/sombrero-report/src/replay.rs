//! Does every figure of a report hold? The detection is made again and compared, without tolerance: it is deterministic to
//! the bit.

use crate::evidence::FileHash;
use crate::record::Record;
use serde::Serialize;
use serde_json::Value;
use sombrero::io::Document;
use sombrero::watermark::Key;
use sombrero::{DetectError, Detector};

/// What a report says of itself rather than of the files, or what differs from run to run.
const NOT_FIGURES: [&str; 9] =
    ["claim", "seconds", "warnings", "prepared", "program", "files", "settings", "suspect", "report"];

/// The result of a replay.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Replay {
    /// Whether the files are those of the report; if not, nothing else was compared.
    pub same_files: bool,
    /// The number of values that were compared.
    pub compared: usize,
    /// The values that are others now, in the order of their names.
    pub differences: Vec<Difference>,
}

impl Replay {
    /// Whether every value was found again.
    pub fn holds(&self) -> bool {
        self.differences.is_empty()
    }
}

/// A value that is another one now.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Difference {
    /// Its place, such as `variants[3].log10_p`.
    pub field: String,
    /// The value that the report has.
    pub recorded: Value,
    /// The value that was found.
    pub found: Value,
}

/// Makes the detection of a report again, with its settings, and compares hashes and every figure.
///
/// # Errors
/// [`DetectError`] when the files are those of the report and yet no detection can be made.
pub fn replay(
    record: &Record,
    suspect: &Document,
    original: &Document,
    key: Key,
) -> Result<Replay, DetectError> {
    let named = &record.evidence.files;
    let hash = |document: &Document| FileHash::of_mesh("", document).sha256;
    let checks = [
        ("files.suspect.sha256", &named.suspect.sha256, hash(suspect)),
        ("files.original.sha256", &named.original.sha256, hash(original)),
        // The file may hold a timestamp by now; the key is the same.
        ("files.commitment", &named.commitment, hex::encode(key.commitment())),
    ];
    let mut differences = Vec::new();
    let mut compared = 0;
    for (field, recorded, found) in checks {
        compared += compare_value(field, &recorded.as_str().into(), &found.into(), &mut differences);
    }
    // Of other files the figures would be others too.
    let same_files = differences.is_empty();
    if same_files {
        let detector = Detector::new(original, key)?;
        let detection = detector.detect(&detector.suspect(suspect), &record.evidence.settings)?;
        // Only numbers, texts and lists: there is nothing that JSON cannot hold.
        let found = serde_json::to_value(&detection).unwrap_or_default();
        compared += compare(&record.figures, &found, &mut differences);
    }
    Ok(Replay { same_files, compared, differences })
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

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn every_value_is_compared_and_the_place_named() {
        let recorded = json!({ "p": 1e-9, "variants": [{ "p": 1 }, { "p": 2 }], "seconds": 3, "gone": null });
        let found = json!({ "p": 1e-9, "variants": [{ "p": 1 }, { "p": 3 }], "seconds": 4, "new": true });
        let mut differences = Vec::new();
        assert_eq!(compare(&recorded, &found, &mut differences), 5);
        let fields: Vec<&str> = differences.iter().map(|d| d.field.as_str()).collect();
        assert_eq!(fields, ["new", "variants[1].p"]);
        assert_eq!((&differences[1].recorded, &differences[1].found), (&json!(2), &json!(3)));
    }
}
