//! From the scene to points and triangles.
//!
//! What is stored once comes once: position data that several primitives use are one block, placed where the
//! scene shows it first. Blocks must not share bytes with anything else, since moving the one would move the other.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ops::Range;

use nalgebra::Point3;
use sombrero_mesh::Soup;

use super::accessor::{Accessors, Holds, buffers_of};
use super::block::{Block, Bounds};
use super::buffers::Buffers;
use super::claims::Claims;
use super::container::Container;
use super::elements::{Component, Elements, Key};
use super::error::{again_and_again, compressed, malformed, overlapping};
use super::json::{Accessor, Primitive, Root, Shape, spans_of_three};
use super::places::Places;
use super::scene::{self, Shown};
use super::shading::Shading;
use super::write::Layout;
use crate::attributes::Attributes;
use crate::coordinate::is_finite;
use crate::error::{ParseError, Place};
use crate::input::Source;
use crate::notes;
use crate::parsed::Parsed;
use crate::placement::Placement;
use crate::polygon;

const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

impl Primitive {
    /// Whether it is a surface that is read.
    fn is_surface(&self) -> bool {
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
    refuse_compression(root)?;
    let shown = scene::shown(root)?;
    let needed = needed_buffers(root, &shown)?;
    let buffers = Buffers::load(source, &container, text, root, &needed)?;
    let mut reader = Reader::new(source, root, &buffers);
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
    let Reader { soup, blocks, repeated, shading, places, .. } = reader;
    let places = places.into_list();
    let format = container.format;
    let layout = Layout { container, origins: buffers.origins, blocks, bounds, shading };
    Ok(Parsed {
        repeated_triangles: repeated,
        places,
        draws_loose,
        notes,
        companions: buffers.companions,
        ..Parsed::new(format, soup, attributes(root), layout)
    })
}

fn refuse_compression(root: &Root<'_>) -> Result<(), ParseError> {
    let packed = |name: &&String| {
        let name = name.to_ascii_lowercase();
        ["compression", "draco", "meshopt"].iter().any(|word| name.contains(word))
    };
    root.extensions_required.iter().find(packed).map_or(Ok(()), |name| Err(compressed(name)))
}

/// The buffers that hold geometry of the meshes that are shown.
fn needed_buffers(root: &Root<'_>, shown: &[Shown]) -> Result<BTreeSet<u32>, ParseError> {
    let placed = shown.iter().filter(|s| s.placement.is_some());
    let meshes: BTreeSet<usize> = placed.map(|s| s.mesh).collect();
    let mut buffers = BTreeSet::new();
    let primitives = meshes.iter().filter_map(|m| root.meshes.get(*m)).flat_map(|m| &m.primitives);
    let mut seen = HashSet::new();
    for primitive in primitives.filter(|p| p.is_surface()) {
        if primitive.extensions.draco.is_some() {
            return Err(compressed("KHR_draco_mesh_compression"));
        }
        let vertices = &primitive.attributes;
        let accessors = [vertices.position, primitive.indices, vertices.normal, vertices.tangent];
        for accessor in accessors.into_iter().flatten().filter(|a| seen.insert(*a)) {
            buffers.extend(buffers_of(root, accessor)?);
        }
    }
    Ok(buffers)
}

/// Sentences about the meshes that are not read.
fn left_alone(root: &Root<'_>, shown: &[Shown]) -> Vec<String> {
    const UNSEEN: u8 = 0;
    const FLAT: u8 = 1;
    const READ: u8 = 2;
    let mut states = vec![UNSEEN; root.meshes.len()];
    for shown in shown {
        if let Some(state) = states.get_mut(shown.mesh) {
            *state = (*state).max(if shown.placement.is_some() { READ } else { FLAT });
        }
    }
    let of = |state: u8| states.iter().filter(|s| **s == state).count();
    let meshes = |count, which| notes::stays(count, ["mesh", "meshes"], which);
    let unseen = meshes(of(UNSEEN), "that no scene shows");
    let flat = meshes(of(FLAT), "that a node scales to nothing or beyond all numbers");
    unseen.into_iter().chain(flat).collect()
}

/// A primitive: its block, its indices and its mode.
type Drawn = (usize, Option<Key>, u32);

pub(super) struct Reader<'a> {
    pub(super) root: &'a Root<'a>,
    pub(super) accessors: Accessors<'a>,
    source: Source<'a>,
    /// All bytes there are: no more points than these, and hardly more corners.
    pub(super) bytes: u64,
    corners_left: u64,
    pub(super) claims: Claims,
    soup: Soup,
    blocks: Vec<Block>,
    pub(super) block_of: HashMap<u32, usize>,
    pub(super) block_of_key: HashMap<Key, usize>,
    /// Triangles and vertices of each primitive that was read.
    drawn: HashMap<Drawn, (u64, Range<u32>)>,
    /// Triangles of a mesh that was read.
    totals: Vec<Option<u64>>,
    repeated: u64,
    shading: Shading,
    places: Places,
}

