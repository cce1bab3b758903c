//! Cooking: ground, then landform after landform, each placing primitives on the solid as it is.

use super::water::{self, accessible};
use super::{Cliffs, Entry, Landform, Recipe};
use crate::brush::{Limits, Stroke, StrokeError};
use crate::field::{Box3, Density};
use crate::geology::{Archetype, Geology, GeologyError, archetype};
use crate::hydrology::HydrologyError;
use crate::implicit::heightfield::{HeightfieldError, Implicitisation};
use crate::implicit::index::Index;
use crate::implicit::primitive::Primitive;
use crate::implicit::surface::Surface;
use crate::implicit::volume::{Volume, file};
use crate::landform::ParameterError;
use crate::landform::canyon::Canyon;
use crate::landform::ground::scatter;
use crate::landform::hoodoo::{Habitat, Hoodoo};
use crate::landform::karst::{Karst, KarstError};
use crate::landform::raster::{bilinear, largest, shaped};
use crate::landform::shallow::{Shallow, Site};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::sync::Arc;
use terrain_model::grid::Grid;
use terrain_model::noise::hash::mix;

/// What a recipe names beside its own text.
pub trait Pantry {
    /// A raster.
    ///
    /// # Errors
    /// Why there is none, in one line.
    fn raster(&mut self, name: &str) -> Result<Grid<f32>, String>;
    /// A text.
    ///
    /// # Errors
    /// Why there is none, in one line.
    fn text(&mut self, name: &str) -> Result<String, String>;
}

/// A recipe that cannot be cooked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecipeError {
    /// The raster, or radius and floor of the recipe.
    #[error(transparent)]
    Ground(#[from] HeightfieldError),
    /// A file that the recipe names.
    #[error("{name}: {problem}")]
    Source {
        /// The file.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The geology.
    #[error("geology {name}: {problem}")]
    Geology {
        /// The file.
        name: String,
        /// Line and column, or the place in the tree.
        problem: GeologyError,
    },
    /// A parameter.
    #[error("landform {entry}: {problem}")]
    Parameter {
        /// Which of the recipe's landforms, from 1.
        entry: usize,
        /// Its name, its value and what was expected.
        problem: ParameterError,
    },
    /// A karst that cannot grow.
    #[error("landform {entry}: {problem}")]
    Karst {
        /// Which of the recipe's landforms, from 1.
        entry: usize,
        /// Why.
        problem: KarstError,
    },
    /// The raster, as ground that water runs over.
    #[error("landform {entry}: {problem}")]
    Water {
        /// Which of the recipe's landforms, from 1.
        entry: usize,
        /// What is wrong.
        problem: HydrologyError,
    },
    /// A stroke.
    #[error("landform {entry}, stroke {stroke}: {problem}")]
    Stroke {
        /// Which of the recipe's landforms, from 1.
        entry: usize,
        /// Which of its strokes, from 1.
        stroke: usize,
        /// What is wrong.
        problem: StrokeError,
    },
    /// A box of which a corner is not below the other.
    #[error("landform {entry}, within: expected the lower corner, then the upper, found {low} and {high}")]
    Within {
        /// Which of the recipe's landforms, from 1.
        entry: usize,
        /// First corner.
        low: DVec3,
        /// Second corner.
        high: DVec3,
    },
}

/// What one landform added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Made {
    /// Its name in recipes.
    pub landform: &'static str,
    /// How many primitives.
    pub primitives: usize,
}

/// An amplified terrain.
#[derive(Clone, Debug)]
pub struct Amplified {
    /// The heightfield as a solid.
    pub ground: Volume,
    /// The ground blended with all primitives.
    pub volume: Volume,
    /// The primitives, sorted as the index sums them.
    pub index: Arc<Index>,
    /// The rock.
    pub geology: Geology,
    /// The largest σ of sea and rivers on the heightfield, one sample for each of the raster's.
    pub stress: Grid<f32>,
    /// What each entry of the recipe added, in its order.
    pub made: Vec<Made>,
}

