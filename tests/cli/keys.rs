//! Keys and secrets that are refused.

use super::shared::{arguments, refused, workshop};
use serde_json::Value;
use sombrero::io::{Document, Format, encode};
use sombrero::shapes;
use sombrero_tests::{Workshop, marked};

/// Both commands that read a key refuse this one.
fn assert_no_key(workshop: &Workshop, key: &str, words: &[&str]) -> [String; 2] {
    let mut words = words.to_vec();
    words.push(key);
    [
        format!("detect marked.obj --original original.obj --method paper --registration never --resampling never --key {key}"),
        format!("verify {key} --original original.obj"),
    ]
    .map(|line| refused(workshop, &arguments(&line), &words))
}

#[test]
fn a_key_of_another_original_is_refused() {
    let workshop = workshop();
    let other = encode(Format::Obj, &shapes::bumpy_sphere(1000)).unwrap();
    let key = marked(&Document::parse(other.clone(), None).unwrap(), 1).key;
    workshop.write("other.obj", other);
    workshop.write("other.key", key.to_json());
    assert_eq!(assert_no_key(&workshop, "other.key", &["another original", "SHA-256"]), ["key", "key"]);
    // A copy that says the same in other bytes is another file.
    let mut spaced = workshop.read("original.obj");
    spaced.extend(b"\n");
    workshop.write("spaced.obj", spaced);
    let line = "detect marked.obj --original spaced.obj --key mark.key --method paper --registration never --resampling never";
    refused(&workshop, &arguments(line), &["mark.key", "another original"]);
    refused(
        &workshop,
        &arguments("verify mark.key --original marked.obj"),
        &["mark.key", "another original"],
    );
}

#[test]
fn a_damaged_key_is_refused() {
    let workshop = workshop();
    let key = workshop.read("mark.key");
    let text = String::from_utf8(key.clone()).unwrap();
    let mut bits = key.clone();
    bits[40] ^= 0x80;
    let last = text.rfind("    ").unwrap();
    for (name, bytes, words) in [
        ("empty.key", Vec::new(), &["key"][..]),
        ("cut.key", key[..key.len() / 2].to_vec(), &["damaged"]),
        ("bits.key", bits, &["damaged"]),
        ("list.key", b"[1, 2, 3]".to_vec(), &["format"]),
        ("null.key", b"null".to_vec(), &["format"]),
        ("other.key", b"{\"format\": \"else\"}".to_vec(), &["format"]),
        ("mesh.key", workshop.read("original.obj"), &["not a sombrero key"]),
        ("deep.key", "[".repeat(100_000).into_bytes(), &["key"]),
        ("tail.key", [key.as_slice(), b"x"].concat(), &["damaged"]),
        (
            "fewer.key",
            (text[..last].trim_end().trim_end_matches(',').to_owned() + "\n  ]\n}\n").into_bytes(),
            &["watermark", "199"],
        ),
        ("later.key", text.replace("\"version\": 2", "\"version\": 3").into_bytes(), &["version 3"]),
        ("former.key", text.replace("\"version\": 2", "\"version\": 1").into_bytes(), &["version 1", "anew"]),
        ("versionless.key", text.replace("\"version\": 2", "\"version\": -2").into_bytes(), &["key"]),
        (
            "extra.key",
            text.replace("\"version\": 2", "\"version\": 2, \"colour\": 3").into_bytes(),
            &["colour"],
        ),
        (
            "twice.key",
            text.replace("\"version\": 2", "\"version\": 2, \"version\": 2").into_bytes(),
            &["version"],
        ),
        (
            "many.key",
            text.replace("\"coefficients\": 200", "\"coefficients\": 4000000000").into_bytes(),
            &["coefficients"],
        ),
        (
            "none.key",
            text.replace("\"coefficients\": 200", "\"coefficients\": 0").into_bytes(),
            &["coefficients"],
        ),
        ("infinite.key", text.replace("\"epsilon\": 0.0088", "\"epsilon\": 1e999").into_bytes(), &["key"]),
        ("nothing.key", text.replace("\"epsilon\": 0.0088", "\"epsilon\": 0").into_bytes(), &["epsilon"]),
        ("nan.key", text.replace("\"epsilon\": 0.0088", "\"epsilon\": NaN").into_bytes(), &["key"]),
        ("cap.key", text.replace("\"basis\": \"sombrero\"", "\"basis\": \"cap\"").into_bytes(), &["basis"]),
    ] {
        assert!(bytes != key, "{name} is not damaged");
        workshop.write(name, bytes);
        assert_eq!(assert_no_key(&workshop, name, words), ["key", "key"], "{name}");
    }
}

