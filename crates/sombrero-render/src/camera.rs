//! Where the eye is: a frame around the points of interest, seen from a direction.
//!
//! View coordinates have x to the right, y up and z towards the eye; their origin is the middle of the bounding box of the
//! framed points, and their unit is half its diagonal, so that nothing downstream depends on model units. The eye
//! sits at z = D:
//!
//! ```text
//! perspective:   (X, Y) = (x, y) · D / (D - z)       orthographic:   (X, Y) = (x, y)
//! ```

use nalgebra::{Point3, Vector3};

/// Distance of the eye from the middle, in half diagonals: a long lens, with little distortion.
const EYE_DISTANCE: f64 = 5.0;

/// What is nearer to the eye than this (same unit) is not drawn.
const NEAREST: f64 = 0.05;

/// A view that frames a set of points in a picture of any shape, with a small margin.
///
/// It keeps the frame, not the points: with one camera, two versions of a mesh appear in the same place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    middle: Point3<f64>,
    unit: f64,
    right: Vector3<f64>,
    up: Vector3<f64>,
    backward: Vector3<f64>,
    perspective: bool,
    /// Middle of the framed rectangle in the projection plane.
    frame_middle: [f64; 2],
    /// Half width and half height of the rectangle.
    frame_half: [f64; 2],
}

/// A point in the projection plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Projected {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Grows towards the eye and is linear in the picture: 1/(D - z), or z without perspective.
    pub(crate) nearness: f64,
    /// Factor that makes interpolation of vertex values linear in space: 1/(D - z), or 1.
    pub(crate) weight: f64,
}

impl Camera {
    /// A perspective view along `direction` (from the eye to the object; any length) that frames `points`.
    ///
    /// `up` appears upwards in the picture. A zero or non-finite direction counts as (0, 0, -1), the view from +z;
    /// an `up` that is parallel to the direction is replaced by some axis that is not. Points that are not finite
    /// are ignored. Pass only points that will be seen: see [`used_points`].
    pub fn framing(points: &[Point3<f64>], direction: Vector3<f64>, up: Vector3<f64>) -> Self {
        Self::new(points, direction, up, true)
    }

    /// Like [`framing`](Self::framing), in parallel projection: equal lengths appear equal.
    pub fn framing_orthographic(points: &[Point3<f64>], direction: Vector3<f64>, up: Vector3<f64>) -> Self {
        Self::new(points, direction, up, false)
    }

    /// The same view with the frame around `point` and narrower by `zoom` (2 shows half the width). A zoom that is
    /// not positive counts as 1; a point that cannot be projected leaves the frame's middle where it was.
    pub fn close_up(&self, point: Point3<f64>, zoom: f64) -> Self {
        let zoom = if zoom > 0.0 && zoom.is_finite() { zoom } else { 1.0 };
        let frame_middle = self.project(&self.view(&point)).map_or(self.frame_middle, |p| [p.x, p.y]);
        Self { frame_middle, frame_half: self.frame_half.map(|half| half / zoom), ..*self }
    }

    fn new(points: &[Point3<f64>], direction: Vector3<f64>, up: Vector3<f64>, perspective: bool) -> Self {
        let (middle, unit) = bounding_sphere(points);
        let backward = -unit_vector(direction).unwrap_or(-Vector3::z());
        let [right, up] = picture_axes(backward, up);
        let frame_middle = [0.0; 2];
        let frame_half = [1.0; 2];
        let camera = Self { middle, unit, right, up, backward, perspective, frame_middle, frame_half };
        camera.framed(points)
    }

