//! An original that any number of copies are made of.

use super::choice::{Choice, FEW};
use super::error::EmbedError;
use super::limit::epsilon_within;
use super::marked::{DistortionReport, EmbedReport, Marked};
use super::self_test::{self, SelfTest, Tested};
use crate::info::repair_notes;
use nalgebra::Point3;
use sombrero_basis::{Basis, BasisFunction};
use sombrero_fidelity::{Fidelity, Places};
use sombrero_io::{Document, Filling, Limits, Rewrite, Rewritten, WriteError};
use sombrero_mesh::repair::Repaired;
use sombrero_mesh::{geometry, topology};
use sombrero_search::{Model, Stages};
use sombrero_watermark::{
    COEFFICIENTS, Derivation, EPSILONS, Identity, Key, OriginalDigest, Parameters, Secret, embed as insert,
};

/// The mark must read back at least this well from the file just written, and should after a little noise.
const READ_BACK: f64 = -6.0;

/// Of fields some are known far better than others after noise. The paper's test weighs all alike: where it gives -3, the
/// robust method finds -69 (fandisk), so that less than this means that nothing is left.
const WEAK_FIELDS: f64 = -1.5;

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
    /// What each key costs.
    derivation: Derivation,
    /// What no vertex may move by more than, in model units.
    most: Option<f64>,
    self_test: SelfTest,
    /// What is to be said of every copy.
    warnings: Vec<String>,
    /// What there is besides a lower ε by which less is seen.
    milder: Option<&'static str>,
    /// The preparation's.
    seconds: Stages,
}

impl<'a> Embedder<'a> {
    /// The original with its basis computed. `fewer_if_small` is [`EmbedOptions::fewer_if_small`](crate::EmbedOptions::fewer_if_small).
    ///
    /// # Errors
    /// [`EmbedError`] when the mesh cannot carry a mark with these parameters.
    pub fn new(
        original: &'a Document,
        parameters: Parameters,
        fewer_if_small: bool,
    ) -> Result<Self, EmbedError> {
        Self::within(original, parameters, fewer_if_small, None)
    }

    /// The same with ε lowered so far that a mark moves a vertex by more than `most` model units, before the file rounds it,
    /// with a probability of 0.001 at most; such a mark is refused by [`mark`](Self::mark). The ε that all copies then have
    /// ([`parameters`](Self::parameters)) depends on the matrix B alone, never on a watermark, which is bound to it. It is
    /// never raised.
    ///
    /// # Errors
    /// As [`new`](Self::new); [`EmbedError::Displacement`] when `most` is not above 0, [`EmbedError::TooLittle`] when it
    /// leaves no usable ε.
    pub fn within(
        original: &'a Document,
        parameters: Parameters,
        fewer_if_small: bool,
        most: Option<f64>,
    ) -> Result<Self, EmbedError> {
        let mut seconds = Stages::default();
        let Parameters { basis: wanted, epsilon, .. } = parameters;
        if !EPSILONS.contains(&epsilon) {
            return Err(EmbedError::Epsilon { epsilon });
        }
        if !COEFFICIENTS.contains(&wanted.coefficients) {
            return Err(EmbedError::Coefficients { coefficients: wanted.coefficients });
        }
        if let Some(why) = original.fixed() {
            return Err(EmbedError::Fixed(WriteError::Fixed { why: why.to_owned() }));
        }
        let model = seconds.time("weld", || Model::of_scene(original.soup(), &original.scene()));
        if seconds.time("repair", || model.repaired()).mesh.face_count() == 0 {
            return Err(EmbedError::NoFaces);
        }
        if let Some(triangles) = unjoined(&model) {
            return Err(EmbedError::Unjoined { triangles });
        }
        let (progressive, coarser) =
            rayon::join(|| seconds.time("conversion", || model.converted()), || self_test::coarser(&model));
        let choice =
            seconds.time("basis", || Choice::new(&model, progressive, parameters, fewer_if_small))?;
        let Choice { basis, mut parameters, expected, note } = choice;
        // A preset that was taken for want of the other one is not to be exchanged for it.
        let milder = parameters.basis.function != BasisFunction::Field && note.is_none();
        // A smaller ε asks less of walls and gaps, so that the bound is that of what they do not limit.
        if let Some(most) = most {
            parameters.epsilon = epsilon_within(&basis, parameters.epsilon, most)?;
        }
        let basis = seconds.time("basis", || model.kept_apart(basis, &parameters.basis, parameters.epsilon));
        let (self_test, basis_digest) = rayon::join(
            || seconds.time("test", || SelfTest::new(&model, &basis, coarser)),
            || basis.digest(),
        );
        let self_test = self_test?;
        let digest = seconds.time("insert", || OriginalDigest::of(original.parts()));
        Ok(Self {
            original,
            warnings: warnings(original, &model, note, [expected, basis.functions().len()]),
            model,
            basis_digest,
            basis,
            digest,
            parameters,
            derivation: Derivation::STANDARD,
            most,
            self_test,
            milder: milder.then_some("take --preset faithful"),
            seconds,
        })
    }

