//! From the scene to points and triangles.
//!
//! What is stored once comes once: position data that several primitives use are one block, whose points stand where the
//! scene shows each of them first. Blocks must not share bytes with anything else, since moving the one would move the other.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ops::Range;

use nalgebra::Point3;
use sombrero_mesh::Soup;

use super::accessor::{Accessors, Holds};
use super::attributes::attributes;
use super::block::{Block, Bounds};
use super::buffers::Buffers;
use super::claims::Claims;
use super::container::Container;
use super::draco;
use super::elements::{Component, Elements, Key};
use super::error::{again_and_again, malformed, overlapping};
use super::extensions;
use super::json::{Accessor, Primitive, Root, Shape, spans_of_three};
use super::needed::{left_alone, needed};
use super::overlaps::{Overlaps, Part};
use super::packed;
use super::places::Places;
use super::scene::{self, Shown};
use super::shading::Shading;
use super::write::Layout;
use crate::coordinate::is_finite;
use crate::error::{ParseError, Place};
use crate::input::Source;
use crate::parsed::Parsed;
use crate::placement::{MOST_SHOWN, Placement};
use crate::polygon;

pub(super) const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

impl Primitive {
    /// Whether it is a surface that is read.
    pub(super) fn is_surface(&self) -> bool {
        self.mode >= TRIANGLES && self.attributes.position.is_some()
    }

    /// The positions of points or lines.
    pub(super) fn loose(&self) -> Option<u32> {
        self.attributes.position.filter(|_| self.mode < TRIANGLES)
    }
}

/// Reads what the scene shows.
pub(super) fn read(
    source: Source<'_>,
    container: Container,
    text: &str,
    root: &Root<'_>,
) -> Result<Parsed, ParseError> {
    extensions::check(&root.extensions_required)?;
    let shown = scene::shown(root)?;
    let needed = needed(root, &shown)?;
    let mut buffers = Buffers::load(source, &container, text, root, &needed)?;
    let decoded = draco::decoded(root, &shown, &mut buffers, source.limits)?;
    let mut reader = Reader::new(source, root, &buffers, &decoded);
    let shown = scene::placed(shown, &reader.accessors)?;
    reader.find_overlaps(&shown)?;
    for shown in &shown {
        if let Some(placement) = &shown.placement {
            reader.show(shown.mesh, placement)?;
        }
    }
    let mut notes = left_alone(root, &shown);
    let surfaces = reader.soup.points.len();
    if !reader.read_loose(&shown)? {
        notes.push(
            "Points and lines share bytes with other data, or are none, and stay where they are.".into(),
        );
    }
    let normals_shared = reader.refuse_shared_bytes()?;
    let bounds = reader.bounds(text);
    if reader.blocks.iter().any(|block| block.elements.component != Component::F32) {
        notes.push("Positions are whole numbers (KHR_mesh_quantization): new ones are rounded.".into());
    }
    if normals_shared {
        notes.push("Normals share bytes with other data and are never turned.".into());
        reader.shading = Shading::default();
    }
    let draws_loose = reader.soup.points.len() > surfaces;
    let elements = reader.blocks.iter().map(|block| &block.elements).chain(reader.shading.elements());
    let cannot = packed::cannot_be_written(root, &buffers, elements.flat_map(Elements::stores));
    let fixed = cannot.then_some(packed::FIXED).or((!decoded.is_empty()).then_some(draco::FIXED));
    let fixed = fixed.map(str::to_owned);
    let Reader { soup, blocks, repeated, shading, places, .. } = reader;
    let places = places.into_list();
    let format = container.format;
    let layout =
        Layout { container, origins: buffers.origins, blocks, bounds, shading, fixed: fixed.clone() };
    Ok(Parsed {
        fixed,
        repeated_triangles: repeated,
        places,
        draws_loose,
        notes,
        companions: buffers.companions,
        ..Parsed::new(format, soup, attributes(root), layout)
    })
}

/// A primitive: its block and which of its elements, its indices and its mode.
type Drawn = (usize, [usize; 2], Option<Key>, u32);

