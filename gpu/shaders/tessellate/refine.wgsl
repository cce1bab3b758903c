// One level of refinement: each triangle of a list is culled, becomes a leaf, or pushes its halves to the next list.
// Twin: src/tessellate/decision.rs, which says why rounding opens no crack.

const SIDE: i32 = 1 << 24u;
const LEVEL: u32 = 25u;
const COORDINATE: u32 = (1u << LEVEL) - 1u;
// Workgroups along x; more continue along y.
const ACROSS: u32 = 65535u;
// 16 units in the last place of 1.
const SLACK: f32 = 9.5367431640625e-7;

struct Decision {
    // The grid vertex nearest the eye, metres per grid unit, and the eye: x and y from that vertex, elevation.
    origin: vec2<i32>,
    unit: vec2<f32>,
    eye: vec3<f32>,
    // The largest displacement by noise, metres.
    amplitude: f32,
    // Inward normals of planes through the eye.
    planes: array<vec4<f32>, 5>,
    cells: u32,
    levels: u32,
    cull: u32,
    capacity: u32,
    leaf_capacity: u32,
    // The raster's north-east corner.
    east: i32,
    north: i32,
    // R(l)², metres²; the last is 0.
    radii: array<f32, 43>,
}

struct Counters {
    read: u32,
    write: atomic<u32>,
    leaves: atomic<u32>,
    most: u32,
}

@group(0) @binding(0) var<storage, read> decision: Decision;
// Lowest and highest elevation and farthest move of each block, from single cells to the whole.
@group(0) @binding(1) var<storage, read> pyramid: array<f32>;
// Apex and first end of the base; the level stands above the apex's x.
@group(0) @binding(2) var<storage, read> list: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> next: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> leaves: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> counters: Counters;

struct Block {
    low: f32,
    high: f32,
    moved: f32,
}

// Of the square of half side `reach` about `centre`, with room for the noise.
fn enclosure(centre: vec2<i32>, reach: i32) -> Block {
    var shift = firstTrailingBit(u32(SIDE) / decision.cells);
    var side = decision.cells;
    var first = 0u;
    for (var level = 1u; level < decision.levels && (2i << shift) < reach; level++) {
        first += side * side;
        side = side >> 1u;
        shift += 1u;
    }
    let last = vec2<u32>(side - 1u);
    let begin = min(vec2<u32>(max(centre - (reach + 1), vec2<i32>(0))) >> vec2<u32>(shift), last);
    let end = min(vec2<u32>(max(centre + reach, vec2<i32>(0))) >> vec2<u32>(shift), last);
    let any = 3u * (first + begin.y * side + begin.x);
    var whole = Block(pyramid[any], pyramid[any + 1u], pyramid[any + 2u]);
    for (var j = begin.y; j <= end.y; j++) {
        for (var i = begin.x; i <= end.x; i++) {
            let at = 3u * (first + j * side + i);
            whole.low = min(whole.low, pyramid[at]);
            whole.high = max(whole.high, pyramid[at + 1u]);
            whole.moved = max(whole.moved, pyramid[at + 2u]);
        }
    }
    let a = decision.amplitude;
    return Block(whole.low - a, whole.high + a, whole.moved + a);
}

fn metres(vertex: vec2<i32>) -> vec2<f32> {
    return vec2<f32>(vertex - decision.origin) * decision.unit;
}

fn splits(middle: vec2<i32>, block: Block, level: u32) -> bool {
    let d = metres(middle) - decision.eye.xy;
    let z = max(max(block.low - decision.eye.z, decision.eye.z - block.high), 0.0);
    return d.x * d.x + d.y * d.y + z * z < decision.radii[level];
}

fn hidden(corners: array<vec2<i32>, 3>, block: Block) -> bool {
    let a = metres(corners[0]);
    let b = metres(corners[1]);
    let c = metres(corners[2]);
    let low = vec3<f32>(min(min(a, b), c) - block.moved, block.low);
    let high = vec3<f32>(max(max(a, b), c) + block.moved, block.high);
    for (var k = 0u; k < 5u; k++) {
        let n = decision.planes[k].xyz;
        let bound = select(low, high, n > vec3<f32>(0.0));
        let far = bound - decision.eye;
        let size = abs(n) * (abs(bound) + block.moved + abs(decision.eye));
        if n.x * far.x + n.y * far.y + n.z * far.z < -SLACK * (size.x + size.y + size.z) {
            return true;
        }
    }
    return false;
}

fn pack(level: u32, apex: vec2<i32>, base: vec2<i32>) -> vec4<u32> {
    return vec4<u32>(u32(apex.x) | (level << LEVEL), u32(apex.y), u32(base.x), u32(base.y));
}

@compute @workgroup_size(64)
fn refine(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let i = (group.y * ACROSS + group.x) * 64u + lane;
    if i >= counters.read {
        return;
    }
    let packed = list[i];
    let level = packed.x >> LEVEL;
    let apex = vec2<i32>(vec2<u32>(packed.x & COORDINATE, packed.y));
    let base = vec2<i32>(packed.zw);
    let leg = base - apex;
    let third = apex + vec2<i32>(-leg.y, leg.x);
    // Nothing of it is over the raster.
    if min(min(apex.x, base.x), third.x) >= decision.east || min(min(apex.y, base.y), third.y) >= decision.north {
        return;
    }
    let middle = (base + third) / 2;
    let w = max(abs(leg.x), abs(leg.y));
    let block = enclosure(middle, select(2 * w, 3 * w / 2, level % 2u == 0u));
    if decision.cull != 0u && hidden(array<vec2<i32>, 3>(apex, base, third), block) {
        return;
    }
    if splits(middle, block, level) {
        let slot = atomicAdd(&counters.write, 2u);
        if slot + 2u <= decision.capacity {
            next[slot] = pack(level + 1u, middle, apex);
            next[slot + 1u] = pack(level + 1u, middle, third);
        }
    } else {
        let slot = atomicAdd(&counters.leaves, 1u);
        if slot < decision.leaf_capacity {
            leaves[slot] = packed;
        }
    }
}
