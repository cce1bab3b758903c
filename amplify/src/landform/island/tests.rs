//! Islands are where their rasters say and nowhere else, closed, and small in memory.

use super::*;
use crate::field::THRESHOLD;
use crate::geology::Archetype;
use crate::implicit::sigmoid::Sigmoid;
use crate::implicit::surface::{Distance, Surface};
use crate::landform::karst::Karst;
use crate::polygonize::check::Census;
use crate::polygonize::{Lattice, Polygonizer};

const AT: DVec3 = DVec3::new(1000.0, -500.0, 800.0);

fn strata() -> Option<Arc<Geology>> {
    Some(Arc::new(Archetype::HorizontalStrata.geology()))
}

#[test]
fn rock_is_below_the_top_and_above_the_bottom() {
    let island = Island { cell: 8.0, ..Island::default() };
    let [bottom, top] = island.rasters(AT).unwrap();
    let volume = island.volume(AT, None).unwrap();
    let step = DVec3::Z * 0.05;
    let (mut thick, mut none) = (0, 0);
    for ((_, _, p, low), (_, _, _, high)) in bottom.positions().zip(top.positions()) {
        let [low, high] = [low, high].map(|z| p.extend(f64::from(z)));
        if high.z - low.z > 1.0 {
            thick += 1;
            assert!(volume.value(high - step) > THRESHOLD && volume.value(high + step) < THRESHOLD, "{high}");
            assert!(volume.value(low + step) > THRESHOLD && volume.value(low - step) < THRESHOLD, "{low}");
            assert!(volume.value(low.lerp(high, 0.5)) > THRESHOLD);
        } else if high.z < low.z {
            none += 1;
            assert!(
                (-40..40).all(|k| volume.value(AT.with_x(p.x).with_y(p.y) + DVec3::Z * f64::from(k * 5)) < THRESHOLD)
            );
        }
    }
    assert!(thick > 1500 && none > 500, "{thick} {none}");
}

/// The inverted terrain, made by turning it upside down instead.
#[test]
fn an_island_is_the_intersection_of_a_terrain_and_an_inverted_one() {
    let island = Island { cell: 10.0, ..Island::default() };
    let [bottom, top] = island.rasters(AT).unwrap();
    for distance in [Distance::Vertical, Distance::Normalised] {
        let made = between(&top, &bottom, distance, island.radius).unwrap();
        let surface = |grid: &Grid<f32>| Surface::new(grid, Sigmoid::default(), distance, island.radius).unwrap();
        let upright = surface(&top);
        let turned = surface(&bottom.map_known(|z| -z));
        let (mut most, mut other) = (0.0f64, 0.0f64);
        for k in 0..4000u32 {
            let random = |j: u32| f64::from(hash::mix(6, 3 * k + j)) / 2_147_483_648.0 - 1.0;
            let p = AT + DVec3::new(random(0), random(1), random(2)) * DVec3::new(220.0, 220.0, 150.0);
            let (up, down) = (upright.density(p.to_array()), turned.density([p.x, p.y, -p.z]));
            most = most.max((made.value(p) - up.min(down)).abs());
            // Control: the terrain without its counterpart.
            other = other.max((made.value(p) - up).abs());
        }
        assert!(most < 1e-12 && other > 0.9, "{most} {other}");
    }
}

#[test]
fn nothing_is_outside_the_extent_and_the_width_is_what_was_asked() {
    for (width, seed) in [(300.0, 1), (450.0, 2), (600.0, 3)] {
        let island = Island { width, seed, cell: 6.0, ..Island::default() };
        let (volume, extent) = (island.volume(AT, strata()).unwrap(), island.extent(AT));
        let size = extent.high - extent.low;
        // Six slabs around it, out to ten times its size.
        for axis in 0..3 {
            let mut slab = Box3 { low: extent.low - 10.0 * size, high: extent.high + 10.0 * size };
            slab.low[axis] = extent.high[axis];
            let mut other = Box3 { low: extent.low - 10.0 * size, high: extent.high + 10.0 * size };
            other.high[axis] = extent.low[axis];
            for slab in [slab, other] {
                for k in 0..3000u32 {
                    let random = |j: u32| f64::from(hash::mix(seed, 3 * k + j)) / 4_294_967_296.0;
                    let share = DVec3::new(random(0), random(1), random(2));
                    // Near the island as often as far from it.
                    let p = slab.low + (slab.high - slab.low) * share;
                    let near = p.clamp(extent.low - 20.0, extent.high + 20.0);
                    assert!(volume.value(p) < THRESHOLD && (extent.contains(near) || volume.value(near) < THRESHOLD));
                }
            }
        }
        let rock = |k: i32| {
            let p = AT + DVec3::X * f64::from(k);
            (-30..10).any(|z| volume.value(p + DVec3::Z * f64::from(z)) > THRESHOLD)
        };
        let wide = (-500..500).filter(|&k| rock(k)).count() as f64;
        assert!((wide / width - 1.0).abs() < island.rim + 0.1, "{wide} of {width}");
    }
}

