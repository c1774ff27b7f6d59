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

use crate::describe::Described;
use crate::features::{cells_near, signature, telling};
use crate::lists::{Lists, PieceOf};
use crate::question::MORE;

/// Cells that a landmark looks into at each rung.
const PROBES: usize = 16;
/// Votes by how many bits of the signatures differ.
const VOTES: [u16; 8] = [16, 14, 12, 9, 6, 4, 2, 1];
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
    /// Index into the ballot's cells.
    cell: u32,
    signature: u16,
    /// What a vote is multiplied with.
    weight: u16,
}

impl Probe {
    /// What it finds in a landmark of the cell with the signature `other`.
    fn vote(&self, other: u16) -> u32 {
        let differing = (self.signature ^ other).count_ones() as usize;
        VOTES.get(differing).map_or(0, |&vote| u32::from(vote * self.weight))
    }
}

/// What a piece asks of every segment.
pub(crate) struct Ballot {
    /// All cells that are probed, each once, ascending.
    cells: Vec<u16>,
    /// By landmark and rung.
    by_landmark: Vec<Probe>,
    /// The same by cell and rung.
    by_cell: Vec<Probe>,
}

impl Ballot {
    pub(crate) fn new(asked: &Described) -> Self {
        let mut cells = Vec::new();
        let mut by_landmark = Vec::new();
        for (landmark, described) in (0..).zip(&asked.landmarks) {
            for (rung, looks) in (0..).zip(&described.looks) {
                let weight = telling(looks) as u16;
                for cell in cells_near(looks, PROBES) {
                    let signature = signature(looks, cell);
                    cells.push(cell);
                    by_landmark.push(Probe { landmark, rung, cell: u32::from(cell), signature, weight });
                }
            }
        }
        cells.sort_unstable();
        cells.dedup();
        for probe in &mut by_landmark {
            probe.cell = cells.partition_point(|cell| u32::from(*cell) < probe.cell) as u32;
        }
        let mut by_cell = by_landmark.clone();
        by_cell.sort_by_key(|probe| (probe.cell, probe.rung));
        Self { cells, by_landmark, by_cell }
    }

    /// The `most` pieces with most votes, best first; `alive` says which entries count.
    pub(crate) fn count(
        &self,
        lists: &Lists,
        alive: impl Fn(u32) -> bool,
        most: usize,
    ) -> std::io::Result<Vec<Voted>> {
        let read = |&cell: &u16| Ok(postings(&lists.list(cell)?));
        let found: Vec<Vec<Posting>> = self.cells.iter().map(read).collect::<std::io::Result<_>>()?;
        let slots = lists.head.pieces.len() * RUNGS;
        let sums = [self.found_by_suspect(&found, slots), self.found_by_pieces(&found, slots)];
        Ok(ranked(lists, &sums, alive, most))
    }

    /// Σ_i max_j v(i, j) by piece and rung.
    fn found_by_suspect(&self, found: &[Vec<Posting>], slots: usize) -> Vec<u32> {
        let mut sums = vec![0; slots];
        let mut best = vec![0; slots];
        let mut touched = Vec::new();
        for probes in self.by_landmark.chunk_by(|a, b| (a.landmark, a.rung) == (b.landmark, b.rung)) {
            for probe in probes {
                for posting in &found[probe.cell as usize] {
                    let slot = posting.slot(probe.rung);
                    let Some(best) = best.get_mut(slot) else { continue };
                    let vote = probe.vote(posting.signature);
                    if *best == 0 && vote > 0 {
                        touched.push(slot);
                    }
                    *best = vote.max(*best);
                }
            }
            for slot in touched.drain(..) {
                sums[slot] += std::mem::take(&mut best[slot]);
            }
        }
        sums
    }

    /// Σ_j max_i v(i, j) by piece and rung.
    fn found_by_pieces(&self, found: &[Vec<Posting>], slots: usize) -> Vec<u32> {
        let mut sums = vec![0; slots];
        for probes in self.by_cell.chunk_by(|a, b| (a.cell, a.rung) == (b.cell, b.rung)) {
            for posting in &found[probes[0].cell as usize] {
                let best = probes.iter().map(|probe| probe.vote(posting.signature)).max();
                if let Some(sum) = sums.get_mut(posting.slot(probes[0].rung)) {
                    *sum += best.unwrap_or(0);
                }
            }
        }
        sums
    }
}

/// A landmark of a piece, in the list of a cell.
struct Posting {
    piece: u16,
    signature: u16,
}

impl Posting {
    fn slot(&self, rung: u16) -> usize {
        usize::from(self.piece) * RUNGS + usize::from(rung)
    }
}

fn postings(list: &[u8]) -> Vec<Posting> {
    let number = |a, b| u16::from_le_bytes([a, b]);
    list.chunks_exact(4)
        .map(|p| Posting { piece: number(p[0], p[1]), signature: number(p[2], p[3]) })
        .collect()
}

fn ranked(lists: &Lists, sums: &[Vec<u32>; 2], alive: impl Fn(u32) -> bool, most: usize) -> Vec<Voted> {
    let of_piece = |(piece, of): (usize, &PieceOf)| {
        let votes = |rung: usize| {
            let [a, b] = sums.each_ref().map(|sums| about(&sums[piece * RUNGS..(piece + 1) * RUNGS], rung));
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
fn about(sums: &[u32], rung: usize) -> u64 {
    let at = |rung: usize| u64::from(sums.get(rung).copied().unwrap_or(0));
    2 * at(rung) + at(rung + 1) + rung.checked_sub(1).map_or(0, at)
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
        let found = Ballot::new(&described(suspect)).count(&lists, |_| true, 9).unwrap();
        found.into_iter().map(|voted| voted.hash).collect()
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
