//! `cargo xtask bench-peers`: our stages beside the libraries that people would pick instead, in one run.
//!
//! The cases are made here and written to `target/peers/cases`; the peers of `benches/peers` read them. Peers that are
//! not installed are left out. Each of our stages runs in a process of its own, as the peers do, so that nobody's
//! memory is counted as another's.

mod cases;
mod jobs;
mod measure;
mod ours;
mod score;
mod table;

use anyhow::{Context, bail};
use measure::Row;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What to measure.
#[derive(clap::Args)]
pub(crate) struct Peers {
    /// Stages, separated by commas: limit, a (simplify), b (closest points), c (registration), d (least squares),
    /// e (fitting), f (files), g (whole jobs). Default: all.
    #[arg(long, value_delimiter = ',')]
    stages: Vec<Stage>,
    /// Models, separated by commas: bunny, big. Default: both.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Measured runs of each, after one that is not counted.
    #[arg(long, default_value_t = 5)]
    repeats: usize,
    /// Where `benches/peers/setup.sh` put the peers, and where the cases go.
    #[arg(long, value_name = "DIR", default_value = "target/peers")]
    folder: PathBuf,
    /// The document whose table is replaced. All measurements go beside it as JSON.
    #[arg(long, value_name = "FILE", default_value = "docs/performance.md")]
    out: PathBuf,
    /// Measure this one stage of ours and print it; what the verb calls itself with.
    #[arg(long, hide = true)]
    ours: bool,
}

/// A part of the work that others offer too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Stage {
    Limit,
    A,
    B,
    C,
    D,
    E,
    F,
    G,
}

impl Stage {
    const ALL: [Self; 8] = [Self::Limit, Self::A, Self::B, Self::C, Self::D, Self::E, Self::F, Self::G];

    fn name(self) -> &'static str {
        ["limit", "a", "b", "c", "d", "e", "f", "g"][self as usize]
    }

    /// The script of the peers in Python.
    fn script(self) -> Option<&'static str> {
        match self {
            Self::A => Some("a_simplify.py"),
            Self::B => Some("b_closest.py"),
            Self::C => Some("c_register.py"),
            Self::D => Some("d_lsq.py"),
            Self::E => Some("e_fit.py"),
            Self::F => Some("f_io.py"),
            Self::Limit | Self::G => None,
        }
    }

    fn in_rust(self) -> bool {
        matches!(self, Self::Limit | Self::A | Self::B | Self::D | Self::F)
    }

    fn in_cpp(self) -> bool {
        matches!(self, Self::A | Self::B)
    }
}

/// The large one is the small one, subdivided twice and roughened.
const MODELS: [&str; 2] = ["bunny", "big"];

impl Peers {
    fn cases(&self) -> PathBuf {
        self.folder.join("cases")
    }

    fn models(&self) -> Vec<&str> {
        let wanted = |model: &&str| self.only.is_empty() || self.only.iter().any(|o| o == model);
        MODELS.into_iter().filter(wanted).collect()
    }
}

pub(crate) fn run(args: &Peers, models: &Path) -> anyhow::Result<()> {
    if let Some(unknown) = args.only.iter().find(|o| !MODELS.contains(&o.as_str())) {
        bail!("`{unknown}` is none of the models; known are {}", MODELS.join(", "));
    }
    let stages = if args.stages.is_empty() { Stage::ALL.to_vec() } else { args.stages.clone() };
    if args.ours {
        return one_of_ours(args, &stages);
    }
    cases::write(&args.cases(), models)?;
    let mut rows = Vec::new();
    for stage in stages {
        let of_stage = measured(args, stage)?;
        rows.extend(of_stage);
    }
    table::write(&args.out, rows)
}

/// All measurements of a stage: ours and the peers' model by model, so that they meet the same machine.
fn measured(args: &Peers, stage: Stage) -> anyhow::Result<Vec<Row>> {
    let mut rows = Vec::new();
    if stage == Stage::Limit {
        rows.extend(child(args, rust_peers(args).arg("limit"))?);
        return Ok(rows);
    }
    for model in args.models() {
        if stage == Stage::G {
            rows.extend(jobs::measure(&args.cases(), model, args.repeats)?);
            continue;
        }
        rows.extend(child(args, &mut ourselves(args, stage, model)?)?);
        if stage.in_rust() {
            rows.extend(child(args, rust_peers(args).args([stage.name(), model]))?);
        }
        if stage.in_cpp() {
            rows.extend(child(
                args,
                Command::new(args.folder.join("peers_cpp")).args([stage.name(), model]),
            )?);
        }
        if let Some(script) = stage.script() {
            let python = args.folder.join("venv/bin/python");
            rows.extend(child(
                args,
                Command::new(python).arg(Path::new("benches/peers").join(script)).arg(model),
            )?);
        }
    }
    score::fill_in(&args.cases(), &args.folder, &mut rows)?;
    Ok(rows)
}

fn rust_peers(args: &Peers) -> Command {
    Command::new(args.folder.join("release/peers"))
}

fn ourselves(args: &Peers, stage: Stage, model: &str) -> anyhow::Result<Command> {
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["bench-peers", "--ours", "--stages", stage.name(), "--only", model]);
    command.arg("--repeats").arg(args.repeats.to_string()).arg("--folder").arg(&args.folder);
    Ok(command)
}

/// Runs a program that prints a row a line. One that is not there has no rows.
fn child(args: &Peers, command: &mut Command) -> anyhow::Result<Vec<Row>> {
    let program = command.get_program().to_owned();
    if !Path::new(&program).exists() {
        eprintln!("{} is not installed: left out (see benches/peers/README.md)", program.display());
        return Ok(Vec::new());
    }
    let [cases, scratch] = ["cases", "scratch"].map(|name| args.folder.join(name));
    std::fs::create_dir_all(&scratch)?;
    command.env("CASES", cases).env("PEERS_TMP", scratch).env("REPEATS", args.repeats.to_string());
    command.env("TRIALS", cases::TRIALS.to_string()).stdout(Stdio::piped());
    let output = command.output().with_context(|| format!("running {}", program.display()))?;
    if !output.status.success() {
        eprintln!(
            "{} ended with {}: {}",
            program.display(),
            output.status,
            String::from_utf8_lossy(&output.stderr)
        );
    }
    let text = String::from_utf8_lossy(&output.stdout);
    text.lines().filter(|line| line.starts_with('{')).map(|line| Ok(serde_json::from_str(line)?)).collect()
}

fn one_of_ours(args: &Peers, stages: &[Stage]) -> anyhow::Result<()> {
    for &stage in stages {
        for model in args.models() {
            for row in ours::measure(stage, &args.cases(), model, args.repeats)? {
                println!("{}", serde_json::to_string(&row)?);
            }
        }
    }
    Ok(())
}
