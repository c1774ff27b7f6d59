//! Arguments that several commands share, and how they are read.

use clap::{Args, ValueEnum};
use sombrero::DetectOptions;

// The steps of looking for a mark, and when it counts as found. Not `///`: clap would take it for the command's help.
#[derive(Debug, Args)]
pub(crate) struct Steps {
    /// Align the suspect to the original first (similarity: turned, moved, scaled).
    #[arg(long, value_enum, default_value_t = When::Auto)]
    registration: When,
    /// Resample the suspect to the original's connectivity; with --method robust, compare surfaces instead of vertices.
    #[arg(long, value_enum, default_value_t = When::Auto)]
    resampling: When,
    /// The mark counts as found when the probability of a chance match is at most this.
    #[arg(long, value_name = "P", default_value_t = 1e-6, allow_negative_numbers = true, value_parser = finite)]
    threshold: f64,
    /// CPU seconds after which the search ends with what it has; with --method robust.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = seconds)]
    budget: f64,
}

impl Steps {
    /// The options that were asked for; method and seed are the usual ones.
    pub(crate) fn options(&self) -> DetectOptions {
        DetectOptions {
            registration: self.registration.into(),
            resampling: self.resampling.into(),
            threshold: self.threshold,
            budget: Some(self.budget),
            ..DetectOptions::default()
        }
    }
}

/// When a step is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum When {
    /// As the suspect asks for; the paper's method tries with and without, and the better one counts.
    Auto,
    /// Only with it.
    Always,
    /// Only without it.
    Never,
}

impl From<When> for sombrero::When {
    fn from(step: When) -> Self {
        match step {
            When::Auto => Self::Auto,
            When::Always => Self::Always,
            When::Never => Self::Never,
        }
    }
}

/// A number that one can compute with.
pub(crate) fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| x.is_finite());
    number.ok_or_else(|| format!("`{text}` is not a number to compute with"))
}

/// A number of seconds, none of them negative.
fn seconds(text: &str) -> Result<f64, String> {
    let number = finite(text).ok().filter(|seconds| *seconds >= 0.0);
    number.ok_or_else(|| format!("`{text}` is not a number of seconds"))
}

/// A number of bytes: digits, and K, M or G for powers of 1024.
pub(crate) fn bytes(text: &str) -> Result<u64, String> {
    let upper = text.to_ascii_uppercase();
    let digits = upper.trim_end_matches(['K', 'M', 'G']);
    let unit = match &upper[digits.len()..] {
        "" => Some(1),
        "K" => Some(1 << 10),
        "M" => Some(1 << 20),
        "G" => Some(1 << 30),
        _ => None,
    };
    let size = digits.parse::<u64>().ok().zip(unit).and_then(|(n, unit)| n.checked_mul(unit));
    size.ok_or_else(|| format!("`{text}` is not a size; write bytes, or a number with K, M or G"))
}
