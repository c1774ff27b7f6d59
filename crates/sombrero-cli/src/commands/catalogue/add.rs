//! `sombrero catalogue add`.

use crate::answer::{Answer, Context, Outcome};
use crate::batch::{self, Inputs, Words};
use crate::catalogue::{Added, Adding, Described, LockArgs};
use crate::desk::Desk;
use crate::failure::Failure;
use crate::files;
use crate::key_folder::KeyFolder;
use crate::progress::Progress;
use crate::table::Table;
use rayon::prelude::*;
use serde_json::json;
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};

// What is typed after `sombrero catalogue add`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The folder of the catalogue. It is made if it is not there.
    catalogue: PathBuf,
    /// Originals, and folders of them.
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// Keep the originals and their keys in the catalogue, compressed and encrypted.
    #[arg(long)]
    keep: bool,
    /// The folder with the keys to keep. Default: of each original the key that `embed` put beside it, INPUT.key, if it is there.
    #[arg(long, value_name = "DIR", requires = "keep")]
    keys: Option<PathBuf>,
    #[command(flatten)]
    lock: LockArgs,
}

const WORDS: Words =
    Words { role: "input", outcomes: [Some("added"), Some("kept"), None], failed: "refused" };

/// Files that are described at once; each is reported as soon as it is on the disk.
const AT_ONCE: usize = 16;

pub(crate) fn run(args: &Args, context: &Context) -> Result<Outcome, Failure> {
    let inputs = Inputs::new(&args.inputs, Some(&args.catalogue))?.files;
    if inputs.iter().any(|input| files::is_standard(&input.path)) {
        return Err(Failure::new("usage", "an original in a catalogue needs a name; give a file"));
    }
    let keys = Keys::new(args)?;
    let mut adding = Adding::open(&args.catalogue, args.keep.then_some(&args.lock))?;
    let inputs: Vec<(PathBuf, String)> =
        inputs.into_iter().map(|input| (input.path, input.name.display().to_string())).collect();
    let mut waiting = inputs.as_slice();
    let mut described: VecDeque<Result<Described, Failure>> = VecDeque::new();
    batch::each(&inputs, &WORDS, context, |input, _| {
        if described.is_empty() {
            let done = inputs.len() - waiting.len();
            let progress = Progress::new(format!("describing {}", input.display()));
            progress.count(done, inputs.len());
            let (now, later) = waiting.split_at(waiting.len().min(AT_ONCE));
            let known = &adding.known;
            described = now
                .par_iter()
                .map(|(path, name)| {
                    Described::new(files::read_mesh(path, context)?, path, name.clone(), known)
                })
                .collect();
            waiting = later;
        }
        // As many are described as are asked for.
        let next =
            described.pop_front().ok_or_else(|| Failure::new("internal", "an original was lost"))??;
        let keys = keys.of(input, &next.digest)?;
        let added = adding.add(next, &keys)?;
        answer(args, input, &added)
    })
}

fn answer(args: &Args, input: &Path, added: &Added) -> Result<Answer, Failure> {
    let Added { original, kept, .. } = added;
    let catalogue = args.catalogue.display();
    let head = match kept {
        true => format!("{} is in {catalogue} already, as {original}", input.display()),
        false => format!("added {} to {catalogue} as {original}", input.display()),
    };
    let mut json = json!(added);
    json["input"] = input.display().to_string().into();
    Answer::new(Table::new(head).rows("kept", added.encrypted_in_words()), &json)
}

/// The keys to keep.
enum Keys {
    /// None.
    Nothing,
    /// The one beside each original.
    Beside,
    /// Those of a folder: the files of each original.
    Folder(BTreeMap<[u8; 32], Vec<PathBuf>>),
}

impl Keys {
    fn new(args: &Args) -> Result<Self, Failure> {
        match (&args.keys, args.keep) {
            (_, false) => Ok(Self::Nothing),
            (None, true) => Ok(Self::Beside),
            (Some(folder), true) => {
                let KeyFolder { paths, keys, .. } = KeyFolder::read(folder, &Desk::default())?;
                let mut of: BTreeMap<[u8; 32], Vec<PathBuf>> = BTreeMap::new();
                for (path, key) in paths.into_iter().zip(keys) {
                    of.entry(key.original_sha256).or_default().push(path);
                }
                Ok(Self::Folder(of))
            }
        }
    }

    /// The contents of the key files of an original.
    fn of(&self, input: &Path, digest: &[u8; 32]) -> Result<Vec<Vec<u8>>, Failure> {
        match self {
            Self::Nothing => Ok(Vec::new()),
            Self::Beside => {
                let path = input.with_extension("key");
                let Ok(bytes) = files::read_key_file(&path) else { return Ok(Vec::new()) };
                let fits = files::parse_key(&path, &bytes).is_ok_and(|key| key.original_sha256 == *digest);
                Ok(if fits { vec![bytes] } else { Vec::new() })
            }
            Self::Folder(of) => {
                of.get(digest).into_iter().flatten().map(|path| files::read_key_file(path)).collect()
            }
        }
    }
}
