//! Curves that several experiments share: straight ridges, and random sets of curves with cracks.

use crate::genevaux2015::rays::Random;
use glam::DVec2;
use terrain_diffusion::curve::{ConstraintPoint, Curve, Elevation, Gradient, Noise, Side};

/// A straight curve that wants the same everywhere.
pub fn line(from: DVec2, to: DVec2, point: ConstraintPoint) -> Result<Curve, String> {
    let points = [0.0, 1.0].map(|place| ConstraintPoint { place, ..point }).to_vec();
    let control = vec![from, from.lerp(to, 1.0 / 3.0), from.lerp(to, 2.0 / 3.0), to];
    Curve::new(control, points).map_err(|error| error.to_string())
}

/// A crest at elevation 0 that falls away to both sides by `degrees` over `extent` metres.
pub fn crest(extent: f64, degrees: f64) -> ConstraintPoint {
    let side = Side { extent, angle: -degrees.to_radians() };
    ConstraintPoint {
        elevation: Some(Elevation { height: 0.0, radius: 0.0 }),
        gradient: Some(Gradient { left: side, right: side }),
        ..ConstraintPoint::default()
    }
}

/// What random curves are like.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Elevations only: Laplace fields.
    Levels,
    /// Ridges with slopes and noise.
    Ridges,
    /// The same, every fifth a crack without elevation.
    Cracks,
}

/// Side of the square on which random curves lie, metres.
pub const SIDE: f64 = 4000.0;

/// `count` cubic curves some 600 m long, the first `k` of which do not depend on `count`.
pub fn random(seed: u64, count: usize, kind: Kind) -> Result<Vec<Curve>, String> {
    let mut random = Random(seed);
    (0..count)
        .map(|k| {
            let mut place = |low: f64, high: f64| DVec2::new(random.range(low, high), random.range(low, high));
            let mut control = vec![place(0.0, SIDE)];
            for k in 0..3 {
                control.push(control[k] + place(-300.0, 300.0));
            }
            let (height, change) = (random.range(0.0, 800.0), random.range(-50.0, 50.0));
            let [left, right] =
                [0, 1].map(|_| Side { extent: random.range(60.0, 160.0), angle: random.range(-0.6, -0.1) });
            let noise = Noise { amplitude: random.range(0.0, 10.0), roughness: random.range(0.0, 1.0) };
            let crack = kind == Kind::Cracks && k % 5 == 4;
            // A crack's sides rise away from it.
            let sign = if crack { -1.0 } else { 1.0 };
            let side = |side: Side| Side { angle: sign * side.angle, ..side };
            let point = |place: f64| ConstraintPoint {
                place,
                elevation: (!crack).then_some(Elevation { height: height + place * change, radius: 10.0 }),
                gradient: (kind != Kind::Levels).then(|| Gradient { left: side(left), right: side(right) }),
                noise: Some(noise),
            };
            Curve::new(control, vec![point(0.0), point(1.0)]).map_err(|error| format!("random curve {k}: {error}"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_random_curves_begin_with_the_same_ones() {
        let (few, more) = (random(3, 4, Kind::Cracks).unwrap(), random(3, 9, Kind::Cracks).unwrap());
        assert!(few[..] == more[..4] && random(4, 4, Kind::Cracks).unwrap()[0] != few[0]);
        assert!(more[4].points()[0].elevation.is_none() && more[3].points()[0].elevation.is_some());
    }
}
