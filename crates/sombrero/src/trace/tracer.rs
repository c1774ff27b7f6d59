//! One original and all of its keys, ready for any number of suspects.

use super::many_keys::{ManyKeys, Score};
use super::verdict::{Named, Rejected, Trace};
use crate::detect::{Alignment, DetectError, DetectOptions, positions};
use rayon::prelude::*;
use sombrero_io::Document;
use sombrero_search::{Glance, Looked, Original, Outline, SearchOutcome, search_from};
use sombrero_stats::{LogProbability, best_of};
use sombrero_watermark::{Key, OriginalDigest, Parameters};

/// An original with all the keys that were made for it.
#[derive(Debug)]
pub struct Tracer {
    keys: Vec<Key>,
    groups: Vec<Group>,
    /// Whether keys are taken at their word.
    trusting: bool,
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
    /// The tracer of those keys that belong to `original`; the basis is computed once for all keys of equal parameters.
    /// Those that do not belong are given back with the reason. Whether a watermark was derived as the key says is checked
    /// when the key is about to be named, since that costs.
    ///
    /// # Errors
    /// [`DetectError::NoFaces`] or [`DetectError::Basis`] when the original cannot carry such marks.
    pub fn new(original: &Document, keys: Vec<Key>) -> Result<(Self, Vec<Rejected>), DetectError> {
        Self::with(original, None, keys)
    }

    /// [`Tracer::new`] with the outline of `original`, where it is known already.
    ///
    /// # Errors
    /// As [`Tracer::new`].
    pub fn of_outline(
        original: &Document,
        outline: Outline,
        keys: Vec<Key>,
    ) -> Result<(Self, Vec<Rejected>), DetectError> {
        Self::with(original, Some(outline), keys)
    }

