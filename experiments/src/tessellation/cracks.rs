//! Whether tessellation cracks: a census of the edges of every leaf's lattice, for random cameras, on the processor's twin.

use super::cameras::{JACKSBORO, camera, places};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Table};
use rayon::prelude::*;
use std::collections::BTreeSet;
use terrain_gpu::tessellate::census::Census;
use terrain_gpu::tessellate::refine::Refinement;
use terrain_gpu::tessellate::triangle::{LATTICE, Triangle};
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "tessellation/cracks",
    title: "Cracks, T-junctions and culled triangles",
    section: "§6; implied by every figure",
    about: "For random cameras over a real and a synthetic ground, every inner edge of the tessellation must have exactly two triangles, \
            and no displaced vertex of a culled leaf may fall in the image. The control shrinks every second radius to 0.6 of itself, \
            which breaks the nesting: the census must then find cracks.",
    code: "experiments/src/tessellation/cracks.rs",
    test: "gpu/src/tessellate/tests.rs::every_inner_edge_has_two_triangles_and_a_broken_rule_shows",
    expected: |profile| Expected { seconds: profile.pick(30.0, 300.0), memory_bytes: 256 << 20, disk_bytes: 16 << 10 },
    run,
};

/// Target length of edges, pixels: coarse, so that a thousand cameras fit. The rule is the same at any length.
const TARGET: f64 = 48.0;

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
        let visible = |leaf: &&&Triangle| {
            let corners: BTreeSet<_> = leaf.lattice(LATTICE).iter().flat_map(Triangle::corners).collect();
            corners.into_iter().any(|vertex| view.sees(refinement.position(vertex)))
        };
        let culled_visible = culled.iter().filter(visible).count();
        let (count, culled, census) = (leaves.len(), culled.len(), Census::of(&leaves));
        refinement.radii_mut().iter_mut().skip(1).step_by(2).for_each(|radius| *radius *= 0.6);
        let control = Census::of(&refinement.leaves(false)).cracks;
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
    let sound = whole.census == Census::default() && whole.culled_visible == 0;
    let mut outcome = Outcome::new(if sound { Verdict::Reproduced } else { Verdict::NotReproduced });
    outcome.input("jacksboro.tif", JACKSBORO);
    outcome.table(table)?;
    outcome.metric("cameras", f64::from(cameras))?;
    outcome.metric("cracks", whole.census.cracks as f64)?;
    outcome.metric("t_junctions", whole.census.t_junctions as f64)?;
    outcome.metric("control_cracks", whole.control as f64)?;
    outcome.metric("culled_visible", whole.culled_visible as f64)?;
    outcome.control("odd radii", "every second radius × 0.6", "the census finds cracks", whole.control > 1000);
    outcome.deviation(
        "Background pixels between triangles are not counted here.",
        "The census is of integer vertices; positions are a pure function of those, so that shared edges coincide.",
    );
    Ok(outcome)
}
