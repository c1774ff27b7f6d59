//! Other positions in the same file: bytes of buffers, and the few numbers and names of the JSON that follow them.

use std::ops::Range;

use nalgebra::Point3;

use super::Layout;
use super::accessor::Elements;
use super::buffers::{Origin, data_uri, encoded, quoted};
use super::geometry::{Block, Bounds};
use crate::document::{Companion, Parsed, Rewrite, Rewritten};
use crate::error::WriteError;
use crate::splice::Splice;
use crate::text;

/// The stores, as far as they change.
pub(super) struct Patches<'a> {
    source: &'a [u8],
    origins: &'a [Origin],
    companions: &'a [Companion],
    changed: Vec<Option<Vec<u8>>>,
}

impl<'a> Patches<'a> {
    fn new(source: &'a [u8], origins: &'a [Origin], companions: &'a [Companion]) -> Self {
        Self { source, origins, companions, changed: vec![None; origins.len()] }
    }

    /// A store as it was read.
    pub(super) fn old(&self, store: usize) -> &'a [u8] {
        self.origins.get(store).map_or(&[], |origin| origin.bytes(self.source, self.companions))
    }

    /// A store as it will be.
    fn new_bytes(&self, store: usize) -> &[u8] {
        self.changed.get(store).and_then(Option::as_deref).unwrap_or_else(|| self.old(store))
    }

    /// Writes the first three numbers of an element; `false` when it is not stored.
    pub(super) fn put(&mut self, elements: &Elements, element: usize, raw: [f64; 3]) -> bool {
        let Some((store, offset)) = elements.slot(element) else { return false };
        let old = self.old(store);
        let Some(slot) = self.changed.get_mut(store) else { return false };
        let bytes = slot.get_or_insert_with(|| old.to_vec());
        let size = elements.component.size();
        for (axis, value) in raw.into_iter().enumerate() {
            if let Some(place) = bytes.get_mut(offset + axis * size..) {
                elements.component.put(value, place);
            }
        }
        true
    }
}

impl Layout {
    /// The file with new positions; see [`Rewrite`] for the choices.
    pub(crate) fn rewrite(
        &self,
        source: &[u8],
        parsed: &Parsed,
        new: &[Point3<f64>],
        how: &Rewrite,
    ) -> Result<Rewritten, WriteError> {
        let old = &parsed.soup.points;
        let mut patches = Patches::new(source, &self.origins, &parsed.companions);
        let mut moved = Vec::with_capacity(self.blocks.len());
        for block in &self.blocks {
            moved.push(block.write(old, new, &mut patches)?);
        }
        let mut edits = self.new_bounds(source, &moved, &patches);
        if how.renew_normals {
            self.shading.turn(&self.blocks, &parsed.soup.triangles, old, new, &mut patches);
        }
        let companions = self.new_names(parsed, how, &patches, &mut edits);
        let bytes = self
            .assemble(source, edits, &patches)
            .ok_or(WriteError::TooMany { format: parsed.format, count: parsed.soup.triangles.len() })?;
        Ok(Rewritten { bytes, companions })
    }

    /// The numbers of `min` and `max` that are no longer true.
    fn new_bounds(&self, source: &[u8], moved: &[bool], patches: &Patches<'_>) -> Vec<Edit> {
        let mut edits = Vec::new();
        let mut extremes: Vec<Option<Extremes>> = vec![None; self.blocks.len()];
        for bounds in &self.bounds {
            let Some(block) = self.blocks.get(bounds.block) else { continue };
            if !moved.get(bounds.block).copied().unwrap_or(false) {
                continue;
            }
            let Some(slot) = extremes.get_mut(bounds.block) else { continue };
            let extremes = slot.get_or_insert_with(|| Extremes::of(&block.elements, patches));
            bounds.follow(self.json(source), &block.elements, extremes, &mut edits);
        }
        edits
    }

    /// Names for the buffers that have files of their own, and the contents of data URIs.
    fn new_names(
        &self,
        parsed: &Parsed,
        how: &Rewrite,
        patches: &Patches<'_>,
        edits: &mut Vec<Edit>,
    ) -> Vec<Companion> {
        let single = parsed.companions.len() == 1;
        let mut companions = Vec::new();
        for (store, origin) in self.origins.iter().enumerate() {
            match origin {
                Origin::Chunk(_) => {}
                Origin::Inline(inline) => {
                    if let Some(bytes) = patches.changed.get(store).and_then(Option::as_deref) {
                        edits.push(Edit { span: inline.span.clone(), text: inline.uri(bytes) });
                    }
                }
                Origin::Beside { span, companion } => {
                    let bytes = patches.new_bytes(store);
                    let text = match &how.stem {
                        Some(stem) => {
                            let number = if single { String::new() } else { format!("-{companion}") };
                            let name = format!("{stem}{number}.bin");
                            let text = quoted(&encoded(&name));
                            companions.push(Companion { name, bytes: bytes.to_vec() });
                            text
                        }
                        None => data_uri(bytes),
                    };
                    edits.push(Edit { span: span.clone(), text });
                }
            }
        }
        companions
    }

