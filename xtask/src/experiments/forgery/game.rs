//! The claimant's game: whether originals made up after the suspect, and free choice of everything else, bring more than
//! tries do.
//!
//! He knows the suspect before he makes the original, so that w* can be what he likes: none of what he does is secret to
//! him but w, which he gets by a derivation once all else is fixed.

use super::{Rate, SEED, line};
use anyhow::Context;
use nalgebra::Point3;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::Serialize;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::basis::{Amplitudes, BasisFunction, BasisOptions};
use sombrero::extraction::{Estimate, extract};
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::Soup;
use sombrero::search::{Examiner, Hypothesis, Looked, Model, Original, SearchOptions, Suspect, search};
use sombrero::shapes;
use sombrero::stats::{KeyTests, LogProbability, WatermarkTestOptions, best_of, watermark_test};
use sombrero::watermark::{COEFFICIENTS, Derivation, Identity, Key, OriginalDigest, Parameters, Secret};
use sombrero::{DetectOptions, Method, Stages, When, settings_weight};
use std::collections::BTreeMap;

/// Rates from 10^-1 down to 10^-4.
const LAST: usize = 4;

/// How an original is made from a suspect.
const WAYS: [&str; 9] = [
    "the suspect itself",
    "noise",
    "smoothing",
    "simplification",
    "solved for a mark",
    "solved for a mark far too strong",
    "solved for a few coefficients",
    "solved for coefficients that are nearly equal",
    "solved, suspect cropped",
];

/// What the command lets him set: registration, resampling. The defaults first.
const SETTINGS: [(When, When); 4] = [
    (When::Auto, When::Auto),
    (When::Never, When::Auto),
    (When::Auto, When::Always),
    (When::Never, When::Always),
];

/// log10 of what p is multiplied with for the choice of settings, as a verdict does.
fn price(options: &DetectOptions) -> f64 {
    -settings_weight(options).log10()
}

#[derive(Serialize)]
pub(super) struct Game {
    games: u64,
    keys: usize,
    pub(super) rates: Vec<Rate>,
    smallest_log10_p: f64,
    /// Of every way, the tries and the smallest p.
    ways: BTreeMap<&'static str, Way>,
    /// Why a question was not answered, and how often.
    unanswered: BTreeMap<String, u64>,
}

#[derive(Serialize, Clone, Copy, Default)]
struct Way {
    tries: u64,
    smallest_log10_p: f64,
    counts: [u64; LAST],
}

/// What a pair of original and suspect gave: log10 p for each key, the best of all settings.
struct Played {
    way: &'static str,
    log10_p: Vec<f64>,
    unanswered: Vec<String>,
}

impl Game {
    pub(super) fn run(games: u64, keys: usize) -> anyhow::Result<Self> {
        let played: Vec<Played> =
            (0..games).into_par_iter().map(|number| play(number, keys)).collect::<anyhow::Result<_>>()?;
        let mut ways: BTreeMap<&str, Way> = BTreeMap::new();
        let mut unanswered = BTreeMap::new();
        let mut all = Way::default();
        for Played { way, log10_p, unanswered: reasons } in played {
            all.add(&log10_p);
            ways.entry(way).or_default().add(&log10_p);
            for reason in reasons {
                *unanswered.entry(reason).or_insert(0) += 1;
            }
        }
        let rates = Rate::all(&all.counts, all.tries);
        Ok(Self { games, keys, rates, smallest_log10_p: all.smallest_log10_p, ways, unanswered })
    }

    pub(super) fn write(&self, out: &mut String) {
        let Self { games, keys, rates, ways, unanswered, .. } = self;
        line(out, format_args!("## The claimant's game\n"));
        line(
            out,
            format_args!(
                "{games} random suspects, an original made from each, random parameters, {keys} keys for each with texts and \
                 secrets of their own, derivation stubbed; each key detected with the defaults and with four other settings, of which \
                 the best counts, p times what a verdict multiplies it with for the choice of settings (2 for the defaults, 34 for others). Of all keys a share of 10^-k at most may \
                 be at p <= 10^-k.\n"
            ),
        );
        line(out, format_args!("| original | keys | at 0.1 | 0.01 | 0.001 | 0.0001 | smallest log10 p |"));
        line(out, format_args!("|---|---|---|---|---|---|---|"));
        let mut total = Way::default();
        for (name, way) in ways {
            way.write(name, out);
            total.merge(way);
        }
        total.write("all", out);
        let allowed: Vec<String> = rates.iter().map(|rate| format!("{:.0}", rate.expected)).collect();
        line(out, format_args!("| allowed | | {} | |\n", allowed.join(" | ")));
        if !unanswered.is_empty() {
            line(out, format_args!("Questions that got no answer (p = 1):\n"));
            for (reason, count) in unanswered {
                line(out, format_args!("- {count} times: {reason}"));
            }
            line(out, format_args!(""));
        }
    }
}

