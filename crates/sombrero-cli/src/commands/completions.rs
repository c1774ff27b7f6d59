//! `sombrero completions`.

use crate::args::{Cli, Completions};
use crate::failure::Failure;
use crate::{Context, Outcome, say};
use clap::CommandFactory;

pub(crate) fn run(args: &Completions, context: &Context) -> Result<Outcome, Failure> {
    if context.json {
        return Err(Failure::new("usage", "completions are for a shell and not JSON; leave --json out"));
    }
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "sombrero", &mut script);
    let script = String::from_utf8_lossy(&script);
    say(script.trim_end())
        .map_err(|e| Failure::new("write", format!("standard output: cannot be written ({e})")))?;
    Ok(Outcome::Printed(0))
}
