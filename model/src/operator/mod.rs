//! The inner nodes of the tree: how they combine elevations and weights, or move the plane below them, and the bounds
//! that follow. Each rule is written for difference quotients, so it needs no derivative (claims G4) and holds on any
//! segment of the region. A new operator is a file and a line in `combines!` or `frames!`, and a node of the tree.

pub mod add;
pub mod affine;
pub mod blend;
pub mod lod;
pub mod masked;
pub mod replace;
pub mod warp;

pub use blend::BlendRule;

use crate::bounds::{Bounds, Region, times_up};
use crate::detail::{Focus, FocusSlot};
use crate::interval::Interval;
use crate::primitive::{Extent, Number, Parameters};
use crate::program::TileLayout;
use crate::real::{Operand, Real, apart};
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// What a replacement or an addition does to the weight (Génevaux 2015 §5.2, §5.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WeightRule {
    /// α = α_A.
    #[default]
    Keep,
    /// Replacement: α = (1−α_B)·α_A + α_B²; addition: α = α_A + α_B². The elevation is the blend with these two
    /// weights, so it stays Lipschitz where α_A fades out (claims, *Nesting*).
    Combine,
    /// The same weight with the elevation as printed: its slope has no bound where α_A fades out.
    CombinePaper,
}

/// What pruning knows of an operand.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Its weight is exactly 0 on the box.
    pub absent: bool,
    /// Encloses its weight on the box.
    pub weight: Interval,
}

/// What becomes of an operand's code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It stays.
    Keep,
    /// It goes.
    Drop,
    /// Only its weight is needed.
    WeightOnly,
    /// It left no code, but its place must be filled.
    Empty,
}

/// What pruning leaves of an operator: `None` when the one operand that is kept is the result.
#[derive(Clone, Copy, Debug)]
pub struct Pruned<C> {
    /// The operator on what is left.
    pub code: Option<C>,
    /// Weight of the result.
    pub result: Part,
}

/// A compiled operator on the values of its operands. `p` starts at its first parameter, if it has any.
pub trait Combine: Copy {
    /// Index of its first parameter.
    fn at(&self) -> u32 {
        0
    }
    /// How many operands.
    fn operands(&self) -> usize;
    /// Appends what the instruction says beside its kind, as words: the index of its first parameter, then its own fields.
    fn fields(&self, out: &mut Vec<u32>);
    /// The result at `x`.
    fn combine<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, x: [R; 2], parts: &[Operand<R>]) -> Operand<R>;
    /// Bounds of the result over a region.
    fn bounds(&self, p: Parameters<f64>, rule: BlendRule, region: &Region, parts: &[Bounds]) -> Bounds;
    /// Exact pruning: what is left computes the same bits. A term that is dropped was exactly 0.
    fn prune(&self, p: Parameters<f64>, region: &Region, parts: &[Part], fates: &mut [Fate]) -> Pruned<Self>;
    /// A box that holds the support.
    fn support(&self, parts: &[Option<Extent>]) -> Option<Extent>;
    /// How far the elevation may be off where those of the operands are off by `errors`, metres; `parts` are the bounds of
    /// the operands as they were. Most operators take a mean.
    fn error(&self, _p: Parameters<f64>, _parts: &[Bounds], errors: &[f64]) -> f64 {
        errors.iter().fold(0.0, |worst: f64, e| worst.max(*e))
    }
    /// Where the parameters of the focus stand, if it depends on the level of detail.
    fn focus(&self) -> Option<FocusSlot> {
        None
    }
    /// The same operator with its parameters from `at` on; asked of those with a focus alone.
    #[must_use]
    fn stored_at(self, _at: u32) -> Self {
        self
    }
    /// The same operator relative to `origin`, with its parameters stored in the tile.
    #[must_use]
    fn rebase(&self, _p: Parameters<f64>, _origin: DVec2, _tile: &mut TileLayout) -> Self {
        *self
    }
}

