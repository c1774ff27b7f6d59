//! The page as a whole.

use super::*;
use crate::{Evidence, Record};
use nalgebra::Point3;
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero::watermark::{Identity, Secret};
use sombrero::{Alignment, Claim, DetectOptions, Detector, EmbedOptions, Model, When, detect, embed};
use std::sync::OnceLock;

/// A detection and what it came from.
#[derive(Clone)]
struct Case {
    detection: Detection,
    claim: Claim,
    key: Key,
    original: Model,
    suspect: Soup,
    evidence: Evidence,
}

impl Case {
    fn report(&self) -> Report<'_> {
        let Self { detection, claim, key, original, suspect, evidence } = self;
        Report { detection, claim, key, original, suspect, prepared: false, evidence }
    }
}

fn detected(suspect: &Document, original: &Document, key: Key) -> Case {
    let settings =
        DetectOptions { registration: When::Never, resampling: When::Never, ..DetectOptions::default() };
    let file = |path: &str| FileHash { path: path.into(), sha256: "00ff".into() };
    let evidence = Evidence::new(file("copy.obj"), file("vase.obj"), file("vase.key"), &key, settings);
    let detector = Detector::new(original, key).unwrap();
    let detection = detector.detect(&detector.suspect(suspect), &settings).unwrap();
    let (key, original) = (detector.key().clone(), detector.model().clone());
    let claim = Claim::new(detection.detected, detection.log10_p, &key, None, &settings);
    Case { detection, claim, key, original, suspect: suspect.soup().clone(), evidence }
}

fn original() -> Document {
    Document::parse(encode(Format::Obj, &shapes::bumpy_sphere(400)).unwrap(), None).unwrap()
}

/// A marked copy and the original itself as suspects.
fn cases() -> &'static [Case; 2] {
    static CASES: OnceLock<[Case; 2]> = OnceLock::new();
    CASES.get_or_init(|| {
        let original = original();
        let identity = Identity { owner: "Alice".into(), recipient: "Bob".into() };
        let options = EmbedOptions { identity, ..EmbedOptions::default() };
        let marked = embed(&original, Secret([7; 32]), &options).unwrap();
        let copy = Document::parse(marked.bytes, None).unwrap();
        [detected(&copy, &original, marked.key.clone()), detected(&original, &original, marked.key)]
    })
}

fn marked() -> Case {
    cases()[0].clone()
}

fn html_of(case: &Case) -> String {
    page(&case.report()).unwrap()
}

/// The page without scripts and the pictures' bytes, in which any few letters may occur.
fn without_pictures(page: &str) -> String {
    let page =
        page.split_once("<script type=\"application/json\" id=\"sombrero-evidence\">").map_or(page, |p| p.0);
    let mut parts = page.split("data:image/png;base64,");
    let mut text = parts.next().unwrap().to_owned();
    parts.for_each(|part| text += part.split_once('"').unwrap().1);
    text
}

/// The alignment of the marked copy, but with this matrix.
fn alignment(matrix: [[f64; 4]; 4], rms: f64) -> Alignment {
    static FOUND: OnceLock<Alignment> = OnceLock::new();
    let found = FOUND.get_or_init(|| {
        let original = original();
        let mark = embed(&original, Secret([7; 32]), &EmbedOptions::default()).unwrap();
        let copy = Document::parse(mark.bytes, None).unwrap();
        let aligned = DetectOptions { registration: When::Always, ..DetectOptions::default() };
        detect(&copy, &original, &mark.key, &aligned).unwrap().registration.unwrap()
    });
    let mut alignment = *found;
    (alignment.matrix, alignment.rms) = (matrix, rms);
    alignment
}

