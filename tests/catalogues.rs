//! A catalogue from beginning to end: what was marked is found again with nothing else at hand, and what is kept comes
//! back to the byte, to whom it shall.

#![cfg(unix)]

use serde_json::{Value, json};
use sombrero::io::{Format, encode};
use sombrero::mesh::Soup;
use sombrero::nalgebra::Vector3;
use sombrero::shapes;
use sombrero_tests::{Ran, Workshop, obj, separate_gltf};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

const PROGRAM: &str = env!("CARGO_BIN_EXE_sombrero-under-test");

/// The key pair of age's own tests: it saves the work that a passphrase costs.
const PUBLIC: &str = "age1t7rxyev2z3rw82stdlrrepyc39nvn86l5078zqkf5uasdy86jp6svpy7pa";
const SECRET: &str = "AGE-SECRET-KEY-1GQ9778VQXMMJVE8SK7J6VT8UJ4HDQAJUVSFCWCM02D8GEWQ72PVQ2Y5J33";

fn workshop() -> Workshop {
    let workshop = Workshop::new(PROGRAM);
    workshop.write("identity", format!("# created in a test\n{SECRET}\n"));
    workshop.write("buyers.csv", "recipient,file\nA. Buyer,one\nB. Buyer,two\nC. Buyer,three\n");
    workshop
}

/// Status 2 and one sentence with these words.
fn refused(ran: &Ran, words: &[&str]) {
    assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""), "{}", ran.stderr);
    let message = ran.stderr.strip_prefix("sombrero: ").and_then(|text| text.strip_suffix('\n')).unwrap();
    assert!(!message.contains('\n'), "{message}");
    for word in words {
        assert!(message.contains(word), "no `{word}` in: {message}");
    }
}

/// Whether any file below `folder` holds `known`.
fn shows(workshop: &Workshop, folder: &str, known: &[u8]) -> bool {
    let within = workshop.path(folder);
    let files = workshop.listing().into_iter().filter(|(path, _)| path.starts_with(&within));
    files.into_iter().any(|(_, bytes)| bytes.windows(known.len()).any(|window| window == known))
}

