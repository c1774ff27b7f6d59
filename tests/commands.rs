//! What every command prints, as `cmd/*.md` and the READMEs show it, and what such a page cannot hold: pipes, files that
//! are changed or moved between two commands, and a timestamping authority.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stderr, reason = "a test that is left out says so")]
#![cfg(unix)]

use serde_json::{Value, json};
use sombrero::io::{Format, encode};
use sombrero::shapes;
use sombrero_tests::Workshop;
use std::io::Write;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use trycmd::TestCases;

const PROGRAM: &str = env!("CARGO_BIN_EXE_sombrero-under-test");

/// The secret of the READMEs' marks, which is not shown there.
const SECRET: &str = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

/// The folder of this file.
fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs the commands of `pages`, each page in a fresh copy of the folder `inputs`. What they print now becomes the
/// pages' text when the environment says `TRYCMD=overwrite`.
fn run(pages: &[PathBuf], inputs: &Path, settings: &[(&str, &str)]) {
    let folder = tempfile::tempdir().unwrap();
    let cases = TestCases::new();
    cases.register_bin("sombrero", Path::new(PROGRAM));
    // Whoever runs the tests may have a taste of their own.
    for (name, value) in [("CLICOLOR_FORCE", ""), ("RUST_BACKTRACE", "0")].iter().chain(settings) {
        cases.env(*name, *value);
    }
    let mut texts = Vec::new();
    for page in pages {
        let text = std::fs::read_to_string(page).unwrap();
        let copy = folder.path().join(page.file_name().unwrap());
        std::fs::write(&copy, for_trycmd(&text)).unwrap();
        symlink(inputs, copy.with_extension("in")).unwrap();
        // That it is there allows the commands to write.
        std::fs::create_dir(copy.with_extension("out")).unwrap();
        cases.case(&copy);
        texts.push((page, copy, text));
    }
    cases.run();
    if std::env::var_os("TRYCMD").is_some_and(|mode| mode == "overwrite") {
        for (page, copy, text) in texts {
            let now = for_people(&std::fs::read_to_string(copy).unwrap(), &text);
            // Somebody may have edited the page meanwhile.
            if now != text && std::fs::read_to_string(page).unwrap() == text {
                std::fs::write(page, now).unwrap();
            }
        }
    }
}

/// Whether a line begins a block of commands.
fn opens(line: &str) -> bool {
    line == "```console"
}

/// What begins the line that tells how long a command took.
const SECONDS: &str = "  seconds       ";

/// The page as trycmd is to read it: any number of seconds will do, and after the output of each command there is an
/// empty line, which stands for the line end of its last line. People shall see neither.
fn for_trycmd(page: &str) -> String {
    let (mut lines, mut inside): (Vec<String>, bool) = (Vec::new(), false);
    for line in page.lines() {
        let last = lines.last().map_or("", String::as_str);
        let no_output = ["```console", "$ ", "> ", "? "].iter().any(|start| last.starts_with(start));
        if inside && !last.is_empty() && !no_output && (line == "```" || line.starts_with("$ ")) {
            lines.push(String::new());
        }
        inside = opens(line) || (inside && line != "```");
        lines.push(if inside && line.starts_with(SECONDS) {
            format!("{SECONDS}[..]")
        } else {
            line.to_owned()
        });
    }
    lines.join("\n") + "\n"
}

/// What trycmd wrote as people are to read it, with the seconds that stood in the page before.
fn for_people(written: &str, page: &str) -> String {
    let mut before = page.lines().filter(|line| line.starts_with(SECONDS));
    let (mut lines, mut inside): (Vec<&str>, bool) = (Vec::new(), false);
    for line in written.lines() {
        if inside && line == "```" && lines.last() == Some(&"") {
            lines.pop();
        }
        inside = opens(line) || (inside && line != "```");
        let any = line.strip_prefix(SECONDS) == Some("[..]");
        lines.push(if any { before.next().unwrap_or(line) } else { line });
    }
    lines.join("\n") + "\n"
}

