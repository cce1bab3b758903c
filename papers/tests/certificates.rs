//! Every proof holds and its control fails. Slow ones are spread over two tests, so that each keeps to its budget of time.

use rayon::prelude::*;
use std::time::Instant;
use terrain_papers::certificates::{Certificate, Form, Kind, all};

/// Runs the proofs that `chosen` picks, two at a time, and returns what went wrong.
fn failures(chosen: impl Fn(&Certificate) -> bool + Sync) -> Vec<String> {
    let proofs: Vec<_> = all().filter(|certificate| chosen(certificate)).collect();
    proofs
        .par_iter()
        .flat_map_iter(|certificate| {
            let Kind::Proof(prove) = certificate.kind else { return Vec::new() };
            let start = Instant::now();
            let (stated, perturbed) = (prove(Form::Stated), prove(Form::Perturbed));
            println!(
                "{:6.2} s  {}: {} | {}",
                start.elapsed().as_secs_f64(),
                certificate.id,
                stated.line(),
                perturbed.line()
            );
            let mut failed = Vec::new();
            if !stated.proved() {
                failed.push(format!("{}: {}", certificate.id, stated.line()));
            }
            if perturbed.proved() {
                failed.push(format!("{}, control: {}", certificate.id, perturbed.line()));
            }
            failed
        })
        .collect()
}

#[test]
fn proofs_hold_and_their_controls_fail() {
    let failed = failures(|certificate| !certificate.id.starts_with("noise-"));
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn proofs_of_noise_hold_and_their_controls_fail() {
    let failed = failures(|certificate| certificate.id.starts_with("noise-"));
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn ids_are_unique() {
    let mut ids: Vec<&str> = all().map(|certificate| certificate.id).collect();
    ids.sort_unstable();
    assert!(ids.windows(2).all(|pair| pair[0] != pair[1]), "{ids:?}");
}
