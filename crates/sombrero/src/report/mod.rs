//! A detection as one HTML page that people can keep, print and hand on.
//!
//! The page needs nothing but itself: pictures are PNG in data URIs, the plot is SVG, and one script, which is part of
//! this crate and of every page, lets the shapes be turned. Without it the page says all the same. A content policy in
//! the page forbids browsers to load anything and to run any other script. Text from outside is escaped by the
//! template engine wherever it appears, and isolated, so that a file name written from right to left cannot turn a
//! sentence round. The same input gives the same bytes; only the times in [`Detection::seconds`] differ from run to
//! run.

mod course;
mod decimate;
mod distances;
mod evidence;
mod motion;
mod pictures;
mod plot;
mod scene;
mod shapes;
mod viewer;
mod words;

#[cfg(test)]
mod tests;

pub use evidence::evidence_of;

use crate::{Detection, Model};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use nalgebra::Point3;
use pictures::Pictures;
use plot::Plot;
use scene::Scene;
use shapes::Shapes;
use sombrero_mesh::Soup;
use sombrero_render::ImageError;
use sombrero_watermark::Key;
use thiserror::Error;
use words::{count, decimal, odds, p_value, percent};

/// All that a report shows. Lengths are in model units.
#[derive(Debug, Clone, Copy)]
pub struct DetectionReport<'a> {
    /// What was found.
    pub detection: &'a Detection,
    /// The key that was looked for. Its secret does not appear, but the plot shows its coefficients.
    pub key: &'a Key,
    /// The original.
    pub original: &'a Model,
    /// The suspect as its file has it, for the picture; moved by [`Detection::registration`] before it is
    /// drawn.
    pub suspect: &'a Soup,
    /// Where each point of `original` is on the suspect, in the original's coordinates, for the map of
    /// distances. `None` when no correspondence is known; an entry of `None`, one that is not finite, or one
    /// that is left out at the end counts as missing.
    pub found: Option<&'a [Option<Point3<f64>>]>,
    /// The original's file.
    pub original_file: FileLabel<'a>,
    /// The suspect's file.
    pub suspect_file: FileLabel<'a>,
    /// The key's file.
    pub key_file: FileLabel<'a>,
    /// The command line that repeats the test; the section is left out when it is empty.
    pub command: &'a str,
    /// When the test was made, in words of the caller's choice; this module reads no clock.
    pub date: Option<&'a str>,
    /// The whole answer of the test as JSON, such as `sombrero detect --json` writes it. The page carries it
    /// word for word in meaning, and [`evidence_of`] finds it again.
    pub evidence: Option<&'a str>,
}

/// What tells one file from all others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileLabel<'a> {
    /// Its name as people know it.
    pub name: &'a str,
    /// The SHA-256 of its bytes in hexadecimal digits.
    pub sha256: &'a str,
}

/// Why there is no report.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A picture cannot be stored.
    #[error("a picture of the report cannot be made: {0}")]
    Picture(#[from] ImageError),
}

/// The whole page as HTML.
///
/// # Errors
/// [`ReportError`] when a picture cannot be encoded.
///
/// # Example
/// ```
/// use sombrero::report::{DetectionReport, FileLabel, detection_report};
/// use sombrero::{DetectOptions, EmbedOptions, Detector, embed};
/// use sombrero::{io::{Document, Format, encode}, shapes, watermark::Secret};
///
/// let original = Document::parse(encode(Format::Obj, &shapes::bumpy_sphere(500))?, None)?;
/// let marked = embed(&original, Secret([1; 32]), &EmbedOptions::default())?;
/// let suspect = Document::parse(marked.bytes, None)?;
/// let detector = Detector::new(&original, marked.key)?;
/// let detection = detector.detect(&detector.suspect(&suspect), &DetectOptions::default())?;
///
/// let page = detection_report(&DetectionReport {
///     detection: &detection,
///     key: detector.key(),
///     original: detector.model(),
///     suspect: &suspect.soup(),
///     found: Some(&detection.found),
///     original_file: FileLabel { name: "vase.obj", sha256: "…" },
///     suspect_file: FileLabel { name: "found.obj", sha256: "…" },
///     key_file: FileLabel { name: "vase.key", sha256: "…" },
///     command: "sombrero detect found.obj --original vase.obj --key vase.key",
///     date: None,
///     evidence: None,
/// })?;
/// assert!(page.contains("The mark was found"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn detection_report(input: &DetectionReport<'_>) -> Result<String, ReportError> {
    let shapes = Shapes::new(input);
    let pictures = Pictures::new(&shapes)?;
    let scene = Scene::new(&shapes);
    let plot = Plot::new(&input.key.watermark, &input.detection.extracted, input.detection.variant.test);
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            (head(input, scene.as_ref()))
            body {
                main {
                    (verdict(input))
                    (figures(input.detection))
                    (notes(input.detection))
                    (coefficients(input.detection, &plot))
                    (in_space(input, &shapes, &pictures, scene.as_ref()))
                    (meaning(input.detection))
                    (files(input))
                    (parameters(input))
                    (course::section(input.detection, input.original.largest_side()))
                    (repeat(input))
                }
                (footer(input.date))
                @if let Some(json) = input.evidence { (evidence::element(json)) }
                @if let Some(scene) = &scene { (viewer::scripts(scene)) }
            }
        }
    };
    Ok(page.into_string())
}

