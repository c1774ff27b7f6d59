//! Marks a file.

use crate::Model;
use crate::timing::Stages;
use nalgebra::Point3;
use serde::Serialize;
use sombrero_basis::{Basis, BasisError, BasisOptions};
use sombrero_extraction::{ExtractError, extract};
use sombrero_io::{Companion, Document, Limits, ParseError, Rewrite, Rewritten, WriteError};
use sombrero_stats::{WatermarkTestOptions, watermark_test};
use sombrero_watermark::{Distortion, Fingerprint, Identity, Key, Parameters, Secret, embed as insert, normal_change};
use thiserror::Error;

/// What the mark says and how strong it is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EmbedOptions {
    /// Coefficients, basis function and ε.
    pub parameters: Parameters,
    /// Take fewer coefficients, 50 at least, when the mesh cannot carry as many. Otherwise that is an
    /// error. Default: no.
    pub fewer_if_small: bool,
    /// Whose mark it is.
    pub identity: Identity,
    /// Whether stored normals turn with the surface, and the name that the copy will have.
    pub rewrite: Rewrite,
}

/// With fewer coefficients than the paper's a mark is too easily lost to be made without being asked for.
const FEWEST: usize = 50;

/// A marked copy.
#[derive(Debug, Clone)]
pub struct Marked {
    /// The file: the original with other positions.
    pub bytes: Vec<u8>,
    /// What belongs beside it: see [`Rewrite::stem`].
    pub companions: Vec<Companion>,
    /// The stored positions as they read back.
    pub points: Vec<Point3<f64>>,
    /// The secret key that finds the mark again.
    pub key: Key,
    /// What was done, for people and programs.
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
    /// m.
    pub coefficients: usize,
    /// ε.
    pub epsilon: f64,
    /// The basis function's name.
    pub basis: String,
    /// How far the vertices with a face moved.
    pub distortion: DistortionReport,
    /// log10 of the probability that an unmarked mesh would match as well, read back from the marked file.
    pub log10_p: f64,
    /// Seconds by stage.
    pub seconds: Stages,
    /// What the owner should know.
    pub warnings: Vec<String>,
}

/// Displacements in model units, and relative to the largest side of the bounding box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DistortionReport {
    /// Longest displacement.
    pub max: f64,
    /// Root mean square.
    pub rms: f64,
    /// `max` over the largest side.
    pub relative_max: f64,
    /// `rms` over the largest side.
    pub relative_rms: f64,
    /// How far face normals turned, root mean square by area, in radians.
    pub normals_rms: f64,
}

/// Why a file cannot be marked.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EmbedError {
    /// There is nothing to mark.
    #[error("the file has no usable face; a mark needs a surface, not points or lines")]
    NoFaces,
    /// ε is not a positive number.
    #[error("epsilon {epsilon} is not usable; it must be above 0 and at most 1 (0.01 is usual)")]
    Epsilon {
        /// What was given.
        epsilon: f64,
    },
    /// Fewer than four coefficients were asked for.
    #[error("a mark needs at least 4 coefficients, not {coefficients}; 50 are usual")]
    Coefficients {
        /// What was given.
        coefficients: usize,
    },
    /// The mesh is too small or too flat.
    #[error(transparent)]
    Basis(#[from] BasisError),
    /// The new positions cannot be stored.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The marked file does not read back.
    #[error("the marked file does not read back: {0}")]
    ReadBack(#[from] ParseError),
    /// The marked file cannot be compared with the original.
    #[error(transparent)]
    Extract(#[from] ExtractError),
    /// The file's numbers are too coarse for the mark.
    #[error(
        "the mark does not survive being stored (log10 p is {log10_p:.1} in the marked file): the file's number type is too coarse for its coordinates; move the model nearer to the origin, use a format with double precision, or raise epsilon"
    )]
    Lost {
        /// What was found in the marked file.
        log10_p: f64,
    },
}

/// The mark must read back at least this well from the file just written.
const READ_BACK: f64 = -6.0;

