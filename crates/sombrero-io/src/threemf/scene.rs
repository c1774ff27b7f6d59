//! What the build shows: each mesh once, by the first path to it, and how often it is shown.
//!
//! Components can share components, so there may be more paths than anyone can follow: every object is visited
//! once, and paths are only counted.

use std::collections::HashMap;

use nalgebra::Matrix4;

use super::model::{Link, Part};
use crate::placement::{MOST_SHOWN, Placement};

/// So many components are followed to all places that they have.
const MOST_STEPS: usize = 1 << 16;

/// A component or an item that cannot be followed.
#[derive(Debug)]
pub(super) struct Trouble {
    pub(super) part: usize,
    pub(super) at: usize,
    pub(super) problem: String,
}

/// Where a scene puts a mesh.
#[derive(Debug)]
pub(super) struct Placed {
    pub(super) part: usize,
    pub(super) object: usize,
    /// `None` for a transform that cannot be undone.
    pub(super) placement: Option<Placement>,
    /// How often the scene shows it.
    pub(super) times: u64,
    /// Where it is shown beside that, by as many paths as were followed.
    pub(super) further: Vec<Placement>,
}

/// The meshes that are shown and those that are not.
#[derive(Debug, Default)]
pub(super) struct Scene {
    /// In the order of parts and objects.
    pub(super) placed: Vec<Placed>,
    pub(super) hidden: usize,
    pub(super) supports: usize,
    /// Objects that slicers never print.
    pub(super) unprinted: usize,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    New,
    Open,
    Done,
}

/// An object on the way down.
struct Frame {
    part: usize,
    object: usize,
    /// The components that are still to be visited.
    rest: std::ops::Range<usize>,
    matrix: Matrix4<f64>,
}

struct Walk<'p> {
    parts: &'p [Part],
    /// How many objects stand in the parts before each part.
    bases: Vec<usize>,
    states: Vec<State>,
    /// Part and object, every one behind all that it refers to.
    finished: Vec<(usize, usize)>,
    placed: Vec<Placed>,
}

/// Finds out what is shown.
pub(super) fn read(parts: &[Part]) -> Result<Scene, Trouble> {
    let (mut bases, mut total) = (Vec::new(), 0);
    for part in parts {
        bases.push(total);
        total += part.objects.len();
    }
    let states = vec![State::New; total];
    let mut walk = Walk { parts, bases, states, finished: Vec::new(), placed: Vec::new() };
    let items = parts.first().map_or(&[][..], |part| &part.items);
    if items.is_empty() {
        walk.place_all();
    } else {
        for item in items {
            walk.visit(item)?;
        }
        walk.count(items)?;
        walk.follow_all(items)?;
    }
    Ok(walk.scene())
}

