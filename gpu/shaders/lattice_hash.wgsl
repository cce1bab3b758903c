// The hashes of plane and space lattice points, as terrain_model::noise::hash computes them. Twin: src/lattice_hash.rs.
// `hash.wgsl` stands before it.

// x, y, z as two's complement words, and the seed of the lattice.
@group(0) @binding(0) var<storage, read> points: array<vec4<u32>>;
// The hash of (x, y) and the hash of (x, y, z).
@group(0) @binding(1) var<storage, read_write> hashes: array<vec2<u32>>;

fn mix_seed(seed: u32, word: u32) -> u32 {
    return finish(finish(seed ^ 0x5bd1e995u) + word * GOLDEN);
}

fn keys(seed: u32) -> vec3<u32> {
    return vec3<u32>(mix_seed(seed, 1u), mix_seed(seed, 2u), mix_seed(seed, 3u));
}

@compute @workgroup_size(64)
fn lattice_hash(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.y * groups.x * 64u + id.x;
    if i >= arrayLength(&points) {
        return;
    }
    let p = points[i];
    let key = keys(p.w);
    hashes[i] = vec2<u32>(hashed2(p.xy + key.xy), hashed3(p.xyz + key));
}
