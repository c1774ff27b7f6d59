//! Factors that change slowly over a surface: a low one lowers those around it.
//!
//! ```text
//! s'_v = min over u of (s_u + dist(u, v)/ρ)
//! ```
//!
//! with distances along edges, and none within what must move as a whole.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Two points and how far they are apart, in units of ρ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// The two points.
    pub ends: [u32; 2],
    /// dist/ρ, not negative.
    pub length: f64,
}

/// The largest factors that are at most `factors` and differ by no more than their links' lengths, in O(n log n).
///
/// ```
/// use sombrero_coupling::{Link, spread};
///
/// let link = |a, b| Link { ends: [a, b], length: 0.25 };
/// assert_eq!(spread(&[1.0, 1.0, 0.2, 1.0], &[link(0, 1), link(1, 2)]), [0.7, 0.45, 0.2, 1.0]);
/// ```
///
/// # Panics
/// When a link's end is not below the number of factors.
pub fn spread(factors: &[f64], links: &[Link]) -> Vec<f64> {
    let mut begins = vec![0_usize; factors.len() + 1];
    links.iter().flat_map(|link| link.ends).for_each(|v| begins[v as usize + 1] += 1);
    for v in 1..begins.len() {
        begins[v] += begins[v - 1];
    }
    let mut next = begins.clone();
    let mut around = vec![(0_u32, 0.0_f64); 2 * links.len()];
    for Link { ends: [a, b], length } in links {
        for (from, to) in [(a, b), (b, a)] {
            let place = &mut next[*from as usize];
            around[*place] = (*to, *length);
            *place += 1;
        }
    }
    let mut least = factors.to_vec();
    // Numbers that are not negative are in the order of their bits.
    let key = |factor: f64, v: u32| Reverse((factor.max(0.0).to_bits(), v));
    let mut heap: BinaryHeap<_> =
        (0..).zip(factors).filter(|(_, f)| **f < 1.0).map(|(v, f)| key(*f, v)).collect();
    while let Some(Reverse((bits, v))) = heap.pop() {
        let factor = f64::from_bits(bits);
        if factor > least[v as usize] {
            continue;
        }
        for &(u, length) in &around[begins[v as usize]..begins[v as usize + 1]] {
            let reached = factor + length;
            if reached < least[u as usize] {
                least[u as usize] = reached;
                heap.push(key(reached, u));
            }
        }
    }
    least
}