    /// The same with keys that cost something else: for experiments with thousands of them. Keys with less than
    /// [`Derivation::STANDARD`] are refused everywhere but there.
    #[must_use]
    pub fn with_derivation(self, derivation: Derivation) -> Self {
        Self { derivation, ..self }
    }

    /// The parameters that all copies are marked with.
    pub fn parameters(&self) -> Parameters {
        self.parameters
    }

    /// The key of the copy with this identity and secret.
    pub fn key(&self, identity: Identity, secret: Secret) -> Key {
        Key::new(&self.digest, identity, secret, self.parameters, &self.basis_digest, self.derivation)
    }

    /// One marked copy, tested.
    ///
    /// # Errors
    /// [`EmbedError`] when the format cannot store the mark.
    pub fn mark(&self, identity: Identity, secret: Secret, rewrite: &Rewrite) -> Result<Marked, EmbedError> {
        let mut seconds = Stages::default();
        let Self { original, model, basis, .. } = self;
        let rewrite = &rewrite.clone().with_filling(Filling(secret.for_digits()));
        let key = self.key(identity, secret);
        let (Rewritten { bytes, companions, .. }, moved) = seconds.time("insert", || {
            let points = insert(&model.soup().points, basis, &key.watermark, key.parameters.epsilon);
            let rewritten = original.rewrite(&model.stored_from_points(&points), rewrite)?;
            Ok::<_, WriteError>((rewritten, points))
        })?;
        let distortion = DistortionReport::between(model, &moved);
        if let Some(most) = self.most.filter(|&most| distortion.max > most) {
            return Err(EmbedError::Moved { most, moved: distortion.max });
        }
        let copy = seconds.time("read back", || self.read_back(&bytes, companions.is_empty(), &moved))?;
        let is_field = key.parameters.basis.function == BasisFunction::Field;
        let wanted = if is_field { WEAK_FIELDS } else { READ_BACK };
        let tested =
            seconds.time("test", || self.self_test.of_copy(model, basis, &key, copy.points(), wanted))?;
        let Tested { log10_p, after_noise: log10_p_after_noise, halved: log10_p_halved, .. } = tested;
        if log10_p > READ_BACK {
            return Err(EmbedError::Lost { log10_p });
        }
        let mut warnings = self.warnings.clone();
        warnings.extend(weak(&tested, wanted, self.most.is_some()));
        warnings.extend(unmarked(model, &moved));
        let report = EmbedReport {
            vertices: original.points().len(),
            faces: usize::try_from(original.triangles_with_instances()).unwrap_or(usize::MAX),
            coefficients: key.watermark.len(),
            epsilon: key.parameters.epsilon,
            basis: key.parameters.basis.function.to_string(),
            distortion,
            fidelity: None,
            log10_p,
            log10_p_after_noise,
            log10_p_halved,
            unit: original.unit().map(str::to_owned),
            seconds,
            warnings,
        };
        Ok(Marked { bytes, companions, points: copy.points().to_vec(), key, report })
    }

    /// A copy that [`mark`](Self::mark) made, with its [`fidelity`](EmbedReport::fidelity) measured and what is amiss among
    /// its warnings. All copies of one original are much alike: of many, one may stand for all.
    #[must_use]
    pub fn measured(&self, marked: Marked) -> Marked {
        measured(self.original, &self.model, self.milder, marked)
    }

    /// [`measured`](Self::measured) with the preparation's seconds among its own, of the last copy: what only others need is
    /// let go of.
    pub(super) fn finished(self, marked: Marked) -> Marked {
        let Self { original, model, basis, milder, mut seconds, .. } = self;
        drop(basis);
        let mut marked = measured(original, &model, milder, marked);
        seconds.add(marked.report.seconds);
        marked.report.seconds = seconds;
        marked
    }

    /// The marked file with `moved` points, read from its `bytes`. One that needs others cannot be read from memory; then
    /// the same positions are read from one that does not.
    fn read_back(
        &self,
        bytes: &[u8],
        stands_alone: bool,
        moved: &[Point3<f64>],
    ) -> Result<Document, EmbedError> {
        let whole = if stands_alone {
            bytes.to_vec()
        } else {
            self.original.with_points(&self.model.stored_from_points(moved))?
        };
        Ok(Document::parse_within(whole, Some(self.original.extension()), Limits::unlimited())?)
    }
}

