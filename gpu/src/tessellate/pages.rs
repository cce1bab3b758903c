//! A raster of which only the pages that were asked for are in memory, the least recently used going first. Coarse enclosures of all of it
//! stay, so that what a camera does not see is culled without its page.

use super::ground::GroundError;
use super::page::{Block, Frame, Page, Sample, Window, halved};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};

/// Cells along a page's side.
pub const PAGE: usize = 256;
/// Bytes of a page in memory: its samples and four levels of enclosures.
pub const PAGE_BYTES: u64 =
    ((PAGE + 1) * (PAGE + 1) * size_of::<Sample>() + PAGE * PAGE * size_of::<Block>() * 85 / 64) as u64;
/// Levels of enclosures that are in pages; blocks of the next, 16 cells wide, and all above stay.
pub(super) const LEVELS: usize = 4;

/// Where elevations come from.
pub trait Elevations: Send + Sync {
    /// Samples from west to east and from south to north.
    fn size(&self) -> [usize; 2];
    /// Metres between them.
    fn spacing(&self) -> [f64; 2];
    /// Elevations of columns and rows `first` to `last`, both included, row by row from the south, metres.
    ///
    /// # Errors
    /// One line that says what could not be read.
    fn window(&self, first: [usize; 2], last: [usize; 2]) -> Result<Vec<f64>, String>;
}

/// What pages did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Residence {
    /// Pages of the whole.
    pub pages: usize,
    /// Pages in memory now, and the most that may be.
    pub resident: [usize; 2],
    /// Pages that were made of the source, the first pass over all of them not counted.
    pub read: usize,
}

/// What stays of all pages.
pub(super) struct Summary {
    /// Enclosures of 16 cells and above, each level row by row.
    pub top: Vec<Vec<Block>>,
    /// Lowest and highest elevation.
    pub range: [f64; 2],
}

type Kept = HashMap<[usize; 2], (Arc<Page>, AtomicU64)>;

/// Pages of one raster.
pub(super) struct Pages {
    source: Box<dyn Elevations>,
    frame: Frame,
    /// Pages along a side of the square.
    along: usize,
    kept: RwLock<Kept>,
    most: usize,
    clock: AtomicU64,
    read: AtomicUsize,
    failure: Mutex<Option<String>>,
}

