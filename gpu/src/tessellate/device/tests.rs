//! The device against its twins, on random cameras over a rough synthetic ground; each comparison with a kernel broken beside it.

use super::TessellateError;
use super::displace::{DISPLACE, Displacer, VERTICES, lattice_vertices};
use super::refine::{ADVANCE, Capacity, REFINE, Refiner};
use crate::context::device;
use crate::program::conformance::DEVICE;
use crate::tessellate::census::Census;
use crate::tessellate::decision::{Decision, Pyramid};
use crate::tessellate::refine::Refinement;
use crate::tessellate::surface::Surface;
use crate::tessellate::tests::{camera, detail, kinds, partial};
use crate::tessellate::triangle::{Triangle, Vertex};
use std::collections::{HashMap, HashSet};
use terrain_model::noise::Octaves;
use terrain_model::rounding::Rounded;

const CAMERAS: u32 = 20;
const ROOM: Capacity = Capacity { list: 1 << 15, leaves: 1 << 16 };

/// Leaves that no rounding gives, and leaves that every rounding gives but are not there.
fn wrong(decision: &Decision<'_>, found: &[Triangle], cull: bool) -> usize {
    let [certain, open] = decision.possible_leaves(cull);
    let all: HashSet<&Triangle> = certain.iter().chain(&open).collect();
    let found: HashSet<&Triangle> = found.iter().collect();
    found.difference(&all).count() + certain.iter().filter(|leaf| !found.contains(leaf)).count()
}

#[test]
fn the_device_has_the_leaves_of_its_twin_and_a_kernel_with_another_rule_has_not() {
    let Some(context) = device() else { return };
    let (ground, detail) = (partial(), detail());
    let pyramid = Pyramid::new(&ground);
    let mut refiner = Refiner::new(&context, &pyramid, ROOM).unwrap();
    let other = REFINE.replace("decision.radii[level]", "decision.radii[level] * 0.99");
    assert_ne!(other, REFINE);
    let mut control = Refiner::compile(&context, [&other, ADVANCE], &pyramid, ROOM).unwrap();
    let mut seen_in_control = 0;
    for k in 0..CAMERAS {
        let refinement = Refinement::new(&ground, &detail, camera(&ground, k), 24.0, 22);
        let decision = Decision::new(&pyramid, &refinement);
        for cull in [false, true] {
            let count = refiner.refine_growing(&decision, cull).unwrap();
            let mut found = refiner.leaves(count).unwrap();
            assert_eq!(wrong(&decision, &found, cull), 0, "camera {k}");
            if context.description().software {
                // Nothing is contracted there: the same operations give the same bits.
                let mut twin = decision.leaves(cull);
                found.sort_unstable();
                twin.sort_unstable();
                assert!(found == twin, "camera {k}: {} leaves, the twin has {}", found.len(), twin.len());
            }
            let count = control.refine_growing(&decision, cull).unwrap();
            seen_in_control += wrong(&decision, &control.leaves(count).unwrap(), cull);
        }
    }
    assert!(seen_in_control > 100, "{seen_in_control}");
}

#[test]
fn leaves_of_the_device_fit_and_those_of_radii_that_do_not_nest_leave_cracks() {
    let Some(context) = device() else { return };
    let (ground, detail) = (partial(), detail());
    let pyramid = Pyramid::new(&ground);
    let mut refiner = Refiner::new(&context, &pyramid, ROOM).unwrap();
    let other = REFINE.replace("decision.radii[level]", "decision.radii[level] * select(1.0, 0.36, level % 2u == 1u)");
    assert_ne!(other, REFINE);
    let mut control = Refiner::compile(&context, [&other, ADVANCE], &pyramid, ROOM).unwrap();
    let mut cracks = 0;
    for k in 0..CAMERAS {
        let refinement = Refinement::new(&ground, &detail, camera(&ground, k), 24.0, 22);
        let decision = Decision::new(&pyramid, &refinement);
        let census = |refiner: &mut Refiner<'_>| {
            let count = refiner.refine_growing(&decision, false).unwrap();
            Census::of(&refiner.leaves(count).unwrap(), ground.end())
        };
        assert_eq!(census(&mut refiner), Census::default(), "camera {k}");
        cracks += census(&mut control).cracks;
    }
    assert!(cracks > 1000, "{cracks}");
}

