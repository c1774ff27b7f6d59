//! Polygons and strips split into triangles.
//!
//! A polygon comes as a fan around its first corner, which is right wherever all of the polygon is seen from there. Where
//! it is not, the fan covers what is outside: once all positions are known, [`split`] takes the ears of such a polygon
//! one by one instead (Meisters, "Polygons have ears", 1975), as many triangles as the fan has, in the same place.

use earcut::Earcut;
use nalgebra::{Point3, Vector3};
use sombrero_mesh::Soup;

/// What rounding may take off a triangle of a fan, as a share of the polygon's area.
const ROUNDING: f64 = 1e-9;

/// Clipping ears may take the square of the number of corners: as many are spent on one file, so that no file takes
/// longer than a second. What is left keeps its fans.
const MOST_STEPS: u64 = 1 << 27;

/// The triangles that a polygon of more than three corners was split into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Polygon {
    first: u32,
    triangles: u32,
}

impl Polygon {
    fn range(self) -> std::ops::Range<usize> {
        self.first as usize..self.first as usize + self.triangles as usize
    }
}

/// Triangles in the making, and which of them are of one polygon.
#[derive(Debug, Default)]
pub(crate) struct Faces {
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) polygons: Vec<Polygon>,
}

impl Faces {
    /// Appends a polygon as a fan around its first corner. Fewer than three corners make none.
    pub(crate) fn push(&mut self, corners: &[u32]) {
        let first = self.triangles.len();
        fan(corners, &mut self.triangles);
        let triangles = self.triangles.len() - first;
        if triangles > 1
            && let (Ok(first), Ok(triangles)) = (u32::try_from(first), u32::try_from(triangles))
        {
            self.polygons.push(Polygon { first, triangles });
        }
    }
}

/// Appends the triangles of a polygon, as a fan around its first corner. Fewer than three corners make none.
pub(crate) fn fan(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    if let [hub, rim @ ..] = corners {
        triangles.extend(rim.windows(2).map(|pair| [*hub, pair[0], pair[1]]));
    }
}

/// Appends the triangles of a strip, every second one turned round so that all face the same way.
///
/// Triangles with a doubled corner are left out: strips use them as joints, not as surface.
pub(crate) fn strip(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    for (i, w) in corners.windows(3).enumerate() {
        let [a, b, c] = [w[0], w[1], w[2]];
        if a != b && b != c && c != a {
            triangles.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
        }
    }
}

/// Splits anew the polygons whose fans cover what is outside of them. All corners must have a finite position.
pub(crate) fn split(soup: &mut Soup, polygons: &[Polygon]) {
    let Soup { points, triangles } = soup;
    let mut clipper = Clipper::default();
    for polygon in polygons {
        let Some(fan) = triangles.get_mut(polygon.range()) else { continue };
        if !clipper.split(points, fan) {
            return;
        }
    }
}

/// Whether `other` has the same faces as `own` and splits at most their polygons otherwise.
pub(crate) fn same_faces(own: &[[u32; 3]], polygons: &[Polygon], other: &[[u32; 3]]) -> bool {
    if own.len() != other.len() {
        return false;
    }
    let mut at = 0;
    for polygon in polygons {
        let range = polygon.range();
        let between = at..range.start;
        let (Some(a), Some(b)) = (own.get(range.clone()), other.get(range.clone())) else { return false };
        if own.get(between.clone()) != other.get(between) || !(a == b || same_outline(a, b)) {
            return false;
        }
        at = range.end;
    }
    own.get(at..) == other.get(at..)
}

/// Whether two sets of triangles have the same outline: each edge, with its direction, as often.
fn same_outline(a: &[[u32; 3]], b: &[[u32; 3]]) -> bool {
    let edges = |[p, q, r]: [u32; 3]| [[p, q], [q, r], [r, p]];
    let mut signed: Vec<([u32; 2], i32)> = Vec::with_capacity(3 * (a.len() + b.len()));
    for (triangles, sign) in [(a, 1), (b, -1)] {
        let all = triangles.iter().copied().flat_map(edges);
        signed.extend(all.map(|[p, q]| if p < q { ([p, q], sign) } else { ([q, p], -sign) }));
    }
    signed.sort_unstable();
    signed
        .chunk_by(|(e, _), (f, _)| e == f)
        .all(|of_one| of_one.iter().map(|(_, sign)| sign).sum::<i32>() == 0)
}

/// What the polygons of a file share while they are split.
struct Clipper {
    steps_left: u64,
    earcut: Earcut<f64>,
    corners: Vec<u32>,
    flat: Vec<[f64; 2]>,
    ears: Vec<u32>,
}

impl Default for Clipper {
    fn default() -> Self {
        let (corners, flat, ears) = (Vec::new(), Vec::new(), Vec::new());
        Self { steps_left: MOST_STEPS, earcut: Earcut::new(), corners, flat, ears }
    }
}

