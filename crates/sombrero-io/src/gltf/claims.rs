//! Which bytes belong to whom: positions and normals must not share theirs with other data.

use super::elements::Elements;

/// Equal pieces of a store at equal distances.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Stretch {
    pub(super) store: usize,
    pub(super) start: usize,
    pub(super) size: usize,
    pub(super) stride: usize,
    pub(super) count: usize,
}

/// Bytes that are taken.
#[derive(Debug)]
pub(super) struct Claims {
    /// A bit for each byte of each store.
    bits: Vec<Vec<u64>>,
}

impl Claims {
    /// Nothing is taken yet.
    pub(super) fn new(lengths: &[usize]) -> Self {
        Self { bits: lengths.iter().map(|length| vec![0; length.div_ceil(64)]).collect() }
    }

    /// Takes some bytes; `false` when some of them were taken before.
    pub(super) fn take(&mut self, store: usize, start: usize, size: usize) -> bool {
        let Some(bits) = self.bits.get_mut(store) else { return size == 0 };
        let mut free = true;
        for (word, mask) in masks(start, size) {
            if let Some(word) = bits.get_mut(word) {
                free &= *word & mask == 0;
                *word |= mask;
            }
        }
        free
    }

    /// Takes every stored element; `false` when some of their bytes were taken before.
    pub(super) fn take_all(&mut self, elements: &Elements) -> bool {
        let size = elements.size();
        let indices: Box<dyn Iterator<Item = usize>> = if elements.has_gaps() {
            Box::new(elements.sparse.iter().map(|(element, _)| *element as usize))
        } else {
            Box::new(0..elements.count)
        };
        for element in indices {
            if let Some((store, offset)) = elements.slot(element)
                && !self.take(store, offset, size)
            {
                return false;
            }
        }
        true
    }

    fn touches(&self, store: usize, start: usize, size: usize) -> bool {
        let Some(bits) = self.bits.get(store) else { return false };
        masks(start, size).any(|(word, mask)| bits.get(word).is_some_and(|word| word & mask != 0))
    }

    /// Whether some of these bytes are taken. What it costs to look is taken off `budget`; `None` when that is
    /// used up.
    pub(super) fn meets(&self, stretch: &Stretch, budget: &mut u64) -> Option<bool> {
        let Stretch { store, start, size, stride, count } = *stretch;
        // Pieces without gaps are looked at as one.
        let (size, stride, count) =
            if size == stride { (size * count, 0, count.min(1)) } else { (size, stride, count) };
        *budget = budget.checked_sub((count as u64) * (1 + size as u64 / 64))?;
        Some((0..count).any(|i| self.touches(store, start + i * stride, size)))
    }
}

/// The words of a bit set that a range of bits is in, and which bits of each.
fn masks(start: usize, size: usize) -> impl Iterator<Item = (usize, u64)> {
    let end = start + size;
    let words = if size == 0 { 0..0 } else { start / 64..end.div_ceil(64) };
    words.map(move |word| {
        let low = start.saturating_sub(word * 64);
        let high = (end - word * 64).min(64);
        (word, (u64::MAX >> (64 - (high - low))) << low)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_taken_once() {
        let mut claims = Claims::new(&[200, 10]);
        assert!(claims.take(0, 60, 10));
        assert!(claims.take(0, 70, 130));
        assert!(claims.take(1, 0, 10));
        assert!(claims.take(0, 0, 60));
        assert!(!claims.take(0, 128, 1));
    }

    #[test]
    fn every_byte_of_a_range_counts() {
        for (start, size) in [(0, 1), (63, 1), (63, 2), (64, 64), (1, 190), (191, 9)] {
            let mut claims = Claims::new(&[200]);
            assert!(claims.take(0, start, size));
            for byte in 0..200 {
                let inside = (start..start + size).contains(&byte);
                assert_eq!(claims.touches(0, byte, 1), inside, "{start} {size} {byte}");
            }
        }
    }

    #[test]
    fn looking_has_a_price() {
        let claims = Claims::new(&[100]);
        let stretch = Stretch { store: 0, start: 0, size: 2, stride: 4, count: 20 };
        let mut budget = 25;
        assert_eq!(claims.meets(&stretch, &mut budget), Some(false));
        assert_eq!(claims.meets(&stretch, &mut budget), None);
    }
}
