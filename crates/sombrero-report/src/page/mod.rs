//! A report as one HTML page that people can keep, print and hand on.
//!
//! The page needs nothing but itself: pictures are PNG in data URIs, the plot is SVG, and one script, which is part of
//! this crate and of every page, lets the shapes be turned. Without it the page says all the same. A content policy in
//! the page forbids browsers to load anything and to run any other script. Text from outside is escaped by the
//! template engine wherever it appears, and isolated, so that a file name written from right to left cannot turn a
//! sentence round. The same report gives the same bytes, so that a page can be made again from its record and the
//! files, and compared: nothing is in it that is not in [`Report`], not even the version of the program that runs.

mod course;
mod decimate;
mod distances;
mod lone;
mod motion;
mod pictures;
mod plot;
mod scene;
mod shapes;
mod sheet;
mod viewer;
mod words;

#[cfg(test)]
mod tests;

use crate::evidence::FileHash;
use crate::record::{element, record};
use crate::report::Report;
pub use lone::view;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use pictures::Pictures;
use plot::Plot;
use scene::Scene;
use shapes::Shapes;
pub use sheet::{Sheet, SheetCandidate, sheet};
use sombrero::Detection;
use sombrero::render::ImageError;
use sombrero::watermark::Key;
use thiserror::Error;
use words::{count, decimal, odds, p_value, pair, percent};

/// Why there is no page.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PageError {
    /// A picture cannot be stored.
    #[error("a picture of the report cannot be made: {0}")]
    Picture(#[from] ImageError),
}

/// The whole page as HTML, with the [record](record()) in it.
///
/// # Errors
/// [`PageError`] when a picture cannot be encoded.
pub fn page(report: &Report<'_>) -> Result<String, PageError> {
    let shapes = Shapes::new(report);
    let pictures = Pictures::new(&shapes)?;
    let scene = Scene::new(&shapes);
    let test = report.detection.variant.map(|variant| variant.test);
    let plot = Plot::new(&report.key.watermark, &report.detection.extracted, test);
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            (head(report, scene.as_ref()))
            body {
                main {
                    (verdict(report))
                    (figures(report.detection))
                    (notes(report.detection))
                    (coefficients(report.detection, &plot))
                    (in_space(report, &shapes, &pictures, scene.as_ref()))
                    (meaning(report.detection))
                    (files(report))
                    (parameters(report))
                    (course::section(report.detection, report.original.largest_side(), &report.evidence.program))
                    (repeat(report))
                }
                (footer(&report.evidence.program))
                (PreEscaped(element(&record(report))))
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

fn head(report: &Report<'_>, scene: Option<&Scene>) -> Markup {
    html! {
        head {
            meta charset="utf-8";
            meta http-equiv="Content-Security-Policy" content=(viewer::content_policy(scene));
            meta name="viewport" content="width=device-width, initial-scale=1";
            meta name="color-scheme" content="light dark";
            meta name="robots" content="noindex";
            title { (headline(report.detection.detected)) " – " (report.evidence.files.suspect.path) }
            style { (PreEscaped(include_str!("style.css"))) }
        }
    }
}

fn verdict(report: &Report<'_>) -> Markup {
    let Detection { detected, log10_p, .. } = *report.detection;
    html! {
        header class=(if detected { "found" } else { "not-found" }) {
            p.kicker { "Watermark report" }
            h1 { (headline(detected)) }
            p.lead {
                (outside(&report.evidence.files.suspect.path))
                @if detected { " carries the mark that " } @else { " does not measurably carry the mark that " }
                (outside(&report.evidence.files.key.path)) " describes. The chance that an unmarked mesh would match as well is "
                (odds(log10_p)) ". " (outside(&report.claim.sentence()))
            }
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
                "The probability is that of one try: one key that was fixed before the suspect was seen, and one suspect. "
                "Somebody who wants to deceive can make keys until one fits by chance, and hold each against every public "
                "model; a key costs him a known amount of computing. The sentence at the head says how many keys and "
                "suspects were counted. A trusted timestamp that is older than the suspect leaves him only those keys that "
                "were stamped before."
            }
            @if detection.log10_p < words::BEYOND_CHANCE {
                p {
                    "At so small a probability chance is no longer the doubt that matters: a mistake in handling files or "
                    "keys is far more likely, and the hashes below are there to rule it out."
                }
            }
            p {
                "This page holds the mark’s coefficients, nearly all that the key keeps secret: with them the mark can be "
                "taken out, or put into other meshes. Whoever doubts it is better shown the verdict than the page."
            }
        }
    }
}

fn files(report: &Report<'_>) -> Markup {
    let files = &report.evidence.files;
    let files = [("Original", &files.original), ("Suspect", &files.suspect), ("Key", &files.key)];
    html! {
        section {
            h2 { "Files" }
            dl.files {
                @for (role, FileHash { path, sha256 }) in files {
                    div {
                        dt { (role) }
                        dd { (outside(path)) }
                        dd.hash { span { "SHA-256 " } code { (sha256) } }
                    }
                }
            }
        }
    }
}

fn parameters(report: &Report<'_>) -> Markup {
    let Key { identity, parameters, .. } = report.key;
    let soup = report.original.soup();
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

/// The shapes in space: to be turned, and as pictures.
fn in_space(report: &Report<'_>, shapes: &Shapes<'_>, pictures: &Pictures, scene: Option<&Scene>) -> Markup {
    let moved = report.detection.registration.is_some();
    html! {
        section {
            h2 { "The shapes" }
            @if let Some(scene) = scene { (viewer::view(scene, shapes.distances.as_ref(), moved)) }
            (pictures.gallery(shapes, moved))
        }
    }
}

fn repeat(report: &Report<'_>) -> Markup {
    html! {
        section {
            h2 { "To repeat the test" }
            p {
                "Check that the three files have the hashes above, then run this with the same version of the "
                "program. Every figure must come out the same; only the times differ."
            }
            pre tabindex="0" { code { (report.evidence.command()) } }
            p {
                "This page also carries its figures for programs. With the three files beside it, the following line "
                "repeats the test, makes the page again, and says whether every sign of it is as it is here. "
                code { "REPORT.html" } " stands for this page."
            }
            pre tabindex="0" { code { "sombrero verify REPORT.html" } }
        }
    }
}

fn footer(program: &str) -> Markup {
    html! {
        footer {
            p { (words::FOR_THE_OWNER) }
            p {
                "Made by " (program)
                "; the view in space is drawn by three.js " (viewer::THREE_VERSION)
                ". The method is that of E. Praun, H. Hoppe and A. Finkelstein, “Robust Mesh Watermarking”, SIGGRAPH 1999."
            }
        }
    }
}
