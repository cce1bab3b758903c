// Elevation, weight and mean gradient at points of tiles: what shading asks for where rays have met the ground.

struct Look {
    // Relative to the tile's centre: the point, and the ends of the lines west to east and south to north through it.
    at: vec2<f32>,
    low: vec2<f32>,
    high: vec2<f32>,
    tile: u32,
    // 2: see `whole`.
    twice: u32,
}

@group(0) @binding(4) var<storage, read> tiles: array<Tile>;
@group(0) @binding(5) var<storage, read> looks: array<Look>;
@group(0) @binding(6) var<storage, read_write> results: array<vec4<f32>>;

// Of two ends of a line: the difference of elevations over that of places. An end off the domain is the point itself.
fn slope(low: f32, high: f32, below: f32, above: f32) -> f32 {
    if high > low {
        return (above - below) / (high - low);
    }
    return 0.0;
}

fn seen(look: Look) -> vec4<f32> {
    let tile = tiles[look.tile];
    var places = array<vec2<f32>, 5>(
        look.at,
        vec2<f32>(look.low.x, look.at.y),
        vec2<f32>(look.high.x, look.at.y),
        vec2<f32>(look.at.x, look.low.y),
        vec2<f32>(look.at.x, look.high.y),
    );
    var found: array<vec2<f32>, 5>;
    for (var k = 0u; k < 5u; k += 1u) {
        found[k] = run(tile.start, tile.end, places[k]);
        if k > 0u && found[k].y < T {
            places[k] = places[0];
            found[k] = found[0];
        }
    }
    let x = slope(places[1].x, places[2].x, found[1].x, found[2].x);
    let y = slope(places[3].y, places[4].y, found[3].x, found[4].x);
    return vec4<f32>(found[0], x, y);
}

@compute @workgroup_size(64)
fn ground(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&looks) {
        let look = looks[id.x];
        let answer = seen(look);
        // A weight below 0 says that the answer is void.
        results[id.x] = select(vec4<f32>(-1.0), answer, whole(look.twice));
    }
}