impl Clipper {
    /// Splits the polygon of a fan anew, if that is needed and better. `false` when no steps are left.
    fn split(&mut self, points: &[Point3<f64>], fan: &mut [[u32; 3]]) -> bool {
        let Some(normal) = normal(points, fan) else { return true };
        if covers(points, fan, &normal) {
            return true;
        }
        let count = fan.len() as u64 + 2;
        let Some(left) = self.steps_left.checked_sub(count.saturating_mul(count)) else { return false };
        self.steps_left = left;
        self.corners.clear();
        self.corners.extend(fan.first().iter().flat_map(|t| &t[..2]));
        self.corners.extend(fan.iter().map(|t| t[2]));
        self.flatten(points, &normal);
        self.earcut.earcut_slice(&self.flat, &[], &mut self.ears);
        let (ears, _) = self.ears.as_chunks::<3>();
        let corner = |place: u32| self.corners.get(place as usize).copied().unwrap_or_default();
        let mut split: Vec<[u32; 3]> = ears.iter().map(|ear| ear.map(corner)).collect();
        if split.iter().map(|t| doubled_area(points, t).dot(&normal)).sum::<f64>() < 0.0 {
            split.iter_mut().for_each(|t| t.swap(1, 2));
        }
        // One that crosses itself has no split into triangles: any is as good as the fan.
        if split.len() == fan.len() && covers(points, &split, &normal) {
            fan.copy_from_slice(&split);
        }
        true
    }

    /// The corners seen along the axis that is nearest to the normal: as they are stored, so that what is in line stays so.
    fn flatten(&mut self, points: &[Point3<f64>], normal: &Vector3<f64>) {
        let (x, y) = [(1, 2), (2, 0), (0, 1)].get(normal.iamax()).copied().unwrap_or((0, 1));
        self.flat.clear();
        self.flat.extend(self.corners.iter().map(|&c| {
            let p = points.get(c as usize).copied().unwrap_or_default();
            [p[x], p[y]]
        }));
    }
}

