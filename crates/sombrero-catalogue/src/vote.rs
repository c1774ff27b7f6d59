//! The first round: which pieces of a catalogue have landmarks that look like those of the suspect, at one ratio of sizes.
//!
//! Each landmark of the suspect, at each rung of the ladder, gives to every piece with a landmark in one of the nearest cells a
//! vote, weighed by how unusual it looks and by how many bits of the signatures agree; of several votes of one landmark for the same piece and rung the
//! best one counts. Whatever was made from a model has its landmarks at one ratio of sizes, so votes of neighbouring rungs
//! are added up and the best sum counts (weak geometric consistency: Jégou, Douze and Schmid 2008).

use std::cmp::Reverse;
use std::collections::BTreeMap;

use crate::describe::Described;
use crate::features::{cells_near, signature, telling};
use crate::lists::Lists;
use crate::question::MORE;

/// Cells that a landmark looks into at each rung.
const PROBES: usize = 24;
/// Votes by how many bits of the signatures differ.
const VOTES: [u16; 8] = [16, 14, 12, 9, 6, 4, 2, 1];
const RUNGS: usize = 2 * MORE + 1;

/// A piece of a segment and its votes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Voted {
    /// Larger is better.
    pub(crate) votes: Reverse<u32>,
    /// Orders pieces with equal votes in a way that does not depend on where they lie.
    pub(crate) hash: u64,
    pub(crate) number: u16,
    /// Index among the segment's pieces.
    pub(crate) piece: u32,
    /// The rung with most votes.
    pub(crate) rung: usize,
}

/// A look of the suspect's in one cell.
struct Probe {
    cell: u16,
    signature: u16,
    rung: usize,
    /// What a vote is multiplied with.
    weight: u16,
}

/// What a piece asks of every segment.
pub(crate) struct Ballot {
    /// By landmark.
    probes: Vec<Vec<Probe>>,
    /// All cells that are probed, each once, ascending.
    cells: Vec<u16>,
}

impl Ballot {
    pub(crate) fn new(asked: &Described) -> Self {
        let probe = |rung: usize, looks: &_| {
            let weight = telling(looks) as u16;
            let cells = cells_near(looks, PROBES).into_iter();
            cells
                .map(|cell| Probe { cell, signature: signature(looks, cell), rung, weight })
                .collect::<Vec<_>>()
        };
        let of_landmark = |looks: &Vec<_>| looks.iter().enumerate().flat_map(|(r, l)| probe(r, l)).collect();
        let probes: Vec<Vec<Probe>> = asked.landmarks.iter().map(|l| of_landmark(&l.looks)).collect();
        let mut cells: Vec<u16> = probes.iter().flatten().map(|p| p.cell).collect();
        cells.sort_unstable();
        cells.dedup();
        Self { probes, cells }
    }

    /// The `most` pieces with most votes, best first; `alive` says which entries count.
    pub(crate) fn count(
        &self,
        lists: &Lists,
        alive: impl Fn(u32) -> bool,
        most: usize,
    ) -> std::io::Result<Vec<Voted>> {
        let found: BTreeMap<u16, Vec<u8>> =
            self.cells.iter().map(|&cell| Ok((cell, lists.list(cell)?))).collect::<std::io::Result<_>>()?;
        let pieces = &lists.head.pieces;
        let mut sums = vec![0u32; pieces.len() * RUNGS];
        let mut best = vec![0u16; sums.len()];
        let mut touched = Vec::new();
        for probes in &self.probes {
            for probe in probes {
                let list = found.get(&probe.cell).map_or(&[][..], |list| &list[..]);
                for posting in list.chunks_exact(4) {
                    let piece = usize::from(u16::from_le_bytes([posting[0], posting[1]]));
                    let other = u16::from_le_bytes([posting[2], posting[3]]);
                    let Some(&vote) = VOTES.get((other ^ probe.signature).count_ones() as usize) else {
                        continue;
                    };
                    let Some(best) = best.get_mut(piece * RUNGS + probe.rung) else { continue };
                    if *best == 0 {
                        touched.push(piece * RUNGS + probe.rung);
                    }
                    *best = (*best).max(vote * probe.weight);
                }
            }
            for slot in touched.drain(..) {
                sums[slot] += u32::from(std::mem::take(&mut best[slot]));
            }
        }
        Ok(ranked(lists, &sums, alive, most))
    }
}

fn ranked(lists: &Lists, sums: &[u32], alive: impl Fn(u32) -> bool, most: usize) -> Vec<Voted> {
    let of_piece = |(piece, sums): (usize, &[u32])| {
        let of = lists.head.pieces.get(piece)?;
        // A rung's own votes count twice, its neighbours' once.
        let at = |rung: usize| sums.get(rung).copied().unwrap_or(0);
        let total = |rung: usize| 2 * at(rung) + at(rung + 1) + rung.checked_sub(1).map_or(0, at);
        let (sum, Reverse(rung)) = (0..RUNGS).map(|rung| (total(rung), Reverse(rung))).max()?;
        // By chance a piece gets votes as it has landmarks.
        let votes = (f64::from(sum) * 64.0 / f64::from(of.landmarks.max(1)).sqrt()) as u32;
        let hash = lists.head.entries.get(of.entry as usize)?.hash;
        (votes > 0 && alive(of.entry)).then_some(Voted {
            votes: Reverse(votes),
            hash,
            number: of.number,
            piece: piece as u32,
            rung,
        })
    };
    let mut found: Vec<Voted> = sums.chunks_exact(RUNGS).enumerate().filter_map(of_piece).collect();
    if found.len() > most {
        found.select_nth_unstable(most);
        found.truncate(most);
    }
    found.sort_unstable();
    found
}
