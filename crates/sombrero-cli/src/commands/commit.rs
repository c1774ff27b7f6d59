//! `sombrero commit`.

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

// What is typed after `sombrero commit`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The file that was marked.
    input: PathBuf,
    /// Its key.
    #[arg(long, value_name = "FILE")]
    key: PathBuf,
    /// The request to write. Default: KEY.tsq.
    #[arg(short, long, value_name = "FILE", conflicts_with = "token")]
    output: Option<PathBuf>,
    /// Also write the statement that the digest is of. It opens the commitment and is as secret as the key.
    #[arg(long, value_name = "FILE")]
    statement: Option<PathBuf>,
    /// The authority's answer, to be checked and stored in the key.
    #[arg(long, value_name = "FILE")]
    token: Option<PathBuf>,
    /// Certificates (PEM) of the timestamping authorities that you trust.
    #[arg(long, value_name = "FILE", requires = "token")]
    ca: Option<PathBuf>,
    /// Replace outputs that exist, or a token that the key has.
    #[arg(long)]
    force: bool,
}

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

pub(crate) fn run(args: &Args, context: &Context) -> Result<Answer, Failure> {
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
fn store(args: &Args, key: &Key, path: &Path) -> Result<Stamp, Failure> {
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

fn text(args: &Args, report: &Report) -> Table {
    let (key, input) = (args.key.display(), args.input.display());
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
    table
        .row("proves", "once it is timestamped: original, key and both texts existed then, in this form")
        .row("proves not", "who had them, who made the model, or that nobody had it before")
}
