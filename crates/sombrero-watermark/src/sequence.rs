//! The numbers of a watermark, and what they are made from.

use rand::SeedableRng;
use rand_chacha::ChaCha20Rng;
use rand_distr::{Distribution, StandardNormal};
use sha2::{Digest, Sha256};
use std::fmt;
use thiserror::Error;

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

/// With its length in front (64 bits, little-endian), so that parts cannot run into each other.
pub(crate) fn hash_part(hash: &mut Sha256, part: &[u8]) {
    hash.update((part.len() as u64).to_le_bytes());
    hash.update(part);
}

/// The first `count` standard normal numbers that ChaCha20 draws from this seed, by the ziggurat method, rounded to
/// multiples of 2⁻⁴⁰. The rounding hides the last bits of the logarithm that numbers beyond ±3.65 come from, which may
/// differ between machines.
///
/// The watermark of a key has a seed that costs something and binds the key ([`Derivation`](crate::Derivation)); this
/// function is also for marks that are nobody's, and for experiments.
pub fn gaussians(seed: [u8; 32], count: usize) -> Vec<f64> {
    let mut rng = ChaCha20Rng::from_seed(seed);
    let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
    (0..count).map(|_| rounded(draw())).collect()
}

fn rounded(x: f64) -> f64 {
    const STEPS: f64 = (1u64 << 40) as f64;
    (x * STEPS).round() / STEPS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sequence_is_pinned() {
        assert_eq!(gaussians([7; 32], 6), GOLDEN);
        assert_eq!(gaussians([7; 32], 3), GOLDEN[..3]);
    }

    const GOLDEN: [f64; 6] = [
        -0.27496608560250024,
        -0.31666677343855554,
        -0.4583096026917701,
        1.7221808645435885,
        -1.444729331416056,
        -0.09149687948956853,
    ];

    #[test]
    fn numbers_are_standard_gaussian() {
        let n = 100_000;
        let w = gaussians([1; 32], n);
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
