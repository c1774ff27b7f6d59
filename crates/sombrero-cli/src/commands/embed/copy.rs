//! One marked copy: made, written with its key, read back, told of.

use super::args::Order;
use super::folder::other_key;
use crate::answer::{Answer, Context};
use crate::failure::Failure;
use crate::fidelity;
use crate::files;
use crate::lengths::length;
use crate::table::Table;
use nalgebra::Point3;
use serde::Serialize;
use sombrero::io::{Access, Companion, Document, Limits, Output};
use sombrero::watermark::{Key, Secret};
use sombrero::{EmbedOptions, EmbedReport, Marked, embed};
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Report<'a> {
    output: String,
    key: String,
    #[serde(flatten)]
    report: &'a EmbedReport,
}

/// The places that a copy comes from and goes to.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub(super) input: &'a Path,
    pub(super) output: &'a Path,
    pub(super) key: &'a Path,
}

pub(super) fn mark(
    order: &Order<'_>,
    original: &Document,
    place: &Place<'_>,
    secret: Secret,
) -> Result<Marked, Failure> {
    let options = EmbedOptions { rewrite: order.rewrite(place.output), ..order.options.clone() };
    embed(original, secret, &options).map_err(|e| Failure::about("mesh", place.input, &e))
}

/// Writes key, copy and what belongs beside the copy, all or nothing, and reads the copy back. With a `kept` key of an
/// earlier run that was broken off, what is missing of the copy that it belongs to.
pub(super) fn write(
    marked: &Marked,
    original: &Document,
    place: &Place<'_>,
    inputs: &[&Path],
    kept: Option<&Key>,
    force: bool,
    context: &Context,
) -> Result<(), Failure> {
    let key = marked.key.to_json();
    let beside = |path: &Path, companion: &Companion| path.with_file_name(&companion.name);
    let companions: Vec<PathBuf> = marked.companions.iter().map(|c| beside(place.output, c)).collect();
    let buffers: Vec<PathBuf> = original.companions().iter().map(|c| beside(place.input, c)).collect();
    // The key first: a run that is broken off leaves what the copy can be made of, never a copy without its key. The copy
    // last: where it is, all is.
    let mut outputs = vec![Output { path: place.key, bytes: key.as_bytes(), access: Access::Private }];
    let contents = companions.iter().zip(&marked.companions);
    outputs.extend(contents.map(|(path, c)| Output { path, bytes: &c.bytes, access: Access::Usual }));
    outputs.push(Output { path: place.output, bytes: &marked.bytes, access: Access::Usual });
    if let Some(kept) = kept {
        if kept.commitment() != marked.key.commitment() {
            return Err(other_key(place.key));
        }
        outputs.remove(0);
        outputs.retain(|output| !fs::read(output.path).is_ok_and(|there| there == output.bytes));
    }
    let paths: Vec<&Path> = outputs.iter().map(|o| o.path).collect();
    let inputs: Vec<&Path> = inputs.iter().copied().chain(buffers.iter().map(PathBuf::as_path)).collect();
    let desk = context.desk;
    files::check_outputs(&desk.on_disk(&paths), &inputs, force)?;
    files::write_with(&outputs, force, desk)?;
    if files::is_standard(place.output) || desk.takes(place.output) {
        return Ok(());
    }
    check_written(place.output, context.limits, marked)
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
    let message = format!(
        "{}: reads back otherwise than it was written; if no other run replaced it, check the disk",
        output.display()
    );
    Err(Failure::new("write", message))
}

pub(super) fn answer(place: &Place<'_>, report: &EmbedReport) -> Result<Answer, Failure> {
    let [output, key] = [place.output, place.key].map(|path| path.display().to_string());
    Answer::new(text(place, report), &Report { output, key, report })
}

fn text(place: &Place<'_>, report: &EmbedReport) -> Table {
    let (d, unit) = (report.distortion, report.unit.as_deref());
    let mark =
        format!("{} coefficients, {} basis, epsilon {}", report.coefficients, report.basis, report.epsilon);
    let displacement = format!(
        "max {}, rms {} (of the largest side: {:.5}, {:.5})",
        length(d.max, unit),
        length(d.rms, unit),
        d.relative_max,
        d.relative_rms
    );
    let halved = report
        .log10_p_halved
        .map_or_else(String::new, |p| format!(", after noise of 0.1 % and simplification to half {p:.1}"));
    let read_back = format!(
        "log10 p = {:.1}; by the paper's test after noise of 0.2 % {:.1}{halved}",
        report.log10_p, report.log10_p_after_noise
    );
    Table::new(format!("marked {} → {}", place.input.display(), place.output.display()))
        .row("key", format!("{} (secret; keep it together with the original)", place.key.display()))
        .row("mesh", format!("{} vertices, {} triangles", report.vertices, report.faces))
        .row("mark", mark)
        .row("displacement", displacement)
        .and(report.fidelity.as_ref().map_or_else(Table::default, |f| fidelity::rows(f, unit)))
        .row("read back", read_back)
        .row("seconds", format!("{:.2}", report.seconds.total()))
        .rows("note", &report.warnings)
}
