//! What a dying process or a dying disk leaves behind.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use proptest::prelude::*;
use sombrero_catalogue::{Catalogue, CatalogueError, Editor, Entry, Portrait};
use sombrero_shapes as shapes;

fn portrait() -> Portrait {
    static KNOWN: OnceLock<Portrait> = OnceLock::new();
    let make = || {
        let part = shapes::part(3);
        Portrait::of(&part.points, &part.triangles).unwrap()
    };
    KNOWN.get_or_init(make).clone()
}

fn entry(name: &str) -> Entry {
    Entry { name: name.into(), digest: [7; 32], place: "here".into(), note: String::new() }
}

fn add(editor: &mut Editor, name: &str) {
    editor.add(vec![(entry(name), portrait())]).unwrap();
}

fn names(folder: &Path) -> Vec<String> {
    Catalogue::open(folder).unwrap().entries().unwrap().into_iter().map(|entry| entry.name).collect()
}

fn flip(file: &Path, at: usize) {
    let mut bytes = fs::read(file).unwrap();
    let at = at % bytes.len();
    bytes[at] ^= 0x10;
    fs::write(file, bytes).unwrap();
}

#[test]
fn one_changes_many_read() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path().join("c");
    let mut editor = Editor::create(&folder).unwrap();
    assert!(matches!(Editor::open(&folder), Err(CatalogueError::Busy { .. })));
    assert!(matches!(Editor::create(&folder), Err(CatalogueError::Exists { .. })));
    add(&mut editor, "a");
    let early = Catalogue::open(&folder).unwrap();
    add(&mut editor, "b");
    assert!(matches!(editor.add(vec![(entry("b"), portrait())]), Err(CatalogueError::Taken { .. })));
    assert!(matches!(editor.add(vec![(entry(""), portrait())]), Err(CatalogueError::Text { .. })));
    assert!(editor.remove("a").unwrap() && !editor.remove("a").unwrap());
    assert_eq!((early.len(), names(&folder)), (1, vec!["b".to_owned()]));
    assert_eq!(Catalogue::open(&folder).unwrap().entry("b").unwrap(), Some(entry("b")));
    assert_eq!(Catalogue::open(&folder).unwrap().entry("a").unwrap(), None);
    drop(editor);
    assert!(Editor::open(&folder).unwrap().contains("b"));
    let other = temporary.path().join("other");
    assert!(matches!(Catalogue::open(&other), Err(CatalogueError::NotACatalogue { .. })));
    assert!(matches!(Editor::open(&other), Err(CatalogueError::NotACatalogue { .. })));
}

#[test]
fn many_become_few_files_and_none_is_lost() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path().join("c");
    let mut editor = Editor::create(&folder).unwrap();
    let mut all: Vec<String> = (0..2100).map(|k| format!("model {k:04}")).collect();
    editor.add(all.iter().map(|name| (entry(name), portrait())).collect()).unwrap();
    // One of eight that were merged, and one that is too late for that.
    for name in ["model 0007", "model 2099"] {
        assert!(editor.remove(name).unwrap());
        all.retain(|other| other != name);
    }
    assert_eq!(names(&folder), all);
    assert_eq!(editor.catalogue().unwrap().verify().unwrap(), []);
    assert!(fs::read_dir(&folder).unwrap().count() <= 5);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// A process that died while it added "c" leaves a part of it.
    #[test]
    fn what_was_added_outlives_a_process_that_dies(share in 0.0..1.0f64) {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path().join("c");
        let log = folder.join("000000.log");
        let mut editor = Editor::create(&folder).unwrap();
        add(&mut editor, "a");
        add(&mut editor, "b");
        let safe = fs::metadata(&log).unwrap().len();
        add(&mut editor, "c");
        drop(editor);
        let whole = fs::metadata(&log).unwrap().len();
        let left = safe + ((whole - safe) as f64 * share) as u64;
        fs::File::options().write(true).open(&log).unwrap().set_len(left).unwrap();
        prop_assert_eq!(names(&folder), ["a", "b"]);
        let mut editor = Editor::open(&folder).unwrap();
        add(&mut editor, "c");
        add(&mut editor, "d");
        prop_assert_eq!(names(&folder), ["a", "b", "c", "d"]);
    }

    /// A flipped bit anywhere is named; whatever stands elsewhere stays, and rebuilding brings back the rest.
    #[test]
    fn damage_is_named_and_mended(at in any::<u32>(), which in 0usize..3) {
        let temporary = tempfile::tempdir().unwrap();
        let folder = temporary.path().join("c");
        let mut editor = Editor::create(&folder).unwrap();
        for name in ["a", "b", "c"] {
            add(&mut editor, name);
        }
        editor.rebuild(&mut |_| None).unwrap();
        add(&mut editor, "d");
        drop(editor);
        prop_assert_eq!(Catalogue::open(&folder).unwrap().verify().unwrap(), []);
        let file = folder.join(["000000.log", "000000.lists", "000001.log"][which]);
        // The first bytes of a log say what it is; without them it is none, and that is told.
        let first = if which == 1 { 0 } else { 8 };
        let length = fs::metadata(&file).unwrap().len() as usize;
        flip(&file, first + at as usize % (length - first));
        let found = Catalogue::open(&folder).unwrap().verify().unwrap();
        prop_assert!(found.iter().any(|damage| damage.file == file), "{found:?}");
        let mut editor = Editor::open(&folder).unwrap();
        let mut asked = Vec::new();
        let dropped = editor.rebuild(&mut |entry| { asked.push(entry.name.clone()); Some(portrait()) }).unwrap();
        let left = editor.catalogue().unwrap();
        prop_assert_eq!(left.verify().unwrap(), []);
        let lost = 4 - left.len();
        prop_assert!(lost <= 1 && (which != 1 || lost == 0), "{asked:?} {dropped:?}");
    }
}
