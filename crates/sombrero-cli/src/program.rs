//! The command as a program calls it: arguments in, JSON out, files in memory where that suits better. Nothing is printed,
//! and no threads are chosen: it works on those of the pool that it is called from.

use crate::answer::{Context, Outcome};
use crate::cli::{Cli, Command};
use crate::commands::detect::Job;
use crate::desk::Desk;
use crate::failure::Failure;
use crate::progress::Verbosity;
use crate::{work, wrong_usage};
use serde_json::Value;
use std::ffi::OsString;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// The answers of the command to these arguments, without its name: what it prints with `--json`, one or more. Commands that
/// write to standard output (`completions`, `demo`) still do.
///
/// # Errors
/// [`Failure`] as the command has it. Of several inputs each has an answer of its own, which may hold an `error`.
pub fn answers(arguments: impl IntoIterator<Item = OsString>, desk: &Desk) -> Result<Vec<Value>, Failure> {
    let cli = parse(arguments)?;
    let collected = Mutex::default();
    match work(&cli.command, &context(&cli, desk, &collected))? {
        Outcome::Answer(answer) | Outcome::Aside(answer) => Ok(vec![answer.json]),
        Outcome::Printed(_) => Ok(collected.into_inner().unwrap_or_else(PoisonError::into_inner)),
    }
}

/// An original and a key, read once for any number of suspects: `sombrero detect`, from as many threads as one likes.
pub struct Detecting {
    job: Job,
    cli: Cli,
}

impl Detecting {
    /// The arguments are those of `detect`, without its name; its suspects are passed over.
    ///
    /// # Errors
    /// [`Failure`] when key and original cannot be read or do not belong together.
    pub fn new(arguments: impl IntoIterator<Item = OsString>, desk: &Desk) -> Result<Self, Failure> {
        let cli = parse(std::iter::once("detect".into()).chain(arguments))?;
        let Command::Detect(args) = &cli.command else {
            return Err(Failure::new("internal", "`detect` is not what was parsed"));
        };
        let collected = Mutex::default();
        let job = Job::of(args, &context(&cli, desk, &collected))?;
        Ok(Self { job, cli })
    }

    /// Looks at one suspect, and writes its page where one is asked for.
    ///
    /// # Errors
    /// [`Failure`] when the suspect cannot be looked at.
    pub fn look(&self, suspect: &Path, page: Option<&Path>, desk: &Desk) -> Result<Value, Failure> {
        let collected = Mutex::default();
        Ok(self.job.look(suspect, page, &context(&self.cli, desk, &collected))?.json)
    }
}

fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Cli, Failure> {
    // Lines that move on a terminal would get into those of the program.
    Verbosity::Quiet.set();
    let words: Vec<OsString> = std::iter::once("sombrero".into()).chain(arguments).collect();
    Cli::parse_from_typed(&words).map_err(|error| wrong_usage(&error))
}

fn context<'a>(cli: &Cli, desk: &'a Desk, collected: &'a Mutex<Vec<Value>>) -> Context<'a> {
    Context { limits: cli.limits(), json: true, quiet: true, desk, collected: Some(collected) }
}
