//! What the project's own people run: `cargo xtask VERB`, a file for each verb: upkeep of the repository, and the
//! experiments that the documents rest on.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for the terminal")]

mod experiments;
mod upkeep;

use clap::{Parser, Subcommand};
use experiments::{
    alignment, benchmark, calibrate, catalogue, collusion, figures, forgery, ordeal, peers, presets,
    readings, removal, roc, scaling, suspects, tables, visibility,
};
use std::path::PathBuf;
use upkeep::{ci, dist, hostile, models, package, tidy};

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
    /// Measure how often suspects are aligned without a hint, and how often the verdict is right.
    Alignment(alignment::Alignment),
    /// Run the published benchmark protocol for mesh watermarking (Wang et al. 2010).
    Benchmark(benchmark::Benchmark),
    /// Compare the false-positive rate that detection promises with the one that it has.
    Calibrate(calibrate::Calibrate),
    /// Build a catalogue of many models, attack them, and see how often the right one is found.
    Catalogue(catalogue::CatalogueArgs),
    /// Time our stages beside other libraries, as far as these are installed, and whole jobs.
    BenchPeers(peers::Peers),
    /// What CI runs: formatting, lints, tests, documentation, the main command, the recorded tables.
    Ci,
    /// Let several of a thousand buyers average their copies, and name them.
    Collusion(collusion::Collusion),
    /// Make what is handed out: the command and the Python package for this platform, the page for browsers, checksums,
    /// licences.
    Dist(dist::Dist),
    /// Redraw Figures 1, 2, 4 and 5.
    Figures(figures::Figures),
    /// Claim what is not one's own in every way that there is, and count what it brings.
    Forgery(forgery::Forgery),
    /// Feed every reader with mutated files and see that none panics, hangs or takes much memory.
    Hostile(hostile::Hostile),
    /// Fetch the paper's models, or check those that are there.
    Models(models::Models),
    /// Say in which order the crates are published, and package them all.
    Package,
    /// Mark a thousand random originals, attack them at random, and look whether every question gets an answer.
    Ordeal(ordeal::Ordeal),
    /// Compare sets of parameters at equal distortion.
    Presets(presets::Presets),
    /// Try other readings of the paper, choice by choice, on its Tables 1 and 2.
    Readings(readings::Readings),
    /// Take marks out without the original, and see what it costs.
    Removal(removal::Removal),
    /// Recompute Figure 6, how often a mark is missed under noise.
    Roc(roc::Roc),
    /// Time every stage and weigh memory from a thousand to ten million triangles.
    Scaling(scaling::Scaling),
    /// Look at suspects as they come: mirrored, scanned, printed, kits laid elsewhere, and what shows something else.
    Suspects(suspects::Suspects),
    /// Recompute Tables 1, 2 and 3.
    Tables(tables::Tables),
    /// Check the repository's own rules.
    Tidy,
    /// Measure what is seen of each preset's marks and what they survive, and draw them beside the originals.
    Visibility(visibility::Visibility),
}

fn main() -> anyhow::Result<()> {
    let cli = Cli::parse();
    let folder = cli
        .models
        .or_else(|| std::env::var_os("SOMBRERO_MODELS").map(PathBuf::from))
        .unwrap_or_else(|| PathBuf::from("models"));
    match cli.verb {
        Verb::Alignment(args) => alignment::run(&args, &folder),
        Verb::BenchPeers(args) => peers::run(&args, &folder),
        Verb::Benchmark(args) => benchmark::run(&args, &folder),
        Verb::Calibrate(args) => calibrate::run(&args, &folder),
        Verb::Catalogue(args) => catalogue::run(&args),
        Verb::Ci => ci::run(&folder),
        Verb::Dist(args) => dist::run(&args),
        Verb::Figures(args) => figures::run(&args, &folder),
        Verb::Collusion(args) => collusion::run(&args, &folder),
        Verb::Forgery(args) => forgery::run(&args),
        Verb::Hostile(args) => hostile::run(&args),
        Verb::Models(args) => models::run(&args, &folder),
        Verb::Package => package::run(),
        Verb::Ordeal(args) => ordeal::run(&args, &folder),
        Verb::Presets(args) => presets::run(&args, &folder),
        Verb::Readings(args) => readings::run(&args, &folder),
        Verb::Removal(args) => removal::run(&args, &folder),
        Verb::Roc(args) => roc::run(&args, &folder),
        Verb::Scaling(args) => scaling::run(&args),
        Verb::Suspects(args) => suspects::run(&args, &folder),
        Verb::Tables(args) => tables::run(&args, &folder),
        Verb::Tidy => tidy::run(),
        Verb::Visibility(args) => visibility::run(&args, &folder),
    }
}
