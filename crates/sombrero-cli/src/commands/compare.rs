//! `sombrero compare`.

use crate::answer::{Answer, Context};
use crate::failure::Failure;
use crate::fidelity;
use crate::files;
use crate::lengths::length;
use crate::progress::Progress;
use crate::table::Table;
use sombrero::{CompareError, compare};
use std::path::PathBuf;

// What is typed after `sombrero compare`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The first mesh; relative lengths are fractions of its size.
    a: PathBuf,
    /// The second mesh.
    b: PathBuf,
}

pub(crate) fn run(args: &Args, context: &Context) -> Result<Answer, Failure> {
    files::check_outputs(&[], &[&args.a, &args.b], false)?;
    let _progress = Progress::new("comparing");
    let (a, b) = (files::read_mesh(&args.a, context)?, files::read_mesh(&args.b, context)?);
    let c = compare(&a, &b).map_err(|e| failure(args, &e))?;
    let moved = c.vertex_rms.zip(c.vertex_max);
    // Of two units none can be said.
    let unit = a.unit().filter(|unit| b.unit() == Some(unit));
    let length = |x| length(x, unit);
    let text = Table::new(format!("{} and {}", args.a.display(), args.b.display()))
        .row(
            "Hausdorff",
            format!("{} ({:.6} of the largest side)", length(c.hausdorff), c.relative_hausdorff),
        )
        .row("rms", format!("{} ({:.6})", length(c.rms), c.relative_rms))
        .row("mean", length(c.mean))
        .rows(
            "vertices",
            moved.map(|(rms, max)| {
                format!("moved by {} rms, {} max (same connectivity)", length(rms), length(max))
            }),
        )
        .and(c.fidelity.as_ref().map_or_else(Table::default, |f| fidelity::rows(f, unit)));
    Answer::new(text, &c)
}

/// Names the file that the error is about.
fn failure(args: &Args, error: &CompareError) -> Failure {
    let path = if matches!(error, CompareError::NoFaces { which: "first" }) { &args.a } else { &args.b };
    Failure::about("mesh", path, error)
}
