//! Sphere tracing and its accelerated form (Génevaux 2015 §7.1, §7.2): steps that go too far, that stop too early, or that stand still.

use super::search::{Finding, Form, Number};
use super::witness::{Measure, Sides, Statement};
use super::{Certificate, Kind};
use glam::DVec3;
use terrain_model::bounds::THRESHOLD;
use terrain_model::falloff::wyvill;
use terrain_model::primitive::disc::Disc;
use terrain_model::program::Program;
use terrain_model::trace::{Answer, HeightRay, Ray, RayFunction, Settings, Surface, Tracer};
use terrain_model::tree::{Node, Tree};

pub(super) const ALL: &[Certificate] = &[
    Certificate {
        id: "step-slope-of-f",
        shows: "A step |h|/λ with λ of f reaches below a plane of that slope.",
        control: "|h|/√(1 + λ²)",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["slope", "half_tilt"],
            root: [(0.05, 2.0), (0.0, 1.0)],
            measure: SlopeOfF,
        }),
    },
    Certificate {
        id: "step-unclamped",
        shows: "A step h/|u_z − ‖u_xy‖λ| with the slope of the candidate segment alone passes through a wall behind it.",
        control: "min(δ, ·)",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["fall", "wall_at", "wall_slope"],
            root: [(0.005, 0.5), (1.5, 50.0), (1.0, 20.0)],
            measure: Unclamped,
        }),
    },
    Certificate {
        id: "step-short",
        shows: "The merged formula stops short where nothing can be met.",
        control: "δ where u_z − ‖u_xy‖λ ≥ 0",
        certifies: &[],
        kind: Kind::Witness(&Statement {
            names: ["height", "climb"],
            root: [(0.001, 1.0), (0.1, 1.0)],
            measure: Short,
        }),
    },
    Certificate {
        id: "step-doubling",
        shows: "Over spikes the candidate that only doubles costs more than three times the evaluations of one that follows the step.",
        control: "the other way round",
        certifies: &[],
        kind: Kind::Proof(doubling),
    },
    Certificate {
        id: "domain-hull",
        shows: "Between two discs a ray inside the hull of the domain passes points of weight 0, where f is 0/0.",
        control: "one component of the domain",
        certifies: &[],
        kind: Kind::Witness(&Statement { names: ["gap", "at"], root: [(0.1, 3.0), (0.0, 1.0)], measure: Hull }),
    },
    Certificate {
        id: "epsilon-parallel",
        shows: "A ray that runs ε/2 above level ground is said to hit it, and never does.",
        control: "a change of sign behind the point",
        certifies: &[],
        kind: Kind::Proof(parallel),
    },
    Certificate {
        id: "step-stands-still",
        shows: "In f32, 100 km from the camera, the step from ε = 1 mm over ground of slope 1 leaves t where it is.",
        control: "the same in f64",
        certifies: &[],
        kind: Kind::Proof(stands_still),
    },
    Certificate {
        id: "side-wall",
        shows: "Where a ray enters the domain below the ground, |h| < ε sees nothing and h < ε a hit: the two algorithms disagree.",
        control: "a ray that enters above the ground",
        certifies: &[],
        kind: Kind::Proof(side_wall),
    },
    Certificate {
        id: "ray-bounds",
        shows: "What both kinds of ray bounds promise over pieces of rays is proved by splitting them.",
        control: "a tenth of the slope",
        certifies: &["trace/height_ray.rs::bounds", "trace/height_ray.rs::enclose"],
        kind: Kind::Proof(ray_bounds),
    },
];

struct SlopeOfF;
impl Measure<2> for SlopeOfF {
    fn sides<R: Number>(&self, [slope, tilt]: [R; 2]) -> Sides<R> {
        // The share of the height that a step uses up over a plane of slope λ: at most all of it. u = (n, −w), against the slope.
        let square = tilt.square();
        let (n, w) = ((tilt + tilt) / (R::one() + square), (R::one() - square) / (R::one() + square));
        let rate = n * slope + w;
        Sides::forms(rate / slope, rate / (R::one() + slope.square()).sqrt(), R::constant(1.0 + 1e-12))
    }
}

/// δ of the candidate segment, metres, over level ground; the ray starts 1 m above it.
const DELTA: f64 = 1.0;