/// Stretches of vertices, each with where it stands.
type Stretches = Vec<(Range<u32>, Placement)>;

/// An accessor's positions: some of the elements of a block.
#[derive(Debug, Clone)]
pub(super) struct Positions {
    block: usize,
    elements: Range<usize>,
}

pub(super) struct Reader<'a> {
    pub(super) root: &'a Root<'a>,
    pub(super) accessors: Accessors<'a>,
    source: Source<'a>,
    /// All bytes there are: no more points than these, and hardly more corners.
    pub(super) bytes: u64,
    corners_left: u64,
    pub(super) claims: Claims,
    soup: Soup,
    overlaps: Overlaps,
    blocks: Vec<Block>,
    pub(super) positions_of: HashMap<u32, Positions>,
    block_of_key: HashMap<Key, usize>,
    /// Triangles and vertices of each primitive that was read.
    drawn: HashMap<Drawn, (u64, Stretches)>,
    /// Triangles of a mesh that was read.
    totals: Vec<Option<u64>>,
    repeated: u64,
    shading: Shading,
    places: Places,
    /// How many stretches of points may still be told apart, since each takes more memory than a corner does in the file.
    stretches_left: usize,
}

impl<'a> Reader<'a> {
    fn new(
        source: Source<'a>,
        root: &'a Root<'a>,
        buffers: &'a Buffers<'a>,
        decoded: &'a HashMap<u32, Elements>,
    ) -> Self {
        let lengths = buffers.lengths();
        let bytes = lengths.iter().sum::<usize>() as u64;
        Self {
            root,
            accessors: Accessors::new(root, buffers, decoded),
            source,
            bytes,
            corners_left: bytes.saturating_add(1024),
            claims: Claims::new(&lengths),
            soup: Soup::default(),
            overlaps: Overlaps::default(),
            blocks: Vec::new(),
            positions_of: HashMap::new(),
            block_of_key: HashMap::new(),
            drawn: HashMap::new(),
            totals: vec![None; root.meshes.len()],
            repeated: 0,
            shading: Shading::default(),
            places: Places::default(),
            stretches_left: MOST_SHOWN / 64,
        }
    }

    /// Finds out which positions are the same bytes.
    fn find_overlaps(&mut self, shown: &[Shown]) -> Result<(), ParseError> {
        let (mut list, mut seen) = (Vec::new(), HashSet::new());
        for Shown { mesh, placement, .. } in shown {
            if placement.is_none() || !seen.insert(*mesh) {
                continue;
            }
            let primitives = self.root.meshes.get(*mesh).map_or(&[][..], |m| &m.primitives).iter();
            let accessors: BTreeSet<u32> = primitives.filter_map(|p| p.attributes.position).collect();
            for accessor in accessors {
                // Sparse ones are never the same as others.
                let is_run = self.root.accessors.get(accessor as usize).is_some_and(|a| a.sparse.is_none());
                // What is wrong with one is said when it is read.
                if let Some(Ok(elements)) = is_run.then(|| self.accessors.elements(accessor)) {
                    list.push((*mesh, elements));
                }
            }
        }
        self.overlaps = Overlaps::new(list);
        Ok(())
    }

    /// Reads a mesh, or counts its triangles once more.
    fn show(&mut self, mesh: usize, placement: &Placement) -> Result<(), ParseError> {
        if let Some(total) = self.totals.get(mesh).copied().flatten() {
            self.repeated = self.repeated.saturating_add(total);
            self.places.again(mesh, placement);
            return Ok(());
        }
        let mut total: u64 = 0;
        let root = self.root;
        for primitive in root.meshes.get(mesh).iter().flat_map(|m| &m.primitives) {
            if primitive.mode > FAN {
                return Err(malformed("mesh", mesh, "a primitive has a mode that glTF does not know"));
            }
            if let Some(position) = primitive.attributes.position.filter(|_| primitive.is_surface()) {
                total = total.saturating_add(self.draw(mesh, primitive, position, placement)?);
            }
        }
        if let Some(slot) = self.totals.get_mut(mesh) {
            *slot = Some(total);
        }
        Ok(())
    }

