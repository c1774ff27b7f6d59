//! What `embed --catalogue` does beside marking: the originals and their keys go into a catalogue.

use super::args::Order;
use crate::answer::Answer;
use crate::catalogue::{Added, Adding, Described};
use crate::failure::Failure;
use crate::files;
use serde_json::json;
use sombrero::io::Document;
use std::path::{Path, PathBuf};

/// The catalogue that was asked for, if one was. It is held from the beginning, so that nothing is marked in vain.
pub(super) struct Keeping<'a>(Option<(&'a Path, Adding)>);

impl<'a> Keeping<'a> {
    pub(super) fn new(order: &Order<'a>) -> Result<Self, Failure> {
        let open = |(folder, lock)| Ok::<_, Failure>((folder, Adding::open(folder, Some(lock))?));
        Ok(Self(order.catalogue.map(open).transpose()?))
    }

    /// Adds the original that was read from `path`, called `name`, with the keys in these files; the answer says so.
    pub(super) fn keep(
        &mut self,
        original: Document,
        path: &Path,
        name: &Path,
        keys: &[PathBuf],
        answer: Answer,
    ) -> Result<Answer, Failure> {
        let Some((folder, adding)) = &mut self.0 else { return Ok(answer) };
        let keys = keys.iter().map(|key| files::read_key_file(key)).collect::<Result<Vec<_>, _>>()?;
        let described = Described::new(original, path, name.display().to_string(), &adding.known)?;
        let added = adding.add(described, &keys)?;
        let Added { original, kept, .. } = &added;
        let folder = folder.display();
        let words = match kept {
            true => format!("{folder} has it already, as {original}"),
            false => format!("added to {folder} as {original}"),
        };
        let Answer { text, mut json, status } = answer;
        json["catalogue"] = json!(added);
        let text = text.row("catalogue", words).rows("kept", added.encrypted_in_words());
        Ok(Answer { text, json, status })
    }
}
