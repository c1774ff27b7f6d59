//! How the answer came about: what was tried, how the suspect was moved, how long it took.

use super::motion;
use super::viewer::THREE_VERSION;
use super::words::{decimal, p_value, pair, percent};
use maud::{Markup, html};
use sombrero::{Alignment, Detection, Method, Part, Variant};

/// `side` is the largest side of the original, `program` the name of the one that made the detection.
pub(super) fn section(detection: &Detection, side: f64, program: &str) -> Markup {
    html! {
        section {
            h2 { "How it was tested" }
            (parameters(detection, program))
            h3 { "What was tried" }
            (variants(detection))
            h3 { "How the suspect was moved" }
            @if detection.variant.is_none() { p { "The suspect was not moved." } }
            @else if detection.parts.is_empty() { (alignment(detection.registration.as_ref(), side)) }
            @else { (parts(&detection.parts, side)) }
            h3 { "How long it took" }
            (timings(detection))
        }
    }
}

fn parameters(detection: &Detection, program: &str) -> Markup {
    html! {
        dl.pairs {
            (pair("Method", html! { (detection.method.name()) }))
            (pair("Threshold for p", p_value(detection.threshold.log10())))
            (pair("Ways of looking", html! { (detection.variants_counted) }))
            (pair("Program", html! { (program) }))
            (pair("View in space", html! { "three.js " (THREE_VERSION) }))
        }
    }
}

fn variants(detection: &Detection) -> Markup {
    let Some(winner) = detection.variant else {
        return html! { p { "None: the shapes alone say that the suspect shows something else, so nothing was compared." } };
    };
    let (tried, counted) = (detection.variants.len(), detection.variants_counted);
    html! {
        p {
            @if tried == 1 { "One way of looking was tried" }
            @else { (tried) " ways of looking were tried" }
            @if counted == 1 { "." }
            @else { "; p above is that of the best one, times " (counted) ", as many as were planned." }
        }
        div.scroll tabindex="0" role="region" aria-label="What was tried" {
            table {
                thead {
                    tr {
                        @for name in ["Aligned", "Compared", "Solved for too", "Test"] { th scope="col" { (name) } }
                        @for name in ["p alone", "Correlation"] { th.number scope="col" { (name) } }
                        th scope="col" { "Counts" }
                    }
                }
                tbody { @for variant in &detection.variants { (variant_row(detection.method, variant, winner)) } }
            }
        }
    }
}

fn compared(method: Method, resampling: bool) -> &'static str {
    match (method, resampling) {
        (Method::Robust, true) => "surfaces",
        (Method::Paper, true) => "vertices, resampled",
        (_, false) => "vertices",
    }
}

fn variant_row(method: Method, variant: &Variant, winner: Variant) -> Markup {
    let word = |yes: bool| if yes { "yes" } else { "no" };
    let counts = *variant == winner;
    html! {
        tr class=[counts.then_some("winner")] {
            td { (word(variant.registration)) }
            td {
                (compared(method, variant.resampling))
                @match variant.look { "mirrored" => ", mirrored", "parts" => ", part by part", _ => {} }
            }
            td { (variant.nuisance) }
            td { (variant.test) }
            td.number { (p_value(variant.log10_p)) }
            td.number { (decimal(variant.correlation, 3)) }
            td { @if counts { "this one" } }
        }
    }
}

fn alignment(alignment: Option<&Alignment>, side: f64) -> Markup {
    let Some(Alignment { matrix, rms, overlap, .. }) = alignment else {
        return html! { p { "The suspect was compared where it lies, without moving it." } };
    };
    html! {
        p {
            @if alignment.is_some_and(|alignment| alignment.mirrored) { "The suspect is a mirror image. " }
            "The suspect was moved onto the original" @if let Some(words) = motion::in_words(matrix, side) { ": " (words) }
            ". The two are then " (percent(rms / side)) " of the largest side apart (root mean square), and "
            (percent(*overlap)) " of the original’s surface has a counterpart on the suspect."
        }
        p { "This matrix moves it, points taken as columns:" }
        div.scroll tabindex="0" role="region" aria-label="The matrix" {
            table.matrix { tbody { @for row in matrix { tr { @for value in row { td.number { (decimal(*value, 6)) } } } } } }
        }
    }
}

/// Each part where it was found.
fn parts(parts: &[Part], side: f64) -> Markup {
    html! {
        p {
            "The suspect's parts were moved one by one, each onto the part of the original that it fits. What they say was "
            "summed up, and every way to place them counts. Parts are numbered from 0, in the order of the files."
        }
        div.scroll tabindex="0" role="region" aria-label="The parts" {
            table {
                thead {
                    tr {
                        th.number scope="col" { "Part" }
                        th.number scope="col" { "Found in" }
                        th.number scope="col" { "p by itself" }
                        th.number scope="col" { "Coverage" }
                        th scope="col" { "Moved" }
                    }
                }
                tbody {
                    @for part in parts {
                        tr {
                            td.number { (part.component) }
                            td.number { (part.suspect_component) }
                            td.number { (p_value(part.log10_p)) }
                            td.number { (percent(part.coverage)) }
                            td { (motion::in_words(&part.matrix, side).unwrap_or_default()) }
                        }
                    }
                }
            }
        }
    }
}

fn timings(detection: &Detection) -> Markup {
    html! {
        @if detection.seconds.0.is_empty() {
            p.timings { "No times were taken." }
        } @else {
            p.timings {
                @for (stage, seconds) in &detection.seconds.0 { (stage) " " (decimal(*seconds, 3)) " s, " }
                "together " (decimal(detection.seconds.total(), 3)) " s."
            }
        }
    }
}
