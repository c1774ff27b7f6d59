//! Finished trials on disk, so that an interrupted run goes on where it stopped.
//!
//! One line of JSON a trial, in a file named after the hash of this very program: other code starts anew.

use super::trial::Trial;
use anyhow::Context;
use sha2::{Digest, Sha256};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;

pub(crate) struct Journal {
    done: Vec<Trial>,
    file: Mutex<File>,
}

impl Journal {
    pub(crate) fn open() -> anyhow::Result<Self> {
        let program = std::fs::read(std::env::current_exe()?)?;
        let folder = Path::new("target").join("tables");
        std::fs::create_dir_all(&folder)?;
        let name = &hex::encode(Sha256::digest(&program))[..16];
        let path = folder.join(format!("trials-{name}.jsonl"));
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        // A line that the interruption cut off is no trial.
        let done = text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        let file = OpenOptions::new().create(true).append(true).open(&path);
        let mut file = file.with_context(|| format!("{} cannot be written", path.display()))?;
        if !text.is_empty() && !text.ends_with('\n') {
            writeln!(file)?;
        }
        Ok(Self { done, file: Mutex::new(file) })
    }

    pub(crate) fn find(
        &self,
        method: &str,
        model: &str,
        basis: &str,
        row: &str,
        seed: u64,
    ) -> Option<&Trial> {
        let same = |t: &&Trial| t.method == method && t.model == model && t.basis == basis;
        self.done.iter().filter(same).find(|t| t.row == row && t.seed == seed)
    }

    pub(crate) fn add(&self, trial: &Trial) -> anyhow::Result<()> {
        let line = serde_json::to_string(trial)? + "\n";
        let mut file = self.file.lock().map_err(|_| anyhow::anyhow!("another trial failed"))?;
        Ok(file.write_all(line.as_bytes())?)
    }
}
