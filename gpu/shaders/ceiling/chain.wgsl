// Chains of multiplications and additions, four beside each other so that none waits for the last: what the device computes when it moves
// nothing. x ← a·x + b has the fixed point 1 with a = b = ½, which shows that the chain was run.

@group(0) @binding(0) var<storage, read> start: array<f32>;
@group(0) @binding(1) var<storage, read_write> ends: array<f32>;

const TURNS: u32 = 256u;

@compute @workgroup_size(256)
fn chain(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&ends) {
        return;
    }
    let a = start[0];
    let b = start[1];
    var x = vec4<f32>(start[2], start[3], start[4], start[5]) + f32(id.x & 255u);
    var y = x + 1.0;
    for (var turn = 0u; turn < TURNS; turn++) {
        x = fma(x, vec4<f32>(a), vec4<f32>(b));
        y = fma(y, vec4<f32>(a), vec4<f32>(b));
        x = fma(x, vec4<f32>(a), vec4<f32>(b));
        y = fma(y, vec4<f32>(a), vec4<f32>(b));
    }
    ends[id.x] = (x.x + x.y + x.z + x.w + y.x + y.y + y.z + y.w) / 8.0;
}
