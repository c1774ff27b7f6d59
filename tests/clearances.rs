//! Walls, gaps and layers: what is close stays as far apart as it was, and nothing cuts anything.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use nalgebra::Point3;
use proptest::prelude::*;
use sombrero::attacks::{Scheme, Subdivision, subdivide};
use sombrero::fidelity::{Change, Places, cracks, flatness, new_intersections};
use sombrero::io::{Document, Format};
use sombrero::mesh::{Facets, Soup};
use sombrero::shapes;
use sombrero::watermark::{Preset, Secret};
use sombrero::{EmbedOptions, embed};
use sombrero_tests::{document, joined, shell, wall};

/// The points of the copy of `soup` that this secret's mark makes.
fn copy(soup: &Soup, preset: Preset, secret: u8) -> Vec<Point3<f64>> {
    let original = document(Format::PlyBinaryLittleEndian, soup);
    let options =
        EmbedOptions { parameters: preset.parameters(), fewer_if_small: true, ..EmbedOptions::default() };
    let marked = embed(&original, Secret([secret; 32]), &options).unwrap();
    let copy = Document::parse(marked.bytes, None).unwrap();
    let moved = |(p, q): (&Point3<f64>, &Point3<f64>)| (q - p).norm();
    assert!(soup.points.iter().zip(copy.points()).map(moved).fold(0.0, f64::max) > 1e-6, "nothing moved");
    copy.points().to_vec()
}

/// The least distance of the points that `before` has at the same places of two lists.
fn least(near: &[Point3<f64>], far: &[Point3<f64>]) -> f64 {
    near.iter().zip(far).map(|(p, q)| (p - q).norm()).fold(f64::INFINITY, f64::min)
}

/// Vertices of `outer` on the inner side of the nearest face of `inner`.
fn inside(outer: &[Point3<f64>], inner: &[Point3<f64>], triangles: &[[u32; 3]]) -> usize {
    let surface = sombrero::spatial::Surface::new(inner, triangles);
    let is_inside = |p: &&Point3<f64>| {
        let closest = surface.closest(p).unwrap();
        let [a, b, c] = triangles[closest.face as usize].map(|v| inner[v as usize]);
        (b - a).cross(&(c - a)).dot(&(*p - closest.point)) < 0.0
    };
    outer.iter().filter(is_inside).count()
}

/// A body with shells about it, each so far from the one inside.
fn nested(body: &Soup, gaps: &[f64]) -> Vec<Soup> {
    let mut layers = vec![body.clone()];
    for gap in gaps {
        layers.push(shell(&layers[layers.len() - 1], *gap));
    }
    layers
}

/// Marks all layers together; fails unless each stays outside of the one before, at nine tenths of the gap.
fn layers_stay_apart(layers: &[Soup], gaps: &[f64], preset: Preset, secret: u8) {
    let all = layers.iter().cloned().reduce(|all, layer| joined(&all, &layer)).unwrap();
    let after = copy(&all, preset, secret);
    let parts: Vec<&[Point3<f64>]> = after.chunks(layers[0].points.len()).collect();
    for (pair, gap) in parts.windows(2).zip(gaps) {
        assert_eq!(inside(pair[1], pair[0], &layers[0].triangles), 0, "{gap}");
        let left = least(pair[0], pair[1]);
        assert!(left > 0.9 * gap, "{gap} became {left}");
    }
    assert_eq!(new_intersections(&Change::new(&all.points, &after, &all.triangles)), 0);
}

/// Marks a plate; fails unless it keeps nine tenths of its thickness.
fn wall_stays_thick(thickness: f64, secret: u8) {
    let wall = wall(thickness);
    let after = copy(&wall, Preset::Faithful, secret);
    let (front, back) = after.split_at(wall.points.len() / 2);
    let left = least(front, back);
    assert!(left > 0.9 * thickness, "{thickness} became {left}");
    assert_eq!(new_intersections(&Change::new(&wall.points, &after, &wall.triangles)), 0);
}

/// Needles, as exports of CAD have them: an edge of each is cut a few millionths of the side from one of its ends.
fn with_needles(soup: &Soup, every: usize) -> Soup {
    let mut cut = soup.clone();
    for side in (0..soup.triangles.len() * 3).step_by(every) {
        let [a, b, c] = [0, 1, 2].map(|k| cut.triangles[side / 3][(side + k) % 3]);
        let runs = |t: &[u32; 3]| (0..3).find(|&k| t[k] == b && t[(k + 1) % 3] == a);
        let Some((other, k)) = (0..).zip(&cut.triangles).find_map(|(i, t)| Some((i as usize, runs(t)?)))
        else {
            continue;
        };
        let d = cut.triangles[other][(k + 2) % 3];
        let [p, q] = [a, b].map(|v| cut.points[v as usize]);
        let new = cut.points.len() as u32;
        cut.points.push(p + (q - p).normalize() * 5e-7);
        cut.triangles[side / 3] = [a, new, c];
        cut.triangles[other] = [b, new, d];
        cut.triangles.extend([[new, b, c], [new, a, d]]);
    }
    cut
}