#[test]
fn a_list_that_is_too_short_is_an_error_with_what_it_needs_and_grows() {
    let Some(context) = device() else { return };
    let (ground, detail) = (partial(), detail());
    let pyramid = Pyramid::new(&ground);
    let refinement = Refinement::new(&ground, &detail, camera(&ground, 1), 24.0, 22);
    let decision = Decision::new(&pyramid, &refinement);
    let whole = decision.leaves(true).len();
    for short in [Capacity { list: 64, ..ROOM }, Capacity { leaves: 100, ..ROOM }] {
        let mut refiner = Refiner::new(&context, &pyramid, short).unwrap();
        let error = refiner.refine(&decision, true).unwrap_err();
        let TessellateError::Overflow { needed, capacity, .. } = error else { panic!("{error}") };
        assert!(capacity == 64 && needed > 64 || capacity == 100 && needed as usize == whole, "{error}");
        assert!(!error.to_string().contains('\n'));
        assert_eq!(refiner.refine_growing(&decision, true).unwrap() as usize, whole);
        assert!(refiner.capacity().list > 64 && refiner.capacity().leaves as usize >= whole);
    }
    let huge = Capacity { list: u32::MAX, ..ROOM };
    let error = Refiner::new(&context, &pyramid, huge).err().map(|error| error.to_string()).unwrap();
    assert!(error.contains("triangles of a level") && error.contains("a binding"), "{error}");
}

/// Largest distance from what `f64` says, over what is derived: positions and normals, of each of `found`. `None` where the
/// derived error is too wide to say anything: at the eye itself, and for normals where a clamped share may or may not vary.
fn shares<const N: usize>(surface: &Surface<'_>, vertex: Vertex, found: [[[f32; 3]; 2]; N]) -> [[Option<f64>; 2]; N] {
    let (exact, derived) = (surface.point::<f64>(vertex), surface.point::<Rounded>(vertex));
    found.map(|found| {
        [0, 1].map(|part| {
            let each = (0..3).map(|k| {
                let tolerance = DEVICE * derived[part][k].error + 1e-30;
                ((f64::from(found[part][k]) - exact[part][k]).abs() / tolerance, tolerance)
            });
            // A number that is none is no share of anything.
            let most = |a: f64, b: f64| if b.is_nan() { f64::INFINITY } else { a.max(b) };
            let (share, tolerance) = each.fold((0.0f64, 0.0f64), |a, b| (most(a.0, b.0), most(a.1, b.1)));
            (tolerance < 0.3).then_some(share)
        })
    })
}

#[test]
fn vertices_of_the_device_lie_within_what_is_derived_of_f64_and_those_of_another_octave_or_fade_do_not() {
    let Some(context) = device() else { return };
    let (ground, detail) = (partial(), detail());
    let pyramid = Pyramid::new(&ground);
    let mut refiner = Refiner::new(&context, &pyramid, ROOM).unwrap();
    let mut displacers = [
        DISPLACE.to_owned(),
        DISPLACE.replace("(band * octave.amplitude)", "(band * octave.amplitude * select(1.0, 1.02, k == 0u))"),
        DISPLACE.replace("- 15.0)", "- 14.99)"),
    ]
    .map(|source| Displacer::compile(&context, &source, &ground).unwrap());
    let (mut all, mut vacuous, mut seen_in_controls) = (0usize, [0usize; 2], [[0usize; 2]; 2]);
    let (mut largest, mut metres) = ([0.0f64; 2], 0.0f64);
    for k in 0..4 {
        let refinement = Refinement::new(&ground, &detail, camera(&ground, k), 24.0, 22);
        let decision = Decision::new(&pyramid, &refinement);
        let surface = Surface::new(&refinement, decision.origin());
        let count = refiner.refine_growing(&decision, true).unwrap();
        let vertices: Vec<Vertex> = refiner.leaves(count).unwrap().iter().flat_map(lattice_vertices).collect();
        let found = displacers.each_mut().map(|displacer| {
            displacer.displace(&refiner, &surface).unwrap();
            displacer.read(count).unwrap()
        });
        assert!(found.iter().all(|found| found.len() == vertices.len()));
        for at in (0..vertices.len()).step_by(vertices.len() / 500 + 1) {
            let [right, wrong @ ..] = shares(&surface, vertices[at], found.each_ref().map(|found| found[at]));
            all += 1;
            let exact = surface.point::<f64>(vertices[at])[0];
            metres = (0..3).fold(metres, |most, k| most.max((f64::from(found[0][at][0][k]) - exact[k]).abs()));
            for part in 0..2 {
                match right[part] {
                    Some(share) => largest[part] = largest[part].max(share),
                    None => vacuous[part] += 1,
                }
                for (seen, wrong) in seen_in_controls.iter_mut().zip(wrong) {
                    seen[part] += usize::from(wrong[part].is_some_and(|share| share > 1.0));
                }
            }
        }
    }
    let name = &context.description().name;
    eprintln!("{name}: {metres} m, {largest:?} of the tolerance, {vacuous:?} of {all} vacuous");
    eprintln!("controls: {seen_in_controls:?}");
    assert!(largest.iter().all(|share| *share <= 1.0), "{largest:?}");
    assert!((0..2).all(|part| vacuous[part] * 20 < all), "{vacuous:?} of {all}");
    let [octave, fade] = seen_in_controls;
    assert!(octave[0] * 10 > all && fade.iter().all(|seen| seen * 4 > all), "{seen_in_controls:?} of {all}");
}

