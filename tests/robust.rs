//! Suspects of which nothing is known, neither pose nor vertices, and to which more was done than moving them.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use nalgebra::{Point3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::io::{Document, Format};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero::{DetectOptions, Detector, Method, Tracer};
use sombrero_tests::{document, joined, mapped, marked};

/// A marked copy and two keys: its own and another's. One search answers for both.
struct Story {
    detector: Detector,
    both: Tracer,
    copy: Soup,
}

fn story(soup: &Soup) -> Story {
    let original = document(Format::PlyBinaryLittleEndian, soup);
    let (one, two) = (marked(&original, 1), marked(&original, 2));
    let (both, rejected) = Tracer::new(&original, vec![one.key.clone(), two.key]).unwrap();
    assert!(rejected.is_empty());
    let detector = Detector::new(&original, one.key).unwrap();
    Story { detector, both, copy: Document::parse(one.bytes, None).unwrap().soup().clone() }
}

/// Of irregular connectivity, as scans have.
fn bust() -> Soup {
    attacked(&shapes::bust(20), "simplify:ratio=0.3")
}

fn attacked(soup: &Soup, specs: &str) -> Soup {
    let attacks = parse_list(specs).unwrap();
    apply_all(&attacks, soup, &mut ChaCha8Rng::seed_from_u64(8)).unwrap().soup
}

impl Story {
    fn assert_found(&self, what: &str, suspect: &Soup, bound: f64) {
        let suspect = document(Format::Obj, suspect);
        let trace = self.both.trace(&suspect, &DetectOptions::default()).unwrap();
        let [own, other] = &trace.recipients[..] else { panic!("{what}: {:?}", trace.recipients) };
        assert!(own.index == 0 && own.named && own.log10_p < bound, "{what}: {}", own.log10_p);
        assert!(!other.named && other.log10_p > -3.0, "{what}, another key: {}", other.log10_p);
    }
}

#[test]
fn deformed_cropped_and_remeshed_copies_are_found() {
    let story = story(&bust());
    for (specs, bound) in [
        ("simplify:ratio=0.5 affine:strength=0.5", -12.0),
        ("crop:fraction=0.333 simplify:ratio=0.6 affine:strength=0.3", -12.0),
        ("simplify:ratio=0.5 projective:strength=0.1 transform", -12.0),
        ("crop:fraction=0.333 simplify:ratio=0.6 ffd:strength=0.02 transform", -12.0),
        ("isosurface:resolution=64 transform", -12.0),
        ("remesh:length=1 transform", -12.0),
        ("subdivide:scheme=loop transform reorder", -12.0),
        ("quantize:bits=8 reorder transform", -12.0),
        ("laplacian:iterations=30 reorder transform", -12.0),
    ] {
        story.assert_found(specs, &attacked(&story.copy, specs), bound);
    }
}

#[test]
fn a_copy_with_something_added_is_found() {
    let story = story(&bust());
    let simplified = attacked(&story.copy, "simplify:ratio=0.5");
    let side = simplified.bounding_box().unwrap().largest_side();
    let low = simplified.bounding_box().unwrap().min.z;
    let plate =
        mapped(&shapes::cube(), |p| Point3::new(p.x * 0.8, p.y * 0.8, low + 0.05 * side * (p.z - 0.5)));
    let beside = mapped(&shapes::torus(40, 20, 1.0, 0.4), |p| {
        Point3::from(p.coords * 0.3 * side) + Vector3::new(1.2 * side, 0.0, 0.0)
    });
    for (what, added) in [("a base plate", plate), ("a second object", beside)] {
        story.assert_found(what, &attacked(&joined(&simplified, &added), "transform"), -12.0);
    }
}

/// Renumbered, cropped and moved, but never remeshed: the connectivity tells which vertex is which.
#[test]
fn renumbered_vertices_are_recognised() {
    let story = story(&bust());
    let suspect = attacked(&story.copy, "reorder crop:fraction=0.333 transform");
    story.assert_found("renumbered", &suspect, -100.0);
    let file = story.detector.suspect(&document(Format::Obj, &suspect));
    let own = story.detector.detect(&file, &DetectOptions::default()).unwrap();
    assert_eq!(own.method, Method::Robust);
    assert!(own.variants_counted >= own.variants.len());
    assert!(own.variant.is_some_and(|best| !best.resampling && best.registration));
    assert!((0.4..0.9).contains(&own.coverage), "{}", own.coverage);
}

/// A box has many poses that its surface cannot tell apart; the relief of the mark is in one of them.
#[test]
fn a_symmetric_shape_is_found_in_the_pose_that_is_right() {
    let cube = shapes::cube();
    let dented = mapped(&attacked(&cube, "subdivide:scheme=midpoint,iterations=4"), |p| {
        let bump = |x: f64| (9.0 * x).cos();
        p + p.coords * (0.02 * bump(p.x) * bump(p.y) * bump(p.z))
    });
    let story = story(&dented);
    story.assert_found("a cube", &attacked(&story.copy, "simplify:ratio=0.8 transform"), -12.0);
}
