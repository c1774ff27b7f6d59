//! A priority queue of elements whose costs change: the cheapest first, ties to the smaller index.
//!
//! A heap of four children a node that knows where each element stands. Every element is in it at most once, so it
//! never grows beyond their number, however often costs change; the usual binary heap with void entries spends
//! most of a large conversion on them. Siblings share a cache line: place p is the p % 4-th of line p / 4, its
//! children are line p - 2, the root is place 3.

/// Absent from the heap.
const NOWHERE: u32 = u32::MAX;
const CHILDREN: usize = 4;
const ROOT: usize = 3;

/// Bits of a cost, which order as non-negative numbers do, and the element.
type Entry = (u64, u32);

/// No entry: more than any cost.
const NONE: Entry = (u64::MAX, NOWHERE);

/// Entries with the same parent.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Siblings([Entry; CHILDREN]);

/// Elements `0..bound` with non-negative costs.
#[derive(Debug, Clone)]
pub(crate) struct Queue {
    /// [`NONE`] before the root and after the last entry.
    heap: Vec<Siblings>,
    /// Where the next entry goes.
    end: usize,
    /// Where in `heap` each element is.
    place: Vec<u32>,
}

impl Queue {
    /// An empty queue for elements below `bound`.
    ///
    /// # Panics
    /// When elements do not fit 32-bit indices.
    pub(crate) fn new(bound: usize) -> Self {
        assert!(bound < NOWHERE as usize - CHILDREN, "elements have 32-bit indices");
        let heap = vec![Siblings([NONE; CHILDREN]); bound.div_ceil(CHILDREN) + 1];
        Self { heap, end: ROOT, place: vec![NOWHERE; bound] }
    }

    /// Puts an element in with this cost, or changes its cost. A negative cost counts as zero, no number as infinite.
    ///
    /// # Panics
    /// When `element` is not below the bound.
    pub(crate) fn set(&mut self, element: usize, cost: f64) {
        let entry = entry(element, cost);
        let at = self.place[element];
        if at == NOWHERE {
            self.end += 1;
            self.rise(self.end - 1, entry);
        } else if entry < self.at(at as usize) {
            self.rise(at as usize, entry);
        } else {
            self.sink(at as usize, entry);
        }
    }

    /// Whether an element of this cost would come next if it were in.
    pub(crate) fn would_be_next(&self, element: usize, cost: f64) -> bool {
        self.end == ROOT || entry(element, cost) < self.at(ROOT)
    }

    /// Takes the cheapest element out.
    pub(crate) fn pop(&mut self) -> Option<usize> {
        if self.end == ROOT {
            return None;
        }
        let (_, element) = self.at(ROOT);
        self.place[element as usize] = NOWHERE;
        self.end -= 1;
        let last = std::mem::replace(&mut self.heap[self.end / CHILDREN].0[self.end % CHILDREN], NONE);
        if self.end > ROOT {
            self.sink(ROOT, last);
        }
        Some(element as usize)
    }

    #[inline]
    fn at(&self, place: usize) -> Entry {
        self.heap[place / CHILDREN].0[place % CHILDREN]
    }

    /// Puts `entry` at `at` or above.
    fn rise(&mut self, mut at: usize, entry: Entry) {
        while at > ROOT {
            let parent = at / CHILDREN + 2;
            let above = self.at(parent);
            if above < entry {
                break;
            }
            self.put(at, above);
            at = parent;
        }
        self.put(at, entry);
    }

    /// Puts `entry` at `at` or below.
    fn sink(&mut self, mut at: usize, entry: Entry) {
        while let Some(Siblings(children)) = self.heap.get(at - 2) {
            let (mut child, mut least) = (0, children[0]);
            for (i, &other) in children.iter().enumerate().skip(1) {
                if other < least {
                    (child, least) = (i, other);
                }
            }
            if entry < least {
                break;
            }
            self.put(at, least);
            at = CHILDREN * (at - 2) + child;
        }
        self.put(at, entry);
    }

    #[inline]
    fn put(&mut self, at: usize, entry: Entry) {
        self.heap[at / CHILDREN].0[at % CHILDREN] = entry;
        self.place[entry.1 as usize] = at as u32;
    }
}

/// As the heap has it: a negative cost counts as zero, no number as infinite.
fn entry(element: usize, cost: f64) -> Entry {
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
