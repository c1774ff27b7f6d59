//! Mutated files: whatever the bytes, an answer or an error, and Law 2 for what is read.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use proptest::prelude::*;
use sombrero::io::Document;
use sombrero::watermark::Key;
use sombrero_tests::hostile::{Target, input, seeds};

#[test]
fn seeds_are_valid() {
    for target in Target::ALL {
        let mut with_triangles = 0;
        for (i, seed) in seeds(target).into_iter().enumerate() {
            assert!(target.feed(&seed));
            let name = target.name();
            match target {
                Target::Key => drop(Key::from_json(&seed).unwrap()),
                _ => {
                    let document =
                        Document::parse(seed, Some(name)).unwrap_or_else(|e| panic!("{name} {i}: {e}"));
                    assert!(!document.points().is_empty(), "{name} {i}: no vertices");
                    with_triangles += usize::from(!document.triangles().is_empty());
                }
            }
        }
        // All but a cloud of points.
        let expected = if target == Target::Key { 0 } else { seeds(target).len() - CLOUDS[target as usize] };
        assert_eq!(with_triangles, expected, "{}", target.name());
    }
}

/// How many seeds of each target are clouds of points.
const CLOUDS: [usize; 8] = [1, 1, 1, 0, 0, 0, 0, 0];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn no_mutant_breaks_a_reader(target in prop::sample::select(&Target::ALL[..]), index in any::<u64>()) {
        thread_local! {
            static SEEDS: Vec<Vec<Vec<u8>>> = Target::ALL.iter().map(|&t| seeds(t)).collect();
        }
        let at = Target::ALL.iter().position(|&t| t == target).unwrap();
        let bytes = SEEDS.with(|seeds| input(target, &seeds[at], index));
        target.feed(&bytes);
    }
}