/// The ends of needles stay together, and the planes at them planar.
#[test]
fn needles_do_not_open() {
    let part = with_needles(&shapes::part(shapes::PART_RESOLUTION), 97);
    let needles = part.points.len() - shapes::part(shapes::PART_RESOLUTION).points.len();
    assert!(needles > 10, "{needles}");
    for secret in [1, 2] {
        let after = copy(&part, Preset::Faithful, secret);
        let found = cracks(&Places::new(&part.points, &after).with_tolerance(1e-6));
        assert!(found.before > 4e-7 && found.after < found.before + 1e-6, "{found:?}");
        let bent = flatness(&Change::new(&part.points, &after, &part.triangles)).unwrap();
        assert!(bent < 1e-6, "{bent}");
    }
}

/// A body and one of a third of its size that stands so far from it, in its largest sides.
fn beside(gap: f64) -> [Soup; 2] {
    let body = shapes::bumpy_sphere(700);
    let small = shapes::bumpy_sphere(500);
    let side = body.bounding_box().unwrap().largest_side();
    let across = |soup: &Soup, scale: f64, sign: f64| {
        soup.points.iter().map(|p| sign * scale * p.x).fold(f64::NEG_INFINITY, f64::max)
    };
    let shift = across(&body, 1.0, 1.0) + across(&small, 0.33, -1.0) + gap * side;
    let at = |p: &Point3<f64>| Point3::new(0.33 * p.x + shift, 0.33 * p.y, 0.33 * p.z);
    [body, Soup::new(small.points.iter().map(at).collect(), small.triangles)]
}

/// Solids with clearance move each by itself, those that touch go along: neither way do they come to cut.
#[test]
fn solids_beside_each_other_do_not_come_to_cut() {
    for (gap, preset) in [0.02, 0.004, 0.0012, 0.0005]
        .into_iter()
        .flat_map(|gap| [Preset::Robust, Preset::Faithful].map(|preset| (gap, preset)))
    {
        let [body, small] = beside(gap);
        let both = joined(&body, &small);
        for secret in [1, 2, 3] {
            let after = copy(&both, preset, secret);
            let new = new_intersections(&Change::new(&both.points, &after, &both.triangles));
            assert_eq!(new, 0, "{gap} {preset:?} {secret}");
        }
    }
}

#[test]
fn a_shell_close_about_a_body_stays_outside() {
    let body = shapes::bumpy_sphere(700);
    for (gap, preset) in [(0.005, Preset::Robust), (0.005, Preset::Faithful), (0.02, Preset::Faithful)] {
        layers_stay_apart(&nested(&body, &[gap]), &[gap], preset, 7);
    }
}

#[test]
fn a_thin_wall_keeps_nine_tenths_of_its_thickness() {
    for thickness in [0.004, 0.02] {
        wall_stays_thick(thickness, 7);
    }
}

/// The ball with a point so far off the middle of an edge of every tenth face, inside of the face: one of the three
/// faces that it makes is that thin.
fn with_thin_faces(ball: &Soup, height: f64) -> Soup {
    let mut soup = ball.clone();
    for face in (0..ball.triangles.len()).step_by(10) {
        let corners = ball.triangles[face];
        let [a, b, c] = corners.map(|v| ball.points[v as usize]);
        let middle = nalgebra::center(&a, &b);
        let new = soup.points.len() as u32;
        soup.points.push(middle + (c - middle).normalize() * height);
        soup.triangles[face] = [corners[0], corners[1], new];
        soup.triangles.extend([[corners[1], corners[2], new], [corners[2], corners[0], new]]);
    }
    soup
}

#[test]
fn thin_faces_do_not_fold() {
    for (vertices, height) in [(700, 1e-3), (3500, 1e-4)] {
        let soup = with_thin_faces(&shapes::bumpy_sphere(vertices), height);
        let after = copy(&soup, Preset::Faithful, 7);
        let [was, is] = [&soup.points, &after].map(|points| Facets::new(points, &soup.triangles).normals);
        let least = was.iter().zip(&is).map(|(n, m)| n.dot(m)).fold(1.0, f64::min);
        assert!(least > 0.9, "a face turned to a cosine of {least}");
    }
}

#[test]
fn a_preset_that_was_tried_is_not_advised() {
    let subdivision = Subdivision { scheme: Scheme::Midpoint, iterations: 3 };
    let cube = document(Format::Obj, &subdivide(&shapes::cube(), &subdivision).unwrap().soup);
    let warned = |preset: Preset| {
        let options =
            EmbedOptions { parameters: preset.parameters(), fewer_if_small: true, ..EmbedOptions::default() };
        embed(&cube, Secret([1; 32]), &options).unwrap().report.warnings.concat()
    };
    // The preset robust, since nothing of it moves unseen.
    let tried = warned(Preset::Faithful);
    assert!(tried.contains("preset robust") && tried.contains("lower epsilon."), "{tried}");
    assert!(!tried.contains("--preset faithful"), "{tried}");
    let chosen = warned(Preset::Robust);
    assert!(chosen.contains("lower epsilon or take --preset faithful"), "{chosen}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn random_nested_shells_keep_their_gaps(
        logs in prop::collection::vec(-6.0..-3.0_f64, 1..3),
        vertices in 300..900_usize,
        secret in any::<u8>(),
    ) {
        let gaps: Vec<f64> = logs.iter().map(|log| log.exp()).collect();
        let body = shapes::bumpy_sphere(vertices);
        layers_stay_apart(&nested(&body, &gaps), &gaps, Preset::Faithful, secret);
    }

    #[test]
    fn random_walls_keep_their_thickness(log in -7.0..-2.5_f64, secret in any::<u8>()) {
        wall_stays_thick(log.exp(), secret);
    }
}
