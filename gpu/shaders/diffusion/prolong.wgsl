// fine += P·coarse, P the interpolation of terrain_diffusion::solver::hierarchy. Twin: `add_row` of
// terrain_diffusion::solver::interpolation.

struct Sizes {
    // Of the fine raster.
    width: u32,
    height: u32,
    coarse_width: u32,
    coarse_height: u32,
}

@group(0) @binding(0) var<uniform> sizes: Sizes;
@group(0) @binding(1) var<storage, read> lines: array<f32>;
@group(0) @binding(2) var<storage, read> middles: array<f32>;
@group(0) @binding(3) var<storage, read_write> fine: array<f32>;
@group(0) @binding(4) var<storage, read> coarse: array<f32>;

// 0 past the ends of a row or a column.
fn value(i: u32, j: u32) -> f32 {
    let inside = i < sizes.coarse_width && j < sizes.coarse_height;
    return select(0.0, coarse[min(j, sizes.coarse_height - 1u) * sizes.coarse_width + min(i, sizes.coarse_width - 1u)], inside);
}

@compute @workgroup_size(32, 8)
fn prolong(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= sizes.width || id.y >= sizes.height {
        return;
    }
    let i = id.x / 2u;
    let j = id.y / 2u;
    let n = sizes.coarse_width;
    let at = 4u * j * n + i;
    let k = id.y * sizes.width + id.x;
    if (id.y & 1u) == 0u {
        if (id.x & 1u) == 0u {
            fine[k] = fine[k] + value(i, j);
        } else {
            fine[k] = fine[k] + (lines[at] * value(i, j) + lines[at + n] * value(i + 1u, j));
        }
    } else if (id.x & 1u) == 0u {
        fine[k] = fine[k] + lines[at + 2u * n] * value(i, j) + lines[at + 3u * n] * value(i, j + 1u);
    } else {
        fine[k] = fine[k] + (middles[at] * value(i, j) + middles[at + n] * value(i + 1u, j))
            + (middles[at + 2u * n] * value(i, j + 1u) + middles[at + 3u * n] * value(i + 1u, j + 1u));
    }
}
