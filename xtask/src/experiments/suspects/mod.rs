//! `cargo xtask suspects`: suspects as they come, whole runs of the program: copies that were mirrored, scanned or printed, kits
//! whose parts were laid elsewhere, and what shows something else; what is found, and what an answer costs.

mod copies;
mod kits;
mod others;
mod owner;

use owner::Answer;
use serde::Serialize;
use sombrero::stats::median;
use sombrero::watermark::Preset;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What to measure.
#[derive(clap::Args)]
pub(crate) struct Suspects {
    /// Secrets for each original and preset.
    #[arg(long, default_value_t = 3)]
    runs: u64,
    /// Kinds of suspects, separated by commas: copies, kits, others.
    #[arg(long, value_delimiter = ',', default_value = "copies,kits,others")]
    kinds: Vec<String>,
    /// Presets, separated by commas.
    #[arg(long, value_delimiter = ',', default_value = "faithful,robust")]
    presets: Vec<String>,
    /// Originals whose names contain one of these, separated by commas. Default: all.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Where `suspects.md` and `suspects.json` are written.
    #[arg(long, default_value = "docs/suspects")]
    out: PathBuf,
}

impl Suspects {
    fn asks_for(&self, name: &str) -> bool {
        self.only.is_empty() || self.only.iter().any(|only| name.contains(only.as_str()))
    }
}

/// What became of one suspect, for each secret.
#[derive(Serialize)]
struct Line {
    kind: &'static str,
    original: String,
    preset: &'static str,
    suspect: String,
    answers: Vec<Answer>,
}

pub(crate) fn run(args: &Suspects, folder: &Path) -> anyhow::Result<()> {
    let presets = Preset::ALL.into_iter().filter(|preset| args.presets.iter().any(|p| p == preset.name()));
    let mut lines = Vec::new();
    for preset in presets {
        for kind in &args.kinds {
            lines.extend(match kind.as_str() {
                "copies" => copies::lines(args, folder, preset)?,
                "kits" => kits::lines(args, preset)?,
                "others" => others::lines(args, folder, preset)?,
                other => anyhow::bail!("no kind of suspects is called {other}: copies, kits, others"),
            });
        }
    }
    std::fs::create_dir_all(&args.out)?;
    std::fs::write(args.out.join("suspects.md"), markdown(args.runs, &lines))?;
    Ok(std::fs::write(args.out.join("suspects.json"), serde_json::to_string_pretty(&lines)? + "\n")?)
}

impl Line {
    /// Of a suspect that nobody has looked at yet.
    fn new(kind: &'static str, original: &str, preset: Preset, suspect: &str) -> Self {
        let (original, suspect) = (original.to_owned(), suspect.to_owned());
        Self { kind, original, preset: preset.name(), suspect, answers: Vec::new() }
    }

    /// Says how far the experiment is.
    fn print(self) -> Self {
        println!("{}", self.row());
        self
    }

    fn middle(&self, figure: impl Fn(&Answer) -> f64) -> f64 {
        median(&self.answers.iter().map(figure).collect::<Vec<_>>()).unwrap_or(f64::NAN)
    }

    fn most(&self, figure: impl Fn(&Answer) -> f64) -> f64 {
        self.answers.iter().map(figure).fold(f64::NEG_INFINITY, f64::max)
    }

    fn row(&self) -> String {
        format!(
            "| {} | {} | {} | {:.1} | {:.1} | {:.1} | {:.1} | {:.0} |",
            self.original,
            self.preset,
            self.suspect,
            self.middle(|answer| answer.log10_p),
            self.most(|answer| answer.log10_p),
            self.most(|answer| answer.seconds),
            self.most(|answer| answer.cpu),
            self.most(|answer| answer.megabytes),
        )
    }
}

fn markdown(runs: u64, lines: &[Line]) -> String {
    let mut text = format!(
        "# Suspects as they come\n\nWritten by `cargo xtask suspects`; {runs} secrets for each original and preset. Nothing is told \
         to the program about what was done. log10 p is the median and the worst, seconds (on the clock, then of all threads) \
         and memory are the most; whole runs of `detect`. Memory is not told below what the experiment itself holds, some \
         370 MB.\n"
    );
    let mut kind = "";
    for line in lines {
        if line.kind != kind {
            kind = line.kind;
            let _ = writeln!(
                text,
                "\n## {kind}\n\n| original | preset | suspect | log10 p | worst | s | CPU s | MB |\n|---|---|---|{}",
                "---:|".repeat(5)
            );
        }
        let _ = writeln!(text, "{}", line.row());
    }
    text
}
