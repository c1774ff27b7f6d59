//! Looks at mirror images, kits, point clouds and warps: what the search itself shows of suspects without a mark.
//!
//! For the rates of random watermarks every estimate that the search shows of a suspect is kept, as it was shown. Where a
//! component has several places, which is taken depends on the watermark; the kits here have parts that nothing but their own
//! place fits, so their estimates are those of any watermark. The whole detection sees kits with parts that fit in several
//! places too.

use super::key_tests::{Extracted, key_tests};
use super::pipeline::{attacked, case, document};
use super::{Rate, bar, rng};
use crate::experiments::case::{Case, random_secret};
use crate::experiments::removal::warped;
use crate::experiments::tables::Method;
use nalgebra::{Point3, Rotation3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::mesh::Soup;
use sombrero::search::{
    Estimate, Examiner, Hypothesis, Look, Original, SearchError, SearchOptions, Stages, Suspect, search,
};
use sombrero::stats::{KeyTests, LogProbability};
use sombrero::watermark::Preset;
use sombrero::{DetectOptions, shapes};
use sombrero_tests::joined;

/// Estimates of a suspect that keys are held against.
const ESTIMATES: usize = 2;
/// Streams of random numbers, beside those of the other kinds.
const STREAM: u64 = 100;

/// A kind of suspect by its name.
pub(super) struct Kind {
    pub(super) name: &'static str,
    /// Each makes one suspect of an original.
    attacks: &'static [&'static str],
    /// The look that its estimates are taken from; without one those of every look are.
    look: Option<Look>,
    make: Make,
}

/// What is done to a suspect beside its attacks.
#[derive(Clone, Copy, PartialEq)]
enum Make {
    Attacked,
    /// A kit whose parts are laid elsewhere afterwards.
    Rearranged,
    /// Bent beforehand by waves of [`WAVE`] sides that move vertices by [`BENT`] sides.
    Warped,
}

/// The wave of the cheapest removal, and some four times what a mark of the preset robust moves vertices by.
const WAVE: f64 = 0.3;
const BENT: f64 = 0.0025;

pub(super) const KINDS: [Kind; 4] = [
    Kind {
        name: "mirror images",
        attacks: &["mirror transform", "simplify:ratio=0.5 mirror transform"],
        look: None,
        make: Make::Attacked,
    },
    Kind {
        name: "point clouds",
        attacks: &["transform points:count=20000", "noise:amplitude=0.002 transform points:count=20000"],
        look: Some(Look::Whole),
        make: Make::Attacked,
    },
    Kind {
        name: "kits, laid elsewhere",
        attacks: &["none", "noise:amplitude=0.002"],
        look: Some(Look::Parts),
        make: Make::Rearranged,
    },
    Kind {
        name: "warps, half of the faces",
        attacks: &["simplify:ratio=0.5 transform", "simplify:ratio=0.5 noise:amplitude=0.001"],
        look: Some(Look::Warped),
        make: Make::Warped,
    },
];

/// Keeps what it is shown, and weighs places by a watermark of its own.
#[derive(Clone)]
struct Recorder {
    watermark: Vec<f64>,
    kept: Vec<(&'static str, Estimate)>,
}

impl Examiner for Recorder {
    type Error = SearchError;
    const TESTS: usize = KeyTests::COUNT;

    fn examine(
        &mut self,
        hypothesis: &Hypothesis,
        estimate: &Estimate,
        _: &mut Stages,
    ) -> Result<(), SearchError> {
        self.kept.push((hypothesis.nuisance, estimate.clone()));
        Ok(())
    }

    fn weigh(&self, functions: &[usize], estimate: &Estimate) -> Result<LogProbability, SearchError> {
        let own: Vec<f64> = functions.iter().map(|&i| self.watermark[i]).collect();
        let tests = KeyTests::new(&estimate.coefficients, estimate.known(), &estimate.precision);
        let Ok(tests) = tests else { return Ok(LogProbability::ONE) };
        Ok(tests.compare(&own).map_or(LogProbability::ONE, |compared| compared.best()))
    }