#[test]
fn an_island_is_one_closed_surface_within_its_extent() {
    let island = Island { width: 300.0, cell: 6.0, ..Island::default() };
    let volume = island.volume(AT, strata()).unwrap();
    let extent = island.extent(AT);
    let lattice = Lattice::over(&Box3 { low: extent.low - 30.0, high: extent.high + 30.0 }, 12.0).unwrap();
    let (mesh, _) = Polygonizer::new(&volume, lattice, 1e-2).unwrap().sparse().unwrap();
    let census = Census::of(&mesh);
    assert!(census.is_closed(), "{census:?}");
    assert!(mesh.positions.len() > 500);
    assert!(mesh.positions.iter().all(|p| extent.contains(DVec3::from_array(*p))));
}

#[test]
fn weak_strata_are_worn_back_and_the_inside_stays() {
    let island = Island { cell: 10.0, strata: 0.45, ..Island::default() };
    let (bare, worn) = (island.volume(AT, None).unwrap(), island.volume(AT, strata()).unwrap());
    let (mut lost, mut kept) = (0, 0);
    for k in 0..20_000u32 {
        let random = |j: u32| f64::from(hash::mix(4, 3 * k + j)) / 2_147_483_648.0 - 1.0;
        let p = AT + DVec3::new(random(0), random(1), random(2)) * DVec3::new(250.0, 250.0, 200.0);
        let (before, after) = (bare.value(p), worn.value(p));
        assert!(after <= before);
        lost += usize::from(before > THRESHOLD && after <= THRESHOLD);
        kept += usize::from(after > THRESHOLD);
        assert!(before < 1.0 || after > THRESHOLD);
    }
    assert!(lost > 50 && kept > 5 * lost, "{lost} of {kept}");
}

/// Fig. 21: islands of 300 m to 600 m, one with caves, 6 MB in all, rasters too.
#[test]
fn five_islands_with_caves_take_less_than_6_mb() {
    let mut parts = Vec::new();
    for (k, width) in [300.0, 375.0, 450.0, 525.0, 600.0].into_iter().enumerate() {
        let island = Island { width, seed: k as u32, ..Island::default() };
        let at = DVec3::new(900.0 * k as f64, 0.0, 500.0 + 50.0 * k as f64);
        let volume = island.volume(at, strata()).unwrap();
        if k == 1 {
            let sinks = vec![at + DVec3::new(20.0, 0.0, 0.0)];
            let karst = Karst { sinks, sites: 5000, threshold: 2.0, spacing: 5.0, ..Karst::default() };
            let inside = |p: DVec3| volume.value(p) > THRESHOLD;
            let rock = Archetype::HorizontalStrata.geology();
            let sites = karst.grow(&island.extent(at), inside, &[], |p| rock.value(p)).unwrap();
            assert!(sites.len() > 1000 && sites.iter().skip(1).all(|site| inside(site.position)));
            parts.push(Volume::terrain(volume.clone(), karst.primitives(&sites)).unwrap());
        } else {
            parts.push(volume);
        }
    }
    let [tree, rasters] = Volume::Blend(parts).bytes();
    assert!(tree + rasters <= 6_000_000, "{tree} and {rasters}");
    // Control: rasters four times as fine do not fit.
    let fine = Island { width: 600.0, cell: 1.0, ..Island::default() }.volume(AT, None).unwrap();
    assert!(fine.bytes().iter().sum::<usize>() > 6_000_000);
}

#[test]
fn text_has_defaults_and_what_makes_no_sense_is_refused_by_name() {
    let read: Island = ron::from_str("(width: 300, seed: 4)").unwrap();
    assert_eq!(read, Island { width: 300.0, seed: 4, ..Island::default() });
    assert!(ron::from_str::<Island>("(wide: 300)").is_err());
    for (bad, field) in [
        (Island { width: 5.0, ..read }, "width"),
        (Island { rim: 0.6, ..read }, "rim"),
        (Island { height: -1.0, ..read }, "height"),
        (Island { hills: f64::NAN, ..read }, "hills"),
        (Island { depth: 0.0, ..read }, "depth"),
        (Island { crags: 1.0, ..read }, "crags"),
        (Island { wavelength: 0.0, ..read }, "wavelength"),
        (Island { octaves: 0, ..read }, "octaves"),
        (Island { cell: 0.2, ..read }, "cell"),
        (Island { radius: 80.0, ..read }, "radius"),
        (Island { strata: 0.5, ..read }, "strata"),
    ] {
        assert!(matches!(bad.volume(AT, None), Err(IslandError::Parameter(error)) if error.field == field));
    }
    let nowhere = read.volume(AT.with_x(f64::NAN), None);
    assert!(matches!(nowhere, Err(IslandError::Parameter(error)) if error.field == "at"));
    let [bottom, top] = read.rasters(AT).unwrap();
    let [_, other] = read.rasters(AT + 8.0).unwrap();
    assert!(matches!(between(&other, &bottom, Distance::Vertical, 10.0), Err(IslandError::Frames { .. })));
    assert!(matches!(
        between(&top, &bottom, Distance::Vertical, 1e4),
        Err(IslandError::Bottom(HeightfieldError::Radius { .. }))
    ));
    assert!(between(&top, &bottom, Distance::Vertical, 10.0).is_ok());
}
