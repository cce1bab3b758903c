//! A volcano in the sea (Fig. 12): a shore, a rim with the crater inside, the crater's floor, and spurs from the rim to capes.

use super::relief::{Ridge, level_ring};
use super::{Drawn, Slope};
use crate::curve::Elevation;
use glam::DVec2;
use serde::Deserialize;

/// See the module. It has 3 rings and one curve for each spur.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Island {
    /// Of the crater.
    pub centre: DVec2,
    /// From the centre to a cape; a bay lies a tenth nearer.
    pub shore: f64,
    /// How far from the shore the sea bed falls, and by how much.
    pub bed: (f64, f64),
    /// From the centre to the rim.
    pub rim: f64,
    /// Elevation of the rim above the sea.
    pub height: f64,
    /// Depth of the crater below the rim.
    pub crater: f64,
    /// Ridges from the rim to the capes, at least 3, the first to the east.
    pub spurs: u32,
    /// (A, R) of the rim and the spurs.
    #[serde(default)]
    pub noise: Option<(f64, f64)>,
}

impl Island {
    pub(super) fn draw(&self) -> Result<Vec<Drawn>, String> {
        let &Island { centre, shore, rim, height, crater, spurs, .. } = self;
        if !(0.0 < rim && rim < 0.8 * shore) {
            return Err(format!("a rim at {rim} m: expected one above 0 and below 0.8 of the shore's {shore} m"));
        }
        if !(3..=64).contains(&spurs) {
            return Err(format!("an island with {spurs} spurs: expected 3 to 64"));
        }
        let turn = |part: f64| {
            let angle = part * std::f64::consts::TAU;
            DVec2::new(libm::cos(angle), libm::sin(angle))
        };
        let ring = |count: u32, radius: &dyn Fn(u32) -> f64| -> Vec<DVec2> {
            (0..count).map(|k| centre + turn(f64::from(k) / f64::from(count)) * radius(k)).collect()
        };
        let level = |height: f64| Elevation { height, radius: 0.0 };
        // Rings run counter-clockwise: the inside is to the left.
        let coast = ring(2 * spurs, &|k| if k % 2 == 0 { shore } else { 0.9 * shore });
        let foot = Slope::rising(0.15 * shore, 0.05 * height);
        let bed = Slope::rising(self.bed.0, -self.bed.1);
        let wall = Slope::rising(0.45 * rim, -0.8 * crater);
        let flank = Slope::rising(0.3 * (shore - rim), -0.35 * height);
        let mut curves = vec![
            level_ring(coast, level(0.0), (foot, bed), Some((0.0, 0.0))),
            level_ring(ring(8, &|_| rim), level(height), (wall, flank), self.noise),
            level_ring(ring(6, &|_| 0.4 * rim), level(height - crater), Default::default(), None),
        ];
        for k in 0..spurs {
            let away = turn(f64::from(k) / f64::from(spurs));
            // Concave, as lava that thins out: the elevations at the quarters of the way.
            let at = |part: f64| {
                let radius = rim + part * (0.95 * shore - rim);
                let elevation = height * (1.0 - part) * (1.0 - 0.6 * part) + 0.02 * height * part;
                (centre + away * radius).extend(elevation)
            };
            // A twelfth of the way to the next spur, on the ground half way out.
            let reach = std::f64::consts::TAU * 0.5 * (rim + shore) / f64::from(12 * spurs);
            let side = Slope(reach, -30.0);
            let points = [0.0, 0.25, 0.5, 1.0].map(at).to_vec();
            curves.push(Ridge { points, radius: 0.0, left: side, right: side, taper: 1.0, noise: self.noise }.draw()?);
        }
        Ok(curves)
    }
}