#[test]
fn two_commands_lead_from_a_marked_model_to_a_named_buyer() {
    let workshop = workshop();
    let original = obj(&shapes::bust(6));
    workshop.write("vase.obj", &original);
    workshop.write("other.ply", encode(Format::PlyBinaryLittleEndian, &shapes::bumpy_sphere(400)).unwrap());
    workshop.line("catalogue add models other.ply -q").text();
    let embed = "embed vase.obj --recipients buyers.csv --out-dir copies --catalogue models --owner Museum";
    let marked = workshop.line(&format!("{embed} --encrypt-to {PUBLIC} --json")).json();
    assert_eq!(marked["catalogue"]["encrypted"], json!({ "original": true, "keys": 3 }), "{marked}");
    // Made again it changes nothing, and more buyers are added.
    workshop
        .write("buyers.csv", "recipient,file\nA. Buyer,one\nB. Buyer,two\nC. Buyer,three\nD. Buyer,four\n");
    let again = workshop.line(&format!("{embed} --json")).json();
    assert_eq!(again["catalogue"]["encrypted"], json!({ "original": false, "keys": 1 }), "{again}");
    assert_eq!(again["catalogue"]["kept"], json!(true));

    // Nothing of it can be read.
    let key: Value = serde_json::from_slice(&workshop.read("copies/keys/two.key")).unwrap();
    let secret = key["secret"].as_str().unwrap().to_owned();
    for known in [secret.as_str(), "A. Buyer", "Museum", "ring of clay", "usemtl", "\nv ", "watermark"] {
        assert!(!shows(&workshop, "models", known.as_bytes()), "{known}");
    }
    assert!(shows(&workshop, "copies", secret.as_bytes()) && original.contains("ring of clay"));

    // All but the catalogue is lost.
    workshop.line("attack copies/two.obj -o leaked.obj transform noise:amplitude=0.0005 -q").text();
    for lost in ["vase.obj", "other.ply"] {
        std::fs::remove_file(workshop.path(lost)).unwrap();
    }
    std::fs::remove_dir_all(workshop.path("copies")).unwrap();
    let search = "search leaked.obj --catalogue models --identity identity";
    let found = workshop.line(&format!("{search} --report found.html --json")).json();
    let first = &found["candidates"][0];
    assert_eq!(
        (&found["found"], &first["original"], &first["recipient"], &first["owner"]),
        (&json!(true), &json!("vase.obj"), &json!("B. Buyer"), &json!("Museum")),
        "{found}"
    );
    assert!(first["log10_p"].as_f64().unwrap() < -6.0 && found["tests"] == json!(1), "{found}");
    let text = workshop.line(search);
    assert!(text.text().starts_with(
        "FOUND: leaked.obj carries a mark of vase.obj\n  copy          B. Buyer, by a key of Museum\n"
    ));

    // Two pages, which need nothing else.
    let page = |name: &str| String::from_utf8(workshop.read(name)).unwrap();
    let sheet = page("found.html");
    assert!(sheet.contains("href=\"found-detection.html\"") && sheet.contains("data:image/png;base64,"));
    assert!(sheet.contains("B. Buyer") && page("found-detection.html").contains("sombrero-evidence"));

    // What comes out is what went in, and the report holds.
    let export = "catalogue export models vase.obj --keys keys --identity identity";
    workshop.line(&format!("{export} -q")).text();
    assert!(workshop.read("vase.obj") == original.as_bytes());
    let keys = std::fs::read_dir(workshop.path("keys")).unwrap().count();
    assert_eq!(keys, 4);
    refused(&workshop.line(export), &["vase.obj", "already exists", "--force"]);
    let kept = Path::new(first["key"].as_str().unwrap()).file_stem().unwrap().to_str().unwrap().to_owned();
    let verify = format!("verify found-detection.html --original vase.obj --key keys/{kept}");
    assert!(workshop.line(&verify).text().starts_with("HOLDS"), "{verify}");

    // With the keys in a folder nothing is asked for, once the original is where it was.
    let found = workshop.line("search leaked.obj --catalogue models --keys keys --json").json();
    assert_eq!((&found["found"], &found["candidates"][0]["recipient"]), (&json!(true), &json!("B. Buyer")));
    // The original itself carries no mark.
    let clean = workshop.line("search vase.obj --catalogue models --keys keys --json");
    assert_eq!((clean.status, &clean.json()["found"]), (Some(1), &json!(false)));
    // A stranger is ranked by its shape, and no key is tested for it.
    let torus = encode(Format::PlyBinaryLittleEndian, &shapes::torus(40, 20, 1.0, 0.4)).unwrap();
    workshop.write("stranger.ply", torus);
    let stranger = workshop.line("search stranger.ply --catalogue models --keys keys --json");
    let answer = stranger.json();
    let vase = answer["candidates"].as_array().unwrap().iter().find(|c| c["original"] == "vase.obj").unwrap();
    assert_eq!((stranger.status, &answer["tests"], &vase["log10_p"]), (Some(1), &json!(0), &Value::Null));
    assert!(vase["score"].as_f64().unwrap() < 0.4, "{answer}");
    let ranked = workshop.line("search vase.obj --catalogue models --rank-only --top 1 --json").json();
    assert_eq!((&ranked["candidates"][0]["log10_p"], &ranked["tested"]), (&Value::Null, &json!(false)));

    let list = workshop.line("catalogue list models --json").json();
    assert_eq!(list["originals"].as_array().unwrap().len(), 2);
    assert_eq!((&list["originals"][1]["kept"], &list["originals"][1]["keys"]), (&json!(true), &json!(4)));
    refused(&workshop.line("catalogue remove models vase.obj"), &["vase.obj", "4 of its keys", "--force"]);
    workshop.line("catalogue remove models vase.obj --force -q").text();
    assert_eq!(
        workshop.line("catalogue list models --json").json()["originals"].as_array().unwrap().len(),
        1
    );
    refused(&workshop.line(export), &["vase.obj", "no original of models"]);
}