#[test]
fn both_verdicts() {
    let [found, not_found] = cases();
    let text = html_of(found);
    assert!(text.starts_with("<!DOCTYPE html>") && text.ends_with("</html>"));
    assert!(text.contains("The mark was found") && !text.contains("No mark was found"));
    assert!(text.contains("less than 1 in 10<sup>"));
    for part in ["Alice", "Bob", "vase.obj", "00ff", "--key vase.key", "sombrero 0."] {
        assert!(text.contains(part), "{part}");
    }
    let text = html_of(not_found);
    assert!(text.contains("No mark was found") && !text.contains("The mark was found"));
    assert!(
        text.contains("about 100 in 100") && text.contains("does not show that the mesh never carried it")
    );
    assert!(text.contains("No point has moved at all."));
}

#[test]
fn nothing_is_loaded_and_one_script_is_run() {
    let page = html_of(&cases()[0]);
    let text = without_pictures(&page);
    assert_eq!(text.matches("src=").count(), 3);
    assert_eq!(page.matches("src=\"data:image/png;base64,").count(), 3);
    for word in ["http:", "https:", "href", "url(", "@import", "//", "<script", "<link", "<iframe"] {
        assert!(!text.contains(word), "{word}");
    }
    assert!(
        text.contains("http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:;")
    );
    assert!(text.contains("script-src 'sha256-") && !text.contains("unsafe-eval"));
    // The record, the scene, and the script that reads it.
    assert_eq!((page.matches("<script").count(), page.matches("</script>").count()), (3, 3));
    assert!(page.ends_with("</script></body></html>"));
}

#[test]
fn the_view_waits_for_its_script_and_stays_off_paper() {
    let text = html_of(&cases()[0]);
    assert!(text.contains("<div class=\"view\" id=\"view\" hidden>"));
    assert!(text.contains("With JavaScript and WebGL there is a view here"));
    for mode in ["original", "suspect", "both", "distance"] {
        assert!(text.contains(&format!("data-mode=\"{mode}\"")), "{mode}");
    }
    let style = include_str!("style.css");
    let print = style.split_once("@media print {").unwrap().1;
    assert!(print.contains(".view, #view-missing { display: none; }"));
    assert!(style.contains(":focus-visible { outline: 2px solid"));
}

#[test]
fn the_record_is_carried_and_the_line_that_checks_it_shown() {
    let mut case = marked();
    case.evidence.files.suspect.path = "</script><script>\u{202e}\"&'\u{2028}".into();
    let text = html_of(&case);
    assert!(text.contains("sombrero verify REPORT.html"));
    let found = Record::find(text.as_bytes()).unwrap().unwrap();
    assert_eq!(found.evidence, case.evidence);
    assert_eq!(found.figures, record(&case.report()));
    // Record, scene and script.
    assert_eq!(text.matches("<script").count(), 3);
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    assert_eq!(html_of(&cases()[0]), html_of(&cases()[0]));
}

#[test]
fn text_from_outside_is_escaped() {
    let evil = "<script>alert(\"1\")</script>&'";
    let mut case = marked();
    case.key.identity = Identity { owner: evil.into(), recipient: evil.into() };
    case.detection.warnings.push(evil.into());
    let file = FileHash { path: evil.into(), sha256: evil.into() };
    let files = &mut case.evidence.files;
    (files.suspect, files.original, files.key) = (file.clone(), file.clone(), file);
    let text = without_pictures(&html_of(&case));
    assert!(!text.contains("<script") && !text.contains("alert(\""));
    // Title, lead (2), warning, files (6), owner, recipient, command (3).
    assert_eq!(text.matches("&lt;script&gt;alert(&quot;1&quot;)&lt;/script&gt;&amp;'").count(), 15);
}

#[test]
fn the_plot_has_a_sign_for_each_coefficient() {
    let mut case = marked();
    case.detection.variant.as_mut().unwrap().test = sombrero::stats::Statistic::CORRELATION;
    let total = case.key.watermark.len();
    case.detection.extracted[3] = None;
    case.detection.extracted[4] = Some(f64::NAN);
    case.detection.extracted[5] = Some(-1e9);
    let used = case.detection.extracted.iter().flatten().filter(|e| e.abs() <= 2.5).count();
    let text = html_of(&case);
    let count = |class: &str| text.matches(&format!("<{class}")).count();
    assert_eq!(count("circle class=\"used\""), used);
    // One sign more of each is in the legend.
    assert_eq!(count("path class=\"missing\""), 2 + 1);
    assert_eq!(count("path class=\"dropped\""), total - 2 - used + 1);
    assert!(
        text.contains("role=\"img\"")
            && text.contains(&format!("Of {total} coefficients {used} were compared"))
    );
    assert_eq!(
        html_of(&cases()[0]).matches("circle class=\"used\"").count(),
        cases()[0].detection.coefficients_used
    );
}

