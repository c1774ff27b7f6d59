//! What a catalogue keeps of a shape.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::bytes::Bytes;
use crate::describe::{Described, described};
use crate::error::ShapeError;
use crate::features::{Looks, NUMBERS};
use crate::pieces::pieces;

/// Landmarks of an original, shared by its pieces.
const COUNT: usize = 128;
/// Landmarks that a piece has at least.
const FEWEST: usize = 24;
/// Coordinates are kept as multiples of this, relative to the root of the area.
const GRAIN: f64 = 1.0 / 4096.0;
/// Bytes of a landmark.
const MARK: usize = NUMBERS + 6 + 2;
/// Bytes of a piece before its landmarks.
const HEAD: usize = 8 * 4 + 4;

/// The landmarks of a shape, for [`Editor::add`](crate::Editor::add). Some kilobytes.
#[derive(Debug, Clone, PartialEq)]
pub struct Portrait {
    pub(crate) pieces: Vec<Likeness>,
}

/// The whole of a shape, or a part of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Likeness {
    /// Of the surface, in model units.
    pub(crate) centroid: Point3<f64>,
    /// Root of the area, in model units.
    pub(crate) size: f64,
    pub(crate) marks: Vec<Mark>,
}

/// A landmark in 24 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mark {
    pub(crate) looks: Looks,
    place: [i16; 3],
    normal: [i8; 2],
}

impl Portrait {
    /// Describes a surface: some 50 milliseconds for 100,000 triangles. Vertices at equal positions count as one; each
    /// part that hangs together is described besides the whole.
    ///
    /// # Errors
    /// [`ShapeError`] when it is no surface.
    pub fn of(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Result<Self, ShapeError> {
        let pieces = pieces(points, triangles)?;
        let share = (COUNT / pieces.len()).max(FEWEST);
        let likeness = |piece| Likeness::of(&described(piece, share, 0));
        Ok(Self { pieces: pieces.par_iter().map(likeness).collect() })
    }

    /// A portrait like this one, each number of each landmark's looks changed by what `change` says next: for measuring
    /// what a fuller catalogue costs.
    #[must_use]
    pub fn shaken(&self, change: &mut dyn FnMut() -> i32) -> Self {
        let mut shaken = self.clone();
        for mark in shaken.pieces.iter_mut().flat_map(|piece| &mut piece.marks) {
            mark.looks = mark.looks.map(|x| (i32::from(x) + change()).clamp(-127, 127) as i8);
        }
        shaken
    }

    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        out.extend((self.pieces.len() as u32).to_le_bytes());
        for piece in &self.pieces {
            let [x, y, z]: [f64; 3] = piece.centroid.coords.into();
            [x, y, z, piece.size].iter().for_each(|x| out.extend(x.to_le_bytes()));
            out.extend((piece.marks.len() as u32).to_le_bytes());
            piece.marks.iter().for_each(|mark| out.extend(mark.bytes()));
        }
    }

    /// `None` for bytes that are none.
    pub(crate) fn read(bytes: &[u8]) -> Option<Self> {
        let mut bytes = Bytes(bytes);
        let count = bytes.u32()? as usize;
        let most = bytes.0.len() / HEAD;
        let pieces = (0..count.min(most + 1)).map(|_| Likeness::read(&mut bytes)).collect::<Option<_>>()?;
        bytes.0.is_empty().then_some(Self { pieces })
    }
}

impl Likeness {
    pub(crate) fn of(described: &Described) -> Self {
        let mark = |landmark: &crate::describe::Landmark| {
            let place = landmark.point.coords.map(|x| (x / GRAIN).round() as i16);
            let looks = landmark.looks.first().copied().unwrap_or_default();
            Mark { looks, place: place.into(), normal: flattened(&landmark.normal) }
        };
        let marks = described.landmarks.iter().map(mark).collect();
        Self { centroid: described.centroid, size: described.size, marks }
    }

    fn read(bytes: &mut Bytes<'_>) -> Option<Self> {
        let [x, y, z, size] = [bytes.f64()?, bytes.f64()?, bytes.f64()?, bytes.f64()?];
        let count = bytes.u32()? as usize;
        let marks = bytes.take(count.checked_mul(MARK)?)?.chunks_exact(MARK).map(Mark::read);
        let marks = marks.collect::<Option<_>>()?;
        (size > 0.0).then_some(Self { centroid: Point3::new(x, y, z), size, marks })
    }
}

impl Mark {
    /// About the centroid, relative to the root of the area.
    pub(crate) fn point(&self) -> Point3<f64> {
        Point3::from(self.place.map(|x| f64::from(x) * GRAIN))
    }

    pub(crate) fn normal(&self) -> Vector3<f64> {
        unflattened(self.normal)
    }

    fn bytes(&self) -> impl Iterator<Item = u8> {
        let place = self.place.into_iter().flat_map(i16::to_le_bytes);
        self.looks.into_iter().map(|x| x as u8).chain(place).chain(self.normal.into_iter().map(|x| x as u8))
    }

    fn read(bytes: &[u8]) -> Option<Self> {
        let mut bytes = Bytes(bytes);
        let looks = bytes.array::<NUMBERS>()?.map(|x| x as i8);
        let [a, b, c, d, e, f] = bytes.array()?;
        let place = [[a, b], [c, d], [e, f]].map(i16::from_le_bytes);
        Some(Self { looks, place, normal: bytes.array::<2>()?.map(|x| x as i8) })
    }
}

/// A direction in two bytes, within a degree: projected onto the octahedron |x| + |y| + |z| = 1, whose lower half is folded out
/// into the corners of the square that the upper half fills (Cigolle et al. 2014).
fn flattened(normal: &Vector3<f64>) -> [i8; 2] {
    let sum = normal.abs().sum();
    let [x, y] = if sum > 0.0 { [normal.x / sum, normal.y / sum] } else { [0.0; 2] };
    let [x, y] = if normal.z < 0.0 { folded(x, y) } else { [x, y] };
    [x, y].map(|x| (x * 127.0).round() as i8)
}

fn unflattened(flat: [i8; 2]) -> Vector3<f64> {
    let [x, y] = flat.map(|x| f64::from(x) / 127.0);
    let z = 1.0 - x.abs() - y.abs();
    let [x, y] = if z < 0.0 { folded(x, y) } else { [x, y] };
    Vector3::new(x, y, z).normalize()
}

/// Across the edge of the upper half; twice is nothing.
fn folded(x: f64, y: f64) -> [f64; 2] {
    [(1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_shapes as shapes;

    proptest! {
        #[test]
        fn directions_are_kept_within_a_degree(v in prop::array::uniform3(-1.0..1.0f64)) {
            let Some(v) = Vector3::from(v).try_normalize(1e-3) else { return Ok(()) };
            prop_assert!(unflattened(flattened(&v)).dot(&v) > 0.9998);
        }

        #[test]
        fn any_two_bytes_are_a_direction(flat in prop::array::uniform2(any::<i8>())) {
            prop_assert!((unflattened(flat).norm() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn what_is_written_is_read() {
        let part = shapes::part(6);
        let portrait = Portrait::of(&part.points, &part.triangles).unwrap();
        let mut bytes = Vec::new();
        portrait.put(&mut bytes);
        assert_eq!(Portrait::read(&bytes), Some(portrait));
        // Whatever is cut off is missed, and what is too much is no portrait.
        assert!((0..bytes.len()).all(|length| Portrait::read(&bytes[..length]).is_none()));
        bytes.push(0);
        assert_eq!(Portrait::read(&bytes), None);
    }
}
