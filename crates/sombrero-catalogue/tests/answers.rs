//! Who is found, and that it does not matter how the catalogue came to be.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::sync::OnceLock;

use nalgebra::{Point3, Similarity3, Vector3};
use proptest::prelude::*;
use sombrero_catalogue::{Candidate, Catalogue, Editor, Entry, Portrait, Question, SearchOptions, nalgebra};
use sombrero_mesh::Soup;
use sombrero_shapes as shapes;

fn models() -> Vec<(Entry, Portrait)> {
    let soups = [
        chiral(shapes::part(6)),
        shapes::bust(12),
        shapes::bumpy_sphere(800),
        shapes::torus(40, 20, 2.0, 0.7),
        shapes::genus(2, 12),
        shapes::cube(),
    ];
    let entry = |k: usize| Entry {
        name: format!("model {k}"),
        digest: [k as u8; 32],
        place: format!("/models/{k}.ply"),
        note: "{}".into(),
    };
    let portrait = |soup: &Soup| Portrait::of(&soup.points, &soup.triangles).unwrap();
    soups.iter().enumerate().map(|(k, soup)| (entry(k), portrait(soup))).collect()
}

fn known() -> &'static [(Entry, Portrait)] {
    static KNOWN: OnceLock<Vec<(Entry, Portrait)>> = OnceLock::new();
    KNOWN.get_or_init(models)
}

/// A shape that differs from its mirror image.
fn chiral(mut soup: Soup) -> Soup {
    let side = soup.bounding_box().unwrap().largest_side();
    soup.points.iter_mut().for_each(|p| p.x += 0.8 * p.y * (p.z + 0.3 * p.x) / side);
    soup
}

fn moved(soup: &Soup, mirrored: bool) -> (Soup, Similarity3<f64>) {
    let pose = Similarity3::new(Vector3::new(5.0, -3.0, 1.0), Vector3::new(0.4, -1.0, 2.0), 30.0);
    let map = |p: &Point3<f64>| pose * if mirrored { Point3::new(-p.x, p.y, p.z) } else { *p };
    let mut triangles = soup.triangles.clone();
    if mirrored {
        triangles.iter_mut().for_each(|t| t.swap(0, 1));
    }
    (Soup::new(soup.points.iter().map(map).collect(), triangles), pose)
}

fn ask(catalogue: &Catalogue, suspect: &Soup) -> Vec<Candidate> {
    let question = Question::of(&suspect.points, &suspect.triangles).unwrap();
    catalogue.search(&question, &SearchOptions::default()).unwrap()
}

#[test]
fn a_suspect_is_found_where_it_is_and_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let mut editor = Editor::create(&folder.path().join("c")).unwrap();
    editor.add(known().to_vec()).unwrap();
    let catalogue = editor.catalogue().unwrap();
    assert_eq!((catalogue.len(), catalogue.is_empty()), (6, false));
    for mirrored in [false, true] {
        // Another tessellation of the first model.
        let part = chiral(shapes::part(9));
        let (suspect, pose) = moved(&part, mirrored);
        let found = &ask(&catalogue, &suspect)[0];
        assert_eq!((&found.entry, found.part, found.mirrored), (&known()[0].0, None, mirrored));
        let size = suspect.bounding_box().unwrap().diagonal();
        for p in &part.points {
            let place = if mirrored { Point3::new(-p.x, p.y, p.z) } else { *p };
            assert!((found.pose * place - pose * place).norm() < 0.02 * size);
        }
    }
}

#[test]
fn each_of_a_scene_is_named_with_its_part() {
    let folder = tempfile::tempdir().unwrap();
    let mut editor = Editor::create(&folder.path().join("c")).unwrap();
    editor.add(known().to_vec()).unwrap();
    let mut scene = moved(&chiral(shapes::part(5)), false).0;
    let bust = shapes::bust(10);
    let first = scene.points.len() as u32;
    scene.points.extend(bust.points.iter().map(|p| p * 40.0 + Vector3::new(900.0, 0.0, 0.0)));
    scene.triangles.extend(bust.triangles.iter().map(|t| t.map(|v| v + first)));
    let question = Question::of(&scene.points, &scene.triangles).unwrap();
    assert_eq!(question.parts(), 2);
    let found = editor.catalogue().unwrap().search(&question, &SearchOptions::default().top(2)).unwrap();
    let mut named: Vec<(&str, usize)> = found
        .iter()
        .map(|c| (c.entry.name.as_str(), question.part(c.part.unwrap()).unwrap().triangles.len()))
        .collect();
    named.sort_unstable();
    assert_eq!(named, [("model 0", shapes::part(5).triangles.len()), ("model 1", bust.triangles.len())]);
    assert_eq!(question.part(2), None);
}

#[test]
fn an_empty_catalogue_answers_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let editor = Editor::create(&folder.path().join("c")).unwrap();
    assert_eq!(ask(&editor.catalogue().unwrap(), &shapes::part(4)), []);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Any order, any split into segments, removed and added again, merged or not, one thread or three.
    #[test]
    fn the_answer_does_not_depend_on_how_the_catalogue_came_to_be(
        order in Just((0..6).collect::<Vec<usize>>()).prop_shuffle(),
        sealed in prop::collection::vec(0u8..3, 6),
        again in prop::collection::vec(any::<bool>(), 6),
        threads in 1usize..4,
    ) {
        static PLAIN: OnceLock<Vec<Candidate>> = OnceLock::new();
        let suspect = moved(&shapes::genus(2, 10), false).0;
        let plain = PLAIN.get_or_init(|| {
            let folder = tempfile::tempdir().unwrap();
            let mut editor = Editor::create(&folder.path().join("c")).unwrap();
            editor.add(known().to_vec()).unwrap();
            ask(&editor.catalogue().unwrap(), &suspect)
        });
        let folder = tempfile::tempdir().unwrap();
        let mut editor = Editor::create(&folder.path().join("c")).unwrap();
        for (&k, (seals, again)) in order.iter().zip(sealed.iter().zip(&again)) {
            let (entry, portrait) = &known()[k];
            let old = Entry { place: "elsewhere".into(), ..entry.clone() };
            if *again {
                editor.add(vec![(old, portrait.clone())]).unwrap();
            }
            for _ in 0..*seals {
                // Seals the open log, whether there is damage or not.
                prop_assert_eq!(editor.rebuild(&mut |_| None).unwrap(), Vec::<String>::new());
            }
            prop_assert_eq!(editor.remove(&entry.name).unwrap(), *again);
            editor.add(vec![(entry.clone(), portrait.clone())]).unwrap();
        }
        let catalogue = editor.catalogue().unwrap();
        let mut entries: Vec<Entry> = known().iter().map(|(entry, _)| entry.clone()).collect();
        entries.sort();
        prop_assert_eq!(catalogue.entries().unwrap(), entries);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        prop_assert_eq!(&pool.install(|| ask(&catalogue, &suspect)), plain);
    }
}
