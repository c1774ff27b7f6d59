//! `sombrero attack`.

use crate::answer::{Answer, Context, Outcome};
use crate::failure::Failure;
use crate::files;
use crate::progress::Progress;
use crate::table::Table;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use sombrero::attack;
use sombrero::attacks::Attack;
use sombrero::io::{Access, Document, Format, Output, encode};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

// What is typed after `sombrero attack`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The mesh to attack. It stays as it is.
    input: PathBuf,
    /// The attacked mesh. A name of another format than the input's gets the bare mesh in that format.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The attacks, in order.
    #[arg(required = true, value_name = "SPEC")]
    attacks: Vec<Attack>,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Replace an output that exists.
    #[arg(long)]
    force: bool,
}

#[derive(Serialize)]
struct Report {
    output: String,
    attacks: Vec<String>,
    seed: u64,
    vertices: usize,
    faces: usize,
    kept_file: bool,
}

pub(crate) fn run(args: &Args, context: &Context) -> Result<Outcome, Failure> {
    files::check_standard_output(&args.output, context)?;
    files::check_outputs(&context.desk.on_disk(&[&args.output]), &[&args.input], args.force)?;
    let _progress = Progress::new(format!("attacking {}", args.input.display()));
    let document = files::read_mesh(&args.input, context)?;
    let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
    let attacked =
        attack(&document, &args.attacks, &mut rng).map_err(|e| Failure::about("attack", &args.input, &e))?;
    let other = other_format(&args.output, &document);
    let encoded = other.map(|format| encode(format, &attacked.soup)).transpose()?;
    let bytes = encoded.as_deref().unwrap_or(&attacked.bytes);
    let output = Output { path: &args.output, bytes, access: Access::Usual };
    files::write_with(&[output], args.force, context.desk)?;
    let kept_file = attacked.kept_file && other.is_none();
    let report = Report {
        output: args.output.display().to_string(),
        attacks: args.attacks.iter().map(ToString::to_string).collect(),
        seed: args.seed,
        vertices: attacked.soup.points.len(),
        faces: attacked.soup.triangles.len(),
        kept_file,
    };
    let file = match other {
        _ if kept_file => "all but positions kept".to_owned(),
        Some(format) => format!("bare mesh, as {format}"),
        None => "bare mesh, connectivity changed".to_owned(),
    };
    let text = Table::new(format!("attacked {} → {}", args.input.display(), args.output.display()))
        .row("attacks", report.attacks.join(" "))
        .row("mesh", format!("{} points, {} triangles ({file})", report.vertices, report.faces));
    Ok(files::answered(&args.output, Answer::new(text, &report)?))
}

/// The format that the output's name says, where it is another one than the input has.
fn other_format(output: &Path, document: &Document) -> Option<Format> {
    let named = output.extension().and_then(OsStr::to_str).and_then(Format::from_extension);
    named.filter(|named| named.extension() != document.extension())
}
