//! The first round: which pieces of a catalogue have landmarks that look like those of the suspect, at one ratio of sizes.
//!
//! Each landmark of the suspect, at each rung of the ladder, looks into the nearest cells; what it finds there is weighed by how unusual
//! it looks and by how many bits of the signatures agree. With v(i, j) what landmark i of the suspect and landmark j of a piece
//! find in each other, a piece with n landmarks has
//!
//! ```text
//! votes = Σ_i max_j v(i, j) · Σ_j max_i v(i, j) / n,
//! ```
//!
//! so that both must be like the other: one landmark of a piece that looks like a whole plain suspect is worth little, and so is
//! a plain piece that looks like one landmark. Whatever was made from a model has its landmarks at one ratio of sizes, so votes of neighbouring rungs
//! are added up and the best count (weak geometric consistency: Jégou, Douze and Schmid 2008).

use std::cmp::Reverse;

use rayon::prelude::*;

use crate::describe::Described;
use crate::features::{cells_near, signature, telling};
use crate::lists::{Lists, PieceOf, Postings};
use crate::question::MORE;

/// Cells that a landmark looks into at each rung.
const PROBES: usize = 16;
const RUNGS: usize = 2 * MORE + 1;

/// A piece of a segment and its votes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Voted {
    /// Larger is better.
    pub(crate) votes: Reverse<u64>,
    /// Orders pieces with equal votes in a way that does not depend on where they lie.
    pub(crate) hash: u64,
    pub(crate) number: u16,
    /// Index among the segment's pieces.
    pub(crate) piece: u32,
    /// The rung with most votes.
    pub(crate) rung: usize,
}

/// What one landmark of the suspect looks for in one cell.
#[derive(Clone, Copy)]
struct Probe {
    landmark: u16,
    rung: u16,
    cell: u16,
    signature: u16,
    /// What a vote is multiplied with.
    weight: u16,
}

impl Probe {
    /// What it finds in a landmark of the cell with the signature `other`: 16, 14, 12, 9, 6, 4, 2, 1 and then nothing, by how
    /// many bits differ. Written as a sum of ramps, so that many are told at once.
    fn vote(&self, other: u16) -> u16 {
        let differing = (self.signature ^ other).count_ones() as u16;
        let below = |end: u16| end.saturating_sub(differing);
        (below(8) + below(6) + below(4) - below(2)) * self.weight
    }
}

/// What the pieces of a suspect ask of every segment.
pub(crate) struct Ballots {
    /// All cells that are probed, each once, ascending.
    cells: Vec<u16>,
    ballots: Vec<Ballot>,
}

impl Ballots {
    pub(crate) fn new<'a>(asked: impl IntoParallelIterator<Item = &'a Described>) -> Self {
        let ballots: Vec<Ballot> = asked.into_par_iter().map(Ballot::new).collect();
        let mut cells: Vec<u16> =
            ballots.iter().flat_map(|ballot| &ballot.by_cell).map(|probe| probe.cell).collect();
        cells.sort_unstable();
        cells.dedup();
        Self { cells, ballots }
    }

    /// For each piece of the suspect the `most` pieces with most votes, best first; `alive` says which entries count. Lists are
    /// read once for all.
    pub(crate) fn count(
        &self,
        lists: &Lists,
        alive: impl Fn(u32) -> bool + Sync,
        most: usize,
    ) -> std::io::Result<Vec<Vec<Voted>>> {
        let postings = lists.postings(&self.cells)?;
        let pieces = lists.head.pieces.len();
        let count = |ballot: &Ballot| {
            let sums =
                [ballot.found_by_suspect(&postings, pieces), ballot.found_by_pieces(&postings, pieces)];
            ranked(lists, &sums, &alive, most)
        };
        Ok(self.ballots.par_iter().map(count).collect())
    }
}

/// What one piece asks.
struct Ballot {
    /// By rung and landmark.
    by_landmark: Vec<Probe>,
    /// The same by cell and rung.
    by_cell: Vec<Probe>,
}

impl Ballot {
    fn new(asked: &Described) -> Self {
        let mut by_landmark = Vec::new();
        for (landmark, described) in (0..).zip(&asked.landmarks) {
            for (rung, looks) in (0..).zip(&described.looks) {
                let weight = telling(looks) as u16;
                by_landmark.extend(cells_near(looks, PROBES).into_iter().map(|cell| {
                    let signature = signature(looks, cell);
                    Probe { landmark, rung, cell, signature, weight }
                }));
            }
        }
        by_landmark.sort_by_key(|probe| (probe.rung, probe.landmark));
        let mut by_cell = by_landmark.clone();
        by_cell.sort_by_key(|probe| (probe.cell, probe.rung));
        Self { by_landmark, by_cell }
    }

