//! Editing by hand (Paris 2019 §3.2, §8.2): strokes of primitives that extrude and intrude, kept to a painted region and a
//! volume, undone and redone; each says which box it has changed, so that a mesh is mended there alone.

use crate::field::{Box3, Density, THRESHOLD};
use crate::implicit::index::Index;
use crate::implicit::primitive::Primitive;
use crate::implicit::skeleton::Skeleton;
use crate::implicit::volume::Volume;
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::Arc;
use terrain_model::grid::Grid;
use terrain_model::noise::hash;

/// What a brush does to rock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tool {
    /// Adds rock.
    #[serde(alias = "extrude")]
    Extrude,
    /// Takes rock away.
    #[serde(alias = "intrude")]
    Intrude,
}

/// One stroke: primitives along a path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stroke {
    /// What it does.
    pub tool: Tool,
    /// Corners of the path, metres; one is a dab.
    pub path: Vec<[f32; 3]>,
    /// Radius of the primitives' support, metres.
    pub radius: f32,
    /// Metres of path from one primitive to the next.
    pub step: f32,
    /// |energy| of each primitive.
    pub strength: f32,
    /// Each is moved by up to this many metres along each axis.
    #[serde(default)]
    pub scatter: f32,
    /// Of the scatter.
    #[serde(default)]
    pub seed: u32,
}

/// A stroke that cannot be drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StrokeError {
    /// No path, or coordinates out of range.
    #[error("a stroke with {corners} corners: expected at least one, coordinates within ±1000000000 m")]
    Path {
        /// Corners of the path.
        corners: usize,
    },
    /// A number out of range.
    #[error("stroke {name} {value}: expected {expected}")]
    Value {
        /// Which.
        name: &'static str,
        /// What it is.
        value: f32,
        /// What it could be.
        expected: &'static str,
    },
    /// Text that is not a list of strokes.
    #[error("line {line}, column {column}: {problem}")]
    Text {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// What is wrong.
        problem: String,
    },
    /// More primitives than an index can number.
    #[error("a stroke of {count} primitives: expected at most 10000000; lengthen its step")]
    Long {
        /// How many.
        count: f64,
    },
}

impl Stroke {
    fn check(&self) -> Result<(), StrokeError> {
        let corners = self.path.len();
        if corners == 0 || !self.path.iter().flatten().all(|x| x.abs() <= 1e9) {
            return Err(StrokeError::Path { corners });
        }
        let positive = |name, value: f32| {
            let sound = (1e-3..=1e6).contains(&value);
            sound.then_some(()).ok_or(StrokeError::Value { name, value, expected: "0.001 to 1000000" })
        };
        positive("radius", self.radius)?;
        positive("step", self.step)?;
        positive("strength", self.strength)?;
        let (name, value) = ("scatter", self.scatter);
        if !(0.0..=1e6).contains(&value) {
            return Err(StrokeError::Value { name, value, expected: "0 to 1000000" });
        }
        Ok(())
    }

    /// Its primitives: one at the path's start and one after every step.
    ///
    /// # Errors
    /// A [`StrokeError`] says what is wrong with the stroke.
    pub fn primitives(&self) -> Result<Vec<Primitive>, StrokeError> {
        self.check()?;
        let path: Vec<DVec3> = self.path.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
        let length: f64 = path.windows(2).map(|ends| ends[0].distance(ends[1])).sum();
        let step = f64::from(self.step);
        if length / step > 1e7 {
            return Err(StrokeError::Long { count: length / step });
        }
        let energy = if self.tool == Tool::Extrude { self.strength } else { -self.strength };
        let mut made = Vec::new();
        let mut place = |p: DVec3| {
            let k = made.len() as u32;
            let random = |j: u32| f64::from(hash::mix(self.seed, 3 * k + j)) / 2_147_483_648.0 - 1.0;
            let p = p + DVec3::new(random(0), random(1), random(2)) * f64::from(self.scatter);
            made.push(Primitive { skeleton: Skeleton::Point(p.as_vec3().to_array()), radius: self.radius, energy });
        };
        place(path[0]);
        let mut ahead = step;
        for ends in path.windows(2) {
            let along = ends[0].distance(ends[1]);
            while ahead <= along {
                place(ends[0].lerp(ends[1], ahead / along));
                ahead += step;
            }
            ahead -= along;
        }
        Ok(made)
    }
}

/// The strokes of a RON text: a list in the order in which they are drawn.
///
/// # Errors
/// [`StrokeError::Text`] with the place.
pub fn parse(text: &str) -> Result<Vec<Stroke>, StrokeError> {
    ron::from_str(text).map_err(|error| StrokeError::Text {
        line: error.span.start.line,
        column: error.span.start.col,
        problem: error.code.to_string(),
    })
}

/// Where strokes may act: primitives whose centre lies elsewhere are left out.
#[derive(Clone, Debug, Default)]
pub struct Limits {
    /// Painted on the ground: a primitive stays where the nearest sample is above 0. Off the grid nothing stays.
    pub region: Option<Grid<f32>>,
    /// A box.
    pub volume: Option<Box3>,
    /// A solid: a primitive stays where its centre is in the rock.
    pub solid: Option<Volume>,
}

