//! What an owner has timestamped before publishing: one digest that binds a key and tells nothing about it.
//!
//! The statement is text, one `name value` a line: all that the watermark is bound to, and thereby all that decides the
//! mark. The digest can be shown to anybody: the secret's 256 bits hide the rest. To open it one shows the statement,
//! and with it the secret.

use crate::key::Key;
use sha2::{Digest, Sha256};

impl Key {
    /// The statement, which is as secret as the key. The same for the same mark in every version of this program.
    pub fn statement(&self) -> String {
        let line = |(name, value): (&str, String)| match name {
            // Whatever they hold, they stay on their line.
            "owner" | "recipient" => format!("{name} {}\n", serde_json::Value::from(value)),
            _ => format!("{name} {value}\n"),
        };
        let lines: String = self.bound().into_iter().map(line).collect();
        format!("sombrero-commitment 2\n{lines}")
    }

    /// SHA-256 of [`statement`](Self::statement).
    pub fn commitment(&self) -> [u8; 32] {
        Sha256::digest(self.statement()).into()
    }

    /// What a timestamp is asked for: the commitment, or the root of the tree in which it has a place.
    pub fn stamped(&self) -> [u8; 32] {
        let commitment = self.commitment();
        self.path.as_ref().map_or(commitment, |path| path.root(&commitment))
    }
}

#[cfg(test)]
mod tests {
    use crate::{Derivation, Identity, Key, OriginalDigest, Preset, Secret, hash_tree};

    fn key(owner: &str) -> Key {
        let identity = Identity { owner: owner.into(), recipient: "№ 7".into() };
        let file = OriginalDigest::of_file(b"file");
        let stub = Derivation::stub_for_experiments();
        let key = Key::new(&file, identity, Secret([9; 32]), Preset::Robust.parameters(), &[1; 32], stub);
        Key { derivation: Derivation::STANDARD, ..key }
    }

    /// Timestamps that were had for it must stay good.
    #[test]
    fn the_statement_is_pinned() {
        let expected = "sombrero-commitment 2\n\
            original_sha256 3b9c358f36f0a31b6ad3e14f309c7cf198ac9246e8316f9ce543d5b19ac02b80\n\
            basis_sha256 0101010101010101010101010101010101010101010101010101010101010101\n\
            preset robust\ncoefficients 200\nepsilon 0.0088\nbasis sombrero\namplitudes root-heights\n\
            derivation argon2id 65536 3 1\n\
            owner \"A\\nB\"\nrecipient \"№ 7\"\n\
            secret 0909090909090909090909090909090909090909090909090909090909090909\n";
        let key = key("A\nB");
        assert_eq!(key.statement(), expected);
        assert_eq!(hex::encode(key.commitment()), GOLDEN);
    }

    const GOLDEN: &str = "b13639a2e6d37f6a069bc61df1e6cc6f441d16fa423225ed45648b96b4387b42";

    #[test]
    fn it_binds_every_part_and_no_timestamp() {
        let first = key("A");
        let mut changed = [key("B"), first.clone(), first.clone(), first.clone(), first.clone()];
        changed[1].secret.0[31] ^= 1;
        changed[2].parameters.epsilon *= 1.000_000_1;
        changed[3].original_sha256[0] ^= 1;
        changed[4].parameters.preset = None;
        assert!(changed.iter().all(|key| key.commitment() != first.commitment()));
        let stamped = Key { timestamp: Some(vec![1, 2, 3]), ..first.clone() };
        assert_eq!(stamped.commitment(), first.commitment());
        assert_eq!(first.stamped(), first.commitment());
    }

    #[test]
    fn in_a_tree_its_root_is_stamped() {
        let keys = ["A", "B", "C"].map(key);
        let (root, paths) = hash_tree(&keys.clone().map(|key| key.commitment()));
        for (key, path) in keys.into_iter().zip(paths) {
            let placed = Key { path: Some(path), ..key };
            assert_eq!(placed.stamped(), root);
            let mut edited = placed;
            edited.identity.recipient.push('!');
            assert_ne!(edited.stamped(), root);
        }
    }
}
