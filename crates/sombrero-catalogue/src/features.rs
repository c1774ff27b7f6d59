//! The numbers of a landmark that are compared, in bytes.

use sombrero_landmarks::Features;

/// Numbers that are kept of a landmark.
pub(crate) const NUMBERS: usize = 16;

/// A landmark's looks: their squared differences are distances.
pub(crate) type Looks = [i8; NUMBERS];

/// Which features are kept until better ones are known, and their standard deviations.
const KEPT: [(usize, f32, f32); 4] = [(0, 0.0, 0.3), (1, 0.0, 0.15), (5, 0.0, 0.1), (6, 0.8, 0.2)];

/// Keeps what tells landmarks apart.
pub(crate) fn looks(features: &Features) -> Looks {
    std::array::from_fn(|k| {
        let (index, mean, deviation) = KEPT[k % 4];
        ((features[k / 4 * 8 + index] - mean) / deviation * 32.0).round().clamp(-127.0, 127.0) as i8
    })
}

/// Squared distance.
pub(crate) fn apart(a: &Looks, b: &Looks) -> u32 {
    a.iter().zip(b).map(|(a, b)| (i32::from(*a) - i32::from(*b)).pow(2) as u32).sum()
}
