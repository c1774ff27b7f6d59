//! Plots of numbers as SVG, drawn by plotters: panels side by side, each with axes, series and a legend.

use anyhow::anyhow;
use plotters::coord::Shift;
use plotters::prelude::*;
use std::ops::Range;
use std::path::Path;

/// Colours that eyes of all kinds tell apart (Okabe and Ito), in the order in which series take them.
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(70, 70, 70),
];
const FONT: &str = "sans-serif";

/// One axis.
pub(crate) struct Axis {
    pub(crate) label: &'static str,
    pub(crate) range: Range<f64>,
    /// Whether positions on it are decimal logarithms, which the ticks show as powers of ten.
    pub(crate) powers: bool,
    /// How many ticks at most.
    pub(crate) ticks: usize,
}

/// One line of a plot.
#[derive(Clone)]
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
    /// Vertical intervals as (x, low, high).
    pub(crate) intervals: Vec<(f64, f64, f64)>,
    /// Whether each point gets a dot.
    pub(crate) dots: bool,
}

/// One plot.
pub(crate) struct Panel {
    pub(crate) caption: &'static str,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: Vec<Series>,
    /// Whether a grey line shows where x and y are equal.
    pub(crate) diagonal: bool,
    /// Where the names of the series stand, if they do.
    pub(crate) legend: Option<SeriesLabelPosition>,
}

/// Draws panels side by side into an SVG file of `size` pixels.
pub(crate) fn write(path: &Path, size: (u32, u32), panels: &[Panel]) -> anyhow::Result<()> {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE).map_err(failed)?;
        for (area, panel) in root.split_evenly((1, panels.len())).iter().zip(panels) {
            draw(area, panel)?;
        }
        root.present().map_err(failed)?;
    }
    Ok(std::fs::write(path, text)?)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn draw(area: &Area<'_>, panel: &Panel) -> anyhow::Result<()> {
    let mut chart = ChartBuilder::on(area)
        .caption(panel.caption, (FONT, 17))
        .margin(12)
        .margin_right(22)
        .x_label_area_size(46)
        .y_label_area_size(64)
        .build_cartesian_2d(panel.x.range.clone(), panel.y.range.clone())
        .map_err(failed)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(225, 225, 225))
        .axis_style(RGBColor(90, 90, 90))
        .label_style((FONT, 13))
        .axis_desc_style((FONT, 15))
        .x_desc(panel.x.label)
        .y_desc(panel.y.label)
        .x_labels(panel.x.ticks)
        .y_labels(panel.y.ticks)
        .x_label_formatter(&|v| tick(*v, panel.x.powers))
        .y_label_formatter(&|v| tick(*v, panel.y.powers))
        .draw()
        .map_err(failed)?;
    if panel.diagonal {
        let ends = [panel.x.range.start, panel.x.range.end].map(|v| (v, v));
        chart.draw_series(LineSeries::new(ends, RGBColor(150, 150, 150))).map_err(failed)?;
    }
    for (series, color) in panel.series.iter().zip(COLORS.iter().cycle()) {
        let line = LineSeries::new(series.points.iter().copied(), color.stroke_width(2));
        let drawn = chart.draw_series(line).map_err(failed)?.label(&series.name);
        drawn.legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
        let bars = series
            .intervals
            .iter()
            .map(|&(x, low, high)| PathElement::new([(x, low), (x, high)], color.mix(0.75).stroke_width(2)));
        chart.draw_series(bars).map_err(failed)?;
        let dots = series.points.iter().filter(|_| series.dots);
        chart.draw_series(dots.map(|&at| Circle::new(at, 3, color.filled()))).map_err(failed)?;
    }
    let Some(position) = panel.legend.clone() else { return Ok(()) };
    chart
        .configure_series_labels()
        .position(position)
        .background_style(WHITE.mix(0.9))
        .border_style(RGBColor(200, 200, 200))
        .label_font((FONT, 13))
        .draw()
        .map_err(failed)
}

/// The words at a tick; none at a broken power of ten.
fn tick(value: f64, powers: bool) -> String {
    let whole = value.round();
    match powers {
        false => format!("{}", (value * 1000.0).round() / 1000.0 + 0.0),
        true if (value - whole).abs() > 1e-6 => String::new(),
        true => format!("10{}", (whole as i64).to_string().chars().map(superscript).collect::<String>()),
    }
}

fn superscript(character: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    character.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])
}

fn failed(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("the plot cannot be drawn: {error}")
}
