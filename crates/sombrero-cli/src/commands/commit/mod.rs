//! `sombrero commit`: one key, or all keys of a folder under one timestamp.

mod many;
mod one;

use crate::answer::{Answer, Context};
use crate::failure::Failure;
use crate::table::Table;
use std::path::PathBuf;

// What is typed after `sombrero commit`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The file that was marked.
    input: PathBuf,
    /// Its key.
    #[arg(long, value_name = "FILE", required_unless_present = "keys")]
    key: Option<PathBuf>,
    /// A folder of its keys, which share one timestamp: each keeps its place in a tree of all of them.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["key", "statement"])]
    keys: Option<PathBuf>,
    /// The request to write. Default: KEY.tsq, or DIR.tsq.
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

pub(crate) fn run(args: &Args, context: &Context) -> Result<Answer, Failure> {
    match (&args.key, &args.keys) {
        (Some(key), None) => one::run(args, key, context),
        (None, Some(folder)) => many::run(args, folder, context),
        _ => Err(Failure::new(
            "usage",
            "a commitment is to a key or to a folder of keys; give --key or --keys",
        )),
    }
}

/// The worth of the digest, in words.
fn meaning() -> Table {
    Table::default()
        .row("proves", "once it is timestamped: original, key and both texts existed then, in this form")
        .row("proves not", "who had them, who made the model, or that nobody had it before")
}
