//! What an owner has timestamped before publishing: one digest that binds a key and tells nothing about it.
//!
//! The statement is text, one `name value` a line. Original, texts and secret determine the watermark, `basis_sha256`
//! the directions in which it moves the surface. The digest can be shown to anybody: the secret's 256 bits hide the
//! rest. To open it one shows the statement, and with it the secret.

use crate::Key;
use sha2::{Digest, Sha256};

impl Key {
    /// The statement, which is as secret as the key. The same for the same mark in every version of this program.
    pub fn statement(&self) -> String {
        let text = |text: &str| serde_json::Value::from(text).to_string();
        let basis = self.parameters.basis;
        let lines = [
            "sombrero-commitment 1".to_owned(),
            format!("original_sha256 {}", hex::encode(self.original_sha256)),
            format!("basis_sha256 {}", hex::encode(self.basis_sha256)),
            format!("coefficients {}", basis.coefficients),
            format!("epsilon {}", self.parameters.epsilon),
            format!("basis {}", basis.function),
            format!("amplitudes {}", basis.amplitudes),
            format!("owner {}", text(&self.identity.owner)),
            format!("recipient {}", text(&self.identity.recipient)),
            format!("secret {}", self.secret.to_hex()),
        ];
        lines.join("\n") + "\n"
    }

    /// SHA-256 of [`statement`](Self::statement): what a timestamp is asked for.
    pub fn commitment(&self) -> [u8; 32] {
        Sha256::digest(self.statement()).into()
    }
}

#[cfg(test)]
mod tests {
    use crate::{Identity, Key, OriginalDigest, Parameters, Secret};

    fn key(owner: &str) -> Key {
        let identity = Identity { owner: owner.into(), recipient: "№ 7".into() };
        let file = OriginalDigest::of(b"file");
        Key::with_digest(&file, identity, Secret([9; 32]), Parameters::default(), &[1; 32])
    }

    /// Timestamps that were had for it must stay good.
    #[test]
    fn the_statement_is_pinned() {
        let expected = "sombrero-commitment 1\n\
            original_sha256 3b9c358f36f0a31b6ad3e14f309c7cf198ac9246e8316f9ce543d5b19ac02b80\n\
            basis_sha256 BASIS\n\
            coefficients 200\nepsilon 0.0088\nbasis sombrero\namplitudes root-heights\n\
            owner \"A\\nB\"\nrecipient \"№ 7\"\n\
            secret 0909090909090909090909090909090909090909090909090909090909090909\n";
        let key = key("A\nB");
        assert_eq!(key.statement(), expected.replace("BASIS", &hex::encode(key.basis_sha256)));
        assert_eq!(hex::encode(key.commitment()), GOLDEN);
    }

    const GOLDEN: &str = "f0c5de72b9b05806e26d505631c416844a19d0338b9277c249b812f57d3169d4";

    #[test]
    fn it_binds_every_part_and_no_timestamp() {
        let first = key("A");
        let mut changed = [key("B"), first.clone(), first.clone(), first.clone()];
        changed[1].secret.0[31] ^= 1;
        changed[2].parameters.epsilon *= 1.000_000_1;
        changed[3].original_sha256[0] ^= 1;
        assert!(changed.iter().all(|key| key.commitment() != first.commitment()));
        let stamped = Key { timestamp: Some(vec![1, 2, 3]), ..first.clone() };
        assert_eq!(stamped.commitment(), first.commitment());
    }
}