impl Way {
    fn add(&mut self, log10_p: &[f64]) {
        self.tries += log10_p.len() as u64;
        for p in log10_p {
            self.smallest_log10_p = self.smallest_log10_p.min(*p);
            (1..).zip(&mut self.counts).for_each(|(k, count)| *count += u64::from(*p <= -f64::from(k)));
        }
    }

    fn merge(&mut self, other: &Self) {
        self.tries += other.tries;
        self.smallest_log10_p = self.smallest_log10_p.min(other.smallest_log10_p);
        self.counts.iter_mut().zip(other.counts).for_each(|(a, b)| *a += b);
    }

    fn write(&self, name: &str, out: &mut String) {
        let Self { tries, smallest_log10_p, counts } = self;
        let counts = counts.map(|count| count.to_string()).join(" | ");
        line(out, format_args!("| {name} | {tries} | {counts} | {smallest_log10_p:.2} |"));
    }
}

fn play(number: u64, keys: usize) -> anyhow::Result<Played> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    rng.set_stream(number);
    let way = WAYS[number as usize % WAYS.len()];
    let public = public(&mut rng)?;
    let parameters = parameters(&public, &mut rng);
    let (original, suspect) = made_up(way, public, &parameters, &mut rng)?;
    let document = Document::parse(encode(Format::PlyBinaryLittleEndian, &original)?, None)?;
    let mut played = Played { way, log10_p: vec![0.0; keys], unanswered: Vec::new() };
    let original = match Original::new(document.soup(), &parameters.basis, parameters.epsilon) {
        Ok(original) => original,
        Err(error) => {
            played.unanswered.push(error.to_string());
            return Ok(played);
        }
    };
    let watermarks = watermarks(&document, &original, parameters, keys, &mut rng);
    let suspect = original.suspect(&suspect);
    for (registration, resampling) in SETTINGS {
        let price = price(&DetectOptions { registration, resampling, ..DetectOptions::default() });
        let options = SearchOptions { registration, resampling, ..SearchOptions::default() };
        match Fishing::all(&original, &suspect, &options, &watermarks) {
            Ok(log10_p) => played.improve(log10_p.into_iter().map(|p| p + price)),
            Err(error) => played.unanswered.push(reason(&error)),
        }
    }
    // The paper's method where vertices correspond, without registration: it explains nothing away.
    if let Some(found) = &suspect.correspondence {
        let points = &original.model().soup().points;
        let known = extract(original.basis(), original.epsilon(), points, found)?.coefficients;
        let test = |w: &Vec<f64>| Ok(watermark_test(w, &known, &WatermarkTestOptions::default())?.log10_p());
        let log10_p = watermarks.iter().map(test).collect::<anyhow::Result<Vec<f64>>>()?;
        let (registration, resampling) = (When::Never, When::Never);
        let options =
            DetectOptions { method: Method::Paper, registration, resampling, ..DetectOptions::default() };
        let price = price(&options);
        played.improve(log10_p.into_iter().map(|p| p + price));
    }
    Ok(played)
}

/// Numbers do not matter here.
fn reason(error: &anyhow::Error) -> String {
    error.to_string().chars().map(|c| if c.is_ascii_digit() { '0' } else { c }).collect()
}

impl Played {
    fn improve(&mut self, others: impl Iterator<Item = f64>) {
        self.log10_p.iter_mut().zip(others).for_each(|(p, other)| *p = p.min(other));
    }
}

/// A shape as it may be found on the net.
fn public(rng: &mut ChaCha8Rng) -> anyhow::Result<Soup> {
    let shape = match rng.random_range(0..7) {
        0 => shapes::bust(rng.random_range(5..9)),
        1 => shapes::part(rng.random_range(2..4)),
        2 => shapes::bumpy_sphere(rng.random_range(200..600)),
        3 => {
            shapes::torus(rng.random_range(12..24), rng.random_range(8..14), 2.0, rng.random_range(0.3..1.2))
        }
        4 => shapes::genus(rng.random_range(1..4), 2),
        5 => shapes::open_sheet(rng.random_range(10..20), rng.random_range(10..20)),
        // With all its poses.
        _ => return Ok(shapes::sphere(3)),
    };
    let (affine, bent) = (rng.random_range(0.0..0.5), rng.random_range(0.0..0.05));
    let specs = format!("affine:strength={affine} ffd:strength={bent} noise:amplitude=0.001");
    Ok(apply_all(&parse_list(&specs)?, &shape, rng)?.soup)
}

