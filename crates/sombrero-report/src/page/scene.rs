//! What the view of the page shows: small versions of both shapes, packed.
//!
//! A shape is placed in a cube from -1.25 to 1.25 in which the largest side of the original goes from -1 to 1. Each
//! coordinate is a share of the cube in 16 bits, each corner of a triangle an index of 16 bits, each distance a share of
//! the scale in 8 bits. All are little-endian and in base64:
//!
//! ```json
//! {"shapes": {"original": {"points": "…", "triangles": "…"}, "suspect": {…}}, "distances": "…", "colors": "…"}
//! ```
//!
//! `distances` holds one byte for each point of the original, 255 where none is known; `colors` the 255 colours of the
//! others, three bytes each. Both are left out when no distance is known.

use super::decimate::{Valued, decimated};
use super::distances::{Distances, color};
use super::shapes::{MARGIN, Placement, Shapes};
use base64::{Engine, engine::general_purpose::STANDARD};
use nalgebra::{Point3, Vector3};
use sombrero::mesh::{BoundingBox, Soup};
use sombrero::render::used_points;

/// The view needs no more, and some telephones could not turn more.
const TRIANGLES: usize = 12_000;
/// Half the side of the cube: room for a suspect that sticks out by twice the margin, as its unit is half a side.
const HALF_CUBE: f64 = 1.25;
const _: () = assert!(1.0 + 2.0 * MARGIN < HALF_CUBE);
/// The byte of a missing distance.
const MISSING: u8 = 255;

/// The packed scene, and what there is in it.
pub(super) struct Scene {
    /// As the module's words have it.
    pub(super) json: String,
    /// Whether the suspect has a surface.
    pub(super) suspect: bool,
    /// Whether both may be shown at once.
    pub(super) together: bool,
    pub(super) distances: bool,
    /// Triangles that are shown of the original and of the suspect.
    pub(super) triangles: [usize; 2],
}

