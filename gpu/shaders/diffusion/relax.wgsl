// Gauss–Seidel for A·x = b over one of four colours: nodes whose column has the parity `first` and whose row has the parity `second`. No two
// of them are neighbours. An operator stands before it. Twin: the relaxation of terrain_diffusion::solver::cycle.

@group(0) @binding(4) var<storage, read_write> x: array<f32>;
@group(0) @binding(5) var<storage, read> b: array<f32>;

@compute @workgroup_size(32, 8)
fn relax(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = 2u * id.x + size.first;
    let j = 2u * id.y + size.second;
    if i >= size.width || j >= size.height {
        return;
    }
    let k = j * size.width + i;
    x[k] = x[k] + (b[k] - product(i, j)) * inverse(i, j);
}
