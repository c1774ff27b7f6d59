//! The candidates of one suspect, tested with their keys one after the other.
//!
//! Which candidates there are, their order and how many tests they may take is decided by shapes alone, before any key is
//! looked at. All planned tests count, whether they take place or not: of n tests each has p times n (Bonferroni), as `trace`
//! corrects for its keys within one of them.

use crate::catalogue::{KeptKey, Originals};
use crate::failure::Failure;
use sombrero::io::{Document, Format, encode};
use sombrero::search::{Outline, SearchOptions};
use sombrero::{DetectOptions, Tracer};
use sombrero_catalogue::{Candidate, Question};

/// CPU seconds for each test, as `detect` has them.
pub(super) const BUDGET: f64 = 60.0;

/// Candidates of a lower score are other shapes, and their keys are not tested: of 990 suspects attacked in nine ways, all whose
/// original was among the ten candidates had it at 0.44 or more, and strangers rarely reach 0.4. Of fewer tests each counts more.
const ALIKE: f64 = 0.4;

/// A candidate, and what its keys said.
pub(super) struct Examined {
    pub(super) candidate: Candidate,
    /// What was found with its keys; `None` when none was tested.
    pub(super) tested: Option<Tested>,
    /// Why it could not be tested, or why keys were left out.
    pub(super) notes: Vec<String>,
}

impl Examined {
    /// Whether a mark was found.
    pub(super) fn is_found(&self) -> bool {
        self.tested.as_ref().is_some_and(|tested| tested.named > 0)
    }
}

/// What was found with the keys of a candidate.
pub(super) struct Tested {
    /// The keys, best first, each with log10 p, corrected for all tests of the whole search.
    pub(super) keys: Vec<(KeptKey, f64)>,
    /// How many of them are named.
    pub(super) named: usize,
}

/// One suspect's candidates.
pub(super) struct Examination {
    pub(super) candidates: Vec<Examined>,
    /// The number of tests that p was corrected for, each of all keys of one original.
    pub(super) tests: usize,
}

/// A candidate that can be tested.
struct Planned {
    candidate: Candidate,
    keys: Vec<KeptKey>,
    notes: Vec<String>,
}

impl Planned {
    /// A part is looked at by itself first, which is quicker, and then within the whole.
    fn tests(&self) -> usize {
        match (self.is_tested(), self.candidate.part) {
            (false, _) => 0,
            (true, None) => 1,
            (true, Some(_)) => 2,
        }
    }

    fn is_tested(&self) -> bool {
        !self.keys.is_empty() && self.candidate.score >= ALIKE
    }
}

/// Tests candidates until one is found for every part of the suspect that has any.
pub(super) fn examine(
    suspect: &Document,
    question: &Question,
    candidates: Vec<Candidate>,
    originals: &Originals,
    threshold: f64,
) -> Result<Examination, Failure> {
    let planned: Vec<Planned> =
        candidates.into_iter().map(|candidate| planned(candidate, originals)).collect();
    let tests = planned.iter().map(Planned::tests).sum::<usize>();
    let options = DetectOptions {
        threshold: threshold / tests.max(1) as f64,
        budget: Some(BUDGET),
        ..DetectOptions::default()
    };
    let mut examined: Vec<Examined> = Vec::with_capacity(planned.len());
    for planned in planned {
        let is_tested = planned.is_tested();
        let Planned { candidate, keys, mut notes } = planned;
        // What the whole was made from, or this part.
        let is_settled = examined
            .iter()
            .any(|before| before.is_found() && [None, candidate.part].contains(&before.candidate.part));
        let mut tested = None;
        if is_tested && !is_settled {
            match test(suspect, question, &candidate, originals, &keys, &options) {
                Ok(found) => {
                    let Found { keys, named, notes: more } = found;
                    let correct = |(key, p): (KeptKey, f64)| (key, (p + (tests as f64).log10()).min(0.0));
                    tested = Some(Tested { keys: keys.into_iter().map(correct).collect(), named });
                    notes.extend(more);
                }
                Err(failure) => notes.push(failure.message().to_owned()),
            }
        }
        examined.push(Examined { candidate, tested, notes });
    }
    Ok(Examination { candidates: examined, tests })
}

/// The keys of a candidate. One whose keys cannot be read is told of and ranked all the same.
fn planned(candidate: Candidate, originals: &Originals) -> Planned {
    let (keys, notes) = match originals.keys(&candidate.entry) {
        Ok(keys) => (keys, Vec::new()),
        Err(failure) => (Vec::new(), vec![failure.message().to_owned()]),
    };
    Planned { candidate, keys, notes }
}

/// What the keys of one original said, not yet corrected for the others.
struct Found {
    keys: Vec<(KeptKey, f64)>,
    named: usize,
    notes: Vec<String>,
}

fn test(
    suspect: &Document,
    question: &Question,
    candidate: &Candidate,
    originals: &Originals,
    keys: &[KeptKey],
    options: &DetectOptions,
) -> Result<Found, Failure> {
    let original = originals.document(&candidate.entry)?;
    let part = candidate.part.and_then(|part| question.part(part));
    let Some(part) = part else { return traced(&original, suspect, keys, options) };
    let unreadable =
        |e: &dyn std::fmt::Display| Failure::new("suspect", format!("a part of the suspect: {e}"));
    let bytes = encode(Format::PlyBinaryLittleEndian, &part).map_err(|e| unreadable(&e))?;
    let part = Document::parse(bytes, None).map_err(|e| unreadable(&e))?;
    let found = traced(&original, &part, keys, options)?;
    if found.named > 0 { Ok(found) } else { traced(&original, suspect, keys, options) }
}

/// The keys of `original`, tested on `suspect`. A suspect of another shape is told before the basis is computed.
fn traced(
    original: &Document,
    suspect: &Document,
    keys: &[KeptKey],
    options: &DetectOptions,
) -> Result<Found, Failure> {
    let failed = |e: &dyn std::error::Error| Failure::new("suspect", e.to_string());
    let outline = Outline::new(original.soup(), &original.scene()).map_err(|e| failed(&e))?;
    let shape = outline.suspect(&suspect.soup_like(outline.triangles()));
    let looking =
        SearchOptions { threshold: options.threshold, budget: options.budget, ..SearchOptions::default() };
    let glance = outline.glance(&shape, &looking).map_err(|e| failed(&e))?;
    if glance.is_another_shape() {
        let keys = keys.iter().map(|key| (key.clone(), 0.0)).collect();
        return Ok(Found { keys, named: 0, notes: Vec::new() });
    }
    let all = keys.iter().map(|kept| kept.key.clone()).collect();
    let (tracer, rejected) = Tracer::of_outline(original, outline, all).map_err(|e| failed(&e))?;
    let trace = tracer.trace_after(Some(glance), suspect, options).map_err(|e| failed(&e))?;
    let place = |index: usize| keys[index].path.display();
    let rejected = rejected.iter().chain(&trace.rejected);
    Ok(Found {
        notes: rejected.map(|r| format!("{}: {}", place(r.index), r.reason)).chain(trace.warnings).collect(),
        named: trace.recipients.iter().filter(|recipient| recipient.named).count(),
        keys: trace.recipients.iter().map(|r| (keys[r.index].clone(), r.log10_p)).collect(),
    })
}
