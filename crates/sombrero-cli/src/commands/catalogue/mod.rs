//! `sombrero catalogue`: which originals there are, what is kept of them, and how they come back.

mod add;
mod export;
mod list;
mod remove;

use crate::answer::{Context, Outcome};
use crate::failure::Failure;
use clap::Subcommand;

// What is typed after `sombrero catalogue`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Add originals, and keep them with their keys if asked to.
    #[command(after_help = "Example: sombrero catalogue add models vase.obj more-originals\n\
        With the files themselves and their keys, encrypted: sombrero catalogue add models vase.obj --keep --keys copies/keys\n\
        What is in the catalogue already is passed over, so that a run which was broken off can be made again.\n\
        The first time that something is kept, a passphrase is chosen; adding more does not ask for it.")]
    Add(add::Args),
    /// Remove originals, and what is kept of them.
    #[command(after_help = "Example: sombrero catalogue remove models vase.obj")]
    Remove(remove::Args),
    /// List the originals.
    #[command(after_help = "Example: sombrero catalogue list models")]
    List(list::Args),
    /// Give an original back that is kept, byte for byte.
    #[command(after_help = "Example: sombrero catalogue export models vase.obj -o vase.obj\n\
        With its keys: sombrero catalogue export models vase.obj --keys vase-keys")]
    Export(export::Args),
}

pub(crate) fn run(args: &Args, context: &Context) -> Result<Outcome, Failure> {
    match &args.command {
        Command::Add(args) => add::run(args, context),
        Command::Remove(args) => remove::run(args).map(Outcome::Answer),
        Command::List(args) => list::run(args).map(Outcome::Answer),
        Command::Export(args) => export::run(args, context),
    }
}