#[test]
fn every_command_prints_what_is_written_down() {
    let is_case =
        |page: &PathBuf| page.extension().is_some_and(|e| e == "md") && !page.ends_with("README.md");
    let entries = std::fs::read_dir(here().join("cmd")).unwrap();
    let pages: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).filter(is_case).collect();
    run(&pages, &here().join("cmd/in"), &[]);
}

/// `buyers.csv` of the READMEs.
const BUYERS: &str = "recipient\norder-1001\norder-1002\norder-1003\n";

/// The READMEs whose blocks marked `console` are run, and whether there must be one.
const READMES: [(&str, bool); 2] = [("../README.md", true), ("../crates/sombrero-cli/README.md", false)];

#[test]
fn the_readmes_commands_print_what_they_show() {
    for (readme, has_commands) in READMES {
        let page = here().join(readme).canonicalize().unwrap();
        let text = std::fs::read_to_string(&page).unwrap();
        assert!(
            text.lines().any(opens) || !has_commands,
            "{readme}: no block of commands is marked `console`"
        );

        let inputs = tempfile::tempdir().unwrap();
        let vase = encode(Format::Obj, &shapes::bust(24)).unwrap();
        std::fs::write(inputs.path().join("vase.obj"), vase).unwrap();
        std::fs::write(inputs.path().join("buyers.csv"), BUYERS).unwrap();
        run(
            &[page],
            inputs.path(),
            &[("SOMBRERO_SECRET", SECRET), ("SOMBRERO_PASSPHRASE", "six words drawn by lot")],
        );
    }
}

/// A folder with the files of `cmd/in`, a marked copy of the vase and its key.
fn workshop() -> Workshop {
    let workshop = Workshop::new(PROGRAM);
    for entry in std::fs::read_dir(here().join("cmd/in")).unwrap() {
        let path = entry.unwrap().path();
        workshop.write(path.file_name().unwrap(), std::fs::read(&path).unwrap());
    }
    let marked = workshop.line("embed vase.obj -o marked.obj --key vase.key --secret-file secret -q");
    assert_eq!((marked.text(), workshop.path("vase.key").exists()), ("", true));
    workshop
}

/// Runs a line with `input` on standard input; gives status, standard output and standard error.
fn piped(workshop: &Workshop, line: &str, input: &[u8]) -> (Option<i32>, Vec<u8>, String) {
    let mut command = workshop.command(line.split(' '));
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let ran = std::thread::scope(|scope| {
        // Whoever refuses early does not read; that is no matter here.
        scope.spawn(move || stdin.write_all(input).is_ok());
        child.wait_with_output().unwrap()
    });
    (ran.status.code(), ran.stdout, String::from_utf8(ran.stderr).unwrap())
}

#[test]
fn meshes_go_through_pipes() {
    let workshop = workshop();
    let vase = workshop.read("vase.obj");

    let line = "embed - -o - --key piped.key --secret-file secret";
    let (status, copy, answer) = piped(&workshop, line, &vase);
    assert_eq!(status, Some(0), "{answer}");
    assert!(copy == workshop.read("marked.obj") && workshop.read("piped.key") == workshop.read("vase.key"));
    assert!(answer.starts_with("marked - → -\n  key           piped.key"), "{answer}");

    let line = "detect - --original vase.obj --key vase.key";
    let (status, answer, messages) = piped(&workshop, line, &copy);
    assert_eq!((status, messages.as_str()), (Some(0), ""));
    assert!(answer.starts_with(b"FOUND: the mark is in -\n"));
    assert_eq!(piped(&workshop, line, &vase).0, Some(1));

    let (status, drawn, _) = piped(&workshop, "render - -o - --size 32", &vase);
    assert!(status == Some(0) && drawn.starts_with(b"\x89PNG"));
    let (_, attacked, _) = piped(&workshop, "attack - -o - none", &vase);
    assert!(attacked == vase);

    let (status, _, message) = piped(&workshop, "info -", b"no mesh");
    assert_eq!(status, Some(2));
    assert!(message.starts_with("sombrero: standard input: "), "{message}");
    let (status, _, message) = piped(&workshop, "compare - -", &vase);
    assert_eq!(status, Some(2));
    assert!(message.contains("two files cannot both be standard input"), "{message}");
}

