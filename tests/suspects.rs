//! Suspects that have nothing to do with the original, or are hardly a surface.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use nalgebra::Point3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero::watermark::{Preset, Secret};
use sombrero::{DetectError, DetectOptions, Detection, Detector, EmbedOptions, FirstLook, Glancer, embed};
use sombrero_tests::joined;

fn document(soup: &Soup) -> Document {
    Document::parse(encode(Format::Obj, soup).unwrap(), None).unwrap()
}

/// These stories are of the method, and of marks as strong as they can be.
fn robust() -> EmbedOptions {
    EmbedOptions { parameters: Preset::Robust.parameters(), ..EmbedOptions::default() }
}

fn detector() -> Detector {
    let original = document(&shapes::bust(12));
    let marked = embed(&original, Secret([3; 32]), &robust()).unwrap();
    Detector::new(&original, marked.key).unwrap()
}

fn look(detector: &Detector, suspect: &Soup) -> Result<Detection, DetectError> {
    detector.detect(&detector.suspect(&document(suspect)), &DetectOptions::default())
}

/// Numbers only, and a p that says nothing was found.
fn assert_nothing_found(detection: &Detection) {
    assert!(!detection.detected, "{detection:?}");
    assert!(detection.log10_p.is_finite() && detection.log10_p > -3.0, "{}", detection.log10_p);
    assert!(detection.correlation.is_finite());
    assert!(detection.coverage.is_sign_positive() && detection.coverage <= 1.0, "{}", detection.coverage);
    if let Some(alignment) = &detection.registration {
        assert!(alignment.matrix.iter().flatten().all(|x| x.is_finite()) && alignment.rms.is_finite());
    }
}

