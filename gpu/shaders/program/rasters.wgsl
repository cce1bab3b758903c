// Images on rectangles and on chains of quadrangles, as model/src/primitive/{image,quad,raster,spline}.rs compute them on
// lanes. A raster stands in `images` as its width, its height and its samples row by row; `r` is the index of its width.

// Parameters of a chain before its sections, and of a section with the quadrangle that follows.
const CHAIN_HEADER: u32 = 10u;
const CHAIN_STRIDE: u32 = 14u;

// A cell or a span along one axis, and the position inside it.
struct Within {
    index: i32,
    at: f32,
}

fn sample_of(r: u32, i: i32, j: i32) -> f32 {
    return bitcast<f32>(images[r + 2u + u32(j) * images[r] + u32(i)]);
}

fn cell_of(cells: i32, base: i32, u: f32) -> Within {
    let below = floor(u);
    let cell = i32(below) + base;
    if cell < 0 {
        return Within(0, 0.0);
    }
    if cell >= cells {
        return Within(cells - 1, 1.0);
    }
    return Within(cell, u - below);
}

fn lookup(r: u32, base: vec2<i32>, u: vec2<f32>) -> f32 {
    let x = cell_of(i32(images[r]) - 1, base.x, u.x);
    let y = cell_of(i32(images[r + 1u]) - 1, base.y, u.y);
    let south = lerp(sample_of(r, x.index, y.index), sample_of(r, x.index + 1, y.index), x.at);
    let north = lerp(sample_of(r, x.index, y.index + 1), sample_of(r, x.index + 1, y.index + 1), x.at);
    return lerp(south, north, y.at);
}

// From the first to the last sample; there the span is entered and left at its middle.
fn span_of(count: i32, base: i32, u: f32) -> Within {
    let x = u + 0.5;
    let below = floor(x);
    let at = x - below;
    let middle = i32(below) + base;
    let last = count - 1;
    if middle < 0 || (middle == 0 && at < 0.5) {
        return Within(0, 0.5);
    }
    if middle > last || (middle == last && at > 0.5) {
        return Within(last, 0.5);
    }
    return Within(middle, at);
}

fn spline_span(c: vec3<f32>, t: f32) -> f32 {
    let d0 = c.y - c.x;
    let d1 = c.z - c.y;
    return c.y + 0.5 * (t * t * d1 - (1.0 - t) * (1.0 - t) * d0);
}

fn spline_row(r: u32, x: Within, j: i32) -> f32 {
    let west = max(x.index - 1, 0);
    let east = min(x.index + 1, i32(images[r]) - 1);
    return spline_span(vec3<f32>(sample_of(r, west, j), sample_of(r, x.index, j), sample_of(r, east, j)), x.at);
}

fn spline(r: u32, base: vec2<i32>, u: vec2<f32>) -> f32 {
    let rows = i32(images[r + 1u]);
    let x = span_of(i32(images[r]), base.x, u.x);
    let y = span_of(rows, base.y, u.y);
    let south = spline_row(r, x, max(y.index - 1, 0));
    let north = spline_row(r, x, min(y.index + 1, rows - 1));
    return spline_span(vec3<f32>(south, spline_row(r, x, y.index), north), y.at);
}

// 1 inside, 0 from the border on.
fn edge(distance: f32, inverse_margin: f32) -> f32 {
    let left = 1.0 - clamp01(distance * inverse_margin);
    return wyvill(left * left);
}

fn image(k: u32, length: u32, x: vec2<f32>) -> vec2<f32> {
    let p = code[k];
    let offset = x - pair(p);
    let base = bitcast<vec2<i32>>(vec2<u32>(code[k + 2u], code[k + 3u]));
    let u = offset * pair(p + 2u) + pair(p + 4u);
    let elevation = lookup(code[k + 1u], base, u) * parameters[p + 12u] + parameters[p + 13u];
    let from_edge = pair(p + 8u) - abs(x - pair(p + 6u));
    var weight = parameters[p + 11u] * edge(from_edge.x, parameters[p + 10u]) * edge(from_edge.y, parameters[p + 10u]);
    if length > 4u {
        let weights_base = bitcast<vec2<i32>>(vec2<u32>(code[k + 5u], code[k + 6u]));
        weight = weight * spline(code[k + 4u], weights_base, offset * pair(p + 14u) + pair(p + 16u));
    }
    return vec2<f32>(elevation, weight);
}

fn cross_of(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// Elevation and weight at the share u of the width and the share v of the length of a chain.
fn on_chain(k: u32, length: u32, u: f32, v: f32) -> vec2<f32> {
    let p = code[k];
    let at = vec2<f32>(u, v);
    let elevation = lookup(code[k + 1u], vec2<i32>(0), at * pair(p + 6u)) * parameters[p + 3u] + parameters[p + 4u];
    let from_edge = vec2<f32>(0.5) - abs(at - vec2<f32>(0.5));
    var weight = parameters[p] * edge(from_edge.x, parameters[p + 1u]) * edge(from_edge.y, parameters[p + 2u]);
    if length > 3u {
        weight = weight * spline(code[k + 3u], vec2<i32>(0), at * pair(p + 8u));
    }
    return vec2<f32>(elevation, weight);
}

// The side of a section is computed once and decides for the quadrangles before and behind it: however the device
// contracts it, no point is between the two.
fn chain(k: u32, length: u32, x: vec2<f32>) -> vec2<f32> {
    let header = code[k];
    let pieces = code[k + 2u];
    var answer = vec2<f32>(0.0);
    var along_v = cross_of(pair(header + CHAIN_HEADER + 2u), x - pair(header + CHAIN_HEADER));
    for (var i = 0u; i < pieces; i++) {
        let p = header + CHAIN_HEADER + i * CHAIN_STRIDE;
        let next = p + CHAIN_STRIDE;
        let entered = along_v;
        along_v = cross_of(pair(next + 2u), x - pair(next));
        let d = x - pair(p);
        let e = pair(p + 2u);
        let f = pair(p + 5u);
        let g = pair(p + 7u);
        let along_u = cross_of(d, f);
        if entered < 0.0 || !(along_v < 0.0) || !(along_u > 0.0) || !(cross_of(f + g, d - e) > 0.0) {
            continue;
        }
        let ef = parameters[p + 9u];
        let gf = parameters[p + 10u];
        let least = parameters[p + 12u];
        let dg = cross_of(d, g);
        let b = ef + dg;
        let determinant = sqrt(max(b * b + 4.0 * gf * entered, least * least));
        let v = clamp01(2.0 * entered / max(b + determinant, 2.0 * least));
        let u = clamp01(2.0 * along_u / max(ef - dg + determinant, 2.0 * least));
        let row = parameters[p + 4u];
        answer = on_chain(k, length, u, row + v * (parameters[next + 4u] - row));
    }
    return answer;
}
