//! Popping: how far points of the surface jump on the screen from one frame of a flight to the next.

use super::cameras::{JACKSBORO, places};
use super::scenes::{detail, looking, mountain};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Axis, Cell, Outcome, Plot, Style, Table};
use rayon::prelude::*;
use terrain_gpu::tessellate::displace::{Detail, Space};
use terrain_gpu::tessellate::ground::Ground;
use terrain_gpu::tessellate::popping::jumps;
use terrain_gpu::tessellate::refine::Refinement;
use terrain_gpu::tessellate::view::View;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "tessellation/popping",
    title: "Popping over a flight",
    section: "§6; the paper does not speak of it",
    about: "Two frames of a flight are compared over the common refinement of their triangles, both seen from the second camera, so that \
            the camera's own motion is not in it. Each point's jump in pixels is held against a bound by intervals: what slopes of the \
            displaced surface vary by over the coarser triangle, and what the band limit changes. Points that something nearer hides \
            count too. Controls: bounds of the ground without detail, octaves that no band limit fades, and four levels more \
            everywhere from one frame to the next.",
    code: "experiments/src/tessellation/popping.rs",
    test: "gpu/src/tessellate/popping.rs::no_point_jumps_farther_than_its_bound_and_detail_without_a_band_limit_jumps_farther",
    expected: |profile| Expected {
        seconds: profile.pick(8.0, 3600.0),
        memory_bytes: profile.pick(256 << 20, 4 << 30),
        disk_bytes: 64 << 10,
    },
    run,
};

/// Metres from frame to frame: 480 m/s at 60 frames a second.
const STEP: f64 = 8.0;
/// Metres of climb per metre.
const CLIMB: f64 = 0.4;
/// Levels that come at once in a control.
const LEVELS: f64 = 4.0;
/// Finest level of leaves.
const FINEST: u32 = 28;

struct Flight {
    name: &'static str,
    ground: Ground,
    detail: Detail,
    from: View,
}

/// What a flight showed.
#[derive(Default)]
struct Found {
    pixels: Vec<f32>,
    switched: u64,
    beyond: u64,
    /// Points without a bound: what the surface varies by there reaches the eye.
    open: u64,
    /// Largest jump, and the largest over its bound.
    largest: [f64; 2],
}

impl Found {
    fn of(frames: [&Refinement<'_>; 2], promised: [&Refinement<'_>; 2]) -> Found {
        let mut found = Found::default();
        jumps(frames, promised, |jump| {
            found.pixels.push(jump.pixels as f32);
            found.switched += u64::from(jump.switched);
            found.beyond += u64::from(jump.pixels > jump.bound);
            found.open += u64::from(jump.bound.is_infinite());
            let part = jump.pixels / jump.bound.max(f64::MIN_POSITIVE);
            found.largest = [found.largest[0].max(jump.pixels), found.largest[1].max(part)];
        });
        found
    }
    fn plus(mut self, other: Found) -> Found {
        self.pixels.extend(other.pixels);
        self.switched += other.switched;
        self.beyond += other.beyond;
        self.open += other.open;
        self.largest = [0, 1].map(|k| self.largest[k].max(other.largest[k]));
        self
    }
    /// The jump that a thousandth of the points exceed.
    fn thousandth(&mut self) -> f64 {
        let at = self.pixels.len() * 999 / 1000;
        if at >= self.pixels.len() {
            return 0.0;
        }
        f64::from(*self.pixels.select_nth_unstable_by(at, f32::total_cmp).1)
    }
}

fn flights(ctx: &Context) -> Result<[Flight; 2], ExperimentError> {
    let size = ctx.profile.pick([480, 270], [1920, 1080]);
    let ground = Ground::new(&mountain(ctx.profile.pick(65, 129))?, 0.6).map_err(ExperimentError::failed)?;
    let octaves = detail(&ground, 3.0, Space::Volume)?;
    let from = looking((&ground, &octaves), [0.40, 0.28, 60.0], [0.515, 0.60, 60.0], size)?;
    let mountain = Flight { name: "mountain", ground, detail: octaves, from };
    let [place, _] = places()?;
    let from = looking((&place.ground, &place.detail), [0.3, 0.3, 40.0], [0.45, 0.5, 0.0], size)?;
    Ok([mountain, Flight { name: "Jacksboro", ground: place.ground, detail: place.detail, from }])
}

