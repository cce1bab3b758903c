//! The leaves of the tree: each file holds one primitive, as it is authored, as it stands in a scene file, and as it
//! is compiled, with its formula over any [`Number`] and its bounds. A new primitive is a file and a line in
//! `for_each_primitive!`.

pub mod contour;
pub mod curve;
pub mod detail_disc;
pub mod disc;
pub mod image;
pub mod quad;
mod raster;
pub mod river;
pub mod road;
mod spline;
pub mod strip;

use crate::bounds::{Bounds, Region};
use crate::detail::FocusSlot;
use crate::interval::Interval;
use crate::noise::{Bounds as NoiseBounds, NoiseValue, Octave};
use crate::program::{Layout, TileLayout};
use crate::real::{Operand, apart};
use glam::DVec2;
use image::{Image, ImageNumber};
use std::sync::Arc;

/// What a tree can be evaluated on.
pub trait Number: NoiseValue + ImageNumber {}
impl<R: NoiseValue + ImageNumber> Number for R {}

/// Reads consecutive parameters as numbers.
#[derive(Clone, Copy)]
pub struct Parameters<'a, P>(pub &'a [P]);

impl<'a, P: Copy + Into<f64>> Parameters<'a, P> {
    /// The `k`-th one.
    #[inline(always)]
    pub fn get<R: Number>(&self, k: usize) -> R {
        R::constant(self.0[k].into())
    }
    /// The `k`-th and the next one.
    #[inline(always)]
    pub fn pair<R: Number>(&self, k: usize) -> [R; 2] {
        [self.get(k), self.get(k + 1)]
    }
    /// All from the `k`-th on.
    #[inline(always)]
    pub fn from(&self, k: usize) -> Parameters<'a, P> {
        Parameters(&self.0[k..])
    }
}

/// What instructions refer to beside their parameters.
#[derive(Clone, Copy, Debug)]
pub struct Tables<'a> {
    /// The octaves of every noise.
    pub octaves: &'a [Octave<2>],
    /// Octaves are placed for the origin of a tile instead of the centre of their primitive.
    pub tiled: bool,
    /// Range and slope of every noise; empty in a tile, which is never bounded.
    pub noises: &'a [NoiseBounds],
    /// The rasters.
    pub images: &'a [Arc<Image>],
}

impl Tables<'_> {
    /// No tables, for primitives that need none.
    pub(crate) const NONE: Tables<'static> = Tables { octaves: &[], tiled: false, noises: &[], images: &[] };
}

/// South-west and north-east corners, metres.
pub type Extent = (DVec2, DVec2);

/// A box around points, `r` metres wider on every side.
pub(crate) fn around(points: impl IntoIterator<Item = DVec2>, r: f64) -> Option<Extent> {
    let r = DVec2::splat(r * (1.0 + 1e-12));
    points
        .into_iter()
        .fold(None, |b: Option<Extent>, p| Some(b.map_or((p - r, p + r), |(lo, hi)| (lo.min(p - r), hi.max(p + r)))))
}

/// A primitive as it is authored.
pub trait Authored {
    /// What it compiles to.
    type Code: Leaf;
    /// Checks it, derives what is costly at run time, and stores its parameters.
    ///
    /// # Errors
    /// What was expected, in one line.
    fn compile(&self, out: &mut Layout) -> Result<Self::Code, String>;
}

