//! What the surface looks like around a point, at several sizes: integral invariants of concentric balls.
//!
//! The part of the surface within the ball of radius r about a landmark p has an area, a centroid, second
//! moments and a mean normal. With lengths divided by r they are the same for the same surface in any pose,
//! at any scale and in any tessellation, and as integrals they hardly feel noise (Manay, Cremers, Hong, Yezzi
//! and Soatto 2006, `manay2006`; Pottmann, Wallner, Huang and Yang 2009, `pottmann2009`):
//!
//! | feature | meaning |
//! |---|---|
//! | ln (area / π r²) | 0 in a plane |
//! | z · (centroid - p) / r | convex or concave |
//! | length of its tangential part | how uneven the area lies around p |
//! | roots of the eigenvalues of the covariance / r² | flat, ridge, corner |
//! | length of the mean normal, and its part along z | how bent |
//!
//! z is the mean normal in the smallest ball. The directions in which the area lies give *frames*: two
//! landmarks that look alike, with a frame each, make a whole pose.
//!
//! Radii come from a ladder with the ratio [`RUNG`]. A landmark of the suspect has more rungs than one of the
//! reference, so that the two can be compared at several ratios of their sizes.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};

use crate::SurfacePoint;

/// Ratio between neighbouring radii of the ladder.
pub const RUNG: f64 = 1.16;
/// Rungs from one radius of a description to the next.
const STRIDE: usize = 2;
/// Balls of a description.
const BALLS: usize = 4;
/// Rungs from the first to the last ball of a description.
pub const SPAN: usize = STRIDE * (BALLS - 1);
/// Features of a ball.
const FEATURES: usize = 8;
/// Numbers of a description.
pub const NUMBERS: usize = BALLS * FEATURES;
/// The balls whose area gives the frames.
const FRAME_BALLS: [usize; 2] = [1, 3];
/// Directions less pronounced than this give no frame: relative difference of two moments, or
/// distance of the centroid in radii.
const PRONOUNCED: f64 = 0.06;

/// The numbers that are compared.
pub type Features = [f32; NUMBERS];

/// A landmark as it looks at one rung of the ladder.
#[derive(Debug, Clone)]
pub struct View {
    /// What the surface around is like.
    pub features: Features,
    /// Right-handed frames as columns, z last.
    pub frames: Vec<Frame>,
}

/// Axes at a landmark.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// A rotation matrix: columns x, y and z.
    pub axes: Matrix3<f64>,
    /// Which rule gave it: frames of one rule correspond.
    pub rule: usize,
    /// Whether x might as well be -x.
    pub two_fold: bool,
}

/// A point of a surface and its views, one for each rung from which [`SPAN`] more exist.
#[derive(Debug, Clone)]
pub struct Landmark {
    /// Where it is.
    pub point: Point3<f64>,
    /// One for each rung that has [`SPAN`] more above it, smallest radii first.
    pub views: Vec<View>,
}

/// A surface as an even cloud of points with normals.
pub struct Cloud {
    samples: Vec<SurfacePoint>,
    tree: Option<ImmutableKdTree<f64, 3>>,
    /// Area that a sample stands for.
    share: f64,
}

/// Sums over the samples in a ball, relative to its centre.
#[derive(Clone, Copy, Default)]
struct Ball {
    count: f64,
    first: Vector3<f64>,
    second: Matrix3<f64>,
    normal: Vector3<f64>,
}

impl Cloud {
    /// The cloud of `samples` with normals of length 1 (or 0 where there is none), each of which stands for the same part
    /// of the surface's `area`. All features but the sign of the height stay the same when all normals are turned.
    pub fn new(samples: Vec<SurfacePoint>, area: f64) -> Self {
        let positions: Vec<[f64; 3]> = samples.iter().map(|s| s.point.coords.into()).collect();
        let tree = ImmutableKdTree::new_from_slice(&positions).ok();
        Self { tree, share: area / samples.len().max(1) as f64, samples }
    }

    /// The points that the cloud is made of.
    pub fn samples(&self) -> &[SurfacePoint] {
        &self.samples
    }

    /// A landmark at `point`, seen with the ladder of `radii`, ascending.
    pub fn landmark(&self, point: Point3<f64>, radii: &[f64]) -> Landmark {
        let balls = self.balls(&point, radii);
        let rungs = radii.len().saturating_sub(SPAN);
        let views = (0..rungs).map(|rung| self.view(&balls[rung..], &radii[rung..])).collect();
        Landmark { point, views }
    }

    /// Sums within each of the radii.
    fn balls(&self, point: &Point3<f64>, radii: &[f64]) -> Vec<Ball> {
        let mut balls = vec![Ball::default(); radii.len()];
        let (Some(tree), Some(largest)) = (&self.tree, radii.last()) else { return balls };
        let query: [f64; 3] = point.coords.into();
        let within =
            tree.query(&query).within::<SquaredEuclidean<f64>>(largest * largest).unsorted().execute();
        let mut items: Vec<u32> = within.into_iter().map(|found| found.item).collect();
        // Sums are to be the same whatever the order in which the tree is walked.
        items.sort_unstable();
        for item in items {
            let sample = &self.samples[item as usize];
            let d = sample.point - point;
            let ring = radii.partition_point(|r| r * r < d.norm_squared());
            if let Some(ball) = balls.get_mut(ring) {
                ball.count += 1.0;
                ball.first += d;
                ball.second.syger(1.0, &d, &d, 1.0);
                ball.normal += sample.normal;
            }
        }
        for ring in 1..balls.len() {
            let inner = balls[ring - 1];
            balls[ring].add(&inner);
        }
        balls
    }

