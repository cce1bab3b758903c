//! Plots as SVG, each with a CSV of the same data. The bytes depend on the data only.

mod draw;

use super::{OutcomeError, csv, number};

/// How an axis maps values to places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences.
    Linear,
    /// Equal ratios; every value must be positive.
    Log,
}

/// An axis: its label carries the unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    pub(crate) label: String,
    pub(crate) scale: Scale,
}

impl Axis {
    /// Equal differences.
    pub fn linear(label: &str) -> Self {
        Self { label: label.into(), scale: Scale::Linear }
    }

    /// Equal ratios.
    pub fn log(label: &str) -> Self {
        Self { label: label.into(), scale: Scale::Log }
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A line through the points.
    Line,
    /// A line and a dot at each point.
    LineAndPoints,
    /// Dots.
    Points,
    /// A dashed line, for a bound or a reference.
    Dashed,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Series {
    pub label: String,
    pub style: Style,
    pub points: Vec<(f64, f64)>,
}

/// A plot: lines and points over two axes, or bars over named categories.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    pub(crate) name: String,
    pub(crate) caption: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: Vec<Series>,
    /// Names under the bars; empty for lines and points.
    pub(crate) categories: Vec<String>,
    pub(crate) machine: bool,
}

impl Plot {
    /// An empty plot of lines and points; `name` is its file name without extension.
    pub fn new(name: &str, caption: &str, x: Axis, y: Axis) -> Self {
        Self {
            name: name.into(),
            caption: caption.into(),
            x,
            y,
            series: Vec::new(),
            categories: Vec::new(),
            machine: false,
        }
    }

    /// An empty plot of bars; each [`Self::bars`] gives one height per category.
    pub fn bar_chart(name: &str, caption: &str, categories: &[&str], y: Axis) -> Self {
        let categories = categories.iter().map(|&category| category.to_owned()).collect();
        Self { categories, ..Self::new(name, caption, Axis::linear(""), y) }
    }

    /// Adds a series.
    pub fn series(mut self, label: &str, style: Style, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.series.push(Series { label: label.into(), style, points: points.into_iter().collect() });
        self
    }

    /// Adds one bar per category.
    pub fn bars(self, label: &str, heights: &[f64]) -> Self {
        let points: Vec<(f64, f64)> = heights.iter().enumerate().map(|(i, &height)| (i as f64, height)).collect();
        self.series(label, Style::Line, points)
    }

    /// Adds the dashed line y = y₀ (x/x₀)^`order` over the plot's range of x: straight between two logarithmic axes, where its slope is
    /// the theoretical order of convergence. Add it after the data.
    pub fn reference_order(self, label: &str, order: f64, through: (f64, f64)) -> Self {
        let xs = self.series.iter().flat_map(|series| series.points.iter().map(|point| point.0));
        let (low, high) = xs.fold((through.0, through.0), |(low, high), x| (low.min(x), high.max(x)));
        let at = |x: f64| (x, through.1 * libm::pow(x / through.0, order));
        self.series(label, Style::Dashed, [at(low), at(high)])
    }

    /// Says that the data depends on the machine: the plot goes to `timings/`.
    pub const fn machine(mut self) -> Self {
        self.machine = true;
        self
    }

    pub(crate) fn check(&self) -> Result<(), OutcomeError> {
        let error = |why: String| Err(OutcomeError::Plot { name: self.name.clone(), why });
        if self.series.iter().all(|series| series.points.is_empty()) {
            return error("it has no point".into());
        }
        for series in &self.series {
            if !self.categories.is_empty() && series.points.len() != self.categories.len() {
                let (bars, categories) = (series.points.len(), self.categories.len());
                return error(format!("`{}` has {bars} bars for {categories} categories", series.label));
            }
            for &(x, y) in &series.points {
                if !x.is_finite() || !y.is_finite() {
                    return error(format!("`{}` has a point ({x}, {y})", series.label));
                }
                if (self.x.scale == Scale::Log && x <= 0.0) || (self.y.scale == Scale::Log && y <= 0.0) {
                    return error(format!("`{}` has a point ({x}, {y}) on a logarithmic axis", series.label));
                }
            }
        }
        Ok(())
    }