impl Flight {
    fn view(&self, frame: u32) -> View {
        let mut view = self.from;
        let [x, y, _] = self.from.axes[2];
        let along = STEP * f64::from(frame) / (x * x + y * y).sqrt();
        view.eye = [view.eye[0] + along * x, view.eye[1] + along * y, view.eye[2] + CLIMB * STEP * f64::from(frame)];
        view
    }
    /// All frames with edges of `target` pixels: as they are, with bounds of the bare ground, without a band limit, with levels more.
    fn fly(&self, frames: u32, target: f64, controls: bool) -> Result<[Found; 4], ExperimentError> {
        let bare = detail(&self.ground, 0.0, Space::Volume)?;
        let pair = |frame: u32| {
            let both = |detail, target| {
                [frame, frame + 1].map(|frame| Refinement::new(&self.ground, detail, self.view(frame), target, FINEST))
            };
            let [a, b] = both(&self.detail, target);
            let right = Found::of([&a, &b], [&a, &b]);
            if !controls {
                return [right, Found::default(), Found::default(), Found::default()];
            }
            let [c, d] = both(&bare, target);
            let bounds = Found::of([&a, &b], [&c, &d]);
            let mut fine = both(&self.detail, 1e-3);
            fine.iter_mut().for_each(|r| r.radii_mut().copy_from_slice(a.radii()));
            let [c, d] = fine;
            let fine = Found::of([&c, &d], [&a, &b]);
            let [_, more] = both(&self.detail, target * libm::exp2(-LEVELS / 2.0));
            let [_, mut later] = both(&self.detail, target);
            later.radii_mut().copy_from_slice(more.radii());
            [right, bounds, fine, Found::of([&a, &later], [&a, &b])]
        };
        let each: Vec<[Found; 4]> = (0..frames).into_par_iter().map(pair).collect();
        let sum = |all: [Found; 4], found: [Found; 4]| {
            let mut pairs = all.into_iter().zip(found);
            std::array::from_fn(|_| pairs.next().map_or_else(Found::default, |(a, b)| a.plus(b)))
        };
        Ok(each.into_iter().fold(std::array::from_fn(|_| Found::default()), sum))
    }
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let frames = ctx.profile.pick(8u32, 120);
    let targets: &[f64] = ctx.profile.pick(&[32.0, 16.0, 8.0], &[32.0, 16.0, 8.0, 4.0]);
    let mut outcome = Outcome::new(Verdict::Reproduced);
    outcome.input("jacksboro.tif", JACKSBORO);
    let mut table = Table::new("jumps", "From one frame to the next, 8 m farther")
        .column("ground")
        .column("edge")
        .column("points")
        .column("whose triangles change")
        .column("largest jump")
        .column("a thousandth jump more than")
        .column("largest share of its bound")
        .column("without a bound");
    let mut plot = Plot::new("largest", "Largest jump", Axis::log("edge (px)"), Axis::log("jump (px)"));
    let (mut beyond, mut unseen, mut most_open, mut controls) = (0, false, 0.0f64, Vec::<[f64; 3]>::new());
    let progress = ctx.progress("flights", 2 * targets.len() as u64);
    for flight in flights(ctx)? {
        let mut series = Vec::new();
        for &target in targets {
            let with_controls = target == targets[1];
            let [mut right, bare, fine, more] = flight.fly(frames, target, with_controls)?;
            let thousandth = right.thousandth();
            let open = right.open as f64 / right.pixels.len().max(1) as f64;
            most_open = most_open.max(open);
            table.row([
                flight.name.into(),
                Cell::number(target, "px", 3),
                Cell::count(right.pixels.len() as u64),
                Cell::count(right.switched),
                Cell::number(right.largest[0], "px", 3),
                Cell::number(thousandth, "px", 3),
                Cell::number(right.largest[1], "", 3),
                Cell::number(100.0 * open, "%", 3),
            ]);
            let name = format!("{}.edge{target}", flight.name.to_lowercase());
            outcome.metric(&format!("{name}.largest_pixels"), right.largest[0])?;
            outcome.metric(&format!("{name}.thousandth_pixels"), thousandth)?;
            outcome.metric(&format!("{name}.switched_points"), right.switched as f64)?;
            series.push((target, right.largest[0]));
            beyond += right.beyond;
            unseen |= right.switched == 0;
            if with_controls {
                outcome.metric(&format!("{name}.largest_pixels_without_band_limit"), fine.largest[0])?;
                outcome.metric(&format!("{name}.largest_pixels_with_levels_more"), more.largest[0])?;
                let over = [fine.largest[0], more.largest[0]].map(|most| most / right.largest[0]);
                // Detail of Jacksboro is a thirtieth of the mountain's: its jumps are the raster's own, band limit or not.
                let without_limit = if controls.is_empty() { over[0] } else { f64::INFINITY };
                controls.push([bare.beyond as f64, without_limit, over[1]]);
            }
            progress.advance(1);
        }
        let [(coarse, most), (fine, least)] = [series[0], series[series.len() - 1]];
        let order = libm::log2(most / least) / libm::log2(coarse / fine);
        outcome.metric(&format!("{}.order", flight.name.to_lowercase()), order)?;
        plot = plot.series(flight.name, Style::LineAndPoints, series);
    }
    outcome.table(table)?;
    outcome.plot(plot)?;
    let controls = [0, 1, 2].map(|k| controls.iter().map(|found| found[k]).fold(f64::INFINITY, f64::min));
    outcome.metric("beyond_bounds", beyond as f64)?;
    outcome.metric("without_bound_percent", 100.0 * most_open)?;
    outcome.metric("control_beyond_bounds", controls[0])?;
    outcome.control("other bounds", "those of the ground without detail", "points jump farther", controls[0] > 0.0);
    outcome.control("no band limit", "octaves finer than edges, on the mountain", "a larger jump", controls[1] > 1.0);
    outcome.control("four levels more", "everywhere at once", "a larger jump on both grounds", controls[2] > 1.0);
    // Bounds that are nowhere would hold everywhere.
    if beyond > 0 || unseen || most_open > 0.1 {
        let why = format!(
            "{beyond} points jump farther than their bound, {} of a flight's have none; or a flight in which nothing changes",
            most_open
        );
        outcome.set_verdict(Verdict::NotReproduced, why);
    }
    Ok(outcome)
}
