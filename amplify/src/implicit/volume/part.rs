//! Operators that need more than their operands: localised warp, erosion, instance.

use super::{Volume, VolumeNumber};
use crate::field::{Box3, Density, DensityBounds};
use crate::geology::Geology;
use crate::geology::noise::{Turbulence, channels, fold_slope};
use glam::{DMat3, DVec3};
use std::sync::Arc;
use terrain_model::bounds::{plus_up, times_up};
use terrain_model::interval::Interval;
use terrain_model::real::Real;

/// Covers the rounding of the few operations behind a slope.
const ROUNDING: f64 = 1.0 + 1e-12;

/// f_D clamped to [0, 1]: how much of an operator acts.
fn share<R: VolumeNumber>(region: &Volume, p: [R; 3]) -> R {
    region.density(p).clamp01()
}

/// Encloses the share over a box; clamping is no steeper.
fn share_bounds(region: &Volume, over: &Box3) -> DensityBounds {
    let bounds = region.bounds(over);
    let clamped = Interval::new(bounds.range.lo().clamp(0.0, 1.0), bounds.range.hi().clamp(0.0, 1.0));
    let still = clamped.lo() == clamped.hi();
    DensityBounds { range: clamped, slope: if still { 0.0 } else { bounds.slope } }
}

/// f(p + δ(p)·f_D(p)), δ turbulence of three channels (Paris 2019 §5.3; claims P4 and P5: no claim that space does not
/// fold, [`Warp::folds`] tells).
#[derive(Clone, Debug)]
pub struct Warp {
    /// What is warped.
    pub child: Volume,
    /// f_D.
    pub region: Volume,
    delta: Arc<Delta>,
}

#[derive(Debug)]
struct Delta {
    channels: [Turbulence; 3],
    /// Of one channel, metres.
    amplitude: f64,
    /// Lip(δ).
    slope: f64,
}

impl Warp {
    /// Displaces by at most `amplitude` metres, in waves of `wavelength` metres and `octaves` octaves.
    ///
    /// # Errors
    /// What is wrong with the numbers.
    pub fn new(
        child: Volume,
        region: Volume,
        amplitude: f64,
        wavelength: f64,
        octaves: u32,
        seed: u32,
    ) -> Result<Warp, String> {
        let sound = |x: f64| (1e-6..=1e9).contains(&x);
        if !(sound(amplitude) && sound(wavelength) && (1..=16).contains(&octaves)) {
            return Err(format!(
                "a warp of {amplitude} m in {octaves} octaves of {wavelength} m: expected 1e-6 to 1e9 m and 1 to 16 octaves"
            ));
        }
        let amplitude = amplitude / 3.0f64.sqrt();
        let channels = channels(wavelength, octaves, seed);
        let slope = fold_slope(amplitude, &channels) * ROUNDING;
        Ok(Warp { child, region, delta: Arc::new(Delta { channels, amplitude, slope }) })
    }
    /// May the deformation fold space, its slope bound within the region being 1 or more?
    pub fn folds(&self) -> bool {
        self.steepness(&share_bounds(&self.region, &self.region.support())) >= 1.0
    }
    /// The longest displacement, metres.
    fn reach(&self) -> f64 {
        self.delta.amplitude * 3.0f64.sqrt() * ROUNDING
    }
    /// Lip(δ·f_D): |δ|·Lip(f_D) + f_D·Lip(δ).
    fn steepness(&self, share: &DensityBounds) -> f64 {
        plus_up(times_up(self.reach(), share.slope), times_up(share.range.hi(), self.delta.slope))
    }
    #[inline(never)]
    pub(super) fn density<R: VolumeNumber>(&self, p: [R; 3]) -> R {
        let share = share(&self.region, p);
        if share.hull().hi() <= 0.0 {
            return self.child.density(p);
        }
        let by = share * R::constant(self.delta.amplitude);
        self.child.density(std::array::from_fn(|k| p[k] + by * self.delta.channels[k].signed(p)))
    }
    /// The child's enclosure over the displaced box, steeper by the deformation's own slope.
    pub(super) fn enclose(&self, over: &Box3, keep: bool) -> (DensityBounds, Volume) {
        let share = share_bounds(&self.region, over);
        if share.range.hi() <= 0.0 {
            return self.child.enclose(over, keep);
        }
        let sides = over.intervals();
        let by = share.range * Interval::point(self.delta.amplitude);
        let moved: [Interval; 3] = std::array::from_fn(|k| {
            let delta = self.delta.channels[k].signed(sides).meet(Interval::symmetric(1.0));
            sides[k] + by * delta
        });
        let moved =
            Box3 { low: DVec3::from_array(moved.map(Interval::lo)), high: DVec3::from_array(moved.map(Interval::hi)) };
        let (bounds, child) = self.child.enclose(&moved, keep);
        let slope = times_up(bounds.slope, plus_up(1.0, self.steepness(&share)));
        let rest = if keep {
            let region = self.region.enclose(over, true).1;
            Volume::Warp(Arc::new(Warp { child, region, delta: self.delta.clone() }))
        } else {
            Volume::AIR
        };
        (DensityBounds { range: bounds.range, slope }, rest)
    }
    /// Within reach of the child.
    pub(super) fn support(&self) -> Box3 {
        let reach = DVec3::splat(self.reach() * ROUNDING);
        let child = self.child.support();
        let slack = (child.low.abs().max(child.high.abs())) * 1e-15;
        let slack = slack.map(|x| if x.is_finite() { x } else { 0.0 });
        Box3 { low: child.low - reach - slack, high: child.high + reach + slack }
    }
}

