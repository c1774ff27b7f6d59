//! Whose copy is it? One search, every key.
//!
//! The estimates of the robust method do not depend on a key, so a thousand keys cost one extraction. Each key is
//! tested as `detect` would, and once more beside the keys that the others show ([`accuse`]): copies that were averaged
//! carry all of their marks weakly, and each is noise to the rest until it is accounted for. Every test of every key
//! counts: the chance to name anyone who had no part is at most p.

use crate::detect::{Alignment, DetectError, DetectOptions, FLOORS, positions, robust};
use nalgebra::Affine3;
use rayon::prelude::*;
use serde::Serialize;
use sombrero_extraction::Estimate;
use sombrero_io::Document;
use sombrero_search::{Examiner, Hypothesis, Original, SearchOutcome, Stages, search};
use sombrero_stats::{Ellipsoid, LogProbability, WatermarkTestOptions, accuse, best_of, watermark_test};
use sombrero_watermark::{Key, Mismatch, OriginalDigest, Parameters};

/// An original with all the keys that were made for it.
#[derive(Debug)]
pub struct Tracer {
    keys: Vec<Key>,
    groups: Vec<Group>,
}

/// Keys of equal parameters, which share everything but their watermarks.
#[derive(Debug)]
struct Group {
    parameters: Parameters,
    original: Original,
    /// Places in [`Tracer::keys`].
    keys: Vec<usize>,
}

/// A key that takes no part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rejected {
    /// Its place among the keys that were given.
    pub index: usize,
    /// Why.
    pub reason: Mismatch,
}

/// Who is in a suspect.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Trace {
    /// Whether anybody is named: p of the first is at most the threshold.
    pub found: bool,
    /// Every key with its p, best first; equal ones in the order in which they were given.
    pub recipients: Vec<Named>,
    /// The threshold for p.
    pub threshold: f64,
    /// How many tests p was corrected for: of all keys, in all variants, those left out because one was certain too.
    pub variants_counted: usize,
    /// Share of the original's area that was found on the suspect.
    pub coverage: f64,
    /// How the suspect was moved onto the original; `None` when it was taken as it is.
    pub registration: Option<Alignment>,
    /// Seconds by stage.
    pub seconds: Stages,
    /// What the user should know, in sentences.
    pub warnings: Vec<String>,
}

/// One key's part in a suspect.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Named {
    /// Its place among the keys that were given to [`Tracer::new`].
    pub index: usize,
    /// Whether p is at most the threshold.
    pub named: bool,
    /// log10 of the probability that anybody without a part would be named as surely; corrected for the number of
    /// keys and variants, finite.
    pub log10_p: f64,
    /// Correlation of inserted and extracted coefficients, about 1/√c for one of c averaged copies.
    pub correlation: f64,
    /// Whether it shows best beside other keys that were found too.
    pub beside_others: bool,
}

impl Tracer {
    /// Checks which keys are genuine and belong to `original`, and computes the basis, once for all keys of equal
    /// parameters. Those that do not belong are given back with the reason.
    ///
    /// # Errors
    /// [`DetectError::NoFaces`] or [`DetectError::Basis`] when the original cannot carry such marks.
    pub fn new(original: &Document, keys: Vec<Key>) -> Result<(Self, Vec<Rejected>), DetectError> {
        let digest = OriginalDigest::of(&original.content());
        let checked: Vec<Result<(), Mismatch>> =
            keys.par_iter().map(|key| key.check_watermark(&digest)).collect();
        let mut rejected = Vec::new();
        let mut groups: Vec<Group> = Vec::new();
        for (index, (key, checked)) in keys.iter().zip(checked).enumerate() {
            if let Err(reason) = checked {
                rejected.push(Rejected { index, reason });
                continue;
            }
            let place = match groups.iter().position(|group| group.parameters == key.parameters) {
                Some(place) => place,
                None => {
                    let parameters @ Parameters { basis, epsilon } = key.parameters;
                    let original = Original::new(&original.soup(), &basis, epsilon)?;
                    groups.push(Group { parameters, original, keys: Vec::new() });
                    groups.len() - 1
                }
            };
            match key.check_basis(groups[place].original.basis_digest()) {
                Ok(()) => groups[place].keys.push(index),
                Err(reason) => rejected.push(Rejected { index, reason }),
            }
        }
        groups.retain(|group| !group.keys.is_empty());
        Ok((Self { keys, groups }, rejected))
    }

    /// How many keys can be traced.
    pub fn len(&self) -> usize {
        self.groups.iter().map(|group| group.keys.len()).sum()
    }

