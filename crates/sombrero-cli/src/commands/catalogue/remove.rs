//! `sombrero catalogue remove`.

use crate::answer::Answer;
use crate::catalogue;
use crate::failure::Failure;
use crate::table::Table;
use serde_json::json;
use sombrero_catalogue::{Catalogue, Editor, Entry};
use sombrero_vault::Vault;
use std::path::PathBuf;

// What is typed after `sombrero catalogue remove`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The folder of the catalogue.
    catalogue: PathBuf,
    /// Originals, by the names that `catalogue list` prints.
    #[arg(required = true, value_name = "NAME")]
    names: Vec<String>,
    /// Remove what is kept of them too: originals and keys, for good.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(args: &Args) -> Result<Answer, Failure> {
    let mut editor = Editor::open(&args.catalogue)?;
    let known = editor.catalogue()?;
    let vault = catalogue::vault(&args.catalogue)?;
    // All are checked before the first is removed.
    let entries = args
        .names
        .iter()
        .map(|name| entry(args, &known, vault.as_ref(), name))
        .collect::<Result<Vec<_>, _>>()?;
    for entry in &entries {
        // What is kept goes first: as long as the name is there, this can be asked for again.
        if let Some(vault) = &vault {
            vault.forget(&entry.digest)?;
        }
        editor.remove(&entry.name)?;
    }
    let names: Vec<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
    let text = Table::new(format!("removed {} from {}", names.join(", "), args.catalogue.display()));
    Answer::new(text, &json!({ "removed": names }))
}

fn entry(args: &Args, known: &Catalogue, vault: Option<&Vault>, name: &str) -> Result<Entry, Failure> {
    let catalogue = args.catalogue.display();
    let Some(entry) = known.entry(name)? else {
        let message =
            format!("{name}: no original of {catalogue}; `sombrero catalogue list` prints their names");
        return Err(Failure::new("catalogue", message));
    };
    if let Some(vault) = vault.filter(|_| !args.force) {
        let (original, keys) = (vault.has_original(&entry.digest), vault.keys(&entry.digest)?.len());
        if original || keys > 0 {
            let message = format!(
                "{name}: {catalogue} keeps {}{keys} of its keys, which would be gone; export them first, then give --force",
                if original { "the original and " } else { "" }
            );
            return Err(Failure::new("catalogue", message));
        }
    }
    Ok(entry)
}