#[test]
fn every_way_of_displacing_is_that_of_its_twin_and_of_no_other_and_keeps_its_amplitude() {
    let Some(context) = device() else { return };
    let ground = partial();
    let pyramid = Pyramid::new(&ground);
    let mut refiner = Refiner::new(&context, &pyramid, ROOM).unwrap();
    let mut displacer = Displacer::new(&context, &ground).unwrap();
    let octaves = Octaves { octaves: 5, frequency: 0.02, lacunarity: 2.0, gain: 0.6, amplitude: 6.0 };
    let kinds = kinds(&octaves);
    for (at, detail) in kinds.iter().enumerate() {
        let refinement = Refinement::new(&ground, detail, camera(&ground, 1), 24.0, 22);
        let decision = Decision::new(&pyramid, &refinement);
        let surface = Surface::new(&refinement, decision.origin());
        let other = &kinds[(at + 1) % kinds.len()];
        let other = Surface::new(&Refinement::new(&ground, other, *refinement.view(), 24.0, 22), decision.origin());
        let count = refiner.refine_growing(&decision, true).unwrap();
        let vertices: Vec<Vertex> = refiner.leaves(count).unwrap().iter().flat_map(lattice_vertices).collect();
        displacer.displace(&refiner, &surface).unwrap();
        let found = displacer.read(count).unwrap();
        let (mut all, mut vacuous, mut beyond, mut largest, mut moved) = (0, [0; 2], 0, [0.0f64; 2], 0.0f64);
        for k in (0..vertices.len()).step_by(vertices.len() / 400 + 1) {
            all += 1;
            let [right] = shares(&surface, vertices[k], [found[k]]);
            for part in 0..2 {
                match right[part] {
                    Some(share) => largest[part] = largest[part].max(share),
                    None => vacuous[part] += 1,
                }
            }
            let [wrong] = shares(&other, vertices[k], [found[k]]);
            beyond += usize::from(wrong[0].is_some_and(|share| share > 1.0));
            let smooth = ground.smooth(vertices[k]).0;
            let off = |axis: usize| f64::from(found[k][0][axis]) + refinement.view().eye[axis] - smooth[axis];
            moved = moved.max((0..3).map(|axis| off(axis) * off(axis)).sum::<f64>().sqrt());
        }
        eprintln!("{at}: {largest:?} of the tolerance, {vacuous:?} of {all} vacuous, {beyond} beyond, {moved} m");
        assert!(largest.iter().all(|share| *share <= 1.0), "{detail:?}: {largest:?}");
        assert!((0..2).all(|part| vacuous[part] * 10 < all), "{detail:?}: {vacuous:?} of {all}");
        assert!(beyond * 10 > all, "{detail:?}: {beyond} of {all} by another way");
        // A millimetre is for `f32` at the distances of this ground.
        assert!(moved <= 6.001 && moved > 0.5, "{detail:?}: {moved} m");
    }
}

#[test]
fn equal_vertices_have_equal_bits_and_unequal_ones_do_not() {
    let Some(context) = device() else { return };
    let (ground, detail) = (partial(), detail());
    let pyramid = Pyramid::new(&ground);
    let mut refiner = Refiner::new(&context, &pyramid, ROOM).unwrap();
    let mut displacer = Displacer::new(&context, &ground).unwrap();
    let refinement = Refinement::new(&ground, &detail, camera(&ground, 3), 24.0, 22);
    let decision = Decision::new(&pyramid, &refinement);
    let count = refiner.refine_growing(&decision, false).unwrap();
    let leaves = refiner.leaves(count).unwrap();
    displacer.displace(&refiner, &Surface::new(&refinement, decision.origin())).unwrap();
    // Beyond the raster vertices are those of its border.
    let mut known: HashMap<Vertex, [u32; 6]> = HashMap::new();
    let (mut shared, mut levels) = (0, HashMap::new());
    for (at, (vertex, point)) in
        leaves.iter().flat_map(lattice_vertices).zip(displacer.read(count).unwrap()).enumerate()
    {
        let vertex = ground.within(vertex);
        let bits: Vec<u32> = point.as_flattened().iter().map(|x| x.to_bits()).collect();
        let bits: [u32; 6] = bits.try_into().unwrap();
        assert!(point.as_flattened().iter().all(|x| x.is_finite()));
        shared += usize::from(known.get(&vertex).is_some_and(|other| {
            assert_eq!(*other, bits, "{vertex:?}");
            true
        }));
        known.insert(vertex, bits);
        levels.entry(vertex).or_insert_with(HashSet::new).insert(leaves[at / VERTICES].level);
    }
    let across_levels = levels.values().filter(|levels| levels.len() > 1).count();
    assert!(shared > 1000 && across_levels > 100, "{shared} shared, {across_levels} by leaves of two levels");
    let different: HashSet<&[u32; 6]> = known.values().collect();
    assert_eq!(different.len(), known.len());
}