impl<'a> Reader<'a> {
    fn new(source: Source<'a>, root: &'a Root<'a>, buffers: &'a Buffers<'a>) -> Self {
        let lengths = buffers.lengths();
        let bytes = lengths.iter().sum::<usize>() as u64;
        Self {
            root,
            accessors: Accessors::new(root, buffers),
            source,
            bytes,
            corners_left: bytes.saturating_add(1024),
            claims: Claims::new(&lengths),
            soup: Soup::default(),
            blocks: Vec::new(),
            block_of: HashMap::new(),
            block_of_key: HashMap::new(),
            drawn: HashMap::new(),
            totals: vec![None; root.meshes.len()],
            repeated: 0,
            shading: Shading::default(),
            places: Places::default(),
        }
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
        let block = self.block(position, placement)?;
        let indices = match primitive.indices {
            Some(accessor) => Some((accessor, self.index_elements(accessor)?)),
            None => None,
        };
        let first = self.blocks.get(block).map_or(*placement, |b| b.placement);
        let key = (block, indices.as_ref().map(|(accessor, e)| e.key(*accessor)), primitive.mode);
        if let Some((triangles, vertices)) = self.drawn.get(&key) {
            self.repeated = self.repeated.saturating_add(*triangles);
            self.places.show(mesh, vertices.clone(), &first, placement);
            return Ok(*triangles);
        }
        let corners = self.corners(block, indices.as_ref())?;
        let vertices = spanned(&corners);
        self.places.show(mesh, vertices.clone(), &first, placement);
        let before = self.soup.triangles.len();
        match primitive.mode {
            STRIP => polygon::strip(&corners, &mut self.soup.triangles),
            FAN => polygon::fan(&corners, &mut self.soup.triangles),
            _ => self.soup.triangles.extend_from_slice(corners.as_chunks().0),
        }
        let triangles = before..self.soup.triangles.len();
        let count = triangles.len() as u64;
        self.drawn.insert(key, (count, vertices));
        if let Some(normal) = primitive.attributes.normal {
            let tangent = primitive.attributes.tangent;
            self.shading.add(&self.accessors, block, triangles, normal, tangent)?;
        }
        Ok(count)
    }

    /// The block of a `POSITION` accessor, read now if it is new.
    pub(super) fn block(&mut self, accessor: u32, placement: &Placement) -> Result<usize, ParseError> {
        if let Some(&block) = self.block_of.get(&accessor) {
            return Ok(block);
        }
        let elements = self.accessors.elements(accessor)?;
        let key = elements.key(accessor);
        let block = match self.block_of_key.get(&key) {
            Some(&block) => block,
            None => self.new_block(accessor, elements, placement)?,
        };
        self.block_of.insert(accessor, block);
        self.block_of_key.insert(key, block);
        Ok(block)
    }

