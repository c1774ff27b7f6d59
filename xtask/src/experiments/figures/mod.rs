//! `cargo xtask figures`: Figures 1, 2, 4 and 5 of the paper, drawn from our own runs. The same models give the
//! same bytes.

mod figure1;
mod figure2;
mod figure4;
mod figure5;
mod tubes;

use super::case::{Case, random_secret};
use indicatif::{ProgressBar, ProgressStyle};
use nalgebra::{Point3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::mesh::Soup;
use sombrero::render::{Camera, Image, RenderOptions, Wireframe, render, used_points};
use sombrero::watermark::Preset;
use std::path::{Path, PathBuf};

/// Which figures.
#[derive(clap::Args)]
pub(crate) struct Figures {
    /// Numbers of figures, separated by commas. Default: all.
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=5))]
    only: Vec<u32>,
    /// Where `figure1.png` and so on are written.
    #[arg(long, default_value = "docs/figures")]
    out: PathBuf,
}

const SEED: u64 = 4;
const WHITE: [u8; 4] = [255; 4];
/// Pixels between pictures.
const GAP: u32 = 8;

type Draw = fn(&Path) -> anyhow::Result<Image>;
const FIGURES: [(u32, Draw); 4] =
    [(1, figure1::draw), (2, figure2::draw), (4, figure4::draw), (5, figure5::draw)];

pub(crate) fn run(args: &Figures, folder: &Path) -> anyhow::Result<()> {
    let wanted = FIGURES.iter().filter(|(number, _)| args.only.is_empty() || args.only.contains(number));
    let wanted: Vec<&(u32, Draw)> = wanted.collect();
    std::fs::create_dir_all(&args.out)?;
    let bar = ProgressBar::new(wanted.len() as u64);
    bar.set_style(ProgressStyle::with_template("{elapsed} {bar:40} {pos}/{len} figures")?);
    bar.tick();
    for (number, draw) in wanted {
        let path = args.out.join(format!("figure{number}.png"));
        std::fs::write(&path, draw(folder)?.to_png()?)?;
        bar.inc(1);
        bar.suspend(|| println!("{}", path.display()));
    }
    bar.finish_and_clear();
    Ok(())
}

/// A model of the paper with its mark, and where it is looked at from.
struct Exhibit {
    case: Case,
    marked: Soup,
    direction: Vector3<f64>,
    up: Vector3<f64>,
}

impl Exhibit {
    fn read(folder: &Path, name: &str) -> anyhow::Result<Self> {
        let (file, direction, up) = match name {
            "fandisk" => ("fandisk.obj", Vector3::new(-0.75, -0.45, 1.0), Vector3::y()),
            "head" => ("head.obj", Vector3::new(0.55, -1.0, 0.1), -Vector3::z()),
            "dragon" => ("dragon.obj", Vector3::new(-1.0, -0.25, -0.45), Vector3::y()),
            _ => ("bunny.ply", Vector3::new(-0.2, -0.25, -1.0), Vector3::y()),
        };
        let case = Case::read(folder, file, Preset::Paper)?;
        let marked = case.marked(random_secret(&mut rng()))?.copy;
        Ok(Self { case, marked, direction, up })
    }

    fn original(&self) -> &Soup {
        self.case.soup()
    }

    fn marked(&self) -> &Soup {
        &self.marked
    }

    /// The marked model after attacks given as specs.
    fn attacked(&self, specs: &str) -> anyhow::Result<Soup> {
        Ok(apply_all(&parse_list(specs)?, self.marked(), &mut rng())?.soup)
    }

    /// The view that frames the original.
    fn camera(&self) -> Camera {
        self.framing(self.original())
    }

    /// The same direction, framing something else.
    fn framing(&self, soup: &Soup) -> Camera {
        Camera::framing(&used_points(&soup.points, &soup.triangles), self.direction, self.up)
    }
}

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(SEED)
}

fn picture(soup: &Soup, options: &RenderOptions) -> Image {
    render(&soup.points, &soup.triangles, options)
}

/// Thin, light edges.
fn wireframe() -> Option<Wireframe> {
    Some(Wireframe { width: 0.8, opacity: 0.45, ..Wireframe::default() })
}

/// Triangles whose corners are all there.
fn present(points: &[Option<Point3<f64>>], triangles: &[[u32; 3]]) -> Soup {
    let complete = |corners: &&[u32; 3]| corners.iter().all(|&v| points[v as usize].is_some());
    let triangles = triangles.iter().filter(complete).copied().collect();
    Soup::new(points.iter().map(|p| p.unwrap_or_default()).collect(), triangles)
}
