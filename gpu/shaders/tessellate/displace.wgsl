// Position and normal of each vertex of each leaf's lattice: Phong tessellation, then noise along the normal. Both depend on the
// integer vertex and the camera alone. Twin: src/tessellate/surface.rs, which is the formula of displace.rs relative to the eye.
// `noise.wgsl` stands before it.
//
// A jet is a value with its derivatives along u and v, the coordinates within a cell of the ground.

const SIDE: u32 = 1u << 24u;
const COORDINATE: u32 = (1u << 25u) - 1u;
const ACROSS: u32 = 65535u;
// Vertices along an edge of a leaf's lattice, less one; lanes of a leaf, of which the last does nothing.
const STEPS: i32 = 4;
const LANES: u32 = 16u;
const VERTICES: u32 = 15u;

struct Surface {
    // The grid vertex nearest the eye, metres per grid unit, and the eye: x and y from that vertex, elevation.
    origin: vec2<i32>,
    unit: vec2<f32>,
    eye: vec3<f32>,
    cells: u32,
    // Metres of a cell.
    spacing: vec2<f32>,
    // Weight of Phong tessellation.
    alpha: f32,
    // Largest displacement by noise, metres.
    amplitude: f32,
    // Share of it on level ground and on the lowest, and what that leaves.
    share: vec2<f32>,
    rest: vec2<f32>,
    // Where it is the lowest, above the eye, and the metres to where it is 1.
    low: f32,
    rise: f32,
    // Wanted edge over distance.
    size: f32,
    octaves: u32,
    // Cells of the raster: vertices beyond it are drawn back to its borders.
    inside: vec2<u32>,
    // Largest value of noise, and the sum of the octaves' amplitudes.
    largest: f32,
    range: f32,
    // Not 0: noise is read at x and y; octaves are multiplied.
    plan: u32,
    multiplied: u32,
    // Of a product: what is added to each octave, its value without noise, and the most that it is off that.
    offset: f32,
    neutral: f32,
    reach: f32,
    // Share of the displacement in sharp hollows, what that leaves, and twice the Laplacian that is sharp, 1/m.
    hollow: f32,
    above: f32,
    sharp: f32,
}

struct Octave {
    key: vec3<u32>,
    frequency: f32,
    offset: vec3<f32>,
    amplitude: f32,
}

struct Counters {
    read: u32,
    write: u32,
    leaves: u32,
    most: u32,
}

@group(0) @binding(0) var<storage, read> surface: Surface;
// Elevation and unit normal of each sample.
@group(0) @binding(1) var<storage, read> samples: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> octaves: array<Octave>;
@group(0) @binding(3) var<storage, read> leaves: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> counters: Counters;
// Metres from the eye, then the unit normal: six numbers a vertex.
@group(0) @binding(5) var<storage, read_write> vertices: array<f32>;
// Laplacian of the elevation at each sample, 1/m.
@group(0) @binding(6) var<storage, read> curvatures: array<f32>;

fn times(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(a.x * b.x, a.yz * b.x + a.x * b.yz);
}

fn over(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    let value = a.x / b.x;
    return vec3<f32>(value, (a.yz - value * b.yz) / b.x);
}

// Of three components.
struct Jets {
    x: vec3<f32>,
    y: vec3<f32>,
    z: vec3<f32>,
}

fn dot_jets(a: Jets, b: Jets) -> vec3<f32> {
    return times(a.x, b.x) + times(a.y, b.y) + times(a.z, b.z);
}

struct Point {
    position: vec3<f32>,
    normal: vec3<f32>,
}

// The jet, or a bound where its value lies beyond.
fn clamped(x: vec3<f32>, low: f32, high: f32) -> vec3<f32> {
    let above = select(x, vec3<f32>(low, 0.0, 0.0), x.x < low);
    return select(above, vec3<f32>(high, 0.0, 0.0), above.x > high);
}

