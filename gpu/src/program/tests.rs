use super::*;
use crate::context::device;
use glam::{DVec2, DVec3};
use terrain_model::interval::Interval;
use terrain_model::noise::{Combination, Octaves};
use terrain_model::primitive::disc::{Disc, DiscNoise};
use terrain_model::program::{Instruction, Program, TileProgram};
use terrain_model::rounding::Rounded;
use terrain_model::tree::{Node, Tree};

fn disc(x: f64) -> Disc {
    Disc { centre: DVec3::new(x, 0.0, 50.0), radius: 100.0, weight: 1.0, noise: None }
}

fn encode(tree: &Tree, root: terrain_model::tree::NodeId) -> Encoded {
    Encoded::new(&TileProgram::new(&Program::compile(tree, root).unwrap(), DVec2::ZERO))
}

#[test]
fn the_device_agrees_with_f64_within_the_derived_tolerance_and_a_perturbed_shader_does_not() {
    let Some(context) = device() else { return };
    let outcome = conformance::run(&context, 96, 5).unwrap_or_else(|error| panic!("{error}"));
    eprintln!("{}: {outcome:?}", context.description().name);
    assert_eq!((outcome.failures, outcome.lane_failures), (0, 0), "{outcome:?}");
    assert!(outcome.cases > 5_000 && outcome.vacuous * 20 < outcome.cases, "{outcome:?}");
    assert!(outcome.control_failures > outcome.cases / 4 && outcome.blind_controls == 0, "{outcome:?}");
}

#[test]
fn opcodes_of_the_shader_are_those_of_the_model_and_it_runs_all_of_them() {
    let text = source([8, 8]);
    for (opcode, name) in Instruction::names().iter().enumerate() {
        assert!(text.contains(&format!("const {} = {opcode}u;", constant(name))), "{name}");
        let cases = text.lines().filter_map(|line| line.trim().strip_prefix("case ")?.strip_suffix(": {"));
        let runs = cases.flat_map(|case| case.split(", ")).filter(|case| **case == constant(name)).count();
        assert!(runs == 1, "{name}");
    }
}

#[test]
fn wide_blends_need_no_deeper_stack_and_a_tree_that_is_too_deep_is_refused() {
    let mut tree = Tree::new();
    let discs: Vec<_> = (0..1000).map(|k| tree.push(disc(f64::from(k)))).collect();
    let wide = tree.push(Node::Blend(discs));
    assert_eq!(encode(&tree, wide).depth, [2, 1]);
    let mut deep = wide;
    for _ in 0..100 {
        let first = tree.push(disc(1.0));
        deep = tree.push(Node::Blend(vec![first, deep]));
    }
    let deep = encode(&tree, deep);
    assert_eq!(deep.depth, [102, 1]);
    let Some(context) = device() else { return };
    let refused = Interpreter::new(&context, &deep).unwrap_err().to_string();
    assert!(refused.contains("levels deep"), "{refused}");
}

/// Mesa's processor ends the loops of an invocation after some 8,000 iterations: this program takes 18,000.
#[test]
fn a_program_that_a_driver_cuts_short_is_an_error_and_no_wrong_ground() {
    let Some(context) = device() else { return };
    let octaves = Octaves { octaves: 16, frequency: 0.01, lacunarity: 1.3, gain: 0.8, amplitude: 5.0 };
    let mut tree = Tree::new();
    let noisy = |seed| Disc { noise: Some(DiscNoise { combination: Combination::Sum, octaves, seed }), ..disc(0.0) };
    let parts = (0..1000).map(|seed| tree.push(noisy(seed))).collect();
    let root = tree.push(Node::Blend(parts));
    let program = Program::compile(&tree, root).unwrap();
    let tile = TileProgram::new(&program, DVec2::ZERO);
    let encoded = Encoded::new(&tile);
    let points = [[0.0, 0.0], [10.0, 5.0], [-20.0, 30.0]];
    match Interpreter::new(&context, &encoded).unwrap().evaluate(&context, &encoded, &points) {
        Err(ProgramError::Cut) => assert!(context.description().software, "a graphics card runs loops to their end"),
        Err(error) => panic!("{error}"),
        Ok(found) => {
            for ([x, y], [elevation, weight]) in points.into_iter().zip(found) {
                let p = [x, y].map(|x| Rounded::new(Interval::point(f64::from(x)), 0.0));
                let (f, alpha) = tile.run(&mut tile.evaluator::<Rounded>(), p);
                let off = |found: f32, right: Rounded| {
                    f64::from(found) < right.exact.lo() - conformance::DEVICE * right.error
                        || f64::from(found) > right.exact.hi() + conformance::DEVICE * right.error
                };
                assert!(!off(elevation, f) && !off(weight, alpha), "{x} {y}: {elevation} {weight}, {f:?} {alpha:?}");
            }
        }
    }
}
