// rest = b − A·x. An operator stands before it. Twin: terrain_diffusion::solver::cycle, between relaxation and restriction.

@group(0) @binding(4) var<storage, read_write> x: array<f32>;
@group(0) @binding(5) var<storage, read> b: array<f32>;
@group(0) @binding(6) var<storage, read_write> rest: array<f32>;

@compute @workgroup_size(32, 8)
fn residual(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= size.width || id.y >= size.height {
        return;
    }
    let k = id.y * size.width + id.x;
    rest[k] = b[k] - product(id.x, id.y);
}
