//! Marks a file.

use nalgebra::Point3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use sombrero_attacks::noise;
use sombrero_basis::{Basis, BasisError, BasisOptions};
use sombrero_extraction::{ExtractError, extract};
use sombrero_io::{Companion, Document, Limits, ParseError, Rewrite, Rewritten, WriteError};
use sombrero_search::{Model, Stages};
use sombrero_stats::{WatermarkTestOptions, watermark_test};
use sombrero_watermark::{
    Distortion, Identity, Key, OriginalDigest, Parameters, Secret, embed as insert, normal_change,
};
use thiserror::Error;

/// What the mark says and how strong it is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EmbedOptions {
    /// Coefficients, basis function and ε.
    pub parameters: Parameters,
    /// Take fewer coefficients, 50 at least, when the mesh cannot carry as many. Otherwise that is an
    /// error. Default: no.
    pub fewer_if_small: bool,
    /// Lower ε so far that no vertex moves by more than this many model units. Default: `None`.
    pub max_displacement: Option<f64>,
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
    /// The same by least squares after noise of 0.2 % of the largest side, one draw: what the mark is good for.
    pub log10_p_after_noise: f64,
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
    /// A longest displacement that is not a positive number.
    #[error(
        "a longest displacement of {most} is not usable; give a number above 0, in the units of the model"
    )]
    Displacement {
        /// What was given.
        most: f64,
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
        "the mark does not survive being stored (log10 p is {log10_p:.1} in the marked file): the file's number type is too coarse for its coordinates; move the model nearer to the origin, use a format with double precision, raise epsilon or allow a larger displacement"
    )]
    Lost {
        /// What was found in the marked file.
        log10_p: f64,
    },
}

/// The mark must read back at least this well from the file just written, and should after a little noise.
const READ_BACK: f64 = -6.0;

/// The paper's attack C: noise of this amplitude, in largest sides, hides no usual mark.
const TEST_NOISE: f64 = 0.002;

/// Marks `original` with a watermark that follows from its bytes, the identity and `secret`, and checks
/// that the marked file gives the mark back.
///
/// For many copies of one original make an [`Embedder`] once.
///
/// # Errors
/// [`EmbedError`] when the mesh cannot carry the mark or the format cannot store it.
///
/// # Example
/// ```
/// use sombrero::{EmbedOptions, embed, io::{Document, Format, encode}, shapes, watermark::Secret};
///
/// let file = encode(Format::Obj, &shapes::bumpy_sphere(2000))?;
/// let original = Document::parse(file, None)?;
/// let marked = embed(&original, Secret([1; 32]), &EmbedOptions::default())?;
/// assert!(marked.report.distortion.relative_rms < 0.002);
/// assert!(marked.report.log10_p < -100.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn embed(original: &Document, secret: Secret, options: &EmbedOptions) -> Result<Marked, EmbedError> {
    let mut embedder = Embedder::new(original, options.parameters, options.fewer_if_small)?;
    if let Some(most) = options.max_displacement {
        embedder.limit_displacement(most, [(&options.identity, &secret)])?;
    }
    let mut marked = embedder.mark(options.identity.clone(), secret, &options.rewrite)?;
    let mut seconds = embedder.seconds;
    seconds.add(marked.report.seconds);
    marked.report.seconds = seconds;
    Ok(marked)
}

/// An original that is ready for any number of marked copies: the basis is computed once.
#[derive(Debug)]
pub struct Embedder<'a> {
    original: &'a Document,
    model: Model,
    basis: Basis,
    basis_digest: [u8; 32],
    digest: OriginalDigest,
    /// With as many coefficients as the basis has.
    parameters: Parameters,
    /// What the least squares read from noise alone, for ε = 1.
    noise: Vec<Option<f64>>,
    /// What is to be said of every copy.
    warnings: Vec<String>,
    seconds: Stages,
}

impl<'a> Embedder<'a> {
    /// Computes the basis. `fewer_if_small` is [`EmbedOptions::fewer_if_small`].
    ///
    /// # Errors
    /// [`EmbedError`] when the mesh cannot carry a mark with these parameters.
    pub fn new(
        original: &'a Document,
        parameters: Parameters,
        fewer_if_small: bool,
    ) -> Result<Self, EmbedError> {
        let mut seconds = Stages::default();
        let Parameters { basis: wanted, epsilon } = parameters;
        if !(epsilon > 0.0 && epsilon <= 1.0) {
            return Err(EmbedError::Epsilon { epsilon });
        }
        if wanted.coefficients < 4 {
            return Err(EmbedError::Coefficients { coefficients: wanted.coefficients });
        }
        let model = seconds.time("weld", || Model::new(&original.soup()));
        if seconds.time("repair", || model.repaired()).mesh.face_count() == 0 {
            return Err(EmbedError::NoFaces);
        }
        let mut progressive = seconds.time("conversion", || model.progressive());
        let basis = seconds.time("basis", || match model.basis_of(&mut progressive, &wanted) {
            Err(BasisError::TooFewSplits { available, .. }) if fewer_if_small => {
                let fewer = BasisOptions { coefficients: available.max(FEWEST), ..wanted };
                model.basis_of(&mut progressive, &fewer)
            }
            basis => basis,
        })?;
        drop(progressive);
        let coefficients = basis.functions().len();
        let noise = seconds.time("test", || response_to_noise(&model, &basis))?;
        let digest = seconds.time("insert", || OriginalDigest::of(&original.content()));
        Ok(Self {
            original,
            warnings: warnings(original, &model, wanted.coefficients, coefficients),
            model,
            basis_digest: basis.digest(),
            basis,
            digest,
            parameters: Parameters { basis: BasisOptions { coefficients, ..wanted }, epsilon },
            noise,
            seconds,
        })
    }

