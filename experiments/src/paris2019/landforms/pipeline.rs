//! What a landform is made from (Paris 2019 §6, Figs. 12 and 13): stress and resistance over the ground, the erosion e of the two,
//! and where the primitives came to act.

use super::super::{drainage, draw, landscapes};
use super::{Shelf, looking};
use crate::experiment::{Context, ExperimentError};
use crate::report::{Outcome, Picture, PngFile};
use glam::DVec3;
use terrain_amplify::field::Density;
use terrain_amplify::landform::energy::Attack;
use terrain_amplify::landform::raster::bilinear;
use terrain_amplify::landform::sea::Sea;
use terrain_amplify::landform::shallow::Shallow;
use terrain_amplify::polygonize::{Lattice, Polygonizer};
use terrain_amplify::recipe::{Entry, Landform, Recipe, accessible, amplify};
use terrain_model::grid::Grid;

/// Pixels along a side of a sample of the maps.
const MAGNIFIED: usize = 3;
/// e and what is carved off the ground are to be correlated at least so much: a sphere reaches 5 m around where it was seeded, over
/// which e changes.
const FOLLOWS: f64 = 0.5;

/// A name, a caption, and what is shown.
type Factor<'a> = (&'static str, &'static str, &'a (dyn Fn(DVec3) -> f64 + Sync));

fn sea() -> Sea {
    let erosion =
        Shallow { spacing: 1.7, radius: 5.0, strength: 1.5, hardest: 0.1, threshold: 0.08, ..Sea::default().erosion };
    Sea { reach: 6.0, openness: 25.0, erosion, ..Sea::default() }
}

/// Pearson's correlation of `a` and `b` over the samples where `counts` is above 0.
fn correlation(a: &[f64], b: &[f64], counts: &[f32]) -> f64 {
    let pairs = || a.iter().zip(b).zip(counts).filter(|(_, count)| **count > 0.0).map(|((a, b), _)| (*a, *b));
    let n = pairs().count() as f64;
    let (ma, mb) = pairs().fold((0.0, 0.0), |(x, y), (a, b)| (x + a / n, y + b / n));
    let moment = |f: &dyn Fn(f64, f64) -> f64| pairs().map(|(a, b)| f(a - ma, b - mb)).sum::<f64>();
    moment(&|a, b| a * b) / (moment(&|a, _| a * a) * moment(&|_, b| b * b)).sqrt()
}

/// How bright the ground is at sample `k`, lit from the north-west.
fn light(ground: &Grid<f32>, k: usize) -> f64 {
    let (width, height) = (ground.width(), ground.height());
    let (i, j) = (k % width, k / width);
    let at = |i: usize, j: usize| f64::from(ground.values()[j * width + i]);
    let dx = (at((i + 1).min(width - 1), j) - at(i.saturating_sub(1), j)) / (2.0 * ground.spacing().x);
    let dy = (at(i, (j + 1).min(height - 1)) - at(i, j.saturating_sub(1))) / (2.0 * ground.spacing().y);
    let normal = DVec3::new(-dx, -dy, 1.0).normalize();
    0.45 + 0.55 * normal.dot(DVec3::new(-0.5, 0.5, std::f64::consts::FRAC_1_SQRT_2)).max(0.0) / 0.71
}

/// A map over the ground, magnified, north on top.
fn map(ctx: &Context, name: &str, values: &Grid<f64>, ground: &Grid<f32>) -> Result<PngFile, ExperimentError> {
    let (width, height) = (MAGNIFIED * values.width(), MAGNIFIED * values.height());
    let small = drainage::shaded(values);
    let pixel = |k: usize| {
        let (row, column) = (k / width / MAGNIFIED, k % width / MAGNIFIED);
        let light = light(ground, (values.height() - 1 - row) * values.width() + column);
        let at = 3 * (row * values.width() + column);
        small[at..at + 3].iter().map(move |&c| (f64::from(c) * light).min(255.0) as u8)
    };
    let pixels: Vec<u8> = (0..width * height).flat_map(pixel).collect();
    ctx.write_png(name, width as u32, height as u32, &pixels)
}

