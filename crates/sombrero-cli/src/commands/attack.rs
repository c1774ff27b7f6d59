//! `sombrero attack`.

use crate::args::AttackArgs;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, Context, Outcome, files};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use sombrero::attack;
use sombrero::io::{Access, Output};

#[derive(Serialize)]
struct Report {
    output: String,
    attacks: Vec<String>,
    seed: u64,
    vertices: usize,
    faces: usize,
    kept_file: bool,
}

pub(crate) fn run(args: &AttackArgs, context: &Context) -> Result<Outcome, Failure> {
    files::check_standard_output(&args.output, context)?;
    files::check_outputs(&[&args.output], &[&args.input], args.force)?;
    let _progress = Progress::new(format!("attacking {}", args.input.display()));
    let document = files::read_mesh(&args.input, context.limits)?;
    let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
    let attacked =
        attack(&document, &args.attacks, &mut rng).map_err(|e| Failure::about("attack", &args.input, &e))?;
    let output = Output { path: &args.output, bytes: &attacked.bytes, access: Access::Usual };
    files::write_all(&[output], args.force)?;
    let report = Report {
        output: args.output.display().to_string(),
        attacks: args.attacks.iter().map(ToString::to_string).collect(),
        seed: args.seed,
        vertices: attacked.soup.points.len(),
        faces: attacked.soup.triangles.len(),
        kept_file: attacked.kept_file,
    };
    let file = if attacked.kept_file { "all but positions kept" } else { "bare mesh, connectivity changed" };
    let text = format!(
        "attacked {} → {}\n  attacks       {}\n  mesh          {} points, {} triangles ({file})",
        args.input.display(),
        args.output.display(),
        report.attacks.join(" "),
        report.vertices,
        report.faces,
    );
    Ok(files::answered(&args.output, Answer::new(text, &report)?))
}
