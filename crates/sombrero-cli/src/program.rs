//! The command as a program calls it: arguments in, JSON out, files in memory where that suits better. Nothing is printed,
//! and no threads are chosen: it works on those of the pool that it is called from.

use crate::answer::{Context, Outcome};
use crate::cli::{Cli, Command};
use crate::commands::detect::Job;
use crate::commands::search::args::Args as SearchArgs;
use crate::commands::search::{Pages, Search};
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
        self.job.check_page(page, suspect)?;
        let collected = Mutex::default();
        Ok(self.job.look(suspect, page, &context(&self.cli, desk, &collected))?.json)
    }
}

/// A catalogue that is opened once for any number of suspects: `sombrero search`, from as many threads as one likes.
pub struct Searching {
    search: Search,
    cli: Cli,
}

impl Searching {
    /// The arguments are those of `search`, without its name; its suspects are passed over.
    ///
    /// # Errors
    /// [`Failure`] when the catalogue cannot be opened.
    pub fn new(arguments: impl IntoIterator<Item = OsString>, desk: &Desk) -> Result<Self, Failure> {
        let cli = parse(std::iter::once("search".into()).chain(arguments))?;
        let collected = Mutex::default();
        let search = Search::new(Self::args(&cli)?, &context(&cli, desk, &collected))?;
        Ok(Self { search, cli })
    }

    /// Looks for the original of one suspect, and writes its pages where they are asked for.
    ///
    /// # Errors
    /// [`Failure`] when the suspect cannot be looked at.
    pub fn look(&self, suspect: &Path, page: Option<&Path>, desk: &Desk) -> Result<Value, Failure> {
        let args = Self::args(&self.cli)?;
        let pages = Pages::checked(page, &[suspect], args.force)?;
        let collected = Mutex::default();
        let context = context(&self.cli, desk, &collected);
        Ok(self.search.ask(suspect, pages.as_ref(), args, &context)?.json)
    }

    fn args(cli: &Cli) -> Result<&SearchArgs, Failure> {
        match &cli.command {
            Command::Search(args) => Ok(args),
            _ => Err(Failure::new("internal", "`search` is not what was parsed")),
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero::io::{Document, Format, encode};
    use sombrero::shapes::octahedron;

    fn asked(desk: &Desk, line: &str) -> Result<Vec<Value>, Failure> {
        answers(line.split(' ').map(OsString::from), desk)
    }

    fn mesh() -> Vec<u8> {
        encode(Format::PlyBinaryLittleEndian, &octahedron()).expect("an octahedron has vertices and faces")
    }

    #[test]
    fn meshes_come_from_memory_and_stay_there() {
        let desk = Desk::default().with_file("<mesh>", mesh()).with_output("<attacked>");
        let info = asked(&desk, "info <mesh>").unwrap();
        assert_eq!((info.len(), &info[0]["triangles"]), (1, &8.into()));
        let attacked = asked(&desk, "attack <mesh> -o <attacked> transform:scale=2 --seed 3").unwrap();
        assert_eq!(attacked[0]["output"], "<attacked>");
        let written = Document::parse(desk.take("<attacked>").unwrap(), None).unwrap();
        assert_eq!(written.points().len(), 6);
        assert_ne!(written.points(), octahedron().points);
    }

    #[test]
    fn several_inputs_have_an_answer_each_and_a_summary() {
        let desk = Desk::default().with_file("<a>", mesh()).with_file("<b>", b"v 0 0 nowhere\n".to_vec());
        let folder = tempfile::tempdir().unwrap();
        let catalogue = folder.path().join("models");
        let line = format!("catalogue add {} <a>", catalogue.display());
        assert!(asked(&desk, &line).is_ok());
        let searched =
            asked(&desk, &format!("search <a> <b> --catalogue {} --rank-only", catalogue.display())).unwrap();
        assert_eq!(searched.len(), 3);
        assert_eq!((&searched[0]["found"], &searched[1]["error"]["kind"]), (&true.into(), &"read".into()));
        assert_eq!(searched[2]["summary"]["files"], 2);
    }

    #[test]
    fn failures_have_a_kind() {
        let desk = Desk::default();
        let kind = |line| asked(&desk, line).map_err(|failure| failure.kind());
        assert_eq!(kind("info nothing.obj"), Err("read"));
        assert_eq!(kind("inform nothing.obj"), Err("usage"));
        assert_eq!(kind("detect a --original nothing.obj --key nothing.key"), Err("read"));
    }
}
