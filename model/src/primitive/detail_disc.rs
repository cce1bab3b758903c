//! Disc whose octaves appear one by one as κ grows (Génevaux 2015 §6, Fig. 16: a continuous level-of-detail primitive):
//! f = c_z + Σ aₖ·bₖ(κ)·ηₖ. Where bₖ vanishes on a whole box, pruning drops octave k and those after it.

use super::disc::{self, Disc, DiscNoise, local};
use super::{Authored, Extent, Leaf, Number, Parameters, Tables, around};
use crate::bounds::{Bounds, Region, plus_up, times_up};
use crate::detail::{self, FocusSlot};
use crate::dual::Dual;
use crate::interval::Interval;
use crate::noise::{Bounds as NoiseBounds, Combination, GRADIENT2_RANGE, GRADIENT2_SLOPE, Octave};
use crate::program::{Layout, TileLayout};
use crate::real::{Mask, Operand, Real};
use crate::scene::{Finite, Scope};
use glam::DVec2;
use serde::Deserialize;

/// A disc with a filter for each octave.
#[derive(Clone, Debug)]
pub struct DetailDisc {
    /// The disc at full detail; its noise is a sum or turbulence.
    pub disc: Disc,
    /// For each octave κ from which it rises and κ at which it is full, the first sorted.
    pub filters: Vec<(f64, f64)>,
}

impl DetailDisc {
    /// The first octave always, the others one after the other as κ goes from 0 to 1.
    pub fn even_filters(octaves: u32) -> Vec<(f64, f64)> {
        let step = 1.0 / (f64::from(octaves) - 1.0).max(1.0);
        (0..octaves)
            .map(|k| if k == 0 { (-1.0, 0.0) } else { (f64::from(k - 1) * step, f64::from(k) * step) })
            .collect()
    }
}

/// A disc with filters in a scene file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    disc: disc::File,
    /// Even when absent.
    #[serde(default)]
    filters: Option<Vec<(Finite, Finite)>>,
}

impl File {
    pub(crate) fn build(&self, scope: &mut Scope<'_>) -> Result<DetailDisc, String> {
        let disc = self.disc.build(scope)?;
        let octaves = disc.noise.map_or(0, |noise| noise.octaves.octaves);
        let filters = match &self.filters {
            None => DetailDisc::even_filters(octaves),
            Some(list) => list.iter().map(|(a, b)| ((*a).into(), (*b).into())).collect(),
        };
        Ok(DetailDisc { disc, filters })
    }
}

/// Where the parameters of the focus start: after centre x, y, 1/r², weight and elevation, as of a disc.
const FOCUS: usize = 5;
/// Where the filters start: for each octave κ from which it rises, and 1 over how far.
const FILTERS: usize = FOCUS + detail::WIDTH;

/// A compiled disc with filters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Code {
    at: u32,
    turbulence: bool,
    first: u32,
    octaves: u32,
}

impl Authored for DetailDisc {
    type Code = Code;
    fn compile(&self, out: &mut Layout) -> Result<Code, String> {
        let Disc { centre, radius, weight, noise } = &self.disc;
        if !(centre.is_finite() && *radius > 0.0 && radius.is_finite() && *weight > 0.0 && weight.is_finite()) {
            return Err("a disc needs a finite centre, a positive radius and a positive weight".to_owned());
        }
        let Some(DiscNoise { combination, octaves, seed }) = noise.filter(|noise| noise.octaves.is_sound()) else {
            return Err("a disc with filters needs a noise of 1 to 16 octaves".to_owned());
        };
        // Without its octave a factor of a product does not vanish: only sums can be filtered.
        let turbulence = match combination {
            Combination::Sum => false,
            Combination::Turbulence => true,
            _ => return Err("a disc with filters needs a noise of kind sum or turbulence".to_owned()),
        };
        let filters = &self.filters;
        let rising = filters.iter().all(|(a, b)| a.is_finite() && b.is_finite() && a < b);
        if filters.len() != octaves.octaves as usize || !rising || !filters.is_sorted_by(|a, b| a.0 <= b.0) {
            return Err(format!(
                "a disc with {} octaves needs as many filters (from, to), each from < to, sorted by from",
                octaves.octaves
            ));
        }
        let at = out.store([centre.x, centre.y, 1.0 / (radius * radius), *weight, centre.z + 0.0]);
        out.store(detail::parameters(None));
        out.store(filters.iter().flat_map(|(a, b)| [*a, 1.0 / (b - a)]));
        // The compact form of the octaves; their table follows from it.
        out.store([octaves.frequency, octaves.lacunarity, octaves.amplitude, octaves.gain, f64::from(seed)]);
        let first = out.octaves.len() as u32;
        out.octaves.extend(octaves.place(seed, [0.0; 2]));
        Ok(Code { at, turbulence, first, octaves: octaves.octaves })
    }
}

