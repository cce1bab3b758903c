// What is known of one tile. Layout: gpu/src/trace/tiles.rs.
struct Tile {
    // Which words of `code` are its program; nothing stands on it where there are none.
    start: u32,
    end: u32,
    // λ of f, and of the weight, where the weight is at least T.
    slope: f32,
    weight_slope: f32,
    // No ground is higher.
    highest: f32,
    // 1 where the weight is at least T everywhere.
    inside: u32,
    // How far the device's elevation and weight may be off.
    margin: f32,
    weight_margin: f32,
    // Of ∂f/∂x and ∂f/∂y, where the weight is at least T.
    least_gradient: vec2<f32>,
    greatest_gradient: vec2<f32>,
}