#[test]
fn thousands_of_coefficients_stay_small() {
    let mut case = marked();
    case.key.watermark = (0..5000).map(|i| f64::from(i % 600) / 100.0 - 3.0).collect();
    case.detection.extracted = case.key.watermark.iter().map(|w| Some(0.8 * w)).collect();
    let text = html_of(&case);
    assert_eq!(text.matches("circle class=\"used\"").count(), 5000);
    assert!(without_pictures(&text).len() < 500_000);
}

#[test]
fn odd_numbers_appear_as_none() {
    let mut case = marked();
    case.key.watermark = vec![f64::NAN, f64::INFINITY, 1e300, -1e300];
    case.detection.extracted = vec![Some(1.0), None, Some(f64::NEG_INFINITY)];
    case.detection.log10_p = f64::NEG_INFINITY;
    case.detection.threshold = 0.0;
    case.detection.correlation = f64::NAN;
    case.detection.coverage = f64::NAN;
    case.detection.variants.clear();
    case.detection.registration = Some(alignment([[f64::NAN; 4]; 4], f64::INFINITY));
    let text = without_pictures(&html_of(&case));
    assert!(!text.contains("NaN") && !text.contains(">inf"));
}

#[test]
fn odd_shapes_are_no_error() {
    let empty = Soup::default();
    let point = Soup::new(vec![Point3::origin(); 3], vec![[0, 1, 2]]);
    let broken = Soup::new(vec![Point3::new(f64::NAN, 1e308, -1e308); 2], vec![[0, 1, 9]]);
    let far = [None, Some(Point3::new(f64::NAN, 0.0, 0.0)), Some(Point3::new(f64::MAX, -f64::MAX, 0.0))];
    for original in [&empty, &point, &broken] {
        let mut case = marked();
        case.original = Model::new(original);
        for suspect in [&empty, &point, &broken] {
            for found in [&far[..], &[]] {
                case.detection.found = found.to_vec();
                let text = without_pictures(&page(&Report { suspect, ..case.report() }).unwrap());
                assert!(!text.contains("NaN"));
            }
        }
    }
}

#[test]
fn an_empty_suspect_and_missing_points_are_named() {
    let mut case = marked();
    case.suspect = Soup::default();
    case.detection.found[0] = None;
    let text = html_of(&case);
    assert!(text.contains("It has no surface to draw."));
    assert!(!text.contains("data-mode=\"suspect\"") && !text.contains("data-mode=\"both\""));
    assert!(text.contains("One point was not found on the suspect"));
    case.detection.found.clear();
    assert!(html_of(&case).contains("it is not known which point"));
}

#[test]
fn registration_moves_the_suspect_before_it_is_drawn() {
    let elsewhere = "in a frame of its own";
    let mut case = marked();
    case.suspect.points.iter_mut().for_each(|p| p.x += 100.0);
    let text = html_of(&case);
    assert!(text.contains(elsewhere) && !text.contains("data-mode=\"both\""));
    let mut matrix = [[0.0; 4]; 4];
    (0..4).for_each(|k| matrix[k][k] = 1.0);
    matrix[0][3] = -100.0;
    case.detection.registration = Some(alignment(matrix, 0.001));
    let text = html_of(&case);
    assert!(!text.contains(elsewhere) && text.contains("−100.000000") && text.contains("data-mode=\"both\""));
    assert!(text.contains("not turned by as much as 0.01°, left in its size"));
}
