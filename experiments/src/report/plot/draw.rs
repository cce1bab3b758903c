//! Draws a plot with plotters. Every colour is one of the few below, so that the page's style sheet can restyle it in the dark.

use super::{Plot, Scale, Series, Style};
use crate::report::number;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::ops::Range;

/// Size of the drawing in pixels.
const SIZE: (u32, u32) = (600, 372);
/// plotters rounds places to whole pixels: we draw this many times larger and let the view box shrink it.
const FINE: i32 = 8;
const INK: RGBColor = RGBColor(0x22, 0x26, 0x2A);
const RULE: RGBColor = RGBColor(0xDD, 0xDF, 0xE1);
const SERIES: [RGBColor; 6] = [
    RGBColor(0x1F, 0x5F, 0x8B),
    RGBColor(0xB4, 0x4A, 0x2F),
    RGBColor(0x4A, 0x7D, 0x4E),
    RGBColor(0x7D, 0x55, 0x94),
    RGBColor(0xA6, 0x7C, 0x1A),
    RGBColor(0x5C, 0x66, 0x70),
];
const FONT: &str = "sans-serif";
/// plotters divides font sizes by this.
const POINT: f64 = 1.24;
const LEGEND_HEIGHT: i32 = 36 * FINE;
/// Share of a category's width that its bars fill.
const BAR_FILL: f64 = 0.7;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

pub(super) fn svg(plot: &Plot) -> Result<String, String> {
    let mut text = String::new();
    let fine = (SIZE.0 * FINE.unsigned_abs(), SIZE.1 * FINE.unsigned_abs());
    {
        let root = SVGBackend::with_string(&mut text, fine).into_drawing_area();
        root.fill(&WHITE).map_err(|error| error.to_string())?;
        legend(plot, &root)?;
        let below = root.margin(LEGEND_HEIGHT, 4 * FINE, 4 * FINE, 18 * FINE);
        let (x, y) = (x_range(plot), y_range(plot));
        match (plot.x.scale, plot.y.scale) {
            (Scale::Linear, Scale::Linear) => chart(plot, &below, x, y.clone(), y.start),
            (Scale::Linear, Scale::Log) => chart(plot, &below, x, y.clone().log_scale(), y.start),
            (Scale::Log, Scale::Linear) => chart(plot, &below, x.log_scale(), y.clone(), y.start),
            (Scale::Log, Scale::Log) => chart(plot, &below, x.log_scale(), y.clone().log_scale(), y.start),
        }?;
        root.present().map_err(|error| error.to_string())?;
    }
    let shown = |(width, height): (u32, u32)| format!("<svg width=\"{width}\" height=\"{height}\" ");
    Ok(text.replacen(&shown(fine), &shown(SIZE), 1))
}

fn font(pixels: u32) -> TextStyle<'static> {
    (FONT, f64::from(pixels) * POINT * f64::from(FINE)).into_font().color(&INK)
}

fn stroke(color: RGBColor, pixels: u32) -> ShapeStyle {
    color.stroke_width(pixels * FINE.unsigned_abs())
}

fn color(index: usize, series: &Series) -> RGBColor {
    if series.style == Style::Dashed { SERIES[5] } else { SERIES[index % 5] }
}

fn legend(plot: &Plot, root: &Area) -> Result<(), String> {
    let style = font(14).pos(Pos::new(HPos::Left, VPos::Center));
    let mut x = 64 * FINE;
    let y = 16 * FINE;
    for (i, series) in plot.series.iter().enumerate() {
        let color = color(i, series);
        let line = |from: i32, to: i32| PathElement::new([(x + from * FINE, y), (x + to * FINE, y)], stroke(color, 2));
        let dot = |at: i32| Circle::new((x + at * FINE, y), 4 * FINE, color.filled());
        let bar = || Rectangle::new([(x + 4 * FINE, y - 6 * FINE), (x + 16 * FINE, y + 6 * FINE)], color.filled());
        let drawn = match series.style {
            _ if !plot.categories.is_empty() => root.draw(&bar()),
            Style::Points => root.draw(&dot(11)),
            Style::Dashed => root.draw(&line(0, 9)).and_then(|()| root.draw(&line(14, 23))),
            Style::Line => root.draw(&line(0, 22)),
            Style::LineAndPoints => root.draw(&line(0, 22)).and_then(|()| root.draw(&dot(11))),
        };
        drawn
            .and_then(|()| root.draw(&Text::new(series.label.clone(), (x + 29 * FINE, y), style.clone())))
            .map_err(|error| error.to_string())?;
        // A guess at the width: 7.5 pixels per character at this size.
        let characters = i32::try_from(series.label.chars().count()).unwrap_or(40);
        x += (29 + 22) * FINE + characters * FINE * 15 / 2;
    }
    Ok(())
}

