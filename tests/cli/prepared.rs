//! Prepared files: what they change, and what they must not.

use super::shared::{
    arguments, assert_clean, assert_fields, assert_holds, count, no, refused, workshop, yes,
};
use serde_json::Value;
use sha2::{Digest, Sha256};
use sombrero::basis::BasisFunction;
use sombrero::io::Document;
use sombrero::watermark::{Derivation, Key, OriginalDigest, Preset, embed as insert};
use sombrero::{Detector, EmbedOptions, embed};
use sombrero_tests::Workshop;
use std::os::unix::fs::PermissionsExt;

/// The answer of `detect` with these further words, and its status.
fn looked(workshop: &Workshop, words: &str) -> (i32, Value) {
    let ran = workshop.line(&format!("detect --original original.obj --key mark.key --json {words}"));
    (ran.status.unwrap(), ran.json())
}

/// What prepared files must not change.
fn verdict(mut answer: Value) -> Value {
    for name in ["seconds", "prepared", "prepared_note", "warnings"] {
        answer.as_object_mut().unwrap().remove(name);
    }
    answer
}

#[test]
fn detect_uses_what_was_prepared() {
    let workshop = workshop();
    let suspects = ["marked.obj", "original.obj"];
    let plain = suspects.map(|suspect| looked(&workshop, suspect));
    assert!(plain.iter().all(|(_, answer)| no(&answer["prepared"])));

    let said = workshop.line("prepare --original original.obj --key mark.key");
    assert_holds(said.text(), &["original.obj", "mark.key.prepared", "200 coefficients", "private"]);
    let mode = workshop.path("mark.key.prepared").metadata().unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    let answer = workshop.line("prepare --original original.obj --key mark.key -o elsewhere --json").json();
    assert_fields(
        &answer,
        &[
            ("output", |v| v == "elsewhere"),
            ("vertices", |v| v == 642),
            ("coefficients", |v| v == 200),
            ("bytes", count),
        ],
    );
    assert!(workshop.read("elsewhere") == workshop.read("mark.key.prepared"), "one key, one prepared file");

    for (suspect, (status, answer)) in suspects.into_iter().zip(plain) {
        let warnings = answer["warnings"].clone();
        let expected = (status, verdict(answer));
        let (status, beside) = looked(&workshop, suspect);
        assert!(yes(&beside["prepared"]) && beside["warnings"] == warnings, "{beside}");
        assert_eq!((status, verdict(beside)), expected, "{suspect}");
        let (status, named) = looked(&workshop, &format!("{suspect} --prepared elsewhere"));
        assert!(yes(&named["prepared"]), "{named}");
        // Nobody shall take what was found for more than it is.
        let told = named["warnings"].to_string();
        assert_eq!(told.contains("not derived anew") && told.contains("verify"), status == 0, "{told}");
        assert_eq!((status, verdict(named)), expected, "{suspect}");
    }
}

#[test]
fn a_prepared_file_that_does_not_fit_is_left_aside_unless_it_was_asked_for() {
    let workshop = workshop();
    let expected = looked(&workshop, "marked.obj");
    let expected = (expected.0, verdict(expected.1));
    workshop.line("prepare --original original.obj --key mark.key").text();
    let whole = workshop.read("mark.key.prepared");
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    workshop.line("embed original.obj -o paper.obj --key paper.key --preset paper").text();
    workshop.line("prepare --original original.obj --key paper.key").text();
    let files = [
        ("empty", Vec::new(), "sombrero prepare"),
        ("truncated", whole[..whole.len() / 3].to_vec(), "damaged"),
        ("flipped", flipped, "damaged"),
        ("later", b"sombrero prepared 7\n".to_vec(), "version"),
        ("unrelated", workshop.read("paper.key.prepared"), "another key"),
        ("key", workshop.read("mark.key"), "not a prepared file"),
    ];
    for (name, bytes, word) in files {
        workshop.write("mark.key.prepared", &bytes);
        workshop.write(name, &bytes);
        let (status, answer) = looked(&workshop, "marked.obj");
        assert!(no(&answer["prepared"]), "{name}");
        assert_holds(&answer["warnings"].to_string(), &["prepared file", "not used"]);
        let note = answer["prepared_note"].to_string();
        assert_clean(&note);
        assert_holds(&note, &["mark.key.prepared", word]);
        assert_eq!((status, verdict(answer)), expected, "{name}");
        let line = "detect marked.obj --original original.obj --key mark.key";
        assert_holds(workshop.line(line).text(), &["note", "mark.key.prepared", word]);
        let asked = arguments(&format!("{line} --prepared {name}"));
        assert_eq!(refused(&workshop, &asked, &[name, word, "sombrero prepare"]), "prepared");
    }
    std::fs::remove_file(workshop.path("mark.key.prepared")).unwrap();
    std::fs::create_dir(workshop.path("mark.key.prepared")).unwrap();
    let (status, answer) = looked(&workshop, "marked.obj");
    assert_holds(&answer["prepared_note"].to_string(), &["mark.key.prepared", "not a regular file"]);
    assert_eq!((status, verdict(answer)), expected);
    let asked = "detect marked.obj --original original.obj --key mark.key --prepared missing";
    assert_eq!(refused(&workshop, &arguments(asked), &["missing", "check the path"]), "read");
}

