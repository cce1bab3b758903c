// The leaves, each as the file of its name under model/src/primitive computes it. `k` is the index of the instruction's
// first field; an operand is elevation and weight.

fn disc_weight(p: u32, x: vec2<f32>) -> f32 {
    let d = x - pair(p);
    return parameters[p + 3u] * wyvill((d.x * d.x + d.y * d.y) * parameters[p + 2u]);
}

fn disc(k: u32, length: u32, x: vec2<f32>) -> vec2<f32> {
    let p = code[k];
    let weight = disc_weight(p, x);
    var elevation = parameters[p + 4u];
    if length > 1u && weight > 0.0 {
        let a = bitcast<f32>(code[k + 4u]);
        let b = bitcast<f32>(code[k + 5u]);
        elevation += combined(code[k + 3u], code[k + 1u], code[k + 2u], a, b, x);
    }
    return vec2<f32>(elevation, weight);
}

fn detail_disc(k: u32, x: vec2<f32>) -> vec2<f32> {
    let p = code[k];
    let first = code[k + 1u];
    let count = code[k + 2u];
    let weight = disc_weight(p, x);
    var elevation = parameters[p + 4u];
    if count > 0u && weight > 0.0 {
        let near = kappa(p + 5u, x);
        var sum = 0.0;
        for (var i = 0u; i < count; i++) {
            let filter_at = p + 9u + 2u * i;
            let t = clamp01((near - parameters[filter_at]) * parameters[filter_at + 1u]);
            let b = 1.0 - wyvill(t * t);
            if b > 0.0 {
                let eta = noise(octaves[first + i], x);
                sum += octaves[first + i].amplitude * b * select(eta, abs(eta), code[k + 3u] == 1u);
            }
        }
        elevation += sum;
    }
    return vec2<f32>(elevation, weight);
}