    fn new_block(
        &mut self,
        accessor: u32,
        elements: Elements,
        placement: &Placement,
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
            let point = placement.world(&self.stored(&elements, element));
            if !is_finite(&point) {
                let name = format!("accessor {accessor}, position");
                return Err(ParseError::NonFinite { place: Place::Element { name, index: element } });
            }
            self.soup.points.push(point);
        }
        self.blocks.push(Block { elements, placement: *placement, first });
        Ok(self.blocks.len() - 1)
    }

    pub(super) fn stored(&self, elements: &Elements, element: usize) -> Point3<f64> {
        let raw = elements
            .slot(element)
            .map_or([0.0; 3], |(store, offset)| elements.raw(self.accessors.bytes(store), offset));
        Point3::from(raw.map(|c| elements.meaning(c)))
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

    /// The points that the corners of a primitive are.
    fn corners(&mut self, block: usize, indices: Option<&(u32, Elements)>) -> Result<Vec<u32>, ParseError> {
        let (first, count) = self.blocks.get(block).map_or((0, 0), |b| (b.first, b.elements.count));
        // The number of vertices was checked to fit 32 bits.
        let first = first as u32;
        let Some((accessor, elements)) = indices else {
            return Ok((first..first + count as u32).collect());
        };
        let needed = elements.count as u64;
        self.corners_left = self.corners_left.checked_sub(needed).ok_or(ParseError::Overclaimed {
            element: "index".into(),
            count: needed,
            needed,
            available: self.corners_left,
        })?;
        let corner = |element| {
            let index = elements.slot(element).map_or(0.0, |(store, offset)| {
                elements.component.get(self.accessors.bytes(store).get(offset..).unwrap_or_default())
            }) as u32;
            if (index as usize) < count {
                return Ok(first + index);
            }
            let place = Place::Element { name: format!("accessor {accessor}, index"), index: element };
            Err(ParseError::IndexOutOfRange { place, index: index.into(), first: 0, count })
        };
        (0..elements.count).map(corner).collect()
    }

    /// Refuses positions that are something else, too. Whether normals are something else, too.
    fn refuse_shared_bytes(&mut self) -> Result<bool, ParseError> {
        self.shading.leave_out(&self.block_of_key);
        let lengths = self.accessors.lengths();
        let mut normals = Claims::new(if self.shading.is_empty() { &[] } else { &lengths });
        let mut shared = self.shading.claim(&mut normals);
        let mut budget = self.bytes.saturating_mul(16).saturating_add(4096);
        let mut seen = HashSet::new();
        for index in (0..).take(self.root.accessors.len()) {
            let key = self.key_of(index);
            let is_position = key.is_some_and(|key| self.block_of_key.contains_key(&key));
            let is_normal = key.is_some_and(|key| self.shading.has(&key));
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
        let spans = |block: usize, accessor: &Accessor<'_>| {
            let find = |array: Option<_>| array.and_then(|array| spans_of_three(text, array));
            Bounds { block, min: find(accessor.min), max: find(accessor.max) }
        };
        let accessors = (0..).zip(&self.root.accessors);
        let found = accessors.filter_map(|(index, accessor)| {
            let block = self.block_of_key.get(&self.key_of(index)?)?;
            Some(spans(*block, accessor))
        });
        found.filter(|bounds| bounds.min.is_some() || bounds.max.is_some()).collect()
    }
}

/// From the smallest to the largest number.
fn spanned(corners: &[u32]) -> Range<u32> {
    let (least, largest) = (corners.iter().min(), corners.iter().max());
    least.zip(largest).map_or(0..0, |(least, largest)| *least..*largest + 1)
}

/// What the file holds beside positions and faces.
fn attributes(root: &Root<'_>) -> Attributes {
    let mut names = Attributes::default();
    for primitive in root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        note_vertices(primitive, &mut names);
        match primitive.mode {
            0 => names.note("points"),
            1..TRIANGLES => names.note("lines"),
            _ => {}
        }
        if primitive.material.is_some() {
            names.note("materials");
        }
        if !primitive.targets.is_empty() {
            names.note("morph targets");
        }
    }
    let nodes = &root.nodes;
    let others = [
        ("materials", !root.materials.is_empty()),
        ("images", !root.images.is_empty()),
        ("skins", !root.skins.is_empty() || nodes.iter().any(|n| n.skin.is_some())),
        ("animations", !root.animations.is_empty()),
        ("cameras", !root.cameras.is_empty()),
        ("lights", root.extensions.lights.is_some()),
        ("instances", nodes.iter().any(|n| n.extensions.instances.is_some())),
    ];
    others.iter().filter(|(_, there)| *there).for_each(|(name, _)| names.note(name));
    names
}

fn note_vertices(primitive: &Primitive, names: &mut Attributes) {
    let vertices = &primitive.attributes;
    if vertices.normal.is_some() {
        names.note("normals");
    }
    if vertices.tangent.is_some() {
        names.note("tangents");
    }
    for name in &vertices.others {
        let common = [
            ("TEXCOORD_", "texture coordinates"),
            ("COLOR_", "colours"),
            ("JOINTS_", "skins"),
            ("WEIGHTS_", "skins"),
        ];
        let known = common.iter().find(|(prefix, _)| name.starts_with(prefix));
        names.note(known.map_or(name, |(_, common)| common));
    }
}
