//! A heightfield made a volume (Paris 2019 §5.1): the surface field, the prism that bounds it, and their intersection,
//! three nodes of the tree.

use super::outline::OutlineError;
use super::prism::Prism;
use super::sigmoid::Sigmoid;
use super::surface::{Distance, Surface};
use super::volume::Volume;
use crate::field::THRESHOLD;
use glam::DVec2;
use std::sync::Arc;
use terrain_model::grid::Grid;

/// Why a heightfield cannot become a volume.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HeightfieldError {
    /// Samples without elevation.
    #[error("{count} samples have no elevation: fill or crop them first")]
    Holes {
        /// How many.
        count: usize,
    },
    /// Degrees where metres are needed.
    #[error("the grid is geographic: convert it to metres first (terrain convert --local-metres)")]
    Geographic,
    /// Fewer than 2 × 2 samples.
    #[error("a grid of {width} × {height} samples: expected at least 2 × 2")]
    Small {
        /// Samples along x.
        width: usize,
        /// Samples along y.
        height: usize,
    },
    /// A radius that the sigmoid or the domain does not allow.
    #[error("falloff radius {radius} m: expected a positive number below {limit} m")]
    Radius {
        /// What was asked, metres.
        radius: f64,
        /// What the domain's width and the sigmoid allow, metres.
        limit: f64,
    },
    /// A floor above the lowest elevation.
    #[error("floor at {floor} m: expected {limit} m or less, R below the lowest elevation")]
    Floor {
        /// What was asked, metres.
        floor: f64,
        /// The lowest elevation less R, metres.
        limit: f64,
    },
    /// A corner of the domain where the grid has no samples.
    #[error(
        "corner {corner} of ring {ring} of the domain is at {point}: expected a point within the grid, {low} to {high}; clip the ring"
    )]
    Outside {
        /// From 0.
        ring: usize,
        /// Its position on the ring, from 0.
        corner: usize,
        /// Where it is, metres.
        point: DVec2,
        /// The grid's low corner, metres.
        low: DVec2,
        /// The grid's high corner, metres.
        high: DVec2,
    },
    /// A domain that has no prism.
    #[error(transparent)]
    Domain(#[from] OutlineError),
}

/// How a heightfield becomes a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Implicitisation {
    /// σ.
    pub sigmoid: Sigmoid,
    /// Which distance to the surface.
    pub distance: Distance,
    /// R, metres: at least two cells of the mesh that will be made.
    pub radius: f64,
    /// Elevation of the floor, metres; R below the lowest sample or lower.
    pub floor: f64,
}

impl Implicitisation {
    /// The defaults: the unit-free sigmoid of the normalised distance, the floor 2R below the lowest sample.
    pub fn of(grid: &Grid<f32>, radius: f64) -> Implicitisation {
        let lowest = grid.values().iter().copied().fold(f32::INFINITY, f32::min);
        let floor = f64::from(lowest) - 2.0 * radius;
        Implicitisation { sigmoid: Sigmoid::default(), distance: Distance::default(), radius, floor }
    }

    /// min(f_T, f_P) over the rectangle of `grid`, elevations in metres.
    ///
    /// # Errors
    /// A [`HeightfieldError`] says what is wrong with grid, radius or floor.
    pub fn volume(&self, grid: &Grid<f32>) -> Result<Volume, HeightfieldError> {
        let Implicitisation { floor, radius, .. } = *self;
        let surface = self.surface(grid)?;
        let (low, high) = grid.bounds();
        let limit = surface.elevations().lo() - radius;
        let prism = Prism::new(low, high, floor, radius).ok_or(HeightfieldError::Floor { floor, limit })?;
        Ok(Volume::Ground(Arc::new(surface), Arc::new(prism)))
    }
    /// min(f_T, f_P) over the domain that closed `rings` bound within the rectangle of `grid`, all metres: islands, with
    /// holes or in pieces, read as by [`Outline::eroded`](super::outline::Outline::eroded).
    ///
    /// # Errors
    /// A [`HeightfieldError`] says what is wrong with grid, rings, radius or floor.
    pub fn volume_over(&self, grid: &Grid<f32>, rings: &[Vec<DVec2>]) -> Result<Volume, HeightfieldError> {
        let surface = self.surface(grid)?;
        let prism = Prism::over(rings, self.floor, self.radius)?;
        let (low, high) = grid.bounds();
        for (ring, corners) in rings.iter().enumerate() {
            let outside = |p: &DVec2| !(low.cmple(*p).all() && p.cmple(high).all());
            if let Some(corner) = corners.iter().position(outside) {
                return Err(HeightfieldError::Outside { ring, corner, point: corners[corner], low, high });
            }
        }
        Ok(Volume::Ground(Arc::new(surface), Arc::new(prism)))
    }

