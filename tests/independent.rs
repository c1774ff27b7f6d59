//! p as an independent program computes it from a report and a key: `independent/p_value.py`.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stderr, reason = "a test that is left out says so")]

use sombrero::io::{Format, encode};
use sombrero::shapes;
use sombrero_tests::Workshop;
use std::path::Path;
use std::process::Command;

const PROGRAM: &str = env!("CARGO_BIN_EXE_sombrero-under-test");

/// Whether there is a Python with numpy.
fn has_numpy() -> bool {
    let ran = Command::new("python3").args(["-c", "import numpy"]).output();
    ran.is_ok_and(|ran| ran.status.success())
}

#[test]
fn p_is_what_another_program_computes() {
    if !has_numpy() {
        eprintln!("left out: there is no python3 with numpy");
        return;
    }
    let workshop = Workshop::new(PROGRAM);
    workshop.write("vase.obj", encode(Format::Obj, &shapes::bumpy_sphere(1500)).unwrap());
    for (name, secret) in [("mine", "01"), ("other", "02")] {
        workshop.write("secret", secret.repeat(32));
        let line = format!(
            "embed vase.obj -o {name}.obj --key {name}.key --secret-file secret --coefficients 60 -q"
        );
        workshop.line(&line).text();
    }
    workshop.line("attack mine.obj -o worn.obj noise:amplitude=0.02 --seed 1 -q").text();
    // A copy after wear, one with another key's mark, and what was never marked, by the paper's method.
    let cases = [
        ("worn.obj", "", "worn.html"),
        ("other.obj", "", "other.html"),
        ("vase.obj", " --method paper", "vase.html"),
    ];
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("independent/p_value.py");
    for (suspect, options, page) in cases {
        let line =
            format!("detect {suspect} --original vase.obj --key mine.key --report {page} --json{options}");
        workshop.write("report.json", workshop.line(&line).stdout);
        for report in [page, "report.json"] {
            let mut python = Command::new("python3");
            let ran = python.arg(&script).args([report, "mine.key"]).current_dir(workshop.path("")).output();
            let ran = ran.unwrap();
            let told = String::from_utf8_lossy(&ran.stdout) + String::from_utf8_lossy(&ran.stderr);
            assert!(ran.status.success(), "{suspect}, {report}:\n{told}");
            assert!(told.contains("agrees  all ways together"), "{told}");
            eprintln!("{suspect}, {report}:\n{told}");
        }
    }
}