    fn with(
        original: &Document,
        mut outline: Option<Outline>,
        keys: Vec<Key>,
    ) -> Result<(Self, Vec<Rejected>), DetectError> {
        let digest = OriginalDigest::of(original.parts());
        let mut rejected = Vec::new();
        let mut groups: Vec<Group> = Vec::new();
        for (index, key) in keys.iter().enumerate() {
            if let Err(reason) = key.check_original(&digest) {
                rejected.push(Rejected { index, reason });
                continue;
            }
            let place = match groups.iter().position(|group| group.parameters == key.parameters) {
                Some(place) => place,
                None => {
                    let parameters @ Parameters { basis, epsilon, .. } = key.parameters;
                    let outline = match outline.take() {
                        Some(outline) => outline,
                        None => Outline::new(original.soup(), &original.scene())?,
                    };
                    let original = Original::of_outline(outline, &basis, epsilon)?;
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
        Ok((Self { keys, groups, trusting: false }, rejected))
    }

    /// [`Tracer::new`] with keys that are taken at their word, whatever their watermarks cost: for experiments with
    /// thousands of keys. Whom it names, nobody has to believe.
    ///
    /// # Errors
    /// As [`Tracer::new`].
    pub fn trusting(original: &Document, keys: Vec<Key>) -> Result<(Self, Vec<Rejected>), DetectError> {
        let (tracer, rejected) = Self::new(original, keys)?;
        Ok((Self { trusting: true, ..tracer }, rejected))
    }

    /// One of the keys that were given, by its place.
    ///
    /// # Panics
    /// When there were not so many.
    pub fn key(&self, index: usize) -> &Key {
        &self.keys[index]
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
    /// Keys that are about to be named are checked first. If one of them is not genuine, all others are checked too and
    /// those that are not are left out of a second search: a forged key that fits well can end the first one before
    /// others show. The tests of both searches count.
    ///
    /// # Errors
    /// [`DetectError`] when the question makes no sense.
    pub fn trace(&self, suspect: &Document, options: &DetectOptions) -> Result<Trace, DetectError> {
        self.trace_after(None, suspect, options)
    }

    /// [`trace`](Self::trace) that goes on from a first look at this suspect with these options.
    ///
    /// # Errors
    /// As [`trace`](Self::trace).
    pub fn trace_after(
        &self,
        glance: Option<Glance>,
        suspect: &Document,
        options: &DetectOptions,
    ) -> Result<Trace, DetectError> {
        let mut first = self.look(glance, suspect, options, &[], 0)?;
        if self.trusting {
            return Ok(first);
        }
        let named: Vec<usize> = first.recipients.iter().filter(|r| r.named).map(|r| r.index).collect();
        let genuine = first.seconds.time("derivation", || self.rejected(&named).is_empty());
        if genuine {
            return Ok(first);
        }
        let all: Vec<usize> = self.groups.iter().flat_map(|group| &group.keys).copied().collect();
        let rejected = first.seconds.time("derivation", || self.rejected(&all));
        let mut second = self.look(None, suspect, options, &rejected, first.variants_counted)?;
        second.seconds.add(first.seconds);
        second.rejected = rejected;
        Ok(second)
    }

    /// Those of these keys that are not genuine. Each takes the memory of its derivation while it is checked, so no more
    /// than there are threads are at once.
    fn rejected(&self, keys: &[usize]) -> Vec<Rejected> {
        let check = |&index: &usize| {
            let reason = self.keys[index].check_watermark().err()?;
            Some(Rejected { index, reason })
        };
        keys.par_iter().filter_map(check).collect()
    }

    /// One search for all keys but those; `counted` tests were made before. The first group goes on from `glance`.
    fn look(
        &self,
        mut glance: Option<Glance>,
        suspect: &Document,
        options: &DetectOptions,
        without: &[Rejected],
        counted: usize,
    ) -> Result<Trace, DetectError> {
        let mut trace = Trace::of_nobody(options.threshold, counted);
        let mut searches: Vec<Searched<'_>> = Vec::new();
        for group in &self.groups {
            let suspect = group.original.suspect(&suspect.soup_like(group.original.triangles()));
            options.check(&suspect)?;
            let takes_part = |index: &usize| without.iter().all(|rejected| rejected.index != *index);
            let keys: Vec<usize> = group.keys.iter().copied().filter(takes_part).collect();
            if keys.is_empty() {
                continue;
            }
            let watermarks = keys.iter().map(|&i| self.keys[i].watermark.as_slice()).collect();
            let search_options = options.search();
            let glance = match glance.take() {
                Some(known) => known,
                None => group.original.outline().glance(&suspect, &search_options)?,
            };
            let SearchOutcome { looks, seconds, warnings, budget_spent, .. } =
                search_from(glance, &group.original, &suspect, &search_options, ManyKeys::new(watermarks))?;
            trace.seconds.add(seconds);
            trace.budget_spent |= budget_spent;
            trace
                .warnings
                .extend(warnings.into_iter().filter(|w| !trace.warnings.contains(w)).collect::<Vec<_>>());
            let least = looks.iter().map(|look| look.counted).min().unwrap_or(1).max(1);
            trace.variants_counted = trace.variants_counted.saturating_add(least);
            searches.push(Searched { group, keys, looks, least });
        }
        let mut alone: Vec<(usize, Corrected)> = Vec::new();
        let mut best = LogProbability::ONE;
        for searched in &searches {
            for look in &searched.looks {
                let counted = searched.counted(look, trace.variants_counted);
                let of_look = best_of(look.examiner.best, counted);
                if let Some((estimate, pose)) = &look.examiner.clearest
                    && (trace.coverage == 0.0 || of_look < best)
                {
                    best = of_look;
                    trace.coverage = searched.group.original.coverage(&positions(estimate));
                    trace.registration =
                        pose.map(|pose| Alignment::of_estimate(&pose, estimate, trace.coverage));
                }
            }
            alone.extend(searched.scores(trace.variants_counted));
        }
        alone.sort_by(|(i, a), (j, b)| a.p.ln().total_cmp(&b.p.ln()).then(i.cmp(j)));
        let name = |(index, Corrected { p, score }): (usize, Corrected)| {
            let log10_p = p.log10();
            let named = log10_p <= options.threshold.log10();
            let Score { correlation, beside_others, .. } = score;
            Named { index, named, log10_p, correlation, beside_others }
        };
        trace.recipients = alone.into_iter().map(name).collect();
        trace.found = trace.recipients.first().is_some_and(|first| first.named);
        Ok(trace)
    }
}

/// A score with its p after correction.
struct Corrected {
    p: LogProbability,
    score: Score,
}

/// What the search for the keys of one group gave.
struct Searched<'a> {
    group: &'a Group,
    /// Places in [`Tracer::keys`].
    keys: Vec<usize>,
    looks: Vec<Looked<ManyKeys<'a>>>,
    /// The smallest number of tests that one of its looks counts.
    least: usize,
}

impl Searched<'_> {
    /// What p of a look is corrected for. Groups share the chance to name somebody innocent as their searches count; looks
    /// share that of their group.
    ///
    /// ```text
    /// k_gl · (Σ_g c_g) / c_g,    k_gl what look l of group g counts, c_g = min_l k_gl
    /// ```
    fn counted(&self, look: &Looked<ManyKeys<'_>>, all: usize) -> usize {
        let counted = (look.counted as u128 * all as u128).div_ceil(self.least as u128);
        usize::try_from(counted).unwrap_or(usize::MAX)
    }

    /// Of each key the look in which it shows best.
    fn scores(&self, all: usize) -> Vec<(usize, Corrected)> {
        let in_look = |look: &Looked<ManyKeys<'_>>, at: usize| {
            let score = look.examiner.scores[at];
            Corrected { p: best_of(score.p, self.counted(look, all)), score }
        };
        let best = |(at, &key): (usize, &usize)| {
            let looks = self.looks.iter().map(|look| in_look(look, at));
            Some((key, looks.min_by(|a, b| a.p.ln().total_cmp(&b.p.ln()))?))
        };
        self.keys.iter().enumerate().filter_map(best).collect()
    }
}
