//! A model and a secret in, a marked copy and its key out.

use crate::file::File;
use crate::refusal::Refusal;
use sombrero::io::{Decimals, Document, Format, Rewrite};
use sombrero::watermark::{Identity, Parameters, Secret};
use sombrero::{EmbedReport, Embedder, Marked};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// A marked copy and what belongs to it.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct MarkedCopy {
    /// The copy, in the format of the original.
    pub copy: File,
    /// The key: secret, to be kept together with the original.
    pub key: File,
    /// Displacements, visibility, strength.
    pub report: EmbedReport,
}

/// Marks a model as `sombrero embed` does without options: the same bytes for the same secret and identity.
///
/// `secret` are 32 bytes that nobody can guess. `ready` is given the copy before it is measured what became of the shape, which takes a
/// fifth of the time and changes nothing of the copy.
///
/// # Errors
/// [`Refusal`] when the file is no model, or one that is too large or cannot carry a mark.
///
/// # Example
/// ```
/// use sombrero::io::{Format, encode};
/// use sombrero::{shapes, watermark::Identity};
/// use sombrero_web::{File, mark};
///
/// let bytes = encode(Format::Obj, &shapes::bumpy_sphere(1000))?;
/// let model = File { name: "vase.obj".into(), bytes };
/// let identity = Identity { owner: "A. Museum".into(), recipient: String::new() };
/// let marked = mark(model, identity, &[7; 32], |unmeasured| assert!(unmeasured.report.fidelity.is_none()))?;
/// assert_eq!((marked.copy.name.as_str(), marked.key.name.as_str()), ("vase-marked.obj", "vase.key"));
/// assert!(marked.report.log10_p < -100.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn mark(
    model: File,
    identity: Identity,
    secret: &[u8],
    ready: impl FnOnce(&MarkedCopy),
) -> Result<MarkedCopy, Refusal> {
    let secret: [u8; 32] = secret.try_into().map_err(|_| Refusal::Secret { length: secret.len() })?;
    let name = model.name.clone();
    let original = model.model()?;
    let copy = name_of_copy(&name, &original);
    // What the command does where nothing else is asked of it.
    let rewrite = Rewrite::default().with_decimals(Decimals::Own);
    let rewrite = match copy.file_stem().and_then(OsStr::to_str) {
        Some(stem) => rewrite.with_stem(stem),
        None => rewrite,
    };
    let refused = |source| Refusal::Mark { name: name.clone(), source };
    let embedder = Embedder::new(&original, Parameters::default(), true).map_err(refused)?;
    let marked = embedder.mark(identity, Secret(secret), &rewrite).map_err(refused)?;
    let files = |marked: &Marked| MarkedCopy {
        copy: File { name: copy.display().to_string(), bytes: marked.bytes.clone() },
        key: File {
            name: Path::new(&name).with_extension("key").display().to_string(),
            bytes: marked.key.to_json().into_bytes(),
        },
        report: marked.report.clone(),
    };
    ready(&files(&marked));
    Ok(files(&embedder.measured(marked)))
}

/// The name with `-marked`, and an extension of the copy's format.
fn name_of_copy(name: &str, original: &Document) -> PathBuf {
    let path = Path::new(name);
    let mut copy = path.file_stem().unwrap_or_default().to_owned();
    copy.push("-marked");
    let own = path.extension().and_then(OsStr::to_str);
    let fits = own.and_then(Format::from_extension).is_none_or(|f| f.extension() == original.extension());
    let extension = own.filter(|_| fits).unwrap_or(original.extension());
    PathBuf::from(copy).with_added_extension(extension)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero::io::encode;
    use sombrero::shapes;

    fn model(name: &str) -> File {
        File { name: name.into(), bytes: encode(Format::Off, &shapes::bumpy_sphere(600)).unwrap() }
    }

    #[test]
    fn a_copy_is_named_after_its_original_and_its_format() {
        for (name, copy, key) in [
            ("vase.off", "vase-marked.off", "vase.key"),
            ("vase.stl", "vase-marked.off", "vase.key"),
            ("vase.OFF", "vase-marked.OFF", "vase.key"),
            ("the vase.v2.off", "the vase.v2-marked.off", "the vase.v2.key"),
            ("vase", "vase-marked.off", "vase.key"),
        ] {
            let marked = mark(model(name), Identity::default(), &[1; 32], |_| ()).unwrap();
            assert_eq!((marked.copy.name.as_str(), marked.key.name.as_str()), (copy, key));
        }
    }

    #[test]
    fn a_short_secret_is_refused() {
        let refusal = mark(model("vase.off"), Identity::default(), &[1; 31], |_| ()).unwrap_err();
        assert!(matches!(refusal, Refusal::Secret { length: 31 }), "{refusal}");
    }

    #[test]
    fn what_cannot_carry_a_mark_is_refused_by_name() {
        let bytes = encode(Format::Off, &shapes::octahedron()).unwrap();
        let refusal =
            mark(File { name: "gem.off".into(), bytes }, Identity::default(), &[1; 32], |_| ()).unwrap_err();
        assert!(refusal.to_string().starts_with("gem.off: "), "{refusal}");
    }
}
