//! Karsts keep their spacing, end by packing, follow weak strata and are open from end to end.

use super::*;
use crate::geology::{Geology, Node};
use crate::implicit::index::Index;

fn domain() -> Box3 {
    Box3::new(DVec3::new(-120.0, -120.0, -90.0), DVec3::new(120.0, 120.0, 0.0))
}

/// Fig. 14: horizontal strata with some turbulence.
fn strata(seed: u32) -> Geology {
    let layers = Node::Strata { wavelength: 30.0, octaves: 3, seed: 1 };
    let rough = Node::Turbulence { wavelength: 20.0, octaves: 2, seed: 2 };
    Geology::new(seed, Node::Blend(vec![(3.0, layers), (1.0, rough)])).unwrap()
}

fn three_sinks() -> Karst {
    let sinks = [(-60.0, 10.0), (5.0, -20.0), (70.0, 30.0)].map(|(x, y)| DVec3::new(x, y, -0.5));
    Karst { sinks: sinks.to_vec(), ..Karst::default() }
}

fn grow(karst: &Karst, resistance: impl Fn(DVec3) -> f64) -> Vec<Site> {
    karst.grow(&domain(), |_| true, &[], resistance).unwrap()
}

fn nearest_pair(sites: &[Site]) -> f64 {
    let mut sorted: Vec<DVec3> = sites.iter().map(|site| site.position).collect();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x));
    let mut least = f64::INFINITY;
    for (k, p) in sorted.iter().enumerate() {
        for q in &sorted[k + 1..] {
            if q.x - p.x >= least {
                break;
            }
            least = least.min(p.distance(*q));
        }
    }
    least
}

/// Claims P17: with spheres tested against the queue alone, sites that were invaded would be filled again for ever.
#[test]
fn a_bounded_karst_ends_by_packing_and_its_sites_keep_their_spacing() {
    let karst = Karst { threshold: 2.0, sites: 10_000_000, spacing: 6.0, ..three_sinks() };
    let sites = grow(&karst, |_| 0.5);
    let most = karst.most_sites(&domain());
    assert!((sites.len() as f64) < most, "{} of {most}", sites.len());
    // Control: the bound is near enough to be broken by spheres of half the spacing.
    assert!(sites.len() as f64 > most / 8.0, "{} of {most}", sites.len());
    let least = nearest_pair(&sites);
    assert!(least >= karst.spacing, "{least}");
    let mut control = sites.clone();
    control[7].position = control[900].position + DVec3::X * 0.999 * karst.spacing;
    assert!(nearest_pair(&control) < karst.spacing);
    assert!(sites.iter().all(|site| domain().contains(site.position)));
}

#[test]
fn states_are_the_beginnings_of_one_another_and_seeds_tell_networks_apart() {
    let rock = strata(4);
    let whole = grow(&Karst { sites: 176, ..three_sinks() }, |p| rock.value(p));
    assert_eq!(whole.len(), 176);
    for s in [48, 97, 176] {
        let karst = Karst { sites: s, ..three_sinks() };
        assert_eq!(grow(&karst, |p| rock.value(p)), whole[..s as usize]);
        assert!(!karst.primitives(&whole[..s as usize]).is_empty());
    }
    let other = Karst { sites: 176, seed: 1, ..three_sinks() };
    assert_ne!(grow(&other, |p| rock.value(p)), whole);
}

#[test]
fn what_grows_elsewhere_does_not_change_a_network() {
    let rock = strata(4);
    let sinks = vec![DVec3::new(-90.0, 0.0, -0.5), DVec3::new(90.0, 0.0, -0.5)];
    // Two blocks apart, so that neither takes room from the other.
    let inside = |p: DVec3| p.x.abs() > 40.0;
    let of = |sinks: &[DVec3], seed: u32| -> Vec<DVec3> {
        let karst = Karst { sinks: sinks.to_vec(), threshold: 0.6, sites: 1_000_000, seed, ..Karst::default() };
        let sites = karst.grow(&domain(), inside, &[], |p| rock.value(p)).unwrap();
        sites.iter().filter(|site| site.position.x < 0.0).map(|site| site.position).collect()
    };
    let alone = of(&sinks[..1], 3);
    assert!(alone.len() > 100, "{}", alone.len());
    assert_eq!(of(&sinks, 3), alone);
    assert_ne!(of(&sinks, 4), alone);
}