/// A copy with its fidelity measured; `milder` is what there is besides a lower ε by which less is seen.
fn measured(original: &Document, model: &Model, milder: Option<&'static str>, mut marked: Marked) -> Marked {
    let mut seconds = marked.report.seconds;
    let fidelity = seconds.time("fidelity", || {
        let places = Places::new(original.points(), &marked.points);
        // Both by the same means, so that what did not move is the same to the bit.
        let [before, after] = [original.points(), &marked.points].map(|p| model.points_from_stored(p));
        Fidelity::between(&before, &after, &model.soup().triangles, Some(places))
    });
    marked.report.seconds = seconds;
    marked.report.warnings.extend(fidelity.warnings(milder));
    marked.report.fidelity = Some(fidelity);
    marked
}

/// So many triangles may be apart on purpose.
const FEW_TRIANGLES: usize = 16;

/// How many triangles there are, when no two of them share an edge.
fn unjoined(model: &Model) -> Option<usize> {
    let mesh = &model.repaired().mesh;
    let triangles = mesh.face_count();
    let apart = || mesh.edges().all(|edge| mesh.is_boundary_edge(edge));
    (triangles > FEW_TRIANGLES && apart()).then_some(triangles)
}

/// What is to be said of a mark that hardly survives, and what would make it strong enough.
fn weak(tested: &Tested, wanted: f64, is_limited: bool) -> Option<String> {
    let Tested { after_noise, halved, enough, .. } = *tested;
    let worst = halved.map_or(after_noise, |halved| halved.max(after_noise));
    if worst <= wanted {
        return None;
    }
    let what = match halved {
        Some(halved) if halved > after_noise => {
            "after noise of 0.1 % of each part's largest side and simplification to half"
        }
        _ => "after noise of 0.2 % of each part's largest side",
    };
    let cure = match enough {
        _ if is_limited => "allow a larger displacement".to_owned(),
        Some(epsilon) => format!("raise --epsilon to {}", short(epsilon)),
        None => "no strength makes up for it; use a finer mesh or more coefficients".to_owned(),
    };
    let condition = if is_limited || enough.is_some() { ", if the model bears it" } else { "" };
    Some(format!(
        "The mark is weak: {what} the paper's test would give log10 p = {worst:.1}; {cure}{condition}."
    ))
}

/// A number with two digits, rounded up.
fn short(x: f64) -> f64 {
    let unit = 10_f64.powi(libm::floor(libm::log10(x)) as i32 - 1);
    format!("{:.1e}", (x / unit).ceil() * unit).parse().unwrap_or(x)
}

/// How many parts of the model do not move, if some do not: whoever has only those has no mark.
fn unmarked(model: &Model, moved: &[Point3<f64>]) -> Option<String> {
    let Repaired { mesh, points, source, .. } = model.repaired();
    let (part, count) = topology::components(mesh);
    let mut is_marked = vec![false; count];
    let mut area = vec![0.0_f64; count];
    for ((&part, &point), stood) in part.iter().zip(source).zip(points) {
        is_marked[part as usize] |= moved[point as usize] != *stood;
    }
    for corners in mesh.triangles() {
        let [a, b, c] = corners.map(|v| &points[v as usize]);
        area[part[corners[0] as usize] as usize] += geometry::area_vector(a, b, c).norm();
    }
    let still: Vec<usize> = (0..count).filter(|&part| !is_marked[part]).collect();
    let share = still.iter().map(|&part| area[part]).sum::<f64>() / area.iter().sum::<f64>();
    let percent = 100.0 * share;
    match still.len() {
        0 => None,
        1 => Some(format!("UNMARKED: 1 of {count} parts, with {percent:.1} % of the area, carries no mark.")),
        n => Some(format!("UNMARKED: {n} of {count} parts, with {percent:.1} % of the area, carry no mark.")),
    }
}

/// What was mended, and whether the mesh is small.
fn warnings(
    original: &Document,
    model: &Model,
    note: Option<String>,
    [wanted, carried]: [usize; 2],
) -> Vec<String> {
    let mut notes = original.notes().to_vec();
    notes.extend(repair_notes(&model.repaired().report));
    notes.extend(note);
    if carried < wanted {
        let least = COEFFICIENTS.start();
        let floor = if carried < FEW {
            format!(
                " Fewer than {FEW} prove little after an attack, and {least} are the least that a key can have."
            )
        } else {
            String::new()
        };
        notes.push(format!(
            "The mesh is small: it carries {carried} coefficients, not {wanted}, which survive less.{floor}"
        ));
    }
    notes
}