impl Scene {
    /// `None` when the original has no surface with an extent.
    pub(super) fn new(shapes: &Shapes<'_>) -> Option<Self> {
        let frame = Frame::around(shapes.original)?;
        let shares = shapes.distances.as_ref().map_or(&[][..], Distances::shares);
        let original = frame.small(shapes.original, shares)?;
        let suspect_frame = match shapes.placement {
            Placement::Near => Some(frame),
            Placement::Elsewhere => Frame::around(&shapes.suspect),
            Placement::Empty => None,
        };
        let suspect = suspect_frame.and_then(|frame| frame.small(&shapes.suspect, &[]));
        let mut json = format!(r#"{{"shapes":{{"original":{}"#, shape(&original.soup));
        if let Some(suspect) = &suspect {
            json += &format!(r#","suspect":{}"#, shape(&suspect.soup));
        }
        json.push('}');
        if let Some(distances) = &shapes.distances {
            let bytes = STANDARD.encode(bytes_of(&original.values, distances.scale()));
            json += &format!(r#","distances":"{bytes}","colors":"{}""#, STANDARD.encode(colors()));
        }
        json.push('}');
        Some(Self {
            json,
            suspect: suspect.is_some(),
            together: suspect.is_some() && shapes.placement == Placement::Near,
            distances: shapes.distances.is_some(),
            triangles: [Some(&original), suspect.as_ref()].map(|m| m.map_or(0, |m| m.soup.triangles.len())),
        })
    }
}

/// From model units to the cube.
#[derive(Clone, Copy)]
struct Frame {
    middle: Point3<f64>,
    half_side: f64,
}

impl Frame {
    fn around(soup: &Soup) -> Option<Self> {
        let bounds = BoundingBox::of(&used_points(&soup.points, &soup.triangles))?;
        let half_side = 0.5 * bounds.largest_side();
        let usable = half_side > 0.0 && half_side.is_finite();
        usable.then(|| Self { middle: nalgebra::center(&bounds.min, &bounds.max), half_side })
    }

    /// A small version in the cube; `None` when nothing is left to show.
    fn small(&self, soup: &Soup, values: &[f64]) -> Option<Valued> {
        let place = |p: &Point3<f64>| Point3::from((p - self.middle) / self.half_side);
        let points: Vec<_> = soup.points.iter().map(place).collect();
        let mesh = Valued { soup: Soup::new(points, soup.triangles.clone()), values: values.to_vec() };
        Some(decimated(mesh, TRIANGLES)).filter(|mesh| !mesh.soup.triangles.is_empty())
    }
}

fn shape(soup: &Soup) -> String {
    let share = |c: f64| ((0.5 + 0.5 * c / HALF_CUBE).clamp(0.0, 1.0) * f64::from(u16::MAX)).round() as u16;
    let points = packed(soup.points.iter().flat_map(|p| Vector3::from(p.coords.map(share)).data.0[0]));
    // At most so many triangles have fewer corners than 16 bits count.
    let triangles = packed(soup.triangles.iter().flatten().map(|&v| v as u16));
    format!(r#"{{"points":"{points}","triangles":"{triangles}"}}"#)
}

const _: () = assert!(3 * TRIANGLES <= u16::MAX as usize);

fn packed(numbers: impl Iterator<Item = u16>) -> String {
    STANDARD.encode(numbers.flat_map(u16::to_le_bytes).collect::<Vec<u8>>())
}

fn bytes_of(values: &[f64], scale: f64) -> Vec<u8> {
    let top = f64::from(MISSING - 1);
    let byte =
        |v: &f64| if v.is_finite() { (v / scale * top).round().clamp(0.0, top) as u8 } else { MISSING };
    values.iter().map(byte).collect()
}

fn colors() -> Vec<u8> {
    (0..MISSING).flat_map(|i| color(f64::from(i) / f64::from(MISSING - 1))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero::shapes;

    #[test]
    fn distances_fill_the_scale() {
        assert_eq!(bytes_of(&[0.0, 0.5, 1.0, 7.0, f64::NAN], 1.0), [0, 127, 254, 254, MISSING]);
        assert_eq!(colors().len(), 3 * 255);
    }

    #[test]
    fn a_shape_is_packed_from_edge_to_edge_of_its_cube() {
        let soup = Soup::new(
            vec![Point3::new(-1.25, 0.0, 1.25), Point3::new(9.0, -9.0, 0.0), Point3::origin()],
            vec![[2, 1, 0]],
        );
        let json = shape(&soup);
        let (points, rest) = json.strip_prefix(r#"{"points":""#).unwrap().split_once('"').unwrap();
        let triangles = rest.strip_prefix(r#","triangles":""#).unwrap().strip_suffix("\"}").unwrap();
        let numbers = |text| {
            let bytes = STANDARD.decode(text).unwrap();
            bytes.chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect::<Vec<_>>()
        };
        assert_eq!(numbers(points), [0, 32768, 65535, 65535, 0, 32768, 32768, 32768, 32768]);
        assert_eq!(numbers(triangles), [2, 1, 0]);
    }

    #[test]
    fn any_size_and_place_fills_the_frame() {
        let sphere = shapes::sphere(2);
        for (scale, shift) in [(1e-200, 0.0), (1e150, 0.0), (3.0, 1e6)] {
            let points = sphere.points.iter().map(|p| p * scale + Vector3::repeat(shift)).collect();
            let soup = Soup::new(points, sphere.triangles.clone());
            let small = Frame::around(&soup).unwrap().small(&soup, &[]).unwrap();
            assert!((small.soup.bounding_box().unwrap().largest_side() - 2.0).abs() < 1e-6);
        }
        let huge = Soup::new(
            vec![Point3::new(f64::MAX, 0.0, 0.0), -Point3::new(f64::MAX, 0.0, 0.0)],
            vec![[0, 1, 0]],
        );
        assert!(Frame::around(&huge).is_none() && Frame::around(&Soup::default()).is_none());
    }
}
