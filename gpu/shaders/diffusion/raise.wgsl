// Bilinear values of the fields of a raster at the nodes of a finer one with the same corners. Twin: `raise` of
// terrain_diffusion::solver::cascade.

struct Sizes {
    from_width: u32,
    from_height: u32,
    width: u32,
    height: u32,
    // Spacing of the finer raster over that of the coarser one.
    ratio: f32,
}

@group(0) @binding(0) var<uniform> sizes: Sizes;
@group(0) @binding(1) var<storage, read> coarse: array<f32>;
@group(0) @binding(2) var<storage, read_write> fine: array<f32>;

@compute @workgroup_size(32, 8)
fn raise(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= sizes.width || id.y >= sizes.height {
        return;
    }
    let last = vec2<u32>(sizes.from_width, sizes.from_height) - 1u;
    let at = min(vec2<f32>(id.xy) * sizes.ratio, vec2<f32>(last));
    let cell = min(vec2<u32>(at), last - 1u);
    let t = at - vec2<f32>(cell);
    let k = id.z * sizes.from_width * sizes.from_height + cell.y * sizes.from_width + cell.x;
    let south = coarse[k] * (1.0 - t.x) + coarse[k + 1u] * t.x;
    let north = coarse[k + sizes.from_width] * (1.0 - t.x) + coarse[k + sizes.from_width + 1u] * t.x;
    fine[(id.z * sizes.height + id.y) * sizes.width + id.x] = south * (1.0 - t.y) + north * t.y;
}
