//! What one try costs: Argon2id (Biryukov, Dinu, Khovratovich 2016; RFC 9106) between all that a mark is bound to and
//! its numbers.
//!
//! Whoever claims a mesh that he did not mark has to try secrets, texts and originals until one of them fits by chance.
//! A hash would let him try millions in a second; a function that fills 64 MiB three times over takes every try about
//! the same fraction of a second on any machine, and the memory that a graphics card could use for more of them at once.

use argon2::{Algorithm, Argon2, Params, Version};
use std::fmt;

/// How the seed of the numbers is computed from a digest: the algorithm's cost, which is bound like everything else.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Derivation {
    pub(crate) memory_kib: u32,
    pub(crate) passes: u32,
    pub(crate) lanes: u32,
}

/// Changes whenever the sequence does.
pub(crate) const TAG: &[u8] = b"sombrero watermark 2";

/// The name in keys.
pub(crate) const ALGORITHM: &str = "argon2id";

/// Four times the memory and five times the passes of the standard: nobody needs more, and a hostile key shall not hang
/// us.
const MOST_MEMORY_KIB: u32 = 4 * Derivation::STANDARD.memory_kib;
const MOST_PASSES: u32 = 5 * Derivation::STANDARD.passes;

impl Derivation {
    /// 64 MiB, three passes, one lane: the second recommendation of RFC 9106, in one lane so that a try takes no
    /// second core. A fifth of a second of one core.
    pub const STANDARD: Self = Self { memory_kib: 1 << 16, passes: 3, lanes: 1 };

    /// Next to no cost, for tests and experiments that need thousands of keys. What has it proves nothing: no key file
    /// with it can be read, and no check of a key passes.
    pub const fn stub_for_experiments() -> Self {
        Self { memory_kib: 8, passes: 1, lanes: 1 }
    }

    /// Whether a key with it can be genuine: no cheaper than the standard, and not so dear that checking it is a burden.
    pub fn is_acceptable(&self) -> bool {
        let Self { memory_kib, passes, lanes } = *self;
        (Self::STANDARD.memory_kib..=MOST_MEMORY_KIB).contains(&memory_kib)
            && (Self::STANDARD.passes..=MOST_PASSES).contains(&passes)
            && lanes == 1
    }

    /// seed = Argon2id(password: `digest`, salt: the tag), 32 bytes, version 0x13.
    pub(crate) fn seed(&self, digest: &[u8; 32]) -> [u8; 32] {
        let Self { memory_kib, passes, lanes } = *self;
        let mut seed = [0; 32];
        let costs = Params::new(memory_kib, passes, lanes, Some(seed.len()));
        costs
            .and_then(|costs| {
                let argon2 = Argon2::new(Algorithm::Argon2id, Version::V0x13, costs);
                argon2.hash_password_into(digest, TAG, &mut seed)
            })
            .expect("costs that are made here or were accepted are within the algorithm's");
        seed
    }
}

impl Default for Derivation {
    fn default() -> Self {
        Self::STANDARD
    }
}

impl fmt::Display for Derivation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { memory_kib, passes, lanes } = self;
        write!(f, "{ALGORITHM} {memory_kib} {passes} {lanes}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_standard_and_somewhat_dearer_ones_are_accepted() {
        let standard = Derivation::STANDARD;
        assert!(standard.is_acceptable());
        assert!(Derivation { passes: 15, memory_kib: 1 << 18, ..standard }.is_acceptable());
        for refused in [
            Derivation::stub_for_experiments(),
            Derivation { memory_kib: (1 << 16) - 1, ..standard },
            Derivation { memory_kib: (1 << 18) + 1, ..standard },
            Derivation { passes: 2, ..standard },
            Derivation { passes: 16, ..standard },
            Derivation { lanes: 0, ..standard },
            Derivation { lanes: 2, ..standard },
        ] {
            assert!(!refused.is_acceptable(), "{refused}");
        }
    }

    /// By another implementation (argon2-cffi): password of 32 bytes 1, the tag as salt.
    #[test]
    fn the_seed_is_that_of_argon2id() {
        let expected = "a217168d63bfc42403213012ddd33eec43f9d3fa85290d348938a6a5f232e329";
        assert_eq!(hex::encode(Derivation::STANDARD.seed(&[1; 32])), expected);
    }

    #[test]
    fn the_cost_changes_the_seed() {
        let stub = Derivation::stub_for_experiments();
        let dearer = Derivation { passes: 2, ..stub };
        assert_eq!(stub.seed(&[1; 32]), stub.seed(&[1; 32]));
        assert_ne!(stub.seed(&[1; 32]), dearer.seed(&[1; 32]));
        assert_ne!(stub.seed(&[1; 32]), stub.seed(&[2; 32]));
    }
}
