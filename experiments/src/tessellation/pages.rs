//! A ground larger than memory: which of its pages a flight needs, and that pages are the whole to the bit.

use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Cell, Outcome, Table};
use rayon::prelude::*;
use terrain_gpu::tessellate::displace::{Detail, Space};
use terrain_gpu::tessellate::ground::Ground;
use terrain_gpu::tessellate::pages::{Elevations, PAGE};
use terrain_gpu::tessellate::refine::Refinement;
use terrain_gpu::tessellate::triangle::{FINEST, SIDE, Vertex};
use terrain_gpu::tessellate::view::View;
use terrain_model::grid::Grid;
use terrain_model::noise::{Combination, Octave, Octaves, mix};
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "tessellation/pages",
    title: "Grounds in pages",
    section: "§4: 16385 × 16385 samples",
    about: "Elevations are read in pages of 256 × 256 cells, each when it is first asked for, at most so many in memory; enclosures of 16 \
            cells and above stay, so that what is not seen is culled without its page. A flight over hills made of noise refines and \
            displaces all that it sees. Vertices and leaves are compared with those of the same raster in memory. The control reads \
            windows a column off.",
    code: "experiments/src/tessellation/pages.rs",
    test: "gpu/src/tessellate/pages.rs::a_ground_in_pages_is_the_whole_to_the_bit_and_one_read_a_column_off_is_not",
    expected: |profile| Expected {
        seconds: profile.pick(8.0, 240.0),
        memory_bytes: profile.pick(512 << 20, 1 << 30),
        disk_bytes: 16 << 10,
    },
    run,
};

/// Samples along a side of the raster that is also held in memory.
const SMALL: usize = 1025;
/// Pages in memory at most.
const MOST: usize = 48;

/// Hills 10 m apart, made where they are asked for.
#[derive(Clone)]
struct Hills {
    side: usize,
    shift: usize,
    octaves: Vec<Octave<2>>,
}

impl Hills {
    fn new(side: usize, shift: usize) -> Hills {
        let octaves = Octaves { octaves: 5, frequency: 1.0 / 4000.0, lacunarity: 2.0, gain: 0.45, amplitude: 500.0 }
            .place(17, [0.0; 2]);
        Hills { side, shift, octaves }
    }
    fn elevation(&self, i: usize, j: usize) -> f64 {
        Combination::Sum.plane(&self.octaves, [10.0 * (i + self.shift) as f64, 10.0 * j as f64])
    }
}

impl Elevations for Hills {
    fn size(&self) -> [usize; 2] {
        [self.side; 2]
    }
    fn spacing(&self) -> [f64; 2] {
        [10.0; 2]
    }
    fn window(&self, first: [usize; 2], last: [usize; 2]) -> Result<Vec<f64>, String> {
        let row = |j: usize| (first[0]..=last[0]).map(move |i| self.elevation(i, j));
        Ok((first[1]..=last[1]).flat_map(row).collect())
    }
}

fn detail() -> Result<Detail, ExperimentError> {
    let octaves = Octaves { octaves: 6, frequency: 0.05, lacunarity: 2.0, gain: 0.5, amplitude: 4.0 };
    Detail::new(&octaves, 3, Space::Volume).ok_or_else(|| ExperimentError::failed("octaves are not sound"))
}

/// Frame of a flight from the middle north, 80 m above the ground, looking down: the horizon would need all pages that lie towards it.
fn view(ground: &Ground, frame: u32, size: [usize; 2]) -> Result<View, ExperimentError> {
    let [x, y] = ground.extent().map(|side| side / 2.0);
    let y = y + 300.0 * f64::from(frame);
    let eye = [x, y, ground.elevation([x, y]) + 80.0];
    let half = size.map(|n| 0.5 * n as f64);
    View::new(eye, [0.05, 1.0, -0.62], 1.2 * half[0], half)
        .ok_or_else(|| ExperimentError::failed("a camera looks straight down"))
}

