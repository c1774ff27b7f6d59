//! A folder of copies, one of each input, with their keys in its subfolder `keys`. What is there already is kept, so that
//! a run which was broken off goes on where it was.

use super::args::Order;
use super::copy::{Place, answer, mark, write};
use super::folder::{Before, before, make_folders, own_secret};
use super::keeping::Keeping;
use crate::answer::{Answer, Context, Outcome};
use crate::batch::{self, Input, Inputs, Words};
use crate::failure::Failure;
use crate::files;
use crate::progress::Progress;
use crate::table::Table;
use serde_json::json;
use sombrero::io::Document;
use sombrero::watermark::{OriginalDigest, Secret};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

pub(super) fn run(
    inputs: &[PathBuf],
    folder: &Path,
    order: &Order<'_>,
    context: &Context,
) -> Result<Outcome, Failure> {
    let given = order.secret(context.desk)?;
    let mut keeping = Keeping::new(order)?;
    let mut taken = BTreeSet::new();
    let mut name = |input: Input| {
        let name = name(&input, folder, &mut taken);
        (input.path, name)
    };
    // What an earlier run wrote is no input of this one.
    let inputs: Vec<_> = Inputs::new(inputs, Some(folder))?.files.into_iter().map(&mut name).collect();
    batch::each(&inputs, &WORDS, context, |input, name| {
        let name = name.as_ref().map_err(Failure::clone)?;
        let (output, key) = (folder.join(name), folder.join("keys").join(name).with_added_extension("key"));
        let (original, answer) =
            copy(order, folder, &Place { input, output: &output, key: &key }, given, context)?;
        keeping.keep(original, input, name, &[key], answer)
    })
}

/// What became of several files.
const WORDS: Words =
    Words { role: "input", outcomes: [Some("marked"), Some("kept"), None], failed: "refused" };

/// The name of the copy of `input`, which no other one has.
fn name(input: &Input, folder: &Path, taken: &mut BTreeSet<PathBuf>) -> Result<PathBuf, Failure> {
    if files::is_standard(&input.path) {
        return Err(Failure::new("usage", "a copy of standard input has no name; give a file"));
    }
    let name = input.name.clone();
    if !taken.insert(name.clone()) {
        let message = format!(
            "{}: two inputs have this name; mark them into different folders",
            folder.join(name).display()
        );
        return Err(Failure::new("write", message));
    }
    Ok(name)
}

fn copy(
    order: &Order<'_>,
    folder: &Path,
    place: &Place<'_>,
    given: Option<Secret>,
    context: &Context,
) -> Result<(Document, Answer), Failure> {
    let Place { input, output, key } = *place;
    let _progress = Progress::new(format!("marking {}", input.display()));
    let original = files::read_mesh(input, context)?;
    files::check_format(output, &original)?;
    let identity = &order.options.identity;
    let digest = OriginalDigest::of(original.parts());
    let before = match order.force {
        true => Before::Nothing,
        false => before(&order.options, place, identity, &digest)?,
    };
    let kept = match before {
        Before::All => {
            let [input, output, key] = [input, output, key].map(|path| path.display().to_string());
            let text = Table::new(format!("kept {output}, which was marked before"));
            let json = json!({ "input": input, "output": output, "key": key, "kept": true });
            return Ok((original, Answer::new(text, &json)?));
        }
        Before::Key(kept) => Some(*kept),
        Before::Nothing => {
            files::check_outputs(&[output, key], &[input], order.force)?;
            None
        }
    };
    let secret = match &kept {
        Some(kept) => kept.secret,
        None => own_secret(given, &digest, identity)?,
    };
    let marked = mark(order, &original, place, secret)?;
    make_folders(folder, context)?;
    // Files of subfolders go to subfolders.
    for path in [output, key] {
        path.parent().map_or(Ok(()), files::make_folder)?;
    }
    write(&marked, &original, place, &[input], kept.as_ref(), order.force, context)?;
    let mut answer = answer(place, &marked.report)?;
    answer.json["input"] = input.display().to_string().into();
    answer.json["kept"] = false.into();
    Ok((original, answer))
}