/// Amplifies `grid`, elevations in metres. `seed` changes every landform; `begun` hears the place and name of each as it begins.
///
/// # Errors
/// A [`RecipeError`] names what is wrong; every parameter is checked before anything is made.
pub fn amplify(
    grid: &Grid<f32>,
    recipe: &Recipe,
    pantry: &mut dyn Pantry,
    seed: u32,
    mut begun: impl FnMut(usize, &'static str),
) -> Result<Amplified, RecipeError> {
    for (k, entry) in recipe.landforms.iter().enumerate() {
        entry.make.check().map_err(|problem| RecipeError::Parameter { entry: k + 1, problem })?;
    }
    let limits = recipe.landforms.iter().enumerate().map(|(k, entry)| limits(k + 1, entry, pantry));
    let limits = limits.collect::<Result<Vec<_>, _>>()?;
    let geology = geology(&recipe.geology, pantry)?;
    let radius = recipe.radius.unwrap_or(2.0 * grid.spacing().max_element());
    let usual = Implicitisation::of(grid, radius);
    let settings = Implicitisation { floor: recipe.floor.unwrap_or(usual.floor), distance: recipe.distance, ..usual };
    let ground = settings.volume(grid)?;
    let Volume::Ground(surface, _) = &ground else { unreachable!("a raster is made ground") };
    let mut terrain = Terrain {
        grid,
        surface: surface.clone(),
        floor: settings.floor,
        geology,
        index: Arc::default(),
        stress: shaped(grid, vec![0.0; grid.values().len()]),
        ground,
    };
    let mut made = Vec::new();
    let mut all: Vec<Primitive> = Vec::new();
    for (k, (entry, limits)) in recipe.landforms.iter().zip(&limits).enumerate() {
        let landform = entry.make.name();
        begun(k, landform);
        let limit = entry.limit.unwrap_or(usize::MAX);
        let mut new = terrain.make(k + 1, &entry.make, limits, limit, mix(seed, k as u32))?;
        new.truncate(limit);
        made.push(Made { landform, primitives: new.len() });
        all.extend(new);
        terrain.index = Arc::new(Index::new(all.clone()).expect("landforms make sound primitives"));
    }
    let Terrain { ground, geology, index, stress, .. } = terrain;
    let volume = Volume::Blend(vec![ground.clone(), Volume::Primitives(index.clone())]);
    Ok(Amplified { ground, volume, index, geology, stress, made })
}

fn geology(name: &str, pantry: &mut dyn Pantry) -> Result<Geology, RecipeError> {
    if let Some(known) = archetype(name) {
        return Ok(known.geology());
    }
    let text = pantry.text(name).map_err(|problem| {
        let names = Archetype::ALL.map(Archetype::name).join(", ");
        RecipeError::Source { name: name.to_owned(), problem: format!("{problem}; expected a file or one of {names}") }
    })?;
    Geology::parse(&text).map_err(|problem| RecipeError::Geology { name: name.to_owned(), problem })
}

fn limits(k: usize, entry: &Entry, pantry: &mut dyn Pantry) -> Result<Limits, RecipeError> {
    let source = |name: &str, problem: String| RecipeError::Source { name: name.to_owned(), problem };
    let region = match &entry.mask {
        Some(name) => Some(pantry.raster(name).map_err(|problem| source(name, problem))?),
        None => None,
    };
    let solid = match &entry.inside {
        Some(name) => {
            let text = pantry.text(name).map_err(|problem| source(name, problem))?;
            let tree = file::parse(&text).map_err(|error| source(name, error.to_string()))?;
            Some(tree.build(&mut |raster| pantry.raster(raster)).map_err(|error| source(name, error.to_string()))?)
        }
        None => None,
    };
    let volume = entry.within.map(|[low, high]| Box3 { low: DVec3::from(low), high: DVec3::from(high) });
    if let Some(Box3 { low, high }) = volume
        && !low.cmplt(high).all()
    {
        return Err(RecipeError::Within { entry: k, low, high });
    }
    Ok(Limits { region, volume, solid })
}

/// The terrain while it is made.
struct Terrain<'a> {
    grid: &'a Grid<f32>,
    ground: Volume,
    surface: Arc<Surface>,
    floor: f64,
    geology: Geology,
    index: Arc<Index>,
    stress: Grid<f32>,
}

