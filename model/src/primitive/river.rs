//! Rivers (Génevaux 2015 §4.1): curves whose cross-section follows from the kind of river. A braided river is one curve with
//! several channels; a confluence is a blend of several rivers.

use super::curve::{Curve, PathFile, path_of};
use crate::falloff::wyvill;
use crate::profile::{Knot, Section};
use crate::scene::{Point3, Positive, Scope};
use crate::spline::Path;
use serde::Deserialize;

/// What a river is like; the paper names stream, river, meander and main stem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Narrow, between steep banks.
    Stream,
    /// Wider, with a level strip on both sides.
    River,
    /// Slow, in a wide flood plain.
    Meander,
    /// The widest: what the others flow into.
    MainStem,
    /// Several channels between bars, in one bed.
    Braided,
}

/// One channel of a bed: its middle and its width, in parts of the width of the bed, and the height of its bottom in parts
/// of the depth.
type Channel = (f64, f64, f64);

/// The measures of a kind, metres.
#[derive(Clone, Copy, Debug)]
pub struct Measures {
    /// Which kind.
    pub kind: Kind,
    /// From bank to bank, at the bottom.
    pub width: f64,
    /// From the bottom to the top of the banks.
    pub depth: f64,
    /// Horizontal width of a bank.
    pub bank: f64,
    /// Width of the strip beside the river that belongs to it.
    pub plain: f64,
    /// How far that strip rises.
    pub rise: f64,
    /// The channels of the bed.
    pub channels: &'static [Channel],
}

const ONE: &[Channel] = &[(0.0, 1.0, 0.0)];

/// The kinds of rivers.
pub const KINDS: [Measures; 5] = [
    Measures { kind: Kind::Stream, width: 3.0, depth: 1.5, bank: 4.0, plain: 8.0, rise: 3.0, channels: ONE },
    Measures { kind: Kind::River, width: 14.0, depth: 3.0, bank: 8.0, plain: 24.0, rise: 4.0, channels: ONE },
    Measures { kind: Kind::Meander, width: 20.0, depth: 2.5, bank: 8.0, plain: 60.0, rise: 2.0, channels: ONE },
    Measures { kind: Kind::MainStem, width: 60.0, depth: 6.0, bank: 20.0, plain: 80.0, rise: 6.0, channels: ONE },
    Measures {
        kind: Kind::Braided,
        width: 70.0,
        depth: 3.0,
        bank: 10.0,
        plain: 40.0,
        rise: 3.0,
        channels: &[(-0.38, 0.24, 0.1), (-0.02, 0.2, 0.0), (0.36, 0.28, 0.2)],
    },
];

/// Height of the bars between channels, in parts of the depth.
const BAR: f64 = 0.55;

/// A river from its source to its mouth.
#[derive(Clone, Debug)]
pub struct River {
    /// What it is like.
    pub kind: Kind,
    /// Its course; z is the elevation of its bed and never rises.
    pub path: Path,
    /// Width of the bed, metres; that of its kind if `None`. Banks and plain grow along.
    pub width: Option<f64>,
    /// Depth of the bed, metres; that of its kind if `None`.
    pub depth: Option<f64>,
}

/// A river in a scene file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    kind: Kind,
    #[serde(default)]
    points: Vec<Point3>,
    #[serde(default)]
    path: Option<PathFile>,
    #[serde(default)]
    width: Option<Positive>,
    #[serde(default)]
    depth: Option<Positive>,
}

impl File {
    pub(crate) fn build(&self, _: &mut Scope<'_>) -> Result<Curve, String> {
        // Points of a river are joined smoothly.
        let path = match path_of(&self.points, self.path.as_ref())? {
            Path::Polyline(points) if self.path.is_none() => Path::Smooth(points),
            path => path,
        };
        River { kind: self.kind, path, width: self.width.map(f64::from), depth: self.depth.map(f64::from) }.curve()
    }
}

impl River {
    /// The curve that it is.
    ///
    /// # Errors
    /// When a point lies higher than the one before.
    pub fn curve(&self) -> Result<Curve, String> {
        let points = self.path.points();
        if let Some(k) = points.windows(2).position(|p| p[1].z > p[0].z) {
            return Err(format!(
                "the river rises from point {} (z = {}) to point {} (z = {}); expected at most {} there: points run downstream",
                k + 1,
                points[k].z,
                k + 2,
                points[k + 1].z,
                points[k].z
            ));
        }
        let measures = self.measures();
        let Measures { width, bank, plain, .. } = measures;
        let edge = 0.5 * width + bank;
        let radius = 1.15 * (edge + plain);
        let sections = vec![Section { at: 0.0, profile: profile(&measures) }];
        // A replacement takes the river alone up to the top of its banks.
        let weight = 1.02 / wyvill((edge / radius) * (edge / radius));
        let joint = 0.25 * width.min(radius);
        Ok(Curve { weight, joint, sections, tolerance: 0.05 * width, ..Curve::new(self.path.clone(), radius, vec![]) })
    }
    fn measures(&self) -> Measures {
        let mut measures = KINDS.into_iter().find(|m| m.kind == self.kind).unwrap_or(KINDS[0]);
        if let Some(width) = self.width {
            let scale = width / measures.width;
            (measures.width, measures.bank, measures.plain) = (width, measures.bank * scale, measures.plain * scale);
        }
        measures.depth = self.depth.unwrap_or(measures.depth);
        measures
    }
}

/// The cross-section from the outer edge of the left plain, which is at negative distances, to that of the right one.
fn profile(m: &Measures) -> Vec<Knot> {
    let edge = 0.5 * m.width + m.bank;
    let slope = m.rise / m.plain;
    let mut knots = vec![
        Knot { distance: -edge - m.plain, height: m.depth + m.rise, slope: -slope },
        Knot { distance: -edge, height: m.depth, slope: -slope },
    ];
    let flat = |distance: f64, height: f64| Knot { distance, height, slope: 0.0 };
    let mut bar: Option<f64> = None;
    for &(middle, width, raised) in m.channels {
        let (from, to) = ((middle - 0.5 * width) * m.width, (middle + 0.5 * width) * m.width);
        knots.extend(bar.map(|end| flat(0.5 * (end + from), BAR * m.depth)));
        knots.extend([flat(from, raised * m.depth), flat(to, raised * m.depth)]);
        bar = Some(to);
    }
    knots.push(Knot { distance: edge, height: m.depth, slope });
    knots.push(Knot { distance: edge + m.plain, height: m.depth + m.rise, slope });
    knots
}
