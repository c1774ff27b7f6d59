//! `sombrero man`.

use crate::answer::{Answer, Context, Outcome};
use crate::failure::Failure;
use crate::files;
use crate::table::Table;
use crate::terminal::say;
use clap::Command;
use serde_json::json;
use sombrero::io::{Access, Output};
use std::path::{Path, PathBuf};

// What is typed after `sombrero man`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The folder for one page a command. Default: the page of `sombrero` to standard output.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Replace pages that exist.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(args: &Args, program: Command, context: &Context) -> Result<Outcome, Failure> {
    // It would be listed, and its page has nothing to say.
    let mut program = program.disable_help_subcommand(true);
    program.build();
    let Some(folder) = &args.output else {
        return print(&program, context);
    };
    let mut pages = vec![(folder.join("sombrero.1"), page(program.clone())?)];
    for command in program.get_subcommands() {
        let name = format!("sombrero-{}", command.get_name());
        let path = folder.join(format!("{name}.1"));
        let command = command.clone().name(name.clone()).display_name(name);
        pages.push((path, page(command)?));
    }
    let paths: Vec<&Path> = pages.iter().map(|(path, _)| path.as_path()).collect();
    files::check_outputs(&paths, &[], args.force)?;
    files::make_folder(folder)?;
    let outputs = pages.iter().map(|(path, bytes)| Output { path, bytes, access: Access::Usual });
    files::write_all(&outputs.collect::<Vec<_>>(), args.force)?;
    let files: Vec<String> =
        pages.iter().map(|(path, _): &(PathBuf, _)| path.display().to_string()).collect();
    let text = Table::new(format!("wrote {} manual pages → {}", files.len(), folder.display()));
    Ok(Outcome::Answer(Answer::new(
        text,
        &json!({ "output": folder.display().to_string(), "files": files }),
    )?))
}

fn print(program: &Command, context: &Context) -> Result<Outcome, Failure> {
    if context.json {
        return Err(Failure::new("usage", "a manual page is not JSON; leave --json out, or give -o DIR"));
    }
    let page = page(program.clone())?;
    say(String::from_utf8_lossy(&page).trim_end())
        .map_err(|e| Failure::new("write", format!("standard output: cannot be written ({e})")))?;
    Ok(Outcome::Printed(0))
}

fn page(command: Command) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    clap_mangen::Man::new(command)
        .render(&mut bytes)
        .map_err(|e| Failure::new("internal", format!("a manual page cannot be made: {e}")))?;
    Ok(bytes)
}
