//! `cargo xtask forgery`: what a dishonest claimant gets for his tries.
//!
//! He claims a mesh that carries no mark of his, and chooses the original, the key and the options after he has seen it
//! (Craver et al. 1998). Three questions: what tries bring (grinding), what they cost (Argon2id), and whether anything but
//! tries brings more (the game). The first and the last take keys whose derivation costs nothing.

mod game;
mod grinding;
mod price;

use clap::Args;
use serde::Serialize;
use sombrero::stats::wilson_interval;
use std::fmt::Write;
use std::path::PathBuf;

/// How much to try.
#[derive(Args)]
pub(crate) struct Forgery {
    /// Secrets that are tried against one suspect.
    #[arg(long, default_value_t = 10_000_000)]
    grinding: u64,
    /// Derivations that are timed.
    #[arg(long, default_value_t = 20)]
    derivations: u32,
    /// Pairs of an original and a suspect in the claimant's game.
    #[arg(long, default_value_t = 200)]
    games: u64,
    /// Keys for each of them.
    #[arg(long, default_value_t = 500)]
    keys: usize,
    /// Suspects that one key can be held against.
    #[arg(long, default_value_t = 200)]
    suspects: u64,
    /// Where `forgery.md` and `forgery.json` are written.
    #[arg(long, default_value = "docs/evidence")]
    out: PathBuf,
}

const SEED: u64 = 2026;

/// How many tries were at most 10^-k.
#[derive(Serialize)]
struct Rate {
    k: i32,
    expected: f64,
    count: u64,
    /// Whether so many are no more than chance allows (99.9 %, Wilson) where each is at most 10^-k probable.
    holds: bool,
}

impl Rate {
    /// The rates of 10^-1 and on, given how many reached each.
    fn all(counts: &[u64], tries: u64) -> Vec<Self> {
        let rate = |(k, &count): (i32, &u64)| {
            let theory = 10f64.powi(-k);
            let interval = wilson_interval(count as usize, tries as usize, 0.999);
            let holds = interval.is_none_or(|interval| interval.low <= theory);
            Self { k, expected: tries as f64 * theory, count, holds }
        };
        (1..).zip(counts).map(rate).collect()
    }
}

#[derive(Serialize)]
struct Report {
    seed: u64,
    grinding: grinding::Grinding,
    price: price::Price,
    game: game::Game,
    choice: game::Choice,
}

pub(crate) fn run(args: &Forgery) -> anyhow::Result<()> {
    let report = Report {
        seed: SEED,
        price: price::Price::measure(args.derivations)?,
        grinding: grinding::Grinding::run(args.grinding)?,
        game: game::Game::run(args.games, args.keys)?,
        choice: game::Choice::run(args.suspects, 2 * args.keys)?,
    };
    let text = markdown(&report);
    println!("{text}");
    std::fs::create_dir_all(&args.out)?;
    std::fs::write(args.out.join("forgery.md"), text)?;
    let json = serde_json::to_string_pretty(&report)? + "\n";
    std::fs::write(args.out.join("forgery.json"), json)?;
    let broken = report.game.rates.iter().filter(|rate| !rate.holds).count()
        + report.grinding.tests.iter().flat_map(|test| &test.rates).filter(|rate| !rate.holds).count();
    anyhow::ensure!(broken == 0, "{broken} rates are higher than the probabilities that were told");
    Ok(())
}

fn markdown(report: &Report) -> String {
    let mut out = String::from(
        "# What a forger gets for his tries\n\nWritten by `cargo xtask forgery`; what follows from it stands in \
         [evidence.md](../evidence.md).\n\n",
    );
    report.grinding.write(&mut out);
    report.price.write(&mut out);
    report.game.write(&mut out);
    report.choice.write(&mut out);
    out
}

fn line(out: &mut String, text: std::fmt::Arguments<'_>) {
    writeln!(out, "{text}").expect("text can be written to a string");
}
