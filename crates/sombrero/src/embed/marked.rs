//! A marked copy and its figures.

use nalgebra::Point3;
use serde::Serialize;
use sombrero_fidelity::{Fidelity, normal_change};
use sombrero_io::Companion;
#[cfg(doc)]
use sombrero_io::Rewrite;
use sombrero_search::{Model, Stages};
use sombrero_watermark::{Distortion, Key};

/// A marked copy.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Marked {
    /// The file: the original with other positions.
    pub bytes: Vec<u8>,
    /// The files that belong beside it: see [`Rewrite::stem`].
    pub companions: Vec<Companion>,
    /// The stored positions as they read back.
    pub points: Vec<Point3<f64>>,
    /// The secret key that finds the mark again.
    pub key: Key,
    /// The figures, for people and programs.
    pub report: EmbedReport,
}

/// The figures of one embedding.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct EmbedReport {
    /// Vertices as the file stores them.
    pub vertices: usize,
    /// Triangles, polygons split.
    pub faces: usize,
    /// m, the number of coefficients.
    pub coefficients: usize,
    /// ε, the strength.
    pub epsilon: f64,
    /// The basis function's name.
    pub basis: String,
    /// The displacements of the vertices that have a face.
    pub distortion: DistortionReport,
    /// What became of the model, read back from the marked file; `None` unless it was measured
    /// ([`Embedder::measured`](crate::Embedder::measured)).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fidelity: Option<Fidelity>,
    /// log10 of the probability that an unmarked mesh would match as well, read back from the marked file.
    pub log10_p: f64,
    /// log10 p by least squares after noise of 0.2 % of each part's largest side, one draw: what the mark is good for.
    pub log10_p_after_noise: f64,
    /// log10 p by least squares after noise of 0.1 % and simplification to half of the faces, one draw; `None` for a large
    /// model.
    pub log10_p_halved: Option<f64>,
    /// The unit of the model's lengths, where the file has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Seconds by stage.
    pub seconds: Stages,
    /// What the owner should know, in sentences.
    pub warnings: Vec<String>,
}

/// Displacements in model units, and relative to the largest side of the bounding box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct DistortionReport {
    /// Longest displacement.
    pub max: f64,
    /// Root mean square.
    pub rms: f64,
    /// `max` over the largest side.
    pub relative_max: f64,
    /// `rms` over the largest side.
    pub relative_rms: f64,
    /// The angle by which face normals turned, root mean square by area, in radians.
    pub normals_rms: f64,
}

impl DistortionReport {
    /// The distortion of the model whose points have `moved`, over the vertices that have a face; the others do not
    /// move and count for nothing.
    pub(super) fn between(model: &Model, moved: &[Point3<f64>]) -> Self {
        let used = model.soup().used();
        let of = |points: &[Point3<f64>]| -> Vec<Point3<f64>> {
            points.iter().zip(&used).filter(|(_, used)| **used).map(|(p, _)| *p).collect()
        };
        let Distortion { max, rms } = Distortion::between(&of(&model.soup().points), &of(moved));
        let side = model.largest_side();
        let normals_rms = normal_change(&model.soup().points, moved, &model.soup().triangles);
        Self { max, rms, relative_max: max / side, relative_rms: rms / side, normals_rms }
    }
}
