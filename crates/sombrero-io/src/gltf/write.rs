//! Other positions in the same file: bytes of buffers, and the few numbers and names of the JSON that follow them.

use std::collections::HashMap;
use std::ops::Range;

use nalgebra::Point3;
use sombrero_mesh::Soup;

use super::block::{Block, Bounds};
use super::buffers::{Origin, data_uri, encoded, quoted};
use super::container::Container;
use super::elements::Elements;
use super::patches::Patches;
use super::repack::repack;
use super::shading::Shading;
use crate::coordinate;
use crate::error::{ParseError, Place, WriteError};
use crate::parsed::{self, Companion, Original, Rewrite, Rewritten};
use crate::splice::Splice;
use crate::text;

/// Where the positions stand.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) container: Container,
    /// The buffers that hold geometry: stores, by number.
    pub(super) origins: Vec<Origin>,
    pub(super) blocks: Vec<Block>,
    pub(super) bounds: Vec<Bounds>,
    pub(super) shading: Shading,
    /// Why positions cannot move, if they cannot.
    pub(super) fixed: Option<String>,
}

impl parsed::Layout for Layout {
    fn misplaced(&self, _: &[u8], vertex: usize) -> ParseError {
        let block = self.blocks.iter().rfind(|block| block.first <= vertex);
        let (accessor, first) = block.map_or((0, 0), |block| (block.accessor, block.first));
        let name = format!("accessor {accessor}, position");
        ParseError::NonFinite { place: Place::Element { name, index: vertex - first } }
    }

    fn steps(&self, soup: &Soup) -> Vec<f32> {
        let of = |block: &Block| {
            let points = soup.points.get(block.first..block.first + block.elements.count).unwrap_or_default();
            points.iter().enumerate().map(|(element, p)| block.step(element, p)).collect::<Vec<f32>>()
        };
        self.blocks.iter().flat_map(of).collect()
    }

    fn rewrite(
        &self,
        original: &Original<'_>,
        points: &[Point3<f64>],
        how: &Rewrite,
    ) -> Result<Rewritten, WriteError> {
        let Original { bytes: source, soup, companions } = *original;
        if let Some(why) = &self.fixed
            && !soup.points.iter().zip(points).all(|(old, new)| text::same(old, new))
        {
            return Err(WriteError::Fixed { why: why.clone() });
        }
        let mut patches = Patches::new(source, &self.origins, companions);
        let mut moved = Vec::with_capacity(self.blocks.len());
        for block in &self.blocks {
            moved.push(block.write(&soup.points, points, &mut patches)?);
        }
        let mut edits = self.new_bounds(source, &moved, &patches);
        if how.renew_normals {
            self.shading.turn(&self.blocks, &soup.triangles, &soup.points, points, &mut patches);
        }
        let too_long = || WriteError::TooMany { format: self.container.format, count: soup.triangles.len() };
        let text = std::str::from_utf8(self.json(source)).unwrap_or_default();
        repack(text.trim_end_matches('\0'), &self.origins, &mut patches, &mut edits).ok_or_else(too_long)?;
        let companions = self.new_names(companions.len() == 1, how, &patches, &mut edits);
        let bytes = self.assemble(source, edits, &patches).ok_or_else(too_long)?;
        Ok(Rewritten { bytes, companions })
    }
}

impl Block {
    /// The distance between neighbouring numbers at one of its points, which stands at `world`, in model units.
    fn step(&self, element: usize, world: &Point3<f64>) -> f32 {
        let placement = self.placement(element);
        let largest = placement.stored(world).coords.amax();
        let step = match self.elements.component.bounds() {
            Some((_, most)) if self.elements.normalized => 1.0 / most,
            Some(_) => 1.0,
            None => coordinate::step_of_single(largest),
        };
        (step * placement.scale()) as f32
    }
}

impl Layout {
    /// The numbers of `min` and `max` that are no longer true.
    fn new_bounds(&self, source: &[u8], moved: &[bool], patches: &Patches<'_>) -> Vec<Edit> {
        let mut edits = Vec::new();
        let mut extremes: HashMap<(usize, Range<usize>), Extremes> = HashMap::new();
        for bounds in &self.bounds {
            let Some(block) = self.blocks.get(bounds.block) else { continue };
            if !moved.get(bounds.block).copied().unwrap_or(false) {
                continue;
            }
            let range = bounds.elements.clone();
            let extremes = extremes
                .entry((bounds.block, range.clone()))
                .or_insert_with(|| Extremes::of(&block.elements, range, patches));
            bounds.follow(self.json(source), &block.elements, extremes, &mut edits);
        }
        edits
    }

    /// Names for the buffers that have files of their own (a `single` one or several), and the contents of data URIs.
    fn new_names(
        &self,
        single: bool,
        how: &Rewrite,
        patches: &Patches<'_>,
        edits: &mut Vec<Edit>,
    ) -> Vec<Companion> {
        let mut companions = Vec::new();
        for (store, origin) in self.origins.iter().enumerate() {
            match origin {
                Origin::Chunk(_) | Origin::Packed(_) | Origin::Decoded(_) => {}
                Origin::Inline(inline) => {
                    if let Some(bytes) = patches.changed(store) {
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
                            let holds_geometry = patches.holds_geometry(*companion);
                            companions.push(Companion { name, bytes: bytes.to_vec(), holds_geometry });
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
        let chunk = self.origins.iter().position(|origin| matches!(origin, Origin::Chunk(_)));
        let chunk = chunk.and_then(|store| patches.changed(store));
        if edits.is_empty() && chunk.is_none() {
            return Some(source.to_vec());
        }
        edits.sort_by_key(|edit| edit.span.start);
        let json = (!edits.is_empty()).then(|| {
            let mut splice = Splice::new(self.json(source));
            for edit in edits {
                splice.replace(edit.span, |out| out.extend_from_slice(edit.text.as_bytes()));
            }
            splice.finish()
        });
        self.container.with_content(source, json, chunk)
    }
}

/// What takes the place of some bytes of the JSON.
pub(super) struct Edit {
    pub(super) span: Range<usize>,
    pub(super) text: String,
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
            let raw = self.spell(element, new)?;
            if !patches.put(&self.elements, element, raw) {
                return Err(WriteError::NotStored { vertex });
            }
            changed = true;
        }
        Ok(changed)
    }

    fn spell(&self, element: usize, world: &Point3<f64>) -> Result<[f64; 3], WriteError> {
        let stored = self.placement(element).stored(world);
        let vertex = self.first + element;
        let coordinate = |value| self.elements.coordinate(vertex, value);
        Ok([coordinate(stored.x)?, coordinate(stored.y)?, coordinate(stored.z)?])
    }
}

/// The smallest and largest stored numbers, before and after.
#[derive(Debug, Clone)]
struct Extremes {
    before: [[f64; 3]; 2],
    after: [[f64; 3]; 2],
}

impl Extremes {
    fn of(elements: &Elements, range: Range<usize>, patches: &Patches<'_>) -> Self {
        let mut found = Self { before: NOTHING, after: NOTHING };
        for element in range {
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