    /// Reads a primitive; the number of its triangles.
    fn draw(
        &mut self,
        mesh: usize,
        primitive: &Primitive,
        position: u32,
        placement: &Placement,
    ) -> Result<u64, ParseError> {
        let positions = self.positions(position, placement)?;
        let Positions { block, elements: Range { start, end } } = positions;
        let indices = match primitive.indices {
            Some(accessor) => Some((accessor, self.index_elements(accessor)?)),
            None => None,
        };
        let key =
            (block, [start, end], indices.as_ref().map(|(accessor, e)| e.key(*accessor)), primitive.mode);
        if let Some((triangles, stretches)) = self.drawn.get(&key) {
            self.repeated = self.repeated.saturating_add(*triangles);
            self.places.show(mesh, stretches, placement);
            return Ok(*triangles);
        }
        let mut corners = self.corners(start..end, indices.as_ref())?;
        let stretches = self.place(block, &corners, placement)?;
        self.places.show(mesh, &stretches, placement);
        // The number of vertices was checked to fit 32 bits.
        let first = self.blocks.get(block).map_or(0, |b| b.first) as u32;
        corners.iter_mut().for_each(|corner| *corner += first);
        let before = self.soup.triangles.len();
        match primitive.mode {
            STRIP => polygon::strip(&corners, &mut self.soup.triangles),
            FAN => polygon::fan(&corners, &mut self.soup.triangles),
            _ => self.soup.triangles.extend_from_slice(corners.as_chunks().0),
        }
        let triangles = before..self.soup.triangles.len();
        let count = triangles.len() as u64;
        self.drawn.insert(key, (count, stretches));
        // Of what is in a Draco stream only positions are read.
        if let Some(normal) = primitive.attributes.normal.filter(|_| primitive.extensions.draco.is_none()) {
            let tangent = primitive.attributes.tangent;
            self.shading.add(&self.accessors, (block, start), triangles, normal, tangent)?;
        }
        Ok(count)
    }

    /// Puts those of a block's elements that nothing has shown yet where a primitive shows them.
    fn place(
        &mut self,
        block: usize,
        elements: &[u32],
        placement: &Placement,
    ) -> Result<Stretches, ParseError> {
        let Self { blocks, soup, accessors, .. } = self;
        let Some(block) = blocks.get_mut(block) else { return Ok(Vec::new()) };
        let mut moved = Vec::new();
        block.show(elements.iter().map(|&e| e as usize), placement, |element| moved.push(element));
        for element in moved {
            let stored = stored(accessors, &block.elements, element);
            let point = placement.world(&stored);
            if is_finite(&stored) && !is_finite(&point) {
                return Err(out_of_bounds(block.first + element));
            }
            if let Some(slot) = soup.points.get_mut(block.first + element) {
                *slot = point;
            }
        }
        let stretches = block.stretches(elements, self.stretches_left);
        self.stretches_left = self.stretches_left.saturating_sub(stretches.len());
        Ok(stretches)
    }

    /// The positions of a `POSITION` accessor, read now if they are new.
    pub(super) fn positions(
        &mut self,
        accessor: u32,
        placement: &Placement,
    ) -> Result<Positions, ParseError> {
        if let Some(positions) = self.positions_of.get(&accessor) {
            return Ok(positions.clone());
        }
        let elements = self.accessors.elements(accessor)?;
        let (whole, range, is_shared) = match self.overlaps.part(&elements) {
            Some(Part { whole, range, is_shared }) => (whole, range, is_shared),
            // Of sparse ones nobody has counted who uses them.
            None => (elements.clone(), 0..elements.count, true),
        };
        let key = whole.key(accessor);
        let block = match self.block_of_key.get(&key) {
            Some(&block) => block,
            None => self.new_block(accessor, whole, placement, is_shared)?,
        };
        let positions = Positions { block, elements: range };
        self.positions_of.insert(accessor, positions.clone());
        self.block_of_key.insert(key, block);
        Ok(positions)
    }