/// How far below the rock around them the mean resistance of sites is, in deviations of that rock, for 16 rocks; as mean
/// and standard error of the mean. Sites of one network are not independent, but networks in different rocks are. What the
/// percolation feels is the rock whose seed is `shift` higher.
fn below_the_rock(shift: u32) -> [f64; 2] {
    const ROCKS: u32 = 16;
    let moments = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (values.len() - 1) as f64;
        [mean, variance.sqrt()]
    };
    let of = |seed: u32| {
        let (rock, felt) = (strata(seed), strata(seed + shift));
        let sites = grow(&Karst { sites: 1000, threshold: 2.0, seed, ..three_sinks() }, |p| felt.value(p));
        let reach = sites.iter().fold(Box3::EMPTY, |all, site| all.hull(&Box3::new(site.position, site.position)));
        let at = |k: u32| {
            let random = Random::at(seed, DVec3::splat(f64::from(k)));
            reach.low + (reach.high - reach.low) * DVec3::new(random.unit(0), random.unit(1), random.unit(2))
        };
        let around: Vec<f64> = (0..3000).map(|k| rock.value(at(k))).collect();
        let own: Vec<f64> = sites.iter().map(|site| rock.value(site.position)).collect();
        let ([rock, deviation], [own, _]) = (moments(&around), moments(&own));
        (rock - own) / deviation
    };
    let [mean, deviation] = moments(&(0..ROCKS).map(of).collect::<Vec<f64>>());
    [mean, deviation / f64::from(ROCKS).sqrt()]
}

#[test]
fn a_karst_follows_the_weak_strata_and_not_those_of_another_rock() {
    let [led, error] = below_the_rock(0);
    let [blind, doubt] = below_the_rock(1000);
    assert!(led > 0.5 && led > 5.0 * error, "{led} ± {error}");
    // Four standard errors, the sites' own share of the space around them aside.
    assert!(blind.abs() < 4.0 * doubt && blind.abs() < 0.5 * led, "{blind} ± {doubt}");
}

#[test]
fn water_flows_down_from_sinks_and_is_found_upward_from_resurgences_until_they_meet() {
    let resurgences = vec![DVec3::new(0.0, 0.0, -80.0)];
    let sinks = vec![DVec3::new(5.0, -3.0, -1.0)];
    let karst = Karst { resurgences, sinks, threshold: 2.0, sites: 1_000_000, spacing: 5.0, ..Karst::default() };
    let sites = grow(&karst, |_| 0.3);
    for site in &sites {
        let Some(parent) = site.parent else { continue };
        let rise = site.position.z - sites[parent as usize].position.z;
        assert!(if site.start == 1 { rise >= 0.0 } else { rise <= 0.0 }, "{rise} of {}", site.start);
    }
    let of = |start: u32| sites.iter().filter(move |site| site.start == start);
    let gap = of(0).flat_map(|a| of(1).map(|b| a.position.distance(b.position))).fold(f64::INFINITY, f64::min);
    assert!(of(1).count() > 20 && gap < 1.2 * karst.spacing, "{gap}");
}

/// The field along every link of a network in solid rock of 2T.
fn fullest_link(karst: &Karst, sites: &[Site]) -> f64 {
    let index = Index::new(karst.primitives(sites)).unwrap();
    let carved = |site: &Site| karst.sphere(site).is_some();
    let mut fullest = f64::NEG_INFINITY;
    for site in sites.iter().filter(|site| carved(site)) {
        let Some(parent) = site.parent.map(|parent| &sites[parent as usize]).filter(|parent| carved(parent)) else {
            continue;
        };
        for k in 0..=8 {
            fullest = fullest.max(1.0 + index.value(parent.position.lerp(site.position, f64::from(k) / 8.0)));
        }
    }
    fullest
}

