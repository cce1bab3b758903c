// The first colour of a relaxation from x = 0: nodes whose column and row are even. An operator stands before it.
// Twin: the first step of terrain_diffusion::solver::cycle::Cycle::apply.

@group(0) @binding(4) var<storage, read_write> x: array<f32>;
@group(0) @binding(5) var<storage, read> b: array<f32>;

@compute @workgroup_size(32, 8)
fn start(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= size.width || id.y >= size.height {
        return;
    }
    let k = id.y * size.width + id.x;
    x[k] = select(0.0, b[k] * inverse(id.x, id.y), ((id.x | id.y) & 1u) == 0u);
}
