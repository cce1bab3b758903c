// Gradient noise in the plane, and octaves of it combined, as terrain_model::noise computes them. `hash.wgsl` stands before it.

// The keys of the lattice's seed plus the cell of the tile's origin; noise coordinates of that origin within its cell;
// cycles per metre; metres; amplitude over that of the first octave.
struct Octave {
    key: vec2<u32>,
    offset: vec2<f32>,
    frequency: f32,
    amplitude: f32,
    ratio: f32,
    unused: f32,
}

// The direction that the top three bits of a hash choose.
fn direction(hash: u32) -> vec2<f32> {
    let exchange = ((hash >> 29u) & 1u) == 1u;
    let x = select(LONG, SHORT, exchange);
    let y = select(SHORT, LONG, exchange);
    return vec2<f32>(select(x, -x, (hash & 0x80000000u) != 0u), select(y, -y, (hash & 0x40000000u) != 0u));
}

fn fade(t: f32) -> f32 {
    return t * t * t * ((t * 6.0 - 15.0) * t + 10.0);
}

fn lerp(a: f32, b: f32, t: f32) -> f32 {
    return a + t * (b - a);
}

fn corner(x: u32, y: u32, d: vec2<f32>) -> f32 {
    let g = direction(hashed2(vec2<u32>(x, y)));
    return g.x * d.x + g.y * d.y;
}

// The noise of one octave at a place in metres from the tile's origin.
fn noise(octave: Octave, at: vec2<f32>) -> f32 {
    let p = at * octave.frequency + octave.offset;
    let below = floor(p);
    let t = p - below;
    let i = bitcast<vec2<u32>>(vec2<i32>(below)) + octave.key;
    let u = fade(t.x);
    let v = fade(t.y);
    let s = t - vec2<f32>(1.0);
    let south = lerp(corner(i.x, i.y, t), corner(i.x + 1u, i.y, vec2<f32>(s.x, t.y)), u);
    let north = lerp(corner(i.x, i.y + 1u, vec2<f32>(t.x, s.y)), corner(i.x + 1u, i.y + 1u, s), u);
    return lerp(south, north, v);
}

const TURBULENCE: u32 = 1u;
const RIDGED: u32 = 2u;
const MULTIFRACTAL: u32 = 3u;
const HYBRID: u32 = 4u;

fn combined(kind: u32, first: u32, count: u32, a: f32, b: f32, at: vec2<f32>) -> f32 {
    let amplitude = octaves[first].amplitude;
    if amplitude == 0.0 {
        return 0.0;
    }
    var sum = 0.0;
    if kind == MULTIFRACTAL {
        sum = amplitude;
    }
    var weight = 1.0;
    for (var k = first; k < first + count; k++) {
        let octave = octaves[k];
        let eta = noise(octave, at);
        switch kind {
            case TURBULENCE: {
                sum += octave.amplitude * abs(eta);
            }
            case RIDGED: {
                let ridge = a - abs(eta);
                let signal = ridge * ridge * weight;
                sum += octave.amplitude * signal;
                weight = clamp01(b * signal);
            }
            case MULTIFRACTAL: {
                sum = sum * (a + octave.ratio * eta);
            }
            case HYBRID: {
                let signal = octave.ratio * (eta + a);
                sum += amplitude * (weight * signal);
                weight = min(weight, 1.0) * signal;
            }
            default: {
                sum += octave.amplitude * eta;
            }
        }
    }
    return sum;
}