/// The lines that name what differs.
fn differing(text: &str) -> Vec<&str> {
    text.lines().filter_map(|line| line.strip_prefix("  differs       ")).collect()
}

#[test]
fn a_figure_that_was_changed_is_found() {
    let workshop = workshop();
    let found =
        workshop.line("detect marked.obj --original vase.obj --key vase.key --report found.html --json");
    let answer = found.json();
    workshop.write("found.json", &found.stdout);
    for report in ["found.html", "found.json"] {
        let verified = workshop.line(&format!("verify {report}"));
        assert!(
            verified.text().starts_with(&format!("HOLDS: every figure of {report} ")),
            "{}",
            verified.stdout
        );
    }

    let mut changed = answer.clone();
    changed["log10_p"] = json!(-9999.5);
    changed["coverage"] = json!(0.5);
    workshop.write("changed.json", changed.to_string());
    let verified = workshop.line("verify changed.json");
    assert_eq!((verified.status, verified.stderr.as_str()), (Some(1), ""));
    let verdict = "DOES NOT HOLD: not every figure of changed.json was found again\n";
    assert!(verified.stdout.starts_with(verdict), "{}", verified.stdout);
    let expected = [
        format!("coverage: recorded 0.5, found {}", answer["coverage"]),
        format!("log10_p: recorded -9999.5, found {}", answer["log10_p"]),
    ];
    assert_eq!(differing(&verified.stdout), expected);
    let told = workshop.line("verify changed.json --json");
    assert_eq!((told.status, &told.json()["holds"]), (Some(1), &json!(false)));
    assert_eq!(told.json()["differences"][0]["field"], json!("coverage"));

    // In a page the figures are kept with all their digits as well.
    let page = String::from_utf8(workshop.read("found.html")).unwrap();
    let figure = format!("\"log10_p\":{}", answer["log10_p"]);
    assert!(page.contains(&figure));
    workshop.write("changed.html", page.replace(&figure, "\"log10_p\":-9999.5"));
    let verified = workshop.line("verify changed.html");
    assert_eq!(verified.status, Some(1), "{}{}", verified.stdout, verified.stderr);
    assert!(!differing(&verified.stdout).is_empty());
}

#[test]
fn files_are_found_beside_a_report_that_was_moved() {
    let workshop = workshop();
    workshop.line("detect marked.obj --original vase.obj --key vase.key --report found.html -q").text();
    std::fs::create_dir(workshop.path("case")).unwrap();
    for name in ["found.html", "marked.obj", "vase.obj", "vase.key"] {
        std::fs::rename(workshop.path(name), workshop.path("case").join(name)).unwrap();
    }
    let verified = workshop.line("verify case/found.html");
    assert!(verified.text().starts_with("HOLDS"));
    assert!(verified.stdout.contains("\n  suspect       case/marked.obj\n"), "{}", verified.stdout);

    std::fs::rename(workshop.path("case/vase.key"), workshop.path("elsewhere.key")).unwrap();
    let lost = workshop.line("verify case/found.html");
    assert_eq!(lost.status, Some(2), "{}", lost.stdout);
    let sentence = "sombrero: case/found.html: its key vase.key is not beside it; put it there or give it with --key FILE\n";
    assert_eq!(lost.stderr, sentence);
    let given = workshop.line("verify case/found.html --key elsewhere.key");
    assert!(given.text().starts_with("HOLDS"));
    assert!(
        given.stdout.contains("\n  not compared  the report calls the key vase.key\n"),
        "{}",
        given.stdout
    );
}

