//! Closest points on a triangle mesh.

use nalgebra::Point3;
use rayon::prelude::*;

use crate::limits::usable;
use crate::morton;
use crate::search::Best;
use crate::tree::{NO_FACE, Tree};

/// Queries that one task answers in a row. Answers do not depend on it.
const CHUNK: usize = 256;

/// The closest point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Closest {
    /// The point, computed from the barycentric coordinates.
    pub point: Point3<f64>,
    /// The face it lies on, as an index into the triangles given to [`Surface::new`].
    pub face: u32,
    /// Weights of the face's corners, in their order: each at least 0, sum 1.
    pub barycentric: [f64; 3],
    /// Squared distance from the query, in square model units.
    pub squared_distance: f64,
}

impl Closest {
    /// Distance from the query, in model units.
    pub fn distance(&self) -> f64 {
        self.squared_distance.sqrt()
    }
}

/// A triangle mesh prepared for closest-point queries.
///
/// Faces with an index out of range or with a corner that is not finite (or beyond 1e70) are left out.
/// Faces without area count as the segments or points that they are.
/// Where several faces are equally near, as at a shared vertex, the smallest face index is the answer.
#[derive(Debug, Clone)]
pub struct Surface {
    triangles: Vec<[u32; 3]>,
    tree: Tree,
    /// The slot of each face.
    slots: Vec<u32>,
}

impl Surface {
    /// Prepares the surface: O(n log n), and both arguments may be dropped afterwards.
    pub fn new(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let tree = Tree::new(points, triangles);
        let mut slots = vec![0; triangles.len()];
        for (slot, &face) in (0..).zip(&tree.faces) {
            if let Some(place) = slots.get_mut(face as usize) {
                *place = slot;
            }
        }
        Self { triangles: triangles.to_vec(), tree, slots }
    }

    /// Moves the vertices, keeping the triangles: O(n), and several times faster than a new surface.
    ///
    /// Answers are those of a new surface. Faces join or leave as their corners become usable or not.
    pub fn refit(&mut self, points: &[Point3<f64>]) {
        self.tree.refit(points, &self.triangles);
    }

    /// The triangles as given to [`Surface::new`].
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The closest point to `p`; `None` when the surface has no faces or `p` is not finite.
    pub fn closest(&self, p: &Point3<f64>) -> Option<Closest> {
        self.improve(p, Best::within(f64::INFINITY))
    }

    /// The closest point to `p` when it is at most `max_distance` away.
    pub fn closest_within(&self, p: &Point3<f64>, max_distance: f64) -> Option<Closest> {
        if max_distance.is_nan() || max_distance < 0.0 {
            return None;
        }
        self.improve(p, Best::within(max_distance * max_distance))
    }

    /// The closest point to `p`, as [`Surface::closest`] has it, sooner when `face` is close to it.
    ///
    /// A face of the previous iteration, or of a neighbouring query, makes a good start. Any number is
    /// allowed.
    pub fn closest_from(&self, p: &Point3<f64>, face: u32) -> Option<Closest> {
        let mut best = Best::within(f64::INFINITY);
        if let Some(&slot) = self.slots.get(face as usize) {
            self.tree.try_slot(p, slot, &mut best);
        }
        self.improve(p, best)
    }

    /// [`Surface::closest`] of each point, in parallel.
    ///
    /// Neighbouring queries are answered one after the other and start from each other's face; the
    /// answers are the same as one by one, for any number of threads.
    pub fn closest_many(&self, points: &[Point3<f64>]) -> Vec<Option<Closest>> {
        let order = morton::order(points);
        let answers: Vec<Option<Closest>> = order
            .par_chunks(CHUNK)
            .flat_map_iter(|chunk| {
                let mut face = NO_FACE;
                chunk.iter().map(move |&i| {
                    let answer = self.closest_from(&points[i as usize], face);
                    face = answer.map_or(face, |a| a.face);
                    answer
                })
            })
            .collect();
        morton::scatter(&order, answers, None)
    }

    /// [`Surface::closest`] of each point, in parallel, the i-th starting from `faces[i]`.
    ///
    /// For queries that move little from one iteration to the next. Missing or wrong faces cost only time.
    pub fn closest_many_from(&self, points: &[Point3<f64>], faces: &[u32]) -> Vec<Option<Closest>> {
        let start = |i: usize| faces.get(i).copied().unwrap_or(NO_FACE);
        let query = |(i, p): (usize, &Point3<f64>)| self.closest_from(p, start(i));
        points.par_iter().enumerate().with_min_len(CHUNK).map(query).collect()
    }

    pub(crate) fn tree(&self) -> &Tree {
        &self.tree
    }

