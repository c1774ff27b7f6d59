//! The distance between two files.

use serde::Serialize;
use sombrero_fidelity::{Fidelity, Places};
use sombrero_io::Document;
use sombrero_search::Model;
use sombrero_spatial::{DistanceOptions, compare as surface_distance};
use thiserror::Error;

/// Distances between two surfaces. Lengths in model units; relative ones are divided by the largest side of
/// the first one's bounding box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Comparison {
    /// The longest distance from a point of one surface to the other, both ways.
    pub hausdorff: f64,
    /// Root mean square distance, the larger of both ways.
    pub rms: f64,
    /// Mean distance, the larger of both ways.
    pub mean: f64,
    /// `hausdorff` over the largest side.
    pub relative_hausdorff: f64,
    /// `rms` over the largest side.
    pub relative_rms: f64,
    /// Root mean square displacement of the vertices that have a face, when connectivity agrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertex_rms: Option<f64>,
    /// The longest displacement of a vertex, when connectivity agrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertex_max: Option<f64>,
    /// What the second mesh made of the first, when connectivity agrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fidelity: Option<Fidelity>,
}

/// The reason why two files cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// One of them holds no surface.
    #[error("the {which} mesh has no usable face; give a mesh with triangles or polygons")]
    NoFaces {
        /// First or second.
        which: &'static str,
    },
}

/// Compares two files.
///
/// # Errors
/// [`CompareError`] when one of them has no face.
pub fn compare(a: &Document, b: &Document) -> Result<Comparison, CompareError> {
    // Polygons that both have are split alike.
    let other = b.soup_like(a.triangles());
    let (first, second) = (Model::new(a.soup()), Model::new(&other));
    for (model, which) in [(&first, "first"), (&second, "second")] {
        if model.repaired().mesh.face_count() == 0 {
            return Err(CompareError::NoFaces { which });
        }
    }
    let distances = surface_distance(first.soup(), second.soup(), &DistanceOptions::default())
        .ok_or(CompareError::NoFaces { which: "second" })?;
    let alike = a.triangles() == other.triangles && a.points().len() == b.points().len();
    let vertices = alike.then(|| {
        let used = a.soup().used();
        let pairs = a.points().iter().zip(b.points()).zip(used).filter(|(_, used)| *used);
        let squared: Vec<f64> = pairs.map(|((p, q), _)| (q - p).norm_squared()).collect();
        let mean = squared.iter().sum::<f64>() / squared.len().max(1) as f64;
        (mean.sqrt(), squared.iter().copied().fold(0.0, f64::max).sqrt())
    });
    let fidelity = alike.then(|| {
        let places = Places::new(a.points(), b.points());
        // Both by the same means, so that what did not move is the same to the bit.
        let [before, after] = [a, b].map(|document| first.points_from_stored(document.points()));
        Fidelity::between(&before, &after, &first.soup().triangles, Some(places))
    });
    let side = first.largest_side();
    Ok(Comparison {
        hausdorff: distances.hausdorff,
        rms: distances.rms,
        mean: distances.mean,
        relative_hausdorff: distances.hausdorff / side,
        relative_rms: distances.rms / side,
        vertex_rms: vertices.map(|v| v.0),
        vertex_max: vertices.map(|v| v.1),
        fidelity,
    })
}