    /// Σ_i max_j v(i, j) by rung and piece.
    fn found_by_suspect(&self, postings: &Postings, pieces: usize) -> Vec<u16> {
        let mut sums = vec![0u16; pieces * RUNGS];
        let mut best = vec![0; pieces];
        let mut votes = Vec::new();
        for probes in self.by_landmark.chunk_by(|a, b| (a.rung, a.landmark) == (b.rung, b.landmark)) {
            for probe in probes {
                let list = postings.list(probe.cell);
                votes.clear();
                votes.extend(list.signatures.iter().map(|&other| probe.vote(other)));
                for (&piece, &vote) in list.pieces.iter().zip(&votes) {
                    let Some(best) = best.get_mut(usize::from(piece)) else { continue };
                    *best = vote.max(*best);
                }
            }
            let sums = &mut sums[usize::from(probes[0].rung) * pieces..][..pieces];
            for (sum, best) in sums.iter_mut().zip(&mut best) {
                *sum = sum.saturating_add(std::mem::take(best));
            }
        }
        sums
    }

    /// Σ_j max_i v(i, j) by rung and piece.
    fn found_by_pieces(&self, postings: &Postings, pieces: usize) -> Vec<u16> {
        let mut sums = vec![0u16; pieces * RUNGS];
        let mut votes: Vec<u16> = Vec::new();
        for probes in self.by_cell.chunk_by(|a, b| (a.cell, a.rung) == (b.cell, b.rung)) {
            let list = postings.list(probes[0].cell);
            votes.clear();
            votes.resize(list.signatures.len(), 0);
            for probe in probes {
                for (vote, &other) in votes.iter_mut().zip(list.signatures) {
                    *vote = probe.vote(other).max(*vote);
                }
            }
            let sums = &mut sums[usize::from(probes[0].rung) * pieces..][..pieces];
            for (&piece, &vote) in list.pieces.iter().zip(&votes) {
                let Some(sum) = sums.get_mut(usize::from(piece)) else { continue };
                *sum = sum.saturating_add(vote);
            }
        }
        sums
    }
}

fn ranked(lists: &Lists, sums: &[Vec<u16>; 2], alive: impl Fn(u32) -> bool, most: usize) -> Vec<Voted> {
    let pieces = lists.head.pieces.len();
    let of_piece = |(piece, of): (usize, &PieceOf)| {
        let votes = |rung: usize| {
            let [a, b] = sums.each_ref().map(|sums| about(|rung| sums[rung * pieces + piece], rung));
            a * b / u64::from(of.landmarks.max(1))
        };
        let (votes, Reverse(rung)) = (0..RUNGS).map(|rung| (votes(rung), Reverse(rung))).max()?;
        let hash = lists.head.entries.get(of.entry as usize)?.hash;
        (votes > 0 && alive(of.entry)).then_some(Voted {
            votes: Reverse(votes),
            hash,
            number: of.number,
            piece: piece as u32,
            rung,
        })
    };
    let mut found: Vec<Voted> = lists.head.pieces.iter().enumerate().filter_map(of_piece).collect();
    if found.len() > most {
        found.select_nth_unstable(most);
        found.truncate(most);
    }
    found.sort_unstable();
    found
}

/// A rung's own sum twice, its neighbours' once.
fn about(sum: impl Fn(usize) -> u16, rung: usize) -> u64 {
    let below = rung.checked_sub(1).map_or(0, &sum);
    let above = if rung + 1 < RUNGS { sum(rung + 1) } else { 0 };
    2 * u64::from(sum(rung)) + u64::from(below) + u64::from(above)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::Landmark;
    use crate::features::Looks;
    use crate::lists::Place;
    use crate::portrait::{Likeness, Portrait};
    use nalgebra::{Point3, Vector3};

    fn landmarks(looks: &[Looks]) -> Vec<Landmark> {
        let landmark = |looks: &Looks| Landmark {
            point: Point3::origin(),
            normal: Vector3::z(),
            looks: vec![*looks; RUNGS],
        };
        looks.iter().map(landmark).collect()
    }

    fn described(looks: &[Looks]) -> Described {
        Described { centroid: Point3::origin(), size: 1.0, landmarks: landmarks(looks) }
    }

    /// Names of the entries with votes, best first.
    fn asked(suspect: &[Looks], models: &[&[Looks]]) -> Vec<u64> {
        let entry = |(hash, looks): (u64, &&[Looks])| {
            let portrait = Portrait { pieces: vec![Likeness::of(&described(looks))] };
            (Place { hash, offset: 0, length: 0 }, portrait)
        };
        let lists = Lists::of((0..).zip(models).map(entry).collect(), Vec::new());
        let found = Ballots::new([&described(suspect)]).count(&lists, |_| true, 9).unwrap();
        found.concat().into_iter().map(|voted| voted.hash).collect()
    }

    #[test]
    fn a_plain_suspect_finds_the_plain_model_and_not_one_that_has_such_a_place_too() {
        let plain = [[40; 16]; 30];
        let other: Vec<Looks> = (0..30).map(|k| [if k == 0 { 40 } else { 4 * k - 60 }; 16]).collect();
        assert_eq!(asked(&plain, &[&other, &plain])[0], 1);
        assert_eq!(asked(&other, &[&plain, &other])[0], 1);
        // Two thirds of them are enough.
        assert_eq!(asked(&plain[..20], &[&other, &plain])[0], 1);
        assert_eq!(asked(&other[..20], &[&plain, &other])[0], 1);
    }

    #[test]
    fn nobody_votes_for_nothing() {
        assert_eq!(asked(&[], &[&[[0; 16]]]), []);
        assert_eq!(asked(&[[0; 16]], &[&[]]), []);
    }
}