impl Code {
    #[inline(always)]
    fn octaves<'a>(&self, tables: Tables<'a>) -> &'a [Octave<2>] {
        &tables.octaves[self.first as usize..(self.first + self.octaves) as usize]
    }
    /// Σ aₖ·bₖ(κ)·ηₖ, `noise` giving η. A filter that is 0 for certain leaves its octave out: its term is 0.
    #[inline(always)]
    fn sum<R: Number, P: Copy + Into<f64>>(
        &self,
        p: Parameters<P>,
        octaves: &[Octave<2>],
        kappa: R,
        noise: impl Fn(&Octave<2>) -> R,
    ) -> R {
        let mut sum = R::zero();
        for (k, octave) in octaves.iter().enumerate() {
            let b = detail::filter(kappa, p.get(FILTERS + 2 * k), p.get(FILTERS + 2 * k + 1));
            if R::zero().less(b).may_hold() {
                let eta = noise(octave);
                let eta = if self.turbulence { eta.abs() } else { eta };
                sum = sum + R::constant(octave.amplitude) * b * eta;
            }
        }
        sum
    }
}

impl Leaf for Code {
    #[inline(always)]
    fn at(&self) -> u32 {
        self.at
    }
    fn fields(&self, out: &mut Vec<u32>) {
        out.extend([self.at, self.first, self.octaves, u32::from(self.turbulence)]);
    }
    fn words(&self) -> usize {
        2
    }
    #[inline(always)]
    fn sample<R: Number, P: Copy + Into<f64>>(&self, p: Parameters<P>, tables: Tables<'_>, x: [R; 2]) -> Operand<R> {
        let weight: R = disc::weight(p, x);
        let mut elevation: R = p.get(4);
        if self.octaves > 0 && R::zero().less(weight).may_hold() {
            let c = p.pair::<R>(0);
            let at = if tables.tiled { x } else { [x[0] - c[0], x[1] - c[1]] };
            let kappa = detail::kappa::<R, P>(p.from(FOCUS), x);
            let sum = self.sum(
                p,
                self.octaves(tables),
                kappa,
                #[inline(always)]
                |octave| R::gradient2(octave.lattice, octave.coordinates(at)),
            );
            elevation = elevation + sum;
        }
        Operand::new(elevation, weight)
    }
    fn weight_range(&self, p: Parameters<f64>, region: &Region) -> Interval {
        disc::weight_range(p, region)
    }
    /// Along any direction ∂(a·b·η) = a·(b·∂η + η·b′·∂κ), |∂η| ≤ f·λ_η, |∂κ| ≤ λ_κ: the second term is forgotten in the
    /// paper (claims G8). Computed on a dual of intervals in one arbitrary direction; on narrow boxes the formula itself
    /// on both.
    fn bounds(&self, p: Parameters<f64>, tables: Tables<'_>, region: &Region) -> Bounds {
        let (weight, weight_slope) = disc::weight_bounds(p, region);
        if weight.hi() <= 0.0 {
            return Bounds::ABSENT;
        }
        let octaves = self.octaves(tables);
        let (kappa, kappa_slope) = detail::kappa_bounds(p.from(FOCUS), region);
        let any = Dual::<Interval, 1> { value: kappa, slope: [Interval::symmetric(kappa_slope)] };
        let whole = self.sum(p, octaves, any, |octave| Dual {
            value: Interval::symmetric(GRADIENT2_RANGE),
            slope: [Interval::point(octave.frequency) * Interval::symmetric(GRADIENT2_SLOPE)],
        });
        let (mut range, mut slope) = (whole.value, whole.slope[0].magnitude());
        let width = region.extent[0].width().max(region.extent[1].width());
        if octaves.first().is_some_and(|octave| width * octave.frequency < disc::LOCAL) {
            let at = [0, 1].map(|axis| Dual::<Interval, 2>::variable(region.extent[axis], axis));
            let from = [0, 1].map(|axis| at[axis] - Dual::fixed(Interval::point(p.0[axis])));
            let kappa = if kappa_slope == 0.0 { Dual::fixed(kappa) } else { detail::kappa(p.from(FOCUS), at) };
            let near = self.sum(p, octaves, kappa, |octave| local(octave, from, width));
            range = range.meet(near.value);
            slope = slope.min(Interval::length(near.slope[0], near.slope[1]).hi());
        }
        Bounds::primitive(Interval::point(p.0[4]) + range, weight, slope, weight_slope)
    }
    fn support(&self, p: Parameters<f64>) -> Option<Extent> {
        around([DVec2::new(p.0[0], p.0[1])], 1.0 / p.0[2].sqrt())
    }
    fn weight_only(self) -> Code {
        Code { octaves: 0, ..self }
    }
    fn pruned(self, p: Parameters<f64>, region: &Region) -> Code {
        let kappa = detail::kappa_bounds(p.from(FOCUS), region).0;
        // Filters are sorted: once one is 0 on the box, so are those that follow.
        let left = (0..self.octaves).take_while(|k| kappa.hi() > p.0[FILTERS + 2 * *k as usize]).count();
        Code { octaves: left as u32, ..self }
    }
    /// A term is at most a·sup b·sup|η| high and a·(sup b·f·λ_η + sup|η|·λ_b·λ_κ) steep.
    fn simplified(
        self,
        p: Parameters<f64>,
        tables: Tables<'_>,
        region: &Region,
        slope: f64,
        _: &mut Vec<NoiseBounds>,
    ) -> (Code, f64) {
        let octaves = self.octaves(tables);
        let (kappa, kappa_slope) = detail::kappa_bounds(p.from(FOCUS), region);
        let along = Dual::<Interval, 1> { value: kappa, slope: [Interval::symmetric(kappa_slope)] };
        let term = |k: usize| {
            let b = detail::filter(along, p.get(FILTERS + 2 * k), p.get(FILTERS + 2 * k + 1));
            let Octave { amplitude, frequency, .. } = octaves[k];
            let (size, share) = (amplitude.abs(), b.value.hi().clamp(0.0, 1.0));
            let steep = plus_up(
                times_up(share, times_up(frequency, GRADIENT2_SLOPE)),
                times_up(GRADIENT2_RANGE, b.slope[0].magnitude()),
            );
            (times_up(times_up(size, share), GRADIENT2_RANGE), times_up(size, steep))
        };
        let (left, error) = disc::trailing(octaves.len(), slope, term);
        (Code { octaves: left as u32, ..self }, error)
    }
    fn octaves(&self) -> usize {
        self.octaves as usize
    }
    fn focus(&self) -> Option<FocusSlot> {
        Some(FocusSlot { offset: FOCUS, count: FILTERS + 2 * self.octaves as usize })
    }
    fn stored_at(self, at: u32) -> Code {
        Code { at, ..self }
    }
    fn rebase(&self, p: Parameters<f64>, tables: Tables<'_>, origin: DVec2, tile: &mut TileLayout) -> Code {
        let [x, y] = [p.0[0] - origin.x, p.0[1] - origin.y];
        let at = tile.store([x, y].into_iter().chain(p.0[2..FOCUS].iter().copied()));
        tile.store(detail::rebased(&p.0[FOCUS..], origin));
        tile.store(p.0[FILTERS..FILTERS + 2 * self.octaves as usize].iter().copied());
        let first = tile.octaves.len() as u32;
        // From the centre, which is the origin of the octaves, to the tile's.
        let moved = self.octaves(tables).iter().map(|octave| octave.moved_to([-x, -y]).rounded());
        tile.octaves.extend(moved);
        Code { at, first, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detail::Focus;
    use crate::noise::Octaves;
    use crate::program::Program;
    use crate::tree::Tree;
    use glam::DVec3;

    const OCTAVES: Octaves = Octaves { octaves: 6, frequency: 0.002, lacunarity: 2.0, gain: 0.6, amplitude: 60.0 };

    fn disc(combination: Combination) -> Disc {
        let noise = Some(DiscNoise { combination, octaves: OCTAVES, seed: 9 });
        Disc { centre: DVec3::new(0.0, 0.0, 100.0), radius: 20_000.0, weight: 1.0, noise }
    }
    fn compile(filters: Vec<(f64, f64)>) -> Result<Program, String> {
        let mut tree = Tree::new();
        let root = tree.push(DetailDisc { disc: disc(Combination::Sum), filters });
        Program::compile(&tree, root).map_err(|error| error.problem)
    }
    fn focused() -> Program {
        let focus = Focus { position: DVec2::new(-4000.0, 500.0), near: 300.0, far: 8000.0 };
        compile(DetailDisc::even_filters(6)).expect("it compiles").with_focus(Some(&focus))
    }

    #[test]
    fn pruning_drops_octaves_far_from_the_focus_changes_no_bit_and_lowers_the_slope_bound() {
        let program = focused();
        let full = compile(DetailDisc::even_filters(6)).expect("it compiles");
        let mut seen = [false; 7];
        for k in 0..60 {
            let a = DVec2::new(-4000.0 + 150.0 * f64::from(k), 100.0);
            let b = a + DVec2::splat(64.0);
            let region = Region::rectangle(a, b);
            let pruned = program.prune(region);
            seen[pruned.octaves()] = true;
            for l in 0..20 {
                let p = a + (b - a) * DVec2::new(f64::from(l) / 19.0, f64::from(l * 7 % 20) / 19.0);
                let (x, y) = (program.height(p), pruned.height(p));
                assert_eq!((x.0.to_bits(), x.1.to_bits()), (y.0.to_bits(), y.1.to_bits()));
            }
            let (less, all) = (pruned.bounds(region).slope, program.bounds(region).slope);
            assert!(less <= all && less > all * (1.0 - 1e-12));
            if pruned.octaves() < 3 {
                assert!(program.bounds(region).slope < 0.5 * full.bounds(region).slope);
            }
        }
        // Far off one octave is left, near the focus all are.
        assert!(seen[1] && seen[6] && seen[2..6].iter().all(|s| *s) && !seen[0], "{seen:?}");
    }

    #[test]
    fn at_full_detail_it_is_the_plain_disc_but_for_the_order_of_products() {
        let full = compile(DetailDisc::even_filters(6)).expect("it compiles");
        let mut tree = Tree::new();
        let root = tree.push(disc(Combination::Sum));
        let plain = Program::compile(&tree, root).expect("it compiles");
        for k in 0..200 {
            let p = DVec2::new(37.0 * f64::from(k), -23.0 * f64::from(k));
            assert!((full.height(p).0 - plain.height(p).0).abs() < 1e-11);
        }
    }

    #[test]
    fn the_slope_stays_within_its_bound_where_the_rule_without_kappa_does_not_hold() {
        // One octave as long as the world under a sharp filter: nearly all of the slope is that of κ (claims G8).
        let octaves = Octaves { octaves: 1, frequency: 1e-5, lacunarity: 2.0, gain: 0.5, amplitude: 1000.0 };
        let noise = Some(DiscNoise { combination: Combination::Sum, octaves, seed: 4 });
        let disc = Disc { centre: DVec3::new(40_000.0, 35_000.0, 0.0), radius: 1e6, weight: 1.0, noise };
        let mut tree = Tree::new();
        let root = tree.push(DetailDisc { disc, filters: vec![(0.4, 0.5)] });
        let focus = Focus { position: DVec2::ZERO, near: 0.0, far: 1000.0 };
        let program = Program::compile(&tree, root).expect("it compiles").with_focus(Some(&focus));
        let without = 1000.0 * 1e-5 * GRADIENT2_SLOPE;
        let bounds = program.bounds(Region::rectangle(DVec2::new(0.0, -5.0), DVec2::new(1000.0, 5.0)));
        let steepest = (0..2000)
            .map(|k| program.sample(DVec2::new(0.5 * f64::from(k), 0.0)).gradient.length())
            .fold(0.0, f64::max);
        assert!(steepest <= bounds.slope && steepest > 5.0 * without, "{steepest} {without} {bounds:?}");
    }

    #[test]
    fn filters_that_do_not_fit_are_refused() {
        assert!(compile(vec![(0.0, 1.0)]).unwrap_err().contains("as many filters"));
        assert!(compile((0..6).map(|k| (0.5 - 0.1 * f64::from(k), 0.6)).collect()).unwrap_err().contains("sorted"));
        let mut tree = Tree::new();
        let ridged = Combination::Ridged { offset: 1.0, sharpness: 2.0 };
        let root = tree.push(DetailDisc { disc: disc(ridged), filters: DetailDisc::even_filters(6) });
        assert!(Program::compile(&tree, root).unwrap_err().problem.contains("sum or turbulence"));
    }
}
