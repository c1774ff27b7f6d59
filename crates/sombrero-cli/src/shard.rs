//! One machine's share of many files: which files those are depends on their names alone, so that nothing has to be agreed on.
//!
//! Of N machines, number h mod N + 1 takes a file, where h is the first eight bytes, big-endian, of the SHA-256 of the name
//! that the file has below the folder that was given.

use crate::batch::Inputs;
use sha2::{Digest, Sha256};
use std::path::Path;
use std::str::FromStr;

// The option of commands that look at many files. Not `///`: clap would take it for the command's help.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(crate) struct ShardArgs {
    /// Look only at the share I of N of the files: each file is in one share, whatever else is given. Names decide, so N machines
    /// that see the same folder need not know of each other.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
}

impl ShardArgs {
    /// Those of one machine's share, which is never the whole answer; all without one.
    pub(crate) fn of(self, inputs: Inputs) -> Inputs {
        let Some(shard) = self.shard else { return inputs };
        let files = inputs.files.into_iter().filter(|file| shard.has(&file.name)).collect();
        Inputs { files, one: false }
    }
}

/// The share of one of several machines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Shard {
    /// From 0.
    number: u64,
    count: u64,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((number, count)) if (1..=count).contains(&number) => Ok(Self { number: number - 1, count }),
            _ => Err(format!("`{text}` is no share: give I/N with I from 1 to N, such as 2/8")),
        }
    }
}

impl Shard {
    fn has(self, name: &Path) -> bool {
        let name: Vec<_> = name.iter().map(|part| part.to_string_lossy()).collect();
        let hash = Sha256::digest(name.join("/"));
        let first = hash.iter().take(8).fold(0, |sum, byte| sum << 8 | u64::from(*byte));
        first % self.count == self.number
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn each_file_is_in_one_share(names in proptest::collection::vec("[a-z]{1,5}(/[a-z]{1,5})?", 0..20), count in 1u64..9) {
            let shares = (1..=count).map(|i| format!("{i}/{count}").parse::<Shard>().unwrap());
            let shares: Vec<Shard> = shares.collect();
            for name in &names {
                prop_assert_eq!(shares.iter().filter(|share| share.has(Path::new(name))).count(), 1);
            }
        }
    }

    #[test]
    fn shares_are_the_same_on_every_machine() {
        let names = ["a.obj", "b.obj", "c.obj", "below/a.obj", "below/ü.ply"];
        let second: Shard = "2/3".parse().unwrap();
        assert_eq!(names.map(|name| second.has(Path::new(name))), [false, false, true, false, true]);
    }

    #[test]
    fn what_is_no_share_is_refused() {
        for wrong in ["", "3", "0/3", "4/3", "1/0", "-1/3", "a/b", "1/3/2", "1.5/3"] {
            assert!(wrong.parse::<Shard>().unwrap_err().contains("2/8"), "{wrong}");
        }
        assert_eq!("1/1".parse(), Ok(Shard { number: 0, count: 1 }));
    }
}
