//! Is a key genuine, and since when has it existed?

use super::args::Args;
use crate::answer::{Answer, Context};
use crate::failure::Failure;
use crate::files;
use crate::table::Table;
use crate::timestamp::{self, Stamp};
use serde::Serialize;
use sombrero::Detector;
use sombrero::watermark::Key;

#[derive(Serialize)]
struct Report {
    genuine: bool,
    owner: String,
    recipient: String,
    coefficients: usize,
    epsilon: f64,
    basis: String,
    original_sha256: String,
    basis_sha256: String,
    commitment: String,
    timestamp: Option<Stamp>,
}

pub(super) fn check(args: &Args, bytes: &[u8], context: &Context) -> Result<Answer, Failure> {
    let path = &args.file;
    let key = Key::from_json(bytes)
        .map_err(|e| Failure::new("key", format!("{}: neither a report nor a key: {e}", path.display())))?;
    let Some(original) = &args.original else {
        let message =
            format!("{}: a key is checked against the file that was marked; give --original", path.display());
        return Err(Failure::new("usage", message));
    };
    files::check_outputs(&[], &[path, original], false)?;
    let anchors = timestamp::anchors(args.ca.as_deref())?;
    let document = files::read_mesh(original, context)?;
    let detector = Detector::new(&document, key).map_err(|e| Failure::about("key", path, &e))?;
    let key = detector.key();
    let stamp = timestamp::of_key(path, key, &anchors)?;
    let report = Report {
        genuine: true,
        owner: key.identity.owner.clone(),
        recipient: key.identity.recipient.clone(),
        coefficients: key.parameters.basis.coefficients,
        epsilon: key.parameters.epsilon,
        basis: key.parameters.basis.function.to_string(),
        original_sha256: hex::encode(key.original_sha256),
        basis_sha256: hex::encode(key.basis_sha256),
        commitment: hex::encode(key.commitment()),
        timestamp: stamp,
    };
    let head = format!(
        "{} is genuine: watermark and basis follow from its secret and {}",
        path.display(),
        original.display()
    );
    let mark =
        format!("{} coefficients, {} basis, epsilon {}", report.coefficients, report.basis, report.epsilon);
    let stamp = report
        .timestamp
        .as_ref()
        .map_or_else(|| Table::default().row("timestamp", "none; see `sombrero commit`"), Stamp::rows);
    let text = Table::new(head)
        .row("owner", or_none(&report.owner))
        .row("recipient", or_none(&report.recipient))
        .row("mark", mark)
        .row("original", format!("SHA-256 {}", report.original_sha256))
        .row("basis", format!("SHA-256 {}", report.basis_sha256))
        .row("commitment", format!("SHA-256 {}", report.commitment))
        .and(stamp);
    Answer::new(text, &report)
}

fn or_none(text: &str) -> &str {
    if text.is_empty() { "(none)" } else { text }
}