fn triangles_at(points: &[[f64; 3]]) -> Soup {
    let triangles = (0..points.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Soup::new(points.iter().copied().map(Point3::from).collect(), triangles)
}

#[test]
fn other_shapes_are_not_found() {
    let detector = detector();
    for other in [shapes::torus(30, 20, 1.0, 0.4), shapes::part(1)] {
        assert_nothing_found(&look(&detector, &other).unwrap());
    }
}

/// Another shape is told without the basis, and by a detector that has one in the same words; a copy is not.
#[test]
fn other_shapes_are_told_by_their_shape_alone() {
    let original = document(&shapes::bust(12));
    let marked = embed(&original, Secret([3; 32]), &robust()).unwrap();
    let glancer = Glancer::new(&original, marked.key.clone()).unwrap();
    let detector = Detector::new(&original, marked.key).unwrap();
    let copy = Document::parse(marked.bytes, None).unwrap();
    let options = DetectOptions::default();
    let torus = document(&shapes::torus(30, 20, 1.0, 0.4));
    let seen = match glancer.look(&glancer.suspect(&torus), &options).unwrap() {
        FirstLook::AnotherShape(answer) => *answer,
        FirstLook::Open(_) => panic!("a torus is no bust"),
    };
    let mut detected = detector.detect(&detector.suspect(&torus), &options).unwrap();
    assert!(seen.variant.is_none() && seen.variants.is_empty() && seen.p_value == 1.0 && !seen.detected);
    let stages = |detection: &Detection| detection.seconds.0.iter().map(|stage| stage.0).collect::<Vec<_>>();
    assert_eq!(stages(&seen), stages(&detected), "a replay asks for the same stages");
    detected.seconds = seen.seconds.clone();
    assert_eq!(detected, seen);
    // Of a copy, bent or in a mirror, the first look says nothing.
    for spec in ["simplify:ratio=0.5 ffd:strength=0.05 transform", "simplify:ratio=0.5 mirror transform"] {
        let attacks = parse_list(spec).unwrap();
        let soup = apply_all(&attacks, copy.soup(), &mut ChaCha8Rng::seed_from_u64(5)).unwrap().soup;
        let first = glancer.look(&glancer.suspect(&document(&soup)), &options).unwrap();
        let FirstLook::Open(glance) = first else { panic!("{spec}: taken for another shape") };
        let found = detector.detect_after(glance, &detector.suspect(&document(&soup)), &options).unwrap();
        assert!(found.detected, "{spec}: {}", found.log10_p);
    }
}

/// A simplified quarter fits elsewhere at another size as well as where it lies; nobody moved it, so there it is found.
#[test]
fn a_small_piece_that_was_not_moved_is_found_where_it_lies() {
    let original = document(&shapes::part(shapes::PART_RESOLUTION));
    let marked = embed(&original, Secret([1; 32]), &robust()).unwrap();
    let copy = Document::parse(marked.bytes, None).unwrap().soup().clone();
    let attacks = parse_list("crop:fraction=0.8 simplify:ratio=0.5").unwrap();
    let piece = apply_all(&attacks, &copy, &mut ChaCha8Rng::seed_from_u64(1)).unwrap().soup;
    let detector = Detector::new(&original, marked.key).unwrap();
    let detection = look(&detector, &piece).unwrap();
    assert!(detection.detected && detection.log10_p < -60.0, "{}", detection.log10_p);
}

#[test]
fn hardly_a_surface_is_not_found() {
    let detector = detector();
    let one = triangles_at(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let mut flat = shapes::open_sheet(15, 15);
    flat.points.iter_mut().for_each(|p| p.z = 0.0);
    for suspect in [one, flat] {
        assert_nothing_found(&look(&detector, &suspect).unwrap());
    }
}

#[test]
fn no_extent_at_all_is_a_clear_error() {
    let detector = detector();
    let dot = triangles_at(&[[1.0, 2.0, 3.0]; 6]);
    let message = look(&detector, &dot).unwrap_err().to_string();
    assert!(message.contains("no face with an area") && !message.contains("NaN"), "{message}");
}

/// Bumpy balls, each stretched in its own way; all of one connectivity, but for every third.
fn kit(count: usize) -> Vec<Soup> {
    let part = |i: usize| {
        let mut ball = shapes::bumpy_sphere(if i % 3 == 2 { 900 } else { 600 });
        let [a, b] = [i as f64, 0.7 * i as f64 + 0.3].map(|x| 1.0 + 0.3 * (x - x.floor()) + 0.08 * x);
        for p in &mut ball.points {
            let bend = 0.15 * (2.0 * p.x + i as f64).sin();
            *p = Point3::new(a * p.x, b * p.y + bend, p.z / (0.5 * (a + b)) + bend * p.y);
        }
        ball
    };
    (0..count).map(part).collect()
}

/// All in one file, in a row.
fn laid(parts: &[Soup], place: impl Fn(usize, &Point3<f64>) -> Point3<f64>) -> Soup {
    let placed = |(i, part): (usize, &Soup)| {
        Soup::new(part.points.iter().map(|p| place(i, p)).collect(), part.triangles.clone())
    };
    parts.iter().enumerate().map(placed).fold(Soup::default(), |all, part| joined(&all, &part))
}

fn in_a_row(i: usize, p: &Point3<f64>) -> Point3<f64> {
    Point3::new(p.x + 4.0 * i as f64, p.y, p.z)
}

/// Turned and scaled, each in its own way, and moved away from the others.
fn elsewhere(i: usize, p: &Point3<f64>) -> Point3<f64> {
    let turn = nalgebra::Rotation3::from_euler_angles(0.4 + i as f64, 1.1 * i as f64, 2.0 - i as f64);
    turn * (p * (1.0 + 0.1 * i as f64)) + nalgebra::Vector3::new(0.0, 6.0 * i as f64, -3.0)
}

/// A kit, its detector, and the marked parts about their own origins.
fn marked_kit(count: usize, preset: Preset) -> (Detector, Vec<Soup>) {
    let parts = kit(count);
    let original = document(&laid(&parts, in_a_row));
    let options = EmbedOptions { parameters: preset.parameters(), ..EmbedOptions::default() };
    let marked = embed(&original, Secret([5; 32]), &options).unwrap();
    let copy = Document::parse(marked.bytes, None).unwrap();
    let mut first = 0;
    let pieces = parts.iter().enumerate().map(|(i, part)| {
        let points = &copy.soup().points[first..first + part.points.len()];
        first += part.points.len();
        let about = points.iter().map(|p| Point3::new(p.x - 4.0 * i as f64, p.y, p.z));
        Soup::new(about.collect(), part.triangles.clone())
    });
    (Detector::new(&original, marked.key).unwrap(), pieces.collect())
}

#[test]
fn parts_of_a_kit_are_found_wherever_they_lie() {
    for preset in [Preset::Robust, Preset::Faithful] {
        let (detector, parts) = marked_kit(5, preset);
        let all = look(&detector, &laid(&parts, elsewhere)).unwrap();
        assert!(all.log10_p < -60.0, "{preset:?}: {}", all.log10_p);
        assert_eq!(all.parts.iter().map(|part| part.component).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        assert_eq!(all.variant.map(|best| best.look), Some("parts"));
        assert!(all.coverage > 0.99 && all.parts.iter().all(|part| part.coverage > 0.99 && !part.mirrored));
        // Two of them, one mirrored, and something else beside.
        let mut some = vec![parts[3].clone(), shapes::bust(8), parts[1].clone()];
        some[0].points.iter_mut().for_each(|p| p.x = -p.x);
        let half = look(&detector, &laid(&some, elsewhere)).unwrap();
        assert!(half.detected && half.log10_p < -20.0, "{preset:?}: {}", half.log10_p);
        let found: Vec<_> =
            half.parts.iter().map(|part| (part.component, part.suspect_component, part.mirrored)).collect();
        assert_eq!(found, [(1, 2, false), (3, 0, true)]);
        // One of them alone.
        let one = look(&detector, &laid(&parts[2..3], elsewhere)).unwrap();
        assert!(one.detected && one.registration.is_some(), "{preset:?}: {}", one.log10_p);
        assert_eq!(one.parts.len(), 1);
    }
}

#[test]
fn a_part_that_occurs_twice_is_tried_as_both() {
    let ball = kit(1).remove(0);
    let original = document(&laid(&[ball.clone(), ball.clone()], in_a_row));
    let marked = embed(&original, Secret([9; 32]), &robust()).unwrap();
    let copy = Document::parse(marked.bytes, None).unwrap();
    let second = Soup::new(copy.soup().points[ball.points.len()..].to_vec(), ball.triangles.clone());
    let detector = Detector::new(&original, marked.key).unwrap();
    let found = look(&detector, &laid(&[second], elsewhere)).unwrap();
    assert!(found.detected && found.parts.len() == 1, "{}", found.log10_p);
    assert_eq!(found.parts[0].component, 1);
}

#[test]
fn parts_are_found_by_their_surfaces() {
    let (detector, parts) = marked_kit(3, Preset::Robust);
    let coarse = |part: &Soup| {
        let attacks = parse_list("simplify:ratio=0.6").unwrap();
        apply_all(&attacks, part, &mut ChaCha8Rng::seed_from_u64(2)).unwrap().soup
    };
    let coarse: Vec<Soup> = parts.iter().map(coarse).collect();
    let found = look(&detector, &laid(&coarse, elsewhere)).unwrap();
    assert!(found.detected && found.log10_p < -20.0, "{}", found.log10_p);
    assert_eq!(found.parts.iter().map(|part| part.component).collect::<Vec<_>>(), [0, 1, 2]);
    // Nothing is said of how badly it fits as a whole.
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
}

#[test]
fn kits_that_are_not_marked_are_not_found() {
    let (detector, _) = marked_kit(4, Preset::Robust);
    let parts = kit(4);
    let detection = look(&detector, &laid(&parts, elsewhere)).unwrap();
    assert_nothing_found(&detection);
    assert_eq!(detection.variants_counted % 128, 0);
    // Of one by itself too the vertices say all, so that no surface is laid on another.
    let one = look(&detector, &laid(&parts[..1], elsewhere)).unwrap();
    assert_nothing_found(&one);
    assert!(one.seconds.0.iter().all(|(stage, _)| *stage != "registration"), "{:?}", one.seconds);
}

fn mirrored(soup: &Soup) -> Soup {
    let points = soup.points.iter().map(|p| Point3::new(p.x, p.y, -p.z)).collect();
    Soup::new(points, soup.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect())
}

#[test]
fn mirror_images_are_found_and_called_so() {
    let original = document(&shapes::part(shapes::PART_RESOLUTION));
    let marked = embed(&original, Secret([1; 32]), &robust()).unwrap();
    let copy = Document::parse(marked.bytes, None).unwrap().soup().clone();
    let detector = Detector::new(&original, marked.key).unwrap();
    for (attacks, limit) in
        [("none", -60.0), ("simplify:ratio=0.5", -60.0), ("crop:fraction=0.333 simplify:ratio=0.8", -20.0)]
    {
        let attacks = parse_list(attacks).unwrap();
        let suspect = apply_all(&attacks, &mirrored(&copy), &mut ChaCha8Rng::seed_from_u64(1)).unwrap().soup;
        let found = look(&detector, &suspect).unwrap();
        assert!(found.detected && found.log10_p < limit, "{attacks:?}: {}", found.log10_p);
        assert!(found.registration.unwrap().mirrored, "{attacks:?}");
    }
}

fn attacked(soup: &Soup, specs: &str, seed: u64) -> Soup {
    apply_all(&parse_list(specs).unwrap(), soup, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap().soup
}

/// Connectivity that goes onto itself in many ways: where vertices lie says which is right, and of a ball, whose shape does not
/// say it either, each is tried.
#[test]
fn renumbered_turned_bodies_are_found() {
    for body in [shapes::vase(56, 36), shapes::sphere(3)] {
        let original = document(&body);
        let marked = embed(&original, Secret([4; 32]), &robust()).unwrap();
        let copy = Document::parse(marked.bytes, None).unwrap().soup().clone();
        let detector = Detector::new(&original, marked.key).unwrap();
        for seed in 0..3 {
            for specs in ["reorder", "reorder noise:amplitude=0.0005 transform"] {
                let found = look(&detector, &attacked(&copy, specs, seed)).unwrap();
                let points = body.points.len();
                assert!(found.log10_p < -60.0, "{points} points, {specs}, {seed}: {}", found.log10_p);
            }
        }
    }
}

#[test]
fn pieces_and_mirror_images_of_renumbered_turned_bodies_are_found() {
    let original = document(&shapes::vase(56, 36));
    let marked = embed(&original, Secret([6; 32]), &robust()).unwrap();
    let copy = Document::parse(marked.bytes, None).unwrap().soup().clone();
    let detector = Detector::new(&original, marked.key).unwrap();
    for seed in 0..2 {
        for specs in ["reorder crop:fraction=0.5", "reorder crop:fraction=0.3 transform"] {
            let found = look(&detector, &attacked(&copy, specs, seed)).unwrap();
            assert!(found.log10_p < -60.0, "{specs}, {seed}: {}", found.log10_p);
        }
        let found = look(&detector, &attacked(&mirrored(&copy), "reorder", seed)).unwrap();
        assert!(found.log10_p < -60.0, "mirrored, {seed}: {}", found.log10_p);
    }
}

#[test]
fn renumbered_turned_parts_of_a_kit_are_found() {
    let bodies = [shapes::vase(56, 36), shapes::vase(40, 30)];
    let original = document(&laid(&bodies, in_a_row));
    let marked = embed(&original, Secret([7; 32]), &robust()).unwrap();
    let copy = Document::parse(marked.bytes, None).unwrap().soup().clone();
    let first = bodies[0].points.len();
    let detector = Detector::new(&original, marked.key).unwrap();
    let halves = [0..first, first..copy.points.len()];
    let bodies = bodies
        .iter()
        .zip(halves)
        .map(|(body, range)| Soup::new(copy.points[range].to_vec(), body.triangles.clone()));
    let bodies: Vec<Soup> = bodies.collect();
    for seed in 0..2 {
        let suspect = attacked(&laid(&bodies, elsewhere), "reorder", seed);
        let found = look(&detector, &suspect).unwrap();
        assert!(found.log10_p < -60.0 && found.parts.len() == 2, "{seed}: {}", found.log10_p);
    }
}

/// Points scattered over a surface, with noise, as a scanner leaves them.
fn scanned(soup: &Soup, count: usize, noise: f64) -> Soup {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let side = soup.bounding_box().unwrap().largest_side();
    let samples = sombrero::spatial::spread_samples(&soup.points, &soup.triangles, count);
    let place = |sample: &sombrero::spatial::SurfaceSample| {
        let p = sample.point(&soup.points, &soup.triangles).unwrap();
        elsewhere(3, &(p + sombrero::spatial::sample_ball(&mut rng) * (noise * side)))
    };
    Soup::new(samples.iter().map(place).collect(), Vec::new())
}

#[test]
fn point_clouds_are_found() {
    let original = document(&shapes::part(shapes::PART_RESOLUTION));
    let marked = embed(&original, Secret([1; 32]), &robust()).unwrap();
    let copy = Document::parse(marked.bytes, None).unwrap().soup().clone();
    let detector = Detector::new(&original, marked.key).unwrap();
    let found = look(&detector, &scanned(&copy, 20_000, 0.001)).unwrap();
    assert!(found.detected && found.log10_p < -20.0, "{}", found.log10_p);
    let image = look(&detector, &scanned(&mirrored(&copy), 20_000, 0.001)).unwrap();
    assert!(image.detected && image.registration.unwrap().mirrored, "{}", image.log10_p);
    assert_nothing_found(&look(&detector, &scanned(original.soup(), 20_000, 0.001)).unwrap());
    // Too few points are no surface.
    assert!(matches!(
        look(&detector, &scanned(&copy, 50, 0.0)),
        Err(DetectError::NoFaces { which: "suspect" })
    ));
}

#[test]
fn a_spent_budget_is_told_and_the_verdict_stays_honest() {
    let detector = detector();
    let options = DetectOptions { budget: Some(0.0), ..DetectOptions::default() };
    let attacks = parse_list("simplify:ratio=0.5 transform").unwrap();
    let unmarked =
        apply_all(&attacks, detector.model().soup(), &mut ChaCha8Rng::seed_from_u64(3)).unwrap().soup;
    let suspect = detector.suspect(&document(&unmarked));
    let ended = detector.detect(&suspect, &options).unwrap();
    assert!(ended.budget_spent && ended.variants.len() == 5);
    assert!(ended.warnings.iter().any(|warning| warning.contains("budget")), "{:?}", ended.warnings);
    assert_nothing_found(&ended);
    // Nothing is gained by looking at less.
    let all = detector.detect(&suspect, &DetectOptions::default()).unwrap();
    assert!(!all.budget_spent && ended.variants_counted >= all.variants_counted);
}
