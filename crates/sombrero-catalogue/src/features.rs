//! The numbers of a landmark that are compared, in bytes, and the cells into which their space is cut.
//!
//! A landmark has [`NUMBERS`] combinations of its features, those that attacks change least compared with what tells
//! landmarks apart (linear discriminant analysis: Fisher 1936, Rao 1948), each written in quarters of what an attack changes it
//! by. The space of eight of them is cut into 256 cells by the nearest of as many centroids, that of the other eight as
//! well: 65,536 cells of pairs, whose nearest ones are found without looking at all (the inverted multi-index: Babenko and
//! Lempitsky 2012). Within a cell a bit for each number says on which side of the centroid it lies (Hamming embedding:
//! Jégou, Douze and Schmid 2008).
//!
//! Directions and centroids stand in `features.bin`, which `cargo xtask catalogue --train` makes of generated shapes. They are
//! fixed for good: catalogues are written in their terms.

use std::sync::LazyLock;

use sombrero_landmarks::Features;

use crate::bytes::Bytes;

/// Numbers that are kept of a landmark.
pub(crate) const NUMBERS: usize = 16;
const HALF: usize = NUMBERS / 2;
const CENTROIDS: usize = 256;
/// A sixteenth of twice the mean squared distance from the mean.
const TELLING: u32 = 300;
/// Cells of a catalogue.
pub(crate) const CELLS: usize = CENTROIDS * CENTROIDS;

/// A landmark's looks: their squared differences are distances.
pub(crate) type Looks = [i8; NUMBERS];

struct Table {
    mean: Features,
    rows: [Features; NUMBERS],
    centroids: [[[i8; HALF]; CENTROIDS]; 2],
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let mut bytes = Bytes(include_bytes!("features.bin"));
    // The file has its length by a test.
    let mut float = || bytes.array().map_or(0.0, f32::from_le_bytes);
    let mut vector = || -> Features { std::array::from_fn(|_| float()) };
    let (mean, rows) = (vector(), std::array::from_fn(|_| vector()));
    let mut centroid = || bytes.array::<HALF>().unwrap_or_default().map(|x| x as i8);
    let centroids = std::array::from_fn(|_| std::array::from_fn(|_| centroid()));
    Table { mean, rows, centroids }
});

/// Keeps what tells landmarks apart.
pub(crate) fn looks(features: &Features) -> Looks {
    let table = &*TABLE;
    let centred: Features = std::array::from_fn(|k| features[k] - table.mean[k]);
    table.rows.each_ref().map(|row| {
        let product: f32 = row.iter().zip(&centred).map(|(a, b)| a * b).sum();
        product.round().clamp(-127.0, 127.0) as i8
    })
}

/// Squared distance.
pub(crate) fn apart(a: &[i8], b: &[i8]) -> u32 {
    a.iter().zip(b).map(|(a, b)| (i32::from(*a) - i32::from(*b)).pow(2) as u32).sum()
}

/// How far a landmark looks from the usual: a plane, and what is most like it.
pub(crate) fn unusual(looks: &Looks) -> u32 {
    apart(looks, &[0; NUMBERS])
}

/// How much it tells that something looks so, from 1 for what is everywhere to 16.
pub(crate) fn telling(looks: &Looks) -> u32 {
    (unusual(looks) / TELLING).clamp(1, 16)
}

/// The cell that looks lie in.
pub(crate) fn cell(looks: &Looks) -> u16 {
    let nearest = |half: usize| -> u16 {
        let mine = &looks[half * HALF..(half + 1) * HALF];
        let all = (0u16..).zip(&TABLE.centroids[half]).map(|(k, centroid)| (apart(mine, centroid), k));
        all.min().map_or(0, |found| found.1)
    };
    nearest(0) * CENTROIDS as u16 + nearest(1)
}

/// The cells nearest to the looks, nearest first, at most `count`.
pub(crate) fn cells_near(looks: &Looks, count: usize) -> Vec<u16> {
    let nearest = |half: usize| {
        let mine = &looks[half * HALF..(half + 1) * HALF];
        let all = (0u32..).zip(&TABLE.centroids[half]);
        let mut all: Vec<(u32, u32)> = all.map(|(k, centroid)| (apart(mine, centroid), k)).collect();
        all.sort_unstable();
        all
    };
    let (first, second) = (nearest(0), nearest(1));
    let mut pairs = Vec::new();
    for (i, a) in first.iter().enumerate().take(count) {
        // The pair (i, j) comes after the (i + 1) (j + 1) - 1 pairs of smaller numbers.
        for b in second.iter().take(count.div_ceil(i + 1)) {
            pairs.push((a.0 + b.0, a.1 * CENTROIDS as u32 + b.1));
        }
    }
    pairs.sort_unstable();
    pairs.truncate(count);
    pairs.into_iter().map(|(_, cell)| cell as u16).collect()
}

/// A bit for each number: whether it lies above the centroid of a cell.
pub(crate) fn signature(looks: &Looks, cell: u16) -> u16 {
    let halves = [usize::from(cell) / CENTROIDS, usize::from(cell) % CENTROIDS];
    let centre = |k: usize| TABLE.centroids[k / HALF][halves[k / HALF]][k % HALF];
    (0..NUMBERS).filter(|&k| looks[k] > centre(k)).fold(0, |bits, k| bits | 1 << k)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_landmarks::NUMBERS as FEATURES;

    #[test]
    fn the_table_is_whole() {
        let length = 4 * FEATURES * (1 + NUMBERS) + 2 * CENTROIDS * HALF;
        assert_eq!(include_bytes!("features.bin").len(), length);
        assert!(TABLE.rows.iter().flatten().all(|x| x.is_finite()));
        for half in &TABLE.centroids {
            let mut known = half.to_vec();
            known.sort_unstable();
            known.dedup();
            assert_eq!(known.len(), CENTROIDS);
        }
    }

    proptest! {
        #[test]
        fn the_nearest_cell_comes_first_and_none_twice(looks in prop::array::uniform16(any::<i8>()), count in 1usize..80) {
            let cells = cells_near(&looks, count);
            prop_assert_eq!(cells.len(), count);
            let centre = |cell: u16| {
                let halves = [usize::from(cell) / CENTROIDS, usize::from(cell) % CENTROIDS];
                [TABLE.centroids[0][halves[0]], TABLE.centroids[1][halves[1]]].concat()
            };
            prop_assert_eq!(apart(&looks, &centre(cells[0])), apart(&looks, &centre(cell(&looks))));
            let distances: Vec<u32> = cells.iter().map(|c| apart(&looks, &centre(*c))).collect();
            prop_assert!(distances.is_sorted());
            let farther = (0..=u16::MAX).filter(|c| apart(&looks, &centre(*c)) < distances[count - 1]);
            prop_assert!(farther.count() < count);
            let mut known = cells;
            known.sort_unstable();
            known.dedup();
            prop_assert_eq!(known.len(), count);
        }
    }
}
