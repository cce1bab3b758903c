// The hashes of plane and space lattice points, as terrain_model::noise::hash computes them. Twin: src/lattice_hash.rs.

// x, y, z as two's complement words, and the seed of the lattice.
@group(0) @binding(0) var<storage, read> points: array<vec4<u32>>;
// The hash of (x, y) and the hash of (x, y, z).
@group(0) @binding(1) var<storage, read_write> hashes: array<vec2<u32>>;

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

fn mix_seed(seed: u32, word: u32) -> u32 {
    return finish(finish(seed ^ 0x5bd1e995u) + word * GOLDEN);
}

fn keys(seed: u32) -> vec3<u32> {
    return vec3<u32>(mix_seed(seed, 1u), mix_seed(seed, 2u), mix_seed(seed, 3u));
}

// What is left to finish for a plane point.
fn pair(key: vec3<u32>, x: u32, y: u32) -> u32 {
    let column = (x + key.x) * GOLDEN;
    return column ^ (column >> 13u) ^ ((y + key.y) * SECOND);
}

fn point2(key: vec3<u32>, x: u32, y: u32) -> u32 {
    return finish(pair(key, x, y));
}

fn point3(key: vec3<u32>, x: u32, y: u32, z: u32) -> u32 {
    let h = pair(key, x, y) * THIRD;
    return finish(h ^ (h >> 15u) ^ ((z + key.z) * SECOND));
}

@compute @workgroup_size(64)
fn lattice_hash(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.y * groups.x * 64u + id.x;
    if i >= arrayLength(&points) {
        return;
    }
    let p = points[i];
    let key = keys(p.w);
    hashes[i] = vec2<u32>(point2(key, p.x, p.y), point3(key, p.x, p.y, p.z));
}
