//! The pairs of places that a mark may bring too near to each other, or too far apart.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use sombrero_coupling::{Assembly, Facing, facing};
use sombrero_spectral::{Here, next_field};

/// As large as one of a model's many Gaussian numbers gets.
const LARGEST: f64 = 4.5;

/// What a distance may change by.
const CHANGE: f64 = 0.08;

/// Sums over functions are taken by so many pieces.
const PIECES: usize = 4;

/// Pairs that one task looks at.
const CHUNK: usize = 256;

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
        at: &[&Here],
        functions: usize,
        assembly: &Assembly<'_>,
        epsilon: f64,
        gain: f64,
    ) -> Self {
        let sigma = |here: &&Here| here.iter().map(|(_, d)| d.norm_squared()).sum::<f64>().sqrt();
        let deviations: Vec<f64> =
            at.par_iter().with_min_len(CHUNK).map(|here| LARGEST * epsilon * sigma(here)).collect();
        let longest = deviations.iter().copied().fold(0.0, f64::max);
        let farthest: Vec<f64> = deviations.iter().map(|d| gain * (d + longest) / CHANGE).collect();
        // Most move too little to matter, whatever the two do.
        let mut pairs = facing(assembly, &farthest, |pair| {
            let most: f64 = pair.terms.iter().map(|(v, map)| map.norm() * deviations[*v as usize]).sum();
            CHANGE * pair.distance < gain * most
        });
        pairs.extend(super::thin::pairs(at, assembly, CHANGE / (LARGEST * epsilon * gain)));
        let mut walls = Self { shares: Vec::new(), pairs, longest, unit: LARGEST * epsilon / CHANGE };
        let shares: Vec<f64> = walls.squares(at, functions).into_iter().map(f64::sqrt).collect();
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
    fn squares(&self, at: &[&Here], functions: usize) -> Vec<f64> {
        let piece = functions.div_ceil(PIECES).max(1);
        let square = |pair: &Facing| {
            let mut sums = [0.0; PIECES];
            self.each_change(pair, at, |function, change| sums[function as usize / piece] += change * change);
            sums.iter().sum()
        };
        self.pairs.par_iter().with_min_len(CHUNK).map(square).collect()
    }

    /// For each pair the functions that change it, and their own shares of what is allowed.
    pub(super) fn changes(&self, at: &[&Here]) -> Vec<Vec<(u32, f64)>> {
        let changes = |pair: &Facing| {
            let mut changes = Vec::new();
            self.each_change(pair, at, |function, change| changes.push((function, change)));
            changes
        };
        self.pairs.par_iter().with_min_len(CHUNK).map(changes).collect()
    }

    /// Tells of each function that changes the pair, in order, by what of the allowed change.
    fn each_change(&self, pair: &Facing, at: &[&Here], mut tell: impl FnMut(u32, f64)) {
        let unit = self.unit / pair.distance;
        let along = |(v, map): &(u32, Matrix3<f64>)| (*v, map.transpose() * pair.direction * unit);
        let mut terms: Vec<(u32, Vector3<f64>)> = pair.terms.iter().map(along).collect();
        // Sums are taken in order of points.
        terms.sort_by_key(|term| term.0);
        let mut rests: Vec<&Here> = terms.iter().map(|(v, _)| at[*v as usize]).collect();
        loop {
            let mut change = 0.0;
            let function = next_field(&mut rests, |_, k, d| change += terms[k].1.dot(d));
            let Some(function) = function else { return };
            tell(function, change);
        }
    }
}