/// Anything that a key may have, as far as the shape carries it.
fn parameters(shape: &Soup, rng: &mut ChaCha8Rng) -> Parameters {
    let most = (shape.points.len() / 4).clamp(*COEFFICIENTS.start(), 80);
    let function = BasisFunction::PROFILES.choose(rng).copied().unwrap_or_default();
    let rules: Vec<Amplitudes> = Amplitudes::ALL.into_iter().filter(|rule| rule.suit(function)).collect();
    Parameters {
        preset: None,
        basis: BasisOptions {
            coefficients: rng.random_range(*COEFFICIENTS.start()..=most),
            function,
            amplitudes: rules.choose(rng).copied().unwrap_or_default(),
        },
        epsilon: 10f64.powf(rng.random_range(-5.0..-1.0)),
    }
}

/// An original that makes of `public` a suspect, and the suspect.
fn made_up(
    way: &str,
    public: Soup,
    parameters: &Parameters,
    rng: &mut ChaCha8Rng,
) -> anyhow::Result<(Soup, Soup)> {
    let specs = match way {
        "the suspect itself" => "none".to_owned(),
        "noise" => format!("noise:amplitude={}", 10f64.powf(rng.random_range(-7.0..-2.0))),
        "smoothing" => format!("smooth:iterations={}", rng.random_range(1..20)),
        "simplification" => format!("simplify:ratio={}", rng.random_range(0.5..0.95)),
        _ => return solved(way, public, parameters, rng),
    };
    let original = apply_all(&parse_list(&specs)?, &public, rng)?.soup;
    Ok((original, public))
}

/// original = suspect - B w0 with a w0 of his choice. B is that of the original, which is not known before: that of the
/// suspect, and then that of the first answer.
fn solved(
    way: &str,
    public: Soup,
    parameters: &Parameters,
    rng: &mut ChaCha8Rng,
) -> anyhow::Result<(Soup, Soup)> {
    let mut w0: Vec<f64> =
        StandardNormal.sample_iter(&mut *rng).take(parameters.basis.coefficients).collect();
    match way {
        "solved for a mark far too strong" => {
            // As far as the shape stays one: at the most a tenth of what ε can be.
            let factor = 10f64.powf(rng.random_range(0.0..1.0)) * (0.03 / parameters.epsilon).max(1.0);
            w0.iter_mut().for_each(|w| *w *= factor);
        }
        "solved for a few coefficients" => w0.iter_mut().skip(3).for_each(|w| *w = 0.0),
        "solved for coefficients that are nearly equal" => {
            let spread = 10f64.powf(rng.random_range(-15.0..-3.0));
            w0.iter_mut().for_each(|w| *w = 1.0 + spread * *w);
        }
        _ => {}
    }
    let mut original = public.clone();
    for _ in 0..2 {
        let model = Model::new(&original);
        let Ok(basis) = model.basis(&parameters.basis) else { break };
        let moved = basis.displacements(&w0, parameters.epsilon);
        let points: Vec<Point3<f64>> = public
            .points
            .iter()
            .zip(model.point_of_stored())
            .map(|(p, &at)| p - moved[at as usize])
            .collect();
        original = Soup::new(points, public.triangles.clone());
    }
    let suspect = match way {
        "solved, suspect cropped" => apply_all(&parse_list("crop:fraction=0.4")?, &public, rng)?.soup,
        _ => public,
    };
    Ok((original, suspect))
}

/// What the keys of so many secrets and texts say, for this original.
fn watermarks(
    document: &Document,
    original: &Original,
    parameters: Parameters,
    keys: usize,
    rng: &mut ChaCha8Rng,
) -> Vec<Vec<f64>> {
    let digest = OriginalDigest::of(document.parts());
    let stub = Derivation::stub_for_experiments();
    let key = |number: usize| {
        let identity = Identity { owner: format!("Mallory {number}"), recipient: String::new() };
        let secret = Secret(rng.random());
        Key::new(&digest, identity, secret, parameters, original.basis_digest(), stub).watermark
    };
    (0..keys).map(key).collect()
}

/// Shows every estimate of a search to many watermarks, each on its own.
#[derive(Clone)]
struct Fishing<'a> {
    watermarks: &'a [Vec<f64>],
    /// The smallest of each, not corrected.
    best: Vec<LogProbability>,
    seen: bool,
}

impl<'a> Fishing<'a> {
    /// log10 p of each watermark as `detect` would tell it, had it been asked for this one.
    fn all(
        original: &Original,
        suspect: &Suspect,
        options: &SearchOptions,
        watermarks: &'a [Vec<f64>],
    ) -> anyhow::Result<Vec<f64>> {
        let best = vec![LogProbability::ONE; watermarks.len()];
        let outcome = search(original, suspect, options, Self { watermarks, best, seen: false })?;
        let of_look = |look: &Looked<Self>, at: usize| best_of(look.examiner.best[at], look.counted).log10();
        let all = 0..watermarks.len();
        Ok(all.map(|at| outcome.looks.iter().map(|look| of_look(look, at)).fold(0.0, f64::min)).collect())
    }
}

