//! The browser's door gives what the command gives. That browsers compute the same is for `browser.rs` to show.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use sombrero::io::{Format, encode};
use sombrero::shapes;
use sombrero::watermark::Identity;
use sombrero_tests::Workshop;
use sombrero_web::{File, look, mark};

#[test]
fn copies_have_the_bytes_of_the_command_and_reports_hold() {
    let workshop = Workshop::new(env!("CARGO_BIN_EXE_sombrero-under-test"));
    let file = |name: &str| File { name: name.to_owned(), bytes: workshop.read(name) };
    // Text, whose decimals have to be chosen alike too.
    workshop.write("vase.obj", encode(Format::Obj, &shapes::bumpy_sphere(400)).unwrap());
    workshop.write("secret", "07".repeat(32));
    let embed = "embed vase.obj --secret-file secret --owner Museum --recipient Ada";
    assert_eq!(workshop.line(embed).status, Some(0));

    let identity = Identity { owner: "Museum".into(), recipient: "Ada".into() };
    let marked = mark(file("vase.obj"), identity, &[7; 32], |_| ()).unwrap();
    assert_eq!((marked.copy.name.as_str(), marked.key.name.as_str()), ("vase-marked.obj", "vase.key"));
    assert!(marked.copy.bytes == workshop.read("vase-marked.obj"), "another copy");
    assert!(marked.key.bytes == workshop.read("vase.key"), "another key");

    let verdict = look(marked.copy, file("vase.obj"), &marked.key).unwrap();
    assert!(verdict.detected);
    workshop.write(&verdict.report.name, &verdict.report.bytes);
    let verified = workshop.line(&format!("verify {}", verdict.report.name));
    assert_eq!(verified.status, Some(0), "{}{}", verified.stdout, verified.stderr);
}