    /// The closest point to `p` on a face that `accept` takes, when it is at most `max_distance` away.
    ///
    /// All faces that near may be asked for, so that this takes longer the more of them are refused.
    pub fn closest_where(
        &self,
        p: &Point3<f64>,
        max_distance: f64,
        accept: impl Fn(u32) -> bool,
    ) -> Option<Closest> {
        if max_distance.is_nan() || max_distance < 0.0 {
            return None;
        }
        self.improve_where(p, Best::within(max_distance * max_distance), accept)
    }

    fn improve(&self, p: &Point3<f64>, best: Best) -> Option<Closest> {
        self.improve_where(p, best, |_| true)
    }

    fn improve_where(&self, p: &Point3<f64>, best: Best, accept: impl Fn(u32) -> bool) -> Option<Closest> {
        if !usable(p) {
            return None;
        }
        let best = self.tree.search(p, best, accept);
        if best.face == NO_FACE {
            return None;
        }
        let [a, b, c] = &self.tree.triangles[best.slot as usize];
        let w = best.foot.barycentric;
        Some(Closest {
            point: Point3::from(a.coords * w[0] + b.coords * w[1] + c.coords * w[2]),
            face: best.face,
            barycentric: w,
            squared_distance: best.foot.squared_distance,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::corners;
    use crate::triangle;
    use proptest::prelude::*;

    type Mesh = (Vec<Point3<f64>>, Vec<[u32; 3]>);

    /// Corners on a coarse lattice, so that ties, repeated corners and zero areas are common, or anywhere.
    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![
            4 => (-4i32..=4).prop_map(|i| f64::from(i) / 4.0),
            4 => -1.0..1.0,
            1 => Just(f64::NAN),
        ]
    }

    fn point() -> impl Strategy<Value = Point3<f64>> {
        [coordinate(), coordinate(), coordinate()].prop_map(Point3::from)
    }

    fn mesh() -> impl Strategy<Value = Mesh> {
        // Some indices are out of range.
        (prop::collection::vec(point(), 1..60), prop::collection::vec([0u32..64, 0..64, 0..64], 0..120))
    }

    fn query() -> impl Strategy<Value = Point3<f64>> {
        (point(), prop_oneof![Just(1.0), Just(1e3), Just(1e-6), Just(1e9)]).prop_map(|(p, s)| p * s)
    }

    /// Smallest (squared distance, face) over all faces.
    fn brute_force(points: &[Point3<f64>], triangles: &[[u32; 3]], p: &Point3<f64>) -> Option<(f64, u32)> {
        let key = |(&t, face)| {
            corners(points, t)
                .map(|t| (triangle::closest(p, &t).squared_distance, face))
                .filter(|_| usable(p))
        };
        triangles.iter().zip(0..).filter_map(key).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    }

    fn key(closest: Closest) -> (f64, u32) {
        (closest.squared_distance, closest.face)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]

        #[test]
        fn agrees_with_brute_force((points, triangles) in mesh(), p in query(), hint in 0u32..130) {
            let surface = Surface::new(&points, &triangles);
            let closest = surface.closest(&p);
            prop_assert_eq!(closest.map(key), brute_force(&points, &triangles, &p));
            prop_assert_eq!(surface.closest_from(&p, hint), closest);
            if let Some(closest) = closest {
                let reach = p.coords.norm() + 3.0;
                prop_assert!(((closest.point - p).norm() - closest.distance()).abs() < 1e-12 * reach);
            }
        }

        #[test]
        fn within_is_closest_cut_off((points, triangles) in mesh(), p in query(), max in 0.0..3.0) {
            let surface = Surface::new(&points, &triangles);
            let expected = surface.closest(&p).filter(|c| c.squared_distance <= max * max);
            prop_assert_eq!(surface.closest_within(&p, max), expected);
            prop_assert_eq!(surface.closest_within(&p, f64::INFINITY), surface.closest(&p));
            prop_assert_eq!(surface.closest_within(&p, f64::NAN), None);
            prop_assert_eq!(surface.closest_within(&p, -1.0), None);
        }

        #[test]
        fn faces_that_are_refused_might_as_well_be_absent(
            (points, triangles) in mesh(), p in query(), keep in 0u32..8
        ) {
            let surface = Surface::new(&points, &triangles);
            let accept = |face: u32| face & keep == keep;
            let kept: Vec<[u32; 3]> = (0..).zip(&triangles)
                .map(|(face, t)| if accept(face) { *t } else { [u32::MAX; 3] })
                .collect();
            let expected = Surface::new(&points, &kept).closest(&p);
            prop_assert_eq!(surface.closest_where(&p, f64::INFINITY, accept), expected);
            let expected = Surface::new(&points, &kept).closest_within(&p, 0.5);
            prop_assert_eq!(surface.closest_where(&p, 0.5, accept), expected);
        }

        #[test]
        fn refit_is_a_new_surface(
            (points, triangles) in mesh(),
            moved in prop::collection::vec(point(), 0..60),
            queries in prop::collection::vec(query(), 20)
        ) {
            let mut surface = Surface::new(&points, &triangles);
            surface.refit(&moved);
            let fresh = Surface::new(&moved, &triangles);
            prop_assert_eq!(surface.closest_many(&queries), fresh.closest_many(&queries));
            surface.refit(&points);
            let first = Surface::new(&points, &triangles);
            prop_assert_eq!(surface.closest_many(&queries), first.closest_many(&queries));
        }
    }

    /// A bumpy sheet of about `2 side²` faces.
    fn sheet(side: u32) -> Mesh {
        let at = |i: u32, j: u32| (i * (side + 1) + j) as f64;
        let bump = |i: u32, j: u32| (at(i, j) * 0.37).sin();
        let points = (0..=side).flat_map(|i| (0..=side).map(move |j| (i, j)));
        let points = points.map(|(i, j)| Point3::new(f64::from(i), f64::from(j), bump(i, j))).collect();
        let corner = |i: u32, j: u32| i * (side + 1) + j;
        let cell = |i, j| {
            let (a, b, c, d) = (corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
            [[a, b, c], [a, c, d]]
        };
        let triangles = (0..side).flat_map(|i| (0..side).flat_map(move |j| cell(i, j))).collect();
        (points, triangles)
    }

    fn queries(count: u32, size: f64) -> Vec<Point3<f64>> {
        let wave = |k: u32, step: f64| (f64::from(k) * step).fract() * 1.4 * size - 0.2 * size;
        (0..count).map(|k| Point3::new(wave(k, 0.754), wave(k, 0.569), wave(k, 0.331) / 8.0)).collect()
    }

    #[test]
    fn batches_are_the_single_answers_for_any_number_of_threads() {
        let (points, triangles) = sheet(80);
        let queries = queries(3000, 80.0);
        let answers = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let surface = Surface::new(&points, &triangles);
                let many = surface.closest_many(&queries);
                let faces: Vec<u32> = many.iter().rev().map(|c| c.unwrap().face).collect();
                assert_eq!(surface.closest_many_from(&queries, &faces), many);
                assert_eq!(surface.closest_many_from(&queries, &[]), many);
                many
            })
        };
        let surface = Surface::new(&points, &triangles);
        let single: Vec<_> = queries.iter().map(|p| surface.closest(p)).collect();
        assert_eq!(answers(1), single);
        assert_eq!(answers(2), single);
        for (p, answer) in queries.iter().zip(single).step_by(97) {
            assert_eq!(answer.map(key), brute_force(&points, &triangles, p));
        }
    }

    #[test]
    fn a_shared_corner_belongs_to_the_smallest_face() {
        let (points, triangles) = sheet(10);
        let surface = Surface::new(&points, &triangles);
        for (p, v) in points.iter().zip(0..) {
            let first = triangles.iter().position(|t| t.contains(&v)).unwrap();
            let closest = surface.closest(p).unwrap();
            assert_eq!((closest.face as usize, closest.squared_distance), (first, 0.0));
            assert_eq!(closest.point, *p);
        }
    }

    #[test]
    fn nothing_to_find() {
        let origin = Point3::origin();
        assert_eq!(Surface::new(&[], &[]).closest(&origin), None);
        assert_eq!(Surface::new(&[origin], &[[0, 1, 2]]).closest(&origin), None);
        let mut point = Surface::new(&[origin], &[[0, 0, 0]]);
        assert_eq!(point.closest(&Point3::new(0.0, 3.0, 4.0)).unwrap().distance(), 5.0);
        assert_eq!(point.closest(&Point3::new(0.0, f64::NAN, 4.0)), None);
        assert_eq!(point.closest(&Point3::new(0.0, f64::INFINITY, 4.0)), None);
        point.refit(&[]);
        assert_eq!(point.closest(&origin), None);
        assert!(point.closest_many(&[]).is_empty());
    }

    #[test]
    fn many_equal_faces_end_in_bounded_time() {
        let points = [Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
        let surface = Surface::new(&points, &vec![[0, 1, 2]; 20_000]);
        assert_eq!(surface.closest(&Point3::new(0.1, 0.1, 1.0)).unwrap().face, 0);
    }
}
