//! Original, suspect and the distance between them, drawn.

use super::words::percent;
use super::{DetectionReport, ReportError};
use base64::{Engine, engine::general_purpose::STANDARD};
use maud::{Markup, html};
use nalgebra::{Matrix4, Point3, Vector3};
use sombrero_mesh::{BoundingBox, Soup};
use sombrero_render::{Camera, ColorMap, HeatMap, Image, RenderOptions, render, used_points};

/// Pixels of a picture: twice what a page shows, for sharp screens.
const SIZE: [u32; 2] = [880, 660];

/// The pictures of a report, ready to be put into a page.
pub(super) struct Pictures {
    original: String,
    suspect: String,
    /// Why the suspect's picture is not what one would expect, if so.
    suspect_remark: Option<&'static str>,
    distances: Option<(String, Distances)>,
}

impl Pictures {
    pub(super) fn new(input: &DetectionReport<'_>) -> Result<Self, ReportError> {
        let original = input.original.soup();
        let suspect = aligned(input);
        let camera = camera(original);
        let (suspect_camera, suspect_remark) = match placement(original, &suspect) {
            Placement::Empty => (camera, Some("It has no surface to draw.")),
            Placement::Near => (camera, None),
            Placement::Elsewhere => {
                let remark = "It lies elsewhere or has another size, and is drawn in a frame of its own, turned as it is.";
                (self::camera(&suspect), Some(remark))
            }
        };
        let distances = Distances::new(input).map(|distances| {
            let heat = HeatMap { range: Some((0.0, distances.scale())), bar: false, ..distances.heat_map() };
            Ok::<_, ReportError>((draw(original, camera, Some(heat))?, distances))
        });
        Ok(Self {
            original: draw(original, camera, None)?,
            suspect: draw(&suspect, suspect_camera, None)?,
            suspect_remark,
            distances: distances.transpose()?,
        })
    }

    pub(super) fn section(&self) -> Markup {
        html! {
            section {
                h2 { "The shapes" }
                div.gallery {
                    (plate(&self.original, "The original, shaded", html! { b { "The original." } }))
                    (plate(&self.suspect, "The suspect, shaded", html! {
                        b { "The suspect." } " "
                        (self.suspect_remark.unwrap_or("It is seen from the same place as the original."))
                    }))
                }
                @match &self.distances {
                    Some((picture, distances)) => (distances.section(picture)),
                    None => p {
                        "How far the suspect’s surface is from the original’s is not shown: it is not known which point "
                        "belongs to which."
                    }
                }
            }
        }
    }
}

fn plate(picture: &str, alternative: &str, caption: Markup) -> Markup {
    let [width, height] = SIZE;
    html! {
        figure.plate {
            img src=(picture) alt=(alternative) width=(width) height=(height);
            figcaption { (caption) }
        }
    }
}

/// The suspect where detection put it.
fn aligned(input: &DetectionReport<'_>) -> Soup {
    let mut soup = input.suspect.clone();
    if let Some(alignment) = &input.detection.registration {
        let matrix = Matrix4::from_fn(|row, column| alignment.matrix[row][column]);
        soup.points.iter_mut().for_each(|point| *point = matrix.transform_point(point));
    }
    soup
}

/// From the front, a little from the right and from above.
fn camera(soup: &Soup) -> Camera {
    let direction = Vector3::new(-0.45, -0.35, -1.0);
    Camera::framing(&used_points(&soup.points, &soup.triangles), direction, Vector3::y())
}

/// Where the suspect is, seen from the original.
#[derive(Debug, PartialEq, Eq)]
enum Placement {
    /// There is nothing to see.
    Empty,
    /// The original's frame shows it.
    Near,
    /// In the original's frame it would be a speck or out of sight.
    Elsewhere,
}

fn placement(original: &Soup, suspect: &Soup) -> Placement {
    let bounds = |soup: &Soup| BoundingBox::of(&used_points(&soup.points, &soup.triangles));
    let (Some(a), Some(b)) = (bounds(original), bounds(suspect)) else {
        return Placement::Empty;
    };
    let side = a.largest_side();
    // Part of the original lies inside its box, however small; what sticks out would be cut off.
    let inside = (0..3).all(|k| b.min[k] > a.min[k] - 0.1 * side && b.max[k] < a.max[k] + 0.1 * side);
    let visible = b.largest_side() > 0.2 * side;
    if inside && visible { Placement::Near } else { Placement::Elsewhere }
}

