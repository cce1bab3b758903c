//! temporary
use terrain_model::certify::{climb, noise::*};
use terrain_model::interval::Interval;
fn main() {
    let u = Interval::UNIT;
    let h = Interval::new(0.0, 0.5);
    let s = Interval::symmetric(1.0);
    let [x, y, z] = simplex_root();
    println!("g2r {:?}", climb(&Range(Gradient2), [u; 2], 1, 200));
    println!("g2s {:?}", climb(&Slope { noise: Gradient2, face: 0, ordered: false }, [h, u, u], 1, 400));
    println!("g3r {:?}", climb(&Range(Gradient3), [h; 3], 1, 200));
    println!("g3s {:?}", climb(&Slope { noise: Gradient3, face: 0, ordered: true }, [h, u, u, u, u], 1, 1000));
    println!("s3r {:?}", climb(&Range(Simplex3), [x, y, z], 1, 1000));
    for f in 0..2 {
        println!("s3s {:?}", climb(&Slope { noise: Simplex3, face: f, ordered: false }, [x, y, z, s, s], 1, 4000));
    }
}
