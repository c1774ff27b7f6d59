//! A secret for each copy, from one that the owner keeps.
//!
//! secret = SHA-256(tag, owner's secret, SHA-256 of the original, owner, recipient), each part with its length (64 bits,
//! little-endian) in front. The key of one copy then tells nothing about the keys of the others.

use crate::original::OriginalDigest;
use crate::sequence::{Identity, Secret, hash_part};
use sha2::{Digest, Sha256};

/// Changes whenever the derivation does.
const TAG: &[u8] = b"sombrero copy 1";

/// That of digits, likewise.
const DIGITS: &[u8] = b"sombrero digits 1";

impl Secret {
    /// The secret of the copy of `original` with this identity, derived from the owner's secret `self`: the same for the
    /// same arguments, and of no use for finding `self` or the secret of another copy.
    pub fn for_copy(&self, original: &OriginalDigest, identity: &Identity) -> Self {
        let original = original.sha256();
        let Identity { owner, recipient } = identity;
        let mut hash = Sha256::new();
        for part in [TAG, &self.0, &original, owner.as_bytes(), recipient.as_bytes()] {
            hash_part(&mut hash, part);
        }
        Self(hash.finalize().into())
    }

    /// What the digits of numbers that stay are drawn from (`sombrero_io::Filling`): SHA-256 of a tag and the secret, so
    /// that they tell neither it nor the watermark.
    pub fn for_digits(&self) -> [u8; 32] {
        let mut hash = Sha256::new();
        for part in [DIGITS, &self.0] {
            hash_part(&mut hash, part);
        }
        hash.finalize().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity() -> Identity {
        Identity { owner: "Alice".into(), recipient: "Bob".into() }
    }

    /// A run that was broken off must go on with the same secrets, in any version.
    #[test]
    fn the_derivation_is_pinned() {
        let secret = Secret([7; 32]).for_copy(&OriginalDigest::of_file(b"original"), &identity());
        assert_eq!(secret.to_hex(), GOLDEN);
    }

    const GOLDEN: &str = "63ec27d9f3bcda7ec360f92a8817bd0d79de7f7bbc3c6e11782b13292d2a1506";

    #[test]
    fn every_part_changes_the_secret() {
        let file = OriginalDigest::of_file(b"original");
        let one = Secret([7; 32]).for_copy(&file, &identity());
        // The lengths in front keep texts from running into each other.
        let shifted = Identity { owner: "AliceB".into(), recipient: "ob".into() };
        assert_ne!(one, Secret([8; 32]).for_copy(&file, &identity()));
        assert_ne!(one, Secret([7; 32]).for_copy(&OriginalDigest::of_file(b"originaL"), &identity()));
        assert_ne!(one, Secret([7; 32]).for_copy(&file, &shifted));
    }
}