/// A compiled primitive. `p` starts at its first parameter.
pub trait Leaf: Copy {
    /// Index of its first parameter.
    fn at(&self) -> u32;
    /// Appends what the instruction says beside its kind, as words: the index of its first parameter, then its own fields.
    fn fields(&self, out: &mut Vec<u32>);
    /// 32-bit words of the compact form of the instruction.
    fn words(&self) -> usize {
        1
    }
    /// Elevation and weight at `x`. Where the weight is 0 the elevation means nothing.
    fn sample<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, tables: Tables<'_>, x: [R; 2]) -> Operand<R>;
    /// Range of the weight alone, exactly 0 where the region lies off the support: all that pruning asks.
    fn weight_range(&self, p: Parameters<f64>, region: &Region) -> Interval;
    /// Ranges and slopes over a region.
    fn bounds(&self, p: Parameters<f64>, tables: Tables<'_>, region: &Region) -> Bounds;
    /// A box that holds the support.
    fn support(&self, p: Parameters<f64>) -> Option<Extent>;
    /// Metres: on boxes narrower than this it is seldom that the primitive begins or ends.
    fn grain(&self, p: Parameters<f64>) -> f64 {
        self.support(p).map_or(0.0, |(lo, hi)| (hi - lo).min_element())
    }
    /// The same primitive where only its weight is asked for.
    #[must_use]
    fn weight_only(self) -> Self {
        self
    }
    /// The same primitive on a box: what contributes exactly 0 there is left out.
    #[must_use]
    fn pruned(self, _p: Parameters<f64>, _region: &Region) -> Self {
        self
    }
    /// A cheaper primitive for a box, with how far its elevation may be off, metres: octaves that together are no steeper
    /// than `slope` may leave. Bounds of the noise that is left are added to the table.
    #[must_use]
    fn simplified(
        self,
        _p: Parameters<f64>,
        _tables: Tables<'_>,
        _region: &Region,
        _slope: f64,
        _noises: &mut Vec<NoiseBounds>,
    ) -> (Self, f64) {
        (self, 0.0)
    }
    /// How many octaves of noise an evaluation may visit.
    fn octaves(&self) -> usize {
        0
    }
    /// Where the parameters of the focus stand, if it depends on the level of detail.
    fn focus(&self) -> Option<FocusSlot> {
        None
    }
    /// The same primitive with its parameters from `at` on; asked of those with a focus alone.
    #[must_use]
    fn stored_at(self, _at: u32) -> Self {
        self
    }
    /// The same primitive relative to `origin`, with its parameters stored in the tile.
    #[must_use]
    fn rebase(&self, p: Parameters<f64>, tables: Tables<'_>, origin: DVec2, tile: &mut TileLayout) -> Self;
}

/// Calls a macro with every primitive: its name, its file, its authored type.
macro_rules! for_each_primitive {
    ($then:ident) => {
        $then! {
            /// Disc around a centre, constant or with noise.
            Disc disc Disc,
            /// Disc whose octaves appear with the level of detail.
            DetailDisc detail_disc DetailDisc,
            /// Curve with cross-sections.
            Curve curve Curve,
            /// Closed contour with radial cross-sections.
            Contour contour Contour,
            /// Image on an axis-aligned rectangle.
            Image image ImagePatch,
            /// Image on a convex quadrangle.
            Quad quad Quad,
            /// Images along a curve.
            Strip strip Strip,
        }
    };
}
pub(crate) use for_each_primitive;

macro_rules! define {
    ($($(#[$doc:meta])* $name:ident $file:ident $authored:ident,)*) => {
        /// Any primitive, as it is authored.
        #[derive(Clone, Debug)]
        pub enum Primitive {
            $($(#[$doc])* $name($file::$authored),)*
        }

        /// Any compiled primitive.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Code {
            $($(#[$doc])* $name($file::Code),)*
        }

        impl Code {
            /// The name of each kind, in the order of the enum.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($name),)*];
            /// The name of this one.
            pub fn name(&self) -> &'static str {
                match self { $(Code::$name(_) => stringify!($name),)* }
            }
        }

        $(impl From<$file::$authored> for Primitive {
            fn from(primitive: $file::$authored) -> Primitive {
                Primitive::$name(primitive)
            }
        })*

        impl Authored for Primitive {
            type Code = Code;
            fn compile(&self, out: &mut Layout) -> Result<Code, String> {
                match self {
                    $(Primitive::$name(primitive) => primitive.compile(out).map(Code::$name),)*
                }
            }
        }

        impl Leaf for Code {
            #[inline(always)]
            fn at(&self) -> u32 {
                match self { $(Code::$name(code) => code.at(),)* }
            }
            fn fields(&self, out: &mut Vec<u32>) {
                match self { $(Code::$name(code) => code.fields(out),)* }
            }
            fn words(&self) -> usize {
                match self { $(Code::$name(code) => code.words(),)* }
            }
            #[inline(always)]
            fn sample<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, tables: Tables<'_>, x: [R; 2]) -> Operand<R> {
                match self { $(Code::$name(code) => apart::<R, _>(#[inline(always)] || code.sample(p, tables, x)),)* }
            }
            fn weight_range(&self, p: Parameters<f64>, region: &Region) -> Interval {
                match self { $(Code::$name(code) => code.weight_range(p, region),)* }
            }
            fn bounds(&self, p: Parameters<f64>, tables: Tables<'_>, region: &Region) -> Bounds {
                match self { $(Code::$name(code) => code.bounds(p, tables, region),)* }
            }
            fn support(&self, p: Parameters<f64>) -> Option<Extent> {
                match self { $(Code::$name(code) => code.support(p),)* }
            }
            fn grain(&self, p: Parameters<f64>) -> f64 {
                match self { $(Code::$name(code) => code.grain(p),)* }
            }
            fn weight_only(self) -> Code {
                match self { $(Code::$name(code) => Code::$name(code.weight_only()),)* }
            }
            fn pruned(self, p: Parameters<f64>, region: &Region) -> Code {
                match self { $(Code::$name(code) => Code::$name(code.pruned(p, region)),)* }
            }
            fn simplified(
                self,
                p: Parameters<f64>,
                tables: Tables<'_>,
                region: &Region,
                slope: f64,
                noises: &mut Vec<NoiseBounds>,
            ) -> (Code, f64) {
                match self {
                    $(Code::$name(code) => {
                        let (code, error) = code.simplified(p, tables, region, slope, noises);
                        (Code::$name(code), error)
                    })*
                }
            }
            fn octaves(&self) -> usize {
                match self { $(Code::$name(code) => code.octaves(),)* }
            }
            fn focus(&self) -> Option<FocusSlot> {
                match self { $(Code::$name(code) => code.focus(),)* }
            }
            fn stored_at(self, at: u32) -> Code {
                match self { $(Code::$name(code) => Code::$name(code.stored_at(at)),)* }
            }
            fn rebase(&self, p: Parameters<f64>, tables: Tables<'_>, origin: DVec2, tile: &mut TileLayout) -> Code {
                match self { $(Code::$name(code) => Code::$name(code.rebase(p, tables, origin, tile)),)* }
            }
        }
    };
}
for_each_primitive!(define);