/// A compiled map of the plane around an operand. `p` starts at its first parameter.
pub trait Frame: Copy {
    /// Index of its first parameter.
    fn at(&self) -> u32;
    /// Appends what the instruction says beside its kind, as words: the index of its first parameter, then its own fields.
    fn fields(&self, out: &mut Vec<u32>);
    /// The point carried into the operand's frame.
    fn enter<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, x: [R; 2]) -> [R; 2];
    /// The operand's value carried back.
    fn leave<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, a: Operand<R>) -> Operand<R>;
    /// A region carried into the operand's frame.
    fn enter_region(&self, p: Parameters<f64>, region: &Region) -> Region;
    /// The operand's bounds carried back; `region` is the one outside.
    fn leave_bounds(&self, p: Parameters<f64>, region: &Region, b: Bounds) -> Bounds;
    /// A box that holds what the operand's box is carried to.
    fn support(&self, p: Parameters<f64>, inner: Extent) -> Option<Extent>;
    /// How far the elevation may be off where that of the operand is off by `error`, metres.
    fn error(&self, _p: Parameters<f64>, error: f64) -> f64 {
        error
    }
    /// The focus as the operand's frame sees it.
    fn focus(&self, p: Parameters<f64>, focus: Focus) -> Focus;
    /// The same map from a tile's origin to the origin of the operand's own frame, which is returned.
    #[must_use]
    fn rebase(&self, p: Parameters<f64>, origin: DVec2, tile: &mut TileLayout) -> (Self, DVec2);
}

