// Gradient noise in space and in the plane with its gradient, as terrain_model::noise::gradient3 and gradient2 compute them. `hash.wgsl` stands before
// it.

// The edge of a cube that a hash chooses: the component that is 0 by the top half, signs by the lowest bits.
fn edge(hash: u32) -> vec3<f32> {
    let none = ((hash >> 16u) * 3u) >> 16u;
    let first = select(1.0, -1.0, (hash & 1u) != 0u);
    let second = select(1.0, -1.0, (hash & 2u) != 0u);
    let y = select(second, first, none == 0u);
    return vec3<f32>(select(first, 0.0, none == 0u), select(y, 0.0, none == 1u), select(second, 0.0, none == 2u));
}

fn lerp(a: f32, b: f32, t: f32) -> f32 {
    return a + t * (b - a);
}

// Value, and derivatives along x, y and z, at noise coordinates.
fn gradient_noise(key: vec3<u32>, p: vec3<f32>) -> vec4<f32> {
    let below = floor(p);
    let t = p - below;
    let cell = bitcast<vec3<u32>>(vec3<i32>(below)) + key;
    let fade = t * t * t * ((t * 6.0 - 15.0) * t + 10.0);
    let bump = 0.25 - (t - 0.5) * (t - 0.5);
    let steep = 30.0 * (bump * bump);
    var heights: array<f32, 8>;
    var slope = vec3<f32>(0.0);
    for (var corner = 0u; corner < 8u; corner++) {
        let at = vec3<u32>(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
        let far = at == vec3<u32>(1u);
        let g = edge(hashed3(cell + at));
        let d = t - vec3<f32>(at);
        let height = g.x * d.x + g.y * d.y + g.z * d.z;
        let w = select(1.0 - fade, fade, far);
        let dw = select(-steep, steep, far);
        let yz = w.y * w.z;
        let weight = w.x * yz;
        slope += vec3<f32>(dw.x * yz, dw.y * (w.x * w.z), dw.z * (w.x * w.y)) * height + weight * g;
        heights[corner] = height;
    }
    let south = lerp(lerp(heights[0], heights[1], fade.x), lerp(heights[2], heights[3], fade.x), fade.y);
    let north = lerp(lerp(heights[4], heights[5], fade.x), lerp(heights[6], heights[7], fade.x), fade.y);
    return vec4<f32>(lerp(south, north, fade.z), slope);
}

// cos and sin of π/8.
const LONG: f32 = 0.9238795325112867;
const SHORT: f32 = 0.3826834323650898;

// The direction in the plane that the top three bits of a hash choose.
fn direction(hash: u32) -> vec2<f32> {
    let exchange = ((hash >> 29u) & 1u) == 1u;
    let x = select(LONG, SHORT, exchange);
    let y = select(SHORT, LONG, exchange);
    return vec2<f32>(select(x, -x, (hash & 0x80000000u) != 0u), select(y, -y, (hash & 0x40000000u) != 0u));
}

// Value, and derivatives along x and y, at noise coordinates.
fn plane_noise(key: vec2<u32>, p: vec2<f32>) -> vec3<f32> {
    let below = floor(p);
    let t = p - below;
    let cell = bitcast<vec2<u32>>(vec2<i32>(below)) + key;
    let fade = t * t * t * ((t * 6.0 - 15.0) * t + 10.0);
    let bump = 0.25 - (t - 0.5) * (t - 0.5);
    let steep = 30.0 * (bump * bump);
    var heights: array<f32, 4>;
    var slope = vec2<f32>(0.0);
    for (var corner = 0u; corner < 4u; corner++) {
        let at = vec2<u32>(corner & 1u, corner >> 1u);
        let far = at == vec2<u32>(1u);
        let g = direction(hashed2(cell + at));
        let d = t - vec2<f32>(at);
        let height = g.x * d.x + g.y * d.y;
        let w = select(1.0 - fade, fade, far);
        let dw = select(-steep, steep, far);
        slope += vec2<f32>(dw.x * w.y, dw.y * w.x) * height + (w.x * w.y) * g;
        heights[corner] = height;
    }
    let south = lerp(heights[0], heights[1], fade.x);
    let north = lerp(heights[2], heights[3], fade.x);
    return vec3<f32>(lerp(south, north, fade.y), slope);
}
