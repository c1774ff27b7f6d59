//! The page of the browser's door, end to end. `SOMBRERO_PAGE` names it: `cargo xtask ci` makes it where that is possible.

use super::{Browser, complaints};
use base64::{Engine, engine::general_purpose::STANDARD};
use serde_json::{Value, json};
use sombrero::io::{Format, encode};
use sombrero::shapes;
use sombrero_tests::Workshop;
use std::sync::LazyLock;

/// The secret's bytes.
const SECRET: u8 = 7;

static PAGE: LazyLock<Option<String>> = LazyLock::new(|| {
    let Some(path) = std::env::var_os("SOMBRERO_PAGE") else {
        eprintln!("SOMBRERO_PAGE names no page: the browser's door was not opened");
        return None;
    };
    Some(std::fs::read_to_string(path).unwrap())
});

/// What the visitor found, with what holds of every visit looked at. With a secret it marks and looks.
fn visited(
    browser: &Browser,
    page: &str,
    model: &[u8],
    secret: Option<u8>,
    window: (u32, &str, &str),
) -> Value {
    let (width, scheme, paper) = window;
    let given = json!({ "secret": secret, "model": "vase.off", "content": STANDARD.encode(model) });
    let given = format!("<script type=\"application/json\" id=given>{given}</script>");
    let script = format!("{given}<script>{}</script>", include_str!("door.js"));
    let scheme = format!("--blink-settings=preferredColorScheme={scheme}");
    let (seen, log) = browser.visit_with(page, &script, width, &[&scheme]);
    // The visitor tries to connect in the end, and nothing else is complained of.
    let told = complaints(&log);
    assert!(told.iter().any(|line| line.contains("Content Security Policy")), "{log}");
    assert!(
        told.iter().all(|line| line.contains("data:text/plain,a") && line.contains("onnect")),
        "{told:?}"
    );
    let large = seen["large"].as_str().unwrap();
    assert!(large.starts_with("large.stl: 200 MB"), "{large}");
    assert_eq!(seen["shown"], "vase.off, to be turned");
    assert_eq!((&seen["loaded"], &seen["connected"]), (&json!([]), &json!(false)));
    assert_eq!((&seen["width"], &seen["content_width"]), (&width.into(), &width.into()));
    assert_eq!((&seen["paper"], &seen["nameless"]), (&paper.into(), &json!([])));
    let contrast = seen["least_contrast"]["ratio"].as_f64().unwrap();
    assert!(contrast >= 4.5, "{}", seen["least_contrast"]);
    seen
}

#[test]
fn a_model_is_marked_and_found_as_by_the_command() {
    let (Some(page), Some(browser)) = (PAGE.as_ref(), Browser::new()) else { return };
    let model = encode(Format::Off, &shapes::bumpy_sphere(400)).unwrap();
    let workshop = Workshop::new(env!("CARGO_BIN_EXE_sombrero-under-test"));
    workshop.write("vase.off", &model);
    workshop.write("secret", hex::encode([SECRET; 32]));
    let embed = ["embed", "vase.off", "--secret-file", "secret", "--owner", "A. Museum"];
    assert_eq!(workshop.run(embed).status, Some(0));

    let seen = visited(&browser, page, &model, Some(SECRET), (390, "1", "rgb(248, 246, 241)"));
    let content = |name: &str| STANDARD.decode(seen[name].as_str().unwrap()).unwrap();
    let cancelled = json!({ "during": true, "over": true, "silent": true, "after": true });
    assert_eq!(seen["cancelled"], cancelled);
    assert_eq!((&seen["marked"], &seen["measured"]), (&"Marked".into(), &true.into()));
    assert_eq!(seen["saved"], json!(["vase-marked.off", "vase.key"]));
    assert!(content("copy") == workshop.read("vase-marked.off"), "a browser's copy is another");
    assert!(content("key") == workshop.read("vase.key"), "a browser's key is another");

    assert_eq!(seen["verdict"], "The mark was found");
    let report = seen["reported"].as_str().unwrap();
    workshop.write(report, content("report"));
    let verified = workshop.run(["verify", report]);
    assert_eq!(verified.status, Some(0), "{}{}", verified.stdout, verified.stderr);
}

#[test]
fn a_wide_dark_page_can_be_read_and_loads_nothing() {
    let (Some(page), Some(browser)) = (PAGE.as_ref(), Browser::new()) else { return };
    let model = encode(Format::Off, &shapes::bumpy_sphere(400)).unwrap();
    visited(&browser, page, &model, None, (1200, "0", "rgb(25, 24, 22)"));
}

#[test]
fn other_scripts_are_refused() {
    let (Some(page), Some(browser)) = (PAGE.as_ref(), Browser::new()) else { return };
    let intruder = page.replacen("<main>", "<main><script>document.title = 'intruder'</script>", 1);
    let seen = browser.open(&intruder, &["--dump-dom"]);
    assert!(seen.dom.contains("<title>sombrero"), "an intruder ran");
    assert!(seen.log.contains("Content Security Policy"), "{}", seen.log);
}
