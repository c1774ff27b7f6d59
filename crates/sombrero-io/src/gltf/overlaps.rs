//! The same bytes seen through several accessors are the same points: accessors whose elements are partly the same ones are
//! parts of one stretch.

use std::collections::HashMap;
use std::ops::Range;

use super::elements::{Component, Elements, Run};

/// All elements that an accessor could have whose first is one of them: at equal distances in one store, of one type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Lattice {
    store: usize,
    phase: usize,
    stride: usize,
    component: Component,
    normalized: bool,
    width: u8,
}

/// Elements of one lattice that accessors have, each of which shares some with another.
#[derive(Debug, Clone)]
struct Stretch {
    elements: Range<usize>,
    mesh: usize,
    /// Whether several meshes use it.
    is_shared: bool,
}

/// The stretches of a file's positions.
#[derive(Debug, Default)]
pub(super) struct Overlaps {
    stretches: HashMap<Lattice, Vec<Stretch>>,
}

/// An accessor as a part of what it shares elements with.
#[derive(Debug)]
pub(super) struct Part {
    /// All of the elements.
    pub(super) whole: Elements,
    /// Which of them are the accessor's.
    pub(super) range: Range<usize>,
    /// Whether several meshes use some of them.
    pub(super) is_shared: bool,
}

/// Where an accessor that is nothing but a run stands.
fn place(elements: &Elements) -> Option<(Lattice, Range<usize>)> {
    let Run { store, offset, stride } = elements.run()?;
    let Elements { component, normalized, count, .. } = *elements;
    let width = elements.shape.width();
    let lattice = Lattice { store, phase: offset.checked_rem(stride)?, stride, component, normalized, width };
    let first = offset / stride;
    Some((lattice, first..first.checked_add(count)?))
}

impl Overlaps {
    /// The stretches of these accessors, each with the mesh that uses it.
    pub(super) fn new(accessors: impl IntoIterator<Item = (usize, Elements)>) -> Self {
        let mut stretches: HashMap<Lattice, Vec<Stretch>> = HashMap::new();
        for (mesh, accessor) in accessors {
            if let Some((lattice, elements)) = place(&accessor) {
                stretches.entry(lattice).or_default().push(Stretch { elements, mesh, is_shared: false });
            }
        }
        for list in stretches.values_mut() {
            list.sort_by_key(|stretch| (stretch.elements.start, stretch.elements.end));
            let mut joined: Vec<Stretch> = Vec::new();
            for next in list.drain(..) {
                match joined.last_mut().filter(|last| next.elements.start < last.elements.end) {
                    Some(last) => {
                        last.elements.end = last.elements.end.max(next.elements.end);
                        last.is_shared |= last.mesh != next.mesh;
                    }
                    None => joined.push(next),
                }
            }
            *list = joined;
        }
        Self { stretches }
    }

    /// The stretch that holds all elements of an accessor; `None` when there is none.
    pub(super) fn part(&self, elements: &Elements) -> Option<Part> {
        let (lattice, own) = place(elements)?;
        let list = self.stretches.get(&lattice)?;
        let at = list.partition_point(|stretch| stretch.elements.start <= own.start).checked_sub(1)?;
        let stretch = list.get(at).filter(|stretch| own.end <= stretch.elements.end)?;
        let Range { start, end } = stretch.elements;
        let run = elements.run()?;
        let offset = start.checked_mul(lattice.stride)?.checked_add(lattice.phase)?;
        let whole = Elements {
            base: Some(Run { offset, ..run }),
            count: end - start,
            sparse: Vec::new(),
            ..*elements
        };
        Some(Part { whole, range: own.start - start..own.end - start, is_shared: stretch.is_shared })
    }
}

#[cfg(test)]
mod tests {
    use super::super::json::Shape;
    use super::*;

    fn elements(offset: usize, stride: usize, count: usize) -> Elements {
        Elements {
            component: Component::F32,
            normalized: false,
            shape: Shape::Vec3,
            count,
            base: Some(Run { store: 0, offset, stride }),
            sparse: Vec::new(),
            sparse_store: 0,
        }
    }

    #[test]
    fn what_overlaps_is_one_and_what_touches_is_not() {
        let all = [elements(4, 12, 3), elements(28, 12, 2), elements(52, 12, 2), elements(8, 12, 5)];
        let overlaps = Overlaps::new(all.iter().enumerate().map(|(mesh, e)| (mesh, e.clone())));
        let part = |e: &Elements| {
            let part = overlaps.part(e).unwrap();
            (part.whole.base.unwrap().offset, part.whole.count, part.range, part.is_shared)
        };
        assert_eq!(part(&all[0]), (4, 4, 0..3, true));
        assert_eq!(part(&all[1]), (4, 4, 2..4, true));
        assert_eq!(part(&all[2]), (52, 2, 0..2, false));
        assert_eq!(part(&all[3]), (8, 5, 0..5, false));
        assert_eq!(part(&elements(16, 12, 1)), (4, 4, 1..2, true));
        for other in [elements(40, 12, 2), elements(4, 24, 1), elements(64, 12, 3), elements(0, 12, 1)] {
            assert!(overlaps.part(&other).is_none(), "{other:?}");
        }
    }
}