impl Pages {
    /// Reads all of `source` once, page after page, for the enclosures that stay: those of 16 cells and above, and the range.
    pub fn new(
        source: Box<dyn Elevations>,
        frame: Frame,
        cells: usize,
        most: usize,
    ) -> Result<(Pages, Summary), GroundError> {
        let along = cells / PAGE;
        let pages = Pages {
            source,
            frame,
            along,
            kept: RwLock::new(HashMap::new()),
            most: most.max(4),
            clock: AtomicU64::new(0),
            read: AtomicUsize::new(0),
            failure: Mutex::new(None),
        };
        let (side, wide) = (PAGE >> LEVELS, cells >> LEVELS);
        let summary = |at: usize| -> Result<(Vec<Block>, [f64; 2]), GroundError> {
            let page = pages.load([at % along, at / along])?;
            Ok((page.pyramid()[LEVELS].clone(), page.range()))
        };
        let all: Vec<(Vec<Block>, [f64; 2])> =
            (0..along * along).into_par_iter().map(summary).collect::<Result<_, _>>()?;
        let block = |at: usize| {
            let (i, j) = (at % wide, at / wide);
            all[(j / side) * along + i / side].0[(j % side) * side + i % side]
        };
        let top = halved((0..wide * wide).map(block).collect(), wide);
        let range = all.iter().fold([f64::MAX, f64::MIN], |[low, high], (_, r)| [low.min(r[0]), high.max(r[1])]);
        Ok((pages, Summary { top, range }))
    }
    fn load(&self, page: [usize; 2]) -> Result<Page, GroundError> {
        let first = page.map(|k| k * PAGE);
        let [low, high] = self.frame.reads(first, PAGE);
        let values = self.source.window(low, high).map_err(GroundError::Source)?;
        let width = high[0] - low[0] + 1;
        if values.len() != width * (high[1] - low[1] + 1) {
            return Err(GroundError::Source(format!("a window of {} elevations has {width} columns", values.len())));
        }
        if let Some(at) = values.iter().position(|z| !z.is_finite()) {
            return Err(GroundError::Hole { i: low[0] + at % width, j: low[1] + at / width });
        }
        Ok(self.frame.page(first, PAGE, &Window { first: low, width, values }))
    }
    /// The page with a cell. A source that fails leaves level ground there and is told by [`Pages::failure`].
    pub fn with(&self, cell: [usize; 2]) -> Arc<Page> {
        let at = cell.map(|k| k / PAGE);
        let now = self.clock.fetch_add(1, Ordering::Relaxed);
        let kept = self.kept.read().unwrap_or_else(PoisonError::into_inner);
        if let Some((page, used)) = kept.get(&at) {
            used.store(now, Ordering::Relaxed);
            return page.clone();
        }
        drop(kept);
        self.read.fetch_add(1, Ordering::Relaxed);
        let mut page = self.load(at).unwrap_or_else(|error| {
            let mut failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
            failure.get_or_insert_with(|| error.to_string());
            let first = at.map(|k| k * PAGE);
            let [low, high] = self.frame.reads(first, PAGE);
            let width = high[0] - low[0] + 1;
            let values = vec![0.0; width * (high[1] - low[1] + 1)];
            self.frame.page(first, PAGE, &Window { first: low, width, values })
        });
        page.keep_levels(LEVELS);
        let page = Arc::new(page);
        let mut kept = self.kept.write().unwrap_or_else(PoisonError::into_inner);
        // Another thread may have made it meanwhile, to the same bits.
        kept.insert(at, (page.clone(), AtomicU64::new(now)));
        while kept.len() > self.most {
            let oldest = kept.iter().min_by_key(|(at, (_, used))| (used.load(Ordering::Relaxed), **at));
            let Some(oldest) = oldest.map(|(at, _)| *at) else { break };
            kept.remove(&oldest);
        }
        page
    }
    /// What the source said when it failed first.
    pub fn failure(&self) -> Option<String> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
    /// What is in memory.
    pub fn residence(&self) -> Residence {
        let resident = self.kept.read().unwrap_or_else(PoisonError::into_inner).len();
        let read = self.read.load(Ordering::Relaxed);
        Residence { pages: self.along * self.along, resident: [resident, self.most], read }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tessellate::displace::Detail;
    use crate::tessellate::ground::Ground;
    use crate::tessellate::refine::Refinement;
    use crate::tessellate::tests::{camera, detail};
    use crate::tessellate::triangle::{SIDE, Vertex};
    use terrain_model::grid::Grid;
    use terrain_model::noise::mix;

    const SIZE: [usize; 2] = [701, 522];

    fn elevation(i: usize, j: usize) -> f64 {
        f64::from(mix(mix(5, i as u32), j as u32) >> 20) * 0.005 + 90.0 * ((i / 40 + j / 60) % 3) as f64
    }

    /// Elevations made where they are asked for, `shift` columns off; it fails when asked for a sample east of `end`, once it is armed.
    struct Made {
        shift: usize,
        end: Arc<AtomicUsize>,
    }

    impl Elevations for Made {
        fn size(&self) -> [usize; 2] {
            SIZE
        }
        fn spacing(&self) -> [f64; 2] {
            [30.0, 36.0]
        }
        fn window(&self, first: [usize; 2], last: [usize; 2]) -> Result<Vec<f64>, String> {
            if last[0] > self.end.load(Ordering::Relaxed) {
                return Err("the disk is gone".to_owned());
            }
            let row = |j: usize| (first[0]..=last[0]).map(move |i| elevation(i + self.shift, j));
            Ok((first[1]..=last[1]).flat_map(row).collect())
        }
    }

    fn made(shift: usize) -> Box<Made> {
        Box::new(Made { shift, end: Arc::new(AtomicUsize::new(usize::MAX)) })
    }

    fn whole() -> Ground {
        let values = (0..SIZE[0] * SIZE[1]).map(|at| elevation(at % SIZE[0], at / SIZE[0])).collect();
        let grid = Grid::new([0.0; 2].into(), [30.0, 36.0].into(), SIZE[0], SIZE[1], values).unwrap();
        Ground::new(&grid, 0.6).unwrap()
    }

    fn vertex(k: u32) -> Vertex {
        [0, 1].map(|axis| mix(mix(77, k), axis) & (SIDE - 1))
    }

    #[test]
    fn a_ground_in_pages_is_the_whole_to_the_bit_and_one_read_a_column_off_is_not() {
        let (whole, detail) = (whole(), detail());
        let [paged, control] = [0, 1].map(|shift| Ground::paged(made(shift), 0.6, 32).unwrap());
        assert_eq!((whole.range(), whole.extent(), whole.cells()), (paged.range(), paged.extent(), paged.cells()));
        let mut other = 0;
        for k in 0..3000 {
            let vertex = vertex(k);
            let position = |ground: &Ground| detail.position(ground, vertex, 0.0);
            assert_eq!(position(&whole), position(&paged), "{vertex:?}");
            other += usize::from(position(&whole) != position(&control));
            let reach = i64::from(SIDE >> (k % 14 + 1));
            let enclosure = |ground: &Ground| ground.enclosure(vertex, reach);
            assert_eq!(enclosure(&whole), enclosure(&paged), "{vertex:?} {reach}");
        }
        assert!(other > 1500, "{other}");
        for k in 0..3 {
            let leaves = |ground: &Ground| Refinement::new(ground, &detail, camera(&whole, k), 24.0, 24).leaves(true);
            assert!(leaves(&whole) == leaves(&paged), "camera {k}");
        }
        assert_eq!((whole.residence(), paged.residence().map(|r| r.pages)), (None, Some(16)));
    }

    #[test]
    fn pages_leave_when_there_is_no_room_and_come_again_the_same() {
        let (whole, detail) = (whole(), detail());
        let paged = Ground::paged(made(0), 0.6, 4).unwrap();
        for k in 0..120 {
            let position = |ground: &Ground| detail.position(ground, vertex(k), 0.0);
            assert_eq!(position(&whole), position(&paged));
        }
        let residence = paged.residence().unwrap();
        assert!(residence.resident == [4, 4] && residence.read > 40, "{residence:?}");
        // The one that was used last is still there.
        let _ = detail.position(&paged, vertex(119), 0.0);
        assert_eq!(paged.residence(), Some(residence));
    }

    #[test]
    fn pages_that_are_not_seen_are_not_read() {
        let paged = Ground::paged(made(0), 0.6, 64).unwrap();
        assert_eq!(paged.residence().map(|r| (r.resident[0], r.read)), Some((0, 0)));
        // Over the south-west, looking farther south-west.
        let view =
            crate::tessellate::view::View::new([2500.0, 2500.0, 900.0], [-1.0, -1.0, -0.6], 500.0, [480.0, 270.0]);
        let detail: Detail = detail();
        let refinement = Refinement::new(&paged, &detail, view.unwrap(), 24.0, 24);
        let leaves = refinement.leaves(true);
        let sum: usize = leaves.iter().map(|leaf| refinement.patch(leaf).len()).sum();
        let residence = paged.residence().unwrap();
        assert!(sum > 1000 && (1..=4).contains(&residence.resident[0]) && residence.read <= 4, "{sum} {residence:?}");
    }

    #[test]
    fn the_device_refuses_a_ground_in_pages_in_one_line() {
        let Some(context) = crate::context::device() else { return };
        let paged = Ground::paged(made(0), 0.6, 4).unwrap();
        let error = crate::tessellate::device::displace::Displacer::new(&context, &paged).err().unwrap().to_string();
        assert!(error.contains("pages") && error.contains("the processor") && !error.contains('\n'), "{error}");
        // Control: the same ground in memory is taken.
        assert!(crate::tessellate::device::displace::Displacer::new(&context, &whole()).is_ok());
    }

    #[test]
    fn a_source_that_fails_is_told_and_holes_are_refused() {
        let source = made(0);
        let end = source.end.clone();
        let ground = Ground::paged(source, 0.6, 4).unwrap();
        assert_eq!(ground.failure(), None);
        end.store(0, Ordering::Relaxed);
        assert_eq!(ground.elevation([600.0, 600.0]), 0.0);
        assert_eq!(ground.failure().as_deref(), Some("the disk is gone"));
        let source = made(0);
        source.end.store(300, Ordering::Relaxed);
        let error = Ground::paged(source, 0.6, 4).err().map(|error| error.to_string());
        assert_eq!(error.as_deref(), Some("the disk is gone"));
    }
}
