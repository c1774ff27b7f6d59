//! `sombrero compare`.

use crate::args::Compare;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, Context, files};
use sombrero::{CompareError, compare};

pub(crate) fn run(args: &Compare, context: &Context) -> Result<Answer, Failure> {
    files::check_outputs(&[], &[&args.a, &args.b], false)?;
    let _progress = Progress::new("comparing");
    let (a, b) = (files::read_mesh(&args.a, context.limits)?, files::read_mesh(&args.b, context.limits)?);
    let c = compare(&a, &b).map_err(|e| failure(args, &e))?;
    let mut lines = vec![
        format!("{} and {}", args.a.display(), args.b.display()),
        format!("  Hausdorff     {:.4e} ({:.6} of the largest side)", c.hausdorff, c.relative_hausdorff),
        format!("  rms           {:.4e} ({:.6})", c.rms, c.relative_rms),
        format!("  mean          {:.4e}", c.mean),
    ];
    if let (Some(rms), Some(max)) = (c.vertex_rms, c.vertex_max) {
        lines.push(format!("  vertices      moved by {rms:.4e} rms, {max:.4e} max (same connectivity)"));
    }
    Answer::new(lines.join("\n"), &c)
}

/// Names the file that the error is about.
fn failure(args: &Compare, error: &CompareError) -> Failure {
    let path = if matches!(error, CompareError::NoFaces { which: "first" }) { &args.a } else { &args.b };
    Failure::about("mesh", path, error)
}
