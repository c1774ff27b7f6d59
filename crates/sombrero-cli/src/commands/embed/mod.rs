//! `sombrero embed`: one copy, a copy of each of several files, or a copy for each buyer.

mod copies;
mod recipients;

use crate::args::Embed;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, Context, Outcome, batch, files};
use nalgebra::Point3;
use serde::Serialize;
use sombrero::basis::BasisOptions;
use sombrero::io::{Access, Companion, Document, Limits, Output, Rewrite};
use sombrero::watermark::{Identity, Parameters, Secret};
use sombrero::{EmbedOptions, EmbedReport, Marked, embed};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Report<'a> {
    output: String,
    key: String,
    #[serde(flatten)]
    report: &'a EmbedReport,
}

pub(crate) fn run(args: &Embed, context: &Context) -> Result<Outcome, Failure> {
    match (&args.out_dir, &args.recipients, &args.output, &args.key) {
        (Some(folder), Some(list), ..) => recipients::run(args, folder, list, context),
        (Some(folder), None, ..) => copies::run(args, folder, context),
        (None, _, Some(output), Some(key)) => one(args, output, key, context),
        _ => {
            Err(Failure::new("usage", "a copy and its key need names; give --output and --key, or --out-dir"))
        }
    }
}

fn one(args: &Embed, output: &Path, key: &Path, context: &Context) -> Result<Outcome, Failure> {
    let input = &args.inputs[0];
    if let Some(second) = args.inputs.get(1) {
        let message = format!(
            "{}: a second input cannot share the output; give --out-dir instead of -o and --key",
            second.display()
        );
        return Err(Failure::new("usage", message));
    }
    if !batch::is_one(&args.inputs) {
        let message = format!(
            "{}: a folder, not a regular file; give --out-dir instead of -o and --key",
            input.display()
        );
        return Err(Failure::new("read", message));
    }
    files::check_standard_output(output, context)?;
    if files::is_standard(key) {
        return Err(Failure::new("usage", "a key is not printed, it is secret; give it the name of a file"));
    }
    let inputs: Vec<&Path> = [input].into_iter().chain(&args.secret_file).map(PathBuf::as_path).collect();
    files::check_outputs(&[output, key], &inputs, args.force)?;
    let secret = match files::given_secret(args.secret_file.as_deref())? {
        Some(secret) => secret,
        None => files::new_secret()?,
    };
    let _progress = Progress::new(format!("marking {}", input.display()));
    let original = files::read_mesh(input, context.limits)?;
    let marked = mark(args, &original, input, output, secret)?;
    let place = Place { input, output, key };
    write(&marked, &original, &place, &inputs, args.force, context.limits)?;
    Ok(files::answered(output, answer(&place, &marked.report)?))
}

/// Where a copy comes from and goes to.
#[derive(Clone, Copy)]
struct Place<'a> {
    input: &'a Path,
    output: &'a Path,
    key: &'a Path,
}

fn mark(
    args: &Embed,
    original: &Document,
    input: &Path,
    output: &Path,
    secret: Secret,
) -> Result<Marked, Failure> {
    let options = EmbedOptions {
        parameters: parameters(args),
        fewer_if_small: args.coefficients.is_none(),
        max_displacement: args.max_displacement,
        identity: Identity { owner: args.owner.clone(), recipient: args.recipient.clone() },
        rewrite: rewrite(args, output),
    };
    embed(original, secret, &options).map_err(|e| Failure::about("mesh", input, &e))
}

