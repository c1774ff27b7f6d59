//! More entries of the same kind: portraits with their landmarks shaken, so that an index is as full as one of a hundred times
//! as many models though their shapes repeat.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sombrero_catalogue::Portrait;

/// Standard deviation of what attacks do to a number of a landmark is 4; this is the largest change by shaking.
const STRENGTH: i32 = 14;

/// Another portrait like this one.
pub(crate) fn shaken(portrait: &Portrait, seed: u64) -> Portrait {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    portrait.shaken(&mut || rng.random_range(-STRENGTH..=STRENGTH))
}
