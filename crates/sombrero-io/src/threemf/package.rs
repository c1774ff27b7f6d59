//! The package: which entries are parts of a 3MF, and which of them is the model.

use std::borrow::Cow;
use std::collections::HashMap;

use percent_encoding::percent_decode;

use super::archive::{Archive, Budget};
use super::xml::{Step, Xml};
use crate::attributes::Attributes;
use crate::error::ParseError;

/// The relationship that leads to the model.
const MODEL: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";

/// How an encrypted part begins.
const ENCRYPTED: &[u8] = b"%3McF";

/// An entry that a name leads to.
#[derive(Debug, Clone, Copy)]
struct Found {
    index: usize,
    /// Whether other entries have the same name.
    ambiguous: bool,
}

/// An archive whose entries can be found by the names that parts have.
#[derive(Debug)]
pub(super) struct Package<'a> {
    pub(super) archive: Archive<'a>,
    names: HashMap<Vec<u8>, Found>,
}

/// What the relationships of a part say.
#[derive(Debug, Default)]
struct Relationships {
    model: Option<String>,
    signed: bool,
}

impl<'a> Package<'a> {
    /// Reads the archive's directory.
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, ParseError> {
        let archive = Archive::open(bytes)?;
        let mut names: HashMap<_, Found> = HashMap::with_capacity(archive.len());
        for index in 0..archive.len() {
            names
                .entry(normal(archive.name(index)))
                .and_modify(|found| found.ambiguous = true)
                .or_insert(Found { index, ambiguous: false });
        }
        Ok(Self { archive, names })
    }

    /// The entry that holds a part.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.names.get(&normal(name.as_bytes())).map(|found| found.index)
    }

    /// The content of a part that has to be readable and replaceable: one entry of its name, whose bytes no
    /// other entry shares.
    pub(super) fn model_text(&self, index: usize, budget: &mut Budget) -> Result<Cow<'a, [u8]>, ParseError> {
        let name = self.archive.name(index);
        if self.names.get(&normal(name)).is_some_and(|found| found.ambiguous) {
            let problem = format!("holds the part `{}` more than once", self.archive.title(index));
            return Err(ParseError::Archive { problem });
        }
        let bytes = self.archive.unpack(index, budget)?;
        self.archive.check_alone(index)?;
        if bytes.starts_with(ENCRYPTED) {
            return Err(secure(format!("the encrypted model part `{}`", self.archive.title(index))));
        }
        Ok(bytes)
    }

    /// The entry of the model, and whether the package is signed.
    pub(super) fn model(&self, budget: &mut Budget) -> Result<(usize, bool), ParseError> {
        let root = self.relationships("_rels/.rels", budget)?;
        let index = match &root.model {
            Some(target) => self.find(target).ok_or_else(|| ParseError::Archive {
                problem: format!("names `{}` as its model, which it does not hold", target.escape_debug()),
            })?,
            None => self.only_model()?,
        };
        let of_model = self.relationships(&relationships_of(self.archive.name(index)), budget)?;
        let signed = self.names.keys().any(|name| name.starts_with(b"_xmlsignatures/"));
        Ok((index, signed || root.signed || of_model.signed))
    }

    /// The model of a package whose relationships name none.
    fn only_model(&self) -> Result<usize, ParseError> {
        let mut models = (0..self.archive.len()).filter(|&index| {
            let name = normal(self.archive.name(index));
            name.starts_with(b"3d/") && name.ends_with(b".model")
        });
        match (models.next(), models.next()) {
            (Some(index), None) => Ok(index),
            (Some(_), Some(_)) => {
                let problem = "holds several 3MF models and does not say which one to show".into();
                Err(ParseError::Archive { problem })
            }
            _ => Err(ParseError::Unsupported {
                what: "a ZIP archive without a 3MF model (an office document or a Java archive, perhaps)"
                    .into(),
                cure: "export the model as 3MF",
            }),
        }
    }

    fn relationships(&self, name: &str, budget: &mut Budget) -> Result<Relationships, ParseError> {
        let mut all = Relationships::default();
        let Some(index) = self.find(name) else { return Ok(all) };
        let bytes = self.archive.unpack(index, budget)?;
        let mut xml = Xml::new(self.archive.title(index), &bytes)?;
        loop {
            let tag = match xml.step()? {
                Step::Open(tag) => tag,
                Step::Close => continue,
                Step::End => return Ok(all),
            };
            if xml.name(tag).1 == "Relationship" {
                let [kind, target] = xml.pick(tag, ["Type", "Target"])?;
                let kind = xml.maybe(tag, kind)?.unwrap_or_default();
                all.note(&kind, || Ok(xml.maybe(tag, target)?.unwrap_or_default().into_owned()))?;
            }
        }
    }

    /// Notes what the names of the entries tell.
    pub(super) fn note(&self, attributes: &mut Attributes) {
        for index in 0..self.archive.len() {
            let name = normal(self.archive.name(index));
            let picture = [&b".png"[..], b".jpg", b".jpeg"].iter().any(|end| name.ends_with(end));
            if picture && (name.starts_with(b"metadata/") || name.starts_with(b"thumbnails/")) {
                attributes.note("thumbnails");
            } else if picture && name.starts_with(b"3d/") {
                attributes.note("textures");
            } else if name.starts_with(b"metadata/") && !name.ends_with(b"/") {
                attributes.note("print settings");
            }
        }
    }
}

impl Relationships {
    fn note(
        &mut self,
        kind: &str,
        target: impl FnOnce() -> Result<String, ParseError>,
    ) -> Result<(), ParseError> {
        if kind == MODEL && self.model.is_none() {
            self.model = Some(target()?);
        }
        if kind.ends_with("/keystore") || kind.ends_with("/encryptedfile") {
            return Err(secure("3MF Secure Content (encrypted parts)".into()));
        }
        self.signed |= kind.contains("/digital-signature/");
        Ok(())
    }
}

/// The error for what the Secure Content extension encrypts.
pub(super) fn secure(what: String) -> ParseError {
    ParseError::Unsupported { what, cure: "export the model again without encryption" }
}

/// The name of the part that holds the relationships of another.
fn relationships_of(name: &[u8]) -> String {
    let name = String::from_utf8_lossy(name);
    let (folder, file) = name.rsplit_once('/').unwrap_or(("", &name));
    format!("{folder}/_rels/{file}.rels")
}

/// A name as parts are compared: in one case, from the root, with nothing escaped.
fn normal(name: &[u8]) -> Vec<u8> {
    let slashed: Vec<u8> = name.iter().map(|&byte| if byte == b'\\' { b'/' } else { byte }).collect();
    let out: Vec<u8> = percent_decode(&slashed).map(|byte| byte.to_ascii_lowercase()).collect();
    let start = out.strip_prefix(b"./").unwrap_or(&out);
    let leading = start.iter().take_while(|&&byte| byte == b'/').count();
    start.get(leading..).unwrap_or_default().to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_compared_as_parts_are() {
        for name in ["/3D/My Part.model", "3d/my%20part.MODEL", "./3D/My Part.model", "3D\\My Part.model"] {
            assert_eq!(normal(name.as_bytes()), b"3d/my part.model");
        }
        assert_eq!(normal(b"100%"), b"100%");
        assert_eq!(relationships_of(b"3D/a.model"), "3D/_rels/a.model.rels");
    }
}