/// f − f_D·(1 − ρ): rock of no resistance loses f_D, the most resistant nothing (Paris 2019 §6).
#[derive(Clone, Debug)]
pub struct Erosion {
    /// What is eroded.
    pub child: Volume,
    /// f_D.
    pub region: Volume,
    /// ρ, in [0, 1] whatever the tree (claims P2: a sum beyond 1 would add rock).
    pub geology: Arc<Geology>,
}

impl Erosion {
    #[inline(never)]
    pub(super) fn density<R: VolumeNumber>(&self, p: [R; 3]) -> R {
        let f = self.child.density(p);
        let share = share(&self.region, p);
        if share.hull().hi() <= 0.0 {
            return f;
        }
        f - share * (R::one() - self.geology.resistance(p))
    }
    pub(super) fn enclose(&self, over: &Box3, keep: bool) -> (DensityBounds, Volume) {
        let (bounds, child) = self.child.enclose(over, keep);
        let share = share_bounds(&self.region, over);
        if share.range.hi() <= 0.0 {
            return (bounds, child);
        }
        let rho = self.geology.bounds(over);
        let weak = (Interval::point(1.0) - rho.range).meet(Interval::UNIT);
        let slope = plus_up(times_up(share.slope, weak.hi()), times_up(share.range.hi(), rho.slope));
        // 0 · ∞ where a fault meets a region that is 0.
        let slope = if slope.is_nan() { f64::INFINITY } else { slope };
        let rest = if keep {
            let region = self.region.enclose(over, true).1;
            Volume::Erosion(Arc::new(Erosion { child, region, geology: self.geology.clone() }))
        } else {
            Volume::AIR
        };
        let range = bounds.range - share.range * weak;
        (DensityBounds { range, slope: plus_up(bounds.slope, slope) }, rest)
    }
}

/// Where a copy stands: turned, scaled, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// From the copy's axes to those of the world; orthonormal.
    turn: DMat3,
    scale: f64,
    position: DVec3,
}

impl Placement {
    /// Turned by `angle` radians counter-clockwise about z, scaled about the origin, its origin moved to `position`; `None`
    /// unless the scale is positive and all is finite.
    pub fn new(position: DVec3, angle: f64, scale: f64) -> Option<Placement> {
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let turn = DMat3::from_cols(DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0), DVec3::Z);
        let sound = position.is_finite() && angle.is_finite() && (1e-6..=1e9).contains(&scale);
        sound.then_some(Placement { turn, scale, position })
    }
    /// From the world to the copy's own space.
    fn own<R: Real>(&self, p: [R; 3]) -> [R; 3] {
        let v: [R; 3] = std::array::from_fn(|k| (p[k] - R::constant(self.position[k])) / R::constant(self.scale));
        std::array::from_fn(|k| {
            let axis = self.turn.col(k);
            v[0] * R::constant(axis.x) + v[1] * R::constant(axis.y) + v[2] * R::constant(axis.z)
        })
    }
    fn own_box(&self, over: &Box3) -> Box3 {
        let sides = self.own(over.intervals());
        Box3 { low: DVec3::from_array(sides.map(Interval::lo)), high: DVec3::from_array(sides.map(Interval::hi)) }
    }
}

/// A copy of a volume that is stored once. The field keeps its values; its slopes shrink by the scale.
#[derive(Clone, Debug)]
pub struct Instance {
    /// What is copied.
    pub child: Volume,
    /// Where to.
    pub placement: Placement,
}

impl Instance {
    #[inline(never)]
    pub(super) fn density<R: VolumeNumber>(&self, p: [R; 3]) -> R {
        self.child.density(self.placement.own(p))
    }
    pub(super) fn enclose(&self, over: &Box3, keep: bool) -> (DensityBounds, Volume) {
        let (bounds, child) = self.child.enclose(&self.placement.own_box(over), keep);
        if bounds == DensityBounds::ZERO {
            return (bounds, Volume::AIR);
        }
        let slope = times_up(bounds.slope / self.placement.scale, ROUNDING);
        let rest =
            if keep { Volume::Instance(Arc::new(Instance { child, placement: self.placement })) } else { Volume::AIR };
        (DensityBounds { range: bounds.range, slope }, rest)
    }
    pub(super) fn support(&self) -> Box3 {
        let own = self.child.support();
        if own.is_empty() {
            return Box3::EMPTY;
        }
        let c = Interval::point;
        let corner = own.intervals();
        let side: [Interval; 3] = std::array::from_fn(|k| {
            let row = self.placement.turn.row(k);
            let turned = (0..3).fold(Interval::ZERO, |sum, j| {
                // An infinite side that is turned away from an axis by 0 adds nothing there.
                if row[j] == 0.0 { sum } else { sum + corner[j] * c(row[j]) }
            });
            // Twice the rounding of the way back.
            let slack = Interval::symmetric(times_up(1e-14, turned.magnitude()));
            let slack = if turned.magnitude().is_finite() { slack } else { Interval::ZERO };
            (turned + slack) * c(self.placement.scale) + c(self.placement.position[k])
        });
        Box3 { low: DVec3::from_array(side.map(Interval::lo)), high: DVec3::from_array(side.map(Interval::hi)) }
    }
}
