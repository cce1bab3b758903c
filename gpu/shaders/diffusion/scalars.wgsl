// Adds the parts of two inner products and makes the scalars of BiCGStab of them, on the device, so that no iteration waits for the
// host. Twin: terrain_diffusion::solver::krylov::bicgstab.

struct Scalars {
    rho: f32,
    alpha: f32,
    omega: f32,
    beta: f32,
    // Iterations begun.
    begun: u32,
}

// Which step of an iteration: 0 before its direction, 1 after the first product, 2 after the second.
@group(0) @binding(0) var<uniform> stage: vec4<u32>;
@group(0) @binding(1) var<storage, read> parts: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read_write> scalars: Scalars;
// The square of the residual before each iteration.
@group(0) @binding(3) var<storage, read_write> history: array<f32>;

const GROUP: u32 = 256u;
var<workgroup> sums: array<vec2<f32>, GROUP>;

// a / b; 0 where b is 0, so that a field that has arrived stands still.
fn ratio(a: f32, b: f32) -> f32 {
    return select(0.0, a / b, b != 0.0);
}

@compute @workgroup_size(GROUP)
fn advance_scalars(@builtin(local_invocation_index) local: u32) {
    var sum = vec2<f32>(0.0);
    for (var k = local; k < arrayLength(&parts); k += GROUP) {
        sum += parts[k];
    }
    sums[local] = sum;
    for (var half = GROUP / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if local < half {
            sums[local] += sums[local + half];
        }
    }
    if local > 0u {
        return;
    }
    let total = sums[0];
    switch stage.x {
        case 0u: {
            // shadow·r and r·r. The first direction is the residual.
            let first = scalars.begun == 0u;
            let turn = ratio(total.x, scalars.rho) * ratio(scalars.alpha, scalars.omega);
            scalars.beta = select(turn, 0.0, first);
            scalars.rho = total.x;
            history[min(scalars.begun, arrayLength(&history) - 1u)] = total.y;
            scalars.begun += 1u;
        }
        case 1u: {
            // shadow·v.
            scalars.alpha = ratio(scalars.rho, total.x);
        }
        default: {
            // r·t and t·t.
            scalars.omega = ratio(total.x, total.y);
        }
    }
}