    /// Lowers ε so far that none of these marks moves a vertex by more than `most` model units, before the file rounds
    /// it, and gives the ε that all copies now have. It is never raised.
    ///
    /// # Errors
    /// [`EmbedError::Displacement`] when `most` is not above 0.
    pub fn limit_displacement<'b>(
        &mut self,
        most: f64,
        marks: impl IntoIterator<Item = (&'b Identity, &'b Secret)>,
    ) -> Result<f64, EmbedError> {
        if !(most > 0.0 && most.is_finite()) {
            return Err(EmbedError::Displacement { most });
        }
        for (identity, secret) in marks {
            let w = self.watermark(identity, secret);
            let moves = self.basis.displacements(&w, 1.0);
            let longest = moves.iter().map(|d| d.norm_squared()).fold(0.0, f64::max).sqrt();
            if longest > 0.0 {
                self.parameters.epsilon = self.parameters.epsilon.min(rounded_down(most / longest));
            }
        }
        Ok(self.parameters.epsilon)
    }

    /// How all copies are marked.
    pub fn parameters(&self) -> Parameters {
        self.parameters
    }

    /// The key of the copy with this identity and secret.
    pub fn key(&self, identity: Identity, secret: Secret) -> Key {
        Key::with_digest(&self.digest, identity, secret, self.parameters, &self.basis_digest)
    }

    /// One marked copy, tested.
    ///
    /// # Errors
    /// [`EmbedError`] when the format cannot store the mark.
    pub fn mark(&self, identity: Identity, secret: Secret, rewrite: &Rewrite) -> Result<Marked, EmbedError> {
        let mut seconds = Stages::default();
        let Self { original, model, basis, .. } = self;
        let key = self.key(identity, secret);
        let (Rewritten { bytes, companions }, moved) = seconds.time("insert", || {
            let points = insert(&model.soup().points, basis, &key.watermark, key.parameters.epsilon);
            let rewritten = original.rewrite(&model.stored_from_points(&points), rewrite)?;
            Ok::<_, WriteError>((rewritten, points))
        })?;
        let copy = seconds.time("read back", || {
            // A file that needs others cannot be read from memory; then the same positions are read from one that does not.
            let whole = if companions.is_empty() {
                bytes.clone()
            } else {
                original.with_points(&model.stored_from_points(&moved))?
            };
            Ok::<_, EmbedError>(Document::parse_within(
                whole,
                Some(original.extension()),
                Limits::unlimited(),
            )?)
        })?;
        let [log10_p, log10_p_after_noise] = seconds.time("test", || self.test(&key, copy.points()))?;
        if log10_p > READ_BACK {
            return Err(EmbedError::Lost { log10_p });
        }
        let mut warnings = self.warnings.clone();
        if log10_p_after_noise > READ_BACK {
            warnings.push(format!(
                "The mark is weak: after noise of 0.2 % of the largest side the paper's test would give log10 p = \
                 {log10_p_after_noise:.1}; raise epsilon, or allow a larger displacement, if the model bears it."
            ));
        }
        let report = EmbedReport {
            vertices: original.points().len(),
            faces: usize::try_from(original.triangles_with_instances()).unwrap_or(usize::MAX),
            coefficients: key.watermark.len(),
            epsilon: key.parameters.epsilon,
            basis: key.parameters.basis.function.to_string(),
            distortion: distortion(model, &moved),
            log10_p,
            log10_p_after_noise,
            seconds,
            warnings,
        };
        Ok(Marked { bytes, companions, points: copy.points().to_vec(), key, report })
    }

    fn watermark(&self, identity: &Identity, secret: &Secret) -> Vec<f64> {
        self.digest.watermark(identity, secret, self.parameters.basis.coefficients)
    }

    /// log10 p of the paper's test on the stored positions of a copy, as they are and after noise. Least squares are
    /// linear: what they read from the noisy copy is what they read from both.
    fn test(&self, key: &Key, marked: &[Point3<f64>]) -> Result<[f64; 2], EmbedError> {
        let found: Vec<Option<Point3<f64>>> =
            self.model.points_from_stored(marked).into_iter().map(Some).collect();
        let epsilon = key.parameters.epsilon;
        let clean = extract(&self.basis, epsilon, &self.model.soup().points, &found)?.coefficients;
        let noisy: Vec<Option<f64>> =
            clean.iter().zip(&self.noise).map(|(w, n)| Some((*w)? + (*n)? / epsilon)).collect();
        // Lengths agree by construction; a test that cannot be made is no evidence.
        let log10_p = |found: &[Option<f64>]| {
            let test = watermark_test(&key.watermark, found, &WatermarkTestOptions::default());
            test.map_or(0.0, |test| test.log10_p())
        };
        Ok([log10_p(&clean), log10_p(&noisy)])
    }
}

/// What extraction finds in an unmarked original with noise of [`TEST_NOISE`], for ε = 1.
fn response_to_noise(model: &Model, basis: &Basis) -> Result<Vec<Option<f64>>, EmbedError> {
    let points = &model.soup().points;
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let noisy: Vec<_> =
        noise(points, TEST_NOISE * model.largest_side(), &mut rng).into_iter().map(Some).collect();
    Ok(extract(basis, 1.0, points, &noisy)?.coefficients)
}

/// Two significant digits, so that a key is easy to read.
fn rounded_down(x: f64) -> f64 {
    let unit = 10_f64.powi(libm::floor(libm::log10(x)) as i32 - 1);
    let rounded = (x / unit).floor() * unit;
    // What a decimal cannot hold exactly may come out above.
    let shown: f64 = format!("{rounded:.1e}").parse().unwrap_or(x);
    if shown <= x { shown } else { x }
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
