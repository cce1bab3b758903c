// Elevation and weight at points of one tile.

// Metres from the tile's origin.
@group(0) @binding(4) var<storage, read> points: array<vec2<f32>>;
@group(0) @binding(5) var<storage, read_write> results: array<vec2<f32>>;

@compute @workgroup_size(64)
fn program(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&points) {
        let answer = run(0u, arrayLength(&code), points[id.x]);
        // A weight below 0 says that the answer is void. No program has fewer than two words.
        results[id.x] = select(vec2<f32>(-1.0), answer, whole(min(arrayLength(&code), 2u)));
    }
}
