//! `sombrero catalogue list`.

use crate::answer::Answer;
use crate::catalogue;
use crate::failure::Failure;
use crate::table::Table;
use crate::terminal::visible;
use serde::Serialize;
use serde_json::json;
use std::path::PathBuf;

// What is typed after `sombrero catalogue list`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The folder of the catalogue.
    catalogue: PathBuf,
}

#[derive(Serialize)]
struct Listed {
    original: String,
    sha256: String,
    place: String,
    kept: bool,
    keys: usize,
}

pub(crate) fn run(args: &Args) -> Result<Answer, Failure> {
    let entries = catalogue::open(&args.catalogue)?.entries()?;
    let vault = catalogue::vault(&args.catalogue)?;
    let mut listed = Vec::with_capacity(entries.len());
    for entry in entries {
        let (kept, keys) = match &vault {
            Some(vault) => (vault.has_original(&entry.digest), vault.keys(&entry.digest)?.len()),
            None => (false, 0),
        };
        listed.push(Listed {
            original: entry.name,
            sha256: hex::encode(entry.digest),
            place: entry.place,
            kept,
            keys,
        });
    }
    let head = match listed.len() {
        1 => format!("1 original in {}", args.catalogue.display()),
        count => format!("{count} originals in {}", args.catalogue.display()),
    };
    let line = |l: &Listed| {
        let kept = match (l.kept, l.keys) {
            (false, 0) => "not kept".to_owned(),
            (true, 0) => "kept".to_owned(),
            (true, 1) => "kept with 1 key".to_owned(),
            (true, keys) => format!("kept with {keys} keys"),
            (false, keys) => format!("not kept, {keys} keys"),
        };
        // Its length must be known before it is padded.
        format!("  {:<28} {kept}", visible(&l.original))
    };
    let text = listed.iter().map(line).fold(Table::new(head), |table, line| table.line(line));
    let text = text.rows("encrypted to", vault.as_ref().map(|vault| vault.recipients()));
    let recipients = vault.map(|vault| vault.recipients());
    Answer::new(text, &json!({ "originals": listed, "encrypted_to": recipients }))
}
