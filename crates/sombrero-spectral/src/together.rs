//! Several points' fields at once.

use nalgebra::Vector3;
use std::ops::AddAssign;

/// (field, displacement) of the fields at a point, in order of fields.
pub type Here = [(u32, Vector3<f64>)];

/// The first field of several points' `rests`, from each of which it is taken. `take` is told the field, which of them it
/// was in, in their order, and its displacement there.
///
/// ```
/// use sombrero_spectral::next_field;
///
/// let (up, along) = ([0.0, 0.0, 1.0].into(), [1.0, 0.0, 0.0].into());
/// let mut rests: [&[_]; 2] = [&[(2, up), (7, along)], &[(7, up)]];
/// let mut taken = Vec::new();
/// while let Some(field) = next_field(&mut rests, |field, point, d| taken.push((field, point, d.z))) {
///     assert_eq!(taken.last().map(|last| last.0), Some(field));
/// }
/// assert_eq!(taken, [(2, 0, 1.0), (7, 0, 0.0), (7, 1, 1.0)]);
/// ```
#[inline]
pub fn next_field<'a>(
    rests: &mut [&'a Here],
    mut take: impl FnMut(u32, usize, &'a Vector3<f64>),
) -> Option<u32> {
    let next = rests.iter().filter_map(|rest| Some(rest.first()?.0)).min()?;
    for (point, rest) in rests.iter_mut().enumerate() {
        if let [(field, d), others @ ..] = *rest
            && *field == next
        {
            take(next, point, d);
            *rest = others;
        }
    }
    Some(next)
}

/// Adds up what stands behind one another under the same number, in that order.
pub(crate) fn add_up<T: AddAssign + Copy>(entries: &mut Vec<(u32, T)>) {
    entries.dedup_by(|later, earlier| {
        let same = later.0 == earlier.0;
        if same {
            earlier.1 += later.1;
        }
        same
    });
}
