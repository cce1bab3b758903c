//! Invasion percolation (Wilkinson and Willemsen 1983; Paris 2019 §6.2): of all candidates, the one in the weakest rock is
//! invaded next, and brings candidates of its own. Where those lie is a parameter, so that a lattice and a hemisphere are
//! one algorithm.

use super::random::Random;
use crate::sampling::exclusion::Exclusion;
use glam::DVec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The most candidates.
const CAPACITY: usize = 1 << 30;

/// Where percolation begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// The first site.
    pub position: DVec3,
    /// Does its network grow against the flow?
    pub upstream: bool,
}

/// A site that was invaded; its place in the list is the step at which it was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Where, metres.
    pub position: DVec3,
    /// ρ there.
    pub resistance: f64,
    /// The step of the site that found it; `None` of a start.
    pub parent: Option<u32>,
    /// Which start it grew from.
    pub start: u32,
}

/// How sites are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// No two candidates, invaded or not, are nearer than this, metres.
    pub spacing: f64,
    /// ε: a candidate's place in the queue is ρ + εu, u uniform in [−1, 1); 0 is the deterministic original.
    pub perturbation: f64,
    /// Percolation stops when the first in the queue is not below this.
    pub threshold: f64,
    /// The most sites.
    pub limit: usize,
    /// Of the perturbation.
    pub seed: u32,
}

/// Where candidates lie around a site.
pub trait Propagation {
    /// Appends the places to try around `position`, in their order.
    fn candidates(&self, position: DVec3, upstream: bool, found: &mut Vec<DVec3>);
}

/// A candidate of the queue beside its position.
#[derive(Clone, Copy)]
struct Candidate {
    resistance: f64,
    parent: Option<u32>,
    start: u32,
}

/// Numbers in their order; −0 is 0.
fn ordered(key: f64) -> u64 {
    let bits = (key + 0.0).to_bits();
    if bits >> 63 == 1 { !bits } else { bits | (1 << 63) }
}