    /// The positions that an accessor holds, of whatever it is said to be; `None` when it holds none, or not only such.
    pub(super) fn known(&self, accessor: u32) -> Option<Positions> {
        if let Some(positions) = self.positions_of.get(&accessor) {
            return Some(positions.clone());
        }
        let stored = self.root.accessors.get(accessor as usize)?;
        if stored.sparse.as_ref().is_some_and(|sparse| sparse.count > 0) {
            return None;
        }
        let part = self.overlaps.part(&self.accessors.elements(accessor).ok()?)?;
        let block = *self.block_of_key.get(&part.whole.key(accessor))?;
        Some(Positions { block, elements: part.range })
    }

    fn new_block(
        &mut self,
        accessor: u32,
        elements: Elements,
        placement: &Placement,
        is_shared: bool,
    ) -> Result<usize, ParseError> {
        if elements.shape != Shape::Vec3 || elements.component == Component::U32 {
            let problem = "positions must be VEC3 of 32-bit floats, or of 8 or 16 bit whole numbers";
            return Err(malformed("accessor", accessor as usize, problem));
        }
        let first = self.soup.points.len();
        let total = first.saturating_add(elements.count);
        // Those that are not stored cost no bytes, so they could be without number.
        let available = self.bytes.max(self.source.bytes.len() as u64);
        if total as u64 > available {
            return Err(ParseError::Overclaimed {
                element: format!("element of accessor {accessor}"),
                count: elements.count as u64,
                needed: total as u64,
                available,
            });
        }
        self.source.limits.check_vertices(total)?;
        if !self.claims.take_all(&elements) {
            return Err(overlapping());
        }
        self.soup.points.reserve(elements.count);
        for element in 0..elements.count {
            let stored = self.stored(&elements, element);
            let point = placement.world(&stored);
            // What is no position in the file may stand where no face is.
            if is_finite(&stored) && !is_finite(&point) {
                return Err(out_of_bounds(first + element));
            }
            self.soup.points.push(point);
        }
        self.blocks.push(Block::new(accessor, elements, *placement, first, is_shared));
        Ok(self.blocks.len() - 1)
    }

    pub(super) fn stored(&self, elements: &Elements, element: usize) -> Point3<f64> {
        stored(&self.accessors, elements, element)
    }

    fn index_elements(&self, accessor: u32) -> Result<Elements, ParseError> {
        let elements = self.accessors.elements(accessor)?;
        let fit = matches!(elements.component, Component::U8 | Component::U16 | Component::U32);
        if elements.shape == Shape::Scalar && fit && !elements.normalized {
            Ok(elements)
        } else {
            let problem = "indices must be SCALAR of unsigned whole numbers";
            Err(malformed("accessor", accessor as usize, problem))
        }
    }

    /// The elements of a block that the corners of a primitive are, some of which it may name.
    fn corners(
        &mut self,
        range: Range<usize>,
        indices: Option<&(u32, Elements)>,
    ) -> Result<Vec<u32>, ParseError> {
        let count = range.len();
        let needed = indices.map_or(count, |(_, elements)| elements.count) as u64;
        self.corners_left = self.corners_left.checked_sub(needed).ok_or(ParseError::Overclaimed {
            element: "index".into(),
            count: needed,
            needed,
            available: self.corners_left,
        })?;
        // The number of vertices was checked to fit 32 bits.
        let start = range.start as u32;
        let Some((accessor, elements)) = indices else {
            return Ok((start..range.end as u32).collect());
        };
        let corner = |element| {
            let index = elements.slot(element).map_or(0.0, |(store, offset)| {
                elements.component.get(self.accessors.bytes(store).get(offset..).unwrap_or_default())
            }) as u32;
            if (index as usize) < count {
                return Ok(start + index);
            }
            let place = Place::Element { name: format!("accessor {accessor}, index"), index: element };
            Err(ParseError::IndexOutOfRange { place, index: index.into(), first: 0, count })
        };
        (0..elements.count).map(corner).collect()
    }

