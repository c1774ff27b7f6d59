//! Any mesh file in, the same file out: marks across formats, scenes, every kind of topology, units and places.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use nalgebra::{Point3, Vector3};
use sombrero::io::{Document, Format, Rewrite, encode};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero::watermark::{Preset, Secret};
use sombrero::{DetectOptions, Detector, EmbedOptions, detect, embed, info};
use sombrero_tests::{as_it_is, document, groups, joined, mapped, marked, ring, samples, wavy};

const FORMATS: [Format; 10] = [
    Format::Obj,
    Format::PlyAscii,
    Format::PlyBinaryLittleEndian,
    Format::PlyBinaryBigEndian,
    Format::Off,
    Format::StlAscii,
    Format::StlBinary,
    Format::Gltf,
    Format::Glb,
    Format::ThreeMf,
];

#[test]
fn a_mark_made_in_one_format_is_found_in_every_other() {
    let soup = ring();
    // One of each family to mark in.
    for from in [Format::Obj, Format::PlyBinaryLittleEndian, Format::StlBinary, Format::Glb, Format::ThreeMf]
    {
        let original = document(from, &soup);
        let mark = marked(&original, 21);
        let copy = Document::parse(mark.bytes, Some(from.extension())).unwrap().soup().clone();
        let detector = Detector::new(&original, mark.key).unwrap();
        for to in FORMATS {
            let suspect = Document::parse(encode(to, &copy).unwrap(), Some(to.extension())).unwrap();
            let found = detector.detect(&detector.suspect(&suspect), &DetectOptions::default()).unwrap();
            assert!(found.detected && found.log10_p < -100.0, "{from} to {to}: {}", found.log10_p);
        }
    }
}

#[test]
fn a_mark_made_in_a_scene_is_found_in_what_others_export_of_it() {
    // One of the two instances, turned and scaled by the scene, as facets.
    for sample in samples(&ring()).iter().filter(|s| ["glb", "gltf", "3mf"].contains(&s.extension)) {
        let original = Document::parse(sample.bytes.clone(), Some(sample.extension)).unwrap();
        let triangles = ring().triangles.len();
        assert_eq!(original.triangles().len(), triangles, "{}", sample.name);
        assert_eq!(info(&original).triangles, 2 * triangles, "{}", sample.name);
        let mark = marked(&original, 22);
        let copy = Document::parse(mark.bytes, Some(sample.extension)).unwrap().soup().clone();
        let two = joined(&copy, &mapped(&copy, |p| p + Vector3::new(0.0, 0.0, 30.0)));
        for (what, soup) in [("one", &copy), ("both", &two)] {
            let suspect = document(Format::StlBinary, soup);
            let found = detect(&suspect, &original, &mark.key, &DetectOptions::default()).unwrap();
            assert!(found.detected, "{}, {what}: {}", sample.name, found.log10_p);
        }
    }
}

#[test]
fn parts_of_a_model_share_the_coefficients_and_tiny_ones_stay() {
    let at =
        |soup: &Soup, x: f64, scale: f64| mapped(soup, |p| Point3::from(p.coords * scale) + Vector3::x() * x);
    let (ball, torus) = (shapes::bumpy_sphere(1500), wavy(&shapes::torus(48, 24, 1.0, 0.4)));
    let screw = at(&shapes::bumpy_sphere(200), 6.0, 0.02);
    let parts = [ball.points.len(), torus.points.len(), screw.points.len()];
    let soup = joined(&joined(&ball, &at(&torus, 3.0, 1.0)), &screw);
    let original = document(Format::PlyBinaryLittleEndian, &soup);
    let mark = marked(&original, 23);
    let copy = Document::parse(mark.bytes, None).unwrap();
    let moved = |range: std::ops::Range<usize>| range.filter(|&v| copy.points()[v] != soup.points[v]).count();
    let [first, second, third] = parts;
    assert!(moved(0..first) > first / 2, "{}", moved(0..first));
    assert!(moved(first..first + second) > second / 2, "{}", moved(first..first + second));
    assert_eq!(moved(first + second..first + second + third), 0);
    // Each of the two answers alone, as when the parts are sold one by one.
    let detector = Detector::new(&original, mark.key).unwrap();
    for range in [0..first as u32, first as u32..(first + second) as u32] {
        let inside = |t: &&[u32; 3]| t.iter().all(|v| range.contains(v));
        let triangles: Vec<_> =
            soup.triangles.iter().filter(inside).map(|t| t.map(|v| v - range.start)).collect();
        let points = copy.points()[range.start as usize..range.end as usize].to_vec();
        let suspect = document(Format::Obj, &Soup::new(points, triangles));
        let found = detector.detect(&detector.suspect(&suspect), &DetectOptions::default()).unwrap();
        assert!(found.detected && found.log10_p < -20.0, "{range:?}: {}", found.log10_p);
    }
}

