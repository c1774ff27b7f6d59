//! What the project's own people run: `cargo xtask VERB`. A file for each verb.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for the terminal")]

mod ci;
mod models;
mod tables;

use clap::{Parser, Subcommand};
use std::path::PathBuf;

#[derive(Parser)]
#[command(about, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,

    /// The folder of the paper's models. Default: the environment variable SOMBRERO_MODELS, else `models`.
    #[arg(long, global = true, value_name = "DIR")]
    models: Option<PathBuf>,
}

#[derive(Subcommand)]
enum Verb {
    /// What CI runs: formatting, lints, tests, documentation, the main command, the recorded tables.
    Ci,
    /// Fetch the paper's models, or check those that are there.
    Models(models::Models),
    /// Recompute Tables 1, 2 and 3.
    Tables(tables::Tables),
}

fn main() -> anyhow::Result<()> {
    let cli = Cli::parse();
    let folder = cli
        .models
        .or_else(|| std::env::var_os("SOMBRERO_MODELS").map(PathBuf::from))
        .unwrap_or_else(|| PathBuf::from("models"));
    match cli.verb {
        Verb::Ci => ci::run(&folder),
        Verb::Models(args) => models::run(&args, &folder),
        Verb::Tables(args) => tables::run(&args, &folder),
    }
}
