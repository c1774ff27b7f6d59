//! `sombrero completions`.

use crate::answer::{Context, Outcome};
use crate::failure::Failure;
use crate::terminal::say;
use clap::Command;

// What is typed after `sombrero completions`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The shell.
    #[arg(value_enum)]
    shell: clap_complete::Shell,
}

pub(crate) fn run(args: &Args, program: &mut Command, context: &Context) -> Result<Outcome, Failure> {
    if context.json {
        return Err(Failure::new("usage", "completions are for a shell and not JSON; leave --json out"));
    }
    let mut script = Vec::new();
    clap_complete::generate(args.shell, program, "sombrero", &mut script);
    let script = String::from_utf8_lossy(&script);
    say(script.trim_end())
        .map_err(|e| Failure::new("write", format!("standard output: cannot be written ({e})")))?;
    Ok(Outcome::Printed(0))
}
