#![doc = include_str!("../README.md")]
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is the program that talks to people")]

mod answer;
mod args;
mod batch;
mod catalogue;
mod cli;
mod commands;
mod desk;
mod failure;
mod fidelity;
mod files;
mod key_folder;
mod lengths;
mod program;
mod progress;
mod shard;
mod table;
mod terminal;
mod timestamp;

pub use desk::Desk;
pub use failure::Failure;
pub use program::{Detecting, Searching, answers};

use answer::{Context, Outcome};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use cli::{Cli, Command};
use progress::Verbosity;
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

/// Runs the program with these arguments, the first being its name: parse, work, print.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    ExitCode::from(status(arguments))
}

/// The exit status of [`run`].
pub fn status(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli = match Cli::parse_from_typed(&arguments) {
        Ok(cli) => cli,
        Err(error) => return usage(&error, arguments.iter().any(|a| a == "--json")),
    };
    progress::install(match (cli.quiet, cli.verbose) {
        (true, _) => Verbosity::Quiet,
        (false, true) => Verbosity::Stages,
        (false, false) => Verbosity::Usual,
    });
    let desk = Desk::default();
    let context =
        Context { limits: cli.limits(), json: cli.json, quiet: cli.quiet, desk: &desk, collected: None };
    let status = match set_threads(cli.threads).and_then(|()| work(&cli.command, &context)) {
        Ok(Outcome::Printed(status)) => Ok(status),
        // An answer that cannot be printed cannot be complained of on the same way out.
        Ok(Outcome::Answer(answer)) => context.print(&answer, false).map_err(|failure| (failure, false)),
        Ok(Outcome::Aside(answer)) => context.print(&answer, true).map_err(|failure| (failure, false)),
        Err(failure) => Err((failure, cli.json)),
    };
    status.unwrap_or_else(|(failure, json)| failure.report(json))
}

fn work(command: &Command, context: &Context) -> Result<Outcome, Failure> {
    let answer = match command {
        Command::Catalogue(args) => return commands::catalogue::run(args, context),
        Command::Search(args) => return commands::search::run(args, context),
        Command::Embed(args) => return commands::embed::run(args, context),
        Command::Detect(args) => return commands::detect::run(args, context),
        Command::Attack(args) => return commands::attack::run(args, context),
        Command::Render(args) => return commands::render::run(args, context),
        Command::Completions(args) => return commands::completions::run(args, &mut cli::command(), context),
        Command::Man(args) => return commands::man::run(args, cli::command(), context),
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

/// What people call commands elsewhere.
const OTHER_NAMES: [(&str, &str); 24] = [
    ("mark", "embed"),
    ("watermark", "embed"),
    ("sign", "embed"),
    ("insert", "embed"),
    ("encode", "embed"),
    ("protect", "embed"),
    ("extract", "detect"),
    ("find", "detect"),
    ("check", "detect"),
    ("decode", "detect"),
    ("scan", "detect"),
    ("identify", "trace"),
    ("who", "trace"),
    ("leak", "trace"),
    ("diff", "compare"),
    ("distance", "compare"),
    ("view", "render"),
    ("show", "info"),
    ("inspect", "info"),
    ("timestamp", "commit"),
    ("catalog", "catalogue"),
    ("index", "catalogue"),
    ("which", "search"),
    ("lookup", "search"),
];

/// What was meant by a word that is not known, as far as there is a guess.
fn suggestion(error: &clap::Error) -> Option<String> {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.clone()),
        // The likeliest is last.
        Some(ContextValue::Strings(texts)) => texts.last().cloned(),
        _ => None,
    };
    let other = || {
        let typed = text(ContextKind::InvalidSubcommand)?.to_lowercase();
        OTHER_NAMES.iter().find(|(name, _)| *name == typed).map(|(_, known)| (*known).to_owned())
    };
    let kinds = [ContextKind::SuggestedSubcommand, ContextKind::SuggestedArg];
    other().or_else(|| kinds.into_iter().find_map(text))
}

/// Help and version go to stdout with status 0; wrong usage is a failure like any other, in one sentence.
fn usage(error: &clap::Error, json: bool) -> u8 {
    let help = error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
    if error.use_stderr() && (json || !help) {
        return wrong_usage(error).report(json);
    }
    // A closed pipe is no reason to panic.
    let _ = error.print();
    u8::try_from(error.exit_code()).unwrap_or(2)
}

fn wrong_usage(error: &clap::Error) -> Failure {
    let text = error.to_string();
    // The first paragraph says what is wrong, line by line; the rest is advice on usage.
    let paragraph: Vec<&str> = text.lines().map(str::trim).take_while(|line| !line.is_empty()).collect();
    let sentence = paragraph.join(" ");
    let sentence = sentence.trim_start_matches("error: ");
    if let Some(ContextValue::String(typed)) = error.get(ContextKind::InvalidSubcommand)
        && Path::new(typed).exists()
    {
        let cure = "give a command before it, such as `info`, `embed` or `detect`";
        return Failure::new("usage", format!("{typed}: a file is no command; {cure}"));
    }
    let cure =
        suggestion(error).map_or_else(|| "see --help".to_owned(), |it| format!("did you mean `{it}`?"));
    Failure::new("usage", format!("{sentence}; {cure}"))
}
