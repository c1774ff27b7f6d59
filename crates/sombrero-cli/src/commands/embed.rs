//! `sombrero embed`.

use crate::args::Embed;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, files};
use serde::Serialize;
use sombrero::basis::BasisOptions;
use sombrero::io::{Access, Document, Output, write_together};
use sombrero::watermark::{Identity, Parameters};
use sombrero::{EmbedOptions, EmbedReport, embed};
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Report<'a> {
    output: String,
    key: String,
    #[serde(flatten)]
    report: &'a EmbedReport,
}

pub(crate) fn run(args: &Embed) -> Result<Answer, Failure> {
    let inputs: Vec<&Path> =
        [&args.input].into_iter().chain(&args.secret_file).map(PathBuf::as_path).collect();
    files::check_outputs(&[&args.output, &args.key], &inputs, args.force)?;
    let secret = files::secret(args.secret_file.as_deref())?;
    let _progress = Progress::new(format!("marking {}", args.input.display()));
    let original = Document::read(&args.input)?;
    let options = EmbedOptions {
        parameters: parameters(args),
        fewer_if_small: args.coefficients.is_none(),
        identity: Identity { owner: args.owner.clone(), recipient: args.recipient.clone() },
    };
    let marked = embed(&original, secret, &options).map_err(|e| Failure::about("mesh", &args.input, &e))?;
    let key = marked.key.to_json();
    let outputs = [
        Output { path: &args.output, bytes: &marked.bytes, access: Access::Usual },
        Output { path: &args.key, bytes: key.as_bytes(), access: Access::Private },
    ];
    write_together(&outputs, files::overwrite(args.force))?;
    let [output, key] = [&args.output, &args.key].map(|path| path.display().to_string());
    Answer::new(text(args, &marked.report), &Report { output, key, report: &marked.report })
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
