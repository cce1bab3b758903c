//! Certifies the ranges and slopes of the noises: `certify_noise <name> <target> [file]`. With a file, the slopes of
//! simplex noise are stored there as splits (one file per face of directions, numbered), or checked if it exists.

use std::path::PathBuf;
use std::time::Instant;
use terrain_model::certify::{noise, tree};

const BUDGET: u64 = 10_000_000;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, target, file @ ..] = &arguments[..] else { return eprintln!("usage: certify_noise <name> <target>") };
    let Ok(target) = target.parse::<f64>() else { return eprintln!("{target} is not a number") };
    let start = Instant::now();
    match (name.as_str(), file) {
        ("gradient2-range", _) => println!("{:?}", noise::gradient2_range(target, BUDGET)),
        ("gradient2-slope", _) => println!("{:?}", noise::gradient2_slope(target, BUDGET)),
        ("gradient3-range", _) => println!("{:?}", noise::gradient3_range(target, BUDGET)),
        ("gradient3-slope", _) => println!("{:?}", noise::gradient3_slope(target, BUDGET)),
        ("simplex3-range", _) => println!("{:?}", noise::simplex3_range(target, BUDGET)),
        ("simplex3-slope", []) => println!("{:?}", noise::simplex3_slope(target, BUDGET)),
        ("simplex3-slope", [file, ..]) => {
            for face in [0, 1] {
                store_or_check(face, target, &PathBuf::from(format!("{file}.{face}")));
            }
        }
        (other, _) => eprintln!("no certificate is called {other}"),
    }
    println!("{:.2} s", start.elapsed().as_secs_f64());
}

fn store_or_check(face: usize, target: f64, path: &PathBuf) {
    let (slope, root) = (noise::simplex3_face(face), noise::simplex3_slope_root());
    if let Ok(stored) = std::fs::read(path) {
        println!("face {face}: {:?} leaves", tree::check(&slope, root, target, &stored, |_| true));
        return;
    }
    let (verdict, file) = tree::record(&slope, root, target, BUDGET);
    println!("face {face}: {verdict:?}, {} bytes", file.len());
    if let Err(error) = std::fs::write(path, file) {
        eprintln!("{}: {error}", path.display());
    }
}