/// Writes copy, key and what belongs beside the copy, all or nothing, and reads the copy back.
fn write(
    marked: &Marked,
    original: &Document,
    place: &Place<'_>,
    inputs: &[&Path],
    force: bool,
    limits: Limits,
) -> Result<(), Failure> {
    let key = marked.key.to_json();
    let beside = |path: &Path, companion: &Companion| path.with_file_name(&companion.name);
    let companions: Vec<PathBuf> = marked.companions.iter().map(|c| beside(place.output, c)).collect();
    let buffers: Vec<PathBuf> = original.companions().iter().map(|c| beside(place.input, c)).collect();
    let mut outputs = vec![
        Output { path: place.output, bytes: &marked.bytes, access: Access::Usual },
        // After the copy: where the key is, the copy is whole.
        Output { path: place.key, bytes: key.as_bytes(), access: Access::Private },
    ];
    let contents = companions.iter().zip(&marked.companions);
    outputs.splice(0..0, contents.map(|(path, c)| Output { path, bytes: &c.bytes, access: Access::Usual }));
    let paths: Vec<&Path> = outputs.iter().map(|o| o.path).collect();
    let inputs: Vec<&Path> = inputs.iter().copied().chain(buffers.iter().map(PathBuf::as_path)).collect();
    files::check_outputs(&paths, &inputs, force)?;
    files::write_all(&outputs, force)?;
    if files::is_standard(place.output) { Ok(()) } else { check_written(place.output, limits, marked) }
}

/// Reads the copy back from the disk: its mark was found before it was written, so its positions must be the same.
fn check_written(output: &Path, limits: Limits, marked: &Marked) -> Result<(), Failure> {
    // A copy may take more bytes than the original, whose size was the limit.
    let limits = limits.with_max_bytes(u64::MAX);
    let bits =
        |points: &[Point3<f64>]| points.iter().flat_map(|p| [p.x, p.y, p.z].map(f64::to_bits)).collect();
    let copy = Document::read_within(output, limits)?;
    let [written, meant]: [Vec<u64>; 2] = [bits(copy.points()), bits(&marked.points)];
    if written == meant {
        return Ok(());
    }
    let message = format!("{}: reads back otherwise than it was written; check the disk", output.display());
    Err(Failure::new("write", message))
}

/// How the copy is to be written.
fn rewrite(args: &Embed, output: &Path) -> Rewrite {
    let rewrite = Rewrite::default().with_renewed_normals(args.recompute_normals);
    match output.file_stem().and_then(OsStr::to_str) {
        Some(stem) => rewrite.with_stem(stem),
        None => rewrite,
    }
}

/// The preset's, as far as nothing else was asked for.
fn parameters(args: &Embed) -> Parameters {
    let Parameters { basis, epsilon } = args.preset.parameters();
    Parameters {
        basis: BasisOptions {
            coefficients: args.coefficients.unwrap_or(basis.coefficients),
            function: args.basis.unwrap_or(basis.function),
            ..basis
        },
        epsilon: args.epsilon.unwrap_or(epsilon),
    }
}

fn answer(place: &Place<'_>, report: &EmbedReport) -> Result<Answer, Failure> {
    let [output, key] = [place.output, place.key].map(|path| path.display().to_string());
    Answer::new(text(place, report), &Report { output, key, report })
}

fn text(place: &Place<'_>, report: &EmbedReport) -> String {
    let d = report.distortion;
    let mut lines = vec![
        format!("marked {} → {}", place.input.display(), place.output.display()),
        format!("  key           {} (secret; keep it together with the original)", place.key.display()),
        format!("  mesh          {} vertices, {} triangles", report.vertices, report.faces),
        format!(
            "  mark          {} coefficients, {} basis, epsilon {}",
            report.coefficients, report.basis, report.epsilon
        ),
        format!(
            "  displacement  max {:.3e}, rms {:.3e} (of the largest side: {:.5}, {:.5})",
            d.max, d.rms, d.relative_max, d.relative_rms
        ),
        format!("  normals       turned by {:.2} degrees rms", d.normals_rms.to_degrees()),
        format!(
            "  read back     log10 p = {:.1}; by the paper's test after noise of 0.2 % {:.1}",
            report.log10_p, report.log10_p_after_noise
        ),
        format!("  seconds       {:.2}", report.seconds.total()),
    ];
    lines.extend(report.warnings.iter().map(|w| format!("  note          {w}")));
    lines.join("\n")
}
