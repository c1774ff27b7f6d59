//! The watermark w: standard Gaussian numbers that follow from the original and a secret (the paper,
//! section 4, non-invertible as it asks).
//!
//! seed = SHA-256(tag, original file, owner, recipient, secret), each part with its length (64 bits,
//! little-endian) in front; w = the first m standard normal numbers that ChaCha20 draws from this seed, by
//! the ziggurat method, rounded to multiples of 2⁻⁴⁰. The rounding hides the last bits of the logarithm
//! that numbers beyond ±3.65 come from, which may differ between machines.

use rand::SeedableRng;
use rand_chacha::ChaCha20Rng;
use rand_distr::{Distribution, StandardNormal};
use sha2::{Digest, Sha256};
use std::fmt;
use thiserror::Error;

/// Changes whenever the sequence does.
const TAG: &[u8] = b"sombrero watermark 1";

/// 256 secret bits. Never shown by `Debug`.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Secret(pub [u8; 32]);

/// Text that is not 64 hexadecimal digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("a secret is 64 hexadecimal digits; this one has another length or other characters")]
pub struct SecretError;

impl Secret {
    /// Reads 64 hexadecimal digits; white space around them is passed over.
    ///
    /// # Errors
    /// [`SecretError`] for anything else.
    pub fn from_hex(text: &str) -> Result<Self, SecretError> {
        let mut bytes = [0; 32];
        hex::decode_to_slice(text.trim(), &mut bytes).map_err(|_| SecretError)?;
        Ok(Self(bytes))
    }

    /// 64 lower-case hexadecimal digits.
    pub fn to_hex(&self) -> String {
        hex::encode(self.0)
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(..)")
    }
}

/// Whose mark it is and which copy.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Identity {
    /// The owner's text, for instance name and year.
    pub owner: String,
    /// The recipient's text, for instance an order number; empty when all copies carry the same mark.
    pub recipient: String,
}

/// What watermarks and keys take from the bytes of an original: read once, for any number of copies.
#[derive(Clone)]
pub struct OriginalDigest {
    sha256: [u8; 32],
    /// Tag and original are hashed; texts and secret are to come.
    seed: Sha256,
}

impl OriginalDigest {
    /// Hashes the original file.
    pub fn of(original: &[u8]) -> Self {
        let mut seed = Sha256::new();
        hash_part(&mut seed, TAG);
        hash_part(&mut seed, original);
        Self { sha256: Sha256::digest(original).into(), seed }
    }

    /// SHA-256 of the original file.
    pub fn sha256(&self) -> [u8; 32] {
        self.sha256
    }

    /// The first `coefficients` numbers of the watermark that belongs to the original, these texts and this secret.
    pub fn watermark(&self, identity: &Identity, secret: &Secret, coefficients: usize) -> Vec<f64> {
        let mut seed = self.seed.clone();
        for part in [identity.owner.as_bytes(), identity.recipient.as_bytes(), &secret.0] {
            hash_part(&mut seed, part);
        }
        let mut rng = ChaCha20Rng::from_seed(seed.finalize().into());
        let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
        (0..coefficients).map(|_| rounded(draw())).collect()
    }
}

impl fmt::Debug for OriginalDigest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "OriginalDigest({})", hex::encode(self.sha256))
    }
}

pub(crate) fn hash_part(hash: &mut Sha256, part: &[u8]) {
    hash.update((part.len() as u64).to_le_bytes());
    hash.update(part);
}

/// [`OriginalDigest::watermark`] for those who need a single one.
pub fn watermark(original: &[u8], identity: &Identity, secret: &Secret, coefficients: usize) -> Vec<f64> {
    OriginalDigest::of(original).watermark(identity, secret, coefficients)
}

fn rounded(x: f64) -> f64 {
    const STEPS: f64 = (1u64 << 40) as f64;
    (x * STEPS).round() / STEPS
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity() -> Identity {
        Identity { owner: "Alice".into(), recipient: "Bob".into() }
    }

    #[test]
    fn the_sequence_is_pinned() {
        let w = watermark(b"original", &identity(), &Secret([7; 32]), 6);
        assert_eq!(w, GOLDEN);
        assert_eq!(watermark(b"original", &identity(), &Secret([7; 32]), 3), GOLDEN[..3]);
    }

    const GOLDEN: [f64; 6] = [
        0.13786004921712447,
        -1.532928155488662,
        -1.0106790011195699,
        1.0377376846709012,
        -1.5167794995850272,
        -0.6870750261159628,
    ];

    #[test]
    fn every_part_changes_the_sequence() {
        let secret = Secret([7; 32]);
        let one = watermark(b"original", &identity(), &secret, 4);
        // The lengths in front keep texts from running into each other.
        let shifted = Identity { owner: "AliceB".into(), recipient: "ob".into() };
        let mut other_secret = secret;
        other_secret.0[31] ^= 1;
        for other in [
            watermark(b"originaL", &identity(), &secret, 4),
            watermark(b"original", &shifted, &secret, 4),
            watermark(b"original", &identity(), &other_secret, 4),
        ] {
            assert!(one.iter().zip(&other).all(|(a, b)| a != b));
        }
    }

    #[test]
    fn numbers_are_standard_gaussian() {
        let n = 100_000;
        let w = watermark(b"", &Identity::default(), &Secret([1; 32]), n);
        let moment = |k: i32| w.iter().map(|x| x.powi(k)).sum::<f64>() / n as f64;
        // Standard errors of the first four moments: sqrt(1, 2, 15, 96) / sqrt(n).
        for (k, expected, error) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0)] {
            let deviation = (moment(k) - expected).abs();
            assert!(deviation < 4.0 * (error / n as f64).sqrt(), "moment {k} is off by {deviation}");
        }
    }

    #[test]
    fn secrets_are_read_and_never_shown() {
        let secret = Secret([0xab; 32]);
        assert_eq!(Secret::from_hex(&format!(" {}\n", secret.to_hex())), Ok(secret));
        assert_eq!(Secret::from_hex("abc"), Err(SecretError));
        assert_eq!(Secret::from_hex(&"g".repeat(64)), Err(SecretError));
        assert!(!format!("{secret:?}").contains("ab"));
    }
}
