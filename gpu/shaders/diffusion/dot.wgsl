// Parts of a·b and of b·b: each workgroup adds every (number of workgroups)-th stretch of 256 products. Sums are of the size of the
// workgroup and not of the device, so that the same adapter gives the same bits. Twin: terrain_diffusion::plane::Plane::dot.

@group(0) @binding(0) var<storage, read> a: array<f32>;
@group(0) @binding(1) var<storage, read> b: array<f32>;
// For each workgroup, its part of a·b and of b·b.
@group(0) @binding(2) var<storage, read_write> parts: array<vec2<f32>>;

const GROUP: u32 = 256u;
var<workgroup> sums: array<vec2<f32>, GROUP>;

@compute @workgroup_size(GROUP)
fn dot_parts(
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    var sum = vec2<f32>(0.0);
    for (var k = group.x * GROUP + local; k < arrayLength(&b); k += groups.x * GROUP) {
        sum += vec2<f32>(a[k] * b[k], b[k] * b[k]);
    }
    sums[local] = sum;
    for (var half = GROUP / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if local < half {
            sums[local] += sums[local + half];
        }
    }
    if local == 0u {
        parts[group.x] = sums[0];
    }
}
