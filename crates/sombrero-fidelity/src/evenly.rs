//! Some of many, spread evenly.

/// At most about `most` of the numbers below `count`, in order: all of them when there are no more. Number i is chosen when
/// frac(i / φ) is below the share of those that are, φ the golden ratio: the multiples of no other number spread more evenly
/// modulo 1.
pub(crate) fn evenly(count: usize, most: usize) -> impl Iterator<Item = usize> {
    const STEP: f64 = 0.618_033_988_749_894_8;
    let share = most as f64 / count.max(1) as f64;
    (0..count).filter(move |&i| share >= 1.0 || (i as f64 * STEP).fract() < share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stretch_has_its_share() {
        assert_eq!(evenly(5, 5).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        assert_eq!(evenly(0, 5).count(), 0);
        let some: Vec<usize> = evenly(10_000, 1000).collect();
        for start in (0..10_000).step_by(500) {
            let within = some.iter().filter(|i| (start..start + 500).contains(*i)).count();
            assert!(within.abs_diff(50) <= 2, "{within}");
        }
    }
}
