//! Grinding: secret after secret against one unmarked suspect, of which w* is known beforehand.

use super::{Rate, SEED, line};
use anyhow::Context;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::basis::{Basis, BasisOptions};
use sombrero::extraction::{Deformation, Extractor, Nuisance};
use sombrero::search::Model;
use sombrero::shapes;
use sombrero::stats::{
    Ellipsoid, KeyTests, LogProbability, STATISTICS, WatermarkTestOptions, watermark_test,
};
use sombrero::watermark::{Derivation, Identity, Key, OriginalDigest, Parameters, Secret};

/// As few as a key can have.
const COEFFICIENTS: usize = 16;
/// Rates from 10^-1 down to 10^-LAST.
const LAST: usize = 7;
const CHUNK: u64 = 10_000;

#[derive(Serialize)]
pub(super) struct Grinding {
    tries: u64,
    coefficients: usize,
    pub(super) tests: Vec<Ground>,
}

/// What one test gave.
#[derive(Serialize)]
pub(super) struct Ground {
    test: &'static str,
    smallest_log10_p: f64,
    pub(super) rates: Vec<Rate>,
}

/// A suspect that is ready for very many watermarks.
struct Suspect {
    known: Vec<Option<f64>>,
    /// Each with the distances that belong to the rates, alone and as one of [`KeyTests::COUNT`] tests.
    ellipsoids: Vec<(Ellipsoid, [f64; LAST], [f64; LAST])>,
    tests: KeyTests,
}

/// For the correlation, the ellipsoid without a floor, and the best of all tests: the smallest log10 p, and how many
/// reached each rate.
type Tally = [(f64, [u64; LAST]); 3];

impl Grinding {
    pub(super) fn run(tries: u64) -> anyhow::Result<Self> {
        let original = shapes::bust(8);
        let model = Model::new(&original);
        let options = BasisOptions { coefficients: COEFFICIENTS, ..BasisOptions::default() };
        let parameters = Parameters { preset: None, basis: options, epsilon: 0.01 };
        let basis = model.basis(&options)?;
        let suspect = Suspect::new(&model, &basis, parameters.epsilon)?;
        let digest = OriginalDigest::of_file(b"an original made up");
        let basis_digest = basis.digest();
        let stub = Derivation::stub_for_experiments();
        let watermark = |number: u64| {
            let mut secret = Secret([0; 32]);
            secret.0[..8].copy_from_slice(&number.to_le_bytes());
            Key::new(&digest, Identity::default(), secret, parameters, &basis_digest, stub).watermark
        };
        let none = [(0.0, [0; LAST]); 3];
        let chunk = |chunk: u64| {
            let mut tally = none;
            for number in chunk * CHUNK..((chunk + 1) * CHUNK).min(tries) {
                suspect.compare(&watermark(number), &mut tally)?;
            }
            Ok::<_, anyhow::Error>(tally)
        };
        let add = |a: Tally, b: Tally| {
            Ok(std::array::from_fn(|test| {
                let counts = std::array::from_fn(|k| a[test].1[k] + b[test].1[k]);
                (a[test].0.min(b[test].0), counts)
            }))
        };
        let tally = (0..tries.div_ceil(CHUNK)).into_par_iter().map(chunk).try_reduce(|| none, add)?;
        let names = ["correlation", "ellipsoid, no floor", "best of the five, times five"];
        let ground = |(test, (smallest_log10_p, counts)): (&'static str, (f64, [u64; LAST]))| Ground {
            test,
            smallest_log10_p,
            rates: Rate::all(&counts, tries),
        };
        let tests = names.into_iter().zip(tally).map(ground).collect();
        Ok(Self { tries, coefficients: COEFFICIENTS, tests })
    }