    /// The data, one point per line.
    pub(crate) fn csv(&self) -> String {
        let bars = !self.categories.is_empty();
        let mut text = csv::line(&["series", if bars { "category" } else { &self.x.label }, &self.y.label]);
        for series in &self.series {
            for (i, &(x, y)) in series.points.iter().enumerate() {
                let x = if bars { self.categories[i].clone() } else { number::exact(x) };
                text += &csv::line(&[&series.label, &x, &number::exact(y)]);
            }
        }
        text
    }

    /// The drawing.
    ///
    /// # Errors
    /// For data that cannot be drawn.
    pub fn svg(&self) -> Result<String, OutcomeError> {
        draw::svg(self).map_err(|why| OutcomeError::Plot { name: self.name.clone(), why })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn convergence() -> Plot {
        let points = (1..6).map(|i| (f64::from(1 << i), 1.0 / f64::from(1 << (2 * i))));
        Plot::new("convergence", "", Axis::log("samples"), Axis::log("error"))
            .series("ours <b>", Style::LineAndPoints, points)
            .reference_order("order −2", -2.0, (2.0, 0.5))
    }

    #[test]
    fn the_reference_line_falls_with_its_order() {
        let plot = convergence();
        assert_eq!(plot.series[1].points, [(2.0, 0.5), (32.0, 0.5 / 256.0)]);
    }

    #[test]
    fn the_drawing_is_repeatable_and_escaped() {
        let svg = convergence().svg().unwrap();
        assert_eq!(svg, convergence().svg().unwrap());
        assert!(svg.starts_with("<svg") && svg.contains("ours &lt;b&gt;") && !svg.contains("<b>"));
        assert!(!svg.contains("NaN"));
    }

    #[test]
    fn every_kind_of_plot_is_drawn_with_its_data() {
        let bars = Plot::bar_chart("bars", "", &["Fig 1", "Fig 3"], Axis::linear("calls")).bars("ours", &[3.0, 4.0]);
        assert_eq!(bars.csv(), "series,category,calls\nours,Fig 1,3\nours,Fig 3,4\n");
        assert!(bars.svg().unwrap().contains("Fig 3"));
        let flat = Plot::new("flat", "", Axis::linear("x"), Axis::log("y")).series("c", Style::Points, [(1.0, 2.0)]);
        assert!(!flat.svg().unwrap().contains("NaN"));
    }

    #[test]
    fn a_tick_at_zero_says_zero() {
        let reach = 0.608_308_700_457_549_8;
        let plot = Plot::new("zero", "", Axis::linear("x"), Axis::linear("y")).series(
            "s",
            Style::Line,
            [(-reach, -0.3), (reach, 0.3)],
        );
        let svg = plot.svg().unwrap();
        assert!(svg.contains(">\n0\n<") && !svg.contains("×10⁻"), "{svg}");
    }

    #[test]
    fn data_that_cannot_be_drawn_is_refused() {
        let axes = || (Axis::linear("x"), Axis::log("y"));
        let plot = |points: &[(f64, f64)]| {
            let (x, y) = axes();
            Plot::new("p", "", x, y).series("s", Style::Line, points.to_vec()).check()
        };
        assert!(plot(&[(0.0, 1.0)]).is_ok());
        assert!(plot(&[]).is_err());
        assert!(plot(&[(0.0, 0.0)]).is_err());
        assert!(plot(&[(f64::NAN, 1.0)]).is_err());
        assert!(Plot::bar_chart("b", "", &["one"], Axis::linear("y")).bars("s", &[1.0, 2.0]).check().is_err());
    }
}
