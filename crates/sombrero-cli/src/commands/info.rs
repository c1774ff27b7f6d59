//! `sombrero info`.

use crate::args::Info as Args;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, Context, files};
use sombrero::{Info, info};

pub(crate) fn run(args: &Args, context: &Context) -> Result<Answer, Failure> {
    let _progress = Progress::new(format!("reading {}", args.mesh.display()));
    let info = info(&files::read_mesh(&args.mesh, context.limits)?);
    Answer::new(text(args, &info), &info)
}

fn text(args: &Args, i: &Info) -> String {
    let markable = if i.markable { "yes" } else { "no" };
    let mut lines = vec![
        format!("{}: {}", args.mesh.display(), i.format),
        format!(
            "  vertices      {} stored, {} distinct positions, {} in no face",
            i.vertices, i.points, i.unused_vertices
        ),
        format!("  triangles     {}", i.triangles),
        format!("  topology      {}", topology(i)),
        format!(
            "  defects       {} non-manifold edges, {} non-manifold vertices, {} degenerate, {} doubled, {} turned faces",
            i.nonmanifold_edges, i.nonmanifold_vertices, i.degenerate_faces, i.doubled_faces, i.flipped_faces
        ),
    ];
    if let Some(b) = i.bounding_box {
        // Six digits are for people; programs get all of them.
        let short = |x: f64| format!("{x:.5e}").parse().unwrap_or(x);
        let [x, y, z] = std::array::from_fn(|k| format!("{} to {}", short(b.min[k]), short(b.max[k])));
        lines.push(format!("  bounding box  x {x}, y {y}, z {z}"));
    }
    let measure = |name: &str, value: Option<f64>| value.map(|x| format!("{name} {x:.6e}"));
    let measures: Vec<String> =
        [measure("area", i.area), measure("volume", i.volume)].into_iter().flatten().collect();
    lines.push(format!("  size          {}", measures.join(", ")));
    if !i.attributes.is_empty() {
        lines.push(format!("  attributes    {}", i.attributes.join(", ")));
    }
    lines.push(format!("  markable      {markable}; at most {} coefficients", i.capacity));
    lines.extend(i.warnings.iter().map(|w| format!("  note          {w}")));
    lines.join("\n")
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