#[test]
fn a_passphrase_is_chosen_once_and_a_wrong_one_opens_nothing() {
    let workshop = workshop();
    workshop.write("ball.obj", encode(Format::Obj, &shapes::bumpy_sphere(100)).unwrap());
    workshop.write("torus.obj", encode(Format::Obj, &shapes::torus(12, 8, 1.0, 0.4)).unwrap());
    workshop.write("right", "six words drawn by lot\r\n");
    workshop.write("wrong", "guessed\n");
    workshop.line("catalogue add models ball.obj --keep --passphrase-file right -q").text();
    // Adding more asks for nothing.
    workshop.line("catalogue add models torus.obj --keep -q").text();
    let another = format!("catalogue add models torus.obj --keep --encrypt-to {PUBLIC}");
    refused(&workshop.line(&another), &["encrypted to age1", "--encrypt-to"]);
    let export = "catalogue export models torus.obj -o out.obj";
    refused(&workshop.line(&format!("{export} --passphrase-file wrong")), &["models", "passphrase"]);
    refused(&workshop.line(&format!("{export} --identity identity")), &["--identity", PUBLIC]);
    refused(&workshop.line(&format!("{export} --identity ball.obj")), &["ball.obj", "AGE-SECRET-KEY-1"]);
    workshop.line(&format!("{export} --passphrase-file right -q")).text();
    assert!(workshop.read("out.obj") == workshop.read("torus.obj"));
    for known in ["six words", "\nv ", "AGE-SECRET-KEY"] {
        assert!(!shows(&workshop, "models", known.as_bytes()), "{known}");
    }
    // Without the passphrase's file nothing opens, and nothing is lost: with it again all is there.
    let name =
        workshop.line("catalogue list models --json").json()["encrypted_to"].as_str().unwrap().to_owned();
    let half = format!("models/vault/{name}.identity.age");
    std::fs::rename(workshop.path(&half), workshop.path("half")).unwrap();
    refused(&workshop.line(export), &["models", &name, "--identity"]);
    let elsewhere = format!("{export} --identity half --passphrase-file right --force -q");
    workshop.line(&elsewhere).text();
}

#[test]
fn a_gltf_comes_back_with_the_files_beside_it() {
    let workshop = workshop();
    let [text, buffer] = separate_gltf(&shapes::bumpy_sphere(100), "parts/the%20buffer.bin");
    std::fs::create_dir_all(workshop.path("in/parts")).unwrap();
    workshop.write("in/ball.gltf", &text);
    workshop.write("in/parts/the buffer.bin", &buffer);
    let add = format!("catalogue add models in --keep --encrypt-to {PUBLIC}");
    workshop.line(&format!("{add} -q")).text();
    std::fs::remove_dir_all(workshop.path("in")).unwrap();
    std::fs::create_dir(workshop.path("out")).unwrap();
    workshop.line("catalogue export models ball.gltf -o out/ball.gltf --identity identity -q").text();
    assert!(workshop.read("out/ball.gltf") == text && workshop.read("out/parts/the buffer.bin") == buffer);
    refused(&workshop.line("catalogue export models ball.gltf -o - --identity identity"), &["--output"]);
    // The whole is the same original, so it is passed over.
    let again = workshop.line("catalogue add models out/ball.gltf --json").json();
    assert_eq!(again["kept"], json!(true));
}

#[test]
fn several_originals_in_one_suspect_are_all_named() {
    let workshop = workshop();
    let shapes = [shapes::bust(8), shapes::bumpy_sphere(700)];
    for (name, soup) in ["bust", "ball"].into_iter().zip(&shapes) {
        workshop.write(format!("{name}.ply"), encode(Format::PlyBinaryLittleEndian, soup).unwrap());
        let line = format!("embed {name}.ply --recipient Shop --catalogue models --encrypt-to {PUBLIC} -q");
        workshop.line(&line).text();
    }
    let mut scene = Soup::default();
    for (name, shift) in [("bust", 0.0), ("ball", 9.0)] {
        let copy = sombrero::io::Document::read(&workshop.path(format!("{name}-marked.ply"))).unwrap();
        let first = scene.points.len() as u32;
        scene.points.extend(copy.points().iter().map(|p| p + Vector3::new(shift, 0.5 * shift, 0.0)));
        scene.triangles.extend(copy.triangles().iter().map(|t| t.map(|corner| corner + first)));
    }
    workshop.write("scene.ply", encode(Format::PlyBinaryLittleEndian, &scene).unwrap());
    let found = workshop.line("search scene.ply --catalogue models --identity identity --json").json();
    let named =
        found["candidates"].as_array().unwrap().iter().filter(|listed| listed["found"] == json!(true));
    let mut named: Vec<&str> = named.map(|listed| listed["original"].as_str().unwrap()).collect();
    named.sort_unstable();
    assert_eq!(named, ["ball.ply", "bust.ply"], "{found}");
}

