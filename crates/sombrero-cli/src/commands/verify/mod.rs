//! `sombrero verify`: a key, or a report.

pub(crate) mod args;
mod beside;
mod key;
mod report;

use crate::answer::{Answer, Context};
use crate::failure::Failure;
use crate::files;
use crate::progress::Progress;
use args::Args;
use sombrero_report::Record;

/// A page with pictures and two meshes has a few MB.
const LARGEST_REPORT: u64 = 256 << 20;

pub(crate) fn run(args: &Args, context: &Context) -> Result<Answer, Failure> {
    let _progress = Progress::new(format!("verifying {}", args.file.display()));
    let read = || files::read_small(&args.file, LARGEST_REPORT, "a key or a report");
    let bytes = context.desk.file_or(&args.file, read)?;
    let recorded = Record::find(&bytes).map_err(|e| Failure::about("report", &args.file, &e))?;
    match recorded {
        Some(recorded) => report::check(args, &recorded, context),
        None => key::check(args, &bytes, context),
    }
}