/// A picture on no background, so that it suits light and dark pages, as a data URI.
fn draw(soup: &Soup, camera: Camera, heat_map: Option<HeatMap>) -> Result<String, ReportError> {
    let options = RenderOptions {
        width: SIZE[0],
        height: SIZE[1],
        camera: Some(camera),
        background: [0; 4],
        // The page shrinks the picture by half, which smooths again.
        supersampling: 2,
        heat_map,
        ..RenderOptions::default()
    };
    data_uri(&render(&soup.points, &soup.triangles, &options))
}

fn data_uri(image: &Image) -> Result<String, ReportError> {
    Ok(format!("data:image/png;base64,{}", STANDARD.encode(image.to_png()?)))
}

/// How far each point of the original is from its place on the suspect, as a share of the largest side; NaN
/// where that is not known.
struct Distances {
    shares: Vec<f64>,
    /// The known ones, ascending.
    known: Vec<f64>,
    missing: usize,
}

impl Distances {
    /// `None` when no point's place is known, or the original has no size to compare with.
    fn new(input: &DetectionReport<'_>) -> Option<Self> {
        let side = input.original.largest_side();
        let soup = input.original.soup();
        let mut shares = vec![f64::NAN; soup.points.len()];
        for ((share, point), found) in shares.iter_mut().zip(&soup.points).zip(input.found?) {
            *share = found.map_or(f64::NAN, |found| distance(point, &found) / side);
        }
        // Only what belongs to the surface counts.
        let used: Vec<f64> =
            shares.iter().zip(soup.used()).filter(|(_, used)| *used).map(|(s, _)| *s).collect();
        let mut known: Vec<f64> = used.iter().copied().filter(|share| share.is_finite()).collect();
        known.sort_by(f64::total_cmp);
        let missing = used.len() - known.len();
        (!known.is_empty()).then_some(Self { shares, known, missing })
    }

    fn heat_map(&self) -> HeatMap {
        HeatMap::new(self.shares.clone())
    }

    fn max(&self) -> f64 {
        self.known.last().copied().unwrap_or(0.0)
    }

    fn median(&self) -> f64 {
        self.known.get(self.known.len() / 2).copied().unwrap_or(0.0)
    }

    /// What the last colour means. Any will do when nothing moved, but the range needs an extent.
    fn scale(&self) -> f64 {
        if self.max() > 0.0 { self.max() } else { 1.0 }
    }

    fn section(&self, picture: &str) -> Markup {
        let alternative = format!("The original, coloured by distance to the suspect. {}", self.in_words());
        html! {
            div.beside.distances {
                (plate(picture, &alternative, self.bar()))
                div {
                    h3 { "How far they are apart" }
                    p {
                        "The original’s surface, coloured by how far each of its points is from its place on the suspect. "
                        "All lengths are in percent of the original’s largest side."
                    }
                    p { (self.in_words()) }
                }
            }
        }
    }

    fn in_words(&self) -> String {
        if self.max() == 0.0 {
            return format!("No point has moved at all.{}", self.missing_in_words());
        }
        let rms = (self.known.iter().map(|s| s * s).sum::<f64>() / self.known.len() as f64).sqrt();
        format!(
            "Dark violet is no distance, bright yellow is the largest, {}. Half of the points are within {}; the root \
             mean square is {}.{}",
            percent(self.max()),
            percent(self.median()),
            percent(rms),
            self.missing_in_words()
        )
    }

    fn missing_in_words(&self) -> String {
        match self.missing {
            0 => String::new(),
            1 => " One point was not found on the suspect; the surface around it stays clay.".into(),
            n => format!(" {n} points were not found on the suspect; the surface around them stays clay."),
        }
    }

    fn bar(&self) -> Markup {
        let stops: Vec<String> = (0..=8)
            .map(|step| ColorMap::Viridis.color(f64::from(step) / 8.0))
            .map(|[r, g, b]| format!("rgb({r},{g},{b})"))
            .collect();
        let ticks = [0.0, 0.5, 1.0].map(|share| percent(share * self.max()));
        html! {
            div.bar {
                div style={ "background:linear-gradient(to right," (stops.join(",")) ")" } {}
                p { @for tick in ticks { span { (tick) } } }
            }
        }
    }
}

/// The distance, or NaN when it is not finite.
fn distance(a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    let length = (b - a).norm();
    if length.is_finite() { length } else { f64::NAN }
}
