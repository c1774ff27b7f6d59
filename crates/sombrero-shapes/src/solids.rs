//! The smallest closed surfaces.

use nalgebra::Point3;

use sombrero_mesh::Soup;

/// A regular tetrahedron with corners on alternate corners of the cube [-1, 1]³: 4 vertices, 4 faces.
///
/// ```
/// assert_eq!(sombrero_shapes::tetrahedron().triangles.len(), 4);
/// ```
pub fn tetrahedron() -> Soup {
    let points = vec![
        Point3::new(1.0, 1.0, 1.0),
        Point3::new(1.0, -1.0, -1.0),
        Point3::new(-1.0, 1.0, -1.0),
        Point3::new(-1.0, -1.0, 1.0),
    ];
    Soup::new(points, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
}

/// A regular octahedron with corners at distance 1 on the axes: 6 vertices, 8 faces.
///
/// ```
/// assert_eq!(sombrero_shapes::octahedron().triangles.len(), 8);
/// ```
pub fn octahedron() -> Soup {
    let points = vec![
        Point3::new(1.0, 0.0, 0.0),
        Point3::new(-1.0, 0.0, 0.0),
        Point3::new(0.0, 1.0, 0.0),
        Point3::new(0.0, -1.0, 0.0),
        Point3::new(0.0, 0.0, 1.0),
        Point3::new(0.0, 0.0, -1.0),
    ];
    let upper = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]];
    let lower = [[2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    Soup::new(points, [upper, lower].concat())
}

/// A regular icosahedron with its corners on the unit sphere: 12 vertices, 20 faces.
///
/// ```
/// let solid = sombrero_shapes::icosahedron();
/// assert_eq!((solid.points.len(), solid.triangles.len()), (12, 20));
/// ```
pub fn icosahedron() -> Soup {
    // Three golden rectangles at right angles, scaled so that their corners are unit vectors.
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let norm = (1.0 + golden * golden).sqrt();
    let (a, b) = (1.0 / norm, golden / norm);
    let rectangle = [(-a, b), (a, b), (-a, -b), (a, -b)];
    let mut points = Vec::with_capacity(12);
    points.extend(rectangle.map(|(s, l)| Point3::new(s, l, 0.0)));
    points.extend(rectangle.map(|(s, l)| Point3::new(0.0, s, l)));
    points.extend(rectangle.map(|(s, l)| Point3::new(l, 0.0, s)));
    let triangles = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    Soup::new(points, triangles)
}

/// The cube [-1, 1]³ with one diagonal a side: 8 vertices, 12 faces.
///
/// ```
/// assert_eq!(sombrero_shapes::cube().points.len(), 8);
/// ```
pub fn cube() -> Soup {
    // Corner number: bit 0 is +x, bit 1 is +y, bit 2 is +z.
    let sign = |corner: u32, bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let points = (0..8).map(|c| Point3::new(sign(c, 0), sign(c, 1), sign(c, 2))).collect();
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Soup::new(points, triangles)
}