    fn best(&self) -> Option<LogProbability> {
        self.kept.last().map(|_| LogProbability::ONE)
    }
}

/// What the search shows of suspects of this kind.
pub(super) fn suspects(
    which: usize,
    preset: Preset,
    cases: &[(&str, Case)],
) -> anyhow::Result<Vec<Extracted>> {
    let kind = &KINDS[which];
    let kit;
    let cases: Vec<(&str, &Case)> = if kind.make == Make::Rearranged {
        kit = case(&kit_of(&[0, 1, 2, 3, 4, 5]), preset)?;
        vec![("kit", &kit)]
    } else {
        cases.iter().map(|(name, case)| (*name, case)).collect()
    };
    let mut rng = rng(STREAM + which as u64, 0);
    let mut suspects = Vec::new();
    for (model, case) in cases {
        let (basis, epsilon) = (case.parameters.basis, case.parameters.epsilon);
        let original = Original::of_scene(case.document.soup(), &case.document.scene(), &basis, epsilon)?;
        for specs in kind.attacks {
            let made = kind.make.suspect(case, specs, &mut rng)?;
            let watermark = case.detector(random_secret(&mut rng))?.key().watermark.clone();
            let recorder = Recorder { watermark, kept: Vec::new() };
            let suspect = original.suspect(&made);
            // A kit whose triangles are those of the original corresponds to it as a whole, which is not what is asked.
            let suspect = Suspect { correspondence: None, ..suspect };
            let outcome = search(&original, &suspect, &SearchOptions::default(), recorder)?;
            let looks =
                outcome.looks.into_iter().filter(|look| kind.look.is_none_or(|kept| look.look == kept));
            for (nuisance, estimate) in looks.flat_map(|look| look.examiner.kept).take(ESTIMATES) {
                suspects
                    .extend(key_tests(&format!("{}: {model} {specs}, {nuisance}", kind.name), &estimate)?);
            }
        }
    }
    Ok(suspects)
}

impl Make {
    fn suspect(self, case: &Case, specs: &str, rng: &mut ChaCha8Rng) -> anyhow::Result<Soup> {
        let bent = (self == Self::Warped).then(|| warped(case.soup(), WAVE, BENT, rng));
        let made = apply_all(&parse_list(specs)?, bent.as_ref().unwrap_or(case.soup()), rng)?.soup;
        Ok(if self == Self::Rearranged { rearranged(&made, rng) } else { made })
    }
}

/// Bumpy balls beside each other; equal numbers are equal parts.
fn kit_of(parts: &[usize]) -> Soup {
    let laid = |(at, &part): (usize, &usize)| {
        let ball = shapes::bumpy_sphere(300 + 20 * part);
        let stretch = Vector3::new(1.0 + 0.07 * part as f64, 1.0, 1.0 - 0.04 * part as f64);
        let shift = Vector3::new(3.0 * at as f64, 0.0, 0.0);
        let place = |p: &Point3<f64>| Point3::from(p.coords.component_mul(&stretch) + shift);
        Soup::new(ball.points.iter().map(place).collect(), ball.triangles)
    };
    parts.iter().enumerate().map(laid).fold(Soup::default(), |kit, part| joined(&kit, &part))
}

/// Each component turned and laid elsewhere by itself.
fn rearranged(soup: &Soup, rng: &mut ChaCha8Rng) -> Soup {
    let links = soup.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c]]);
    let first = sombrero::mesh::connected(soup.points.len(), links);
    let mut moves = std::collections::BTreeMap::new();
    let points = soup.points.iter().zip(&first).map(|(p, part)| {
        let (turn, shift) = moves.entry(*part).or_insert_with(|| {
            let axis = Vector3::from_fn(|_, _| rng.random_range(-3.0..3.0));
            (Rotation3::new(axis), Vector3::from_fn(|_, _| rng.random_range(-9.0..9.0)))
        });
        *turn * p + *shift
    });
    Soup::new(points.collect(), soup.triangles.clone())
}

/// What the whole detection made of suspects without a mark that ask for other looks.
#[derive(Serialize)]
pub(super) struct Innocent {
    suspects: u64,
    what: &'static str,
    /// The corrected p.
    rates: Vec<Rate>,
}

impl Innocent {
    /// As many mirror images, point clouds, prints and warps, and half as many kits.
    pub(super) fn run(method: Method, suspects: u64) -> anyhow::Result<Vec<Self>> {
        let balls = [shapes::bumpy_sphere(600), shapes::bust(8), shapes::part(1)];
        let balls = balls.iter().map(|soup| case(soup, method.preset())).collect::<Result<Vec<_>, _>>()?;
        let kits = [kit_of(&[0, 1, 2]), kit_of(&[0, 0, 1, 2]), kit_of(&[3, 3])];
        let kits = kits.iter().map(|soup| case(soup, method.preset())).collect::<Result<Vec<_>, _>>()?;
        let image = |case: &Case, rng: &mut ChaCha8Rng, i: u64| -> anyhow::Result<Soup> {
            let soup = attacked(case.soup(), rng);
            let specs = ["mirror transform", "points:count=3000", "print:size=100", "simplify:ratio=0.5"];
            let bent = (i % 4 == 3).then(|| warped(&soup, WAVE, BENT, rng));
            let specs = parse_list(specs[i as usize % specs.len()])?;
            Ok(apply_all(&specs, bent.as_ref().unwrap_or(&soup), rng)?.soup)
        };
        let kit = |case: &Case, rng: &mut ChaCha8Rng, i: u64| -> anyhow::Result<Soup> {
            let soup = rearranged(case.soup(), rng);
            let specs = ["none", "noise:amplitude=0.002", "simplify:ratio=0.5", "mirror"][i as usize % 4];
            Ok(apply_all(&parse_list(specs)?, &soup, rng)?.soup)
        };
        Ok(vec![
            Self::of(
                "mirror images, point clouds, simulated prints, warps",
                method,
                &balls,
                suspects,
                image,
            )?,
            Self::of("kits, laid elsewhere", method, &kits, suspects / 2, kit)?,
        ])
    }

    fn of(
        what: &'static str,
        method: Method,
        cases: &[Case],
        suspects: u64,
        make: impl Fn(&Case, &mut ChaCha8Rng, u64) -> anyhow::Result<Soup> + Sync,
    ) -> anyhow::Result<Self> {
        let bar = bar(suspects, what)?;
        let one = |i: u64| -> anyhow::Result<f64> {
            let case = &cases[i as usize / 4 % cases.len()];
            let mut rng = rng(STREAM + 10 + what.len() as u64, i);
            let detector = case.detector(random_secret(&mut rng))?;
            let made = make(case, &mut rng, i);
            let options = DetectOptions { method: method.into(), ..DetectOptions::default() };
            let p = made.ok().and_then(|soup| document(&soup).ok()).and_then(|file| {
                detector.detect(&detector.suspect(&file), &options).ok().map(|detection| detection.log10_p)
            });
            bar.inc(1);
            Ok(p.unwrap_or(0.0))
        };
        let p = (0..suspects).into_par_iter().map(one).collect::<anyhow::Result<Vec<f64>>>()?;
        bar.finish_and_clear();
        let rates = Rate::all(&[0.1, 0.01, 0.001], &p, p.len())?;
        let innocent = Self { suspects, what, rates };
        println!("the whole detection, {suspects} {what}");
        innocent.rates.iter().for_each(Rate::print);
        Ok(innocent)
    }
}