/// The sites in the order in which they are invaded.
///
/// The queue is a heap with the *least* resistant first: the text orders it "by decreasing resistance" and takes the
/// least resistant, which is its last (claims P16). A candidate keeps the place it was given when it entered, since keys
/// that change inside a heap break its order. It enters only if no candidate that ever entered is nearer than the
/// spacing; tested against the queue alone, as printed, places that were invaded could be filled again without end (claims
/// P17). Within a bounded `inside` that packs: with n starts and spacing a there are at most n + vol(inside ⊕ ball a/2) /
/// vol(ball a/2) candidates, so the loop ends. Equal keys are served in the order of entry.
///
/// Starts too near an earlier one are left out. `resistance` is read once for each candidate that enters; starts enter
/// whether they are `inside` or not, being the mouths of the rock.
pub fn percolate(
    starts: &[Start],
    rule: &Rule,
    resistance: impl Fn(DVec3) -> f64,
    inside: impl Fn(DVec3) -> bool,
    propagation: &impl Propagation,
) -> Vec<Site> {
    let mut taken = Exclusion::new(2.0 * rule.spacing);
    let mut queue: BinaryHeap<Reverse<(u64, u32)>> = BinaryHeap::new();
    let mut candidates: Vec<Candidate> = Vec::new();
    let enter = |taken: &mut Exclusion, queue: &mut BinaryHeap<_>, all: &mut Vec<Candidate>, p, parent, start| {
        let resistance = resistance(p);
        let noise = if rule.perturbation > 0.0 { Random::at(rule.seed, p).signed(0) } else { 0.0 };
        queue.push(Reverse((ordered(resistance + rule.perturbation * noise), taken.points().len() as u32)));
        taken.insert(p);
        all.push(Candidate { resistance, parent, start });
    };
    for (k, start) in starts.iter().enumerate() {
        if !taken.any_within(start.position, rule.spacing) {
            enter(&mut taken, &mut queue, &mut candidates, start.position, None, k as u32);
        }
    }
    let (mut sites, mut found) = (Vec::new(), Vec::new());
    let threshold = ordered(rule.threshold);
    while let Some(Reverse((key, which))) = queue.pop() {
        if key >= threshold || sites.len() == rule.limit {
            break;
        }
        let Candidate { resistance, parent, start } = candidates[which as usize];
        let position = taken.points()[which as usize];
        let step = sites.len() as u32;
        sites.push(Site { position, resistance, parent, start });
        found.clear();
        propagation.candidates(position, starts[start as usize].upstream, &mut found);
        for &p in &found {
            if inside(p) && taken.points().len() < CAPACITY && !taken.any_within(p, rule.spacing) {
                enter(&mut taken, &mut queue, &mut candidates, p, Some(step), start);
            }
        }
    }
    sites
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use terrain_model::noise::hash::{self, Keys};

    const SIDE: i32 = 24;

    /// Steps to the six neighbours on the integers.
    const STEPS: [[i32; 3]; 6] = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];

    struct Cubic;

    impl Propagation for Cubic {
        fn candidates(&self, p: DVec3, _: bool, found: &mut Vec<DVec3>) {
            found.extend(STEPS.map(|s| p + DVec3::from_array(s.map(f64::from))));
        }
    }

    fn strength([x, y, z]: [i32; 3]) -> f64 {
        f64::from(Keys::new(77).point3(x as u32, y as u32, z as u32)) / 4_294_967_296.0
    }

    fn holds(p: [i32; 3]) -> bool {
        p.iter().all(|x| (0..SIDE).contains(x))
    }

    fn whole(p: DVec3) -> [i32; 3] {
        p.to_array().map(|x| x as i32)
    }

    /// The textbook: the weakest site of the cluster's whole perimeter is invaded, found by looking at all of it.
    fn textbook(starts: &[[i32; 3]], count: usize, better: impl Fn(f64, f64) -> bool) -> Vec<[i32; 3]> {
        let mut perimeter: BTreeSet<[i32; 3]> = starts.iter().copied().collect();
        let mut cluster: BTreeSet<[i32; 3]> = BTreeSet::new();
        let mut order = Vec::new();
        while order.len() < count
            && let Some(&best) = perimeter.iter().reduce(|a, b| if better(strength(*b), strength(*a)) { b } else { a })
        {
            perimeter.remove(&best);
            cluster.insert(best);
            order.push(best);
            for s in STEPS {
                let next: [i32; 3] = std::array::from_fn(|k| best[k] + s[k]);
                if holds(next) && !cluster.contains(&next) {
                    perimeter.insert(next);
                }
            }
        }
        order
    }

    fn rule(limit: usize) -> Rule {
        Rule { spacing: 0.99, perturbation: 0.0, threshold: f64::INFINITY, limit, seed: 1 }
    }

    fn on_lattice(starts: &[[i32; 3]], rule: &Rule) -> Vec<Site> {
        let starts: Vec<Start> =
            starts.iter().map(|s| Start { position: DVec3::from_array(s.map(f64::from)), upstream: false }).collect();
        percolate(&starts, rule, |p| strength(whole(p)), |p| holds(whole(p)), &Cubic)
    }

    #[test]
    fn on_a_lattice_it_is_the_textbook_s_invasion_in_the_same_order() {
        for starts in [&[[12, 12, 12]][..], &[[0, 0, 23], [23, 5, 23], [11, 11, 0]]] {
            let order = |rule: &Rule| -> Vec<[i32; 3]> {
                on_lattice(starts, rule).iter().map(|site| whole(site.position)).collect()
            };
            let book = textbook(starts, 1000, |a, b| a < b);
            assert_eq!(order(&rule(1000)), book);
            // Controls: the queue ordered as printed, and a perturbed one.
            assert_ne!(textbook(starts, 1000, |a, b| a > b), book);
            assert_ne!(order(&Rule { perturbation: 0.1, ..rule(1000) }), book);
        }
    }

    #[test]
    fn every_site_was_found_by_an_earlier_neighbour_of_the_same_start() {
        let sites = on_lattice(&[[0, 0, 23], [23, 5, 23]], &rule(usize::MAX));
        assert_eq!(sites.len(), (SIDE * SIDE * SIDE) as usize);
        assert_eq!(sites.iter().filter(|site| site.parent.is_none()).count(), 2);
        for (k, site) in sites.iter().enumerate() {
            let Some(parent) = site.parent else { continue };
            let parent = &sites[parent as usize];
            assert!(parent.position.distance(site.position) == 1.0 && parent.start == site.start);
            assert!(site.parent.is_some_and(|p| (p as usize) < k));
        }
    }

    #[test]
    fn a_threshold_stops_it_before_the_first_stronger_site_and_an_empty_queue_ends_it() {
        let weak = (0..SIDE).map(|x| [x, 12, 12]).find(|p| strength(*p) < 0.1);
        let start = [weak.expect("one of 24 is below 0.1")];
        let all = on_lattice(&start, &rule(usize::MAX));
        assert_eq!(all.len(), (SIDE * SIDE * SIDE) as usize);
        let rule = Rule { threshold: 0.4, ..rule(usize::MAX) };
        let some = on_lattice(&start, &rule);
        let first = all.iter().position(|site| site.resistance >= 0.4);
        assert_eq!(first, Some(some.len()));
        assert!(some.len() > 10 && all[..some.len()] == some[..]);
    }

    #[test]
    fn keys_have_the_order_of_numbers() {
        let mut last = ordered(f64::NEG_INFINITY);
        for x in [-2.0, -0.5, -1e-300, 0.0, 1e-300, 0.3, 1.0, f64::INFINITY] {
            assert!(ordered(x) > last);
            last = ordered(x);
        }
        assert_eq!(ordered(-0.0), ordered(0.0));
        let random = |k: u32| f64::from(hash::mix(3, k)) - 2e9;
        assert!((0..1000).all(|k| (ordered(random(k)) < ordered(random(k + 1))) == (random(k) < random(k + 1))));
    }
}
