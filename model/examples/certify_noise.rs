//! Certifies ranges and slopes: `certify_noise <name> <target> [budget]`.

use std::time::Instant;
use terrain_model::certify::noise;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let target: f64 = arguments[1].parse().expect("a target");
    let budget: u64 = arguments.get(2).map_or(1_000_000, |b| b.parse().expect("a budget"));
    let start = Instant::now();
    match arguments[0].as_str() {
        "gradient2-range" => println!("{:?}", noise::gradient2_range(target, budget)),
        "gradient2-slope" => println!("{:?}", noise::gradient2_slope(target, budget)),
        "gradient3-range" => println!("{:?}", noise::gradient3_range(target, budget)),
        "gradient3-slope" => println!("{:?}", noise::gradient3_slope(target, budget)),
        "simplex3-range" => println!("{:?}", noise::simplex3_range(target, budget)),
        "simplex3-slope" => println!("{:?}", noise::simplex3_slope(target, budget)),
        other => eprintln!("unknown certificate {other}"),
    }
    println!("{:.2} s", start.elapsed().as_secs_f64());
}
