//! A commitment to one key.

use super::{Args, LARGEST_TOKEN, meaning};
use crate::answer::{Answer, Context};
use crate::failure::Failure;
use crate::files;
use crate::progress::Progress;
use crate::table::Table;
use crate::timestamp::{self, Stamp};
use serde::Serialize;
use sombrero::Detector;
use sombrero::io::{Access, Output};
use sombrero::watermark::Key;
use sombrero_timestamp::{Token, request};
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Report {
    digest: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    request: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    statement: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    timestamp: Option<Stamp>,
}

pub(super) fn run(args: &Args, key_path: &Path, context: &Context) -> Result<Answer, Failure> {
    let request_path = match args.token {
        Some(_) => None,
        None => Some(args.output.clone().unwrap_or_else(|| key_path.with_added_extension("tsq"))),
    };
    let outputs: Vec<&Path> = request_path.iter().chain(&args.statement).map(PathBuf::as_path).collect();
    let given = args.token.iter().chain(&args.ca).map(PathBuf::as_path);
    let inputs: Vec<&Path> = [args.input.as_path(), key_path].into_iter().chain(given).collect();
    files::check_outputs(&outputs, &inputs, args.force)?;
    let _progress = Progress::new(format!("verifying {}", key_path.display()));
    let key = files::read_key(key_path)?;
    let original = files::read_mesh(&args.input, context)?;
    // Nobody shall wait for a timestamp of a key that is of no use.
    let detector = Detector::new(&original, key).map_err(|e| Failure::about("key", key_path, &e))?;
    let key = detector.key();
    let digest = key.commitment();
    let statement = key.statement();

    let request = request(&digest, None);
    let mut written = Vec::new();
    if let Some(path) = &args.statement {
        written.push(Output { path, bytes: statement.as_bytes(), access: Access::Private });
    }
    if let Some(path) = &request_path {
        written.push(Output { path, bytes: &request, access: Access::Usual });
    }
    files::write_all(&written, args.force)?;
    let stamp = match &args.token {
        Some(token) => Some(store(args, key_path, key, token)?),
        None => None,
    };
    let name = |path: &PathBuf| path.display().to_string();
    let report = Report {
        digest: hex::encode(digest),
        request: request_path.as_ref().map(name),
        statement: args.statement.as_ref().map(name),
        timestamp: stamp,
    };
    Answer::new(text(args, key_path, &report), &report)
}

/// Checks the authority's answer and puts the token into the key file.
fn store(args: &Args, key_path: &Path, key: &Key, path: &Path) -> Result<Stamp, Failure> {
    if key.timestamp.is_some() && !args.force {
        let message = format!("{}: has a timestamp already; give --force to replace it", key_path.display());
        return Err(Failure::new("timestamp", message));
    }
    let anchors = timestamp::anchors(args.ca.as_deref())?;
    let answer = files::read_small(path, LARGEST_TOKEN, "the authority's answer")?;
    let stamp = timestamp::check(path, &answer, &key.commitment(), &anchors)?;
    let token = Token::from_der(&answer).map_err(|e| Failure::about("timestamp", path, &e))?;
    // It is for the commitment by itself.
    let stamped = Key { timestamp: Some(token.to_der().to_vec()), path: None, ..key.clone() }.to_json();
    files::write_all(&[Output { path: key_path, bytes: stamped.as_bytes(), access: Access::Private }], true)?;
    Ok(stamp)
}

fn text(args: &Args, key_path: &Path, report: &Report) -> Table {
    let (key, input) = (key_path.display(), args.input.display());
    let mut table = Table::new(format!("commitment to {key} and {input}"))
        .row("digest", format!("SHA-256 {}", report.digest));
    if let Some(request) = &report.request {
        table = table.row("request", format!("{request} (RFC 3161: send it to a timestamping authority)"));
    }
    if let Some(statement) = &report.statement {
        table = table.row("statement", format!("{statement} (secret: it opens the commitment)"));
    }
    if let Some(stamp) = &report.timestamp {
        table = table
            .row("stored", format!("in {key}, whose hash changes; its commitment does not"))
            .and(stamp.rows());
    }
    table.and(meaning())
}
