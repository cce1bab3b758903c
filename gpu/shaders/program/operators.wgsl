// Falloffs, level of detail, and the inner nodes, each as the file of its name under model/src/operator computes it. An
// operand is elevation and weight.

fn clamp01(x: f32) -> f32 {
    return min(max(x, 0.0), 1.0);
}

// sqrt, not length(): its error is that of the operations it is made of.
fn distance_of(d: vec2<f32>) -> f32 {
    return sqrt(d.x * d.x + d.y * d.y);
}

fn wyvill(u: f32) -> f32 {
    let v = max(1.0 - u, 0.0);
    return v * v * v;
}

fn smooth_step(t: f32) -> f32 {
    return t * t * (3.0 - (t + t));
}

fn pair(p: u32) -> vec2<f32> {
    return vec2<f32>(parameters[p], parameters[p + 1u]);
}

// κ at x; the parameters of the focus start at p.
fn kappa(p: u32, x: vec2<f32>) -> f32 {
    let far = clamp01((distance_of(x - pair(p)) - parameters[p + 2u]) * parameters[p + 3u]);
    return 1.0 - smooth_step(far);
}

// The end of a mean, from its sums Σ α·f and Σ α.
fn mean_of(sums: vec2<f32>) -> vec2<f32> {
    let positive = sums.y > 0.0;
    let mean = sums.x / select(1.0, sums.y, positive);
    return vec2<f32>(select(0.0, mean, positive), sums.y);
}

fn mean_of_two(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return mean_of(vec2<f32>(a.y * a.x + b.y * b.x, a.y + b.y));
}

fn on_support(a: vec2<f32>) -> f32 {
    return select(0.0, a.x, a.y > 0.0);
}

const KEEP: u32 = 0u;
const COMBINE: u32 = 1u;

fn add(rule: u32, a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    let t = clamp01(b.y);
    let detail = t * b.x;
    if rule == KEEP {
        return vec2<f32>(a.x + detail, a.y);
    }
    if rule == COMBINE {
        let base = mean_of_two(a, vec2<f32>(0.0, t * t));
        return vec2<f32>(base.x + detail, base.y);
    }
    return vec2<f32>(on_support(a) + detail, a.y + t * t);
}

fn replace(rule: u32, a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    let t = clamp01(b.y);
    let keep = 1.0 - t;
    if rule == KEEP {
        return vec2<f32>(keep * a.x + t * b.x, a.y);
    }
    if rule == COMBINE {
        return mean_of_two(vec2<f32>(a.x, keep * a.y), vec2<f32>(b.x, t * t));
    }
    return vec2<f32>(keep * on_support(a) + t * b.x, keep * a.y + t * t);
}

fn lod(p: u32, paper: bool, x: vec2<f32>, a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    let s = clamp01((kappa(p + 2u, x) - parameters[p]) * parameters[p + 1u]);
    let t = select(smooth_step(s), s, paper);
    let keep = 1.0 - t;
    let mean = mean_of_two(vec2<f32>(a.x, keep * a.y), vec2<f32>(b.x, t * b.y));
    let between = select(mean.x, keep * a.x + t * b.x, paper);
    return vec2<f32>(select(a.x, select(b.x, between, t < 1.0), t > 0.0), mean.y);
}

fn presence(weight: f32) -> f32 {
    return smooth_step(clamp01(weight * PRESENCE_GRADE - PRESENCE_OFFSET));
}

fn ramp(x: f32, p: u32) -> f32 {
    return smooth_step(clamp01(x * parameters[p] + parameters[p + 1u]));
}

// How far B is allowed, from A here and at four places around.
fn allowed(p: u32, a: array<vec2<f32>, 5>) -> f32 {
    let half = vec2<f32>(a[1].x - a[2].x, a[3].x - a[4].x) * parameters[p];
    var m = ramp(a[0].x, p + 1u) * ramp(distance_of(half), p + 3u);
    m = m * presence(a[0].y);
    m = m * presence(a[1].y);
    m = m * presence(a[2].y);
    m = m * presence(a[3].y);
    return m * presence(a[4].y);
}

fn masked(p: u32, joining: u32, a: array<vec2<f32>, 5>, b: vec2<f32>) -> vec2<f32> {
    let part = vec2<f32>(b.x, clamp01(b.y) * allowed(p, a));
    if joining == 0u {
        return add(KEEP, a[0], part);
    }
    return replace(KEEP, a[0], part);
}

fn enter_affine(p: u32, x: vec2<f32>) -> vec2<f32> {
    let row_x = parameters[p] * x.x + parameters[p + 1u] * x.y + parameters[p + 4u];
    let row_y = parameters[p + 2u] * x.x + parameters[p + 3u] * x.y + parameters[p + 5u];
    return vec2<f32>(row_x, row_y);
}

fn enter_warp(p: u32, controls: u32, x: vec2<f32>) -> vec2<f32> {
    var sum = vec2<f32>(0.0);
    for (var i = 0u; i < controls; i++) {
        let c = p + 2u + 5u * i;
        let d = x - pair(c);
        sum += wyvill((d.x * d.x + d.y * d.y) * parameters[c + 2u]) * pair(c + 3u);
    }
    return x + sum;
}