    pub(super) fn write(&self, out: &mut String) {
        let Self { tries, coefficients, tests } = self;
        line(out, format_args!("## What tries bring\n"));
        line(
            out,
            format_args!(
                "{tries} secrets, derivation stubbed, against w* of one unmarked suspect with {coefficients} coefficients: how \
                 many reach each p, beside tries · p. The ellipsoid's p is a bound.\n"
            ),
        );
        let names: Vec<&str> = tests.iter().map(|test| test.test).collect();
        line(out, format_args!("| log10 p | theory | {} |", names.join(" | ")));
        line(out, format_args!("|---|---|{}", "---|".repeat(names.len())));
        for k in 0..LAST {
            let counts: Vec<String> = tests.iter().map(|test| test.rates[k].count.to_string()).collect();
            let expected = tests.first().map_or(0.0, |test| test.rates[k].expected);
            line(out, format_args!("| -{} | {expected} | {} |", k + 1, counts.join(" | ")));
        }
        let smallest: Vec<String> =
            tests.iter().map(|test| format!("{:.2}", test.smallest_log10_p)).collect();
        let expected = -(*tries as f64).log10();
        line(out, format_args!("| smallest | {expected:.1} | {} |\n", smallest.join(" | ")));
    }
}

impl Suspect {
    /// The model with noise and without a mark, whose vertices correspond.
    fn new(model: &Model, basis: &Basis, epsilon: f64) -> anyhow::Result<Self> {
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let noisy = apply_all(&parse_list("noise:amplitude=0.002")?, model.soup(), &mut rng)?;
        let found: Vec<_> = noisy.soup.points.iter().copied().map(Some).collect();
        let extractor = Extractor::new(basis, epsilon, model.soup())?;
        let nuisance = Nuisance { deformation: Deformation::Similarity, modes: &[] };
        let estimate = extractor.estimate_from_vertices(&found, nuisance)?;
        let known = estimate.known();
        let tests = KeyTests::new(&estimate.coefficients, known.clone(), &estimate.precision)?;
        let plain = Ellipsoid::new(&estimate.coefficients, &estimate.precision)?;
        let prepared = |floor: f64| {
            let ellipsoid = plain.with_floor(floor)?;
            let among = (KeyTests::COUNT as f64).log10();
            let at = |k: usize, among: f64| {
                ellipsoid.distance_at(LogProbability::from_log10(-(k as f64) - 1.0 - among))
            };
            let (alone, chosen) =
                (std::array::from_fn(|k| at(k, 0.0)), std::array::from_fn(|k| at(k, among)));
            Ok::<_, anyhow::Error>((ellipsoid, alone, chosen))
        };
        let floors = STATISTICS.iter().filter_map(|test| test.floor);
        let ellipsoids = floors.map(prepared).collect::<Result<_, _>>()?;
        Ok(Self { known, ellipsoids, tests })
    }

    fn compare(&self, w: &[f64], tally: &mut Tally) -> anyhow::Result<()> {
        let among = (KeyTests::COUNT as f64).log10();
        let reached = |log10_p: f64| (1..=LAST).take_while(|&k| log10_p <= -(k as f64)).count();
        let correlation = watermark_test(w, &self.known, &WatermarkTestOptions::default())?.log10_p();
        let mut best = reached(correlation + among);
        let mut plain = 0;
        for (number, (ellipsoid, alone, chosen)) in self.ellipsoids.iter().enumerate() {
            let distance = ellipsoid.distance(w)?;
            let within = |limits: &[f64; LAST]| limits.iter().take_while(|limit| distance <= **limit).count();
            best = best.max(within(chosen));
            if number == 0 {
                plain = within(alone);
            }
        }
        // The bounds themselves take longer, and only few matter.
        let (mut smallest_plain, mut smallest_best) = (0.0, 0.0);
        if plain.max(best) >= 3 {
            let tests = self.tests.compare(w)?.tests;
            let smallest = tests.iter().map(|test| test.p.log10()).fold(0.0, f64::min);
            smallest_best = (smallest + among).min(0.0);
            smallest_plain = tests.get(1).context("an ellipsoid")?.p.log10();
        }
        let seen = [(correlation, reached(correlation)), (smallest_plain, plain), (smallest_best, best)];
        for ((smallest, counts), (log10_p, reached)) in tally.iter_mut().zip(seen) {
            *smallest = smallest.min(log10_p);
            counts.iter_mut().take(reached).for_each(|count| *count += 1);
        }
        Ok(())
    }
}
