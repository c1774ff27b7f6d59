#![doc = include_str!("../README.md")]
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is the program that talks to people")]

mod args;
mod batch;
mod commands;
mod failure;
mod files;
mod progress;
mod timestamp;

use args::{Cli, Command};
use clap::Parser;
use clap::error::ErrorKind;
use failure::Failure;
use progress::Verbosity;
use serde::Serialize;
use sombrero::io::Limits;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// What a command says when it ran well.
pub(crate) struct Answer {
    /// For people, without the final line end.
    text: String,
    /// For programs.
    json: serde_json::Value,
    /// The exit status.
    status: u8,
}

/// The exit status of a command that ran well and found no watermark, or that a report does not hold.
pub(crate) const NOT_FOUND: u8 = 1;

impl Answer {
    fn new(text: String, json: &impl Serialize) -> Result<Self, Failure> {
        let json = serde_json::to_value(json).map_err(|e| Failure::new("internal", e.to_string()))?;
        Ok(Self { text, json, status: 0 })
    }

    /// The same, but [`NOT_FOUND`] unless `found`.
    fn found_if(self, found: bool) -> Self {
        Self { status: if found { 0 } else { NOT_FOUND }, ..self }
    }
}

/// What every command is told beside its own arguments.
#[derive(Clone, Copy)]
pub(crate) struct Context {
    /// How much is read of a mesh file.
    limits: Limits,
    json: bool,
    quiet: bool,
}

impl Context {
    /// Prints an answer, or a failure where an answer was expected, and gives its exit status. `aside`: standard output
    /// belongs to a file.
    fn print(&self, answer: &Answer, aside: bool) -> Result<u8, Failure> {
        let shown = if self.json { answer.json.to_string() } else { answer.text.clone() };
        let silent = !self.json && (self.quiet || answer.text.is_empty());
        let said = match (silent, aside) {
            (true, _) => Ok(()),
            (false, false) => say(&shown),
            (false, true) => writeln!(std::io::stderr(), "{shown}"),
        };
        said.map(|()| answer.status).map_err(|e| {
            Failure::new("write", format!("the answer cannot be printed ({e}); free some space"))
        })
    }
}

/// What ends a command: one answer, or lines that were printed as they came and the worst of their statuses.
pub(crate) enum Outcome {
    /// To be printed.
    Answer(Answer),
    /// To be printed where it is out of the way: standard output was a file.
    Aside(Answer),
    /// All was said.
    Printed(u8),
}

/// Runs the program with these arguments, the first being its name: parse, work, print.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(error) => return usage(&error, arguments.iter().any(|a| a == "--json")),
    };
    progress::install(match (cli.quiet, cli.verbose) {
        (true, _) => Verbosity::Quiet,
        (false, true) => Verbosity::Stages,
        (false, false) => Verbosity::Usual,
    });
    let context = Context { limits: cli.limits(), json: cli.json, quiet: cli.quiet };
    let status = match set_threads(cli.threads).and_then(|()| work(&cli.command, &context)) {
        Ok(Outcome::Printed(status)) => Ok(status),
        // An answer that cannot be printed cannot be complained of on the same way out.
        Ok(Outcome::Answer(answer)) => context.print(&answer, false).map_err(|failure| (failure, false)),
        Ok(Outcome::Aside(answer)) => context.print(&answer, true).map_err(|failure| (failure, false)),
        Err(failure) => Err((failure, cli.json)),
    };
    status.map_or_else(|(failure, json)| failure.report(json), ExitCode::from)
}

fn work(command: &Command, context: &Context) -> Result<Outcome, Failure> {
    let answer = match command {
        Command::Embed(args) => return commands::embed::run(args, context),
        Command::Detect(args) => return commands::detect::run(args, context),
        Command::Attack(args) => return commands::attack::run(args, context),
        Command::Render(args) => return commands::render::run(args, context),
        Command::Completions(args) => return commands::completions::run(args, context),
        Command::Man(args) => return commands::man::run(args, context),
        Command::Trace(args) => commands::trace::run(args, context),
        Command::Compare(args) => commands::compare::run(args, context),
        Command::Info(args) => commands::info::run(args, context),
        Command::Prepare(args) => commands::prepare::run(args, context),
        Command::Verify(args) => commands::verify::run(args, context),
        Command::Commit(args) => commands::commit::run(args, context),
        Command::Demo(args) => commands::demo::run(args),
    };
    answer.map(Outcome::Answer)
}

fn set_threads(threads: Option<usize>) -> Result<(), Failure> {
    let Some(count) = threads else { return Ok(()) };
    let built = rayon::ThreadPoolBuilder::new().num_threads(count).build_global();
    built.map_err(|e| Failure::new("usage", format!("--threads {count} cannot be had: {e}")))
}

/// Help and version go to stdout with status 0; wrong usage is a failure like any other, in one sentence.
fn usage(error: &clap::Error, json: bool) -> ExitCode {
    let help = error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
    if error.use_stderr() && (json || !help) {
        let text = error.to_string();
        // The first paragraph says what is wrong, line by line; the rest is advice on usage.
        let paragraph: Vec<&str> = text.lines().map(str::trim).take_while(|line| !line.is_empty()).collect();
        let sentence = paragraph.join(" ");
        let sentence = sentence.trim_start_matches("error: ");
        return Failure::new("usage", format!("{sentence}; see --help")).report(json);
    }
    // A closed pipe is no reason to panic.
    let _ = error.print();
    ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
}

/// Prints a line. Whoever closed the pipe has read what they wanted; that is no error.
fn say(line: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{line}").and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(e),
        _ => Ok(()),
    }
}
