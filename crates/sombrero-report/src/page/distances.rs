//! How far the suspect is from the original, in numbers, words and colours.

use super::words::{count, percent};
use crate::report::Report;
use maud::{Markup, html};
use nalgebra::Point3;
use sombrero::render::{ColorMap, HeatMap};

/// How far each point of the original is from its place on the suspect, as a share of the largest side; NaN
/// where that is not known.
pub(super) struct Distances {
    shares: Vec<f64>,
    /// The known ones, ascending.
    known: Vec<f64>,
    missing: usize,
}

impl Distances {
    /// `None` when no point's place is known, or the original has no size to compare with.
    pub(super) fn new(report: &Report<'_>) -> Option<Self> {
        let side = report.original.largest_side();
        let soup = report.original.soup();
        let mut shares = vec![f64::NAN; soup.points.len()];
        for ((share, point), found) in shares.iter_mut().zip(&soup.points).zip(&report.detection.found) {
            *share = found.map_or(f64::NAN, |found| distance(point, &found) / side);
        }
        // Only what belongs to the surface counts.
        let used: Vec<f64> =
            shares.iter().zip(soup.used()).filter(|(_, used)| *used).map(|(s, _)| *s).collect();
        let mut known: Vec<f64> = used.iter().copied().filter(|share| share.is_finite()).collect();
        known.sort_by(f64::total_cmp);
        let missing = used.len() - known.len();
        (!known.is_empty()).then_some(Self { shares, known, missing })
    }

    /// One share a point of the original; NaN where none is known.
    pub(super) fn shares(&self) -> &[f64] {
        &self.shares
    }

    /// The colours of the whole original. The scale stands beside the picture, not in it.
    pub(super) fn heat_map(&self) -> HeatMap {
        HeatMap { range: Some((0.0, self.scale())), bar: false, ..HeatMap::new(self.shares.clone()) }
    }

    fn max(&self) -> f64 {
        self.known.last().copied().unwrap_or(0.0)
    }

    fn median(&self) -> f64 {
        self.known.get(self.known.len() / 2).copied().unwrap_or(0.0)
    }

    /// What the last colour means. Any will do when nothing moved, but the range needs an extent.
    pub(super) fn scale(&self) -> f64 {
        if self.max() > 0.0 { self.max() } else { 1.0 }
    }

    pub(super) fn in_words(&self) -> String {
        if self.max() == 0.0 {
            return format!("No point has moved at all.{}", self.missing_in_words());
        }
        let rms = (self.known.iter().map(|s| s * s).sum::<f64>() / self.known.len() as f64).sqrt();
        format!(
            "Dark violet is no distance, bright yellow is the largest, {}. Half of the points are within {}; the root \
             mean square is {}.{}",
            percent(self.max()),
            percent(self.median()),
            percent(rms),
            self.missing_in_words()
        )
    }

    fn missing_in_words(&self) -> String {
        match self.missing {
            0 => String::new(),
            1 => " One point was not found on the suspect; the surface around it stays clay.".into(),
            n => format!(
                " {} points were not found on the suspect; the surface around them stays clay.",
                count(n)
            ),
        }
    }

    /// The scale of colours.
    pub(super) fn bar(&self) -> Markup {
        let stops: Vec<String> = (0..=8)
            .map(|step| color(f64::from(step) / 8.0))
            .map(|[r, g, b]| format!("rgb({r},{g},{b})"))
            .collect();
        let ticks = [0.0, 0.5, 1.0].map(|share| percent(share * self.max()));
        html! {
            div.bar {
                div style={ "background:linear-gradient(to right," (stops.join(",")) ")" } {}
                p { @for tick in ticks { span { (tick) } } }
            }
        }
    }
}

/// The colour of a share of the scale.
pub(super) fn color(share: f64) -> [u8; 3] {
    ColorMap::Viridis.color(share)
}

/// The distance, or NaN when it is not finite.
fn distance(a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    let length = (b - a).norm();
    if length.is_finite() { length } else { f64::NAN }
}