/// The same prepared file, as if made for this key.
fn forged_for(key: &Key, file: &[u8]) -> Vec<u8> {
    let options = key.parameters.basis;
    let parameters = format!("{} {} {}", options.coefficients, options.function, options.amplitudes);
    let identity = [&key.original_sha256[..], &key.basis_sha256, parameters.as_bytes()].concat();
    let mut forged = file[..file.len() - 32].to_vec();
    forged["sombrero prepared 1\n".len()..][..32].copy_from_slice(&Sha256::digest(identity));
    let hash = Sha256::digest(&forged);
    forged.extend(hash);
    forged
}

#[test]
fn prepared_files_vouch_for_nothing() {
    let workshop = workshop();
    workshop.line("prepare --original original.obj --key mark.key").text();
    // Another original is another original.
    let other = "detect marked.obj --original marked.obj --key mark.key";
    assert_eq!(refused(&workshop, &arguments(other), &["mark.key", "another original"]), "key");
    // A key and a prepared file that agree with each other, but not with the original.
    let original = Document::parse(workshop.read("original.obj"), None).unwrap();
    let key = Key::from_json(&workshop.read("mark.key")).unwrap();
    let derby = {
        let mut options = EmbedOptions { parameters: Preset::Robust.parameters(), ..EmbedOptions::default() };
        options.parameters.basis.function = BasisFunction::Derby;
        embed(&original, key.secret, &options).unwrap().key
    };
    let forged = Key::new(
        &OriginalDigest::of(original.parts()),
        key.identity.clone(),
        key.secret,
        key.parameters,
        &derby.basis_sha256,
        Derivation::STANDARD,
    );
    let detector = Detector::new(&original, derby).unwrap();
    let file = detector.prepared_basis();
    workshop.write("forged.key", forged.to_json());
    workshop.write("forged.key.prepared", forged_for(&forged, &file));
    // w follows from the basis too, so there is nothing to be found; and the key is found out by verifying.
    let asked = "detect marked.obj --original original.obj --key forged.key";
    assert_eq!(workshop.line(asked).status, Some(1));
    // Even in what was marked with them the mark is not called found before the basis is derived anew.
    let model = detector.model();
    let points = insert(&model.soup().points, detector.basis(), &forged.watermark, forged.parameters.epsilon);
    let suspect = original.with_points(&model.stored_from_points(&points)).unwrap();
    workshop.write("suspect.obj", suspect);
    let asked = "detect suspect.obj --original original.obj --key forged.key";
    assert_eq!(refused(&workshop, &arguments(asked), &["forged.key", "basis"]), "key");
    let trusted = format!("{asked} --prepared forged.key.prepared");
    assert_eq!(workshop.line(&trusted).status, Some(0));
    let asked = "verify forged.key --original original.obj";
    assert_eq!(refused(&workshop, &arguments(asked), &["forged.key", "basis"]), "key");
}

#[test]
fn prepare_overwrites_nothing() {
    let workshop = workshop();
    workshop.line("prepare --original original.obj --key mark.key").text();
    let line = "prepare --original original.obj --key mark.key";
    assert_eq!(refused(&workshop, &arguments(line), &["mark.key.prepared", "exists", "--force"]), "write");
    assert_eq!(workshop.line(&format!("{line} --force")).status, Some(0));
    for input in ["original.obj", "mark.key"] {
        let line = format!("{line} -o {input} --force");
        assert_eq!(refused(&workshop, &arguments(&line), &[input, "input"]), "write");
    }
    let line = "prepare --original marked.obj --key mark.key -o new";
    assert_eq!(refused(&workshop, &arguments(line), &["mark.key", "another original"]), "key");
    let line = "detect marked.obj --original original.obj --key mark.key --report mark.key.prepared --force";
    assert_eq!(refused(&workshop, &arguments(line), &["mark.key.prepared", "input"]), "write");
}
