//! What of a soup an attack can work on.

use sombrero_mesh::Soup;

/// The faces whose corners are three different vertices of the soup.
pub(crate) fn whole_faces(soup: &Soup) -> Vec<[u32; 3]> {
    let known = |&v: &u32| (v as usize) < soup.points.len();
    let whole = |&[a, b, c]: &[u32; 3]| [a, b, c].iter().all(known) && a != b && b != c && c != a;
    soup.triangles.iter().copied().filter(whole).collect()
}
