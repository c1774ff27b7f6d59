//! What stands for an original in keys and reports: one digest of all its files.
//!
//! One file: its SHA-256, as every tool prints it. Several files (a glTF and its buffers): SHA-256 of the SHA-256 of
//! a text with one line a file, in the order in which the model names them,
//!
//! ```text
//! sombrero original 2
//! SHA-256 LENGTH "NAME"
//! ```
//!
//! NAME as JSON writes it and as the model refers to the file, empty for the first, which is the model itself. So where
//! one file ends and the next begins is bound, which decides the geometry. The second SHA-256 is of 32 bytes, and no file
//! of 32 bytes is a mesh that carries a mark: the two constructions cannot be taken for each other.

use sha2::{Digest, Sha256};
use std::fmt;
use std::fmt::Write;

/// What keys take from the files of an original: computed once, for any number of copies.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct OriginalDigest([u8; 32]);

impl OriginalDigest {
    /// Hashes all files of an original, each with the name by which the model refers to it. The first is the model's own,
    /// with an empty name.
    pub fn of<N: AsRef<str>, B: AsRef<[u8]>>(parts: impl IntoIterator<Item = (N, B)>) -> Self {
        let hashed = |(name, bytes): (N, B)| {
            let bytes = bytes.as_ref();
            (name.as_ref().to_owned(), bytes.len(), <[u8; 32]>::from(Sha256::digest(bytes)))
        };
        let parts: Vec<_> = parts.into_iter().map(hashed).collect();
        if let [(name, _, sha256)] = parts.as_slice()
            && name.is_empty()
        {
            return Self(*sha256);
        }
        let mut manifest = String::from("sombrero original 2\n");
        for (name, length, sha256) in parts {
            let name = serde_json::Value::from(name);
            writeln!(manifest, "{} {length} {name}", hex::encode(sha256))
                .expect("text can be written to a string");
        }
        Self(Sha256::digest(Sha256::digest(manifest)).into())
    }

    /// The digest of an original that is one file.
    pub fn of_file(bytes: &[u8]) -> Self {
        Self::of([("", bytes)])
    }

    /// As keys and reports have it.
    pub fn sha256(&self) -> [u8; 32] {
        self.0
    }
}

impl fmt::Debug for OriginalDigest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "OriginalDigest({})", hex::encode(self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn digest(parts: &[(&str, &str)]) -> [u8; 32] {
        OriginalDigest::of(parts.iter().copied()).sha256()
    }

    #[test]
    fn a_single_file_has_the_hash_that_every_tool_prints() {
        let printed = "3b9c358f36f0a31b6ad3e14f309c7cf198ac9246e8316f9ce543d5b19ac02b80";
        assert_eq!(hex::encode(OriginalDigest::of_file(b"file").sha256()), printed);
    }

    /// By `printf … | openssl dgst -sha256 -binary | openssl dgst -sha256`.
    #[test]
    fn the_digest_of_several_files_is_pinned() {
        let manifest = "sombrero original 2\n\
            9372c470eeadd5ecd9c3c74c2b3cb633f8e2f2fad799250a0f70d652b6b825e4 5 \"\"\n\
            e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855 0 \"a\\\"b\"\n";
        let twice: [u8; 32] = Sha256::digest(Sha256::digest(manifest)).into();
        assert_eq!(digest(&[("", "model"), ("a\"b", "")]), twice);
    }

    /// The forgery of the first version: all files hashed one after another, so that the cut between them was free.
    #[test]
    fn the_same_bytes_cut_in_another_way_are_another_original() {
        let one = digest(&[("", "model"), ("a", "1234"), ("b", "5678")]);
        for other in [
            digest(&[("", "model"), ("a", "123"), ("b", "45678")]),
            digest(&[("", "model"), ("b", "1234"), ("a", "5678")]),
            digest(&[("", "model"), ("a", "5678"), ("b", "1234")]),
            digest(&[("", "model"), ("a", "12345678")]),
            digest(&[("", "model12345678")]),
            digest(&[("", "model1234"), ("b", "5678")]),
        ] {
            assert_ne!(one, other);
        }
        assert_ne!(digest(&[("", "model")]), digest(&[("model", "model")]));
    }
}