#[test]
fn caves_are_open_from_site_to_site() {
    let rock = strata(4);
    let karst = Karst { sites: 1500, ..three_sinks() };
    let sites = grow(&karst, |p| rock.value(p));
    let fullest = fullest_link(&karst, &sites);
    assert!(fullest < crate::field::THRESHOLD, "{fullest}");
    // Control: spheres of half the size do not meet.
    let thin = Karst { radius: karst.radius.map(|r| 0.4 * r), ..karst.clone() };
    assert!(fullest_link(&thin, &sites) > crate::field::THRESHOLD);
}

#[test]
fn spheres_carve_soluble_rock_alone_and_softer_rock_more() {
    let karst = Karst::default();
    let at = |resistance| karst.sphere(&Site { position: DVec3::ONE, resistance, parent: None, start: 0 });
    let (soft, hard) = (at(0.1).unwrap(), at(0.6).unwrap());
    assert!(soft.radius > hard.radius && soft.energy < hard.energy && hard.energy < 0.0);
    assert_eq!(at(0.7), None);
    assert_eq!(
        Karst { stress: 0.0, ..karst.clone() }.sphere(&Site {
            position: DVec3::ONE,
            resistance: 0.1,
            parent: None,
            start: 0
        }),
        None
    );
}

#[test]
fn text_has_defaults_and_what_makes_no_sense_is_refused_by_name() {
    let read: Karst = ron::from_str("(spacing: 2, sinks: [(1, 2, -3)])").unwrap();
    assert_eq!(read, Karst { spacing: 2.0, sinks: vec![DVec3::new(1.0, 2.0, -3.0)], ..Karst::default() });
    assert!(ron::from_str::<Karst>("(spacng: 2)").is_err());
    assert_eq!(read.check(), Ok(()));
    for (bad, field) in [
        (Karst { spacing: 0.0, ..read.clone() }, "spacing"),
        (Karst { stride: 1.0, ..read.clone() }, "stride"),
        (Karst { directions: 0, ..read.clone() }, "directions"),
        (Karst { perturbation: f64::NAN, ..read.clone() }, "perturbation"),
        (Karst { threshold: -1.0, ..read.clone() }, "threshold"),
        (Karst { soluble: 1.5, ..read.clone() }, "soluble"),
        (Karst { stress: 250.0, ..read.clone() }, "stress"),
        (Karst { on_hardest: -0.1, ..read.clone() }, "on_hardest"),
        (Karst { radius: [1.0, 0.0], ..read.clone() }, "radius"),
        (Karst { strength: 0.0, ..read.clone() }, "strength"),
        (Karst { sites: 0, ..read.clone() }, "sites"),
    ] {
        assert_eq!(bad.check().unwrap_err().field, field);
    }
    let grow = |karst: &Karst, domain: &Box3, pits: &[DVec3]| karst.grow(domain, |_| true, pits, |_| 0.5).map(|_| ());
    let error = grow(&read, &domain(), &[DVec3::ZERO, DVec3::Z]).unwrap_err().to_string();
    assert_eq!(
        error,
        "karst: pit 1 is at [0, 0, 1], expected a point of the domain, [-120, -120, -90] to [120, 120, 0]"
    );
    assert_eq!(grow(&Karst::default(), &domain(), &[]), Err(KarstError::Dry));
    assert!(matches!(grow(&read, &Box3::EMPTY, &[]), Err(KarstError::Domain { .. })));
    assert!(matches!(grow(&read, &Box3::around(DVec3::ZERO, 1e8), &[]), Err(KarstError::Domain { .. })));
}