/// Text from outside, kept from changing the reading direction around it.
fn outside(text: &str) -> Markup {
    html! { bdi { (text) } }
}

fn headline(detected: bool) -> &'static str {
    if detected { "The mark was found" } else { "No mark was found" }
}

fn head(input: &DetectionReport<'_>, scene: Option<&Scene>) -> Markup {
    html! {
        head {
            meta charset="utf-8";
            meta http-equiv="Content-Security-Policy" content=(viewer::content_policy(scene));
            meta name="viewport" content="width=device-width, initial-scale=1";
            meta name="color-scheme" content="light dark";
            meta name="robots" content="noindex";
            title { (headline(input.detection.detected)) " – " (input.suspect_file.name) }
            style { (PreEscaped(include_str!("style.css"))) }
        }
    }
}

fn verdict(input: &DetectionReport<'_>) -> Markup {
    let Detection { detected, log10_p, .. } = *input.detection;
    html! {
        header class=(if detected { "found" } else { "not-found" }) {
            p.kicker { "Watermark report" }
            h1 { (headline(detected)) }
            p.lead {
                (outside(input.suspect_file.name))
                @if detected { " carries the mark that " } @else { " does not measurably carry the mark that " }
                (outside(input.key_file.name)) " describes. The chance that an unmarked mesh would match as well is "
                (odds(log10_p)) "."
            }
            @if let Some(date) = input.date { p.date { "Tested " (outside(date)) } }
        }
    }
}

/// The figures of the test, each with what it means.
fn figures(detection: &Detection) -> Markup {
    let total = detection.extracted.len();
    html! {
        dl.figures {
            (figure("p", p_value(detection.log10_p), "The probability of a match by chance."))
            (figure("threshold", p_value(detection.threshold.log10()), "Found means that p is at most this."))
            (figure(
                "correlation",
                html! { (decimal(detection.correlation, 3)) },
                "Of inserted and extracted coefficients: 1 is a perfect match, 0 none.",
            ))
            (figure(
                "coefficients",
                html! { (detection.coefficients_used) small { " of " (total) } },
                "How many could be compared.",
            ))
            (figure(
                "coverage",
                html! { (percent(detection.coverage)) },
                "Share of the original’s surface that was found on the suspect.",
            ))
        }
    }
}

fn figure(name: &str, value: Markup, meaning: &str) -> Markup {
    html! { div { dt { (name) } dd.value { (value) } dd.meaning { (meaning) } } }
}

fn notes(detection: &Detection) -> Markup {
    html! {
        @if !detection.warnings.is_empty() {
            section.notes aria-label="Remarks" {
                @for warning in &detection.warnings { p { (outside(warning)) } }
            }
        }
    }
}

fn coefficients(detection: &Detection, plot: &Plot) -> Markup {
    html! {
        section {
            h2 { "The mark, number by number" }
            div.beside {
                figure.plot { (plot.svg(detection.correlation)) figcaption { (plot.legend()) } }
                div {
                    p {
                        "The mark is a list of random numbers, each of which moves a patch of the surface a little. "
                        "Here every number is a point: how strongly it was inserted, and how strongly it was "
                        "measured on the suspect."
                    }
                    p {
                        "On an untouched copy every point lies on the dotted diagonal. On a mesh without the mark the "
                        "height of a point has nothing to do with its place from left to right."
                    }
                    p { (plot.summary()) }
                }
            }
        }
    }
}

