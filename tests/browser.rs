//! The report in a real browser: the view draws and obeys, the page loads nothing, fits a telephone and can be read in
//! light and dark. Likewise the page of the browser's door (`door`). Where no Chromium is installed, the tests say so and pass.
//!
//! With `SOMBRERO_SCREENSHOTS=docs`, a folder, the pictures of a report in the documentation are made again.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stderr, reason = "that nothing was tested must not go unsaid")]

#[path = "browser/door.rs"]
mod door;

use base64::{Engine, engine::general_purpose::STANDARD};
use serde_json::Value;
use sombrero::attacks::crop;
use sombrero::io::{Document, Format, encode};
use sombrero::shapes;
use sombrero::{Claim, DetectOptions, Detector};
use sombrero_report::{Evidence, FileHash, Record, Report, page};
use sombrero_tests::{Workshop, document, marked};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A browser that takes longer hangs.
const PATIENCE: Duration = Duration::from_secs(60);

/// Names that would break out of the page, or turn its sentences round.
const HOSTILE: &str = "</script><script>alert(1)</script><!-- \" ' & \\ \u{202e}cod.ylp\u{2028}.ply";

static CHROMIUM: LazyLock<Option<PathBuf>> = LazyLock::new(|| {
    let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let found =
        names.iter().find_map(|name| folders.iter().map(|f| f.join(name)).find(|path| path.is_file()));
    if found.is_none() {
        eprintln!("no Chromium on the path: the report was not opened in a browser");
    }
    found
});

/// A report on a marked copy that was cropped, turned and moved.
static PAGE: LazyLock<String> = LazyLock::new(|| {
    let original = document(Format::Off, &shapes::bumpy_sphere(900));
    let mark = marked(&original, 1);
    let mut soup = crop(Document::parse(mark.bytes, None).unwrap().soup(), 0.2).unwrap().soup;
    let turn = nalgebra::Rotation3::from_euler_angles(0.3, 1.1, -0.4);
    soup.points.iter_mut().for_each(|p| *p = turn * *p * 1.5 + nalgebra::Vector3::new(3.0, 2.0, 1.0));
    let suspect = Document::parse(encode(Format::Off, &soup).unwrap(), None).unwrap();
    let settings = DetectOptions::default();
    let detector = Detector::new(&original, mark.key).unwrap();
    let detection = detector.detect(&detector.suspect(&suspect), &settings).unwrap();
    let file = || FileHash { path: HOSTILE.into(), sha256: "0123456789abcdef".repeat(4) };
    let evidence = Evidence::new(file(), file(), file(), detector.key(), settings);
    let claim = Claim::new(detection.detected, detection.log10_p, detector.key(), None, &settings);
    page(&Report {
        detection: &detection,
        claim: &claim,
        key: detector.key(),
        original: detector.model(),
        suspect: suspect.soup(),
        prepared: false,
        evidence: &evidence,
    })
    .unwrap()
});

/// A browser with a profile of its own that can reach nothing.
struct Browser {
    program: &'static Path,
    folder: TempDir,
}

/// What a run of the browser left behind.
struct Seen {
    dom: String,
    log: String,
}

impl Browser {
    fn new() -> Option<Self> {
        Some(Self { program: CHROMIUM.as_deref()?, folder: TempDir::new().unwrap() })
    }

