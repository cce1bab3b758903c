// e += s·z and r −= s·w, s being α in the first half of an iteration of BiCGStab and ω in the second. Twin:
// terrain_diffusion::solver::krylov::bicgstab.

struct Scalars {
    rho: f32,
    alpha: f32,
    omega: f32,
    beta: f32,
    begun: u32,
}

// Which half: 1 or 2.
@group(0) @binding(0) var<uniform> stage: vec4<u32>;
@group(0) @binding(1) var<storage, read> scalars: Scalars;
@group(0) @binding(2) var<storage, read> z: array<f32>;
@group(0) @binding(3) var<storage, read> w: array<f32>;
@group(0) @binding(4) var<storage, read_write> e: array<f32>;
@group(0) @binding(5) var<storage, read_write> r: array<f32>;

const GROUP: u32 = 256u;

@compute @workgroup_size(GROUP)
fn advance(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let s = select(scalars.omega, scalars.alpha, stage.x == 1u);
    for (var k = id.x; k < arrayLength(&e); k += groups.x * GROUP) {
        e[k] = e[k] + s * z[k];
        r[k] = r[k] - s * w[k];
    }
}
