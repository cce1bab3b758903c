// x = A⁻¹·b on the coarsest level, A⁻¹ row by row: one invocation a row. Twin: `Factors::solve` of terrain_diffusion::solver::dense.

@group(0) @binding(0) var<storage, read> inverse: array<f32>;
@group(0) @binding(1) var<storage, read> b: array<f32>;
@group(0) @binding(2) var<storage, read_write> x: array<f32>;

@compute @workgroup_size(64)
fn coarsest(@builtin(global_invocation_id) id: vec3<u32>) {
    let n = arrayLength(&b);
    if id.x >= n {
        return;
    }
    var total = 0.0;
    for (var k = 0u; k < n; k++) {
        total += inverse[id.x * n + k] * b[k];
    }
    x[id.x] = total;
}
