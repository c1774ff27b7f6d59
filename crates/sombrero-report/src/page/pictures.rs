//! Original, suspect and the distance between them, drawn.

use super::distances::Distances;
use super::shapes::{Placement, Shapes};
use base64::{Engine, engine::general_purpose::STANDARD};
use maud::{Markup, html};
use nalgebra::Vector3;
use sombrero::mesh::Soup;
use sombrero::render::{Camera, HeatMap, Image, ImageError, RenderOptions, render, used_points};

/// How large a picture is: twice what a page shows, for sharp screens.
#[derive(Clone, Copy)]
pub(super) enum Size {
    /// One of a few.
    Large,
    /// One of many.
    Small,
}

impl Size {
    pub(super) fn pixels(self) -> [u32; 2] {
        match self {
            Self::Large => [880, 660],
            Self::Small => [600, 450],
        }
    }
}

/// A shape from where everybody would look at it.
pub(super) fn picture(soup: &Soup, size: Size) -> Result<String, ImageError> {
    draw(soup, camera(soup), None, size)
}

/// The pictures of a report, ready to be put into a page.
pub(super) struct Pictures {
    original: String,
    suspect: String,
    distances: Option<String>,
}

impl Pictures {
    pub(super) fn new(shapes: &Shapes<'_>) -> Result<Self, ImageError> {
        let camera = camera(shapes.original);
        let suspect_camera = match shapes.placement {
            Placement::Elsewhere => self::camera(&shapes.suspect),
            Placement::Empty | Placement::Near => camera,
        };
        let heat =
            |distances: &Distances| draw(shapes.original, camera, Some(distances.heat_map()), Size::Large);
        Ok(Self {
            original: draw(shapes.original, camera, None, Size::Large)?,
            suspect: draw(&shapes.suspect, suspect_camera, None, Size::Large)?,
            distances: shapes.distances.as_ref().map(heat).transpose()?,
        })
    }

    /// Original and suspect side by side, and the map of distances with its scale. `moved` says whether the
    /// suspect was moved first.
    pub(super) fn gallery(&self, shapes: &Shapes<'_>, moved: bool) -> Markup {
        let suspect = if moved { "The suspect, aligned." } else { "The suspect." };
        let remark = shapes.placement.remark();
        html! {
            div.gallery {
                (plate(&self.original, "The original, shaded", html! { b { "The original." } }))
                (plate(&self.suspect, "The suspect, shaded", html! {
                    b { (suspect) } " " (remark.unwrap_or("It is seen from the same place as the original."))
                }))
            }
            @match self.distances.as_ref().zip(shapes.distances.as_ref()) {
                Some((picture, distances)) => (distance_section(picture, distances)),
                None => p.distances {
                    "How far the suspect’s surface is from the original’s is not shown: it is not known which point "
                    "belongs to which."
                }
            }
        }
    }
}

fn distance_section(picture: &str, distances: &Distances) -> Markup {
    let alternative = format!("The original, coloured by distance to the suspect. {}", distances.in_words());
    html! {
        div.beside.distances {
            (plate(picture, &alternative, distances.bar()))
            div {
                h3 { "How far they are apart" }
                p {
                    "The original’s surface, coloured by how far each of its points is from its place on the suspect. "
                    "All lengths are in percent of the original’s largest side."
                }
                p { (distances.in_words()) }
            }
        }
    }
}

fn plate(picture: &str, alternative: &str, caption: Markup) -> Markup {
    let [width, height] = Size::Large.pixels();
    html! {
        figure.plate {
            img src=(picture) alt=(alternative) width=(width) height=(height);
            figcaption { (caption) }
        }
    }
}

/// From the front, a little from the right and from above.
fn camera(soup: &Soup) -> Camera {
    let direction = Vector3::new(-0.45, -0.35, -1.0);
    Camera::framing(&used_points(&soup.points, &soup.triangles), direction, Vector3::y())
}

/// A picture on no background, so that it suits light and dark pages, as a data URI.
fn draw(soup: &Soup, camera: Camera, heat_map: Option<HeatMap>, size: Size) -> Result<String, ImageError> {
    let [width, height] = size.pixels();
    let options = RenderOptions {
        width,
        height,
        camera: Some(camera),
        background: [0; 4],
        // The page shrinks the picture by half, which smooths again.
        supersampling: 2,
        heat_map,
        ..RenderOptions::default()
    };
    data_uri(&render(&soup.points, &soup.triangles, &options))
}

fn data_uri(image: &Image) -> Result<String, ImageError> {
    Ok(format!("data:image/png;base64,{}", STANDARD.encode(image.to_png()?)))
}
