//! The report for programs, as JSON by itself or carried by a page for people.
//!
//! JSON stays the same JSON when a sign inside one of its strings is written as `\uXXXX`, and the signs that could
//! end a script or start a tag appear nowhere else in JSON. With them escaped, no file name can close the element
//! that holds it, and whoever reads the page back needs to undo nothing.

use crate::evidence::Evidence;
use crate::repeated::{self, RepeatedField};
use crate::report::Report;
use base64::{Engine, engine::general_purpose::STANDARD};
use nalgebra::DMatrix;
use serde::Serialize;
use serde_json::Value;
use sombrero::{Claim, Detection};

/// The fields of a record.
#[derive(Serialize)]
struct Fields<'a> {
    suspect: &'a str,
    #[serde(flatten)]
    detection: &'a Detection,
    claim: &'a Claim,
    #[serde(skip_serializing_if = "Option::is_none")]
    centre: Option<&'a [f64]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    precision: Option<String>,
    prepared: bool,
    #[serde(flatten)]
    evidence: &'a Evidence,
}

/// The fields without which nobody can compute the ellipsoid test anew. They are long: a report for other programs may go
/// without, a page may not.
pub const MEASURED: [&str; 2] = ["centre", "precision"];

/// A report as one JSON object: the fields of [`Detection`] and of [`Evidence`], `claim`, `suspect` (its name), `prepared`, and
/// of the robust method [`MEASURED`]: `centre`, which is w* with all its m coefficients, and `precision`, the lower
/// triangle of P row by row, each number as 8 bytes with the least first, in base64.
pub fn record(report: &Report<'_>) -> Value {
    let Report { detection, claim, prepared, evidence, .. } = *report;
    let measured = detection.measured.as_ref();
    let fields = Fields {
        suspect: &evidence.files.suspect.path,
        detection,
        claim,
        centre: measured.map(|measured| measured.centre.as_slice()),
        precision: measured.map(|measured| lower_triangle(&measured.precision)),
        prepared,
        evidence,
    };
    // Only numbers, texts and lists, under names: there is nothing that JSON cannot hold.
    serde_json::to_value(fields).unwrap_or_default()
}

/// The lower triangle of a square matrix, row by row, in base64.
fn lower_triangle(matrix: &DMatrix<f64>) -> String {
    let rows = (0..matrix.nrows()).flat_map(|i| (0..=i).map(move |j| (i, j)));
    STANDARD.encode(rows.flat_map(|place| matrix[place].to_le_bytes()).collect::<Vec<u8>>())
}

/// The record of a report, read back.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// All of it, as [`record()`] wrote it.
    pub figures: Value,
    /// The part that says how it came about.
    pub evidence: Evidence,
    /// The page that carries it; `None` when it stands by itself.
    pub page: Option<String>,
}

impl Record {
    /// The record in a page of [`page`](crate::page()), or that is the whole file; `None` for other files.
    ///
    /// Only its shape is checked: anybody can write such a file, so a reader has to test what it says.
    ///
    /// # Errors
    /// [`RepeatedField`] when it has a field twice, in whatever it holds: nobody could say which is meant.
    pub fn find(bytes: &[u8]) -> Result<Option<Self>, RepeatedField> {
        let Some((record, json)) = Self::read(bytes) else { return Ok(None) };
        repeated::check(json)?;
        Ok(Some(record))
    }

    /// The record and its JSON. Of fields that are there twice the last counts.
    fn read(bytes: &[u8]) -> Option<(Self, &str)> {
        let text = std::str::from_utf8(bytes).ok()?;
        let alone = text.trim_start().starts_with('{');
        let json = if alone { text } else { embedded(text)? };
        let figures: Value = serde_json::from_str(json).ok()?;
        let evidence = serde_json::from_value(figures.clone()).ok()?;
        figures.get("detected")?;
        Some((Self { figures, evidence, page: (!alone).then(|| text.to_owned()) }, json))
    }

    /// Whether it says that the mark was found.
    pub fn detected(&self) -> bool {
        self.figures["detected"] == true
    }

    /// The log10 p that it names; 0 if none.
    pub fn log10_p(&self) -> f64 {
        self.figures["log10_p"].as_f64().unwrap_or(0.0)
    }
}

const START: &str = "<script type=\"application/json\" id=\"sombrero-evidence\">";
const END: &str = "</script>";

/// The HTML element that carries a record.
pub(crate) fn element(record: &Value) -> String {
    format!("{START}{}{END}", escaped(&record.to_string()))
}

/// JSON that may stand inside an element. Line separators are escaped too, because some readers of JSON stumble.
fn escaped(json: &str) -> String {
    let mut text = String::with_capacity(json.len());
    for sign in json.chars() {
        match sign {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => text += &format!("\\u{:04x}", u32::from(sign)),
            _ => text.push(sign),
        }
    }
    text
}

/// The JSON in a page's element; `None` when there is none, or more than one, since then nobody can say which is meant.
fn embedded(page: &str) -> Option<&str> {
    let (_, rest) = page.split_once(START)?;
    let (json, rest) = rest.split_once(END)?;
    (!rest.contains(START)).then_some(json)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_closes_the_element() {
        let record = serde_json::json!({ "name": "</script><!--&\u{2028}\u{2029}\\" });
        let page = format!("<p></p>{}<p></p>", element(&record));
        let text = embedded(&page).unwrap_or_default();
        assert_eq!(text, r#"{"name":"\u003c/script\u003e\u003c!--\u0026\u2028\u2029\\"}"#);
        assert_eq!(serde_json::from_str::<Value>(text).ok(), Some(record));
    }

    #[test]
    fn a_triangle_is_written_row_by_row() {
        let matrix = nalgebra::dmatrix![1.0, 9.0; 2.0, 3.0];
        let bytes = STANDARD.decode(lower_triangle(&matrix)).unwrap();
        let numbers: Vec<f64> =
            bytes.chunks_exact(8).map(|eight| f64::from_le_bytes(eight.try_into().unwrap())).collect();
        assert_eq!(numbers, [1.0, 2.0, 3.0]);
    }

    #[test]
    fn none_or_two_are_no_record() {
        let one = element(&serde_json::json!({}));
        assert_eq!(embedded(&one), Some("{}"));
        assert_eq!(embedded(""), None);
        assert_eq!(embedded(START), None);
        assert_eq!(embedded(&(one.clone() + &one)), None);
        assert_eq!(Record::find(b"{\"detected\":true}"), Ok(None));
    }
}