/// Leaves of a frame, and the sum of the displaced heights of all their vertices.
fn draw(ground: &Ground, detail: &Detail, view: View) -> (usize, f64) {
    let refinement = Refinement::new(ground, detail, view, 16.0, FINEST);
    let leaves = refinement.leaves(true);
    let sums: Vec<f64> =
        leaves.par_iter().map(|leaf| refinement.patch(leaf).iter().map(|corners| corners[0][2]).sum()).collect();
    (leaves.len(), sums.iter().sum())
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let detail = detail()?;
    let frame = ctx.profile.pick([480, 270], [1920, 1080]);
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let values = (0..SMALL * SMALL).into_par_iter().map(|at| Hills::new(SMALL, 0).elevation(at % SMALL, at / SMALL));
    let grid = Grid::new([0.0; 2].into(), [10.0; 2].into(), SMALL, SMALL, values.collect());
    let whole = Ground::new(&grid.map_err(ExperimentError::failed)?, 0.6).map_err(ExperimentError::failed)?;
    let paged = |side: usize, shift: usize| {
        Ground::paged(Box::new(Hills::new(side, shift)), 0.6, MOST).map_err(ExperimentError::failed)
    };
    let (small, control) = (paged(SMALL, 0)?, paged(SMALL, 1)?);
    let places = ctx.profile.pick(20_000u32, 200_000);
    let seed = ctx.seed_for("places") as u32;
    let unequal = |other: &Ground| {
        let differs = |k: u32| {
            let vertex: Vertex = [0, 1].map(|axis| mix(mix(seed, k), axis) & (SIDE - 1));
            detail.position(&whole, vertex, 0.0) != detail.position(other, vertex, 0.0)
        };
        (0..places).into_par_iter().filter(|k| differs(*k)).count()
    };
    let (different, control) = (unequal(&small), unequal(&control));
    let start = view(&whole, 0, frame)?;
    let same = draw(&whole, &detail, start) == draw(&small, &detail, start);

    let side = ctx.profile.pick(4097, 16_385);
    let ground = paged(side, 0)?;
    let mut table = Table::new("flight", "300 m a frame")
        .column("frame")
        .column("leaves")
        .column("pages that were needed so far")
        .column("of all");
    let (frames, mut needed, mut all) = (ctx.profile.pick(8, 60), 0, 0);
    for at in 0..frames {
        let (leaves, _) = draw(&ground, &detail, view(&ground, at, frame)?);
        let Some(residence) = ground.residence() else { return Err(ExperimentError::failed("a ground without pages")) };
        (needed, all) = (residence.resident[0], residence.pages);
        table.row([
            Cell::count(u64::from(at)),
            Cell::count(leaves as u64),
            Cell::count(needed as u64),
            Cell::count(all as u64),
        ]);
        if needed == MOST {
            // From here on pages leave again, and which depends on the threads.
            break;
        }
    }
    outcome.table(table)?;
    outcome.metric("samples_of_a_side", side as f64)?;
    outcome.metric("pages", all as f64)?;
    outcome.metric("pages_needed", needed as f64)?;
    outcome.metric("page_cells", PAGE as f64)?;
    outcome.metric("different_vertices", different as f64)?;
    outcome.metric("control_different_vertices", control as f64)?;
    let off = control * 2 > places as usize;
    outcome.control("another column", "windows a sample off", "more than half of the vertices differ", off);
    outcome.deviation("the paper's elevations of Puget Sound, 16385 × 16385", "hills of noise, as many in full");
    let failed = ground.failure();
    if different > 0 || !same || failed.is_some() || needed * 2 > all {
        let why =
            format!("{different} vertices differ; leaves are the same: {same}; {needed} of {all} pages; {failed:?}");
        outcome.set_verdict(Verdict::NotReproduced, why);
    }
    Ok(outcome)
}
