// result = A·x. An operator stands before it. Twin: the products of terrain_diffusion::solver::krylov::bicgstab.

@group(0) @binding(4) var<storage, read> x: array<f32>;
@group(0) @binding(5) var<storage, read_write> result: array<f32>;

@compute @workgroup_size(32, 8)
fn multiply(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= size.width || id.y >= size.height {
        return;
    }
    result[id.y * size.width + id.x] = product(id.x, id.y);
}
