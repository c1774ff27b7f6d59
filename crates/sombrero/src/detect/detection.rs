//! The answer of a detection.

use super::options::Method;
use nalgebra::{Affine3, DMatrix, Matrix4, Point3};
use serde::{Serialize, Serializer};
use sombrero_extraction::Estimate;
use sombrero_registration::Registration;
use sombrero_search::{FoundPart, Glance, Stages};
use sombrero_stats::{Statistic, best_of};

/// The answer of a detection: what was found of one mark in one suspect.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Detection {
    /// Whether the corrected p is at most the threshold.
    pub detected: bool,
    /// The probability that an unmarked mesh would match as well by chance, corrected for the number of
    /// variants; 0 when it underflows.
    pub p_value: f64,
    /// Its decimal logarithm; always finite.
    pub log10_p: f64,
    /// The threshold for p.
    pub threshold: f64,
    /// Correlation of inserted and extracted coefficients; 0 when there are too few.
    pub correlation: f64,
    /// The number of coefficients that the test used.
    pub coefficients_used: usize,
    /// Share of the original's area that was found on the suspect, 0 to 1.
    pub coverage: f64,
    /// The method.
    pub method: Method,
    /// The variant that won; `None` where the suspect is another shape, so that nothing was compared and p is 1.
    pub variant: Option<Variant>,
    /// All variants that were tried.
    pub variants: Vec<Variant>,
    /// The number of variants that p was corrected for: those tried, and those left out because one was certain. 0 where there is
    /// nothing to be corrected.
    pub variants_counted: usize,
    /// The map that brought the suspect onto the original; `None` when it was taken as it is.
    pub registration: Option<Alignment>,
    /// Where parts were found that were placed one by one; empty where one map places all.
    pub parts: Vec<Part>,
    /// The extracted coefficients of the winning variant. For a marked copy they are nearly the secret w:
    /// keep them as carefully as the key.
    pub extracted: Vec<Option<f64>>,
    /// The estimate of the winning variant as its ellipsoid tests take it; `None` for the paper's method. As secret as
    /// [`extracted`](Self::extracted).
    #[serde(skip)]
    pub measured: Option<Measured>,
    /// The place where the winning variant found each of the original's points, in the original's coordinates; `None`
    /// where it is missing.
    #[serde(skip)]
    pub found: Vec<Option<Point3<f64>>>,
    /// Whether the budget ran out before all was looked at.
    pub budget_spent: bool,
    /// Seconds by stage.
    pub seconds: Stages,
    /// What the user should know, in sentences.
    pub warnings: Vec<String>,
}

impl Detection {
    /// The robust method's answer about a suspect that is another shape. `coefficients` is the length of the watermark, `points`
    /// the number of the original's points.
    pub(super) fn of_another_shape(
        coefficients: usize,
        points: usize,
        threshold: f64,
        seconds: Stages,
    ) -> Self {
        Self {
            detected: threshold >= 1.0,
            p_value: 1.0,
            log10_p: 0.0,
            threshold,
            correlation: 0.0,
            coefficients_used: 0,
            coverage: 0.0,
            method: Method::Robust,
            variant: None,
            variants: Vec::new(),
            variants_counted: 0,
            registration: None,
            parts: Vec::new(),
            extracted: vec![None; coefficients],
            measured: None,
            found: vec![None; points],
            budget_spent: false,
            seconds,
            warnings: vec![Glance::ANOTHER_SHAPE.to_owned()],
        }
    }
}

/// w* and its precision: with the key all that the ellipsoid test needs.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// w* of all m coefficients; 0 in the directions that the suspect does not determine.
    pub centre: Vec<f64>,
    /// Its precision P, m × m and symmetric.
    pub precision: DMatrix<f64>,
}

