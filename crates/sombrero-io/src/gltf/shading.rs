//! Normals and tangents, turned as the surface around them turns.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use nalgebra::{Matrix3, Point3, Vector3};

use super::accessor::Accessors;
use super::block::Block;
use super::claims::Claims;
use super::elements::{Component, Elements, Key};
use super::json::Shape;
use super::patches::Patches;
use crate::error::ParseError;
use crate::normals::{self, NONE, Stored, Turn};
use crate::placement::Placement;

/// The normals and tangents of what was read.
#[derive(Debug, Clone, Default)]
pub(super) struct Shading {
    /// Each `NORMAL` accessor once.
    lists: Vec<List>,
    /// Each `TANGENT` accessor once, with the list whose turns it takes.
    tangents: Vec<(usize, List)>,
    /// Which triangles have the normals of which list.
    parts: Vec<Part>,
    /// The list of an accessor, unless its type is none for normals.
    list_of: HashMap<u32, Option<usize>>,
    list_of_key: HashMap<Key, usize>,
    tangents_seen: HashSet<Key>,
}

/// Directions of a block's points, one for each from the element `start` on.
#[derive(Debug, Clone)]
struct List {
    elements: Elements,
    block: usize,
    start: usize,
}

#[derive(Debug, Clone)]
struct Part {
    triangles: Range<usize>,
    block: usize,
    /// The element of the block that the first normal belongs to.
    start: usize,
    list: usize,
}

/// Whether elements can be directions: floats, or whole numbers that stand for -1 to 1.
fn is_direction(elements: &Elements, shape: Shape) -> bool {
    let whole = matches!(elements.component, Component::I8 | Component::I16) && elements.normalized;
    elements.shape == shape && (whole || elements.component == Component::F32)
}

impl Shading {
    /// Adds the normals of a primitive.
    pub(super) fn add(
        &mut self,
        accessors: &Accessors<'_>,
        (block, start): (usize, usize),
        triangles: Range<usize>,
        normal: u32,
        tangent: Option<u32>,
    ) -> Result<(), ParseError> {
        let list = match self.list_of.get(&normal) {
            Some(list) => *list,
            None => {
                let list = self.new_list(accessors.elements(normal)?, normal, (block, start));
                self.list_of.insert(normal, list);
                list
            }
        };
        let Some(list) = list else { return Ok(()) };
        self.parts.push(Part { triangles, block, start, list });
        if let Some(tangent) = tangent.filter(|t| !self.tangents_seen.contains(&Key::Own(*t))) {
            let elements = accessors.elements(tangent)?;
            let key = elements.key(tangent);
            self.tangents_seen.insert(Key::Own(tangent));
            if is_direction(&elements, Shape::Vec4)
                && !elements.has_gaps()
                && (key == Key::Own(tangent) || self.tangents_seen.insert(key))
            {
                self.tangents.push((list, List { elements, block, start }));
            }
        }
        Ok(())
    }

    // One without bytes could be longer than the file, and cannot be turned.
    fn new_list(
        &mut self,
        elements: Elements,
        accessor: u32,
        (block, start): (usize, usize),
    ) -> Option<usize> {
        if !is_direction(&elements, Shape::Vec3) || elements.has_gaps() {
            return None;
        }
        let key = elements.key(accessor);
        let next = self.lists.len();
        let list = *self.list_of_key.entry(key).or_insert(next);
        if list == next {
            self.lists.push(List { elements, block, start });
        }
        Some(list)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.lists.is_empty()
    }

    /// All normals and tangents.
    pub(super) fn elements(&self) -> impl Iterator<Item = &Elements> {
        self.lists.iter().chain(self.tangents.iter().map(|(_, list)| list)).map(|list| &list.elements)
    }

    /// Whether these are normals or tangents.
    pub(super) fn has(&self, key: &Key) -> bool {
        self.list_of_key.contains_key(key) || self.tangents_seen.contains(key)
    }

    /// Leaves out normals that are positions at the same time, as on a sphere: they turn with those.
    pub(super) fn leave_out(&mut self, is_position: impl Fn(&Elements) -> bool) {
        if self.lists.iter().any(|list| is_position(&list.elements)) {
            *self = Self::default();
        }
    }

    /// Takes the bytes of all normals and tangents. Whether some of them are shared.
    pub(super) fn claim(&self, claims: &mut Claims) -> bool {
        let tangents = self.tangents.iter().map(|(_, list)| list);
        self.lists.iter().chain(tangents).any(|list| !claims.take_all(&list.elements))
    }