struct Unclamped;
impl Measure<3> for Unclamped {
    fn sides<R: Number>(&self, [fall, wall_at, wall_slope]: [R; 3]) -> Sides<R> {
        // Level until `wall_at`, then rising. u is (1, −fall) up to its length, which cancels: λ = 0 on the segment, s = 1/fall.
        let below = |s: R| {
            let ground = (s - wall_at).max(R::zero()) * wall_slope;
            ground - (R::one() - fall * s)
        };
        let unclamped = R::one() / fall;
        Sides::forms(below(unclamped), below(unclamped.min(R::constant(DELTA))), R::constant(1e-9))
            .where_positive(unclamped - wall_at)
    }
}

struct Short;
impl Measure<2> for Short {
    fn sides<R: Number>(&self, [height, climb]: [R; 2]) -> Sides<R> {
        // Level ground, λ = 0, a ray that climbs: how many of its steps a free step is worth.
        let delta = R::constant(DELTA);
        let printed = delta.min(height / climb);
        Sides::forms(delta / printed, R::one(), R::constant(1.0 + 1e-9))
    }
}

struct Hull;
impl Measure<2> for Hull {
    fn sides<R: Number>(&self, [gap, at]: [R; 2]) -> Sides<R> {
        // Unit discs whose supports are `gap` apart, a ray through both centres; `at` runs from centre to centre.
        let apart = gap + R::constant(2.0);
        let weight = |at: R| {
            let x = at * apart;
            wyvill(x.square()) + wyvill((x - apart).square())
        };
        let lacking = |at: R| R::constant(THRESHOLD) - weight(at);
        // A component: the first disc, of which the terrain is the inner 0.45.
        let inside = at * R::constant(0.45) / apart;
        Sides::forms(lacking(at), lacking(inside), R::constant(1e-9))
    }
}

/// A plain with two hundred spikes along 1 km.
fn spikes() -> Option<Program> {
    let mut tree = Tree::new();
    let flat = |x: f64, radius: f64, z: f64| Disc { centre: DVec3::new(x, 0.0, z), radius, weight: 1.0, noise: None };
    let plain = tree.push(flat(0.0, 1e5, 0.0));
    let spikes = (0..50).map(|k| tree.push(flat(10.0 + 20.0 * f64::from(k), 2.0, 5.0))).collect();
    let spikes = tree.push(Node::Blend(spikes));
    let rule = terrain_model::operator::WeightRule::Keep;
    let root = tree.push(Node::Replace { a: plain, b: spikes, rule });
    Program::compile(&tree, root).ok()
}

const UNDECIDED: Finding = Finding::Undecided { bound: f64::NAN, known: f64::NAN, boxes: 0 };

fn doubling(form: Form) -> Finding {
    let Some(program) = spikes() else { return UNDECIDED };
    let surface = Surface::new(&program);
    let count = |tracer: Tracer| {
        let mut ray = HeightRay::new(&surface);
        // Over the spikes' tops, sinking to the plain behind them.
        ray.aim(Ray { origin: DVec3::new(0.0, 0.3, 7.0), direction: DVec3::new(1.0, 0.0, -0.0045).normalize() });
        let settings = Settings { max_steps: 1_000_000, ..Settings::default() };
        let _ = tracer.trace(&surface, &mut ray, &settings);
        ray.evaluations() as f64
    };
    let (doubled, followed) = (count(Tracer::AcceleratedPaper), count(Tracer::Accelerated));
    let (more, fewer) = form.pick((doubled, followed), (followed, doubled));
    if more > 3.0 * fewer {
        Finding::Proved { bound: more, attained: 3.0 * fewer, boxes: 1 }
    } else {
        Finding::Refuted { bound: more, value: 3.0 * fewer, at: "the ray over the spikes".to_owned() }
    }
}

fn plateau(z: f64) -> Option<Program> {
    let mut tree = Tree::new();
    let root = tree.push(Disc { centre: DVec3::new(0.0, 0.0, z), radius: 100.0, weight: 1.0, noise: None });
    Program::compile(&tree, root).ok()
}

/// Every tracer says that the ray misses, though all along 0 ≤ h < ε; control: a ray that descends by ε is a hit.
fn parallel(form: Form) -> Finding {
    let Some(program) = plateau(0.0) else { return UNDECIDED };
    let surface = Surface::new(&program);
    let settings = Settings::default();
    let direction = form.pick(DVec3::X, DVec3::new(1.0, 0.0, -settings.epsilon / 40.0).normalize());
    let missed = Tracer::ALL.iter().all(|tracer| {
        let mut ray = HeightRay::new(&surface);
        ray.aim(Ray { origin: DVec3::new(-40.0, 0.0, settings.epsilon / 2.0), direction });
        tracer.trace(&surface, &mut ray, &settings) == Answer::Miss
    });
    if missed {
        Finding::Proved { bound: settings.epsilon, attained: settings.epsilon / 2.0, boxes: 3 }
    } else {
        Finding::Refuted { bound: 0.0, value: settings.epsilon, at: "a tracer says that it is hit".to_owned() }
    }
}

