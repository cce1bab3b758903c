use super::*;
use crate::context::required;
use glam::{DVec2, DVec3};
use terrain_model::primitive::disc::Disc;
use terrain_model::program::{Instruction, Program, TileProgram};
use terrain_model::tree::{Node, Tree};

fn context() -> Option<Context> {
    match Context::new(None) {
        Ok(context) => Some(context),
        Err(error) if required() => panic!("{error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

fn disc(x: f64) -> Disc {
    Disc { centre: DVec3::new(x, 0.0, 50.0), radius: 100.0, weight: 1.0, noise: None }
}

fn encode(tree: &Tree, root: terrain_model::tree::NodeId) -> Encoded {
    Encoded::new(&TileProgram::new(&Program::compile(tree, root).unwrap(), DVec2::ZERO))
}

#[test]
fn the_device_agrees_with_f64_within_the_derived_tolerance_and_a_perturbed_shader_does_not() {
    let Some(context) = context() else { return };
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
    let Some(context) = context() else { return };
    let refused = Interpreter::new(&context, &deep).unwrap_err().to_string();
    assert!(refused.contains("levels deep"), "{refused}");
}