impl Examiner for Fishing<'_> {
    type Error = anyhow::Error;
    const TESTS: usize = KeyTests::COUNT;

    fn examine(
        &mut self,
        _hypothesis: &Hypothesis,
        estimate: &Estimate,
        _seconds: &mut Stages,
    ) -> anyhow::Result<()> {
        self.seen = true;
        let tests = KeyTests::new(&estimate.coefficients, estimate.known(), &estimate.precision)
            .context("a test cannot be made")?;
        for (best, w) in self.best.iter_mut().zip(self.watermarks) {
            let p = tests.compare(w)?.best();
            if p < *best {
                *best = p;
            }
        }
        Ok(())
    }

    /// Of the watermark that suits best.
    fn weigh(&self, functions: &[usize], estimate: &Estimate) -> anyhow::Result<LogProbability> {
        let tests = KeyTests::new(&estimate.coefficients, estimate.known(), &estimate.precision)
            .context("a test cannot be made")?;
        let own = |w: &Vec<f64>| functions.iter().map(|&i| w[i]).collect::<Vec<f64>>();
        let all = self.watermarks.iter().map(|w| Ok(tests.compare(&own(w))?.best()));
        let all = all.collect::<anyhow::Result<Vec<_>>>()?;
        Ok(all.into_iter().fold(LogProbability::ONE, |least, p| if p < least { p } else { least }))
    }

    /// So that no way is left out because one is certain.
    fn best(&self) -> Option<LogProbability> {
        self.seen.then_some(LogProbability::ONE)
    }
}

/// One key held against many suspects: a derivation is then many tries.
#[derive(Serialize)]
pub(super) struct Choice {
    keys: usize,
    suspects: u64,
    /// Of the keys, the best of all suspects.
    by_key: Vec<Rate>,
    /// Of all pairs.
    by_pair: Vec<Rate>,
    smallest_log10_p: f64,
}

impl Choice {
    pub(super) fn run(suspects: u64, keys: usize) -> anyhow::Result<Self> {
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let shape = shapes::bust(6);
        let basis = BasisOptions { coefficients: *COEFFICIENTS.start(), ..BasisOptions::default() };
        let parameters = Parameters { preset: None, basis, epsilon: 0.01 };
        let document = Document::parse(encode(Format::PlyBinaryLittleEndian, &shape)?, None)?;
        let original = Original::new(document.soup(), &basis, parameters.epsilon)?;
        let watermarks = watermarks(&document, &original, parameters, keys, &mut rng);
        let look = |number: u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(SEED);
            rng.set_stream(number + 1);
            let attacks = parse_list("ffd:strength=0.005 noise:amplitude=0.002")?;
            let suspect = original.suspect(&apply_all(&attacks, &shape, &mut rng)?.soup);
            Fishing::all(&original, &suspect, &SearchOptions::default(), &watermarks)
        };
        let looked: Vec<Vec<f64>> = (0..suspects).into_par_iter().map(look).collect::<anyhow::Result<_>>()?;
        let (mut pairs, mut best) = (Way::default(), vec![0.0_f64; keys]);
        for log10_p in &looked {
            pairs.add(log10_p);
            best.iter_mut().zip(log10_p).for_each(|(best, p)| *best = best.min(*p));
        }
        let mut by_key = Way::default();
        by_key.add(&best);
        Ok(Self {
            keys,
            suspects,
            by_key: Rate::all(&by_key.counts, by_key.tries),
            by_pair: Rate::all(&pairs.counts, pairs.tries),
            smallest_log10_p: pairs.smallest_log10_p,
        })
    }

    pub(super) fn write(&self, out: &mut String) {
        let Self { keys, suspects, by_key, by_pair, smallest_log10_p } = self;
        line(out, format_args!("## One key and many suspects\n"));
        line(
            out,
            format_args!(
                "A derivation is one try against one suspect. Held against every one of {suspects} unmarked suspects, {keys} keys are \
                 {} tries, at the cost of {keys} derivations: the rates hold for pairs, and for keys they do not. Smallest log10 p {smallest_log10_p:.2}.\n",
                *keys as u64 * suspects
            ),
        );
        line(out, format_args!("| log10 p | of the keys | 10^-k of them | of the pairs | 10^-k of them |"));
        line(out, format_args!("|---|---|---|---|---|"));
        for (key, pair) in by_key.iter().zip(by_pair) {
            let Rate { k, expected, count, .. } = key;
            line(out, format_args!("| -{k} | {count} | {expected} | {} | {} |", pair.count, pair.expected));
        }
    }
}
