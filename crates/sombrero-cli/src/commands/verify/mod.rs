//! `sombrero verify`: a key, or a report.

mod key;
mod report;

use crate::args::Verify;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, Context, files};
use sombrero_report::Record;

/// A page with pictures and two meshes has a few MB.
const LARGEST_REPORT: u64 = 256 << 20;

pub(crate) fn run(args: &Verify, context: &Context) -> Result<Answer, Failure> {
    let _progress = Progress::new(format!("verifying {}", args.file.display()));
    let bytes = files::read_small(&args.file, LARGEST_REPORT)?;
    match Record::find(&bytes) {
        Some(recorded) => report::check(args, &recorded, context),
        None => key::check(args, &bytes, context),
    }
}
