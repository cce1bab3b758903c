// Curves and contours: skeletons of arcs, cross-sections, sectors between rays. As model/src/skeleton, profile.rs and
// primitive/{curve,contour}.rs compute them, with the layouts of their parameters.

// Parameters of a piece of a section, of a section before its pieces, of a run of arcs, of an arc; arcs of a run.
const PIECE: u32 = 4u;
const SECTION: u32 = 2u;
const RUN_WIDTH: u32 = 5u;
const ARC_WIDTH: u32 = 19u;
const RUN: u32 = 8u;
// The share of the radius at which the distance to the centre of an arc is held.
const CORE: f32 = 0.25;
// Arcs that are averaged together; more are averaged in turns.
const TOGETHER: u32 = 16u;

fn profile(p: u32, pieces: u32, d: f32) -> f32 {
    var height = parameters[p + 1u];
    for (var piece = 1u; piece < pieces; piece++) {
        let k = p + piece * PIECE;
        let start = parameters[k];
        var end = d;
        if piece + 1u < pieces {
            end = min(d, parameters[k + PIECE]);
        }
        let t = max(end - start, 0.0);
        let value = parameters[k + 1u] + t * (parameters[k + 2u] + t * parameters[k + 3u]);
        height = select(value, height, d < start);
    }
    return height;
}

struct Sections {
    p: u32,
    count: u32,
    pieces: u32,
    even: bool,
}

fn section(shape: Sections, d: f32, s: f32) -> f32 {
    let stride = SECTION + shape.pieces * PIECE;
    var height = profile(shape.p + SECTION, shape.pieces, d);
    for (var k = 1u; k < shape.count; k++) {
        let before = shape.p + (k - 1u) * stride;
        let t = clamp01((s - parameters[before]) * parameters[before + 1u]);
        if t > 0.0 {
            let weight = t * t * (3.0 - t - t);
            let next = profile(shape.p + k * stride + SECTION, shape.pieces, d);
            height = mean_of_two(vec2<f32>(height, 1.0 - weight), vec2<f32>(next, weight)).x;
        }
    }
    return height;
}

// The height at distance d, even part at d and odd part at the side.
fn beside(shape: Sections, d: f32, side: f32, s: f32) -> f32 {
    if shape.even {
        return section(shape, d, s);
    }
    let held = min(max(side, -d), d);
    let even = section(shape, d, s) + section(shape, -d, s);
    return 0.5 * (even + (section(shape, held, s) - section(shape, -held, s)));
}

struct Place {
    at: vec2<f32>,
    ratio: vec2<f32>,
    past: vec2<f32>,
    side: f32,
    distance: f32,
}

fn place(p: u32, x: vec2<f32>) -> Place {
    let direction = pair(p + 2u);
    let v = x - pair(p);
    let a = v.x * direction.x + v.y * direction.y;
    let b = direction.x * v.y - direction.y * v.x;
    let k = parameters[p + 4u];
    let c = 1.0 - k * b;
    let ratio = distance_of(vec2<f32>(c, k * a));
    let to_circle = (b + b - k * (a * a + b * b)) / (1.0 + ratio);
    let along = a * parameters[p + 6u];
    let level = b * parameters[p + 7u] - parameters[p + 8u];
    let past = vec2<f32>(level - along, level + along);
    let inside = max(past.x, past.y) < 0.0;
    let from_end = vec2<f32>(abs(a) - parameters[p + 8u], b - parameters[p + 9u]);
    let to_tangent = from_end.y * parameters[p + 6u] - from_end.x * parameters[p + 7u];
    let side = select(to_tangent + to_tangent, to_circle, inside);
    let distance = select(distance_of(from_end), abs(to_circle), inside);
    return Place(vec2<f32>(a, b), vec2<f32>(ratio, c), past, side, distance);
}

// Elevation of the skeleton, and metres along it.
fn along_arc(p: u32, at: Place, reach: f32) -> vec2<f32> {
    let across = max(abs(at.ratio.y), CORE);
    let u = min(max(at.at.x * parameters[p + 5u] / across, -1.0), 1.0);
    let z = parameters[p + 10u] + u * (parameters[p + 11u] + u * (parameters[p + 12u] + u * parameters[p + 13u]));
    let s = parameters[p + 16u] + u * (parameters[p + 17u] + u * u * parameters[p + 18u]);
    let on = min(max(at.past / max(at.ratio.x, CORE), vec2<f32>(0.0)), vec2<f32>(reach));
    return vec2<f32>(z + on.y * parameters[p + 15u] - on.x * parameters[p + 14u], s + on.y - on.x);
}