    /// Whether no key can be traced.
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// Looks for every key's mark in `suspect` by the robust method; `options.method` and `options.seed` do not matter.
    /// Without a key the answer is that nobody was found.
    ///
    /// # Errors
    /// [`DetectError`] when the question makes no sense.
    pub fn trace(&self, suspect: &Document, options: &DetectOptions) -> Result<Trace, DetectError> {
        let mut trace = Trace {
            found: false,
            recipients: Vec::new(),
            threshold: options.threshold,
            variants_counted: 0,
            coverage: 0.0,
            registration: None,
            seconds: Stages::default(),
            warnings: Vec::new(),
        };
        let mut alone: Vec<(usize, Score)> = Vec::new();
        let mut best = LogProbability::ONE;
        for group in &self.groups {
            let suspect = group.original.suspect(&suspect.soup());
            options.check(&suspect)?;
            let watermarks = group.keys.iter().map(|&i| self.keys[i].watermark.as_slice()).collect();
            let SearchOutcome { examiner, counted, seconds, warnings, .. } =
                search(&group.original, &suspect, &options.search(), ManyKeys::new(watermarks))?;
            trace.variants_counted += counted;
            trace.seconds.add(seconds);
            trace
                .warnings
                .extend(warnings.into_iter().filter(|w| !trace.warnings.contains(w)).collect::<Vec<_>>());
            if let Some((estimate, pose)) =
                examiner.clearest.filter(|_| trace.coverage == 0.0 || examiner.best < best)
            {
                best = examiner.best;
                trace.coverage = group.original.coverage(&positions(&estimate));
                trace.registration =
                    pose.map(|pose| Alignment::of_estimate(&pose, &estimate, trace.coverage));
            }
            alone.extend(group.keys.iter().copied().zip(examiner.scores));
        }
        alone.sort_by(|(i, a), (j, b)| a.p.ln().total_cmp(&b.p.ln()).then(i.cmp(j)));
        let name = |(index, score): (usize, Score)| {
            let log10_p = best_of(score.p, trace.variants_counted).log10();
            let named = log10_p <= options.threshold.log10();
            let Score { correlation, beside_others, .. } = score;
            Named { index, named, log10_p, correlation, beside_others }
        };
        trace.recipients = alone.into_iter().map(name).collect();
        trace.found = trace.recipients.first().is_some_and(|first| first.named);
        Ok(trace)
    }
}

/// The best test of one key so far.
#[derive(Debug, Clone, Copy)]
struct Score {
    p: LogProbability,
    correlation: f64,
    beside_others: bool,
}

/// Looks for many watermarks at once.
struct ManyKeys<'a> {
    watermarks: Vec<&'a [f64]>,
    scores: Vec<Score>,
    /// The best p of all, and the estimate in which it was.
    best: LogProbability,
    clearest: Option<(Estimate, Option<Affine3<f64>>)>,
}

impl<'a> ManyKeys<'a> {
    fn new(watermarks: Vec<&'a [f64]>) -> Self {
        let none = Score { p: LogProbability::ONE, correlation: 0.0, beside_others: false };
        let scores = vec![none; watermarks.len()];
        Self { watermarks, scores, best: LogProbability::ONE, clearest: None }
    }
}

impl Examiner for ManyKeys<'_> {
    type Error = DetectError;
    /// Those of one key, and one beside the others.
    const TESTS: usize = robust::TESTS + 1;

    fn examine(
        &mut self,
        hypothesis: &Hypothesis,
        estimate: &Estimate,
        seconds: &mut Stages,
    ) -> Result<(), DetectError> {
        let extracted = estimate.known();
        let scores = seconds.time("tests", || {
            let ellipsoid = Ellipsoid::new(&estimate.coefficients, &estimate.precision)?;
            let ellipsoids = FLOORS.map(|floor| ellipsoid.with_floor(floor));
            let ellipsoids = ellipsoids.into_iter().collect::<Result<Vec<_>, _>>()?;
            let options = WatermarkTestOptions::default();
            let alone = |w: &&[f64]| {
                let correlation = watermark_test(w, &extracted, &options)?;
                let mut p = correlation.p;
                for ellipsoid in &ellipsoids {
                    p = smaller(p, ellipsoid.test(w)?.bound);
                }
                Ok::<_, DetectError>(Score { p, correlation: correlation.rho(), beside_others: false })
            };
            let mut scores = self.watermarks.par_iter().map(alone).collect::<Result<Vec<_>, _>>()?;
            let beside = accuse(&self.watermarks, &ellipsoid)?;
            for (score, p) in scores.iter_mut().zip(beside) {
                if p < score.p {
                    *score = Score { p, beside_others: true, ..*score };
                }
            }
            Ok::<_, DetectError>(scores)
        })?;
        let best = scores.iter().map(|score| score.p).fold(LogProbability::ONE, smaller);
        if self.clearest.is_none() || best < self.best {
            (self.best, self.clearest) = (best, Some((estimate.clone(), hypothesis.pose)));
        }
        for (known, score) in self.scores.iter_mut().zip(scores) {
            if score.p < known.p {
                *known = score;
            }
        }
        Ok(())
    }

    fn best(&self) -> Option<LogProbability> {
        self.clearest.as_ref().map(|_| self.best)
    }

    fn watermarks(&self) -> usize {
        self.watermarks.len()
    }
}

fn smaller(a: LogProbability, b: LogProbability) -> LogProbability {
    if b < a { b } else { a }
}
