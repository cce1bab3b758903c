// An operator below the finest: nine coefficients a node, as terrain_diffusion::solver::hierarchy lays them out. It stands before a
// kernel that declares `x`, the values it is applied to.

struct Size {
    width: u32,
    height: u32,
    // What the kernel makes of it.
    first: u32,
    second: u32,
}

@group(0) @binding(0) var<uniform> size: Size;
// For each row nine arrays, from the neighbour to the south-west, row by row.
@group(0) @binding(1) var<storage, read> coefficients: array<f32>;
// 1 / the coefficient of the node itself; 0 where the value is given.
@group(0) @binding(2) var<storage, read> inverses: array<f32>;

// A line of three coefficients times the row of x that is `north` of row j; those that point out of the raster are 0.
fn line(i: u32, j: u32, north: i32) -> f32 {
    let q = i32(j) + north;
    if q < 0 || q >= i32(size.height) {
        return 0.0;
    }
    let at = (9u * j + 3u * u32(north + 1)) * size.width + i;
    let row = u32(q) * size.width + i;
    let west = select(0.0, x[row - min(i, 1u)], i > 0u);
    let east = select(0.0, x[row + u32(i + 1u < size.width)], i + 1u < size.width);
    return coefficients[at] * west + coefficients[at + size.width] * x[row] + coefficients[at + 2u * size.width] * east;
}

// A·x.
fn product(i: u32, j: u32) -> f32 {
    return line(i, j, -1) + line(i, j, 0) + line(i, j, 1);
}

fn inverse(i: u32, j: u32) -> f32 {
    return inverses[j * size.width + i];
}
