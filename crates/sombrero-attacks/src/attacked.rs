//! The result of an attack.

use nalgebra::Point3;
use sombrero_mesh::Soup;

/// A mesh after an attack, and where its vertices come from.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Attacked {
    /// The mesh.
    pub soup: Soup,
    /// For each of its vertices the vertex of the attacked mesh that it is; `None` for a new one.
    pub source: Vec<Option<u32>>,
}

impl Attacked {
    /// The same vertices, moved or not.
    pub(crate) fn in_place(soup: Soup) -> Self {
        let source = (0..soup.points.len() as u32).map(Some).collect();
        Self { soup, source }
    }

    /// The vertices of `soup` at other places.
    pub(crate) fn moved(soup: &Soup, points: Vec<Point3<f64>>) -> Self {
        Self::in_place(Soup::new(points, soup.triangles.clone()))
    }

    /// New vertices throughout: none has a source.
    pub(crate) fn anew(soup: Soup) -> Self {
        let source = vec![None; soup.points.len()];
        Self { soup, source }
    }

    /// Vertices picked from the attacked mesh.
    pub(crate) fn picked(soup: Soup, source: Vec<u32>) -> Self {
        Self { soup, source: source.into_iter().map(Some).collect() }
    }

    /// Where each of `vertices` vertices of the attacked mesh is now; `None` for those that are gone.
    /// Undoes reordering and cropping: the known correspondence of the paper's rows K and O.
    pub fn correspondence(&self, vertices: usize) -> Vec<Option<Point3<f64>>> {
        let mut found = vec![None; vertices];
        for (&source, &point) in self.source.iter().zip(&self.soup.points) {
            if let Some(slot) = source.and_then(|v| found.get_mut(v as usize)) {
                *slot = Some(point);
            }
        }
        found
    }
}
