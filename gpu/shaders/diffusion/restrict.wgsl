// coarse = Pᵀ·fine, P the interpolation of terrain_diffusion::solver::hierarchy. Twin: `restrict` of
// terrain_diffusion::solver::interpolation, in its order of sums.

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
@group(0) @binding(3) var<storage, read> fine: array<f32>;
@group(0) @binding(4) var<storage, read_write> coarse: array<f32>;

// 0 past the ends of a row.
fn value(i: u32, j: u32) -> f32 {
    let inside = i < sizes.width;
    return select(0.0, fine[j * sizes.width + min(i, sizes.width - 1u)], inside);
}

// Σ of the weights at `a` and, of the node before, at `b`, times the odd columns beside coarse column i of fine row j.
fn beside(i: u32, j: u32, here: f32, before: f32) -> f32 {
    let sum = here * value(2u * i + 1u, j);
    if i == 0u {
        return sum;
    }
    return sum + before * value(2u * i - 1u, j);
}

@compute @workgroup_size(32, 8)
fn restricted(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= sizes.coarse_width || id.y >= sizes.coarse_height {
        return;
    }
    let i = id.x;
    let n = sizes.coarse_width;
    let last = max(i, 1u) - 1u;
    var j = id.y;
    var total = value(2u * i, 2u * j) + beside(i, 2u * j, lines[4u * j * n + i], lines[(4u * j + 1u) * n + last]);
    if 2u * j + 1u < sizes.height {
        total += lines[(4u * j + 2u) * n + i] * value(2u * i, 2u * j + 1u);
        total += beside(i, 2u * j + 1u, middles[4u * j * n + i], middles[(4u * j + 1u) * n + last]);
    }
    if j > 0u {
        j -= 1u;
        total += lines[(4u * j + 3u) * n + i] * value(2u * i, 2u * j + 1u);
        total += beside(i, 2u * j + 1u, middles[(4u * j + 2u) * n + i], middles[(4u * j + 3u) * n + last]);
    }
    coarse[id.y * n + i] = total;
}
