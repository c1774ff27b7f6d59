//! `sombrero verify`.

use crate::args::Verify;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, files};
use serde::Serialize;
use sombrero::Prepared;
use sombrero::io::{Document, Limits};

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
}

pub(crate) fn run(args: &Verify, limits: Limits) -> Result<Answer, Failure> {
    let _progress = Progress::new(format!("verifying {}", args.key.display()));
    let key = files::read_key(&args.key)?;
    let original = Document::read_within(&args.original, limits)?;
    let prepared = Prepared::new(&original, key).map_err(|e| Failure::about("key", &args.key, &e))?;
    let key = prepared.key();
    let report = Report {
        genuine: true,
        owner: key.identity.owner.clone(),
        recipient: key.identity.recipient.clone(),
        coefficients: key.parameters.basis.coefficients,
        epsilon: key.parameters.epsilon,
        basis: key.parameters.basis.function.to_string(),
        original_sha256: hex::encode(key.original_sha256),
        basis_sha256: hex::encode(key.basis_sha256),
    };
    let text = format!(
        "{} is genuine: watermark and basis follow from its secret and {}\n  owner         {}\n  recipient     {}\n  \
         mark          {} coefficients, {} basis, epsilon {}\n  original      SHA-256 {}\n  basis         SHA-256 {}",
        args.key.display(),
        args.original.display(),
        or_none(&report.owner),
        or_none(&report.recipient),
        report.coefficients,
        report.basis,
        report.epsilon,
        report.original_sha256,
        report.basis_sha256,
    );
    Answer::new(text, &report)
}

fn or_none(text: &str) -> &str {
    if text.is_empty() { "(none)" } else { text }
}