    /// The description that starts with the first of `balls`.
    fn view(&self, balls: &[Ball], radii: &[f64]) -> View {
        let z = balls[0].normal.try_normalize(0.0).unwrap_or_else(Vector3::z);
        let mut features = [0.0; NUMBERS];
        let mut frames = Vec::with_capacity(2 * FRAME_BALLS.len());
        for number in 0..BALLS {
            let (ball, r) = (&balls[number * STRIDE], radii[number * STRIDE]);
            // Samples that a plane would have in the ball; none where there is no surface.
            let plane = if self.share > 0.0 { std::f64::consts::PI * r * r / self.share } else { 0.0 };
            let at = number * FEATURES;
            features[at..at + FEATURES].copy_from_slice(&ball.features(&z, r, plane));
            if let Some(which) = FRAME_BALLS.iter().position(|b| *b == number) {
                frames.extend(ball.frames(&z, r, 2 * which));
            }
        }
        View { features, frames }
    }
}

impl Ball {
    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.first += other.first;
        self.second += other.second;
        self.normal += other.normal;
    }

    fn mean(&self) -> Vector3<f64> {
        self.first / self.count.max(1.0)
    }

    fn covariance(&self) -> Matrix3<f64> {
        let mean = self.mean();
        let mut second = self.second / self.count.max(1.0);
        second.fill_upper_triangle_with_lower_triangle();
        second - mean * mean.transpose()
    }

    fn features(&self, z: &Vector3<f64>, r: f64, plane: f64) -> [f32; FEATURES] {
        let mean = self.mean() / r;
        let height = mean.dot(z);
        let mut spreads =
            SymmetricEigen::new(self.covariance() / (r * r)).eigenvalues.map(|x| x.max(0.0).sqrt());
        spreads.as_mut_slice().sort_by(|a, b| b.total_cmp(a));
        let normal = self.normal / self.count.max(1.0);
        let area = libm::log((self.count + 1.0) / (plane + 1.0));
        let aside = (mean - z * height).norm();
        [area, height, aside, spreads[0], spreads[1], spreads[2], normal.norm(), normal.dot(z)]
            .map(|x| x as f32)
    }

    /// The frames by the side on which the centroid lies, and by the longest tangential axis of the covariance.
    fn frames(&self, z: &Vector3<f64>, r: f64, rule: usize) -> impl Iterator<Item = Frame> {
        let frame = |x: Vector3<f64>, rule, two_fold| {
            let x = (x - z * z.dot(&x)).try_normalize(1e-9)?;
            Some(Frame { axes: Matrix3::from_columns(&[x, z.cross(&x), *z]), rule, two_fold })
        };
        let mean = self.mean();
        let aside = mean - z * z.dot(&mean);
        let by_centroid = (aside.norm() > PRONOUNCED * r).then(|| frame(aside, rule, false)).flatten();
        let by_axis = self.longest_axis(z).and_then(|x| frame(x, rule + 1, true));
        [by_centroid, by_axis].into_iter().flatten()
    }

    /// The larger eigenvector of the covariance within the plane orthogonal to z.
    fn longest_axis(&self, z: &Vector3<f64>) -> Option<Vector3<f64>> {
        let u = z.cross(&Vector3::ith(z.iamin(), 1.0)).try_normalize(0.0)?;
        let v = z.cross(&u);
        let c = self.covariance();
        let (uu, uv, vv) = (u.dot(&(c * u)), u.dot(&(c * v)), v.dot(&(c * v)));
        let difference = (uu - vv).hypot(2.0 * uv);
        let angle = (2.0 * uv).atan2(uu - vv) / 2.0;
        (difference > PRONOUNCED * (uu + vv)).then(|| u * angle.cos() + v * angle.sin())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{area, ladder, surface_points};
    use nalgebra::Similarity3;
    use sombrero_mesh::Soup;
    use sombrero_shapes as shapes;

    fn cloud(soup: &Soup) -> Cloud {
        let samples = surface_points(&soup.points, &soup.triangles, 6_000);
        Cloud::new(samples, area(&soup.points, &soup.triangles))
    }

    #[test]
    fn the_same_in_every_pose_and_tessellation() {
        let (fine, mut coarse) = (shapes::bumpy_sphere(4000), shapes::bumpy_sphere(2000));
        let turn = Similarity3::new(Vector3::new(3.0, 0.0, 9.0), Vector3::new(1.0, -2.0, 0.5), 2.0);
        coarse.points.iter_mut().for_each(|p| *p = turn * *p);
        let (here, there) = (cloud(&fine), cloud(&coarse));
        let largest = 0.17 * fine.bounding_box().unwrap().diagonal();
        for sample in surface_points(&fine.points, &fine.triangles, 40) {
            let a = here.landmark(sample.point, &ladder(largest, 0, 0));
            let b = there.landmark(turn * sample.point, &ladder(2.0 * largest, 0, 0));
            let worst = a.views[0].features.iter().zip(b.views[0].features).map(|(x, y)| (x - y).abs());
            assert!(worst.fold(0.0, f32::max) < 0.12);
            for frame in a.views[0].frames.iter().chain(&b.views[0].frames) {
                assert!((frame.axes.determinant() - 1.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn nothing_around_is_no_trouble() {
        for cloud in [cloud(&shapes::cube()), Cloud::new(Vec::new(), 0.0)] {
            let landmark = cloud.landmark(Point3::new(9.0, 9.0, 9.0), &ladder(0.17, 0, 0));
            assert!(landmark.views[0].features.iter().all(|x| x.is_finite()));
            assert!(landmark.views[0].frames.is_empty());
        }
    }
}
