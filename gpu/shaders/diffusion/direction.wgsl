// p = r + β·(p − ω·v), the direction of an iteration of BiCGStab. Twin: terrain_diffusion::solver::krylov::bicgstab.

struct Scalars {
    rho: f32,
    alpha: f32,
    omega: f32,
    beta: f32,
    begun: u32,
}

@group(0) @binding(0) var<storage, read> scalars: Scalars;
@group(0) @binding(1) var<storage, read> r: array<f32>;
@group(0) @binding(2) var<storage, read> v: array<f32>;
@group(0) @binding(3) var<storage, read_write> p: array<f32>;

const GROUP: u32 = 256u;

@compute @workgroup_size(GROUP)
fn direction(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    for (var k = id.x; k < arrayLength(&p); k += groups.x * GROUP) {
        p[k] = r[k] + scalars.beta * (p[k] - scalars.omega * v[k]);
    }
}
