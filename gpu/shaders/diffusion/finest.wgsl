// The finest operator, as terrain_diffusion::solver::equations states it: differences to the neighbours that exist, which vanish on
// constants. It stands before a kernel that declares `x`, the values it is applied to.

struct Size {
    width: u32,
    height: u32,
    // What the kernel makes of it.
    first: u32,
    second: u32,
}

@group(0) @binding(0) var<uniform> size: Size;
// 0 a plain node, 1 a given one, k + 2 the k-th of the others.
@group(0) @binding(1) var<storage, read> kinds: array<u32>;
// For each of the others: south, west, east, north, the node itself, and 1 / its coefficient.
@group(0) @binding(2) var<storage, read> sides: array<f32>;
// For each of the others: south-west, south-east, north-west, north-east; nothing where none has any.
@group(0) @binding(3) var<storage, read> corners: array<f32>;

// Where a neighbour is missing the node itself stands in: the difference is 0.
fn neighbour(i: u32, j: u32, east: i32, north: i32) -> f32 {
    let p = i32(i) + east;
    let q = i32(j) + north;
    let inside = p >= 0 && q >= 0 && p < i32(size.width) && q < i32(size.height);
    return x[select(j * size.width + i, u32(q) * size.width + u32(p), inside)];
}

// A·x.
fn product(i: u32, j: u32) -> f32 {
    let kind = kinds[j * size.width + i];
    if kind == 1u {
        return 0.0;
    }
    let own = x[j * size.width + i];
    let south = own - neighbour(i, j, 0, -1);
    let west = own - neighbour(i, j, -1, 0);
    let east = own - neighbour(i, j, 1, 0);
    let north = own - neighbour(i, j, 0, 1);
    if kind == 0u {
        return (west + east) + (south + north);
    }
    let w = 6u * (kind - 2u);
    let total = ((sides[w + 1u] * west + sides[w + 2u] * east) + (sides[w] * south + sides[w + 3u] * north)) + sides[w + 4u] * own;
    if arrayLength(&corners) < 4u {
        return total;
    }
    let c = 4u * (kind - 2u);
    let across = (corners[c] * (own - neighbour(i, j, -1, -1)) + corners[c + 1u] * (own - neighbour(i, j, 1, -1)))
        + (corners[c + 2u] * (own - neighbour(i, j, -1, 1)) + corners[c + 3u] * (own - neighbour(i, j, 1, 1)));
    return total + across;
}

// 1 / the coefficient of the node itself; 0 where the value is given.
fn inverse(i: u32, j: u32) -> f32 {
    let kind = kinds[j * size.width + i];
    if kind == 1u {
        return 0.0;
    }
    if kind > 1u {
        return sides[6u * (kind - 2u) + 5u];
    }
    let count = u32(i > 0u) + u32(i + 1u < size.width) + u32(j > 0u) + u32(j + 1u < size.height);
    return 1.0 / f32(max(count, 1u));
}