    /// Refuses positions that are something else, too. Whether normals are something else, too.
    fn refuse_shared_bytes(&mut self) -> Result<bool, ParseError> {
        let Self { shading, overlaps, .. } = self;
        shading.leave_out(|elements| overlaps.part(elements).is_some());
        let lengths = self.accessors.lengths();
        let mut normals = Claims::new(if self.shading.is_empty() { &[] } else { &lengths });
        let mut shared = self.shading.claim(&mut normals);
        let mut budget = self.bytes.saturating_mul(16).saturating_add(4096);
        let mut seen = HashSet::new();
        for index in (0..).take(self.root.accessors.len()) {
            let positions = self.known(index);
            let is_position = positions.is_some();
            // Whoever looks at a part of positions again has its bounds to be kept.
            let looked_at = positions.map_or(0, |positions| positions.elements.len() as u64);
            budget = budget.checked_sub(looked_at).ok_or_else(again_and_again)?;
            let is_normal = self.key_of(index).is_some_and(|key| self.shading.has(&key));
            for (holds, stretch) in self.accessors.stretches(index).unwrap_or_default() {
                // The numbers of sparse elements are nothing that may move, whatever those are.
                let own = |this: bool| this && holds != Holds::Places;
                if own(is_position) || !seen.insert((stretch, own(is_normal))) {
                    continue;
                }
                let meets = |claims: &Claims, budget: &mut u64| {
                    claims.meets(&stretch, budget).ok_or_else(again_and_again)
                };
                if meets(&self.claims, &mut budget)? {
                    return Err(overlapping());
                }
                shared |= !own(is_normal) && meets(&normals, &mut budget)?;
            }
        }
        self.refuse_images_in_positions(&mut budget)?;
        Ok(shared)
    }

    fn refuse_images_in_positions(&self, budget: &mut u64) -> Result<(), ParseError> {
        let views: BTreeSet<u32> = self.root.images.iter().filter_map(|i| i.buffer_view).collect();
        for stretch in views.into_iter().filter_map(|view| self.accessors.whole_view(view)) {
            if self.claims.meets(&stretch, budget).ok_or_else(again_and_again)? {
                return Err(overlapping());
            }
        }
        Ok(())
    }

    /// What an accessor is known by; `None` when it is unsound or of another buffer.
    pub(super) fn key_of(&self, index: u32) -> Option<Key> {
        let accessor = self.root.accessors.get(index as usize)?;
        if accessor.sparse.as_ref().is_some_and(|sparse| sparse.count > 0) {
            return Some(Key::Own(index));
        }
        Some(self.accessors.elements(index).ok()?.key(index))
    }

    /// The `min` and `max` that follow the positions.
    fn bounds(&self, text: &str) -> Vec<Bounds> {
        let spans = |positions: Positions, accessor: &Accessor<'_>| {
            let find = |array: Option<_>| array.and_then(|array| spans_of_three(text, array));
            let Positions { block, elements } = positions;
            Bounds { block, elements, min: find(accessor.min), max: find(accessor.max) }
        };
        let accessors = (0..).zip(&self.root.accessors);
        let found = accessors.filter_map(|(index, accessor)| Some(spans(self.known(index)?, accessor)));
        found.filter(|bounds| bounds.min.is_some() || bounds.max.is_some()).collect()
    }
}

/// An element's position as the file has it.
fn stored(accessors: &Accessors<'_>, elements: &Elements, element: usize) -> Point3<f64> {
    let slot = elements.slot(element);
    let raw = slot.map_or([0.0; 3], |(store, offset)| elements.raw(accessors.bytes(store), offset));
    Point3::from(raw.map(|c| elements.meaning(c)))
}

/// A position that is one, put beyond all numbers by the nodes.
fn out_of_bounds(vertex: usize) -> ParseError {
    ParseError::NonFinite { place: Place::Element { name: "vertex".into(), index: vertex } }
}
