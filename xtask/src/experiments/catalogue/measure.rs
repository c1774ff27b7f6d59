//! A catalogue is built, suspects are made, and it is asked.

use super::families::{is_kit, original};
use super::jitter::shaken;
use super::nearer::{Shown, distances};
use super::queries::{Class, Suspect};
use anyhow::Context;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::io::Document;
use sombrero::mesh::Soup;
use sombrero_catalogue::{Catalogue, Editor, Entry, Portrait, Question, SearchOptions};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// An original: a generated one by its number, or one from a folder.
pub(crate) struct Original {
    pub(crate) name: String,
    soup: Source,
}

enum Source {
    Generated(u64),
    Real(PathBuf),
}

impl Original {
    pub(crate) fn generated(index: u64) -> Self {
        Self { name: format!("generated {index:06}"), soup: Source::Generated(index) }
    }

    pub(crate) fn real(name: String, path: PathBuf) -> Self {
        Self { name, soup: Source::Real(path) }
    }

    pub(crate) fn soup(&self) -> Soup {
        match &self.soup {
            Source::Generated(index) => original(*index),
            // It could be read when the folder was looked through.
            Source::Real(path) => Document::read(path).map(|file| file.soup().clone()).unwrap_or_default(),
        }
    }

    /// Whether a suspect of the class can be made of it.
    pub(crate) fn suits(&self, class: Class) -> bool {
        let kit = matches!(self.soup, Source::Generated(index) if is_kit(index));
        kit == (class == Class::HalfKit)
    }
}

/// Adds all originals, each `jitter` times more with its landmarks shaken; seconds.
pub(crate) fn build(folder: &Path, originals: &[Original], jitter: u64) -> anyhow::Result<f64> {
    let start = Instant::now();
    let mut editor = Editor::create(folder)?;
    for chunk in originals.chunks(128) {
        let described = chunk.par_iter().map(|original| {
            let soup = original.soup();
            let portrait = Portrait::of(&soup.points, &soup.triangles).context(original.name.clone())?;
            Ok((original.name.clone(), portrait))
        });
        let described: Vec<(String, Portrait)> = described.collect::<anyhow::Result<_>>()?;
        for copy in 1..=jitter {
            let shaken = described.iter().zip(0..).map(|((name, portrait), k)| {
                (entry(format!("{name}, shaken {copy}")), shaken(portrait, copy << 32 | k))
            });
            editor.add(shaken.collect())?;
        }
        editor.add(described.into_iter().map(|(name, portrait)| (entry(name), portrait)).collect())?;
    }
    Ok(start.elapsed().as_secs_f64())
}

fn entry(name: String) -> Entry {
    Entry { name, digest: [0; 32], place: String::new(), note: String::new() }
}

/// One question and its answer.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Asked {
    pub(crate) class: &'static str,
    pub(crate) original: String,
    /// The right one's place among all candidates, from 0.
    pub(crate) rank: Option<usize>,
    /// Who came first.
    pub(crate) first: String,
    /// Scores of the first and of the right one.
    pub(crate) scores: [f64; 2],
    /// How far the attack moved the surface: root mean square, relative to the root of the suspect's area.
    pub(crate) attack: f64,
    /// How far those that came before the right one lie from it, likewise.
    pub(crate) before: Vec<f64>,
    /// Of what is not among the best ten: its places after votes, pairs and surfaces.
    pub(crate) fate: Option<[Option<usize>; 3]>,
    pub(crate) describe_seconds: f64,
    pub(crate) search_seconds: f64,
}

impl Asked {
    /// Whether the right one is among the first `count`.
    pub(crate) fn is_within(&self, count: usize) -> bool {
        self.rank.is_some_and(|rank| rank < count)
    }

    /// Whether it is, those left out that are no farther from it than the attack.
    pub(crate) fn is_within_others(&self, count: usize) -> bool {
        let farther = self.before.iter().filter(|distance| **distance > self.attack.max(SAME)).count();
        self.rank.is_some() && farther < count
    }
}

/// Models no farther from each other than this, relative to their size, are the same to a catalogue.
const SAME: f64 = 1e-3;

/// Asks `count` questions of each class, each about another original as far as there are enough, spread over all.
pub(crate) fn ask(
    catalogue: &Catalogue,
    originals: &[Original],
    count: usize,
    classes: &[Class],
) -> Vec<Asked> {
    let known: BTreeMap<&str, &Original> = originals.iter().map(|o| (o.name.as_str(), o)).collect();
    let model = |name: &str| known.get(name).map(|original| original.soup());
    let questions: Vec<_> = classes.iter().flat_map(|class| chosen(originals, *class, count)).collect();
    let ask = |(class, original, seed): &(Class, &Original, u64)| {
        let suspect = class.suspect(&original.soup(), *seed).ok()?;
        one(catalogue, *class, original, &suspect, model).ok()
    };
    questions.par_iter().filter_map(ask).collect()
}

/// What is asked in a class: originals, each with a seed.
fn chosen(originals: &[Original], class: Class, count: usize) -> Vec<(Class, &Original, u64)> {
    let fit: Vec<&Original> = originals.iter().filter(|original| original.suits(class)).collect();
    let count = count.min(fit.len());
    // A class begins where the one before it would go on, and the 7 is prime to ten, so that all members of families are reached.
    let (first, classes) = (class as usize, Class::ALL.len());
    let place = |k: usize| ((k * classes + first) * fit.len() / (count * classes) + 7 * k) % fit.len();
    (0..count).map(|k| (class, fit[place(k)], (k * classes + first) as u64)).collect()
}

fn one(
    catalogue: &Catalogue,
    class: Class,
    original: &Original,
    suspect: &Suspect,
    model: impl Fn(&str) -> Option<Soup>,
) -> anyhow::Result<Asked> {
    let start = Instant::now();
    let question = Question::of(&suspect.soup.points, &suspect.soup.triangles)?;
    let describe_seconds = start.elapsed().as_secs_f64();
    let found = catalogue.search(&question, &SearchOptions::default().top(usize::MAX))?;
    let search_seconds = start.elapsed().as_secs_f64() - describe_seconds;
    let rank = found.iter().position(|candidate| candidate.entry.name == original.name);
    let score = |k: usize| found.get(k).map_or(0.0, |candidate| candidate.score);
    let shown = Shown::of(original, suspect);
    let before = distances(&shown, suspect, &question, &found[..rank.unwrap_or(0)], model);
    let mut asked = Asked {
        class: class.name(),
        original: original.name.clone(),
        rank,
        first: found.first().map(|candidate| candidate.entry.name.clone()).unwrap_or_default(),
        scores: [score(0), rank.map_or(0.0, score)],
        attack: shown.attack,
        before,
        fate: None,
        describe_seconds,
        search_seconds,
    };
    if !asked.is_within(10) {
        let fate = catalogue.fate(&question, &original.name)?;
        asked.fate = Some([fate.votes, fate.pairs, fate.surfaces]);
    }
    Ok(asked)
}