// No arc of the run is nearer than the root of this.
fn least_squared(p: u32, x: vec2<f32>) -> f32 {
    let over = max(abs(x - pair(p)) - pair(p + 2u), vec2<f32>(0.0));
    return over.x * over.x + over.y * over.y;
}

fn curve(k: u32, x: vec2<f32>) -> vec2<f32> {
    let p = code[k];
    let arcs = code[k + 1u];
    let chain = p + 3u;
    let runs = chain + 4u;
    let count = (arcs + RUN - 1u) / RUN;
    let first = runs + count * RUN_WIDTH;
    let shape = Sections(first + arcs * ARC_WIDTH, code[k + 2u], code[k + 3u], code[k + 4u] == 1u);
    var nearest = parameters[chain + 3u];
    for (var run = 0u; run < count; run++) {
        if nearest * nearest < least_squared(runs + run * RUN_WIDTH, x) {
            continue;
        }
        for (var i = run * RUN; i < min((run + 1u) * RUN, arcs); i++) {
            nearest = min(nearest, place(first + i * ARC_WIDTH, x).distance);
        }
    }
    let weight = parameters[p + 1u] * wyvill(nearest * nearest * parameters[p]);
    if !(weight > 0.0) {
        return vec2<f32>(0.0, weight);
    }
    let rounding = parameters[chain + 1u];
    let reach = parameters[chain + 2u];
    if arcs == 1u {
        let at = place(first, x);
        let here = along_arc(first, at, reach);
        return vec2<f32>(here.x + beside(shape, nearest, at.side, here.y), weight);
    }
    let smallest = distance_of(vec2<f32>(nearest, rounding));
    let widest = smallest + 1.0 / parameters[chain];
    let far = widest * widest - rounding * rounding;
    var sums = vec2<f32>(0.0);
    var together = 0u;
    var hull = vec2<f32>(0.0);
    var met = false;
    for (var run = 0u; run < count; run++) {
        if far < least_squared(runs + run * RUN_WIDTH, x) {
            continue;
        }
        for (var i = run * RUN; i < min((run + 1u) * RUN, arcs); i++) {
            let arc = first + i * ARC_WIDTH;
            let at = place(arc, x);
            let rounded = distance_of(vec2<f32>(at.distance, rounding));
            let excess = max((rounded - smallest) * parameters[chain], 0.0);
            if excess < 1.0 {
                if together == TOGETHER {
                    let mean = mean_of(sums);
                    sums = vec2<f32>(mean.y * mean.x, mean.y);
                    together = 1u;
                }
                let on = along_arc(arc, at, reach);
                let here = on.x + beside(shape, nearest, at.side, on.y);
                let share = wyvill(excess);
                sums += vec2<f32>(share * here, share);
                together += 1u;
                hull = select(vec2<f32>(here), vec2<f32>(min(hull.x, here), max(hull.y, here)), met);
                met = true;
            }
        }
    }
    var elevation = mean_of(sums).x;
    if met {
        elevation = min(max(elevation, hull.x), hull.y);
    }
    return vec2<f32>(elevation, weight);
}

fn to_ray(p: u32, v: vec2<f32>) -> f32 {
    return parameters[p] * v.y - parameters[p + 1u] * v.x;
}

fn contour(k: u32, x: vec2<f32>) -> vec2<f32> {
    let p = code[k];
    let rays = code[k + 1u];
    let pieces = code[k + 2u];
    let stride = 4u + pieces * PIECE;
    let ray = p + 8u;
    let v = x - pair(p);
    let distance = distance_of(v);
    var height = parameters[ray + 5u];
    var past = distance - parameters[ray + 2u];
    let start = to_ray(ray, v);
    var after = start;
    for (var i = 0u; i < rays; i++) {
        let here = ray + i * stride;
        let next = ray + ((i + 1u) % rays) * stride;
        let before = after;
        after = start;
        if i + 1u < rays {
            after = to_ray(next, v);
        }
        if before < 0.0 || !(after < 0.0) {
            continue;
        }
        let a = max(before, 0.0);
        let b = max(-after, 0.0);
        let t = min(a / max(a + b, parameters[here + 3u]), 1.0);
        let w = t * t * (3.0 - t - t);
        past = distance - lerp(parameters[here + 2u], parameters[next + 2u], w);
        height = lerp(profile(here + 4u, pieces, past), profile(next + 4u, pieces, past), w);
    }
    let beyond = max(past, 0.0);
    return vec2<f32>(parameters[p + 2u] + height, parameters[p + 3u] * wyvill(beyond * beyond * parameters[p + 4u]));
}