    /// f_T, when grid, radius and floor are sound.
    fn surface(&self, grid: &Grid<f32>) -> Result<Surface, HeightfieldError> {
        if !grid.is_metric() {
            return Err(HeightfieldError::Geographic);
        }
        let count = grid.no_data_count();
        if count > 0 {
            return Err(HeightfieldError::Holes { count });
        }
        let &Implicitisation { sigmoid, distance, radius, floor } = self;
        let (low, high) = grid.bounds();
        let limit = (high - low).min_element() * 0.5;
        if !(sigmoid.fits(radius) && radius < limit) {
            let limit = if sigmoid == Sigmoid::Paper { limit.min(3.0 * THRESHOLD) } else { limit };
            return Err(HeightfieldError::Radius { radius, limit });
        }
        let small = HeightfieldError::Small { width: grid.width(), height: grid.height() };
        let surface = Surface::new(grid, sigmoid, distance, radius).ok_or(small)?;
        let limit = surface.elevations().lo() - radius;
        if !(floor.is_finite() && floor <= limit) {
            return Err(HeightfieldError::Floor { floor, limit });
        }
        Ok(surface)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::field::{Box3, Density};
    use glam::{DVec2, DVec3};
    use proptest::prelude::*;

    /// A wavy plane of 33 × 25 samples, 2 by 3 metres apart.
    pub(crate) fn waves() -> Grid<f32> {
        let value = |i: usize, j: usize| {
            let (x, y) = (i as f64 * 0.4, j as f64 * 0.3);
            (6.0 * libm::sin(x) + 4.0 * libm::cos(y + 0.5 * x)) as f32
        };
        let values = (0..33 * 25).map(|k| value(k % 33, k / 33)).collect();
        Grid::new(DVec2::new(100.0, -20.0), DVec2::new(2.0, 3.0), 33, 25, values).unwrap()
    }

    /// The waves as a volume with vertical distances.
    pub(crate) fn ground(sigmoid: Sigmoid, radius: f64) -> Volume {
        made(sigmoid, Distance::Vertical, radius, -30.0).unwrap()
    }

    fn made(sigmoid: Sigmoid, distance: Distance, radius: f64, floor: f64) -> Result<Volume, HeightfieldError> {
        Implicitisation { sigmoid, distance, radius, floor }.volume(&waves())
    }

    fn solid() -> Box3 {
        *Prism::new(DVec2::new(100.0, -20.0), DVec2::new(164.0, 52.0), -30.0, 4.0).unwrap().extent()
    }

    fn at(field: &Volume, t: [f64; 3]) -> DVec3 {
        let support = field.support();
        support.low + (support.high - support.low) * DVec3::from_array(t.map(|t| 1.1 * t - 0.05))
    }

    #[test]
    fn the_surface_is_where_the_heightfield_is() {
        let f = ground(Sigmoid::UnitFree, 4.0);
        for (_, _, p, z) in waves().positions() {
            let p = p.extend(f64::from(z));
            if solid().contains(p) {
                assert_eq!(f.value(p), THRESHOLD);
                assert!(f.value(p - DVec3::Z * 0.01) > THRESHOLD && f.value(p + DVec3::Z * 0.01) < THRESHOLD);
            }
        }
    }

    /// Claims P8: with f_P = T inside, as printed, f would be T on the whole solid.
    #[test]
    fn the_solid_is_above_t_inside_and_its_walls_stand_0_4542_r_outside_the_prism() {
        let f = ground(Sigmoid::UnitFree, 4.0);
        let deep = DVec3::new(130.0, 10.0, -25.0);
        assert_eq!(f.value(deep), 2.0 * THRESHOLD);
        let wall = DVec3::new(solid().high.x + 0.4542 * 4.0, 10.0, -25.0);
        assert!((f.value(wall) - THRESHOLD).abs() < 1e-4);
        let floor = DVec3::new(130.0, 10.0, -30.0 - 0.4542 * 4.0);
        assert!((f.value(floor) - THRESHOLD).abs() < 1e-4);
    }

    #[test]
    fn the_ground_is_the_intersection_of_its_two_nodes() {
        let ground = ground(Sigmoid::UnitFree, 4.0);
        let Volume::Ground(surface, prism) = &ground else { panic!("a ground") };
        let nodes = Volume::Intersection(vec![Volume::Surface(surface.clone()), Volume::Prism(prism.clone())]);
        assert_eq!(nodes.support(), ground.support());
        for k in 0..5000u32 {
            let t = [k % 17, k / 17 % 17, k / 289].map(|k| f64::from(k) / 17.0);
            let p = at(&ground, t);
            assert_eq!(nodes.value(p), ground.value(p));
            assert_eq!(nodes.bounds(&Box3::around(p, 2.0)), ground.bounds(&Box3::around(p, 2.0)));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn a_heightfield_is_within_its_bounds_over_every_box(
            a in prop::array::uniform3(0.0f64..1.0), b in prop::array::uniform3(0.0f64..1.0), size in 0.0f64..0.5,
            u in prop::array::uniform3(0.0f64..1.0), v in prop::array::uniform3(0.0f64..1.0), which in 0..3,
        ) {
            let f = match which {
                0 => ground(Sigmoid::Paper, 1.5),
                1 => ground(Sigmoid::UnitFree, 5.0),
                _ => made(Sigmoid::UnitFree, Distance::Normalised, 5.0, -30.0).unwrap(),
            };
            let corner = at(&f, a);
            let region = Box3::new(corner, corner.lerp(at(&f, b), size * size));
            let bounds = f.bounds(&region);
            let inside = |t: [f64; 3]| (region.low + (region.high - region.low) * DVec3::from_array(t))
                .clamp(region.low, region.high);
            let (p, q) = (inside(u), inside(v));
            let (value, other) = (f.value(p), f.value(q));
            prop_assert!(bounds.range.contains(value), "{value} in {bounds:?}");
            prop_assert!((value - other).abs() <= bounds.slope * p.distance(q) + 1e-13, "{bounds:?}");
            prop_assert!(f.density(region.intervals()).contains(value));
            prop_assert!(f.support().contains(p) || value.abs() < 1e-15, "{value} at {p}");
            let (sampled, gradient) = f.sample(p);
            prop_assert_eq!(sampled, value);
            prop_assert!(gradient.length() <= bounds.slope * (1.0 + 1e-12) + 1e-13);
        }
    }

    #[test]
    fn what_cannot_become_a_volume_is_refused() {
        let refuse = |sigmoid, radius, floor| made(sigmoid, Distance::Vertical, radius, floor).unwrap_err();
        assert!(matches!(refuse(Sigmoid::Paper, 2.0, -30.0), HeightfieldError::Radius { limit, .. } if limit == 1.5));
        assert!(matches!(refuse(Sigmoid::UnitFree, 32.0, -90.0), HeightfieldError::Radius { .. }));
        assert!(matches!(refuse(Sigmoid::UnitFree, 4.0, 0.0), HeightfieldError::Floor { .. }));
        let holes = waves().with_no_data(Some(waves().values()[7]));
        assert!(matches!(Implicitisation::of(&waves(), 4.0).volume(&holes), Err(HeightfieldError::Holes { count: 1 })));
    }
}
