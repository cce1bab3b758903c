//! The device against its twins, on random cameras over a rough synthetic ground; each comparison with a kernel broken beside it.

use super::TessellateError;
use super::refine::{ADVANCE, Capacity, REFINE, Refiner};
use crate::context::{Context, choose, required};
use crate::tessellate::census::Census;
use crate::tessellate::decision::{Decision, Pyramid};
use crate::tessellate::refine::Refinement;
use crate::tessellate::tests::{camera, detail, ground};
use crate::tessellate::triangle::Triangle;
use std::collections::HashSet;

const CAMERAS: u32 = 20;
const ROOM: Capacity = Capacity { list: 1 << 15, leaves: 1 << 16 };

fn device() -> Option<Context> {
    match choose(None).and_then(|adapter| Context::on(&adapter)) {
        Ok(context) => Some(context),
        Err(error) => {
            assert!(!required(), "TERRAIN_REQUIRE_GPU=1: {error}");
            eprintln!("skipped: {error}");
            None
        }
    }
}

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
    let (ground, detail) = (ground(), detail());
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
    let (ground, detail) = (ground(), detail());
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
            Census::of(&refiner.leaves(count).unwrap())
        };
        assert_eq!(census(&mut refiner), Census::default(), "camera {k}");
        cracks += census(&mut control).cracks;
    }
    assert!(cracks > 1000, "{cracks}");
}

#[test]
fn a_list_that_is_too_short_is_an_error_with_what_it_needs_and_grows() {
    let Some(context) = device() else { return };
    let (ground, detail) = (ground(), detail());
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
