//! The parts of the original, each ready to be found by itself.
//!
//! A part hangs together by triangles that share points. The functions that reach it are those of B with a row in it, so
//! that what is estimated from it is about the same w; a function that reaches several parts is estimated from each.

use crate::coupled::each;
use nalgebra::Vector3;
use sombrero_basis::Basis;
use sombrero_extraction::Extractor;
use sombrero_mesh::{Soup, connected, geometry, part};
use sombrero_registration::Reference;
use std::sync::OnceLock;

/// Parts that are looked at, of original and suspect, the largest first.
const MOST_PARTS: usize = 64;

/// A part of a soup.
#[derive(Debug, Clone)]
pub(crate) struct Component {
    /// Its place among all parts, in the order of their first points.
    pub(crate) number: usize,
    pub(crate) soup: Soup,
    /// The points of the whole that are those of `soup`, ascending.
    pub(crate) points: Vec<u32>,
}

/// The parts of a soup, those with the most triangles first.
pub(crate) fn components(soup: &Soup) -> Vec<Component> {
    let mut groups: Vec<_> =
        sombrero_mesh::parts(soup.points.len(), &soup.triangles).into_iter().enumerate().collect();
    groups.sort_by_key(|(number, group)| (std::cmp::Reverse(group.len()), *number));
    let component = |(number, group): (usize, Vec<[u32; 3]>)| {
        let (soup, points) = part(&soup.points, &group);
        Component { number, soup, points }
    };
    groups.into_iter().take(MOST_PARTS).map(component).collect()
}

/// Whether a soup has more parts than one.
pub(crate) fn has_parts(soup: &Soup) -> bool {
    let links = soup.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c]]);
    let first = connected(soup.points.len(), links);
    let mut of_triangles = soup.triangles.iter().map(|t| first[t[0] as usize]);
    let one = of_triangles.next();
    of_triangles.any(|other| Some(other) != one)
}

/// Whether one of the suspect's parts may be several of the original's, by the numbers of points and triangles.
pub(crate) fn are_alike(original: &[Component], suspect: &[Component]) -> bool {
    let size = |component: &Component| (component.points.len(), component.soup.triangles.len());
    let as_large = |own: &Component| original.iter().filter(|other| size(other) == size(own)).count();
    suspect.iter().any(|component| as_large(component) > 1)
}

/// Part of the original that functions reach.
#[derive(Debug)]
pub(crate) struct Part {
    pub(crate) shape: PartShape,
    /// The functions that reach it, ascending.
    pub(crate) functions: Vec<usize>,
    /// Of those functions, from this part alone.
    pub(crate) extractor: Extractor,
}

/// A part as its shape alone tells.
#[derive(Debug)]
pub(crate) struct PartShape {
    pub(crate) component: Component,
    /// The largest side.
    pub(crate) side: f64,
    /// Made when first asked for; `None` where it has no shape.
    reference: OnceLock<Option<Reference>>,
}

impl PartShape {
    /// `None` of a component without points.
    pub(crate) fn new(component: Component) -> Option<Self> {
        let side = component.soup.bounding_box()?.largest_side();
        Some(Self { component, side, reference: OnceLock::new() })
    }

    /// What components of a suspect are registered to.
    pub(crate) fn reference(&self) -> Option<&Reference> {
        let Soup { points, triangles } = &self.component.soup;
        if let Some(made) = self.reference.get() {
            return made.as_ref();
        }
        let made = Reference::new(points, triangles).ok();
        self.reference.get_or_init(|| made).as_ref()
    }

    /// The share of its area, 0 to 1, whose corners are all present.
    pub(crate) fn coverage(&self, present: &[bool]) -> f64 {
        let Soup { points, triangles } = &self.component.soup;
        let area = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|v| &points[v as usize]);
            geometry::area_vector(a, b, c).norm()
        };
        let seen = |corners: &&[u32; 3]| corners.iter().all(|&v| present[v as usize]);
        let total: f64 = triangles.iter().map(area).sum();
        // An empty sum is -0.
        let covered: f64 = 0.0 + triangles.iter().filter(seen).map(area).sum::<f64>();
        if total > 0.0 { covered / total } else { 0.0 }
    }
}

/// The parts of the original that carry something.
pub(crate) fn parts(soup: &Soup, basis: &Basis, epsilon: f64) -> Vec<Part> {
    let components = components(soup);
    let mut at: Vec<Option<(usize, u32)>> = vec![None; soup.points.len()];
    for (number, component) in components.iter().enumerate() {
        component
            .points
            .iter()
            .zip(0..)
            .for_each(|(&point, local)| at[point as usize] = Some((number, local)));
    }
    // For each part its functions, each with what it does there.
    type Field = Vec<(u32, Vector3<f64>)>;
    let mut fields: Vec<Vec<(usize, Field)>> = vec![Vec::new(); components.len()];
    for function in 0..basis.functions().len() {
        each(basis, function, |row, d| {
            let Some((part, local)) = at[row].filter(|_| d != Vector3::zeros()) else { return };
            match fields[part].last_mut().filter(|(last, _)| *last == function) {
                Some((_, field)) => field.push((local, d)),
                None => fields[part].push((function, vec![(local, d)])),
            }
        });
    }
    let part = |(component, fields): (Component, Vec<(usize, Field)>)| {
        let (functions, fields): (Vec<usize>, Vec<Field>) = fields.into_iter().unzip();
        let basis = Basis::of_fields(component.points.len(), fields);
        let extractor =
            Extractor::new(&basis, epsilon, &component.soup).ok().filter(|_| !functions.is_empty())?;
        Some(Part { shape: PartShape::new(component)?, functions, extractor })
    };
    components.into_iter().zip(fields).filter_map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use sombrero_shapes as shapes;

    fn beside(soups: &[Soup]) -> Soup {
        let mut all = Soup::default();
        for (at, soup) in soups.iter().enumerate() {
            let first = all.points.len() as u32;
            all.points.extend(soup.points.iter().map(|p| Point3::new(p.x + 5.0 * at as f64, p.y, p.z)));
            all.triangles.extend(soup.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        all
    }

    #[test]
    fn parts_are_numbered_by_the_file_and_sorted_by_size() {
        let soups = [shapes::cube(), shapes::sphere(2), shapes::icosahedron()];
        let mut all = beside(&soups);
        all.points.push(Point3::origin());
        // Triangles of the parts in turn.
        all.triangles.sort_by_key(|t| t[0] % 7);
        let found = components(&all);
        assert_eq!(found.iter().map(|c| c.number).collect::<Vec<_>>(), [1, 2, 0]);
        for component in &found {
            let soup = &soups[component.number];
            assert_eq!(component.soup.points.len(), soup.points.len());
            assert_eq!(component.soup.triangles.len(), soup.triangles.len());
            let same = |(p, v): (&Point3<f64>, &u32)| *p == all.points[*v as usize];
            assert!(component.soup.points.iter().zip(&component.points).all(same));
        }
        assert!(components(&Soup::default()).is_empty());
    }
}
