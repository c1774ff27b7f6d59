//! The program as its users get it, and what a run of it takes.

use anyhow::{Context, bail};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Instant;
use wait4::Wait4;

/// The binary `sombrero`, in release mode.
pub(crate) struct Program(PathBuf);

/// What a run took, from start to end.
pub(crate) struct Used {
    pub(crate) seconds: f64,
    /// Seconds of all threads, user and system.
    pub(crate) cpu: f64,
    /// Peak of the memory in use.
    pub(crate) megabytes: f64,
    /// What it printed: its answer as JSON, and of several inputs the summary.
    pub(crate) answer: serde_json::Value,
}

impl Program {
    pub(crate) fn build() -> anyhow::Result<Self> {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let arguments = ["build", "--release", "--quiet", "--package", "sombrero-cli"];
        if !Command::new(cargo).args(arguments).status()?.success() {
            bail!("the program does not build");
        }
        let name = format!("sombrero{}", std::env::consts::EXE_SUFFIX);
        Ok(Self(std::env::current_exe()?.with_file_name(name)))
    }

    /// Runs it with `--json`. Anything but success is an error.
    pub(crate) fn run(&self, arguments: &[&str]) -> anyhow::Result<Used> {
        let (used, found) = self.ask(arguments)?;
        if !found {
            bail!("sombrero {} ended with 1: {}", arguments.join(" "), used.answer);
        }
        Ok(used)
    }

    /// Runs it with `--json`, and says whether something was found (status 0) or not (status 1).
    pub(crate) fn ask(&self, arguments: &[&str]) -> anyhow::Result<(Used, bool)> {
        let start = Instant::now();
        let mut command = Command::new(&self.0);
        command.args(arguments).arg("--json").stdout(Stdio::piped()).stderr(Stdio::inherit());
        let mut child = command.spawn().with_context(|| self.0.display().to_string())?;
        let answer = std::io::read_to_string(child.stdout.take().context("no answer")?)?;
        let done = child.wait4()?;
        let seconds = start.elapsed().as_secs_f64();
        if !matches!(done.status.code(), Some(0 | 1)) {
            bail!("sombrero {} ended with {:?}: {answer}", arguments.join(" "), done.status.code());
        }
        let rusage = done.rusage;
        let used = Used {
            seconds,
            cpu: (rusage.utime + rusage.stime).as_secs_f64(),
            megabytes: rusage.maxrss as f64 / 1e6,
            answer: serde_json::from_str(answer.lines().last().unwrap_or_default())?,
        };
        Ok((used, done.status.success()))
    }
}