#[test]
fn a_hand_edited_key_is_refused() {
    let workshop = workshop();
    let text = String::from_utf8(workshop.read("mark.key")).unwrap();
    let key: Value = serde_json::from_str(&text).unwrap();
    let edited = |field: &str, value: Value| {
        let mut key = key.clone();
        assert_ne!(key[field], value);
        key[field] = value;
        key.to_string()
    };
    let mut w = key["watermark"].clone();
    w[7] = (w[7].as_f64().unwrap() + 1e-9).into();
    for (name, file, words) in [
        ("epsilon.key", edited("epsilon", 0.011.into()), &["watermark", "edited"][..]),
        ("watermark.key", edited("watermark", w), &["coefficient 7", "edited"]),
        ("owner.key", edited("owner", "Mallory".into()), &["watermark", "edited"]),
        ("recipient.key", edited("recipient", "Mallory".into()), &["watermark", "edited"]),
        ("basis.key", edited("basis", "hat".into()), &["watermark", "edited"]),
        ("digest.key", edited("basis_sha256", "00".repeat(32).into()), &["watermark", "edited"]),
        ("hash.key", edited("original_sha256", "00".repeat(32).into()), &["another original"]),
        ("secret.key", edited("secret", "00".repeat(32).into()), &["watermark", "edited"]),
    ] {
        workshop.write(name, file);
        assert_eq!(assert_no_key(&workshop, name, words), ["key", "key"], "{name}");
    }
    // Only the looks were changed, so it is the key that it was.
    workshop.write("dense.key", key.to_string());
    assert!(workshop.line("verify dense.key --original original.obj").text().contains("genuine"));
}

#[test]
fn a_key_that_is_no_small_file_is_refused() {
    let workshop = workshop();
    std::fs::create_dir(workshop.path("folder.key")).unwrap();
    std::fs::File::create(workshop.path("huge.key")).unwrap().set_len(1 << 40).unwrap();
    assert_no_key(&workshop, "folder.key", &["a folder"]);
    assert_no_key(&workshop, "huge.key", &["larger"]);
    assert_no_key(&workshop, "missing.key", &["check the path"]);
    assert_no_key(&workshop, "/dev/zero", &["not a regular file"]);
}

#[test]
fn a_secret_file_of_another_length_is_refused() {
    let workshop = workshop();
    let good = "0123456789abcdef".repeat(4);
    for (name, bytes) in [
        ("short", good.as_bytes()[1..].to_vec()),
        ("long", (good.clone() + "0").into_bytes()),
        ("empty", Vec::new()),
        ("letters", good.replace('a', "x").into_bytes()),
        ("raw", vec![7; 32]),
        ("two", (good.clone() + "\n" + &good).into_bytes()),
        ("huge", good.repeat(100_000).into_bytes()),
    ] {
        workshop.write(name, bytes);
        let line = format!("embed original.obj -o out.obj --key out.key --secret-file {name}");
        refused(&workshop, &arguments(&line), &[name]);
    }
    std::fs::create_dir(workshop.path("folder")).unwrap();
    for name in ["folder", "missing"] {
        let line = format!("embed original.obj -o out.obj --key out.key --secret-file {name}");
        assert_eq!(refused(&workshop, &arguments(&line), &[name]), "read");
    }
    // Its last line may end, and digits may be of either case.
    workshop.write("fine", good.to_uppercase() + "\r\n");
    workshop.line("embed original.obj -o out.obj --key out.key --secret-file fine").text();
    let key: Value = serde_json::from_slice(&workshop.read("out.key")).unwrap();
    assert_eq!(key["secret"], good);
}