#[test]
fn a_report_opens_nothing_that_is_not_beside_it() {
    let workshop = workshop();
    let answer = workshop.line("detect marked.obj --original vase.obj --key vase.key --json").json();
    std::fs::create_dir(workshop.path("case")).unwrap();
    for name in ["marked.obj", "vase.obj", "vase.key"] {
        std::fs::copy(workshop.path(name), workshop.path("case").join(name)).unwrap();
    }
    let elsewhere = workshop.path("elsewhere.obj");
    std::fs::copy(workshop.path("vase.obj"), &elsewhere).unwrap();
    let named = |path: &str| {
        let mut answer = answer.clone();
        answer["files"]["original"]["path"] = json!(path);
        workshop.write("case/report.json", answer.to_string());
        workshop.line("verify case/report.json")
    };
    let paths = [
        elsewhere.to_str().unwrap(),
        "../elsewhere.obj",
        "/etc/passwd",
        r"\\server\share\elsewhere.obj",
        "//server/x.obj",
    ];
    for path in paths {
        let ran = named(path);
        let sentence = "is not beside it; put it there or give it with --original FILE\n";
        assert!(
            ran.status == Some(2) && ran.stderr.ends_with(sentence),
            "{path}: {}{}",
            ran.stdout,
            ran.stderr
        );
    }
    for path in ["-", "", "..", "/", "x/.."] {
        let sentence =
            "sombrero: case/report.json: it names no file as its original; give it with --original FILE\n";
        assert_eq!(named(path).stderr, sentence, "{path}");
    }
    // A path is no more than a name.
    assert!(named("/far/away/vase.obj").text().starts_with("HOLDS"));
    assert!(named(r"C:\scans\vase.obj").text().starts_with("HOLDS"));
}

/// A forger leaves the record as it is, which alone was compared once.
#[test]
fn nothing_in_a_page_can_be_changed() {
    let workshop = workshop();
    workshop.line("detect marked.obj --original vase.obj --key vase.key --report found.html -q --registration never --resampling never").text();
    let page = String::from_utf8(workshop.read("found.html")).unwrap();
    let picture = page.find("data:image/png;base64,").unwrap() + 400;
    let other = if page.as_bytes()[picture] == b'A' { "B" } else { "A" };
    let repainted = format!("{}{other}{}", &page[..picture], &page[picture + 1..]);
    let changed = |old: &str, new: &str| {
        assert!(page.contains(old), "{old}");
        page.replacen(old, new, 1)
    };
    let forgeries = [
        (changed("The mark was found</h1>", "No mark was found</h1>"), "above the first heading"),
        (changed("carries the mark", "is the work"), "below “The mark was found”"),
        (
            changed("<h2>Files", "<section class=\"notes\"><p>The court agreed.</p></section><h2>Files"),
            "below “What this proves, and what not”",
        ),
        (changed("<dt>Recipient</dt><dd>", "<dt>Recipient</dt><dd>not "), "below “The mark”"),
        (changed("SHA-256 </span><code>", "SHA-256 </span><code>0"), "below “Files”"),
        (repainted, "in a picture below “The shapes”"),
        (changed("prefers", "prefer"), "in the style"),
        (changed("Contains three.js", "Contains tree.js"), "in the script or its scene"),
        (page.clone() + "<p>Approved.</p>", "below “To repeat the test”"),
    ];
    for (forged, place) in &forgeries {
        workshop.write("found.html", forged);
        let ran = workshop.line("verify found.html");
        assert_eq!((ran.status, ran.stderr.as_str()), (Some(1), ""), "{place}: {}", ran.stdout);
        assert!(
            ran.stdout.starts_with("DOES NOT HOLD: not all of found.html was found again\n"),
            "{}",
            ran.stdout
        );
        let last = differing(&ran.stdout).pop().unwrap();
        assert!(
            last.starts_with("page, line ") && last.contains(&format!(", {place}: recorded ")),
            "{place}: {last}"
        );
    }

    // Words that were put into page and record alike.
    let words = [
        ("sombrero 0.1.0", "sombrero 0.1.0, certified", "program"),
        ("\"warnings\":[]", "\"warnings\":[\"The suspect's owner confessed.\"]", "warnings"),
        ("\"prepared\":false", "\"prepared\":false,\"judgement\":\"theft\"", "judgement"),
    ];
    for (old, new, field) in words {
        workshop.write("found.html", page.replace(old, new));
        let ran = workshop.line("verify found.html");
        assert_eq!(ran.status, Some(1), "{}{}", ran.stdout, ran.stderr);
        let found = differing(&ran.stdout);
        assert!(found.iter().any(|line| line.starts_with(&format!("{field}: recorded "))), "{found:?}");
    }
    // Times differ from run to run; they are numbers and no more.
    let value = page.split_once("\"seconds\":{").unwrap().1.split_once('}').unwrap().0;
    workshop.write("found.html", page.replace(value, &value.replace(':', ":-")));
    assert_eq!(workshop.line("verify found.html").status, Some(1));
    workshop.write("found.html", &page);
    assert!(workshop.line("verify found.html").text().starts_with("HOLDS"));
}

