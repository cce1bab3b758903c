//! `terrain eval`: elevation, weight, gradient and slope bound at points, as JSON lines.

use super::{Point, SceneArguments, VerbError, numbers, print};
use clap::Args;
use glam::DVec2;
use serde::Serialize;
use std::path::{Path, PathBuf};
use terrain_model::bounds::{Region, THRESHOLD};
use terrain_model::dual::Dual;
use terrain_model::program::{BoundsEvaluator, Evaluator};

/// Half the side of the box of the slope bound, metres.
const HALF: f64 = 0.5;

/// Evaluates a layer at points, one JSON object a line: x, y, elevation, weight, gradient [gx, gy], in_domain (weight at
/// least 1/2) and slope_bound, over the box of 1 m by 1 m around the point.
///
/// Where the weight is 0 there is no elevation: elevation, gradient and slope_bound are null. Where the slope has no
/// bound, slope_bound is null and slope_bound_unbounded is true.
#[derive(Args, Debug)]
pub struct Eval {
    #[command(flatten)]
    scene: SceneArguments,
    /// A point, metres; may be repeated
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, required_unless_present = "points")]
    at: Vec<Point>,
    /// A file of points after those of --at: a line `x,y` each, blank lines and a heading passed over
    #[arg(long, value_name = "FILE.csv")]
    points: Option<PathBuf>,
}

#[derive(Serialize)]
struct Line {
    x: f64,
    y: f64,
    elevation: Option<f64>,
    weight: f64,
    gradient: Option<[f64; 2]>,
    in_domain: bool,
    slope_bound: Option<f64>,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    slope_bound_unbounded: bool,
}

impl Eval {
    /// Runs the verb.
    ///
    /// # Errors
    /// [`VerbError`]: the scene, the layer, or the file of points.
    pub fn run(&self) -> Result<(), VerbError> {
        let (_, program) = self.scene.load()?;
        let mut points: Vec<DVec2> = self.at.iter().map(|point| point.0).collect();
        if let Some(file) = &self.points {
            points.extend(read_points(file)?);
        }
        let mut evaluator = Evaluator::<Dual<f64, 2>>::new(&program);
        let mut bounds = BoundsEvaluator::new(&program);
        for p in points {
            let sample = evaluator.sample(&program, p);
            let here = sample.weight > 0.0;
            let slope = bounds.bounds(Region::rectangle(p - HALF, p + HALF)).slope;
            let line = Line {
                x: p.x,
                y: p.y,
                elevation: here.then_some(sample.elevation),
                weight: sample.weight,
                gradient: here.then_some(sample.gradient.to_array()),
                in_domain: sample.weight >= THRESHOLD,
                slope_bound: (here && slope.is_finite()).then_some(slope),
                slope_bound_unbounded: here && !slope.is_finite(),
            };
            print(&serde_json::to_string(&line).map_err(|error| VerbError::Other(error.to_string()))?)?;
        }
        Ok(())
    }
}

fn read_points(path: &Path) -> Result<Vec<DVec2>, VerbError> {
    let file = path.display();
    let text = std::fs::read_to_string(path).map_err(|error| {
        VerbError::Other(format!("{file}: {error}; expected a text file with a line `x,y` a point"))
    })?;
    let mut points = Vec::new();
    for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let heading = points.is_empty() && line.chars().next().is_some_and(char::is_alphabetic);
        match numbers(line) {
            Ok([x, y]) => points.push(DVec2::new(x, y)),
            Err(_) if heading && number == 0 => {}
            Err(problem) => return Err(VerbError::Other(format!("{file}:{}: {problem}", number + 1))),
        }
    }
    Ok(points)
}
