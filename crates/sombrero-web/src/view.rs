//! A model to be turned before anything is done with it.

use crate::file::File;
use crate::refusal::Refusal;

/// A small page in which the model can be turned, for a frame of the page.
///
/// # Errors
/// [`Refusal`] when the file is no model, is too large, or has no surface.
pub fn view(model: File) -> Result<String, Refusal> {
    let name = model.name.clone();
    let document = model.model()?;
    sombrero_report::view(&name, document.soup()).ok_or(Refusal::Nothing { name })
}
