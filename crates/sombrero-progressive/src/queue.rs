//! A priority queue of elements whose costs change: the cheapest first, ties to the smaller index.
//!
//! A heap of four children a node that knows where each element stands. Every element is in it at most once, so it
//! never grows beyond their number, however often costs change; the usual binary heap with void entries spends
//! most of a large conversion on them.

/// Absent from the heap.
const NOWHERE: u32 = u32::MAX;
const CHILDREN: usize = 4;

/// Elements `0..bound` with non-negative costs.
#[derive(Debug, Clone, Default)]
pub(crate) struct Queue {
    /// Bits of the costs, which order as non-negative numbers do, and elements.
    heap: Vec<(u64, u32)>,
    /// Where in `heap` each element is.
    place: Vec<u32>,
}

impl Queue {
    /// An empty queue for elements below `bound`.
    ///
    /// # Panics
    /// When elements do not fit 32-bit indices.
    pub(crate) fn new(bound: usize) -> Self {
        assert!(bound < NOWHERE as usize, "elements have 32-bit indices");
        Self { heap: Vec::with_capacity(bound), place: vec![NOWHERE; bound] }
    }

    /// Puts an element in with this cost, or changes its cost. A negative cost counts as zero, no number as infinite.
    ///
    /// # Panics
    /// When `element` is not below the bound.
    pub(crate) fn set(&mut self, element: usize, cost: f64) {
        let entry = entry(element, cost);
        let at = self.place[element];
        if at == NOWHERE {
            self.heap.push(entry);
            self.rise(self.heap.len() - 1, entry);
        } else if entry < self.heap[at as usize] {
            self.rise(at as usize, entry);
        } else {
            self.sink(at as usize, entry);
        }
    }

    /// Whether an element of this cost would come next if it were in.
    pub(crate) fn would_be_next(&self, element: usize, cost: f64) -> bool {
        self.heap.first().is_none_or(|first| entry(element, cost) < *first)
    }

    /// Takes the cheapest element out.
    pub(crate) fn pop(&mut self) -> Option<usize> {
        let (_, element) = *self.heap.first()?;
        self.place[element as usize] = NOWHERE;
        let last = self.heap.pop()?;
        if !self.heap.is_empty() {
            self.sink(0, last);
        }
        Some(element as usize)
    }

    /// Puts `entry` at `at` or above.
    fn rise(&mut self, mut at: usize, entry: (u64, u32)) {
        while at > 0 {
            let parent = (at - 1) / CHILDREN;
            if self.heap[parent] < entry {
                break;
            }
            self.put(at, self.heap[parent]);
            at = parent;
        }
        self.put(at, entry);
    }

    /// Puts `entry` at `at` or below.
    fn sink(&mut self, mut at: usize, entry: (u64, u32)) {
        loop {
            let first = CHILDREN * at + 1;
            let children = self.heap.get(first..(first + CHILDREN).min(self.heap.len())).unwrap_or_default();
            let Some((child, &least)) = (first..).zip(children).min_by_key(|(_, entry)| **entry) else {
                break;
            };
            if entry < least {
                break;
            }
            self.put(at, least);
            at = child;
        }
        self.put(at, entry);
    }

    #[inline]
    fn put(&mut self, at: usize, entry: (u64, u32)) {
        self.heap[at] = entry;
        self.place[entry.1 as usize] = at as u32;
    }
}

/// As the heap has it: a negative cost counts as zero, no number as infinite.
fn entry(element: usize, cost: f64) -> (u64, u32) {
    let cost = if cost.is_nan() { f64::INFINITY } else { cost.max(0.0) };
    (cost.to_bits(), element as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_cheapest_comes_first_whatever_was_changed(
            changes in prop::collection::vec((0..30_usize, prop::option::of(-1.0..4.0f64)), 0..200)
        ) {
            let mut queue = Queue::new(30);
            let mut costs = [None; 30];
            let first = |costs: &[Option<f64>; 30]| {
                let waiting = costs.iter().enumerate().filter_map(|(i, c)| c.map(|c| (c, i)));
                waiting.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            };
            for (element, cost) in changes {
                // Few different costs, so that there are ties.
                match cost.map(|c| c.floor()) {
                    Some(cost) => {
                        let next = first(&costs).is_none_or(|first| (cost.max(0.0), element) < first);
                        prop_assert_eq!(queue.would_be_next(element, cost), next);
                        queue.set(element, cost);
                        costs[element] = Some(cost.max(0.0));
                    }
                    None => {
                        let expected = first(&costs).map(|(_, i)| i);
                        prop_assert_eq!(queue.pop(), expected);
                        expected.into_iter().for_each(|i| costs[i] = None);
                    }
                }
            }
            let mut expected: Vec<(f64, usize)> =
                costs.iter().enumerate().filter_map(|(i, c)| c.map(|c| (c, i))).collect();
            expected.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let order: Vec<usize> = std::iter::from_fn(|| queue.pop()).collect();
            prop_assert_eq!(order, expected.into_iter().map(|(_, i)| i).collect::<Vec<_>>());
        }
    }
}
