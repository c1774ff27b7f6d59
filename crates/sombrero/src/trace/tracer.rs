//! One original and all of its keys, ready for any number of suspects.

use super::many_keys::{ManyKeys, Score};
use super::verdict::{Named, Rejected, Trace};
use crate::detect::{Alignment, DetectError, DetectOptions, positions};
use rayon::prelude::*;
use sombrero_io::Document;
use sombrero_search::{Original, SearchOutcome, Stages, search};
use sombrero_stats::{LogProbability, best_of};
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

impl Tracer {
    /// The tracer of those keys that are genuine and belong to `original`; the basis is computed once for all keys of
    /// equal parameters. Those that do not belong are given back with the reason.
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
                    let original = Original::new(original.soup(), &basis, epsilon)?;
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

    /// The number of keys that can be traced.
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
            let suspect = group.original.suspect(suspect.soup());
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
