//! Poses from landmarks that look alike.
//!
//! Each landmark of the suspect is compared with all of the reference, at each rung of the ladder by which the
//! two sizes may differ. The few most similar ones, with the frames of both, give a pose each. Most of them are
//! wrong; a table of nearest samples tells in microseconds how much of the suspect a pose puts onto the
//! reference (a RANSAC in which one match is a sample: Fischler and Bolles 1981, `fischler1981`). All poses are asked by few
//! samples, those that look best by more (preemption: Nistér 2003, `nister2003`). Poses that are about the same are one; the
//! best go through a rough ICP on the table.

use nalgebra::{Matrix3, Point3, Rotation3, Similarity3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use sombrero_landmarks::{Frame, Landmark, RUNG, View, ladder};

use crate::refinement::affine_map::AffineMap;
use crate::refinement::motion::Motion;
use crate::starts::landmarks::{LARGEST, Landmarks, cloud};
use crate::starts::ranking::{best, distinct, looked, ranked};
use crate::starts::rough;
use crate::surface::lookup::Lookup;
use crate::surface::sample::{Sample, samples, scattered};
use crate::surface::shape::Shape;

/// Landmarks of the suspect.
const COUNT: usize = 400;
/// Rungs by which the suspect may look smaller or larger than equal areas would have it. A suspect that keeps
/// the share f of the original's area and to which the share g of its own was added has the scale
/// √(f / (1 - g)) relative to equal areas: a third of the original gives 0.58, twice as much added as kept 1.73.
const SMALLER: usize = 4;
const LARGER: usize = 4;
/// Matches taken for each landmark and rung.
const MATCHES: usize = 8;
/// Samples in the first looks at a pose, and the poses that are looked at further.
const LOOKS: [(usize, usize); 2] = [(12, 8_000), (48, 2_000)];
/// Samples in the last look.
const LAST_LOOK: usize = 256;
/// Poses that get a rough ICP.
const ROUGH: usize = 120;
/// Poses that get a rough ICP when the suspect may be stretched, which blurs the first looks.
const AFFINE_ROUGH: usize = 240;
/// Distances up to which a sample supports a pose: before and after the rough ICP, in diagonals.
const TOLERANCES: [f64; 2] = [0.06, 0.03];
/// Poses closer than this on average are one: before and after the rough ICP, in diagonals.
const SAME: [f64; 2] = [0.08, 0.02];

/// One suspect's landmarks against those of the reference.
pub(crate) struct LandmarkMatcher<'a> {
    lookup: &'a Lookup,
    landmarks: &'a Landmarks,
    suspect: Vec<Landmark>,
    /// Scale of equal areas.
    scale: f64,
    looks: Vec<Sample>,
}

impl<'a> LandmarkMatcher<'a> {
    /// Describes the suspect's landmarks. `landmarks` and `lookup` are those of the reference, `orientation` is -1 when
    /// the suspect's normals are to be turned.
    pub(crate) fn new(
        landmarks: &'a Landmarks,
        lookup: &'a Lookup,
        suspect: &Shape,
        orientation: f64,
    ) -> Self {
        let scale = (landmarks.area / suspect.moments.area).sqrt();
        let radii: Vec<f64> = ladder(LARGEST, LARGER, SMALLER).iter().map(|r| r / scale).collect();
        let cloud = cloud(suspect, orientation);
        let points = samples(suspect, COUNT);
        let seen = points.par_iter().map(|s| cloud.landmark(s.point, &radii)).collect();
        let looks = scattered(suspect, LAST_LOOK, orientation);
        Self { lookup, landmarks, suspect: seen, scale, looks }
    }

    /// The best poses in the unit frames, best first; at most `most`.
    pub(crate) fn poses(&self, most: usize) -> Vec<Similarity3<f64>> {
        self.refined(|start| rough::icp(self.lookup, &self.looks, start), ROUGH, most)
    }

    /// The best affine maps in the unit frames, best first; at most `most`.
    pub(crate) fn affine_maps(&self, most: usize) -> Vec<AffineMap> {
        let refine = |start: &Similarity3<f64>| {
            let start = rough::icp(self.lookup, &self.looks, start);
            rough::icp(self.lookup, &self.looks, &start.map())
        };
        self.refined(refine, AFFINE_ROUGH, most)
    }

    fn refined<M: Motion>(
        &self,
        refine: impl Fn(&Similarity3<f64>) -> M + Sync,
        rough: usize,
        most: usize,
    ) -> Vec<M> {
        let found = LOOKS.iter().fold(self.matches(), |found, &(samples, most)| {
            best(looked(found, |pose| self.support(pose, samples, TOLERANCES[0])), most)
        });
        let found = ranked(found, |pose| self.support(pose, LAST_LOOK, TOLERANCES[0]));
        let found = distinct(&found, &self.looks, SAME[0], rough);
        let found = found.par_iter().map(|r| refine(&r.pose)).collect();
        let found = ranked(found, |pose| self.support(pose, LAST_LOOK, TOLERANCES[1]));
        distinct(&found, &self.looks, SAME[1], most).into_iter().map(|r| r.pose).collect()
    }

    /// The poses of all matches.
    fn matches(&self) -> Vec<Similarity3<f64>> {
        let of_landmark = |landmark: &Landmark| {
            let mut found = Vec::new();
            for (rung, view) in landmark.views.iter().enumerate() {
                let scale = self.scale * RUNG.powi(LARGER as i32 - rung as i32);
                for index in self.landmarks.alike(&view.features, MATCHES) {
                    found.extend(poses(&self.landmarks.landmarks[index], landmark, view, scale));
                }
            }
            found
        };
        self.suspect.par_iter().flat_map_iter(of_landmark).collect()
    }

    /// Share of the reference's area that the suspect covers: the share of the samples that agree, times the
    /// ratio of the areas, which a map L changes by about |det L|^(2/3).
    fn support<M: Motion>(&self, pose: &M, count: usize, tolerance: f64) -> f64 {
        let map = pose.map();
        let looks = &self.looks[..count.min(self.looks.len())];
        let share = rough::agreement(self.lookup, looks, &map, tolerance);
        share * (map.linear.determinant().abs().cbrt() / self.scale).powi(2)
    }
}

/// The poses that bring one landmark with its frames onto the other.
fn poses<'a>(
    reference: &'a Landmark,
    suspect: &'a Landmark,
    view: &'a View,
    scale: f64,
) -> impl Iterator<Item = Similarity3<f64>> + 'a {
    let theirs = reference.views.first().map_or(&[][..], |v| &v.frames);
    let pairs =
        view.frames.iter().flat_map(|s| theirs.iter().filter(|r| r.rule == s.rule).map(move |r| (r, s)));
    pairs.flat_map(move |(r, s)| {
        let turns = if s.two_fold { &[1.0, -1.0][..] } else { &[1.0][..] };
        turns.iter().map(move |sign| pose(&reference.point, r, &suspect.point, s, *sign, scale))
    })
}

fn pose(p: &Point3<f64>, r: &Frame, q: &Point3<f64>, s: &Frame, sign: f64, scale: f64) -> Similarity3<f64> {
    let turn = Matrix3::from_diagonal(&Vector3::new(sign, sign, 1.0));
    let rotation = Rotation3::from_matrix_unchecked(r.axes * turn * s.axes.transpose());
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    let shift = p.coords - rotation * q.coords * scale;
    Similarity3::from_parts(Translation3::from(shift), rotation, scale)
}