impl Walk<'_> {
    fn key(&self, part: usize, object: usize) -> usize {
        self.bases.get(part).map_or(usize::MAX, |base| base + object)
    }

    fn resolve(&self, from: usize, link: &Link) -> Result<(usize, usize), Trouble> {
        let object = self.parts.get(link.part).and_then(|part| part.object(link.id));
        object.map(|object| (link.part, object)).ok_or_else(|| Trouble {
            part: from,
            at: link.at,
            problem: format!("there is no object {}", link.id),
        })
    }

    fn state(&mut self, part: usize, object: usize) -> Option<&mut State> {
        let key = self.key(part, object);
        self.states.get_mut(key)
    }

    /// Goes down from an item of the build, without recursion.
    fn visit(&mut self, item: &Link) -> Result<(), Trouble> {
        let mut stack = Vec::new();
        stack.extend(self.enter(0, item, &Matrix4::identity())?);
        while let Some(frame) = stack.last_mut() {
            let from = frame.part;
            let link =
                frame.rest.next().zip(self.parts.get(from)).and_then(|(at, part)| part.components.get(at));
            let Some(link) = link else {
                let done = (from, frame.object);
                stack.pop();
                self.finished.push(done);
                if let Some(state) = self.state(done.0, done.1) {
                    *state = State::Done;
                }
                continue;
            };
            let matrix = frame.matrix;
            stack.extend(self.enter(from, link, &matrix)?);
        }
        Ok(())
    }

    /// Places the object that `link` leads to; `None` if it was visited before.
    fn enter(&mut self, from: usize, link: &Link, above: &Matrix4<f64>) -> Result<Option<Frame>, Trouble> {
        let (part, object) = self.resolve(from, link)?;
        match self.state(part, object) {
            Some(state @ State::New) => *state = State::Open,
            Some(State::Open) => {
                let problem = format!("object {} is a component of itself", link.id);
                return Err(Trouble { part: from, at: link.at, problem });
            }
            _ => return Ok(None),
        }
        let matrix = match &link.transform {
            Some(transform) => above * matrix(transform),
            None => *above,
        };
        let Some(found) = self.parts.get(part).and_then(|part| part.objects.get(object)) else {
            return Ok(None);
        };
        if found.is_model() {
            self.placed.push(Placed {
                part,
                object,
                placement: Placement::new(&matrix),
                times: 1,
                further: Vec::new(),
            });
        }
        Ok(Some(Frame { part, object, rest: found.components.clone(), matrix }))
    }

    /// Without a build, every mesh is shown where it is stored.
    fn place_all(&mut self) {
        for (number, part) in self.parts.iter().enumerate() {
            for (object, found) in part.objects.iter().enumerate() {
                if found.is_model() {
                    let placement = Some(Placement::identity());
                    self.placed.push(Placed {
                        part: number,
                        object,
                        placement,
                        times: 1,
                        further: Vec::new(),
                    });
                }
            }
        }
    }

    /// Follows all paths, or as many as there are steps for, and notes where they lead.
    fn follow_all(&mut self, items: &[Link]) -> Result<(), Trouble> {
        if self.placed.iter().all(|placed| placed.times < 2) {
            return Ok(());
        }
        let index: HashMap<(usize, usize), usize> =
            self.placed.iter().enumerate().map(|(i, placed)| ((placed.part, placed.object), i)).collect();
        let (mut steps, mut shown) = (0, 0_usize);
        // The next is last. No object is a component of itself: that was found out.
        let mut open: Vec<(usize, &Link, Matrix4<f64>)> =
            items.iter().rev().map(|item| (0, item, Matrix4::identity())).collect();
        while let Some((from, link, above)) = open.pop() {
            steps += 1;
            if steps > MOST_STEPS || shown > MOST_SHOWN {
                break;
            }
            let (part, object) = self.resolve(from, link)?;
            let matrix = link.transform.as_ref().map_or(above, |transform| above * matrix(transform));
            let Some(part_found) = self.parts.get(part) else { continue };
            let Some(found) = part_found.objects.get(object) else { continue };
            if let Some(placed) = index.get(&(part, object)).and_then(|i| self.placed.get_mut(*i))
                && let Some(placement) = Placement::new(&matrix)
                && placed.placement.is_some_and(|first| first != placement)
            {
                shown = shown.saturating_add(found.points.len());
                placed.further.push(placement);
            }
            let components = part_found.components.get(found.components.clone()).unwrap_or_default();
            open.extend(components.iter().rev().map(|link| (part, link, matrix)));
        }
        Ok(())
    }

    /// Counts the paths to every mesh, from the items downwards.
    fn count(&mut self, items: &[Link]) -> Result<(), Trouble> {
        let mut times = vec![0_u64; self.states.len()];
        let mut add = |key: usize, more: u64| {
            if let Some(count) = times.get_mut(key) {
                *count = count.saturating_add(more);
            }
            times.get(key).copied().unwrap_or(0)
        };
        for item in items {
            let (part, object) = self.resolve(0, item)?;
            add(self.key(part, object), 1);
        }
        for &(part, object) in self.finished.iter().rev() {
            let more = add(self.key(part, object), 0);
            let Some(found) = self.parts.get(part) else { continue };
            let components = found.objects.get(object).map(|object| object.components.clone());
            for link in components.and_then(|range| found.components.get(range)).unwrap_or_default() {
                let (part, object) = self.resolve(part, link)?;
                add(self.key(part, object), more);
            }
        }
        let bases = &self.bases;
        for placed in &mut self.placed {
            let key = bases.get(placed.part).map(|base| base + placed.object);
            placed.times = key.and_then(|key| times.get(key)).copied().unwrap_or(1);
        }
        Ok(())
    }

    fn scene(self) -> Scene {
        let meshes = || self.parts.iter().flat_map(|part| &part.objects).filter(|o| !o.points.is_empty());
        let supports = meshes().filter(|object| object.support).count();
        let unprinted = meshes().filter(|object| !object.support && object.unprinted).count();
        let hidden = meshes().count().saturating_sub(supports + unprinted + self.placed.len());
        let mut placed = self.placed;
        placed.sort_by_key(|placed| (placed.part, placed.object));
        Scene { placed, hidden, supports, unprinted }
    }
}

/// The map of a transform, which is written for row vectors: three rows, then the shift.
fn matrix(m: &[f64; 12]) -> Matrix4<f64> {
    Matrix4::new(
        m[0], m[3], m[6], m[9], //
        m[1], m[4], m[7], m[10], //
        m[2], m[5], m[8], m[11], //
        0.0, 0.0, 0.0, 1.0,
    )
}
