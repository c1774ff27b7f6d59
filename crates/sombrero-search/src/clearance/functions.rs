//! Whole functions are made weaker.
//!
//! With a_pi the square of what function i uses of pair p's allowed change, the factors s_i² = u_i that
//!
//! ```text
//! maximise Σ_i log u_i      with      Σ_i a_pi u_i ≤ 1 for every p,      u_i ≤ 1
//! ```
//!
//! are u_i = min(1, 1/Σ_p λ_p a_pi), and the prices λ_p follow from λ_p ← λ_p Σ_i a_pi u_i, as those of optimal designs do
//! (Silvey, Titterington and Torsney 1978).

use super::Limits;
use super::walls::Walls;
use sombrero_spectral::Here;

const ITERATIONS: usize = 40;

/// More changes than these would take more memory than the basis.
const MOST: usize = 20_000_000;

/// What each function uses of the pairs that it changes, as shares of what is allowed; `None` where there are too many.
pub(super) fn changes(walls: &Walls, at: &[&Here], functions: usize) -> Option<Vec<Vec<(u32, f64)>>> {
    let of_pairs = walls.changes(at);
    if of_pairs.iter().map(Vec::len).sum::<usize>() > MOST {
        return None;
    }
    let mut changes = vec![Vec::new(); functions];
    for (pair, of_pair) in (0..).zip(of_pairs) {
        of_pair.into_iter().for_each(|(function, share)| changes[function as usize].push((pair, share)));
    }
    Some(changes)
}

/// What functions are multiplied by at this gain.
pub(super) fn limits(changes: &[Vec<(u32, f64)>], pairs: usize, gain: f64) -> Limits {
    let factors = factors(&Uses { changes, gain }, pairs);
    Limits::OfFunctions(factors.into_iter().map(|factor| gain * factor.sqrt()).collect())
}

/// a_pi at a gain: the squares of changes, which are not kept since they take as much memory.
struct Uses<'a> {
    changes: &'a [Vec<(u32, f64)>],
    gain: f64,
}

impl Uses<'_> {
    /// For each function its pairs with their a_pi.
    fn rows(&self) -> impl Iterator<Item = impl Iterator<Item = (usize, f64)>> {
        let square = |share: f64| self.gain * self.gain * share * share;
        self.changes.iter().map(move |row| row.iter().map(move |(p, share)| (*p as usize, square(*share))))
    }

    /// Σ_i a_pi u_i of each pair.
    fn loads(&self, factors: &[f64], pairs: usize) -> Vec<f64> {
        let mut loads = vec![0.0; pairs];
        for (row, factor) in self.rows().zip(factors) {
            row.for_each(|(p, a)| loads[p] += a * factor);
        }
        loads
    }
}

/// u.
fn factors(uses: &Uses<'_>, pairs: usize) -> Vec<f64> {
    let at = |prices: &[f64]| -> Vec<f64> {
        let costs = uses.rows().map(|row| row.map(|(p, a)| prices[p] * a).sum::<f64>());
        costs.map(|cost| 1.0 / cost.max(1.0)).collect()
    };
    let mut prices = vec![1.0; pairs];
    let mut factors = at(&prices);
    for _ in 0..ITERATIONS {
        let loads = uses.loads(&factors, pairs);
        prices.iter_mut().zip(&loads).for_each(|(price, load)| *price *= load);
        factors = at(&prices);
    }
    // What is still too much is taken from all who use it.
    let loads = uses.loads(&factors, pairs);
    let over =
        uses.rows().map(|row| row.filter(|(_, a)| *a > 0.0).map(|(p, _)| loads[p]).fold(1.0, f64::max));
    factors.iter().zip(over).map(|(factor, over)| factor / over).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_share_what_a_wall_allows() {
        // One pair that two functions use four times over, and a third that has nothing to do with it.
        let changes = [vec![(0, 2.0)], vec![(0, 2.0)], vec![]];
        let factors = factors(&Uses { changes: &changes, gain: 1.0 }, 1);
        assert!((factors[0] - 0.125).abs() < 1e-9 && (factors[1] - 0.125).abs() < 1e-9, "{factors:?}");
        assert_eq!(factors[2], 1.0);
    }

    #[test]
    fn every_wall_is_kept_and_one_that_allows_enough_costs_nothing() {
        let uses = [vec![(0, 9.0), (1, 0.2)], vec![(1, 0.5), (2, 0.1)], vec![(0, 1.0), (2, 30.0)]];
        // At twice the gain, from half the changes.
        let changes = uses.map(|row| row.into_iter().map(|(p, a): (u32, f64)| (p, a.sqrt() / 2.0)).collect());
        let uses = Uses { changes: &changes, gain: 2.0 };
        let factors = factors(&uses, 3);
        for load in uses.loads(&factors, 3) {
            assert!(load <= 1.0 + 1e-12, "{factors:?}");
        }
        assert!(factors[1] > 0.999, "{factors:?}");
        assert!(factors[0] > 0.1 && factors[2] > 0.029, "{factors:?}");
    }
}
