//! Which landmarks look most like another, by all of their numbers.
//!
//! Looks a and b differ by Σ_k ((a_k - b_k) / σ_k)², with σ_k the standard deviation of number k. Everything is compared with
//! everything, a block of looks at a time: the same number of all of them side by side, so that a processor takes several at once.

use sombrero_landmarks::{Features, NUMBERS};

/// Looks that are compared at a time.
const BLOCK: usize = 64;
/// What a number varies at least, so that one that is the same everywhere does not decide.
const LEAST_DEVIATION: f32 = 0.02;

/// Looks to compare others with.
#[derive(Debug, Clone)]
pub(crate) struct Looks {
    /// Number k of look j of a block at [k][j].
    blocks: Vec<[[f32; BLOCK]; NUMBERS]>,
    count: usize,
    /// 1 / σ.
    weights: Features,
}

impl Looks {
    pub(crate) fn new(looks: &[Features]) -> Self {
        let block = |looks: &[Features]| {
            let mut block = [[0.0; BLOCK]; NUMBERS];
            for (j, look) in looks.iter().enumerate() {
                look.iter().zip(&mut block).for_each(|(x, row)| row[j] = *x);
            }
            block
        };
        Self { blocks: looks.chunks(BLOCK).map(block).collect(), count: looks.len(), weights: weights(looks) }
    }

    /// The `most` that differ least, those first; of equals the earlier ones.
    pub(crate) fn nearest(&self, look: &Features, most: usize) -> Vec<usize> {
        let mut found: Vec<(f32, usize)> = Vec::with_capacity(most + 1);
        for (number, block) in self.blocks.iter().enumerate() {
            let from = number * BLOCK;
            let differences = self.differences(look, block);
            for (index, &difference) in (from..self.count).zip(&differences) {
                if found.len() == most && found.last().is_none_or(|worst| difference >= worst.0) {
                    continue;
                }
                let place = found.partition_point(|other| other.0 <= difference);
                found.insert(place, (difference, index));
                found.truncate(most);
            }
        }
        found.into_iter().map(|(_, index)| index).collect()
    }

    fn differences(&self, look: &Features, block: &[[f32; BLOCK]; NUMBERS]) -> [f32; BLOCK] {
        let mut sums = [0.0; BLOCK];
        for ((x, weight), row) in look.iter().zip(&self.weights).zip(block) {
            for (sum, y) in sums.iter_mut().zip(row) {
                let difference = (x - y) * weight;
                *sum += difference * difference;
            }
        }
        sums
    }
}

fn weights(looks: &[Features]) -> Features {
    let count = looks.len().max(1) as f32;
    std::array::from_fn(|k| {
        let mean = looks.iter().map(|f| f[k]).sum::<f32>() / count;
        let variance = looks.iter().map(|f| (f[k] - mean).powi(2)).sum::<f32>() / count;
        1.0 / variance.sqrt().max(LEAST_DEVIATION)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn looks() -> impl Strategy<Value = Vec<Features>> {
        proptest::collection::vec(proptest::array::uniform32(-3i8..3), 1..200)
            .prop_map(|looks| looks.into_iter().map(|look| look.map(f32::from)).collect())
    }

    proptest! {
        #[test]
        fn the_nearest_are_those_of_a_sorted_list(looks in looks(), most in 1usize..12) {
            let compared = Looks::new(&looks);
            let difference = |look: &Features| -> f32 {
                let terms = looks[0].iter().zip(look).zip(&compared.weights);
                terms.map(|((x, y), w)| ((x - y) * w).powi(2)).sum()
            };
            let mut expected: Vec<usize> = (0..looks.len()).collect();
            expected.sort_by(|&a, &b| difference(&looks[a]).total_cmp(&difference(&looks[b])));
            expected.truncate(most);
            prop_assert_eq!(compared.nearest(&looks[0], most), expected);
        }
    }
}
