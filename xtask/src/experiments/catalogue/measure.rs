//! A catalogue is built, suspects are made, and it is asked.

use super::families::{is_kit, original};
use super::jitter::shaken;
use super::queries::{Class, named};
use anyhow::Context;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::mesh::Soup;
use sombrero_catalogue::{Catalogue, Editor, Entry, Portrait, Question, SearchOptions};
use std::path::Path;
use std::time::Instant;

/// An original: a generated one by its number, or one from a folder.
pub(crate) struct Original {
    pub(crate) name: String,
    soup: Source,
}

enum Source {
    Generated(u64),
    Real(Soup),
}

impl Original {
    pub(crate) fn generated(index: u64) -> Self {
        Self { name: format!("generated {index:06}"), soup: Source::Generated(index) }
    }

    pub(crate) fn real(name: String, soup: Soup) -> Self {
        Self { name, soup: Source::Real(soup) }
    }

    pub(crate) fn soup(&self) -> Soup {
        match &self.soup {
            Source::Generated(index) => original(*index),
            Source::Real(soup) => soup.clone(),
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
    /// The right one's place among the candidates, from 0.
    pub(crate) rank: Option<usize>,
    /// Who came first.
    pub(crate) first: String,
    /// Scores of the first and of the right one.
    pub(crate) scores: [f64; 2],
    pub(crate) describe_seconds: f64,
    pub(crate) search_seconds: f64,
}

/// Asks `count` questions of each class, about originals spread over all.
pub(crate) fn ask(
    catalogue: &Catalogue,
    originals: &[Original],
    count: usize,
    classes: &[Class],
) -> Vec<Asked> {
    let mut questions = Vec::new();
    for &class in classes {
        let fit: Vec<&Original> = originals.iter().filter(|original| original.suits(class)).collect();
        let count = count.min(fit.len());
        // A stride that is prime to ten reaches all members of families.
        questions
            .extend((0..count).map(|k| (class, fit[(k * fit.len() / count + 7 * k) % fit.len()], k as u64)));
    }
    let ask = |(class, original, seed): &(Class, &Original, u64)| {
        let suspect = named(*class, &original.soup(), *seed).ok()?;
        one(catalogue, *class, original, &suspect).ok()
    };
    questions.par_iter().filter_map(ask).collect()
}

fn one(catalogue: &Catalogue, class: Class, original: &Original, suspect: &Soup) -> anyhow::Result<Asked> {
    let start = Instant::now();
    let question = Question::of(&suspect.points, &suspect.triangles)?;
    let describe_seconds = start.elapsed().as_secs_f64();
    let found = catalogue.search(&question, &SearchOptions::default())?;
    let rank = found.iter().position(|candidate| candidate.entry.name == original.name);
    let score = |k: usize| found.get(k).map_or(0.0, |candidate| candidate.score);
    Ok(Asked {
        class: class.name(),
        original: original.name.clone(),
        rank,
        first: found.first().map(|candidate| candidate.entry.name.clone()).unwrap_or_default(),
        scores: [score(0), rank.map_or(0.0, score)],
        describe_seconds,
        search_seconds: start.elapsed().as_secs_f64() - describe_seconds,
    })
}