const AUTHORITY: &str = include_str!("../crates/sombrero-timestamp/tests/authority.cnf");

/// Runs `openssl` in the workshop and gives what it printed.
fn openssl(workshop: &Workshop, arguments: &str) -> String {
    let mut command = Command::new("openssl");
    let ran = command.args(arguments.split(' ')).current_dir(workshop.path("")).output().unwrap();
    assert!(ran.status.success(), "{arguments}: {}", String::from_utf8_lossy(&ran.stderr));
    String::from_utf8(ran.stdout).unwrap()
}

/// Makes the certificates `root.pem` and `other.pem`, and an authority that the first one vouches for.
fn make_authority(workshop: &Workshop) {
    workshop.write("settings", AUTHORITY);
    workshop.write("serial", "2A\n");
    for name in ["root", "other", "tsa"] {
        openssl(
            workshop,
            &format!("genpkey -quiet -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out {name}.key"),
        );
    }
    for name in ["root", "other"] {
        let request = "req -new -x509 -config settings -extensions root -days 2";
        openssl(workshop, &format!("{request} -key {name}.key -subj /CN={name} -out {name}.pem"));
    }
    openssl(workshop, "req -new -config settings -key tsa.key -subj /CN=authority -out tsa.csr");
    openssl(
        workshop,
        "x509 -req -in tsa.csr -CA root.pem -CAkey root.key -CAcreateserial -days 2 -extfile settings -extensions authority -out tsa.pem",
    );
}