    /// Turns what belongs to triangles that turn when the points go from `old` to `new`.
    pub(super) fn turn(
        &self,
        blocks: &[Block],
        triangles: &[[u32; 3]],
        old: &[Point3<f64>],
        new: &[Point3<f64>],
        patches: &mut Patches<'_>,
    ) {
        let Some((stored, starts)) = self.stored(blocks, triangles, patches) else { return };
        let turns = normals::turns(&stored, triangles, old, new);
        let turns_of = |list: usize| starts.get(list).and_then(|start| turns.get(*start..)).unwrap_or(&[]);
        for (index, list) in self.lists.iter().enumerate() {
            let Some(block) = blocks.get(list.block) else { continue };
            list.turn(block, Frame::of_normals, turns_of(index), patches);
        }
        for (index, list) in &self.tangents {
            let Some(block) = blocks.get(list.block) else { continue };
            let count = self.lists.get(*index).map_or(0, |l| l.elements.count);
            let turns = turns_of(*index);
            list.turn(block, Frame::of_tangents, turns.get(..count).unwrap_or(turns), patches);
        }
    }

    /// All normals as the world has them, and where each list begins; `None` when there are none.
    fn stored(
        &self,
        blocks: &[Block],
        triangles: &[[u32; 3]],
        patches: &Patches<'_>,
    ) -> Option<(Stored, Vec<usize>)> {
        let total: usize = self.lists.iter().map(|list| list.elements.count).sum();
        if total == 0 || total >= NONE as usize {
            return None;
        }
        let mut values = Vec::with_capacity(total);
        let mut starts = Vec::with_capacity(self.lists.len());
        for list in &self.lists {
            starts.push(values.len());
            let mut frames = Frames::new(blocks.get(list.block)?, list.start, Frame::of_normals);
            values.extend((0..list.elements.count).map(|i| frames.at(i).world * list.value(i, patches)));
        }
        let mut corners = vec![[NONE; 3]; triangles.len()];
        for part in &self.parts {
            let first = blocks.get(part.block)?.first + part.start;
            let count = self.lists.get(part.list)?.elements.count;
            let start = *starts.get(part.list)?;
            let normal = |vertex: u32| {
                let element = (vertex as usize).checked_sub(first).filter(|e| *e < count);
                element.and_then(|e| u32::try_from(start + e).ok()).unwrap_or(NONE)
            };
            let range = part.triangles.clone();
            for (corner, triangle) in corners.get_mut(range.clone())?.iter_mut().zip(triangles.get(range)?) {
                *corner = triangle.map(normal);
            }
        }
        Some((Stored { values, corners, slots: Vec::new(), text: false }, starts))
    }
}

impl List {
    /// A direction as it is stored.
    fn value(&self, element: usize, patches: &Patches<'_>) -> Vector3<f64> {
        let raw = self
            .elements
            .slot(element)
            .map_or([0.0; 3], |(store, offset)| self.elements.raw(patches.old(store), offset));
        Vector3::from(raw.map(|c| self.elements.meaning(c)))
    }

    fn turn(&self, block: &Block, of: fn(&Placement) -> Frame, turns: &[Turn], patches: &mut Patches<'_>) {
        let mut frames = Frames::new(block, self.start, of);
        for (element, turn) in (0..self.elements.count).zip(turns) {
            let frame = frames.at(element);
            let stored = self.value(element, patches);
            let world = frame.world * stored;
            let turned = turn.of(&world);
            // No turn gives the same bits.
            if turned == world {
                continue;
            }
            let Some(direction) = (frame.back * turned).try_normalize(0.0) else { continue };
            let value = direction * stored.norm();
            let spelled: [f64; 3] =
                std::array::from_fn(|axis| self.elements.spelling(value.get(axis).copied().unwrap_or(0.0)));
            let clamped = spelled.map(|c| match self.elements.component.bounds() {
                Some((_, largest)) => c.clamp(-largest, largest),
                None => c,
            });
            if clamped.iter().all(|c| c.is_finite()) {
                patches.put(&self.elements, element, clamped);
            }
        }
    }
}

/// The frames of a list's elements, one after the other: neighbours mostly have the same.
struct Frames<'a> {
    block: &'a Block,
    start: usize,
    of: fn(&Placement) -> Frame,
    last: (Placement, Frame),
}

impl<'a> Frames<'a> {
    fn new(block: &'a Block, start: usize, of: fn(&Placement) -> Frame) -> Self {
        let placement = *block.placement(start);
        Self { block, start, of, last: (placement, of(&placement)) }
    }

    fn at(&mut self, element: usize) -> Frame {
        let placement = self.block.placement(self.start.saturating_add(element));
        if *placement != self.last.0 {
            self.last = (*placement, (self.of)(placement));
        }
        self.last.1
    }
}

/// How directions go from the file to the world and back.
#[derive(Debug, Clone, Copy)]
struct Frame {
    world: Matrix3<f64>,
    back: Matrix3<f64>,
}

impl Frame {
    /// With the world `A x + t`, normals go by the transpose of the inverse of `A`.
    fn of_normals(placement: &Placement) -> Self {
        let back = placement.linear().transpose();
        Self { world: back.try_inverse().unwrap_or_else(Matrix3::identity), back }
    }

    /// Tangents go by `A`.
    fn of_tangents(placement: &Placement) -> Self {
        let world = *placement.linear();
        Self { world, back: world.try_inverse().unwrap_or_else(Matrix3::identity) }
    }
}
