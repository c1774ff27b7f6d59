//! Meshes that are shown again: which vertices, and where.

use std::collections::HashMap;
use std::ops::Range;

use sombrero_mesh::Place;

use crate::placement::{MOST_SHOWN, Placement};

/// What a place counts at least: it takes memory, whatever it shows.
const LEAST: usize = 64;

/// Where what was read is shown once more.
#[derive(Debug, Default)]
pub(super) struct Places {
    list: Vec<Place>,
    /// What each mesh that was read shows, and where that stands first.
    drawn: HashMap<usize, Vec<(Range<u32>, Placement)>>,
    /// Vertices at all places so far.
    shown: usize,
}

impl Places {
    /// Notes what a mesh shows at `placement`: stretches of vertices, with where each stands, where another mesh may have
    /// shown it.
    pub(super) fn show(&mut self, mesh: usize, stretches: &[(Range<u32>, Placement)], placement: &Placement) {
        for (vertices, first) in stretches {
            self.add(vertices, first, placement);
        }
        self.drawn.entry(mesh).or_default().extend_from_slice(stretches);
    }

    /// Notes that all of a mesh is shown at `placement`, too.
    pub(super) fn again(&mut self, mesh: usize, placement: &Placement) {
        let drawn = self.drawn.remove(&mesh).unwrap_or_default();
        for (vertices, first) in &drawn {
            if self.shown > MOST_SHOWN {
                break;
            }
            self.add(vertices, first, placement);
        }
        self.drawn.insert(mesh, drawn);
    }

    fn add(&mut self, vertices: &Range<u32>, first: &Placement, placement: &Placement) {
        self.shown = self.shown.saturating_add(vertices.len().max(LEAST));
        if first != placement && self.shown <= MOST_SHOWN {
            self.list.push(placement.after(first, vertices.clone()));
        }
    }

    /// All of them, in the order of the scene.
    pub(super) fn into_list(self) -> Vec<Place> {
        self.list
    }
}
