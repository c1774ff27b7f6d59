//! `sombrero info`.

use crate::answer::{Answer, Context};
use crate::failure::Failure;
use crate::files;
use crate::lengths::measure;
use crate::progress::Progress;
use crate::table::Table;
use sombrero::fidelity::digits;
use sombrero::{Info, info};
use std::path::PathBuf;

// What is typed after `sombrero info`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The mesh.
    mesh: PathBuf,
}

pub(crate) fn run(args: &Args, context: &Context) -> Result<Answer, Failure> {
    let _progress = Progress::new(format!("reading {}", args.mesh.display()));
    let info = info(&files::read_mesh(&args.mesh, context)?);
    Answer::new(text(args, &info), &info)
}

fn text(args: &Args, i: &Info) -> Table {
    let unit = i.unit.as_deref();
    let stored =
        format!("{} stored, {} distinct positions, {} in no face", i.vertices, i.points, i.unused_vertices);
    let defects = format!(
        "{} non-manifold edges, {} non-manifold vertices, {} degenerate, {} doubled, {} turned faces",
        i.nonmanifold_edges, i.nonmanifold_vertices, i.degenerate_faces, i.doubled_faces, i.flipped_faces
    );
    let bounding_box = i.bounding_box.as_ref().map(|b| {
        // Six digits are for people; programs get all of them.
        let [x, y, z] =
            std::array::from_fn(|k| format!("{} to {}", digits(b.min[k], 6), digits(b.max[k], 6)));
        format!("x {x}, y {y}, z {z}{}", unit.map_or_else(String::new, |unit| format!(" ({unit})")))
    });
    let named = |name: &str, value: Option<f64>, power| {
        value.map(|x| format!("{name} {}", measure(x, 6, unit, power)))
    };
    let measures: Vec<String> =
        [named("area", i.area, "²"), named("volume", i.volume, "³")].into_iter().flatten().collect();
    let attributes = (!i.attributes.is_empty()).then(|| i.attributes.join(", "));
    let planes = (i.planar_regions > 0).then(|| {
        format!(
            "{} planar regions, {:.0} % of the area, stay planar",
            i.planar_regions,
            100.0 * i.planar_share
        )
    });
    let markable = if i.markable { "yes" } else { "no" };
    Table::new(format!("{}: {}", args.mesh.display(), i.format))
        .row("vertices", stored)
        .row("triangles", i.triangles)
        .row("topology", topology(i))
        .row("defects", defects)
        .rows("bounding box", bounding_box)
        .row("size", measures.join(", "))
        .rows("flats", planes)
        .rows("attributes", attributes)
        .row("markable", format!("{markable}; at most {} coefficients", i.capacity))
        .rows("note", &i.warnings)
}

fn topology(i: &Info) -> String {
    let boundary = match i.boundary_loops {
        0 => "closed".to_owned(),
        1 => format!("1 boundary loop of {} edges", i.boundary_edges),
        loops => format!("{loops} boundary loops of {} edges", i.boundary_edges),
    };
    let genus = i.genus.map_or(String::new(), |g| format!(", genus {g}"));
    format!("{} component{}, {boundary}{genus}", i.components, if i.components == 1 { "" } else { "s" })
}
