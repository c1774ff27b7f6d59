//! An order of queries in which neighbours in the list are neighbours in space.
//!
//! The Morton code of a point interleaves the bits of its coordinates, 21 bits an axis, after the
//! bounding box is stretched to the cube [0, 2²¹). Visiting queries in this order keeps the part of
//! the tree that one query needs warm in the cache for the next.

use nalgebra::Point3;

use crate::limits::usable;

const CELLS: f64 = (1u64 << 21) as f64;

/// Indices of `points` along the curve. Equal codes keep the order of indices; points that are not
/// usable come first.
pub(crate) fn order(points: &[Point3<f64>]) -> Vec<u32> {
    let bounds = sombrero_mesh::BoundingBox::of(points.iter().filter(|p| usable(p)));
    let Some(bounds) = bounds else { return (0..points.len() as u32).collect() };
    // A flat or point-like set has sides of zero: any positive number serves as the divisor.
    let scale = bounds.sides().map(|s| if s > 0.0 { CELLS / s } else { 0.0 });
    let mut keyed: Vec<(u64, u32)> = points
        .iter()
        .zip(0..)
        .map(|(p, i)| {
            let cell = (p - bounds.min).component_mul(&scale);
            // The conversion takes NaN to 0 and saturates.
            let axis = |x: f64| spread((x as u64).min((1 << 21) - 1));
            let code = if usable(p) { axis(cell.x) | axis(cell.y) << 1 | axis(cell.z) << 2 } else { 0 };
            (code, i)
        })
        .collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, i)| i).collect()
}

/// Puts answers that follow `order` back into the order of the queries.
pub(crate) fn scatter<T: Clone>(order: &[u32], answers: Vec<T>, blank: T) -> Vec<T> {
    let mut scattered = vec![blank; answers.len()];
    for (&i, answer) in order.iter().zip(answers) {
        scattered[i as usize] = answer;
    }
    scattered
}

/// Puts two zero bits between neighbouring bits of a 21-bit number.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_bits_are_three_apart() {
        for bit in 0..21 {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread((1 << 21) - 1).count_ones(), 21);
    }

    #[test]
    fn order_is_a_permutation_for_any_input() {
        let mut points: Vec<_> = (0..50).map(|i| Point3::new(f64::from(i * 7 % 50), 1.0, -2.0)).collect();
        points.push(Point3::new(f64::NAN, 0.0, 0.0));
        points.push(Point3::new(0.0, f64::INFINITY, 0.0));
        let mut order = order(&points);
        let along: Vec<f64> =
            order[2..].iter().map(|&i| points[i as usize].x).filter(|x| x.is_finite()).collect();
        assert!(along.is_sorted());
        order.sort_unstable();
        assert_eq!(order, (0..52).collect::<Vec<u32>>());
    }
}