fn stands_still(form: Form) -> Finding {
    let (t, epsilon, slope) = (1e5f64, 1e-3f64, 1.0f64);
    let step = epsilon / (1.0 + slope * slope).sqrt();
    let still = match form {
        Form::Stated => (t as f32) + (step as f32) == t as f32,
        Form::Perturbed => t + step == t,
    };
    if still {
        Finding::Proved { bound: step, attained: 0.0, boxes: 1 }
    } else {
        Finding::Refuted { bound: 0.0, value: step, at: "t = 100 km".to_owned() }
    }
}

fn side_wall(form: Form) -> Finding {
    // The plateau is 10 m high; the ray comes in at 5 m, or above it.
    let Some(program) = plateau(10.0) else { return UNDECIDED };
    let surface = Surface::new(&program);
    let mut ray = HeightRay::new(&surface);
    ray.aim(Ray { origin: DVec3::new(-200.0, 0.0, form.pick(5.0, 15.0)), direction: DVec3::X });
    let Answer::Wall { t } = Tracer::Accelerated.trace(&surface, &mut ray, &Settings::default()) else {
        return Finding::Refuted { bound: 0.0, value: 1.0, at: "no wall is met".to_owned() };
    };
    let height = ray.value(t).height;
    let epsilon = Settings::default().epsilon;
    // §7.1 wants |h| < ε for a hit, §7.2 h < ε.
    let (by_magnitude, by_sign) = (height.abs() < epsilon, height < epsilon);
    if by_magnitude != by_sign {
        Finding::Proved { bound: height.abs(), attained: epsilon, boxes: 1 }
    } else {
        Finding::Refuted { bound: epsilon, value: height.abs(), at: format!("t = {t}") }
    }
}

/// Pieces that a stretch of ray is cut into.
const PIECES: u32 = 512;

fn ray_bounds(form: Form) -> Finding {
    let mut tree = Tree::new();
    let flat = |x: f64, z: f64| Disc { centre: DVec3::new(x, 0.0, z), radius: 60.0, weight: 1.0, noise: None };
    let operands = vec![tree.push(flat(-20.0, 0.0)), tree.push(flat(20.0, 15.0)), tree.push(flat(0.0, 5.0))];
    let root = tree.push(Node::Blend(operands));
    let Ok(program) = Program::compile(&tree, root) else { return UNDECIDED };
    let surface = Surface::new(&program);
    let scale = form.pick(1.0, 0.1);
    let rays = [(-50.0, 3.0, 1.0, 0.1), (40.0, -20.0, -0.8, 0.6), (0.0, -50.0, 0.1, 1.0)];
    Finding::all(rays.map(|(x, y, ux, uy)| {
        let mut ray = HeightRay::new(&surface);
        let direction = DVec3::new(ux, uy, -0.3).normalize();
        ray.aim(Ray { origin: DVec3::new(x, y, 30.0), direction });
        let (from, to) = (5.0, 30.0);
        let promised = [ray.bounds(from, to), ray.enclose(from, to)];
        let (mut steepest, mut boxes) = (0.0f64, 0);
        for k in 0..PIECES {
            let edge = |k: u32| from + (to - from) * f64::from(k) / f64::from(PIECES);
            let piece = ray.enclose(edge(k), edge(k + 1));
            let middle = 0.5 * (edge(k) + edge(k + 1));
            let slope = ray.slope(middle);
            steepest = steepest.max((slope - direction.z).abs());
            boxes += 1;
            for whole in &promised {
                // One piece over-estimates by about its share of the whole.
                let room = 0.01 * (1.0 + whole.slope.width());
                let climb = (whole.slope.hi() - direction.z) * scale;
                if (slope - direction.z).abs() > climb.abs() + room || !whole.height.contains(ray.value(middle).height)
                {
                    let at = format!("t = {middle}");
                    return Finding::Refuted { bound: climb, value: slope - direction.z, at };
                }
                if piece.slope.hi() - direction.z > climb.abs() + room
                    || piece.height.hi() > whole.height.hi() + room
                    || piece.height.lo() < whole.height.lo() - room
                    || piece.weight.hi() > whole.weight.hi() + room
                {
                    return Finding::Undecided { bound: climb, known: piece.slope.hi() - direction.z, boxes };
                }
            }
        }
        Finding::Proved { bound: promised[1].slope.hi() - direction.z, attained: steepest, boxes }
    }))
}
