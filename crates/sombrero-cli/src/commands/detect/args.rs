//! What is typed after `sombrero detect`, and what it means.

use crate::args::Steps;
use crate::batch::Inputs;
use crate::failure::Failure;
use crate::files;
use crate::shard::ShardArgs;
use clap::ValueEnum;
use sombrero::DetectOptions;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The meshes to look at, and folders of them.
    #[arg(required = true, value_name = "SUSPECT")]
    suspects: Vec<PathBuf>,
    /// The file that was marked, exactly.
    #[arg(long, value_name = "FILE")]
    original: PathBuf,
    /// The key that `embed` wrote.
    #[arg(long, value_name = "FILE")]
    key: PathBuf,
    /// A prepared file of your own making, which is taken at its word. Default: the one beside the key, KEY.prepared;
    /// if there is one, what is found with it is confirmed without it.
    #[arg(long, value_name = "FILE")]
    prepared: Option<PathBuf>,
    /// Certificates (PEM) of the timestamping authorities that you trust, for the timestamp in the key.
    #[arg(long, value_name = "FILE")]
    ca: Option<PathBuf>,
    /// How to look.
    #[arg(long, value_enum, default_value_t = Method::Robust)]
    method: Method,
    #[command(flatten)]
    steps: Steps,
    /// Write a report for people: one HTML page with plot, pictures and a view to turn. With several suspects a
    /// folder, where each has its page.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Seed of the points that resampling draws on the suspect.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    shard: ShardArgs,
    /// Replace a report that exists.
    #[arg(long)]
    force: bool,
}

/// A way to look.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// What else was done to the shape is solved for too; several tests.
    Robust,
    /// The paper's: resampling, least squares, correlation, t test.
    Paper,
}

impl From<Method> for sombrero::Method {
    fn from(method: Method) -> Self {
        match method {
            Method::Robust => Self::Robust,
            Method::Paper => Self::Paper,
        }
    }
}

/// A detection that was asked for. All was checked that can be without reading a file.
pub(super) struct Plan {
    pub(super) suspects: Vec<Suspect>,
    /// Whether one file was named, whose answer is the whole answer.
    pub(super) one: bool,
    /// The folder for the pages of several suspects.
    pub(super) folder: Option<PathBuf>,
    pub(super) original: PathBuf,
    pub(super) key: PathBuf,
    pub(super) prepared: Prepared,
    /// The certificates of authorities that are trusted.
    pub(super) ca: Option<PathBuf>,
    pub(super) settings: DetectOptions,
    pub(super) force: bool,
}

/// A file to look at, and where its page goes, if it has one; or why the page can be nowhere.
pub(super) type Suspect = (PathBuf, Result<Option<PathBuf>, Failure>);

/// The place of a prepared file, which may be empty.
pub(super) struct Prepared {
    pub(super) path: PathBuf,
    /// Whether the user named it, and so vouches for it.
    pub(super) named: bool,
}

impl Plan {
    /// The plan of what was typed, checked.
    pub(super) fn new(args: &Args) -> Result<Self, Failure> {
        let Args { original, key, report, force, .. } = args;
        let prepared = Prepared {
            path: args.prepared.clone().unwrap_or_else(|| files::beside_key(key)),
            named: args.prepared.is_some(),
        };
        let Inputs { files, one } = args.shard.of(Inputs::new(&args.suspects, None)?);
        let mut inputs: Vec<&Path> = files.iter().map(|file| file.path.as_path()).collect();
        inputs.extend([original.as_path(), key, &prepared.path]);
        let page = report.as_ref().filter(|_| one);
        files::check_outputs(page.map(PathBuf::as_path).as_slice(), &inputs, *force)?;
        if page.is_some_and(|page| files::is_standard(page)) {
            return Err(Failure::new(
                "usage",
                "a report is a page for a browser; give it the name of a file",
            ));
        }
        let folder = report.clone().filter(|_| !one);
        let mut pages = Pages { folder: folder.as_deref(), taken: BTreeSet::new() };
        let place = |name: &Path| match one {
            true => Ok(page.cloned()),
            false => pages.place(name, &inputs, *force),
        };
        let places: Vec<_> = files.iter().map(|file| file.name.as_path()).map(place).collect();
        Ok(Self {
            suspects: files.into_iter().map(|file| file.path).zip(places).collect(),
            one,
            folder,
            original: original.clone(),
            key: key.clone(),
            prepared,
            ca: args.ca.clone(),
            settings: DetectOptions { method: args.method.into(), seed: args.seed, ..args.steps.options() },
            force: *force,
        })
    }
}

/// The pages of several suspects.
struct Pages<'a> {
    folder: Option<&'a Path>,
    taken: BTreeSet<PathBuf>,
}

impl Pages<'_> {
    fn place(&mut self, name: &Path, inputs: &[&Path], force: bool) -> Result<Option<PathBuf>, Failure> {
        let Some(folder) = self.folder else { return Ok(None) };
        let page = folder.join(name).with_added_extension("html");
        if !self.taken.insert(page.clone()) {
            let message = format!(
                "{}: two suspects have this name; put their reports into different folders",
                page.display()
            );
            return Err(Failure::new("write", message));
        }
        files::check_outputs(&[&page], inputs, force)?;
        Ok(Some(page))
    }
}