impl Limits {
    /// What of a box the limits' own boxes leave.
    #[must_use]
    pub fn meet(&self, region: &Box3) -> Box3 {
        let within = self.volume.map_or(*region, |volume| region.meet(&volume));
        self.solid.as_ref().map_or(within, |solid| within.meet(&solid.support()))
    }
    /// May a primitive stand here?
    pub fn allow(&self, p: DVec3) -> bool {
        let painted = self.region.as_ref().is_none_or(|grid| {
            let at: DVec2 = ((p.truncate() - grid.origin()) / grid.spacing()).round();
            let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < grid.width() as f64 && at.y < grid.height() as f64;
            inside && grid.values()[at.y as usize * grid.width() + at.x as usize] > 0.0
        });
        let boxed = self.volume.is_none_or(|volume| volume.contains(p));
        painted && boxed && self.solid.as_ref().is_none_or(|solid| solid.value(p) > THRESHOLD)
    }
}

/// What one stroke left in the index.
#[derive(Clone, Debug)]
struct Drawn {
    stroke: Stroke,
    which: Range<usize>,
    energies: Vec<f32>,
    support: Box3,
}

/// A volume with strokes on it.
#[derive(Clone, Debug)]
pub struct Sculpture {
    base: Volume,
    limits: Limits,
    index: Arc<Index>,
    drawn: Vec<Drawn>,
    undone: Vec<Drawn>,
}

