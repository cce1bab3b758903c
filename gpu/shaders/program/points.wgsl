// Elevation and weight at points of one tile.

// Metres from the tile's origin.
@group(0) @binding(4) var<storage, read> points: array<vec2<f32>>;
@group(0) @binding(5) var<storage, read_write> results: array<vec2<f32>>;

@compute @workgroup_size(64)
fn program(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&points) {
        results[id.x] = run(0u, arrayLength(&code), points[id.x]);
    }
}
