//! `sombrero render`.

use crate::answer::{Answer, Context, Outcome};
use crate::failure::Failure;
use crate::files;
use crate::lengths::length;
use crate::progress::Progress;
use crate::table::Table;
use clap::ValueEnum;
use nalgebra::Vector3;
use serde::Serialize;
use sombrero::Model;
use sombrero::io::{Access, Output};
use sombrero::mesh::Soup;
use sombrero::render::{Camera, HeatMap, RenderOptions, Wireframe, render, used_points};
use sombrero::spatial::Surface;
use std::path::{Path, PathBuf};

// What is typed after `sombrero render`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The mesh to draw.
    mesh: PathBuf,
    /// The picture, as PNG.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// A mesh to measure the distance from; both stay where they stand.
    #[arg(long, value_name = "MESH")]
    compare: Option<PathBuf>,
    /// Pixels along each side.
    #[arg(long, value_name = "N", default_value_t = 800, value_parser = clap::value_parser!(u32).range(16..=4096))]
    size: u32,
    /// The axis that points upwards: y in most files for display, z in many of scanners and printers.
    #[arg(long, value_enum, default_value_t = Up::Y)]
    up: Up,
    /// Draw the edges of the triangles.
    #[arg(long)]
    wireframe: bool,
    /// Replace a picture that exists.
    #[arg(long)]
    force: bool,
}

/// An axis of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Up {
    Y,
    Z,
}

#[derive(Serialize)]
struct Report {
    output: String,
    width: u32,
    height: u32,
    /// Distances from the vertices of the mesh to the surface of the other one, in model units: the ends of the scale.
    #[serde(skip_serializing_if = "Option::is_none")]
    scale: Option<[f64; 2]>,
}

pub(crate) fn run(args: &Args, context: &Context) -> Result<Outcome, Failure> {
    files::check_standard_output(&args.output, context)?;
    let inputs: Vec<&Path> =
        [Some(&args.mesh), args.compare.as_ref()].into_iter().flatten().map(|p| p.as_path()).collect();
    files::check_outputs(&[&args.output], &inputs, args.force)?;
    let is_png = args.output.extension().is_none_or(|e| e.eq_ignore_ascii_case("png"));
    if !is_png {
        let message = format!("{}: pictures are PNG; give a name that ends in .png", args.output.display());
        return Err(Failure::new("usage", message));
    }
    let _progress = Progress::new(format!("drawing {}", args.mesh.display()));
    let soup = read(&args.mesh, context)?;
    let distances = match &args.compare {
        Some(other) => Some(distances(&soup, &read(other, context)?)),
        None => None,
    };
    let scale =
        distances.as_deref().map(|d| [0.0, d.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max)]);
    let options = RenderOptions {
        width: args.size,
        height: args.size,
        camera: camera(&soup, args.up),
        wireframe: args.wireframe.then(Wireframe::default),
        heat_map: distances
            .zip(scale)
            .map(|(values, [low, high])| HeatMap { range: Some((low, high)), ..HeatMap::new(values) }),
        ..RenderOptions::default()
    };
    let image = render(&soup.points, &soup.triangles, &options);
    let png = image.to_png().map_err(|e| Failure::new("internal", e.to_string()))?;
    files::write_all(&[Output { path: &args.output, bytes: &png, access: Access::Usual }], args.force)?;
    let colours = scale.zip(args.compare.as_ref()).map(|([_, high], other)| {
        format!("distance from {}: dark 0, yellow {} (model units)", other.display(), length(high, None))
    });
    let text = Table::new(format!("drew {} → {}", args.mesh.display(), args.output.display()))
        .rows("colours", colours);
    let report = Report {
        output: args.output.display().to_string(),
        width: options.width,
        height: options.height,
        scale,
    };
    Ok(files::answered(&args.output, Answer::new(text, &report)?))
}

/// A mesh with something to draw. Vertices of equal position are one, so that seams do not show.
fn read(path: &Path, context: &Context) -> Result<Soup, Failure> {
    let soup = Model::new(files::read_mesh(path, context)?.soup()).soup().clone();
    if soup.triangles.is_empty() {
        let message =
            format!("{}: the file has no usable face; a picture needs triangles or polygons", path.display());
        return Err(Failure::new("mesh", message));
    }
    Ok(soup)
}

/// From each vertex of `soup` to the surface of `other`; no number where there is none.
fn distances(soup: &Soup, other: &Soup) -> Vec<f64> {
    let surface = Surface::new(&other.points, &other.triangles);
    surface.closest_many(&soup.points).into_iter().map(|c| c.map_or(f64::NAN, |c| c.distance())).collect()
}

/// The usual view, which has y upwards, or the same with z upwards.
fn camera(soup: &Soup, up: Up) -> Option<Camera> {
    let framed = || used_points(&soup.points, &soup.triangles);
    match up {
        Up::Y => None,
        Up::Z => Some(Camera::framing(&framed(), Vector3::new(-0.45, 1.0, -0.35), Vector3::z())),
    }
}
