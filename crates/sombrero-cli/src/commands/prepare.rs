//! `sombrero prepare`.

use crate::args::Prepare;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, Context, files};
use serde::Serialize;
use sombrero::Detector;
use sombrero::io::{Access, Output};

#[derive(Serialize)]
struct Report {
    output: String,
    vertices: usize,
    coefficients: usize,
    bytes: usize,
}

pub(crate) fn run(args: &Prepare, context: &Context) -> Result<Answer, Failure> {
    let path = args.output.clone().unwrap_or_else(|| files::beside_key(&args.key));
    files::check_outputs(&[&path], &[&args.original, &args.key], args.force)?;
    let _progress = Progress::new(format!("preparing {}", args.original.display()));
    let key = files::read_key(&args.key)?;
    let original = files::read_mesh(&args.original, context.limits)?;
    let detector = Detector::new(&original, key).map_err(|e| Failure::about("key", &args.key, &e))?;
    let bytes = detector.prepared_basis();
    // The basis tells of the original's shape, which is as private as the key.
    let output = Output { path: &path, bytes: &bytes, access: Access::Private };
    files::write_all(&[output], args.force)?;
    let report = Report {
        output: path.display().to_string(),
        vertices: detector.basis().vertex_count(),
        coefficients: detector.basis().functions().len(),
        bytes: bytes.len(),
    };
    let text = format!(
        "prepared {} → {} (keep it as private as the original)\n  basis         {} coefficients, {} vertices\n  \
         size          {:.1} MB",
        args.original.display(),
        report.output,
        report.coefficients,
        report.vertices,
        report.bytes as f64 / 1e6
    );
    Answer::new(text, &report)
}