fn chart<X, Y>(plot: &Plot, area: &Area, x: X, y: Y, floor: f64) -> Result<(), String>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    let bars = !plot.categories.is_empty();
    let mut chart = ChartBuilder::on(area)
        .x_label_area_size(50 * FINE)
        .y_label_area_size(66 * FINE)
        .build_cartesian_2d(x, y)
        .map_err(|error| error.to_string())?;
    let tick_x = |value: &f64| tick(near_zero(plot.x.scale, plot, |point| point.0, *value));
    let tick_y = |value: &f64| tick(near_zero(plot.y.scale, plot, |point| point.1, *value));
    let mut mesh = chart.configure_mesh();
    mesh.axis_style(stroke(INK, 1))
        .bold_line_style(stroke(RULE, 1))
        .light_line_style(TRANSPARENT)
        .label_style(font(13))
        .axis_desc_style(font(14))
        .x_desc(plot.x.label.as_str())
        .y_desc(plot.y.label.as_str())
        .set_all_tick_mark_size(4 * FINE)
        .x_labels(8)
        .y_labels(7)
        .y_label_formatter(&tick_y);
    let drawn = if bars {
        mesh.disable_x_mesh().x_label_formatter(&|_| String::new()).draw()
    } else {
        mesh.x_label_formatter(&tick_x).draw()
    };
    drawn.map_err(|error| error.to_string())?;

    for (i, series) in plot.series.iter().enumerate() {
        let color = color(i, series);
        let line = || LineSeries::new(series.points.iter().copied(), stroke(color, 2));
        let dots = || series.points.iter().map(move |&point| Circle::new(point, 3 * FINE, color.filled()));
        let drawn = match series.style {
            _ if bars => {
                let width = BAR_FILL / plot.series.len() as f64;
                let left = -BAR_FILL / 2.0 + width * i as f64;
                let base = if plot.y.scale == Scale::Log { floor } else { 0.0 };
                let bar =
                    |&(x, y): &(f64, f64)| Rectangle::new([(x + left, base), (x + left + width, y)], color.filled());
                chart.draw_series(series.points.iter().map(bar)).map(drop)
            }
            Style::Line => chart.draw_series(line()).map(drop),
            Style::Points => chart.draw_series(dots()).map(drop),
            Style::LineAndPoints => {
                chart.draw_series(line()).map(drop).map_err(|error| error.to_string())?;
                chart.draw_series(dots()).map(drop)
            }
            Style::Dashed => chart
                .draw_series(DashedLineSeries::new(series.points.iter().copied(), 8 * FINE, 6 * FINE, stroke(color, 2)))
                .map(drop),
        };
        drawn.map_err(|error| error.to_string())?;
    }
    // Below the axis: places are relative to the area that holds the labels too, for a smaller one would clip them.
    let style = font(13).pos(Pos::new(HPos::Center, VPos::Top));
    let (left, top) = area.get_base_pixel();
    for (i, category) in plot.categories.iter().enumerate() {
        let (x, y) = chart.plotting_area().map_coordinate(&(i as f64, floor));
        let place = (x - left, y - top + 8 * FINE);
        area.draw(&Text::new(category.clone(), place, style.clone())).map_err(|error| error.to_string())?;
    }
    Ok(())
}

fn x_range(plot: &Plot) -> Range<f64> {
    if !plot.categories.is_empty() {
        return -0.5..plot.categories.len() as f64 - 0.5;
    }
    let (low, high) = extent(plot, |point| point.0);
    match plot.x.scale {
        _ if low < high => low..high,
        Scale::Linear => low - 1.0..high + 1.0,
        Scale::Log => low / 2.0..high * 2.0,
    }
}

fn y_range(plot: &Plot) -> Range<f64> {
    let (low, high) = extent(plot, |point| point.1);
    match plot.y.scale {
        Scale::Log => low / 1.5..high * 1.5,
        Scale::Linear if !plot.categories.is_empty() => {
            let margin = (high.max(0.0) - low.min(0.0)) * 0.05;
            low.min(0.0)..high.max(0.0) + if margin > 0.0 { margin } else { 1.0 }
        }
        Scale::Linear => {
            let margin = if low < high { (high - low) * 0.05 } else { 1.0 };
            low - margin..high + margin
        }
    }
}

fn extent(plot: &Plot, coordinate: impl Fn(&(f64, f64)) -> f64) -> (f64, f64) {
    let values = plot.series.iter().flat_map(|series| series.points.iter()).map(coordinate);
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// A tick of a linear axis, 0 where it is nothing beside the values drawn: ticks are counted up from the left, so the one at 0 is off
/// by their rounding.
fn near_zero(scale: Scale, plot: &Plot, of: impl Fn(&(f64, f64)) -> f64, tick: f64) -> f64 {
    let largest = plot.series.iter().flat_map(|series| &series.points).map(|point| of(point).abs()).fold(0.0, f64::max);
    if scale == Scale::Linear && tick.abs() < 1e-9 * largest { 0.0 } else { tick }
}

/// A tick's value without the noise of its computation: at most six significant digits, powers of ten for the extremes.
fn tick(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if rounded == 0.0 || (1e-3..1e6).contains(&rounded.abs()) {
        return number::exact(rounded).replace('-', "−");
    }
    let text = number::readable_power(rounded);
    text.strip_prefix("1×").map(str::to_owned).unwrap_or(text)
}