impl Sculpture {
    /// Nothing drawn yet.
    pub fn new(base: Volume) -> Sculpture {
        let index = Arc::new(Index::default());
        Sculpture { base, limits: Limits::default(), index, drawn: Vec::new(), undone: Vec::new() }
    }
    /// Keeps what is drawn from now on within `limits`.
    pub fn limit(&mut self, limits: Limits) {
        self.limits = limits;
    }
    /// The base with all that is drawn, blended.
    pub fn volume(&self) -> Volume {
        Volume::Blend(vec![self.base.clone(), Volume::Primitives(self.index.clone())])
    }
    /// Strokes that are drawn: the paper's #E.
    pub fn strokes(&self) -> impl ExactSizeIterator<Item = &Stroke> {
        self.drawn.iter().map(|drawn| &drawn.stroke)
    }
    /// Primitives of the strokes that are drawn.
    pub fn primitives(&self) -> usize {
        self.drawn.iter().map(|drawn| drawn.which.len()).sum()
    }
    /// Draws a stroke; the box off which nothing has changed. What was undone is forgotten.
    ///
    /// # Errors
    /// As [`Stroke::primitives`]; nothing is drawn then.
    pub fn draw(&mut self, stroke: Stroke) -> Result<Box3, StrokeError> {
        let mut made = stroke.primitives()?;
        made.retain(|one| {
            let support = one.support();
            self.limits.allow((support.low + support.high) * 0.5)
        });
        let corners = stroke.path.len();
        let which = Arc::make_mut(&mut self.index).insert(&made).map_err(|_| StrokeError::Path { corners })?;
        let support = made.iter().fold(Box3::EMPTY, |all, one| all.hull(&one.support()));
        let energies = made.iter().map(|one| one.energy).collect();
        self.undone.clear();
        self.drawn.push(Drawn { stroke, which, energies, support });
        Ok(support)
    }
    /// Takes the last stroke back; the box off which nothing has changed, `None` without a stroke.
    pub fn undo(&mut self) -> Option<Box3> {
        let last = self.drawn.pop()?;
        Arc::make_mut(&mut self.index).remove(last.which.clone());
        let support = last.support;
        self.undone.push(last);
        Some(support)
    }
    /// Draws again what was undone last; the box off which nothing has changed, `None` when nothing was.
    pub fn redo(&mut self) -> Option<Box3> {
        let last = self.undone.pop()?;
        Arc::make_mut(&mut self.index).restore(last.which.clone(), &last.energies);
        let support = last.support;
        self.drawn.push(last);
        Some(support)
    }
    /// The support of all that is drawn and of the base.
    pub fn support(&self) -> Box3 {
        self.volume().support()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::implicit::heightfield::tests::ground;
    use crate::implicit::sigmoid::Sigmoid;
    use crate::polygonize::check::Census;
    use crate::polygonize::{Lattice, Polygonizer};

    fn stroke(tool: Tool, seed: u32) -> Stroke {
        let path = vec![[110.0, 0.0, 0.0], [125.0, 12.0, -2.0], [140.0, 10.0, 2.0]];
        Stroke { tool, path, radius: 5.0, step: 2.0, strength: 0.8, scatter: 0.5, seed }
    }

    #[test]
    fn primitives_stand_a_step_apart_along_the_path() {
        let even = Stroke { scatter: 0.0, ..stroke(Tool::Intrude, 1) };
        let made = even.primitives().unwrap();
        let length = (15.0f64 * 15.0 + 12.0 * 12.0 + 4.0).sqrt() + (15.0f64 * 15.0 + 4.0 + 16.0).sqrt();
        assert_eq!(made.len(), (length / 2.0) as usize + 1);
        assert!(made.iter().all(|one| one.energy == -0.8 && one.radius == 5.0));
        let dab = Stroke { path: vec![[1.0; 3]], ..even.clone() };
        assert_eq!(dab.primitives().unwrap().len(), 1);
        for bad in [
            Stroke { path: Vec::new(), ..even.clone() },
            Stroke { radius: f32::NAN, ..even.clone() },
            Stroke { path: vec![[0.0, f32::NAN, 0.0]], ..even.clone() },
            Stroke { path: vec![[2e9, 0.0, 0.0]], ..even.clone() },
            Stroke { step: 0.0, ..even.clone() },
            Stroke { step: 1e-3, path: vec![[0.0; 3], [1e6, 0.0, 0.0]], ..even.clone() },
            Stroke { scatter: -1.0, ..even },
        ] {
            assert!(bad.primitives().is_err(), "{bad:?}");
        }
    }

    #[test]
    fn strokes_are_read_from_text_and_errors_have_their_place() {
        let text = "[(tool:Intrude,path:[(0,0,0),(1,0,0)],radius:2,step:1,strength:0.5)]";
        assert_eq!(parse(text).unwrap()[0].primitives().unwrap().len(), 2);
        let error = parse("[\n(tool:Smooth,path:[(0,0,0)])]").unwrap_err().to_string();
        assert!(error.starts_with("line 2, ") && error.contains("Smooth"), "{error}");
    }

    #[test]
    fn edits_mend_the_mesh_that_all_at_once_would_give_and_undo_gives_the_old_one() {
        let mut sculpture = Sculpture::new(ground(Sigmoid::UnitFree, 3.0));
        let lattice =
            Lattice::over(&Box3::new(DVec3::new(100.0, -20.0, -40.0), DVec3::new(164.0, 52.0, 20.0)), 1.5).unwrap();
        let volume = sculpture.volume();
        let mut pieces = Polygonizer::new(&volume, lattice, 1e-2).unwrap().pieces();
        let bare = pieces.mesh().unwrap();
        let mut steps = vec![bare.clone()];
        for (tool, seed) in [(Tool::Intrude, 1), (Tool::Extrude, 2)] {
            let changed = sculpture.draw(stroke(tool, seed)).unwrap();
            let volume = sculpture.volume();
            let mesher = Polygonizer::new(&volume, lattice, 1e-2).unwrap();
            mesher.mend(&mut pieces, &changed);
            let mesh = pieces.mesh().unwrap();
            assert!(Census::of(&mesh).is_closed());
            assert_eq!(mesh, mesher.sparse().unwrap().0);
            assert!(!steps.contains(&mesh));
            steps.push(mesh);
        }
        assert_eq!(sculpture.strokes().len(), 2);
        for k in [1, 0] {
            let changed = sculpture.undo().unwrap();
            let volume = sculpture.volume();
            Polygonizer::new(&volume, lattice, 1e-2).unwrap().mend(&mut pieces, &changed);
            assert_eq!(pieces.mesh().unwrap(), steps[k]);
        }
        assert!(sculpture.undo().is_none() && sculpture.primitives() == 0);
        let changed = sculpture.redo().unwrap();
        let volume = sculpture.volume();
        Polygonizer::new(&volume, lattice, 1e-2).unwrap().mend(&mut pieces, &changed);
        assert_eq!(pieces.mesh().unwrap(), steps[1]);
        sculpture.draw(stroke(Tool::Extrude, 9)).unwrap();
        assert!(sculpture.redo().is_none());
    }

    #[test]
    fn a_painted_region_and_a_volume_keep_primitives_out() {
        let mut values = vec![0.0f32; 16];
        values[5] = 1.0;
        let region = Grid::new(DVec2::new(100.0, -10.0), DVec2::splat(10.0), 4, 4, values).unwrap();
        let volume = Box3::new(DVec3::new(100.0, -10.0, -1.0), DVec3::new(150.0, 50.0, 1.0));
        let mut sculpture = Sculpture::new(Volume::AIR);
        sculpture.limit(Limits { region: Some(region), volume: Some(volume), solid: None });
        sculpture.draw(stroke(Tool::Extrude, 3)).unwrap();
        let all = stroke(Tool::Extrude, 3).primitives().unwrap().len();
        let kept = sculpture.primitives();
        assert!(0 < kept && kept < all, "{kept} of {all}");
        let Volume::Blend(parts) = sculpture.volume() else { panic!("a blend") };
        let Volume::Primitives(index) = &parts[1] else { panic!("primitives") };
        for one in index.primitives() {
            let Skeleton::Point(p) = one.skeleton else { panic!("points") };
            assert!((105.0..=115.0).contains(&p[0]) && (-5.0..=5.0).contains(&p[1]) && p[2].abs() <= 1.0, "{p:?}");
        }
    }
}
