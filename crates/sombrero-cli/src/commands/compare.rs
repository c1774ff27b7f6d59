//! `sombrero compare`.

use crate::answer::{Answer, Context};
use crate::failure::Failure;
use crate::fidelity;
use crate::files;
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
    let (a, b) = (files::read_mesh(&args.a, context.limits)?, files::read_mesh(&args.b, context.limits)?);
    let c = compare(&a, &b).map_err(|e| failure(args, &e))?;
    let moved = c.vertex_rms.zip(c.vertex_max);
    let text = Table::new(format!("{} and {}", args.a.display(), args.b.display()))
        .row("Hausdorff", format!("{:.4e} ({:.6} of the largest side)", c.hausdorff, c.relative_hausdorff))
        .row("rms", format!("{:.4e} ({:.6})", c.rms, c.relative_rms))
        .row("mean", format!("{:.4e}", c.mean))
        .rows(
            "vertices",
            moved.map(|(rms, max)| format!("moved by {rms:.4e} rms, {max:.4e} max (same connectivity)")),
        )
        .and(c.fidelity.as_ref().map_or_else(Table::default, fidelity::rows));
    Answer::new(text, &c)
}

/// Names the file that the error is about.
fn failure(args: &Args, error: &CompareError) -> Failure {
    let path = if matches!(error, CompareError::NoFaces { which: "first" }) { &args.a } else { &args.b };
    Failure::about("mesh", path, error)
}