/// Pictures of both figures, and that carving follows e: held against the e of the coast seen in a mirror.
pub(super) fn pipeline(ctx: &Context, outcome: &mut Outcome, wrong: &mut Vec<String>) -> Result<(), ExperimentError> {
    let (seed, grid, sea) = (ctx.seed as u32, landscapes::cove()?, sea());
    let mut recipe = Recipe::new("strata", vec![Entry::of(Landform::Sea(sea))]);
    recipe.radius = Some(2.5);
    let made = amplify(&grid, &recipe, &mut Shelf, seed, |_, _| ()).map_err(ExperimentError::failed)?;
    let maps = made.maps(&grid);
    let of = |values: Vec<f64>| {
        Grid::new(grid.origin(), grid.spacing(), grid.width(), grid.height(), values).map_err(ExperimentError::failed)
    };
    let wide = |map: &Grid<f32>, share: f64| of(map.values().iter().map(|v| f64::from(*v) * share).collect());
    let attack = |(rho, sigma): (&f32, &f32)| {
        Attack { resistance: f64::from(*rho), stress: f64::from(*sigma) }.effect(sea.erosion.hardest)
    };
    let erosion = of(maps.resistance.values().iter().zip(maps.stress.values()).map(attack).collect())?;
    for (name, caption, values) in [
        (
            "fig12_stress",
            "Fig. 12: stress σ of the waves on the ground, dark where it is large",
            wide(&maps.stress, 1.0)?,
        ),
        ("fig12_resistance", "Fig. 12: resistance ρ of the rock on the ground", wide(&maps.resistance, 1.0)?),
        ("fig12_erosion", "Fig. 12: erosion e(ρ, σ)", erosion.clone()),
        (
            "fig12_effects",
            "Fig. 12: effects: pale none, then layers of rock in the column, an overhang or cave from two on",
            wide(&maps.effects, 1.0 / 3.0)?,
        ),
    ] {
        let file = map(ctx, name, &values, &grid)?;
        outcome.picture(Picture::new(file, caption).camera("from above, north on top").seed(ctx.seed));
    }

    let place = |k: usize| grid.position(k % grid.width(), k / grid.width()).extend(f64::from(grid.values()[k]));
    let taken: Vec<f64> =
        (0..grid.values().len()).map(place).map(|p| made.ground.value(p) - made.volume.value(p)).collect();
    let mirrored = |k: usize| erosion.values()[k / grid.width() * grid.width() + grid.width() - 1 - k % grid.width()];
    let mirrored: Vec<f64> = (0..erosion.values().len()).map(mirrored).collect();
    let of_all = |e: &[f64]| correlation(e, &taken, maps.stress.values());
    let (follows, blind) = (of_all(erosion.values()), of_all(&mirrored));
    outcome.metric("fig12.correlation_of_erosion_and_carving", follows)?;
    outcome.metric("fig12.correlation_with_the_mirrored_coast", blind)?;
    if follows.is_nan() || follows < FOLLOWS {
        wrong.push(format!("e and carving are correlated by {follows}, expected {FOLLOWS} or more"));
    }
    outcome.control("erosion of the mirrored coast", "e read at −x", "less correlation", blind < FOLLOWS);

    let open = accessible(&grid, &sea).map_err(ExperimentError::failed)?;
    let (volume, rock) = (&made.volume, &made.geology);
    let lattice = Lattice::over(&made.support(), ctx.profile.pick(0.8, 0.4)).map_err(ExperimentError::failed)?;
    let polygonizer = Polygonizer::new(volume, lattice, 0.01 * lattice.spacing()).map_err(ExperimentError::failed)?;
    let (mesh, _) = polygonizer.sparse().map_err(ExperimentError::failed)?;
    let stress = |p: DVec3| sea.stress(&open, p);
    let fallen = |p: DVec3| sea.falloff(p.z);
    let alpha = |p: DVec3| bilinear(&open, p.truncate()).clamp(0.0, 1.0);
    let erodes = |p: DVec3| Attack { resistance: rock.value(p), stress: stress(p) }.effect(sea.erosion.hardest);
    let factors: [Factor<'_>; 4] = [
        ("fig13_resistance", "Fig. 13: resistance ρ on the eroded cliff, pale where it is large", &|p| rock.value(p)),
        ("fig13_falloff", "Fig. 13: fall-off w from the level of the sea", &fallen),
        ("fig13_accessibility", "Fig. 13: accessibility α, which the paper does not show", &alpha),
        ("fig13_erosion", "Fig. 13: erosion e(ρ, wα): pale where spheres are seeded", &erodes),
    ];
    let (width, height) = ctx.profile.pick((480, 300), (1440, 900));
    let camera = looking([150.0, -46.0, 44.0], [88.0, 92.0, 4.0], 0.66);
    for (name, caption, factor) in factors {
        let drawn = draw::draw(&mesh, &camera, [width, height], factor);
        let file = ctx.write_png(name, width as u32, height as u32, &drawn.pixels)?;
        outcome.picture(Picture::new(file, caption).camera("from (150, −46, 44)").seed(ctx.seed));
    }
    Ok(())
}
