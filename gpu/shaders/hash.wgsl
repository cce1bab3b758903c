// The hashes of plane and space lattice points to which the keys of their lattice were added, as terrain_model::noise::hash computes
// them. It stands before every kernel that hashes.

const GOLDEN: u32 = 0x9e3779b1u;
const SECOND: u32 = 0x85ebca6bu;
const THIRD: u32 = 0xc2b2ae35u;

fn finish(word: u32) -> u32 {
    var h = word;
    h ^= h >> 16u;
    h *= 0x7feb352du;
    h ^= h >> 15u;
    h *= 0x846ca68bu;
    return h ^ (h >> 16u);
}

// What is left to finish for a plane point.
fn joined(x: u32, y: u32) -> u32 {
    let column = x * GOLDEN;
    return column ^ (column >> 13u) ^ (y * SECOND);
}

fn hashed2(point: vec2<u32>) -> u32 {
    return finish(joined(point.x, point.y));
}

fn hashed3(point: vec3<u32>) -> u32 {
    let h = joined(point.x, point.y) * THIRD;
    return finish(h ^ (h >> 15u) ^ (point.z * SECOND));
}