/// Marks `original` with a watermark that follows from its bytes, the identity and `secret`, and checks
/// that the marked file gives the mark back.
///
/// # Errors
/// [`EmbedError`] when the mesh cannot carry the mark or the format cannot store it.
///
/// # Example
/// ```
/// use sombrero::{EmbedOptions, embed, io::{Document, Format, encode}, mesh::shapes, watermark::Secret};
///
/// let file = encode(Format::Obj, &shapes::bumpy_sphere(2000))?;
/// let original = Document::parse(file, None)?;
/// let marked = embed(&original, Secret([1; 32]), &EmbedOptions::default())?;
/// assert!(marked.report.distortion.relative_rms < 0.002);
/// assert!(marked.report.log10_p < -100.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn embed(original: &Document, secret: Secret, options: &EmbedOptions) -> Result<Marked, EmbedError> {
    let mut seconds = Stages::default();
    let Parameters { basis: basis_options, epsilon } = options.parameters;
    if !(epsilon > 0.0 && epsilon <= 1.0) {
        return Err(EmbedError::Epsilon { epsilon });
    }
    if basis_options.coefficients < 4 {
        return Err(EmbedError::Coefficients { coefficients: basis_options.coefficients });
    }
    let model = seconds.time("weld", || Model::new(&original.soup()));
    if seconds.time("repair", || model.repaired()).mesh.face_count() == 0 {
        return Err(EmbedError::NoFaces);
    }
    let mut progressive = seconds.time("conversion", || model.progressive());
    let basis = seconds.time("basis", || match model.basis_of(&mut progressive, &basis_options) {
        Err(BasisError::TooFewSplits { available, .. }) if options.fewer_if_small => {
            let fewer = BasisOptions { coefficients: available.max(FEWEST), ..basis_options };
            model.basis_of(&mut progressive, &fewer)
        }
        basis => basis,
    })?;
    drop(progressive);
    let identity = options.identity.clone();
    let key = Key::new(&Fingerprint::of(&original.content()), identity, secret, &options.parameters, &basis);
    let (Rewritten { bytes, companions }, moved) = seconds.time("insert", || {
        let points = insert(&model.soup().points, &basis, &key.watermark, epsilon);
        let rewritten = original.rewrite(&model.stored_from_points(&points), &options.rewrite)?;
        Ok::<_, WriteError>((rewritten, points))
    })?;
    let copy = seconds.time("read back", || {
        // A file that needs others cannot be read from memory; then the same positions are read from one that does not.
        let whole = if companions.is_empty() {
            bytes.clone()
        } else {
            original.with_points(&model.stored_from_points(&moved))?
        };
        Ok::<_, EmbedError>(Document::parse_within(whole, Some(original.extension()), Limits::unlimited())?)
    })?;
    let log10_p = seconds.time("test", || test(&model, &basis, &key, copy.points()))?;
    if log10_p > READ_BACK {
        return Err(EmbedError::Lost { log10_p });
    }
    let report = EmbedReport {
        vertices: original.points().len(),
        faces: usize::try_from(original.triangles_with_instances()).unwrap_or(usize::MAX),
        coefficients: key.watermark.len(),
        epsilon,
        basis: basis_options.function.to_string(),
        distortion: distortion(&model, &moved),
        log10_p,
        seconds,
        warnings: warnings(original, &model, basis_options.coefficients, key.watermark.len()),
    };
    Ok(Marked { bytes, companions, points: copy.points().to_vec(), key, report })
}

/// What was mended, and whether the mesh is small.
fn warnings(original: &Document, model: &Model, wanted: usize, carried: usize) -> Vec<String> {
    let mut notes = original.notes().to_vec();
    notes.extend(crate::info::repair_notes(&model.repaired().report));
    if carried < wanted {
        notes.push(format!(
            "The mesh is small: it carries {carried} coefficients, not {wanted}, which survive less."
        ));
    }
    notes
}

/// log10 p of the paper's test on the stored positions of the copy.
fn test(model: &Model, basis: &Basis, key: &Key, marked: &[Point3<f64>]) -> Result<f64, EmbedError> {
    let found: Vec<Option<Point3<f64>>> = model.points_from_stored(marked).into_iter().map(Some).collect();
    let extraction = extract(basis, key.parameters.epsilon, &model.soup().points, &found)?;
    let test = watermark_test(&key.watermark, &extraction.coefficients, &WatermarkTestOptions::default());
    // Lengths agree by construction; a test that cannot be made is no evidence.
    Ok(test.map_or(0.0, |test| test.log10_p()))
}

/// Over the vertices that have a face; the others do not move and count for nothing.
fn distortion(model: &Model, moved: &[Point3<f64>]) -> DistortionReport {
    let used = model.soup().used();
    let of = |points: &[Point3<f64>]| -> Vec<Point3<f64>> {
        points.iter().zip(&used).filter(|(_, used)| **used).map(|(p, _)| *p).collect()
    };
    let Distortion { max, rms } = Distortion::between(&of(&model.soup().points), &of(moved));
    let side = model.largest_side();
    let normals_rms = normal_change(&model.soup().points, moved, &model.soup().triangles);
    DistortionReport { max, rms, relative_max: max / side, relative_rms: rms / side, normals_rms }
}
