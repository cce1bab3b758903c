//! Whether tessellation cracks: a census of the edges of every leaf's lattice and of pixels that show no ground, for random cameras,
//! on the processor's twin.

use super::cameras::{JACKSBORO, Place, above, camera, places};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Table};
use rayon::prelude::*;
use std::collections::BTreeSet;
use terrain_gpu::tessellate::census::Census;
use terrain_gpu::tessellate::coverage::{Corners, Image};
use terrain_gpu::tessellate::refine::Refinement;
use terrain_gpu::tessellate::triangle::Triangle;
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "tessellation/cracks",
    title: "Cracks, T-junctions and culled triangles",
    section: "§6; implied by every figure",
    about: "For random cameras over a real and a synthetic ground, every inner edge of the tessellation must have exactly two triangles, \
            no displaced triangle of a culled leaf may cover a pixel's middle, and cameras from above, whose frame the ground fills, \
            may show no background. Images have 240 × 135 pixels. The controls shrink every second radius to 0.6 of itself, which \
            breaks the nesting, and leave out one leaf.",
    code: "experiments/src/tessellation/cracks.rs",
    test: "gpu/src/tessellate/tests.rs::every_inner_edge_has_two_triangles_and_a_broken_rule_shows",
    expected: |profile| Expected { seconds: profile.pick(30.0, 300.0), memory_bytes: 256 << 20, disk_bytes: 16 << 10 },
    run,
};

/// Target length of edges, pixels: coarse, so that a thousand cameras fit. The rule is the same at any length.
const TARGET: f64 = 48.0;
/// Columns and rows of the images in which pixels are counted.
const SIZE: [usize; 2] = [240, 135];

#[derive(Clone, Copy, Default)]
struct Found {
    leaves: usize,
    census: Census,
    control: usize,
    culled: usize,
    culled_visible: usize,
}

impl Found {
    fn plus(self, other: Found) -> Found {
        Found {
            leaves: self.leaves + other.leaves,
            census: Census {
                cracks: self.census.cracks + other.census.cracks,
                t_junctions: self.census.t_junctions + other.census.t_junctions,
            },
            control: self.control + other.control,
            culled: self.culled + other.culled,
            culled_visible: self.culled_visible + other.culled_visible,
        }
    }
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let cameras = ctx.profile.pick(1000u32, 10_000);
    let places = places()?;
    let seed = ctx.seed_for("cameras");
    let one = |k: u32| -> Result<Found, ExperimentError> {
        let place = &places[k as usize % places.len()];
        let view = camera(place, seed, k)?;
        let mut refinement = Refinement::new(&place.ground, &place.detail, view, TARGET, 24);
        let leaves = refinement.leaves(false);
        let kept: BTreeSet<Triangle> = refinement.leaves(true).into_iter().collect();
        let culled: Vec<&Triangle> = leaves.iter().filter(|leaf| !kept.contains(leaf)).collect();
        let image = Image { view: &view, size: SIZE };
        let visible = |leaf: &&&Triangle| refinement.patch(leaf).iter().any(|corners| image.shows(corners));
        let culled_visible = culled.iter().filter(visible).count();
        let (count, culled, census) = (leaves.len(), culled.len(), Census::of(&leaves, place.ground.end()));
        refinement.radii_mut().iter_mut().skip(1).step_by(2).for_each(|radius| *radius *= 0.6);
        let control = Census::of(&refinement.leaves(false), place.ground.end()).cracks;
        Ok(Found { leaves: count, census, control, culled, culled_visible })
    };
    let each: Vec<Found> = (0..cameras).into_par_iter().map(one).collect::<Result<_, _>>()?;
    let mut table = Table::new("census", "Edges and culled leaves, all cameras together")
        .column("ground")
        .column("leaves")
        .column("cracks")
        .column("T-junctions")
        .column("cracks of the control")
        .column("culled leaves")
        .column("of these visible");
    let mut whole = Found::default();
    for (at, place) in places.iter().enumerate() {
        let sum = each.iter().skip(at).step_by(places.len()).fold(Found::default(), |sum, found| sum.plus(*found));
        let Found { leaves, census, control, culled, culled_visible } = sum;
        let counts = [leaves, census.cracks, census.t_junctions, control, culled, culled_visible];
        table.row(std::iter::once(place.name.into()).chain(counts.map(|n| Cell::number(n as f64, "", 9))));
        whole = whole.plus(sum);
    }
    let from_above = ctx.profile.pick(40u32, 400);
    let frames = (0..from_above).into_par_iter().map(|k| frame(&places[k as usize % places.len()], seed, k));
    let frames: Vec<[usize; 3]> = frames.collect::<Result<_, ExperimentError>>()?;
    let [background, torn, least] = [
        frames.iter().map(|frame| frame[0]).sum::<usize>(),
        frames.iter().map(|frame| frame[1]).sum(),
        frames.iter().map(|frame| frame[2]).min().unwrap_or(0),
    ];
    let sound = whole.census == Census::default() && whole.culled_visible + background == 0;
    let mut outcome = Outcome::new(if sound { Verdict::Reproduced } else { Verdict::NotReproduced });
    outcome.input("jacksboro.tif", JACKSBORO);
    outcome.table(table)?;
    outcome.metric("cameras", f64::from(cameras))?;
    outcome.metric("cracks", whole.census.cracks as f64)?;
    outcome.metric("t_junctions", whole.census.t_junctions as f64)?;
    outcome.metric("control_cracks", whole.control as f64)?;
    outcome.metric("background_cameras", f64::from(from_above))?;
    outcome.metric("background_pixels", background as f64)?;
    outcome.metric("control_background_pixels", torn as f64)?;
    outcome.metric("culled_visible", whole.culled_visible as f64)?;
    outcome.control("odd radii", "every second radius × 0.6", "the census finds cracks", whole.control > 1000);
    outcome.control("a leaf left out", "one of those in the image", "background in every frame", least > 0);
    outcome.control("odd radii, seen", "every second radius × 0.6", "background in some frames", torn > 0);
    Ok(outcome)
}

/// Background pixels of a frame that the ground fills: as it is, with the broken rule, and with the leaf left out that covers most.
fn frame(place: &Place, seed: u64, k: u32) -> Result<[usize; 3], ExperimentError> {
    let view = above(place, seed, k)?;
    let image = Image { view: &view, size: SIZE };
    let mut refinement = Refinement::new(&place.ground, &place.detail, view, TARGET, 24);
    let patches = |refinement: &Refinement<'_>| -> Vec<Vec<Corners>> {
        refinement.leaves(true).iter().map(|leaf| refinement.patch(leaf)).collect()
    };
    let whole = patches(&refinement);
    let covers = |patch: &[Corners]| SIZE[0] * SIZE[1] - image.background(patch);
    let most = (0..whole.len()).max_by_key(|k| covers(&whole[*k]));
    let lacking = whole.iter().enumerate().filter(|(k, _)| Some(*k) != most).flat_map(|(_, patch)| patch);
    let [background, lacking] = [image.background(whole.iter().flatten()), image.background(lacking)];
    refinement.radii_mut().iter_mut().skip(1).step_by(2).for_each(|radius| *radius *= 0.6);
    Ok([background, image.background(patches(&refinement).iter().flatten()), lacking])
}