    /// The JSON of `source`, from which all spans count.
    fn json<'a>(&self, source: &'a [u8]) -> &'a [u8] {
        source.get(self.container.json.clone()).unwrap_or_default()
    }

    fn assemble(&self, source: &[u8], mut edits: Vec<Edit>, patches: &Patches<'_>) -> Option<Vec<u8>> {
        let mut patched = None;
        for (origin, changed) in self.origins.iter().zip(&patches.changed) {
            if let (Origin::Chunk(range), Some(bytes)) = (origin, changed) {
                let out = patched.get_or_insert_with(|| source.to_vec());
                out.get_mut(range.clone())?.copy_from_slice(bytes);
            }
        }
        if edits.is_empty() {
            return Some(patched.unwrap_or_else(|| source.to_vec()));
        }
        let source = patched.as_deref().unwrap_or(source);
        edits.sort_by_key(|edit| edit.span.start);
        let mut splice = Splice::new(self.json(source));
        for edit in edits {
            splice.replace(edit.span, |out| out.extend_from_slice(edit.text.as_bytes()));
        }
        self.container.with_json(source, splice.finish())
    }
}

/// What takes the place of some bytes of the JSON.
struct Edit {
    span: Range<usize>,
    text: String,
}

impl Block {
    /// Stores the points that moved. Whether any byte changed.
    fn write(
        &self,
        old: &[Point3<f64>],
        new: &[Point3<f64>],
        patches: &mut Patches<'_>,
    ) -> Result<bool, WriteError> {
        let mut changed = false;
        let range = self.first..self.first + self.elements.count;
        let [old, new] = [old, new].map(|points| points.get(range.clone()).unwrap_or_default());
        for (element, (old, new)) in old.iter().zip(new).enumerate() {
            let vertex = self.first + element;
            if text::same(old, new) {
                continue;
            }
            let raw = self.spell(vertex, new)?;
            if !patches.put(&self.elements, element, raw) {
                return Err(WriteError::NotStored { vertex });
            }
            changed = true;
        }
        Ok(changed)
    }

    fn spell(&self, vertex: usize, world: &Point3<f64>) -> Result<[f64; 3], WriteError> {
        let stored = self.placement.stored(world);
        let values = [stored.x, stored.y, stored.z];
        let raw = values.map(|value| self.elements.spelling(value));
        for (raw, value) in raw.into_iter().zip(values) {
            if !self.elements.fits(raw) {
                return Err(match self.elements.component.bounds() {
                    Some(_) => WriteError::OffGrid { vertex, value },
                    None => WriteError::Overflow { vertex, value },
                });
            }
        }
        Ok(raw)
    }
}

/// The smallest and largest stored numbers, before and after.
#[derive(Debug, Clone)]
struct Extremes {
    before: [[f64; 3]; 2],
    after: [[f64; 3]; 2],
}

impl Extremes {
    fn of(elements: &Elements, patches: &Patches<'_>) -> Self {
        let mut found = Self { before: NOTHING, after: NOTHING };
        for element in 0..elements.count {
            let slot = elements.slot(element);
            let raw = |bytes: &[u8]| slot.map_or([0.0; 3], |(_, offset)| elements.raw(bytes, offset));
            let store = slot.map_or(usize::MAX, |(store, _)| store);
            widen(&mut found.before, raw(patches.old(store)));
            widen(&mut found.after, raw(patches.new_bytes(store)));
        }
        found
    }
}

/// The smallest and largest of no numbers.
pub(super) const NOTHING: [[f64; 3]; 2] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];

/// Takes one more point into the smallest and largest coordinates.
pub(super) fn widen([low, high]: &mut [[f64; 3]; 2], point: [f64; 3]) {
    for ((low, high), value) in low.iter_mut().zip(high).zip(point) {
        *low = low.min(value);
        *high = high.max(value);
    }
}

impl Bounds {
    fn follow(&self, json: &[u8], elements: &Elements, extremes: &Extremes, edits: &mut Vec<Edit>) {
        let ends = [&self.min, &self.max].into_iter().zip(extremes.before.iter().zip(&extremes.after));
        for (spans, (before, after)) in ends {
            for (span, (before, after)) in spans.iter().flatten().zip(before.iter().zip(after)) {
                let spelled = json.get(span.clone()).and_then(|s| std::str::from_utf8(s).ok());
                let told = spelled.and_then(|s| s.parse::<f64>().ok());
                // 0.1 tells a 32-bit float as well as all the digits of it do.
                let holds = told.is_some_and(|told| elements.spelled_raw(told) == *after);
                if before != after && !holds {
                    edits.push(Edit { span: span.clone(), text: number(elements, *after) });
                }
            }
        }
    }
}

impl Elements {
    /// The stored number nearest to one of the JSON.
    fn spelled_raw(&self, told: f64) -> f64 {
        if self.component.bounds().is_some() { told } else { f64::from(told as f32) }
    }
}

/// A stored number as JSON.
fn number(elements: &Elements, value: f64) -> String {
    if elements.component.bounds().is_some() { format!("{value}") } else { format!("{value:?}") }
}
