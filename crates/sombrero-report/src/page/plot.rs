//! The scatter plot of inserted against extracted coefficients, as SVG.

use super::words::decimal;
use maud::{Markup, html};
use sombrero::stats::Statistic;

/// Side of the square picture in its own units.
const SIDE: f64 = 440.0;
/// Left, top, right and bottom of the square in which points lie.
const FRAME: [f64; 4] = [54.0, 10.0, 430.0, 386.0];
/// Above so many points they are drawn small.
const MANY: usize = 300;

/// Pairs of coefficients, sorted by what the test did with them.
pub(super) struct Plot {
    used: Vec<[f64; 2]>,
    dropped: Vec<[f64; 2]>,
    missing: Vec<f64>,
    /// Extracted coefficients beyond this were dropped; `None` when all were kept.
    limit: Option<f64>,
    /// Both axes go from minus this to this.
    reach: f64,
}

impl Plot {
    /// The correlation's test drops extracted coefficients of unusual size, the ellipsoid's keeps all.
    pub(super) fn new(inserted: &[f64], extracted: &[Option<f64>], test: Option<Statistic>) -> Self {
        let limit = test.and_then(|test| test.outlier_threshold);
        let mut plot = Self { used: vec![], dropped: vec![], missing: vec![], limit, reach: 3.0 };
        for (&w, e) in inserted.iter().zip(extracted).filter(|(w, _)| w.is_finite()) {
            match e.filter(|e| e.is_finite()) {
                None => plot.missing.push(w),
                Some(e) if limit.is_some_and(|limit| e.abs() > limit) => plot.dropped.push([w, e]),
                Some(e) => plot.used.push([w, e]),
            }
            // Gaussian numbers do not go beyond 6; others are drawn at the edge.
            plot.reach = plot.reach.max(w.abs().ceil()).min(6.0);
        }
        plot
    }

    fn x(&self, value: f64) -> f64 {
        let [left, _, right, _] = FRAME;
        left + (right - left) * self.share(value)
    }

    fn y(&self, value: f64) -> f64 {
        let [_, top, _, bottom] = FRAME;
        bottom - (bottom - top) * self.share(value)
    }

    /// Place along an axis from 0 to 1; what lies beyond stays at the edge.
    fn share(&self, value: f64) -> f64 {
        (0.5 + 0.5 * value / self.reach).clamp(0.0, 1.0)
    }

    /// The picture with its description for those who do not see it.
    pub(super) fn svg(&self, correlation: f64) -> Markup {
        html! {
            svg viewBox={ "0 0 " (SIDE) " " (SIDE) } role="img" aria-labelledby="plot-title plot-text" {
                title id="plot-title" { "Extracted against inserted coefficients" }
                desc id="plot-text" { (self.description(correlation)) }
                (self.axes())
                (self.points())
            }
        }
    }

    fn description(&self, correlation: f64) -> String {
        let shape = match correlation {
            c if c >= 0.9 => "lie close to a rising line",
            c if c >= 0.4 => "lean towards a rising line",
            _ => "form no rising line",
        };
        let (reach, rho) = (self.reach, decimal(correlation, 3));
        format!(
            "Scatter plot: inserted coefficients from left to right, extracted ones from bottom to top, both from \
             −{reach} to {reach} standard deviations. The points {shape}; their correlation is {rho}. {}",
            self.summary()
        )
    }

    /// How many points there are of each kind.
    pub(super) fn summary(&self) -> String {
        let total = self.used.len() + self.dropped.len() + self.missing.len();
        let mut text = format!("Of {total} coefficients {} were compared", self.used.len());
        if let (Some(limit), false) = (self.limit, self.dropped.is_empty()) {
            let dropped = self.dropped.len();
            text += &format!(", {dropped} dropped because they are larger than ±{limit} on the suspect");
        }
        if !self.missing.is_empty() {
            text +=
                &format!(", {} missing because their part of the surface was not found", self.missing.len());
        }
        text += ".";
        if self.used.iter().chain(&self.dropped).any(|[w, e]| w.abs().max(e.abs()) > self.reach) {
            text += " Points beyond the frame are drawn at its edge.";
        }
        text
    }

    fn axes(&self) -> Markup {
        let [left, top, right, bottom] = FRAME;
        let (middle_x, middle_y) = (0.5 * (left + right), 0.5 * (top + bottom));
        let reach = self.reach as i32;
        let ticks = (-reach..=reach).map(f64::from);
        html! {
            rect.frame x=(left) y=(top) width=(right - left) height=(bottom - top) {}
            @for tick in ticks {
                path.grid d={ "M" (px(self.x(tick))) " " (top) "V" (bottom) "M" (left) " " (px(self.y(tick))) "H" (right) } {}
                text x=(px(self.x(tick))) y=(bottom + 18.0) text-anchor="middle" { (decimal(tick, 0)) }
                text x=(left - 8.0) y=(px(self.y(tick) + 4.0)) text-anchor="end" { (decimal(tick, 0)) }
            }
            @for limit in self.limit.iter().flat_map(|limit| [-limit, *limit]) {
                path.limit d={ "M" (left) " " (px(self.y(limit))) "H" (right) } {}
            }
            path.diagonal d={ "M" (left) " " (bottom) "L" (right) " " (top) } {}
            text.label x=(middle_x) y=(SIDE - 8.0) text-anchor="middle" { "inserted, w (standard deviations)" }
            text.label transform={ "translate(16 " (middle_y) ") rotate(-90)" } text-anchor="middle" {
                "extracted, w* (standard deviations)"
            }
        }
    }

    fn points(&self) -> Markup {
        let total = self.used.len() + self.dropped.len() + self.missing.len();
        let size = if total > MANY { 2.0 } else { 4.0 };
        html! {
            @for w in &self.missing {
                path.missing d={ "M" (px(self.x(*w))) " " (FRAME[3]) "v-12" } {}
            }
            @for [w, e] in &self.dropped { (cross(self.x(*w), self.y(*e), size)) }
            @for [w, e] in &self.used {
                circle.used cx=(px(self.x(*w))) cy=(px(self.y(*e))) r=(size) {}
            }
        }
    }

    /// What the signs mean; only those that appear.
    pub(super) fn legend(&self) -> Markup {
        let circle = html! { circle.sample cx="8" cy="8" r="4" {} };
        let limit = self.limit.map_or(String::new(), |limit| limit.to_string());
        html! {
            ul.legend {
                li { (swatch(circle)) "compared" }
                @if !self.dropped.is_empty() {
                    li { (swatch(cross(8.0, 8.0, 4.0))) "dropped, beyond ±" (limit) }
                }
                @if !self.missing.is_empty() {
                    li { (swatch(html! { path.missing d="M8 14v-12" {} })) "missing on the suspect" }
                }
                li { (swatch(html! { path.diagonal d="M1 15L15 1" {} })) "perfect match" }
                @if self.limit.is_some() {
                    li { (swatch(html! { path.limit d="M0 8H16" {} })) "±" (limit) ", beyond which the test drops" }
                }
            }
        }
    }
}

fn swatch(content: Markup) -> Markup {
    html! { svg.swatch viewBox="0 0 16 16" aria-hidden="true" { (content) } }
}

fn cross(x: f64, y: f64, size: f64) -> Markup {
    let (start_x, start_y, step) = (px(x - size), px(y - size), 2.0 * size);
    html! {
        path.dropped d={ "M" (start_x) " " (start_y) "l" (step) " " (step) "m0 -" (step) "l-" (step) " " (step) } {}
    }
}

/// A coordinate, to a tenth of a unit.
fn px(value: f64) -> String {
    format!("{value:.1}")
}