#[test]
fn folders_are_added_and_searched_line_by_line() {
    let workshop = workshop();
    std::fs::create_dir_all(workshop.path("in/sub")).unwrap();
    let ball = encode(Format::Obj, &shapes::bumpy_sphere(150)).unwrap();
    for name in ["in/a.obj", "in/b.obj", "in/sub/a.obj"] {
        let comment = format!("# {name}\n").into_bytes();
        workshop.write(name, [comment, ball.clone()].concat());
    }
    workshop.write("in/broken.obj", "v 1 2\n");
    let added = workshop.line("catalogue add models in --json");
    assert_eq!(added.status, Some(2), "{}", added.stdout);
    let lines: Vec<Value> = added.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.last().unwrap()["summary"], json!({"files": 4, "added": 3, "kept": 0, "refused": 1}));
    // Another file of a name that is taken is told apart, and what is there is passed over.
    std::fs::create_dir(workshop.path("more")).unwrap();
    workshop.write("more/a.obj", [b"# more\n".as_slice(), &ball].concat());
    let more = workshop.line("catalogue add models more/a.obj in/b.obj --json");
    let lines: Vec<Value> = more.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(lines[0]["original"].as_str().unwrap().starts_with("a.obj#") && lines[1]["kept"] == json!(true));

    let search = workshop.line("search in/a.obj in/b.obj --catalogue models --json");
    let lines: Vec<Value> = search.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((search.status, lines.len()), (Some(0), 3));
    assert!(
        lines[..2].iter().all(|line| line["candidates"].as_array().unwrap().len() == 4),
        "{search:?}",
        search = search.stdout
    );
    refused(&workshop.line("search in/a.obj --catalogue in"), &["in", "no catalogue", "catalogue add"]);
    refused(&workshop.line("catalogue export models a.obj"), &["a.obj", "only its shape"]);
    refused(&workshop.line("catalogue remove models nothing.obj"), &["nothing.obj", "catalogue list"]);
}

#[test]
fn a_disk_that_takes_nothing_loses_nothing() {
    let workshop = workshop();
    workshop.write("ball.obj", encode(Format::Obj, &shapes::bumpy_sphere(100)).unwrap());
    workshop.write("bust.obj", encode(Format::Obj, &shapes::bust(10)).unwrap());
    let add = |what: &str| format!("catalogue add models {what} --keep --encrypt-to {PUBLIC}");
    workshop.line(&format!("{} -q", add("ball.obj"))).text();
    // No file may grow beyond 8 KB, which stands for a disk that is full.
    let script = format!("trap '' XFSZ; ulimit -f 16; exec {PROGRAM} {}", add("bust.obj"));
    let full = Command::new("sh").args(["-c", &script]).current_dir(workshop.path("")).output().unwrap();
    refused(&full.into(), &["models", "space"]);
    let listed =
        || workshop.line("catalogue list models --json").json()["originals"].as_array().unwrap().len();
    assert_eq!(listed(), 1);

    // A folder that cannot be written to; whoever is root may write all the same.
    let all = ["models", "models/vault", "models/vault/originals"];
    let mode = |mode: u32| {
        for folder in all {
            std::fs::set_permissions(workshop.path(folder), std::fs::Permissions::from_mode(mode)).unwrap();
        }
    };
    mode(0o555);
    if std::fs::write(workshop.path("models/probe"), "").is_err() {
        refused(&workshop.line(&add("bust.obj")), &["models"]);
    } else {
        std::fs::remove_file(workshop.path("models/probe")).unwrap();
    }
    mode(0o755);
    assert_eq!(listed(), 1);
    workshop.line(&format!("{} -q", add("bust.obj"))).text();
    assert_eq!(listed(), 2);
    workshop.line("catalogue export models bust.obj -o back.obj --identity identity -q").text();
    assert!(workshop.read("back.obj") == workshop.read("bust.obj"));
}
