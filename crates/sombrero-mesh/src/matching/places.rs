//! The places of one component, of which the best are kept.

use super::flood::Placement;

/// How badly pairs of vertices, of the second mesh and of the first, fit on each other: what a component is laid by.
pub type Misfit<'m> = dyn Fn(&[(u32, u32)]) -> f64 + 'm;

/// Places with as many faces, those with the smallest misfit first.
pub(super) struct Places<'m> {
    pub(super) best: Vec<(f64, Placement)>,
    wanted: usize,
    misfit: Option<&'m Misfit<'m>>,
}

impl<'m> Places<'m> {
    /// None yet. So many are wanted: the best ones by the misfit, the first ones without.
    pub(super) fn new(wanted: usize, misfit: Option<&'m Misfit<'m>>) -> Self {
        Self { best: Vec::new(), wanted, misfit }
    }

    /// Whether another would not be taken.
    pub(super) fn are_enough(&self) -> bool {
        self.misfit.is_none() && self.best.len() >= self.wanted
    }

    /// Takes a place, unless better ones are known.
    pub(super) fn add(&mut self, placement: Placement) {
        let faces = placement.faces.len();
        let known = self.best.first().map_or(0, |(_, other)| other.faces.len());
        if faces < known {
            // Places with fewer faces are not the right ones.
            return;
        }
        if faces > known {
            self.best.clear();
        }
        let misfit = self.misfit.map_or(0.0, |misfit| misfit(&placement.vertices));
        let at = self.best.partition_point(|(other, _)| other.total_cmp(&misfit).is_le());
        if at < self.wanted {
            self.best.insert(at, (misfit, placement));
            self.best.truncate(self.wanted);
        }
    }
}