/// The ball with things wrong with it that real files have.
fn troubled() -> Vec<(&'static str, Soup)> {
    let ball = shapes::bumpy_sphere(1500);
    let with = |change: &dyn Fn(&mut Soup)| {
        let mut soup = ball.clone();
        change(&mut soup);
        soup
    };
    vec![
        ("inward faces", with(&|s| s.triangles.iter_mut().for_each(|t| t.swap(0, 1)))),
        ("some faces turned", with(&|s| s.triangles.iter_mut().step_by(7).for_each(|t| t.swap(0, 1)))),
        (
            "doubled faces",
            with(&|s| {
                let again = s.triangles[..300].to_vec();
                s.triangles.extend(again);
            }),
        ),
        (
            "degenerate faces",
            with(&|s| {
                s.triangles.extend([[5, 5, 9], [3, 3, 3]]);
                s.points.push(s.points[5]);
                let copy = s.points.len() as u32 - 1;
                s.triangles.push([5, copy, 9]);
            }),
        ),
        (
            "an edge with four faces",
            with(&|s| {
                let [a, b, _] = s.triangles[40];
                let n = s.points.len() as u32;
                s.points.extend([Point3::new(2.0, 0.3, 0.0), Point3::new(2.0, 0.0, 0.4)]);
                s.triangles.extend([[a, b, n], [a, b, n + 1]]);
            }),
        ),
        (
            "two fans at a vertex",
            with(&|s| {
                let n = s.points.len() as u32;
                s.points.extend([Point3::new(3.0, 0.0, 0.0), Point3::new(3.0, 0.5, 0.1)]);
                s.triangles.push([7, n, n + 1]);
            }),
        ),
        ("holes", with(&|s| s.triangles.retain(|t| !t.iter().any(|v| v % 97 == 0)))),
        ("unused vertices", with(&|s| s.points.extend([Point3::new(1e6, 0.0, 0.0), Point3::origin()]))),
    ]
}

#[test]
fn meshes_with_faults_are_marked_as_they_come() {
    let formats = [Format::Obj, Format::StlBinary, Format::Glb, Format::ThreeMf].into_iter().cycle();
    for ((name, soup), format) in troubled().into_iter().zip(formats) {
        let original = document(format, &soup);
        let about = info(&original);
        assert!(about.markable, "{name}, {format}: {:?}", about.warnings);
        let mark = marked(&original, 24);
        let copy = Document::parse(mark.bytes, Some(format.extension())).unwrap();
        assert_eq!(copy.triangles(), original.triangles(), "{name}, {format}");
        let found = detect(&copy, &original, &mark.key, &DetectOptions::default()).unwrap();
        assert!(found.log10_p < -50.0, "{name}, {format}: {}", found.log10_p);
    }
}

#[test]
fn units_and_places_do_not_matter_as_far_as_the_numbers_reach() {
    let ball = shapes::bumpy_sphere(1500);
    for (scale, shift, format) in [
        (1e-9, 0.0, Format::Obj),
        (1e-3, 0.0, Format::Off),
        (1e9, 0.0, Format::PlyBinaryBigEndian),
        (1e9, 0.0, Format::ThreeMf),
        (1.0, 1e5, Format::ThreeMf),
        (1e3, -1e7, Format::Obj),
    ] {
        let original =
            document(format, &mapped(&ball, |p| Point3::from(p.coords * scale) + Vector3::repeat(shift)));
        let mark = marked(&original, 25);
        let copy = Document::parse(mark.bytes, Some(format.extension())).unwrap();
        let found = detect(&copy, &original, &mark.key, &as_it_is()).unwrap();
        assert!(found.log10_p < -50.0, "{scale}, {shift}, {format}: {}", found.log10_p);
    }
    // 32-bit numbers a hundred thousand sizes away cannot hold a mark, and `embed` says so.
    let far = mapped(&ball, |p| p + Vector3::repeat(3e6));
    for format in [Format::StlBinary, Format::Glb] {
        let failed = embed(&document(format, &far), Secret([25; 32]), &EmbedOptions::default()).unwrap_err();
        assert!(failed.to_string().contains("too coarse"), "{format}: {failed}");
    }
}

#[test]
fn normals_follow_when_asked_to() {
    let soup = ring();
    for sample in samples(&soup) {
        let original = Document::parse(sample.bytes.clone(), Some(sample.extension)).unwrap();
        let [kept, renewed] = [false, true].map(|renewed| {
            let rewrite = Rewrite::default().with_renewed_normals(renewed);
            let parameters = Preset::Robust.parameters();
            let options = EmbedOptions { rewrite, parameters, ..EmbedOptions::default() };
            embed(&original, Secret([26; 32]), &options).unwrap()
        });
        assert_eq!(kept.points, renewed.points, "{}", sample.name);
        assert_eq!(kept.key, renewed.key, "{}", sample.name);
        // STL's normals always follow; PLY and OFF samples have none, 3MF never; the only one of the OBJ is no face's.
        let has_normals = ["glb", "gltf"].contains(&sample.extension);
        assert_eq!(kept.bytes != renewed.bytes, has_normals, "{}", sample.name);
    }
}

#[test]
fn every_group_goes_through_the_containers() {
    let containers = [Format::Glb, Format::ThreeMf].into_iter().cycle();
    for ((name, soup), format) in groups().into_iter().zip(containers) {
        let original = document(format, &soup);
        let mark = marked(&original, 27);
        let copy = Document::parse(mark.bytes, Some(format.extension())).unwrap();
        let found = detect(&copy, &original, &mark.key, &as_it_is()).unwrap();
        assert!(found.detected && found.log10_p < -100.0, "{name}, {format}: {}", found.log10_p);
    }
}
