//! `sombrero prepare`.

use crate::answer::{Answer, Context};
use crate::failure::Failure;
use crate::files;
use crate::progress::Progress;
use crate::table::Table;
use serde::Serialize;
use sombrero::Detector;
use sombrero::io::{Access, Output};
use std::path::PathBuf;

// What is typed after `sombrero prepare`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The file that was marked, exactly.
    #[arg(long, value_name = "FILE")]
    original: PathBuf,
    /// The key that `embed` wrote.
    #[arg(long, value_name = "FILE")]
    key: PathBuf,
    /// The prepared file, readable by you alone. Default: KEY.prepared, where `detect` looks for it.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace a prepared file that exists.
    #[arg(long)]
    force: bool,
}

#[derive(Serialize)]
struct Report {
    output: String,
    vertices: usize,
    coefficients: usize,
    bytes: usize,
}

pub(crate) fn run(args: &Args, context: &Context) -> Result<Answer, Failure> {
    let path = args.output.clone().unwrap_or_else(|| files::beside_key(&args.key));
    files::check_outputs(&[&path], &[&args.original, &args.key], args.force)?;
    let _progress = Progress::new(format!("preparing {}", args.original.display()));
    let key = files::read_key(&args.key)?;
    let original = files::read_mesh(&args.original, context)?;
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
    let original = args.original.display();
    let text =
        Table::new(format!("prepared {original} → {} (keep it as private as the original)", report.output))
            .row("basis", format!("{} coefficients, {} vertices", report.coefficients, report.vertices))
            .row("size", format!("{:.1} MB", report.bytes as f64 / 1e6));
    Answer::new(text, &report)
}
