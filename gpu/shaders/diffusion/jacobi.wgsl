// One Jacobi iteration of the paper's schedule (Hnaidi 2010 §5.2) on the fields of a raster, which stand one after the other: what is
// given stays, a node with a slope takes half the mean of its neighbours and half what the slope implies, the rest becomes the mean.
// Twin: `laplace_step` and `elevation_step` of terrain_diffusion::solver::cascade.

struct Stage {
    width: u32,
    height: u32,
    // Of `kinds`: where it is set in a node's word, the field is given there.
    given: u32,
    // 1 before the first iteration on this raster: what is given stands in `after` already, and not in `before`. 2 if fields follow slopes, 4 if
    // they read them as printed.
    flags: u32,
    spacing: f32,
}

@group(0) @binding(0) var<uniform> stage: Stage;
// Bits: elevation given, noise given, slope given, slope followed.
@group(0) @binding(1) var<storage, read> kinds: array<u32>;
// Rise, and direction east and north, one field after the other.
@group(0) @binding(2) var<storage, read> slopes: array<f32>;
@group(0) @binding(3) var<storage, read> before: array<f32>;
@group(0) @binding(4) var<storage, read_write> after: array<f32>;

const FOLLOWED: u32 = 8u;
const READ: u32 = 2u;
const PRINTED: u32 = 4u;

fn exists(i: u32, j: u32, east: i32, north: i32) -> bool {
    let p = i32(i) + east;
    let q = i32(j) + north;
    return p >= 0 && q >= 0 && p < i32(stage.width) && q < i32(stage.height);
}

// The value beside node (i, j) of the field that starts at `field`; it exists.
fn value(field: u32, i: u32, j: u32, east: i32, north: i32) -> f32 {
    return before[field + u32(i32(j) + north) * stage.width + u32(i32(i) + east)];
}

// The mean of the neighbours that exist.
fn mean(field: u32, i: u32, j: u32) -> f32 {
    var total = 0.0;
    var count = 0.0;
    if j > 0u {
        total += value(field, i, j, 0, -1);
        count += 1.0;
    }
    if i > 0u {
        total += value(field, i, j, -1, 0);
        count += 1.0;
    }
    if i + 1u < stage.width {
        total += value(field, i, j, 1, 0);
        count += 1.0;
    }
    if j + 1u < stage.height {
        total += value(field, i, j, 0, 1);
        count += 1.0;
    }
    return total / max(count, 1.0);
}

// Equation 2 as printed, with weights n_x², n_y², or with |n_x|, |n_y| over their sum, which is exact on planes.
fn guided(i: u32, j: u32) -> f32 {
    let k = j * stage.width + i;
    let nodes = stage.width * stage.height;
    let free = mean(0u, i, j);
    let rise = slopes[k];
    var n = vec2<f32>(slopes[nodes + k], slopes[2u * nodes + k]);
    let printed = (stage.flags & PRINTED) != 0u;
    if !printed {
        let length = sqrt(n.x * n.x + n.y * n.y);
        if length <= 1e-6 {
            return free;
        }
        n = n / length;
    }
    let share = select(abs(n), n * n, printed);
    let divisor = select(share.x + share.y, 1.0, printed);
    // The neighbour against the direction.
    let along = select(1, -1, n.x > 0.0);
    let up = select(1, -1, n.y > 0.0);
    // Of a slope that comes from outside the raster only half would be read: it is not followed.
    let missing = (share.x > 0.0 && !exists(i, j, along, 0)) || (share.y > 0.0 && !exists(i, j, 0, up));
    if missing || (share.x == 0.0 && share.y == 0.0) {
        return free;
    }
    var implied = rise * stage.spacing;
    if share.x > 0.0 {
        implied += share.x * value(0u, i, j, along, 0);
    }
    if share.y > 0.0 {
        implied += share.y * value(0u, i, j, 0, up);
    }
    return 0.5 * free + 0.5 * implied / divisor;
}

@compute @workgroup_size(32, 8)
fn jacobi(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= stage.width || id.y >= stage.height {
        return;
    }
    let field = id.z * stage.width * stage.height;
    let k = id.y * stage.width + id.x;
    let kind = kinds[k];
    if (kind & stage.given) != 0u {
        if (stage.flags & 1u) == 0u {
            after[field + k] = before[field + k];
        }
        return;
    }
    if (stage.flags & READ) != 0u && (kind & FOLLOWED) != 0u {
        after[k] = guided(id.x, id.y);
    } else {
        after[field + k] = mean(field, id.x, id.y);
    }
}
