//! Ranges and slopes of the lattice noises: the witness found here, the published constant, and the proof, run on the spot where
//! it takes seconds, from its stored splits or by its record where it takes minutes.

use crate::experiment::Profile;
use rayon::prelude::*;
use std::time::Instant;
use terrain_model::certify::noise::{
    CellNoise, Simplex3, gradient2_range, gradient2_slope, gradient3_range, gradient3_slope, simplex3_face,
    simplex3_range, simplex3_slope_root,
};
use terrain_model::certify::{Verdict, tree};
use terrain_model::noise::{
    GRADIENT2_RANGE, GRADIENT2_SLOPE, GRADIENT3_RANGE, GRADIENT3_SLOPE, Prey, SIMPLEX3_RANGE, SIMPLEX3_SLOPE, hunt,
};

/// How a constant is known.
#[derive(Clone, Debug, PartialEq)]
pub enum Proof {
    /// Proved in this run, by a search or by all of its stored splits.
    Here {
        /// Boxes looked at.
        boxes: u64,
    },
    /// Part of the stored splits was checked in this run.
    Sampled {
        /// Leaves checked.
        leaves: u64,
    },
    /// Proved by the tests, not in this run.
    Recorded {
        /// What they record.
        what: &'static str,
    },
    /// It failed: the constant is wrong.
    Failed {
        /// What the search said.
        why: String,
    },
}

/// A published constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// Noise and quantity.
    pub name: &'static str,
    /// The largest value found by climbing.
    pub witness: f64,
    /// What is published.
    pub certified: f64,
    /// How it is known.
    pub proof: Proof,
    /// Wall time of the proof here.
    pub seconds: f64,
}

impl Constant {
    /// Constant over witness, 1 or above.
    pub fn ratio(&self) -> f64 {
        self.certified / self.witness
    }
    /// Does nothing speak against it?
    pub fn stands(&self) -> bool {
        self.witness <= self.certified && !matches!(self.proof, Proof::Failed { .. })
    }
}

const BUDGET: u64 = 1_000_000;

/// What a search for a proof said.
pub fn proof<const N: usize>(verdict: Verdict<N>) -> Proof {
    match verdict {
        Verdict::Proved { boxes, .. } => Proof::Here { boxes },
        other => Proof::Failed { why: format!("{other:?}") },
    }
}

const STORED: [&[u8]; 2] = [
    include_bytes!("../../../../model/certificates/simplex3-slope.0"),
    include_bytes!("../../../../model/certificates/simplex3-slope.1"),
];

/// Checks every `nth` piece of the stored proof of the slope of simplex noise against `target`.
pub fn stored(target: f64, nth: usize) -> Proof {
    let faces: Vec<_> = (0..2)
        .into_par_iter()
        .map(|face| {
            let chosen = |piece: usize| piece % nth == 12 % nth;
            tree::check(&simplex3_face(face), simplex3_slope_root(), target, STORED[face], chosen)
        })
        .collect();
    let mut leaves = 0;
    for face in faces {
        match face {
            Ok(n) => leaves += n,
            Err(error) => return Proof::Failed { why: error.to_string() },
        }
    }
    if nth == 1 { Proof::Here { boxes: leaves } } else { Proof::Sampled { leaves } }
}

/// All constants, with `evaluations` for each witness.
pub fn constants(profile: Profile, seed: u32, evaluations: u32) -> Vec<Constant> {
    let witnesses: Vec<_> = [Prey::Gradient2, Prey::Gradient3, Prey::Simplex3]
        .into_par_iter()
        .map(|prey| hunt(prey, seed, evaluations))
        .map(|found| (found.values[1], found.slope))
        .collect();
    let timed = |name, witness, certified, prove: &dyn Fn(f64) -> Proof| {
        let start = Instant::now();
        let proof = prove(certified);
        Constant { name, witness, certified, proof, seconds: start.elapsed().as_secs_f64() }
    };
    let space_slope = |target| match profile {
        Profile::Full => proof(gradient3_slope(target, BUDGET)),
        Profile::Quick => Proof::Recorded { what: "209 thousand boxes; the full profile and the tests prove it" },
    };
    let nth = profile.pick(64, 1);
    let [(range2, slope2), (range3, slope3), (range_s, slope_s)] = witnesses[..] else { return Vec::new() };
    vec![
        timed("plane, range", range2, GRADIENT2_RANGE, &|target| proof(gradient2_range(target, BUDGET))),
        timed("plane, slope", slope2, GRADIENT2_SLOPE, &|target| proof(gradient2_slope(target, BUDGET))),
        timed("space, range", range3, GRADIENT3_RANGE, &|target| proof(gradient3_range(target, BUDGET))),
        timed("space, slope", slope3, GRADIENT3_SLOPE, &space_slope),
        timed("simplex, range", range_s, SIMPLEX3_RANGE, &|target| proof(simplex3_range(target, BUDGET))),
        timed("simplex, slope", slope_s, SIMPLEX3_SLOPE, &|target| stored(target, nth)),
    ]
}

/// The scale of the classic formula, whose edge gradients have length √2.
const CLASSIC_SCALE: f64 = 32.0;

/// How far classic simplex noise in space can jump across the face between two tetrahedra when its kernel is (`reach` − d²)⁴.
///
/// At the foot of a corner on the face opposite to it, the corner behind the face drops out of the sum and its mirror image
/// comes in; with opposite gradients along their offsets the two contributions add.
pub fn simplex_jump(reach: f64) -> f64 {
    let foot = [1.0 / 3.0, 1.0 / 3.0, -1.0 / 6.0];
    // The corner that the face x = y leaves out.
    let offset = Simplex3.corners_at(foot)[1].offset;
    let distance_squared: f64 = offset.iter().map(|x| x * x).sum();
    let kernel = (reach - distance_squared).max(0.0);
    2.0 * CLASSIC_SCALE * kernel * kernel * kernel * kernel * Simplex3.support(offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_certificates_prove_the_constants_and_refute_what_a_witness_passes() {
        assert!(matches!(proof(gradient2_slope(GRADIENT2_SLOPE, BUDGET)), Proof::Here { boxes } if boxes > 500));
        assert!(matches!(gradient2_slope(2.067, BUDGET), Verdict::Refuted { .. }));
        assert!(matches!(proof(gradient2_range(0.6, BUDGET)), Proof::Failed { .. }));
    }

    #[test]
    fn stored_splits_prove_their_slope_and_not_less() {
        assert!(matches!(stored(SIMPLEX3_SLOPE, 64), Proof::Sampled { leaves } if leaves > 1000));
        assert!(matches!(stored(0.98 * SIMPLEX3_SLOPE, 1), Proof::Failed { .. }));
    }

    #[test]
    fn a_kernel_that_reaches_past_its_tetrahedron_jumps() {
        // Claims G31: 0.0064 for 0.6, nothing for 1/2. The offsets round by an ulp, whose fourth power is 0.
        assert!((simplex_jump(0.6) - 0.0064).abs() < 1e-9, "{}", simplex_jump(0.6));
        assert!(simplex_jump(0.5) < 1e-60);
    }
}
