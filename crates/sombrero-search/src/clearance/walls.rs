//! The pairs of places that a mark may bring too near to each other, or too far apart.

use super::Displacements;
use nalgebra::Vector3;
use rayon::prelude::*;
use sombrero_basis::Basis;
use sombrero_coupling::{Assembly, Facing, facing};

/// As large as one of a model's many Gaussian numbers gets.
const LARGEST: f64 = 4.5;

/// What a distance may change by.
const CHANGE: f64 = 0.08;

/// Functions are taken in so many pieces, whatever the number of threads.
const PIECES: usize = 4;

/// Walls and gaps that functions may change by more than they may.
pub(super) struct Walls {
    /// The places.
    pub(super) pairs: Vec<Facing>,
    /// 4.5 ε σ / 0.08 D of each: what of the allowed change they use, more than 1 when it is too much.
    pub(super) shares: Vec<f64>,
    /// 4.5 ε σ of the point that moves furthest.
    pub(super) longest: f64,
    /// What turns a change into a share: 4.5 ε / 0.08.
    unit: f64,
}

impl Walls {
    /// Those whose share is more than 1 once functions are `gain` times as strong.
    pub(super) fn find(
        basis: &Basis,
        displacements: &[Displacements],
        assembly: &Assembly<'_>,
        epsilon: f64,
        gain: f64,
    ) -> Self {
        let deviations: Vec<f64> = basis.deviations().iter().map(|sigma| LARGEST * epsilon * sigma).collect();
        let longest = deviations.iter().copied().fold(0.0, f64::max);
        let farthest: Vec<f64> = deviations.iter().map(|d| gain * (d + longest) / CHANGE).collect();
        let mut pairs = facing(assembly, &farthest);
        // Most move too little to matter, whatever the two do.
        pairs.retain(|pair| {
            let most: f64 = pair.terms.iter().map(|(v, map)| map.norm() * deviations[*v as usize]).sum();
            CHANGE * pair.distance < gain * most
        });
        pairs.extend(super::thin::pairs(displacements, assembly, CHANGE / (LARGEST * epsilon * gain)));
        let mut walls = Self { shares: Vec::new(), pairs, longest, unit: LARGEST * epsilon / CHANGE };
        let shares: Vec<f64> = walls.squares(basis).into_iter().map(f64::sqrt).collect();
        let binding: Vec<bool> = shares.iter().map(|share| gain * share > 1.0).collect();
        walls.shares = shares.into_iter().filter(|share| gain * share > 1.0).collect();
        let mut binding = binding.into_iter();
        walls.pairs.retain(|_| binding.next() == Some(true));
        walls
    }

    /// Whether any has a share of more than 1 at this gain.
    pub(super) fn bind(&self, gain: f64) -> bool {
        self.shares.iter().any(|share| gain * share > 1.0)
    }

    /// The square of each pair's share.
    fn squares(&self, basis: &Basis) -> Vec<f64> {
        let sums = self.by_functions(basis, |changes: &[Vec<(u32, f64)>]| {
            let mut squares = vec![0.0; self.pairs.len()];
            changes.iter().flatten().for_each(|(pair, share)| squares[*pair as usize] += share * share);
            squares
        });
        (0..self.pairs.len()).map(|pair| sums.iter().map(|squares| squares[pair]).sum()).collect()
    }

    /// For each function the pairs that it changes, and its own share of what is allowed.
    pub(super) fn changes(&self, basis: &Basis) -> Vec<Vec<(u32, f64)>> {
        self.by_functions(basis, <[_]>::to_vec).concat()
    }

    /// What `take` makes of each piece's functions: of the pairs that each changes, and of its share.
    fn by_functions<T: Send>(&self, basis: &Basis, take: impl Fn(&[Vec<(u32, f64)>]) -> T + Sync) -> Vec<T> {
        // For each point the pairs that it is part of, and u · M as a vector.
        let mut part_of: Vec<Vec<(u32, Vector3<f64>)>> = vec![Vec::new(); basis.vertex_count()];
        for (number, pair) in (0..).zip(&self.pairs) {
            for (v, map) in &pair.terms {
                let along = map.transpose() * pair.direction * (self.unit / pair.distance);
                part_of[*v as usize].push((number, along));
            }
        }
        let functions: Vec<usize> = (0..basis.functions().len()).collect();
        let piece = |functions: &[usize]| {
            let mut change = vec![0.0; self.pairs.len()];
            let mut of = |i: usize| {
                let mut touched = Vec::new();
                crate::coupled::each(basis, i, |row, d| {
                    for (pair, along) in &part_of[row] {
                        touched.push(*pair);
                        change[*pair as usize] += along.dot(&d);
                    }
                });
                touched.sort_unstable();
                touched.dedup();
                touched.iter().map(|&pair| (pair, std::mem::take(&mut change[pair as usize]))).collect()
            };
            take(&functions.iter().map(|&i| of(i)).collect::<Vec<Vec<(u32, f64)>>>())
        };
        functions.par_chunks(functions.len().div_ceil(PIECES).max(1)).map(piece).collect()
    }
}