    /// Opens a page that is written to a file first. A browser that does not end is ended.
    fn open(&self, page: &str, options: &[&str]) -> Seen {
        let path = |name| self.folder.path().join(name);
        fs::write(path("page.html"), page).unwrap();
        let mut command = Command::new(self.program);
        command.args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars"]);
        // WebGL without a graphics card.
        command.args(["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]);
        command.args(["--host-resolver-rules=MAP * ~NOTFOUND", "--disable-background-networking"]);
        command.args(["--disable-component-update", "--disable-sync", "--disable-dev-shm-usage"]);
        command.args(["--enable-logging=stderr", "--v=0", "--timeout=50000"]);
        command.arg(format!("--user-data-dir={}", path("profile").display())).args(options);
        command.arg(format!("file://{}", path("page.html").display()));
        command.stdout(File::create(path("dom")).unwrap()).stderr(File::create(path("log")).unwrap());
        let mut child = command.spawn().unwrap();
        let start = Instant::now();
        let read = |name| String::from_utf8_lossy(&fs::read(path(name)).unwrap()).into_owned();
        while child.try_wait().unwrap().is_none() {
            if start.elapsed() > PATIENCE {
                child.kill().unwrap();
                child.wait().unwrap();
                panic!("the browser did not end within {PATIENCE:?}; it said:\n{}", read("log"));
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        Seen { dom: read("dom"), log: read("log") }
    }

    /// What the visitor found out about the page in a window of this width.
    fn visit(&self, page: &str, width: u32, options: &[&str]) -> (Value, String) {
        self.visit_with(page, "", width, options)
    }

    /// The same with `more` of the page around it, after the visitor.
    fn visit_with(&self, page: &str, more: &str, width: u32, options: &[&str]) -> (Value, String) {
        let frame = page.replace('&', "&amp;").replace('"', "&quot;");
        let wrapper = format!(
            "<!DOCTYPE html><meta charset=utf-8><meta name=color-scheme content=\"light dark\"><title>-</title>\
             <output></output><iframe hidden></iframe><script>{VISITOR}</script>{more}\
             <iframe width={width} height=900 style=\"border:0\" onload=\"begin(this)\" srcdoc=\"{frame}\"></iframe>"
        );
        let seen = self.open(&wrapper, &[&["--dump-dom", "--window-size=1400,1000"], options].concat());
        let output = seen.dom.rsplit_once("<output>").and_then(|(_, rest)| rest.split_once("</output>"));
        let Some((output, _)) = output.filter(|(text, _)| !text.is_empty()) else {
            panic!("the visitor has not come back; the browser said:\n{}", seen.log);
        };
        let found: Value = serde_json::from_slice(&STANDARD.decode(output).unwrap()).unwrap();
        assert_eq!(found["failed"], Value::Null, "{}", seen.log);
        (found, seen.log)
    }
}

/// A script of the page around the report: looks at the report, presses its buttons, tells what came of it.
const VISITOR: &str = include_str!("browser/visitor.js");

/// What pages wrote to the browser's console; drivers without a graphics card complain of their own slowness.
fn complaints(log: &str) -> Vec<&str> {
    log.lines().filter(|line| line.contains(":CONSOLE") && !line.contains("GL Driver Message")).collect()
}

#[test]
fn the_view_draws_and_obeys() {
    let Some(browser) = Browser::new() else { return };
    for (width, scheme, paper) in [(390, "1", "rgb(248, 246, 241)"), (1200, "0", "rgb(25, 24, 22)")] {
        let scheme = format!("--blink-settings=preferredColorScheme={scheme}");
        let (seen, log) = browser.visit(&PAGE, width, &[&scheme]);
        assert_eq!(complaints(&log), [""; 0]);
        assert_eq!(seen["state"], "ready", "{seen}");
        for mode in ["original", "suspect", "both", "distance"] {
            let drawn = seen["drawn"][mode].as_i64().unwrap();
            assert!((100..=900).contains(&drawn), "{mode}: {drawn} of 1000");
        }
        assert!(
            seen["drawn"]["suspect"].as_i64() < seen["drawn"]["original"].as_i64(),
            "a part is cropped: {seen}"
        );
        assert_eq!(seen["frames_while_idle"], 0, "{seen}");
        for change in ["key_turns", "key_zooms", "drag_turns", "wheel_zooms", "reset_returns"] {
            assert_eq!(seen[change], true, "{change}: {seen}");
        }
        assert_eq!(seen["wheel_without_focus"], false, "the page must scroll: {seen}");
        assert_eq!((&seen["missing_shown"], &seen["canvas_printed"]), (&false.into(), &false.into()));
        assert_eq!(seen["loaded"], 0, "something was loaded: {seen}");
        let record = Record::find(PAGE.as_bytes()).unwrap().unwrap().figures;
        for field in ["suspect", "files", "detected", "threshold", "variants_counted"] {
            assert_eq!(seen["evidence"][field], record[field], "a browser reads another {field}");
        }
        assert_eq!((&seen["width"], &seen["content_width"]), (&width.into(), &width.into()));
        assert_eq!(seen["paper"], paper);
        let contrast = seen["least_contrast"]["ratio"].as_f64().unwrap();
        assert!(contrast >= 4.5, "{}", seen["least_contrast"]);
    }
}

#[test]
fn without_webgl_a_sentence_says_so_and_other_scripts_are_refused() {
    let Some(browser) = Browser::new() else { return };
    let (seen, log) = browser.visit(&PAGE, 800, &["--disable-3d-apis"]);
    assert_eq!((&seen["state"], &seen["missing_shown"]), (&"no WebGL".into(), &true.into()), "{seen}");
    assert!(complaints(&log).is_empty(), "{log}");

    let intruder = PAGE.replacen("<main>", "<main><script>document.title = 'intruder'</script>", 1);
    let seen = browser.open(&intruder, &["--dump-dom"]);
    assert!(seen.dom.contains("<title>The mark was found"), "an intruder ran");
    assert!(seen.log.contains("Content Security Policy"), "{}", seen.log);
}

#[test]
fn the_page_carries_its_evidence_and_names_no_address() {
    let record = Record::find(PAGE.as_bytes()).unwrap().unwrap();
    assert_eq!(record.evidence.files.suspect.path, HOSTILE);
    let (before, script) = PAGE.rsplit_once("<script>").unwrap();
    assert!(script.ends_with("</script></body></html>"));
    for word in ["http:", "https:", "src=\"/", "href", "url(", "@import"] {
        assert!(!before.contains(word), "{word}");
    }
    // The one address in the script is the name of a namespace.
    assert_eq!(script.matches("http").count(), script.matches("http://www.w3.org/1999/xhtml").count());
}

/// The report on the demo's bust, after all of the paper's attacks.
fn bust() -> String {
    let workshop = Workshop::new(env!("CARGO_BIN_EXE_sombrero-under-test"));
    workshop.line("demo -o .").text();
    let ran = workshop
        .line("detect bust-allofthepapers.ply --original bust.ply --key bust.key --report bust.html --quiet");
    assert_eq!(ran.status, Some(0), "{}", ran.stderr);
    String::from_utf8(workshop.read("bust.html")).unwrap()
}

#[test]
fn the_pictures_of_the_documentation() {
    let Some(folder) = std::env::var_os("SOMBRERO_SCREENSHOTS") else { return };
    let Some(browser) = Browser::new() else { return };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join(folder);
    let page = bust();
    for (name, size, scheme) in
        [("light", "1100,2050", "1"), ("dark", "1100,2050", "0"), ("phone", "390,2300", "1")]
    {
        let picture = folder.join(format!("report-{name}.png"));
        let options = [
            format!("--screenshot={}", picture.display()),
            "--virtual-time-budget=5000".into(),
            format!("--window-size={size}"),
            format!("--blink-settings=preferredColorScheme={scheme}"),
        ];
        browser.open(&page, &options.each_ref().map(String::as_str));
        assert!(fs::metadata(&picture).unwrap().len() < 600_000, "{name} is large");
    }
}