#[test]
fn an_authority_stamps_a_commitment() {
    let version = Command::new("openssl").arg("version").output();
    if !version.is_ok_and(|version| version.stdout.starts_with(b"OpenSSL 3")) {
        eprintln!("left out: there is no OpenSSL 3 on the path");
        return;
    }
    let workshop = workshop();
    make_authority(&workshop);

    let committed = workshop.line("commit vase.obj --key vase.key --statement statement --json").json();
    let digest = committed["digest"].as_str().unwrap().to_owned();
    assert_eq!(committed["request"], json!("vase.key.tsq"));
    // Anybody can check what the digest is of.
    assert!(openssl(&workshop, "dgst -sha256 -r statement").starts_with(&digest));
    let query = openssl(&workshop, "ts -query -in vase.key.tsq -text");
    assert!(
        query.contains("Hash Algorithm: sha256") && query.contains("Certificate required: yes"),
        "{query}"
    );
    openssl(&workshop, "ts -reply -config settings -queryfile vase.key.tsq -out vase.key.tsr");

    let store = "commit vase.obj --key vase.key --token vase.key.tsr";
    let refused = workshop.line(&format!("{store} --ca other.pem"));
    assert_eq!((refused.status, refused.stdout.as_str()), (Some(2), ""), "{}", refused.stderr);
    let stored = workshop.line(&format!("{store} --ca root.pem"));
    let text = stored.text();
    for line in [
        "  stored        in vase.key, whose hash changes",
        "serial number",
        "  trust         by a certificate in --ca: ",
        "  fingerprint   SHA-256 ",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    let again = workshop.line(store);
    assert_eq!(again.status, Some(2));
    assert!(again.stderr.contains("has a timestamp already; give --force"), "{}", again.stderr);
    assert_eq!(workshop.line(&format!("{store} --force -q")).text(), "");

    let verify = "verify vase.key --original vase.obj";
    let trusted = |line: &str| {
        let answer = workshop.line(line).json();
        let Value::Object(stamp) = &answer["timestamp"] else { panic!("{answer}") };
        assert!(stamp["time"].as_str().unwrap().ends_with('Z'), "{answer}");
        assert_eq!((&answer["commitment"], &stamp["serial"]), (&json!(digest), &json!("2b")), "{answer}");
        stamp["trusted"] == json!(true)
    };
    assert!(trusted(&format!("{verify} --ca root.pem --json")));
    assert!(!trusted(&format!("{verify} --json")));
    let text = workshop.line(&format!("{verify} --ca root.pem"));
    assert!(text.text().contains("\n  timestamp     20"), "{}", text.stdout);
    assert!(text.stdout.contains(" by CN=authority, serial number"), "{}", text.stdout);
    let told = workshop.line(verify);
    assert!(told.text().contains("  trust         not checked"), "{}", told.stdout);
    let distrusted = workshop.line(&format!("{verify} --ca other.pem"));
    assert_eq!((distrusted.status, distrusted.stdout.as_str()), (Some(2), ""), "{}", distrusted.stderr);

    // A stamped key is a key like any other.
    let found = workshop.line("detect marked.obj --original vase.obj --key vase.key -q");
    assert_eq!(found.text(), "");
    // Whom that convinces depends on who vouches for the timestamp.
    let claim = |more: &str| {
        let found =
            workshop.line(&format!("detect marked.obj --original vase.obj --key vase.key --json {more}"));
        found.json()["claim"].clone()
    };
    let (trusted, told) = (claim("--ca root.pem"), claim(""));
    assert_eq!((&trusted["trusted"], &told["trusted"]), (&json!(true), &json!(false)));
    assert!(trusted["committed_at"].is_string() && trusted["committed_at"] == told["committed_at"], "{told}");
    assert_eq!((&trusted["key_version"], &trusted["convinces"]), (&json!(2), &json!("anybody")));
    let p = |claim: &Value| claim["log10_p_claimant"].as_f64().unwrap();
    // 10^14 keys of his own, or 10^6 stamped ones.
    assert!((p(&told) - p(&trusted) - 8.0).abs() < 1e-9, "{told}");
    // The token of another key's commitment does not fit.
    workshop.line("embed vase.obj -o second.obj --key second.key --owner B --secret-file secret -q").text();
    let strange = workshop.line("commit vase.obj --key second.key --token vase.key.tsr");
    assert_eq!(strange.status, Some(2), "{}", strange.stdout);
    assert!(strange.stderr.starts_with("sombrero: vase.key.tsr: "), "{}", strange.stderr);
}

/// `commit --keys`: what stands in docs/owners.md.
#[test]
fn one_timestamp_serves_a_folder_of_keys() {
    let version = Command::new("openssl").arg("version").output();
    if !version.is_ok_and(|version| version.stdout.starts_with(b"OpenSSL 3")) {
        eprintln!("left out: there is no OpenSSL 3 on the path");
        return;
    }
    let workshop = workshop();
    make_authority(&workshop);
    workshop.write("list.csv", "recipient\nA\nB\nC\n");
    workshop.line("embed vase.obj --recipients list.csv --out-dir shop --secret-file secret -q").text();
    let committed = workshop.line("commit vase.obj --keys shop/keys --json").json();
    assert_eq!((&committed["keys"], &committed["request"]), (&json!(3), &json!("shop/keys.tsq")));
    let again = workshop.line("commit vase.obj --keys shop/keys");
    assert_eq!(again.status, Some(2), "{}", again.stdout);
    assert!(again.stderr.contains("waits for a timestamp"), "{}", again.stderr);
    // A run that was broken off before it wrote the request is gone on with; where another key came since, it was another
    // tree.
    let request = workshop.read("shop/keys.tsq");
    std::fs::remove_file(workshop.path("shop/keys.tsq")).unwrap();
    workshop.line("embed vase.obj -o d.obj --key shop/keys/d.key --recipient D -q").text();
    let again = workshop.line("commit vase.obj --keys shop/keys");
    assert_eq!(again.status, Some(2), "{}", again.stdout);
    assert!(again.stderr.contains("waits for a timestamp"), "{}", again.stderr);
    std::fs::remove_file(workshop.path("shop/keys/d.key")).unwrap();
    workshop.line("commit vase.obj --keys shop/keys").text();
    assert!(workshop.read("shop/keys.tsq") == request);
    openssl(&workshop, "ts -reply -config settings -queryfile shop/keys.tsq -out shop/keys.tsr");
    let store = "commit vase.obj --keys shop/keys --token shop/keys.tsr --ca root.pem";
    assert!(workshop.line(store).text().contains("\n  fingerprint   SHA-256 "));

    for name in ["a", "b", "c"] {
        let verify = format!("verify shop/keys/vase-{name}.key --original vase.obj --ca root.pem --json");
        assert_eq!(workshop.line(&verify).json()["timestamp"]["trusted"], json!(true), "{name}");
    }
    let trace = "trace shop/vase-b.obj --original vase.obj --keys shop/keys --ca root.pem --json";
    let named = &workshop.line(trace).json()["recipients"][0];
    assert_eq!((&named["recipient"], &named["claim"]["convinces"]), (&json!("B"), &json!("anybody")));

    // Without the program: the commitment, then its siblings, as docs/evidence.md has it.
    let key: Value = serde_json::from_slice(&workshop.read("shop/keys/vase-a.key")).unwrap();
    workshop.line("commit vase.obj --key shop/keys/vase-a.key --statement opened -o other.tsq -q").text();
    let script = "set -e
        node=$({ printf '\\000'; openssl dgst -sha256 -binary opened; } | openssl dgst -sha256 -r | cut -d ' ' -f 1)
        for step in $1; do
            side=${step%%:*}; sibling=${step#*:}
            if [ $side = left ]; then pair=$sibling$node; else pair=$node$sibling; fi
            node=$(printf 01$pair | xxd -r -p | openssl dgst -sha256 -r | cut -d ' ' -f 1)
        done
        echo $node";
    let steps: Vec<String> = key["path"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|step| step.as_object().unwrap())
        .map(|(side, sibling)| format!("{side}:{}", sibling.as_str().unwrap()))
        .collect();
    let ran = Command::new("sh")
        .args(["-c", script, "sh", &steps.join(" ")])
        .current_dir(workshop.path(""))
        .output()
        .unwrap();
    assert_eq!(String::from_utf8(ran.stdout).unwrap().trim(), committed["digest"].as_str().unwrap());

    // A path that was made up leads to another root.
    let mut forged = key.clone();
    forged["path"][0] = json!({ "left": "00".repeat(32) });
    workshop.write("forged.key", forged.to_string());
    let refused = workshop.line("verify forged.key --original vase.obj --ca root.pem");
    assert_eq!((refused.status, refused.stdout.as_str()), (Some(2), ""), "{}", refused.stderr);
    assert!(refused.stderr.contains("the token is for another digest"), "{}", refused.stderr);
}