fn meaning(detection: &Detection) -> Markup {
    html! {
        section {
            h2 { "What this proves, and what not" }
            @if !detection.detected {
                p {
                    "That no mark was found does not show that the mesh never carried it: heavy editing, or a loss "
                    "of much of the surface, can hide a mark."
                }
            }
            p {
                "The method is not blind: it needs the original and the key, so that a match ties the suspect to a copy "
                "marked with this key, but does not by itself say who made the original first or who passed the copy on."
            }
            p {
                "The probability assumes that the key was fixed before the suspect was seen; a key made or picked "
                "afterwards could fit any mesh, so be ready to show when the key was made, for instance by a timestamp "
                "of its hash."
            }
            @if detection.log10_p < words::BEYOND_CHANCE {
                p {
                    "At so small a probability chance is no longer the doubt that matters: a mistake in handling files or "
                    "keys is far more likely, and the hashes below are there to rule it out."
                }
            }
            p {
                "This page shows the mark’s coefficients and so gives away part of what the key keeps secret. Share it "
                "as carefully as the key."
            }
        }
    }
}

fn files(input: &DetectionReport<'_>) -> Markup {
    let files = [("Original", input.original_file), ("Suspect", input.suspect_file), ("Key", input.key_file)];
    html! {
        section {
            h2 { "Files" }
            dl.files {
                @for (role, FileLabel { name, sha256 }) in files {
                    div {
                        dt { (role) }
                        dd { (outside(name)) }
                        dd.hash { span { "SHA-256 " } code { (sha256) } }
                    }
                }
            }
        }
    }
}

fn parameters(input: &DetectionReport<'_>) -> Markup {
    let Key { identity, parameters, .. } = input.key;
    let soup = input.original.soup();
    html! {
        section {
            h2 { "The mark" }
            dl.pairs {
                (pair("Owner", named(&identity.owner)))
                (pair("Recipient", named(&identity.recipient)))
                (pair("Coefficients", html! { (parameters.basis.coefficients) }))
                (pair("Strength ε", html! { (parameters.epsilon) }))
                (pair("Basis function", html! { (parameters.basis.function) }))
                (pair("Original", html! { (count(soup.points.len())) " points, " (count(soup.triangles.len())) " triangles" }))
            }
        }
    }
}

fn named(name: &str) -> Markup {
    if name.is_empty() {
        html! { span.faint { "not named" } }
    } else {
        outside(name)
    }
}

fn pair(name: &str, value: Markup) -> Markup {
    html! { div { dt { (name) } dd { (value) } } }
}

/// The shapes in space: to be turned, and as pictures.
fn in_space(
    input: &DetectionReport<'_>,
    shapes: &Shapes<'_>,
    pictures: &Pictures,
    scene: Option<&Scene>,
) -> Markup {
    let moved = input.detection.registration.is_some();
    html! {
        section {
            h2 { "The shapes" }
            @if let Some(scene) = scene { (viewer::view(scene, shapes.distances.as_ref(), moved)) }
            (pictures.gallery(shapes, moved))
        }
    }
}

fn repeat(input: &DetectionReport<'_>) -> Markup {
    let command = input.command.trim();
    html! {
        @if !command.is_empty() || input.evidence.is_some() {
            section {
                h2 { "To repeat the test" }
                @if !command.is_empty() {
                    p {
                        "Check that the three files have the hashes above, then run this with the same version of the "
                        "program. Every figure must come out the same; only the times differ."
                    }
                    pre tabindex="0" { code { (command) } }
                }
                @if input.evidence.is_some() {
                    p {
                        "This page also carries its figures for programs. The following line reads them from the page, "
                        "repeats the test with the files that they name, and says whether all is as it is written here. "
                        code { "REPORT.html" } " stands for this page."
                    }
                    pre tabindex="0" { code { "sombrero verify REPORT.html" } }
                }
            }
        }
    }
}

fn footer(date: Option<&str>) -> Markup {
    html! {
        footer {
            p {
                "Made by sombrero " (env!("CARGO_PKG_VERSION"))
                @if let Some(date) = date { ", " (outside(date)) }
                "; the view in space is drawn by three.js " (viewer::THREE_VERSION)
                ". The method is that of E. Praun, H. Hoppe and A. Finkelstein, “Robust Mesh Watermarking”, SIGGRAPH 1999."
            }
        }
    }
}
