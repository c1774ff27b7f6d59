//! `sombrero embed`.

use crate::args::Embed;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, files};
use nalgebra::Point3;
use serde::Serialize;
use sombrero::basis::BasisOptions;
use sombrero::io::{Access, Companion, Document, Limits, Output, Rewrite, write_together};
use sombrero::watermark::{Identity, Parameters};
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

pub(crate) fn run(args: &Embed, limits: Limits) -> Result<Answer, Failure> {
    let inputs: Vec<&Path> =
        [&args.input].into_iter().chain(&args.secret_file).map(PathBuf::as_path).collect();
    files::check_outputs(&[&args.output, &args.key], &inputs, args.force)?;
    let secret = files::secret(args.secret_file.as_deref())?;
    let _progress = Progress::new(format!("marking {}", args.input.display()));
    let original = Document::read_within(&args.input, limits)?;
    let options = EmbedOptions {
        parameters: parameters(args),
        fewer_if_small: args.coefficients.is_none(),
        identity: Identity { owner: args.owner.clone(), recipient: args.recipient.clone() },
        rewrite: rewrite(args),
    };
    let marked = embed(&original, secret, &options).map_err(|e| Failure::about("mesh", &args.input, &e))?;
    let key = marked.key.to_json();
    let beside = |path: &Path, companion: &Companion| path.with_file_name(&companion.name);
    let companions: Vec<PathBuf> = marked.companions.iter().map(|c| beside(&args.output, c)).collect();
    let buffers: Vec<PathBuf> = original.companions().iter().map(|c| beside(&args.input, c)).collect();
    let mut outputs = vec![
        Output { path: &args.output, bytes: &marked.bytes, access: Access::Usual },
        Output { path: &args.key, bytes: key.as_bytes(), access: Access::Private },
    ];
    let contents = companions.iter().zip(&marked.companions);
    outputs.extend(contents.map(|(path, c)| Output { path, bytes: &c.bytes, access: Access::Usual }));
    let paths: Vec<&Path> = outputs.iter().map(|o| o.path).collect();
    let inputs: Vec<&Path> = inputs.into_iter().chain(buffers.iter().map(PathBuf::as_path)).collect();
    files::check_outputs(&paths, &inputs, args.force)?;
    write_together(&outputs, files::overwrite(args.force))?;
    check_written(args, limits, &marked)?;
    let [output, key] = [&args.output, &args.key].map(|path| path.display().to_string());
    Answer::new(text(args, &marked.report), &Report { output, key, report: &marked.report })
}

/// How the copy is to be written.
fn rewrite(args: &Embed) -> Rewrite {
    let rewrite = Rewrite::default().with_renewed_normals(args.recompute_normals);
    match args.output.file_stem().and_then(OsStr::to_str) {
        Some(stem) => rewrite.with_stem(stem),
        None => rewrite,
    }
}

/// Reads the copy back from the disk: its mark was found before it was written, so its positions must be the same.
fn check_written(args: &Embed, limits: Limits, marked: &Marked) -> Result<(), Failure> {
    // A copy may take more bytes than the original, whose size was the limit.
    let limits = limits.with_max_bytes(u64::MAX);
    let bits =
        |points: &[Point3<f64>]| points.iter().flat_map(|p| [p.x, p.y, p.z].map(f64::to_bits)).collect();
    let copy = Document::read_within(&args.output, limits)?;
    let [written, meant]: [Vec<u64>; 2] = [bits(copy.points()), bits(&marked.points)];
    if written == meant {
        return Ok(());
    }
    let message =
        format!("{}: reads back otherwise than it was written; check the disk", args.output.display());
    Err(Failure::new("write", message))
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

fn text(args: &Embed, report: &EmbedReport) -> String {
    let d = report.distortion;
    let mut lines = vec![
        format!("marked {} → {}", args.input.display(), args.output.display()),
        format!("  key           {} (secret; keep it together with the original)", args.key.display()),
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
        format!("  read back     log10 p = {:.1}", report.log10_p),
        format!("  seconds       {:.2}", report.seconds.total()),
    ];
    lines.extend(report.warnings.iter().map(|w| format!("  note          {w}")));
    lines.join("\n")
}
