//! Points and lines: vertices without a face, which go along with the surface that they are drawn on.

use std::collections::BTreeMap;

use super::claims::Claims;
use super::elements::{Component, Elements};
use super::geometry::Reader;
use super::json::Shape;
use super::scene::Shown;
use crate::coordinate::is_finite;
use crate::error::ParseError;
use crate::placement::Placement;

/// Positions of points and lines that no surface has, by accessor.
type Loose = BTreeMap<u32, (Elements, Placement)>;

impl Reader<'_> {
    /// Reads the positions of points and lines behind those of all surfaces. `false` when some are unsound or are
    /// something else, too: then none of them is read.
    pub(super) fn read_loose(&mut self, shown: &[Shown]) -> Result<bool, ParseError> {
        let Some(loose) = self.loose(shown) else { return Ok(false) };
        if !self.stand_alone(&loose) {
            return Ok(false);
        }
        for (accessor, (_, placement)) in &loose {
            self.positions(*accessor, placement)?;
        }
        Ok(true)
    }

    /// What there is; `None` when some of it is no list of positions.
    fn loose(&self, shown: &[Shown]) -> Option<Loose> {
        let mut loose = Loose::new();
        for Shown { mesh, placement, .. } in shown {
            let Some(placement) = placement else { continue };
            let primitives = self.root.meshes.get(*mesh).map_or(&[][..], |m| &m.primitives);
            for accessor in primitives.iter().filter_map(|primitive| primitive.loose()) {
                if loose.contains_key(&accessor) || self.known(accessor).is_some() {
                    continue;
                }
                let elements = self.accessors.elements(accessor).ok()?;
                let whole = elements.shape == Shape::Vec3 && elements.component != Component::U32;
                let finite = |element| is_finite(&placement.world(&self.stored(&elements, element)));
                if !whole || elements.has_gaps() || !(0..elements.count).all(finite) {
                    return None;
                }
                loose.insert(accessor, (elements, *placement));
            }
        }
        Some(loose)
    }

    /// Whether no byte of theirs belongs to other data.
    fn stand_alone(&self, loose: &Loose) -> bool {
        if loose.is_empty() {
            return true;
        }
        let mut claims = Claims::new(&self.accessors.lengths());
        let mut keys = Vec::new();
        for (accessor, (elements, _)) in loose {
            let key = elements.key(*accessor);
            if !keys.contains(&key) {
                keys.push(key);
                if !claims.take_all(elements) {
                    return false;
                }
            }
        }
        let mut budget = self.bytes.saturating_mul(16).saturating_add(4096);
        let accessors = (0..).take(self.root.accessors.len());
        let others = accessors.filter(|&index| self.key_of(index).is_none_or(|key| !keys.contains(&key)));
        let stretches = others.flat_map(|index| self.accessors.stretches(index).unwrap_or_default());
        let images = self.root.images.iter().filter_map(|i| self.accessors.whole_view(i.buffer_view?));
        stretches
            .map(|(_, stretch)| stretch)
            .chain(images)
            .all(|stretch| claims.meets(&stretch, &mut budget) == Some(false))
    }
}