fn displaced(any: vec2<u32>) -> Point {
    let per_cell = SIDE / surface.cells;
    let vertex = min(any, surface.inside * per_cell);
    let cell = min(vertex / per_cell, surface.inside - 1u);
    let t = vec2<f32>(vertex - cell * per_cell) / f32(per_cell);
    let u = vec3<f32>(t.x, 1.0, 0.0);
    let v = vec3<f32>(t.y, 0.0, 1.0);
    let one = vec3<f32>(1.0, 0.0, 0.0);
    let first = cell.y * (surface.cells + 1u) + cell.x;
    let corners = array<u32, 4>(first, first + 1u, first + surface.cells + 1u, first + surface.cells + 2u);
    let weights = array<vec3<f32>, 4>(times(one - u, one - v), times(u, one - v), times(one - u, v), times(u, v));
    let east = array<vec3<f32>, 4>(u, u - one, u, u - one);
    let north = array<vec3<f32>, 4>(v, v, v - one, v - one);
    let flat = vec2<f32>(vec2<i32>(vertex) - surface.origin) * surface.unit - surface.eye.xy;
    var at: array<vec4<f32>, 4>;
    var z = vec3<f32>(0.0);
    var bend = vec3<f32>(0.0);
    for (var k = 0; k < 4; k++) {
        bend += weights[k] * curvatures[corners[k]];
        at[k] = samples[corners[k]];
        at[k].x -= surface.eye.z;
        z += weights[k] * at[k].x;
    }
    var shift = Jets();
    var n = Jets();
    for (var k = 0; k < 4; k++) {
        let normal = at[k].yzw;
        let height = z - vec3<f32>(at[k].x, 0.0, 0.0);
        let off = east[k] * surface.spacing.x * normal.x + north[k] * surface.spacing.y * normal.y + height * normal.z;
        let pulled = times(weights[k], off);
        shift.x -= pulled * normal.x;
        shift.y -= pulled * normal.y;
        shift.z -= pulled * normal.z;
        n.x += weights[k] * normal.x;
        n.y += weights[k] * normal.y;
        n.z += weights[k] * normal.z;
    }
    let s = Jets(
        vec3<f32>(flat.x, surface.spacing.x, 0.0) + surface.alpha * shift.x,
        vec3<f32>(flat.y, 0.0, surface.spacing.y) + surface.alpha * shift.y,
        z + surface.alpha * shift.z,
    );
    let squared = dot_jets(n, n);
    let root = sqrt(squared.x);
    let length_of_n = vec3<f32>(root, squared.yz / (root + root));
    n = Jets(over(n.x, length_of_n), over(n.y, length_of_n), over(n.z, length_of_n));
    let high = clamped((s.z - vec3<f32>(surface.low, 0.0, 0.0)) / surface.rise, 0.0, 1.0);
    let steep = surface.share.x * one + surface.rest.x * (one - n.z);
    let hollow = surface.hollow * one + surface.above * clamped(0.5 * one - bend / surface.sharp, 0.0, 1.0);
    let share = clamped(times(times(steep, surface.share.y * one + surface.rest.y * high), hollow), 0.0, 1.0);
    let distance = sqrt(s.x.x * s.x.x + s.y.x * s.y.x + s.z.x * s.z.x);
    let size = surface.size * distance;
    var sum = vec3<f32>(0.0);
    var product = one;
    for (var k = 0u; k < surface.octaves; k++) {
        let octave = octaves[k];
        // Half a wave is no shorter than the wanted edge: bands that would alias have faded.
        let band = clamp(1.0 / max(2.0 * size * octave.frequency, 1e-30) - 1.0, 0.0, 1.0);
        var part = vec3<f32>(0.0);
        if band > 0.0 {
            let p = vec3<f32>(s.x.x, s.y.x, s.z.x) * octave.frequency + octave.offset;
            var noise: vec4<f32>;
            if surface.plan != 0u {
                noise = vec4<f32>(plane_noise(octave.key.xy, p.xy), 0.0);
            } else {
                noise = gradient_noise(octave.key, p);
            }
            let along = noise.y * (s.x.yz * octave.frequency) + noise.z * (s.y.yz * octave.frequency)
                + noise.w * (s.z.yz * octave.frequency);
            part = vec3<f32>(noise.x, along) / surface.largest * (band * octave.amplitude);
        }
        sum += part;
        product = times(product, vec3<f32>(surface.offset + part.x, part.yz));
    }
    var combined = sum / surface.range;
    if surface.multiplied != 0u {
        combined = vec3<f32>(product.x - surface.neutral, product.yz) / surface.reach;
    }
    let by = times(share * surface.amplitude, clamped(combined, -1.0, 1.0));
    let p = Jets(s.x + times(by, n.x), s.y + times(by, n.y), s.z + times(by, n.z));
    let east_ward = vec3<f32>(p.x.y, p.y.y, p.z.y);
    let north_ward = vec3<f32>(p.x.z, p.y.z, p.z.z);
    let across = vec3<f32>(
        east_ward.y * north_ward.z - east_ward.z * north_ward.y,
        east_ward.z * north_ward.x - east_ward.x * north_ward.z,
        east_ward.x * north_ward.y - east_ward.y * north_ward.x,
    );
    let length = sqrt(across.x * across.x + across.y * across.y + across.z * across.z);
    // Where displacement folds the surface it may have no normal: that of the smooth one then.
    let normal = select(vec3<f32>(n.x.x, n.y.x, n.z.x), across / length, length > 0.0);
    return Point(vec3<f32>(p.x.x, p.y.x, p.z.x), normal);
}

@compute @workgroup_size(64)
fn displace(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let i = (group.y * ACROSS + group.x) * 64u + lane;
    let leaf = i / LANES;
    let k = i % LANES;
    if leaf >= min(counters.leaves, arrayLength(&leaves)) || k >= VERTICES {
        return;
    }
    // Row after row from the apex's leg: 5, 4, 3, 2, 1 vertices.
    var row = 0;
    var column = i32(k);
    while column > STEPS - row {
        column -= STEPS + 1 - row;
        row += 1;
    }
    let packed = leaves[leaf];
    let apex = vec2<i32>(vec2<u32>(packed.x & COORDINATE, packed.y));
    let leg = vec2<i32>(packed.zw) - apex;
    let other = vec2<i32>(-leg.y, leg.x);
    let point = displaced(vec2<u32>(apex + (leg * column + other * row) / STEPS));
    let first = (leaf * VERTICES + k) * 6u;
    vertices[first] = point.position.x;
    vertices[first + 1u] = point.position.y;
    vertices[first + 2u] = point.position.z;
    vertices[first + 3u] = point.normal.x;
    vertices[first + 4u] = point.normal.y;
    vertices[first + 5u] = point.normal.z;
}
