//! A contact sheet: a suspect, and pictures of the originals that it may have been made from.

use super::pictures::{Size, picture};
use super::words::{self, decimal, p_value};
use super::{PageError, named, outside};
use crate::evidence::PROGRAM;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use sombrero::mesh::Soup;
use sombrero::watermark::Identity;

/// A search in a catalogue, as its page shows it.
#[derive(Debug, Clone, Copy)]
pub struct Sheet<'a> {
    /// What the suspect is called.
    pub suspect: &'a str,
    /// Its shape.
    pub shape: &'a Soup,
    /// What the catalogue is called.
    pub catalogue: &'a str,
    /// The candidates, best first.
    pub candidates: &'a [SheetCandidate],
    /// A mark counts as found when p is at most this.
    pub threshold: f64,
    /// The number of tests that every p was corrected for.
    pub tests: usize,
}

/// An original that the suspect may have been made from.
#[derive(Debug, Clone)]
pub struct SheetCandidate {
    /// What it is called.
    pub name: String,
    /// How well its shape fits, from 0 to 1.
    pub score: f64,
    /// log10 p of the best of its keys; `None` when none was tested.
    pub log10_p: Option<f64>,
    /// Whose copy the suspect is, if that was found.
    pub named: Option<Identity>,
    /// Its shape; `None` when its file was not at hand.
    pub shape: Option<Soup>,
    /// The name of the file beside this page that has the report of the test, if there is one.
    pub report: Option<String>,
}

/// The sheet as one HTML page, which needs nothing but itself and runs no script.
///
/// # Errors
/// [`PageError`] when a picture cannot be encoded.
pub fn sheet(sheet: &Sheet<'_>) -> Result<String, PageError> {
    let found = sheet.candidates.iter().any(|candidate| candidate.named.is_some());
    let suspect = picture(sheet.shape, Size::Small)?;
    let plates = sheet.candidates.iter().map(plate).collect::<Result<Vec<_>, _>>()?;
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(super::viewer::content_policy(None));
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="robots" content="noindex";
                title { (headline(found)) " – " (sheet.suspect) }
                style { (PreEscaped(include_str!("style.css"))) }
            }
            body {
                main {
                    (verdict(sheet, found))
                    section {
                        h2 { "The suspect" }
                        div.gallery { (framed(Some(&suspect), sheet.suspect, html! { b { (outside(sheet.suspect)) } })) }
                    }
                    section {
                        h2 { "What it may have been made from" }
                        @if plates.is_empty() { p { "Nothing in the catalogue has a shape like it." } }
                        div.gallery { @for plate in &plates { (plate) } }
                    }
                }
                footer { p { (words::FOR_THE_OWNER) } p { "Made by " (PROGRAM) "." } }
            }
        }
    };
    Ok(page.into_string())
}

fn headline(found: bool) -> &'static str {
    if found { "A mark was found" } else { "No mark was found" }
}

fn verdict(sheet: &Sheet<'_>, found: bool) -> Markup {
    let named = sheet.candidates.iter().filter(|candidate| candidate.named.is_some());
    html! {
        header class=(if found { "found" } else { "not-found" }) {
            p.kicker { "Search in a catalogue" }
            h1 { (headline(found)) }
            p.lead {
                (outside(sheet.suspect)) " was looked for in " (outside(sheet.catalogue)) ". "
                @for candidate in named { "It carries a mark of " (outside(&candidate.name)) ". " }
                @if sheet.tests == 0 {
                    "No key was tested: the order is that of the shapes."
                } @else {
                    "Every p is the chance that any test of this search, " (sheet.tests)
                    " in all, matches as well by accident; found means that it is at most "
                    (p_value(sheet.threshold.log10())) "."
                }
            }
        }
    }
}

fn plate(candidate: &SheetCandidate) -> Result<Markup, PageError> {
    let SheetCandidate { name, score, log10_p, named: whose, shape, report } = candidate;
    let drawn = shape.as_ref().map(|shape| picture(shape, Size::Small)).transpose()?;
    let caption = html! {
        b { (outside(name)) } " score " (decimal(*score, 3))
        @if let Some(p) = log10_p { ", p " (p_value(*p)) }
        @if let Some(Identity { owner, recipient }) = whose {
            ". Copy of " (named(recipient)) ", by a key of " (named(owner)) "."
        }
        @if let Some(report) = report { " " a href=(report) { "Report of this test" } }
    };
    Ok(framed(drawn.as_deref(), name, caption))
}

fn framed(picture: Option<&str>, alternative: &str, caption: Markup) -> Markup {
    let [width, height] = Size::Small.pixels();
    html! {
        figure.plate {
            @if let Some(picture) = picture {
                img src=(picture) alt=(alternative) width=(width) height=(height) loading="lazy";
            } @else {
                p.faint { "No picture: the file was not at hand." }
            }
            figcaption { (caption) }
        }
    }
}
