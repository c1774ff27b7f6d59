#![doc = include_str!("../README.md")]
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is the program that talks to people")]

mod args;
mod commands;
mod failure;
mod files;
mod progress;

use args::{Cli, Command};
use clap::Parser;
use clap::error::ErrorKind;
use failure::Failure;
use serde::Serialize;
use std::ffi::OsString;
use std::process::ExitCode;

/// What a command says when it ran well.
pub(crate) struct Answer {
    /// For people, without the final line end.
    text: String,
    /// For programs.
    json: serde_json::Value,
    /// False: it ran well and found no watermark.
    found: bool,
}

impl Answer {
    fn new(text: String, json: &impl Serialize) -> Result<Self, Failure> {
        let json = serde_json::to_value(json).map_err(|e| Failure::new("internal", e.to_string()))?;
        Ok(Self { text, json, found: true })
    }
}

/// Runs the program with these arguments, the first being its name: parse, work, print.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(error) => return usage(&error, arguments.iter().any(|a| a == "--json")),
    };
    let answer = set_threads(cli.threads).and_then(|()| work(&cli));
    match answer {
        Ok(answer) => {
            let shown = if cli.json { answer.json.to_string() } else { answer.text };
            match say(&shown) {
                Ok(()) => ExitCode::from(u8::from(!answer.found)),
                Err(e) => {
                    Failure::new("write", format!("the answer cannot be printed ({e}); free some space"))
                        .report(false)
                }
            }
        }
        Err(failure) => failure.report(cli.json),
    }
}

fn work(cli: &Cli) -> Result<Answer, Failure> {
    let limits = cli.limits();
    match &cli.command {
        Command::Embed(args) => commands::embed::run(args, limits),
        Command::Detect(args) => commands::detect::run(args, limits),
        Command::Attack(args) => commands::attack::run(args, limits),
        Command::Compare(args) => commands::compare::run(args, limits),
        Command::Render(args) => commands::render::run(args, limits),
        Command::Info(args) => commands::info::run(args, limits),
        Command::Prepare(args) => commands::prepare::run(args, limits),
        Command::Verify(args) => commands::verify::run(args, limits),
        Command::Demo(args) => commands::demo::run(args),
    }
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
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{line}").and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(e),
        _ => Ok(()),
    }
}