macro_rules! combines {
    ($($(#[$doc:meta])* $name:ident($code:path),)*) => {
        /// Any compiled operator on values.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Operator {
            $($(#[$doc])* $name($code),)*
        }

        impl Operator {
            /// The name of each kind, in the order of the enum.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($name),)*];
            /// The name of this one.
            pub fn name(&self) -> &'static str {
                match self { $(Operator::$name(_) => stringify!($name),)* }
            }
        }

        impl Combine for Operator {
            #[inline(always)]
            fn at(&self) -> u32 {
                match self { $(Operator::$name(code) => code.at(),)* }
            }
            fn fields(&self, out: &mut Vec<u32>) {
                match self { $(Operator::$name(code) => code.fields(out),)* }
            }
            #[inline(always)]
            fn operands(&self) -> usize {
                match self { $(Operator::$name(code) => code.operands(),)* }
            }
            #[inline(always)]
            fn combine<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, x: [R; 2], parts: &[Operand<R>]) -> Operand<R> {
                match self { $(Operator::$name(code) => apart::<R, _>(#[inline(always)] || code.combine(p, x, parts)),)* }
            }
            fn bounds(&self, p: Parameters<f64>, rule: BlendRule, region: &Region, parts: &[Bounds]) -> Bounds {
                match self { $(Operator::$name(code) => code.bounds(p, rule, region, parts),)* }
            }
            fn prune(&self, p: Parameters<f64>, region: &Region, parts: &[Part], fates: &mut [Fate]) -> Pruned<Operator> {
                match self {
                    $(Operator::$name(code) => {
                        let Pruned { code, result } = code.prune(p, region, parts, fates);
                        Pruned { code: code.map(Operator::$name), result }
                    })*
                }
            }
            fn support(&self, parts: &[Option<Extent>]) -> Option<Extent> {
                match self { $(Operator::$name(code) => code.support(parts),)* }
            }
            fn error(&self, p: Parameters<f64>, parts: &[Bounds], errors: &[f64]) -> f64 {
                match self { $(Operator::$name(code) => code.error(p, parts, errors),)* }
            }
            fn focus(&self) -> Option<FocusSlot> {
                match self { $(Operator::$name(code) => code.focus(),)* }
            }
            fn stored_at(self, at: u32) -> Operator {
                match self { $(Operator::$name(code) => Operator::$name(code.stored_at(at)),)* }
            }
            fn rebase(&self, p: Parameters<f64>, origin: DVec2, tile: &mut TileLayout) -> Operator {
                match self { $(Operator::$name(code) => Operator::$name(code.rebase(p, origin, tile)),)* }
            }
        }
    };
}
combines! {
    /// Blend of any number of operands.
    Blend(blend::Code),
    /// Replacement of the first operand by the second.
    Replace(replace::Code),
    /// Addition of the second operand to the first.
    Add(add::Code),
    /// The first operand far from the focus, the second near it.
    Lod(lod::Code),
    /// The last operand where the first is low and gentle.
    Masked(masked::Code),
}

macro_rules! frames {
    ($($(#[$doc:meta])* $name:ident($code:path),)*) => {
        /// Any compiled map of the plane.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Map {
            $($(#[$doc])* $name($code),)*
        }

        impl Map {
            /// The name of each kind, in the order of the enum.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($name),)*];
            /// The name of this one.
            pub fn name(&self) -> &'static str {
                match self { $(Map::$name(_) => stringify!($name),)* }
            }
        }

        impl Frame for Map {
            #[inline(always)]
            fn at(&self) -> u32 {
                match self { $(Map::$name(code) => code.at(),)* }
            }
            fn fields(&self, out: &mut Vec<u32>) {
                match self { $(Map::$name(code) => code.fields(out),)* }
            }
            #[inline(always)]
            fn enter<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, x: [R; 2]) -> [R; 2] {
                match self { $(Map::$name(code) => apart::<R, _>(#[inline(always)] || code.enter(p, x)),)* }
            }
            #[inline(always)]
            fn leave<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, a: Operand<R>) -> Operand<R> {
                match self { $(Map::$name(code) => apart::<R, _>(#[inline(always)] || code.leave(p, a)),)* }
            }
            fn enter_region(&self, p: Parameters<f64>, region: &Region) -> Region {
                match self { $(Map::$name(code) => code.enter_region(p, region),)* }
            }
            fn leave_bounds(&self, p: Parameters<f64>, region: &Region, b: Bounds) -> Bounds {
                match self { $(Map::$name(code) => code.leave_bounds(p, region, b),)* }
            }
            fn support(&self, p: Parameters<f64>, inner: Extent) -> Option<Extent> {
                match self { $(Map::$name(code) => code.support(p, inner),)* }
            }
            fn error(&self, p: Parameters<f64>, error: f64) -> f64 {
                match self { $(Map::$name(code) => code.error(p, error),)* }
            }
            fn focus(&self, p: Parameters<f64>, focus: Focus) -> Focus {
                match self { $(Map::$name(code) => code.focus(p, focus),)* }
            }
            fn rebase(&self, p: Parameters<f64>, origin: DVec2, tile: &mut TileLayout) -> (Map, DVec2) {
                match self {
                    $(Map::$name(code) => {
                        let (code, inner) = code.rebase(p, origin, tile);
                        (Map::$name(code), inner)
                    })*
                }
            }
        }
    };
}
frames! {
    /// Scale, rotation and translation.
    Affine(affine::Code),
    /// Compact displacements.
    Warp(warp::Code),
}

/// t·f with t the weight clamped to [0, 1] (claims G24). An enclosure also has it as α·f / max(α, 1), which stays
/// smooth where the weight fades out and f itself has no slope bound.
#[inline(always)]
fn carried<R: Real>(t: R, b: &Operand<R>) -> R {
    let plain = t * b.elevation;
    if R::ENCLOSES { (b.product / b.weight.max(R::one())).tighten(plain) } else { plain }
}

/// f_A where A has weight, 0 elsewhere: what the printed rules read. It jumps, and an enclosure knows no slope for it.
#[inline(always)]
fn on_support<R: Real>(a: Operand<R>) -> R {
    if R::ENCLOSES {
        R::weighted_mean(&[a], 0.0).elevation
    } else {
        R::select(R::zero().less(a.weight), a.elevation, R::zero())
    }
}

/// Fates of two operands that both enter the result: dropping either would change its rounding.
pub(crate) fn both_needed(parts: &[Part], fates: &mut [Fate]) {
    for (part, fate) in parts.iter().zip(fates) {
        *fate = if part.absent { Fate::Empty } else { Fate::Keep };
    }
}

/// The box around both.
fn hull(a: Option<Extent>, b: Option<Extent>) -> Option<Extent> {
    match (a, b) {
        (Some((p, q)), Some((r, s))) => Some((p.min(r), q.max(s))),
        (a, b) => a.or(b),
    }
}

/// `b` carrying the weight α_B² instead of α_B, α_B in `t`: λ ≤ 2·sup α_B·λ_αB, μ ≤ sup α_B·μ_B.
fn squared_weight(b: Bounds, t: Interval) -> Bounds {
    Bounds {
        weight: t.square(),
        weight_slope: times_up(2.0 * t.hi(), b.weight_slope),
        weighted_slope: times_up(b.weighted_slope, t.hi()),
        ..b
    }
}

/// A weight enclosure without the negative dust of outward rounding.
fn clean(b: Bounds) -> Bounds {
    if b.is_absent() {
        return Bounds::ABSENT;
    }
    Bounds { weight: Interval::new(b.weight.lo().max(0.0), b.weight.hi()), ..b }
}