impl Terrain<'_> {
    fn make(
        &mut self,
        entry: usize,
        landform: &Landform,
        limits: &Limits,
        limit: usize,
        seed: u32,
    ) -> Result<Vec<Primitive>, RecipeError> {
        let problem = |problem| RecipeError::Water { entry, problem };
        Ok(match landform {
            Landform::Sea(sea) => {
                let band = [sea.level - sea.reach, sea.level + sea.reach];
                let open = accessible(self.grid, sea).map_err(problem)?;
                self.erode(&sea.erosion, band, (&open, limit), limits, seed, |p| sea.stress(&open, p))
            }
            Landform::Canyon(canyon) => {
                let bed = canyon.bed(&water::power(self.grid).map_err(problem)?);
                let map = water::spread(&bed, canyon.banks).map_err(problem)?;
                let heights = self.surface.elevations();
                let reach = canyon.erosion.radius * f64::from(canyon.erosion.steps);
                let band = [heights.lo() - reach, heights.hi()];
                self.erode(&canyon.erosion, band, (&map, limit), limits, seed, |p| Canyon::stress(&map, p))
            }
            Landform::Karst { percolation, pits, cliffs } => {
                let found = pits.map_or_else(|| Ok(Vec::new()), |pits| water::deepest(self.grid, pits));
                let mut found = found.map_err(problem)?;
                if let Some(cliffs) = cliffs {
                    found.extend(self.cliffs(*cliffs, seed).map_err(problem)?);
                }
                let problem = |problem| RecipeError::Karst { entry, problem };
                self.karst(percolation, found, limits, seed).map_err(problem)?
            }
            Landform::Hoodoos { grammar, habitat, spacing } => {
                self.hoodoos(grammar, habitat, *spacing, limits, seed).map_err(problem)?
            }
            Landform::Brush(strokes) => self.brush(entry, strokes, limits)?,
            Landform::Arch(arch) => {
                let stroke = arch.stroke().map_err(|problem| RecipeError::Parameter { entry, problem })?;
                self.brush(entry, &[stroke], limits)?
            }
        })
    }

    /// The box that the raster spans, between two elevations, within the limits.
    fn region(&self, [low, high]: [f64; 2], limits: &Limits) -> Box3 {
        let [from, to] = self.surface.ground();
        let all = Box3 { low: from.extend(low), high: to.extend(high) };
        limits.meet(&all)
    }

    fn erode(
        &mut self,
        erosion: &Shallow,
        band: [f64; 2],
        (most, limit): (&Grid<f32>, usize),
        limits: &Limits,
        seed: u32,
        stress: impl Fn(DVec3) -> f64 + Sync,
    ) -> Vec<Primitive> {
        let allowed = |p: DVec3| limits.allow(p);
        let (grid, width) = (self.grid, self.grid.width());
        self.stress.values_mut().par_iter_mut().zip(grid.values()).enumerate().for_each(|(k, (most, height))| {
            let p = grid.position(k % width, k / width).extend(f64::from(*height));
            let sigma = stress(p);
            if sigma > f64::from(*most) && allowed(p) {
                *most = sigma as f32;
            }
        });
        let region = self.region(band, limits);
        let (ground, before, geology) = (&self.ground, self.index.primitives(), &self.geology);
        let site = Site { ground, before, surface: &self.surface, geology, region, most, limit };
        erosion.erode(&site, stress, allowed, seed)
    }

    fn karst(
        &self,
        karst: &Karst,
        starts: Vec<DVec3>,
        limits: &Limits,
        seed: u32,
    ) -> Result<Vec<Primitive>, KarstError> {
        let karst = Karst { seed: mix(karst.seed, seed), ..karst.clone() };
        // Caves stay off the solid's own walls and floor.
        let [from, to] = self.surface.ground();
        let margin = 2.0 * self.surface.radius() + karst.radius[0].max(karst.radius[1]);
        let low = (from + margin).extend(self.floor + margin);
        let domain = Box3 { low, high: (to - margin).extend(self.surface.elevations().hi()) };
        let domain = limits.meet(&domain);
        let inside = |p: DVec3| {
            let [height, _] = self.surface.column::<f64>([p.x, p.y]);
            p.z < height && limits.allow(p)
        };
        let found: Vec<DVec3> = starts.into_iter().filter(|&p| domain.contains(p) && limits.allow(p)).collect();
        let sites = karst.grow(&domain, inside, &found, |p| self.geology.value(p))?;
        Ok(karst.primitives(&sites))
    }

    /// Places of the ground that are as steep as cliffs.
    fn cliffs(&self, Cliffs { slope, spacing }: Cliffs, seed: u32) -> Result<Vec<DVec3>, HydrologyError> {
        let gradient = water::gradient(self.grid)?;
        let heights = self.surface.elevations();
        let everywhere = self.region([heights.lo(), heights.hi()], &Limits::default());
        let chance = |p: DVec3| f64::from(bilinear(&gradient, p.truncate()) >= slope);
        let steep = |low: DVec2, high: DVec2| largest(&gradient, low, high) >= slope;
        Ok(scatter(&self.surface, &everywhere, spacing, steep, chance, seed))
    }

    fn hoodoos(
        &self,
        grammar: &Hoodoo,
        habitat: &Habitat,
        spacing: f64,
        limits: &Limits,
        seed: u32,
    ) -> Result<Vec<Primitive>, HydrologyError> {
        let (area, slope) = (water::area(self.grid)?, water::gradient(self.grid)?);
        let grammar = Hoodoo { seed: mix(grammar.seed, seed), ..grammar.clone() };
        let band = self.surface.elevations();
        let region = self.region([band.lo(), band.hi()], limits);
        let chance = |p: DVec3| {
            let at = p.truncate();
            if limits.allow(p) { habitat.probability(bilinear(&area, at), bilinear(&slope, at), 1.0) } else { 0.0 }
        };
        let spires: Vec<Vec<Primitive>> = scatter(&self.surface, &region, spacing, |_, _| true, chance, seed)
            .into_par_iter()
            .map(|foot| {
                let symbols = grammar.derive(foot, |p| self.geology.value(p)).expect("checked before");
                grammar.primitives(&symbols)
            })
            .collect();
        Ok(spires.concat())
    }

    fn brush(&self, entry: usize, strokes: &[Stroke], limits: &Limits) -> Result<Vec<Primitive>, RecipeError> {
        let mut all = Vec::new();
        for (k, stroke) in strokes.iter().enumerate() {
            let made = stroke.primitives().map_err(|problem| RecipeError::Stroke { entry, stroke: k + 1, problem })?;
            all.extend(made.into_iter().filter(|one| {
                let support = one.support();
                limits.allow((support.low + support.high) * 0.5)
            }));
        }
        Ok(all)
    }
}

impl Amplified {
    /// Where the solid is not air.
    pub fn support(&self) -> Box3 {
        self.volume.support()
    }
    /// Bytes: of what the primitives are, and of the index beside them.
    pub fn bytes(&self) -> [usize; 2] {
        self.index.bytes()
    }
}