/// One way of looking.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Variant {
    /// Whether the suspect was aligned.
    pub registration: bool,
    /// What the suspect was taken for: the "whole" original or a piece of it, its "mirrored" image, or its "parts", each
    /// placed by itself.
    pub look: &'static str,
    /// Whether it was resampled; with the robust method, whether surfaces were compared instead of vertices.
    pub resampling: bool,
    /// The name of what was solved for beside the coefficients.
    pub nuisance: &'static str,
    /// The test by which inserted and extracted coefficients were compared.
    #[serde(serialize_with = "name")]
    pub test: Statistic,
    /// The least standard error that the ellipsoid test took, in standard deviations of the watermark; 0 for none.
    pub floor: f64,
    /// log10 p of this variant alone, uncorrected.
    pub log10_p: f64,
    /// Its correlation.
    pub correlation: f64,
}

/// A statistic, as the answer names it.
fn name<S: Serializer>(statistic: &Statistic, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(statistic.name)
}

/// A registration's result.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Alignment {
    /// Suspect to original, 4 × 4, row by row.
    pub matrix: [[f64; 4]; 4],
    /// Whether it makes a mirror image.
    pub mirrored: bool,
    /// Root mean square distance after it, in model units.
    pub rms: f64,
    /// Share of the original's area that has a counterpart in the suspect.
    pub overlap: f64,
    /// Iterations of the winning start.
    pub iterations: usize,
    /// Whether it came to rest.
    pub converged: bool,
}

impl Alignment {
    /// The pose of the robust method's `estimate`, of whose original the share `overlap` was found.
    pub(crate) fn of_estimate(pose: &Affine3<f64>, estimate: &Estimate, overlap: f64) -> Self {
        Self {
            matrix: rows(&pose.to_homogeneous()),
            mirrored: is_mirrored(pose),
            rms: estimate.residual_rms,
            overlap,
            iterations: estimate.iterations,
            converged: estimate.converged,
        }
    }

    /// The best pose of a registration alone.
    pub(super) fn of_registration(registration: &Registration) -> Self {
        let Registration { best, iterations, converged, .. } = registration;
        let (iterations, converged) = (*iterations, *converged);
        let matrix = rows(&best.reference_from_suspect.to_homogeneous());
        Self { matrix, mirrored: false, rms: best.rms, overlap: best.overlap, iterations, converged }
    }
}

/// Whether a map turns right into left.
fn is_mirrored(pose: &Affine3<f64>) -> bool {
    pose.matrix().fixed_view::<3, 3>(0, 0).determinant() < 0.0
}

/// A part of the original that was placed by itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Part {
    /// Which part of the original, by the order in which the file has their first points.
    pub component: usize,
    /// Which part of the suspect it was found in, by the same order there.
    pub suspect_component: usize,
    /// log10 p of this part alone, corrected as that of all together.
    pub log10_p: f64,
    /// Share of the part's area that was found, 0 to 1.
    pub coverage: f64,
    /// Suspect to original, 4 × 4, row by row.
    pub matrix: [[f64; 4]; 4],
    /// Whether it makes a mirror image.
    pub mirrored: bool,
}

impl Part {
    /// `counted` is the number of tests that p is corrected for.
    pub(super) fn new(found: &FoundPart, counted: usize) -> Self {
        Self {
            component: found.part,
            suspect_component: found.component,
            log10_p: best_of(found.p, counted).log10(),
            coverage: found.coverage,
            matrix: rows(&found.pose.to_homogeneous()),
            mirrored: is_mirrored(&found.pose),
        }
    }
}

/// A warning of a test that rests on next to nothing.
pub(super) fn few(used: usize) -> Option<String> {
    (used < 8).then(|| format!("Fewer than 8 coefficients could be compared ({used}), which proves little."))
}

/// Row by row, as people write matrices.
fn rows(matrix: &Matrix4<f64>) -> [[f64; 4]; 4] {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
}

/// Where each point of the original is on the suspect, in the original's coordinates; `None` where it is missing.
pub(crate) fn positions(estimate: &Estimate) -> Vec<Option<Point3<f64>>> {
    let place = |(p, present): (&Point3<f64>, &bool)| present.then_some(*p);
    estimate.positions.iter().zip(&estimate.present).map(place).collect()
}
