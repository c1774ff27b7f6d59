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
use sombrero::{DetectError, DetectOptions, Detection, Detector, EmbedOptions, embed};

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