/// The area vector of a polygon, doubled (Newell's normal); `None` for one without area or beyond all numbers.
fn normal(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Option<Vector3<f64>> {
    let sum: Vector3<f64> = triangles.iter().map(|t| doubled_area(points, t)).sum();
    let squared = sum.norm_squared();
    (squared > 0.0 && squared.is_finite()).then_some(sum)
}

/// Whether all triangles face the way of `normal`, which then is the sum of their areas: none covers another.
fn covers(points: &[Point3<f64>], triangles: &[[u32; 3]], normal: &Vector3<f64>) -> bool {
    let least = -ROUNDING * normal.norm_squared();
    triangles.iter().all(|t| doubled_area(points, t).dot(normal) >= least)
}

fn doubled_area(points: &[Point3<f64>], triangle: &[u32; 3]) -> Vector3<f64> {
    let [a, b, c] = triangle.map(|v| points.get(v as usize).copied().unwrap_or_default());
    (b - a).cross(&(c - a))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn collect(split: fn(&[u32], &mut Vec<[u32; 3]>), corners: &[u32]) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        split(corners, &mut triangles);
        triangles
    }

    /// The triangles of one polygon, and their summed area.
    fn triangulated(outline: &[[f64; 3]]) -> (Vec<[u32; 3]>, f64) {
        let points: Vec<_> = outline.iter().map(|p| Point3::from(*p)).collect();
        let corners: Vec<u32> = (0..outline.len() as u32).collect();
        let mut faces = Faces::default();
        faces.push(&corners);
        let mut soup = Soup::new(points, faces.triangles);
        split(&mut soup, &faces.polygons);
        let area = soup.triangles.iter().map(|t| doubled_area(&soup.points, t).norm() / 2.0).sum();
        (soup.triangles, area)
    }

    fn flat(outline: &[[f64; 2]]) -> (Vec<[u32; 3]>, f64) {
        triangulated(&outline.iter().map(|[x, y]| [*x, *y, 0.0]).collect::<Vec<_>>())
    }

    #[test]
    fn a_pentagon_is_a_fan_of_three() {
        assert_eq!(collect(fan, &[4, 7, 9, 2, 3]), [[4, 7, 9], [4, 9, 2], [4, 2, 3]]);
    }

    #[test]
    fn too_few_corners_make_no_triangle() {
        for corners in [&[][..], &[1], &[1, 2]] {
            assert_eq!(collect(fan, corners), <[[u32; 3]; 0]>::default());
            assert_eq!(collect(strip, corners), <[[u32; 3]; 0]>::default());
        }
    }

    #[test]
    fn a_strip_alternates_and_skips_its_joints() {
        assert_eq!(collect(strip, &[0, 1, 2, 3]), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(collect(strip, &[0, 1, 2, 2, 3]), [[0, 1, 2]]);
    }

    #[test]
    fn what_its_first_corner_sees_stays_a_fan() {
        // Convex, with corners in the middle of sides, and concave as seen from the notch.
        for outline in [
            &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 2.0], [0.0, 2.0]][..],
            &[[1.0, 1.0], [0.0, 2.0], [0.0, 0.0], [2.0, 0.0], [2.0, 2.0]],
        ] {
            let (triangles, _) = flat(outline);
            assert!(triangles.iter().all(|t| t[0] == 0), "{triangles:?}");
        }
    }

    #[test]
    fn concave_polygons_have_the_area_they_have() {
        let arrow = [[0.0, 2.0], [0.0, 0.0], [2.0, 0.0], [0.5, 0.5]];
        assert!((flat(&arrow).1 - 1.0).abs() < 1e-12);
        let ell = [[2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0], [0.0, 0.0]];
        assert!((flat(&ell).1 - 3.0).abs() < 1e-12);
        // A comb of two teeth, and the other way round.
        let mut comb =
            [[0.0, 0.0], [5.0, 0.0], [5.0, 3.0], [4.0, 3.0], [4.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
        assert!((flat(&comb).1 - 9.0).abs() < 1e-12);
        comb.reverse();
        assert!((flat(&comb).1 - 9.0).abs() < 1e-12);
        // A frame whose hole hangs on a cut, as exporters write it: the cut's corners come twice.
        let frame = [
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [0.0, 3.0],
            [0.0, 0.0], //
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ];
        assert!((flat(&frame).1 - 8.0).abs() < 1e-12);
        // A U that stands upright in the plane x = z, turned so that no axis is its normal.
        let upright: Vec<[f64; 3]> = comb.iter().map(|[u, v]| [*u, *v, *u]).collect();
        assert!((triangulated(&upright).1 - 9.0 * 2.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_split_faces_the_way_of_the_polygon() {
        let arrow = [[0.0, 2.0], [0.0, 0.0], [2.0, 0.0], [0.5, 0.5]];
        let mut outline: Vec<[f64; 3]> = arrow.iter().map(|[x, y]| [*x, *y, 0.0]).collect();
        for sign in [1.0, -1.0] {
            let (triangles, _) = triangulated(&outline);
            let points: Vec<_> = outline.iter().map(|p| Point3::from(*p)).collect();
            assert!(triangles.iter().all(|t| sign * doubled_area(&points, t).z > 0.0), "{triangles:?}");
            outline.reverse();
        }
    }

    #[test]
    fn what_has_no_split_keeps_its_fan() {
        for outline in [
            // Crossing itself, without area, and beyond all numbers.
            &[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]][..],
            &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 0.0]],
            &[[0.0, 1e300], [0.0, 0.0], [1e300, 0.0], [1e299, 1e299]],
        ] {
            let (triangles, _) = flat(outline);
            assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
        }
    }

    #[test]
    fn other_splits_of_the_same_polygon_are_the_same_faces() {
        let polygons = [Polygon { first: 1, triangles: 2 }];
        let own = [[7, 8, 9], [0, 1, 2], [0, 2, 3], [4, 5, 6]];
        assert!(same_faces(&own, &polygons, &own));
        assert!(same_faces(&own, &polygons, &[[7, 8, 9], [1, 2, 3], [3, 0, 1], [4, 5, 6]]));
        for other in [
            &[[7, 8, 9], [0, 1, 2], [0, 2, 4], [4, 5, 6]][..],
            &[[7, 9, 8], [0, 1, 2], [0, 2, 3], [4, 5, 6]],
            &[[7, 8, 9], [0, 1, 2], [0, 2, 3], [4, 6, 5]],
            &[[7, 8, 9], [0, 2, 1], [0, 3, 2], [4, 5, 6]],
            &[[7, 8, 9], [0, 1, 2], [0, 2, 3]],
        ] {
            assert!(!same_faces(&own, &polygons, other), "{other:?}");
        }
    }

    proptest! {
        /// A star about the origin is simple, whatever its radii; its area is a sum over its sides.
        #[test]
        fn stars_are_covered_once(radii in prop::collection::vec(0.1..10.0_f64, 4..40), start in 0..40_usize) {
            let count = radii.len();
            let at = |i: usize| {
                let angle = std::f64::consts::TAU * (i as f64) / (count as f64);
                [radii[i] * angle.cos(), radii[i] * angle.sin()]
            };
            let outline: Vec<[f64; 2]> = (0..count).map(|i| at((i + start) % count)).collect();
            let sides = outline.iter().zip(outline.iter().cycle().skip(1));
            let expected: f64 = sides.map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum::<f64>() / 2.0;
            let (triangles, area) = flat(&outline);
            prop_assert_eq!(triangles.len(), count - 2);
            prop_assert!((area - expected).abs() < 1e-9 * expected, "{} instead of {}", area, expected);
        }
    }
}
