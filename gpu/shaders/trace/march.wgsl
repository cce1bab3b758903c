// Sphere tracing over tiles: one ray an invocation, from tile to tile, for so many turns a dispatch. A turn looks at the
// terrain once or crosses into the next tile; a ray that is still underway goes on in the next dispatch from the state it
// left. Positions are relative to the centre of the tile; a tile that is left is entered by its neighbour at the border
// exactly. Twin of the steps: model/src/trace/sphere.rs.
//
// What is computed for a point of the ray is off the true point by at most `drift` where the tile is entered, and by
// `placed` within it, metres. With UNIT = 2⁻²⁴ and a unit direction: the rounded direction moves a point by UNIT·s, the
// product rounds by UNIT·s, the sum by UNIT·(|x| + |y| + |z|), and s itself is held to its spacing, 2·UNIT·s. Where a tile
// is left, the quotient may be off by 5 half units and its difference by one, so that the border is met within 8·UNIT·(s +
// width). f(x, y) differs from what the device computes by at most the tile's margin. h = z − f changes by at most 1 + λ per metre
// of place, so the true height is at least the computed one less `slack`: a step covers what is left of it.

struct Beam {
    // Where the tile was entered.
    position: vec3<f32>,
    drift: f32,
    direction: vec3<f32>,
    // √(x² + y²) of the direction, rounded up.
    across: f32,
    cell: vec2<i32>,
    // Metres from `position`.
    s: f32,
    kind: u32,
    // Evaluations so far.
    steps: u32,
    // 1 where the last look was off the domain.
    off: u32,
    // At a hit the true height is between −slack and the threshold plus slack, and the place along the ray within slack.
    slack: f32,
    // 0 where the driver ended a loop before its condition did: the state is then void.
    sound: u32,
}

struct Grid {
    columns: i32,
    rows: i32,
    // Half the width of a tile.
    half: f32,
    // A hit is a height below this, or below twice the slack.
    epsilon: f32,
    // The least step at the border of the domain.
    least: f32,
    // No h changes faster along a ray.
    steepest: f32,
    // Of the bound; 1 but in a control.
    share: f32,
    // Which bound a step is taken by.
    bound: u32,
    most_steps: u32,
    turns: u32,
    // 2: how often the last loop of all runs.
    twice: u32,
}

@group(0) @binding(4) var<storage, read> tiles: array<Tile>;
@group(0) @binding(5) var<storage, read> beams: array<Beam>;
@group(0) @binding(6) var<storage, read> grid: Grid;
@group(0) @binding(7) var<storage, read_write> results: array<Beam>;

const UNDERWAY: u32 = 0u;
const CLEAR: u32 = 1u;
const HIT: u32 = 2u;
const WALL: u32 = 3u;
const GAVE_UP: u32 = 4u;

const GLOBAL: u32 = 0u;
const TILE: u32 = 1u;

const UNIT: f32 = 5.9604645e-8;
// The quotients and sums of a step, and what rounds in the slack itself, are off by less than this share.
const DEFLATED: f32 = 0.99999;
const LONGEST: f32 = 1e9;

// Metres to the border of the tile along one axis.
fn exit(p: f32, u: f32) -> f32 {
    if u == 0.0 {
        return LONGEST;
    }
    return max((select(-grid.half, grid.half, u > 0.0) - p) / u, 0.0);
}

fn over(a: f32, b: f32) -> f32 {
    return select(LONGEST, DEFLATED * a / b, b > 0.0);
}

// −h′ along the ray is at most this in the tile. What the products and sums round by is below 4·UNIT of the largest.
fn descent(tile: Tile, beam: Beam) -> f32 {
    if grid.bound == GLOBAL {
        return grid.steepest;
    }
    let u = beam.direction;
    let by_length = beam.across * tile.slope;
    if grid.bound == TILE {
        return by_length - u.z;
    }
    let rise = max(u.xy * tile.least_gradient, u.xy * tile.greatest_gradient);
    return min(by_length, rise.x + rise.y + 4.0 * UNIT * by_length) - u.z;
}

fn crossed(before: Beam, to: vec2<f32>) -> Beam {
    var now = before;
    let u = now.direction;
    let end = min(to.x, to.y);
    now.drift += 1.001 * UNIT * (12.0 * end + 18.0 * grid.half + abs(now.position.z));
    now.position += u * end;
    now.s = 0.0;
    if to.x <= to.y {
        now.cell.x += select(-1, 1, u.x > 0.0);
        now.position.x = select(grid.half, -grid.half, u.x > 0.0);
    } else {
        now.cell.y += select(-1, 1, u.y > 0.0);
        now.position.y = select(grid.half, -grid.half, u.y > 0.0);
    }
    return now;
}

fn march(before: Beam) -> Beam {
    var now = before;
    let u = now.direction;
    for (var turn = 0u; turn < grid.turns && now.kind == UNDERWAY; turn += 1u) {
        if now.cell.x < 0 || now.cell.y < 0 || now.cell.x >= grid.columns || now.cell.y >= grid.rows {
            now.kind = CLEAR;
            continue;
        }
        let tile = tiles[now.cell.y * grid.columns + now.cell.x];
        let p = now.position;
        let to = vec2<f32>(exit(p.x, u.x), exit(p.y, u.y));
        let end = min(to.x, to.y);
        let rounding = UNIT * (2.0 * grid.half + abs(p.z));
        let top = tile.highest + now.drift + rounding + 5.0 * UNIT * end;
        let z = p.z + u.z * now.s;
        if tile.start < tile.end && z > top {
            // Above all of its ground: to the top of it, or across where the ray climbs.
            now.s = min(now.s + over(z - top, -u.z), LONGEST);
        }
        if tile.start == tile.end || now.s >= end {
            if end >= LONGEST {
                now.kind = CLEAR;
                continue;
            }
            now.off = select(now.off, 1u, tile.start == tile.end);
            now = crossed(now, to);
            continue;
        }
        if now.steps >= grid.most_steps {
            now.kind = GAVE_UP;
            continue;
        }
        let q = p + u * now.s;
        let found = run(tile.start, tile.end, q.xy);
        now.steps += 1u;
        let off_by = now.drift + rounding + 5.0 * UNIT * now.s;
        let slack = tile.margin + (1.0 + tile.slope) * off_by;
        let border = T - tile.weight_margin - tile.weight_slope * off_by;
        let thinning = now.across * tile.weight_slope;
        var step = 0.0;
        if tile.inside == 0u && found.y < border {
            step = max(over(border - found.y, thinning), grid.least);
            now.off = 1u;
        } else {
            let h = q.z - found.x;
            if h <= max(grid.epsilon, 2.0 * slack) {
                now.kind = select(HIT, WALL, now.off == 1u && h <= 0.0);
                now.slack = slack;
                continue;
            }
            step = over(h - slack, grid.share * descent(tile, now));
            if tile.inside == 0u {
                step = min(step, max(over(found.y - (T + T - border), thinning), grid.least));
            }
            now.off = 0u;
        }
        now.s = max(now.s + step, bitcast<f32>(bitcast<u32>(now.s) + 1u));
    }
    return now;
}

@compute @workgroup_size(64)
fn trace(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&beams) {
        var after = march(beams[id.x]);
        after.sound = u32(whole(grid.twice));
        results[id.x] = after;
    }
}
