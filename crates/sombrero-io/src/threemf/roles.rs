//! What slicers say of volumes that are never printed: modifiers, negative volumes, places for and against supports.
//!
//! PrusaSlicer keeps all volumes of an object in one mesh and tells in `Metadata/Slic3r_PE_model.config` which triangles are
//! which; Bambu Studio and OrcaSlicer make each a component and tell its kind in `Metadata/model_settings.config`. A table
//! that cannot be read says nothing.

use std::collections::HashMap;
use std::ops::RangeInclusive;

use super::archive::Budget;
use super::model::Part;
use super::package::Package;
use super::xml::{Step, Tag, Xml};
use crate::error::ParseError;

const PRUSA: &str = "Metadata/Slic3r_PE_model.config";
const BAMBU: &str = "Metadata/model_settings.config";

/// The kinds of volumes that are printed, in both programs' words.
const PRINTED: [&str; 2] = ["ModelPart", "normal_part"];

/// Volumes that are not printed.
#[derive(Debug, Default)]
pub(super) struct Roles {
    /// For each object of the model that the package names, the triangles that are not.
    triangles: HashMap<u32, Vec<RangeInclusive<u64>>>,
    /// For each object, the components that are not, by their objects.
    components: HashMap<u32, Vec<u32>>,
}

/// An element that something is said of.
enum Open {
    Volume { object: u32, triangles: RangeInclusive<u64>, is_printed: bool },
    Other,
}

impl Roles {
    /// What the slicers' tables in a package say.
    pub(super) fn read(package: &Package<'_>, budget: &mut Budget) -> Self {
        let mut roles = Self::default();
        for name in [PRUSA, BAMBU] {
            let Some(entry) = package.find(name) else { continue };
            let Ok(bytes) = package.archive.unpack(entry, budget) else { continue };
            let mut found = Self::default();
            if found.read_table(&bytes).is_ok() {
                roles.triangles.extend(found.triangles);
                roles.components.extend(found.components);
            }
        }
        roles
    }

    fn read_table(&mut self, bytes: &[u8]) -> Result<(), ParseError> {
        let mut xml = Xml::new("settings".into(), bytes)?;
        let mut open: Vec<Open> = Vec::new();
        let mut object = None;
        loop {
            match xml.step()? {
                Step::Open(tag) => {
                    let element = self.element(&xml, tag, &mut object, open.last_mut())?;
                    if tag.empty {
                        self.close(element);
                    } else {
                        open.push(element);
                    }
                }
                Step::Close => self.close(open.pop().unwrap_or(Open::Other)),
                Step::End => return Ok(()),
            }
        }
    }

    fn element<'a>(
        &mut self,
        xml: &Xml<'a>,
        tag: Tag<'a>,
        object: &mut Option<u32>,
        parent: Option<&mut Open>,
    ) -> Result<Open, ParseError> {
        let text = |name| {
            let [span] = xml.pick(tag, [name])?;
            xml.maybe(tag, span)
        };
        let number = |name| Ok(text(name)?.and_then(|value| value.parse::<u64>().ok()));
        let id = |name| Ok::<_, ParseError>(number(name)?.and_then(|id| u32::try_from(id).ok()));
        match (xml.name(tag).1, *object) {
            ("object", _) => *object = id("id")?,
            ("part", Some(object)) => {
                let is_printed = text("subtype")?.is_none_or(|kind| PRINTED.contains(&&*kind));
                if let (false, Some(part)) = (is_printed, id("id")?) {
                    self.components.entry(object).or_default().push(part);
                }
            }
            ("volume", Some(object)) => {
                if let (Some(first), Some(last)) = (number("firstid")?, number("lastid")?) {
                    return Ok(Open::Volume { object, triangles: first..=last, is_printed: true });
                }
            }
            ("metadata", _) => {
                if let Some(Open::Volume { is_printed, .. }) = parent {
                    let (key, value) = (text("key")?.unwrap_or_default(), text("value")?.unwrap_or_default());
                    match &*key {
                        "volume_type" => *is_printed = PRINTED.contains(&&*value),
                        // What came before `volume_type`.
                        "modifier" => *is_printed &= &*value != "1",
                        _ => {}
                    }
                }
            }
            _ => {}
        }
        Ok(Open::Other)
    }

    fn close(&mut self, element: Open) {
        if let Open::Volume { object, triangles, is_printed: false } = element {
            self.triangles.entry(object).or_default().push(triangles);
        }
    }

    /// Marks the objects that are not printed. A component stands for its object, which slicers do not share between kinds.
    pub(super) fn apply(&self, parts: &mut [Part]) {
        let mut unprinted = Vec::new();
        for (id, components) in &self.components {
            let Some(part) = parts.first() else { continue };
            let object = part.object(*id).and_then(|object| part.objects.get(object));
            let links = object.and_then(|object| part.components.get(object.components.clone()));
            let named = links.into_iter().flatten().filter(|link| components.contains(&link.id));
            unprinted.extend(named.map(|link| (link.part, link.id)));
        }
        for (part, id) in unprinted {
            let part = parts.get_mut(part);
            if let Some(part) = part
                && let Some(object) = part.object(id).and_then(|object| part.objects.get_mut(object))
            {
                object.unprinted = true;
            }
        }
    }

    /// The triangles of an object of the model that the package names that are not printed; `count` are all of them.
    pub(super) fn unprinted(&self, id: u32, count: usize) -> Option<Vec<bool>> {
        let ranges = self.triangles.get(&id)?;
        let mut unprinted = vec![false; count];
        for range in ranges {
            let [first, last] =
                [*range.start(), *range.end()].map(|i| usize::try_from(i).unwrap_or(usize::MAX));
            let triangles = unprinted.get_mut(first.min(count)..last.saturating_add(1).min(count));
            triangles.unwrap_or_default().fill(true);
        }
        Some(unprinted)
    }

    /// How many volumes of an object are not printed.
    pub(super) fn volumes(&self, id: u32) -> usize {
        self.triangles.get(&id).map_or(0, Vec::len)
    }
}
