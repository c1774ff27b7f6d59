//! Figure 4: marked models, and below each of them two attacks on it, those of the paper.
//!
//! | fandisk | head | dragon | bunny |
//! |---|---|---|---|
//! | marked | marked | marked | marked |
//! | F, smoothed | D, noise of 0.45 % | G, moved | I, simplified to 1/8 |
//! | R, everything | J, a second mark | H, simplified to 1/2 | K, cropped |

use super::{Exhibit, GAP, WHITE, picture};
use sombrero::mesh::Soup;
use sombrero::render::{Image, RenderOptions};
use std::path::Path;

const COLUMNS: [(&str, [&str; 2]); 4] = [
    (
        "fandisk",
        [
            "smooth:iterations=10",
            "reorder noise:amplitude=0.002 smooth:iterations=10 transform simplify:ratio=0.5 watermark crop:fraction=0.333",
        ],
    ),
    ("head", ["noise:amplitude=0.0045", "watermark"]),
    ("dragon", ["transform", "simplify:ratio=0.5"]),
    ("bunny", ["simplify:ratio=0.125", "crop:fraction=0.333"]),
];

pub(super) fn draw(folder: &Path) -> anyhow::Result<Image> {
    let columns = COLUMNS.iter().map(|(name, attacks)| column(folder, name, attacks));
    let columns = columns.collect::<anyhow::Result<Vec<Image>>>()?;
    Ok(Image::beside(&columns, GAP, WHITE))
}

fn column(folder: &Path, name: &str, attacks: &[&str]) -> anyhow::Result<Image> {
    let exhibit = Exhibit::read(folder, name)?;
    let drawn = |soup: &Soup, moved: bool| {
        let camera = if moved { exhibit.framing(soup) } else { exhibit.camera() };
        let options =
            RenderOptions { width: 330, height: 300, camera: Some(camera), ..RenderOptions::default() };
        picture(soup, &options)
    };
    let mut pictures = vec![drawn(exhibit.marked(), false)];
    for specs in attacks {
        pictures.push(drawn(&exhibit.attacked(specs)?, specs.contains("transform")));
    }
    Ok(Image::stacked(&pictures, GAP, WHITE))
}
