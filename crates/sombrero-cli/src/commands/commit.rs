//! `sombrero commit`.

use crate::args::Commit;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::timestamp::{self, Stamp};
use crate::{Answer, Context, files};
use serde::Serialize;
use sombrero::Detector;
use sombrero::io::{Access, Output};
use sombrero::watermark::Key;
use sombrero_timestamp::{Token, request};
use std::path::{Path, PathBuf};

/// A token holds some certificates.
const LARGEST_TOKEN: u64 = 1 << 20;

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

/// What the digest is good for.
const MEANING: &str = "  proves        once it is timestamped: original, key and both texts existed then, in this form\n  \
    proves not    who had them, who made the model, or that nobody had it before";

pub(crate) fn run(args: &Commit, context: &Context) -> Result<Answer, Failure> {
    let request_path = match args.token {
        Some(_) => None,
        None => Some(args.output.clone().unwrap_or_else(|| args.key.with_added_extension("tsq"))),
    };
    let outputs: Vec<&Path> = request_path.iter().chain(&args.statement).map(PathBuf::as_path).collect();
    let inputs: Vec<&Path> = [&args.input, &args.key]
        .into_iter()
        .chain(&args.token)
        .chain(&args.ca)
        .map(PathBuf::as_path)
        .collect();
    files::check_outputs(&outputs, &inputs, args.force)?;
    let _progress = Progress::new(format!("verifying {}", args.key.display()));
    let key = files::read_key(&args.key)?;
    let original = files::read_mesh(&args.input, context.limits)?;
    // Nobody shall wait for a timestamp of a key that is of no use.
    let detector = Detector::new(&original, key).map_err(|e| Failure::about("key", &args.key, &e))?;
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
        Some(token) => Some(store(args, key, token)?),
        None => None,
    };
    let name = |path: &PathBuf| path.display().to_string();
    let report = Report {
        digest: hex::encode(digest),
        request: request_path.as_ref().map(name),
        statement: args.statement.as_ref().map(name),
        timestamp: stamp,
    };
    Answer::new(text(args, &report), &report)
}

/// Checks the authority's answer and puts the token into the key file.
fn store(args: &Commit, key: &Key, path: &Path) -> Result<Stamp, Failure> {
    if key.timestamp.is_some() && !args.force {
        let message = format!("{}: has a timestamp already; give --force to replace it", args.key.display());
        return Err(Failure::new("timestamp", message));
    }
    let anchors = timestamp::anchors(args.ca.as_deref())?;
    let answer = files::read_small(path, LARGEST_TOKEN)?;
    let stamp = timestamp::check(path, &answer, &key.commitment(), &anchors)?;
    let token = Token::from_der(&answer).map_err(|e| Failure::about("timestamp", path, &e))?;
    let stamped = Key { timestamp: Some(token.to_der().to_vec()), ..key.clone() }.to_json();
    files::write_all(
        &[Output { path: &args.key, bytes: stamped.as_bytes(), access: Access::Private }],
        true,
    )?;
    Ok(stamp)
}

fn text(args: &Commit, report: &Report) -> String {
    let mut lines = vec![format!("commitment to {} and {}", args.key.display(), args.input.display())];
    lines.push(format!("  digest        SHA-256 {}", report.digest));
    if let Some(request) = &report.request {
        lines.push(format!("  request       {request} (RFC 3161: send it to a timestamping authority)"));
    }
    if let Some(statement) = &report.statement {
        lines.push(format!("  statement     {statement} (secret: it opens the commitment)"));
    }
    if let Some(stamp) = &report.timestamp {
        lines.push(format!(
            "  stored        in {}, whose hash changes; its commitment does not",
            args.key.display()
        ));
        lines.extend(stamp.lines());
    }
    lines.push(MEANING.to_owned());
    lines.join("\n")
}
