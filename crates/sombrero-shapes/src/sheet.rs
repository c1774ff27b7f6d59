//! Open surfaces.

use nalgebra::Point3;

use sombrero_mesh::Soup;

/// Most cells along a side.
const MAX_CELLS: usize = 4096;

/// A gently waving sheet over the rectangle [0, 1.5] x [0, 1], seen from +z: (nx + 1) (ny + 1) vertices and
/// one boundary loop.
///
/// `nx` and `ny` count the cells along the sides and are moved into 1..=4096.
///
/// ```
/// let sheet = sombrero_shapes::open_sheet(12, 8);
/// assert_eq!((sheet.points.len(), sheet.triangles.len()), (13 * 9, 2 * 12 * 8));
/// ```
pub fn open_sheet(nx: usize, ny: usize) -> Soup {
    let size = [nx.clamp(1, MAX_CELLS), ny.clamp(1, MAX_CELLS)];
    sheet(size, |_, _| true)
}

/// The sheet of [`open_sheet`] with the middle third of its cells along x and y left out: two boundary loops,
/// Euler characteristic 0.
///
/// With hx = max(1, nx / 3) and hy alike, (nx + 1) (ny + 1) - (hx - 1) (hy - 1) vertices and
/// 2 (nx ny - hx hy) triangles. `nx` and `ny` are moved into 3..=4096.
///
/// ```
/// let sheet = sombrero_shapes::sheet_with_hole(12, 9);
/// assert_eq!((sheet.points.len(), sheet.triangles.len()), (13 * 10 - 3 * 2, 2 * (12 * 9 - 4 * 3)));
/// ```
pub fn sheet_with_hole(nx: usize, ny: usize) -> Soup {
    let size = [nx.clamp(3, MAX_CELLS), ny.clamp(3, MAX_CELLS)];
    // A hole no wider than a third leaves a rim of one cell at least.
    let hole = size.map(|n| {
        let width = (n / 3).max(1);
        (n - width) / 2..(n - width) / 2 + width
    });
    sheet(size, |i, j| !(hole[0].contains(&i) && hole[1].contains(&j)))
}

/// The cells of an `nx` by `ny` grid that `keep` wants, as a sheet.
fn sheet([nx, ny]: [usize; 2], keep: impl Fn(usize, usize) -> bool) -> Soup {
    // `number[node]` is the vertex of a grid node once some kept cell has asked for it.
    let mut number = vec![None; (nx + 1) * (ny + 1)];
    let mut soup = Soup::default();
    for j in 0..ny {
        for i in (0..nx).filter(|i| keep(*i, j)) {
            let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            let [a, b, c, d] = corners.map(|(i, j)| {
                *number[j * (nx + 1) + i].get_or_insert_with(|| {
                    soup.points.push(wave(i as f64 / nx as f64, j as f64 / ny as f64));
                    soup.points.len() as u32 - 1
                })
            });
            // Alternating diagonals, so that the sheet has no grain.
            let pair = if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            soup.triangles.extend(pair);
        }
    }
    soup
}

/// The sheet over the unit square: two long waves, and a slow drift in the plane that makes cells uneven.
fn wave(u: f64, v: f64) -> Point3<f64> {
    let x = 1.5 * (u + 0.06 * libm::sin(5.0 * v + 1.0) * u * (1.0 - u));
    let y = v + 0.08 * libm::sin(4.0 * u + 0.5) * v * (1.0 - v);
    let z = 0.08 * libm::sin(4.0 * x + 1.5 * y) + 0.05 * libm::cos(7.0 * y - 2.0 * x);
    Point3::new(x, y, z)
}
