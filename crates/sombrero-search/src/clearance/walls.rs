//! The pairs of places that a mark may bring too near to each other, or too far apart.

use nalgebra::Vector3;
use rayon::prelude::*;
use sombrero_basis::Basis;
use sombrero_coupling::{Assembly, Facing, Views};
use sombrero_spectral::{Here, next_field};

/// As large as one of a model's many Gaussian numbers gets.
const LARGEST: f64 = 4.5;

/// What a distance may change by.
const CHANGE: f64 = 0.07;

/// Sums over functions are taken by so many pieces.
const PIECES: usize = 4;

/// Pairs that one task looks at.
const CHUNK: usize = 256;

/// Walls and gaps that functions may change by more than they may.
pub(super) struct Walls {
    /// The places.
    pub(super) pairs: Vec<Facing>,
    /// 4.5 ε σ / 0.07 D of each: what of the allowed change they use, more than 1 when it is too much.
    pub(super) shares: Vec<f64>,
    /// 4.5 ε σ of the point that moves furthest.
    pub(super) longest: f64,
    /// What turns a change into a share: 4.5 ε / 0.07.
    unit: f64,
}

impl Walls {
    /// Those whose share is more than 1 once functions are `gain` times as strong.
    pub(super) fn find(
        basis: &Basis,
        at: &[&Here],
        assembly: &Assembly<'_>,
        views: &Views,
        epsilon: f64,
        gain: f64,
    ) -> Self {
        let deviations: Vec<f64> = basis.deviations().iter().map(|sigma| LARGEST * epsilon * sigma).collect();
        let longest = deviations.iter().copied().fold(0.0, f64::max);
        let farthest: Vec<f64> = deviations.iter().map(|d| gain * (d + longest) / CHANGE).collect();
        // Most move too little to matter, whatever the two do.
        let mut pairs = views.facing(assembly, &farthest, |pair| {
            let most: f64 = pair.terms.iter().map(|(v, map)| map.norm() * deviations[*v as usize]).sum();
            CHANGE * pair.distance < gain * most
        });
        pairs.extend(super::thin::pairs(at, assembly, CHANGE / (LARGEST * epsilon * gain)));
        let mut walls = Self { shares: Vec::new(), pairs, longest, unit: LARGEST * epsilon / CHANGE };
        let shares: Vec<f64> =
            walls.squares(at, basis.functions().len()).into_iter().map(f64::sqrt).collect();
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
            let mut terms: Vec<(u32, Vector3<f64>)> = self.along(pair).collect();
            // Sums are taken in order of points.
            terms.sort_by_key(|term| term.0);
            let mut rests: Vec<&Here> = terms.iter().map(|(v, _)| at[*v as usize]).collect();
            let mut sums = [0.0; PIECES];
            loop {
                let mut change = 0.0;
                let function = next_field(&mut rests, |_, k, d| change += terms[k].1.dot(d));
                let Some(function) = function else { return sums.iter().sum() };
                sums[function as usize / piece] += change * change;
            }
        };
        self.pairs.par_iter().with_min_len(CHUNK).map(square).collect()
    }

    /// For each point that a pair is part of u · M as a vector, in what is allowed.
    fn along(&self, pair: &Facing) -> impl Iterator<Item = (u32, Vector3<f64>)> {
        let unit = self.unit / pair.distance;
        pair.terms.iter().map(move |(v, map)| (*v, map.transpose() * pair.direction * unit))
    }

    /// For each function the pairs that it changes, and its own share of what is allowed.
    pub(super) fn changes(&self, basis: &Basis) -> Vec<Vec<(u32, f64)>> {
        let mut part_of: Vec<Vec<(u32, Vector3<f64>)>> = vec![Vec::new(); basis.vertex_count()];
        for (number, pair) in (0..).zip(&self.pairs) {
            self.along(pair).for_each(|(v, along)| part_of[v as usize].push((number, along)));
        }
        let of = |change: &mut Vec<f64>, i: usize| {
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
        let functions = (0..basis.functions().len()).into_par_iter();
        functions.map_init(|| vec![0.0; self.pairs.len()], of).collect()
    }
}