    /// The camera with its rectangle fitted to the projected points.
    fn framed(self, points: &[Point3<f64>]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in points.iter().filter_map(|p| self.project(&self.view(p))) {
            for (axis, value) in [p.x, p.y].into_iter().enumerate() {
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        if low[0] > high[0] {
            return self;
        }
        let frame_middle = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
        // A thousandth of the diagonal at least, lest a single point be magnified without end.
        let frame_half = [0, 1].map(|axis| (0.5 * (high[axis] - low[axis])).max(1e-3));
        Self { frame_middle, frame_half, ..self }
    }

    /// View coordinates of a point.
    pub(crate) fn view(&self, point: &Point3<f64>) -> Vector3<f64> {
        let offset = (point - self.middle) / self.unit;
        Vector3::new(self.right.dot(&offset), self.up.dot(&offset), self.backward.dot(&offset))
    }

    /// Where view coordinates appear; `None` when they are not finite, or behind or next to the eye.
    pub(crate) fn project(&self, view: &Vector3<f64>) -> Option<Projected> {
        if !view.iter().all(|c| c.is_finite()) {
            return None;
        }
        if !self.perspective {
            return Some(Projected { x: view.x, y: view.y, nearness: view.z, weight: 1.0 });
        }
        let distance = EYE_DISTANCE - view.z;
        if distance < NEAREST {
            return None;
        }
        let (scale, weight) = (EYE_DISTANCE / distance, 1.0 / distance);
        Some(Projected { x: view.x * scale, y: view.y * scale, nearness: weight, weight })
    }

    /// The direction from a point in view coordinates to the eye, of any length.
    pub(crate) fn toward_eye(&self, view: &Vector3<f64>) -> Vector3<f64> {
        if self.perspective { Vector3::new(0.0, 0.0, EYE_DISTANCE) - view } else { Vector3::z() }
    }

    /// Scale and offsets from the projection plane to a picture: column = x · s + dx, row = -y · s + dy.
    pub(crate) fn picture_scale(&self, width: f64, height: f64) -> [f64; 3] {
        const MARGIN: f64 = 0.06;
        let free = 0.5 * (1.0 - 2.0 * MARGIN);
        let s = free * (width / self.frame_half[0]).min(height / self.frame_half[1]);
        [s, 0.5 * width - s * self.frame_middle[0], 0.5 * height + s * self.frame_middle[1]]
    }
}

/// The finite points that are corners of some triangle, for [`Camera::framing`]: files may hold others.
pub fn used_points(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<Point3<f64>> {
    let mut used = vec![false; points.len()];
    for &corner in triangles.iter().flatten() {
        if let Some(flag) = used.get_mut(corner as usize) {
            *flag = true;
        }
    }
    let finite = |p: &Point3<f64>| p.iter().all(|c| c.is_finite());
    points.iter().zip(used).filter(|(p, used)| *used && finite(p)).map(|(p, _)| *p).collect()
}

/// Middle and half diagonal (or 1 when that is zero) of the bounding box of the finite points.
fn bounding_sphere(points: &[Point3<f64>]) -> (Point3<f64>, f64) {
    let finite: Vec<_> = points.iter().filter(|p| p.iter().all(|c| c.is_finite())).collect();
    let Some(first) = finite.first() else {
        return (Point3::origin(), 1.0);
    };
    let (mut low, mut high) = (first.coords, first.coords);
    for p in &finite {
        low = low.inf(&p.coords);
        high = high.sup(&p.coords);
    }
    // Halves first: the difference of two large doubles may overflow.
    let half = high * 0.5 - low * 0.5;
    // The largest side comes out of the root, whose squares would overflow or vanish.
    let side = half.amax();
    let unit = if side > 0.0 { side * (half / side).norm() } else { 1.0 };
    let unit = if unit.is_finite() && unit >= f64::MIN_POSITIVE { unit } else { side.max(f64::MIN_POSITIVE) };
    (Point3::from(low * 0.5 + high * 0.5), unit)
}

/// The vector at length one; `None` of zero or non-finite vectors.
fn unit_vector(v: Vector3<f64>) -> Option<Vector3<f64>> {
    let largest = v.amax();
    if !(largest > 0.0 && largest.is_finite() && v.iter().all(|c| c.is_finite())) {
        return None;
    }
    // Twice, because the first quotient is inexact for subnormal vectors.
    let v = v / largest;
    Some(v / v.norm())
}

/// Right and up, unit vectors at right angles to `backward` and each other.
fn picture_axes(backward: Vector3<f64>, up: Vector3<f64>) -> [Vector3<f64>; 2] {
    let candidates = [up, Vector3::y(), Vector3::z(), Vector3::x()];
    let right = candidates
        .into_iter()
        .filter_map(unit_vector)
        .map(|up| up.cross(&backward))
        .find(|right| right.norm() > 1e-6)
        .and_then(unit_vector)
        .unwrap_or(Vector3::x());
    [right, backward.cross(&right)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> Vec<Point3<f64>> {
        (0..8).map(|i| Point3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect()
    }

    #[test]
    fn axes_are_right_handed_and_orthonormal() {
        for (direction, up) in [
            (Vector3::new(1.0, -2.0, 0.5), Vector3::y()),
            (Vector3::new(0.0, -3.0, 0.0), Vector3::y()),
            (Vector3::zeros(), Vector3::zeros()),
            (Vector3::new(f64::NAN, 0.0, 1.0), Vector3::x() * 1e300),
            (Vector3::new(1e-320, 0.0, 0.0), Vector3::z() * f64::MAX),
        ] {
            let c = Camera::framing(&corners(), direction, up);
            assert!((c.right.cross(&c.up) - c.backward).norm() < 1e-12);
            for v in [c.right, c.up, c.backward] {
                assert!((v.norm() - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn every_point_is_inside_the_margin_and_some_touch_it() {
        for perspective in [true, false] {
            let c = Camera::new(&corners(), Vector3::new(-1.0, -0.7, -2.0), Vector3::y(), perspective);
            let [s, dx, dy] = c.picture_scale(300.0, 200.0);
            let rows: Vec<f64> = corners()
                .iter()
                .map(|p| {
                    let p = c.project(&c.view(p)).unwrap();
                    let column = p.x * s + dx;
                    assert!((17.999..282.001).contains(&column), "{column}");
                    dy - p.y * s
                })
                .collect();
            let top = rows.iter().copied().fold(f64::INFINITY, f64::min);
            let bottom = rows.iter().copied().fold(0.0, f64::max);
            assert!((top - 12.0).abs() < 1e-9 && (bottom - 188.0).abs() < 1e-9);
        }
    }

    #[test]
    fn perspective_makes_near_things_large() {
        let view = |z| Vector3::new(0.5, 0.0, z);
        let camera = Camera::framing(&corners(), -Vector3::z(), Vector3::y());
        let x = |z| camera.project(&view(z)).map(|p| p.x);
        assert!(x(0.5) > x(-0.5));
        assert_eq!(x(0.0), Some(0.5));
        assert_eq!(x(5.0), None);
        let parallel = Camera::framing_orthographic(&corners(), -Vector3::z(), Vector3::y());
        assert_eq!(parallel.project(&view(7.0)).map(|p| p.x), Some(0.5));
    }

    #[test]
    fn close_up_centres_its_point() {
        let camera = Camera::framing(&corners(), Vector3::new(-1.0, -1.0, -1.0), Vector3::y());
        let near = camera.close_up(Point3::new(1.0, 0.0, 0.0), 4.0);
        let p = near.project(&near.view(&Point3::new(1.0, 0.0, 0.0))).unwrap();
        let [s, dx, dy] = near.picture_scale(100.0, 100.0);
        assert!((p.x * s + dx - 50.0).abs() < 1e-9 && (dy - p.y * s - 50.0).abs() < 1e-9);
        assert!((s / camera.picture_scale(100.0, 100.0)[0] - 4.0).abs() < 1e-9);
        assert_eq!(camera.close_up(Point3::new(f64::NAN, 0.0, 0.0), f64::NAN), camera);
    }

    #[test]
    fn any_extent_is_framed() {
        let far = Point3::new(f64::MAX, -f64::MAX, 0.0);
        let nan = Point3::new(f64::NAN, 0.0, 0.0);
        for points in [
            vec![],
            vec![nan],
            vec![Point3::origin()],
            vec![far, -far, nan],
            vec![Point3::new(1e-310, 0.0, 0.0), Point3::origin()],
        ] {
            let c = Camera::framing(&points, Vector3::new(1.0, 1.0, -1.0), Vector3::y());
            assert!(c.unit > 0.0 && c.unit.is_finite());
            assert!(c.picture_scale(10.0, 10.0).iter().all(|v| v.is_finite()));
        }
    }

    #[test]
    fn unused_and_bad_points_are_not_framed() {
        let points = [Point3::origin(), Point3::new(9.0, 9.0, 9.0), Point3::new(1.0, f64::NAN, 0.0)];
        assert_eq!(used_points(&points, &[[0, 2, 77]]), vec![Point3::origin()]);
    }
}
