// The stack machine: elevation and weight at a point of a tile. Twin: model/src/program/run.rs. Opcodes and STACK, FRAMES
// stand before this text. A blend is summed as its operands arrive, in their order, so that the stack is as deep as the
// tree and no deeper.

// Each instruction is its opcode with its length in words above bit 16, then its fields.
@group(0) @binding(0) var<storage, read> code: array<u32>;
@group(0) @binding(1) var<storage, read> parameters: array<f32>;
@group(0) @binding(2) var<storage, read> octaves: array<Octave>;
// Each raster is its width, its height and its samples, f32 as bits.
@group(0) @binding(3) var<storage, read> images: array<u32>;

// The program in code[start..end] at x, metres from its tile's origin: elevation and weight. Where the weight is 0 the
// elevation means nothing.
fn run(start: u32, end: u32, x: vec2<f32>) -> vec2<f32> {
    var stack: array<vec2<f32>, STACK>;
    var frames: array<vec2<f32>, FRAMES>;
    var top = 0u;
    var frame = 0u;
    var here = x;
    frames[0] = x;
    var pc = start;
    while pc < end {
        let length = code[pc] >> 16u;
        let k = pc + 1u;
        switch code[pc] & 0xffffu {
            case DISC: {
                stack[top] = disc(k, length - 1u, here);
                top += 1u;
            }
            case DETAIL_DISC: {
                stack[top] = detail_disc(k, here);
                top += 1u;
            }
            case CURVE: {
                stack[top] = curve(k, here);
                top += 1u;
            }
            case CONTOUR: {
                stack[top] = contour(k, here);
                top += 1u;
            }
            case IMAGE: {
                stack[top] = image(k, length - 1u, here);
                top += 1u;
            }
            case QUAD, STRIP: {
                stack[top] = chain(k, length - 1u, here);
                top += 1u;
            }
            case BEGIN_BLEND: {
                stack[top] = vec2<f32>(0.0);
                top += 1u;
            }
            case ACCUMULATE: {
                let part = stack[top - 1u];
                let sums = stack[top - 2u];
                stack[top - 2u] = vec2<f32>(sums.x + part.y * part.x, sums.y + part.y);
                top -= 1u;
            }
            case BLEND: {
                stack[top - 1u] = mean_of(stack[top - 1u]);
            }
            case REPLACE: {
                stack[top - 2u] = replace(code[k + 1u], stack[top - 2u], stack[top - 1u]);
                top -= 1u;
            }
            case ADD: {
                stack[top - 2u] = add(code[k + 1u], stack[top - 2u], stack[top - 1u]);
                top -= 1u;
            }
            case LOD: {
                stack[top - 2u] = lod(code[k], code[k + 1u] == 1u, here, stack[top - 2u], stack[top - 1u]);
                top -= 1u;
            }
            case MASKED: {
                let f = top - 6u;
                let a = array<vec2<f32>, 5>(stack[f], stack[f + 1u], stack[f + 2u], stack[f + 3u], stack[f + 4u]);
                stack[f] = masked(code[k], code[k + 1u], a, stack[f + 5u]);
                top = f + 1u;
            }
            case ENTER_AFFINE: {
                here = enter_affine(code[k], here);
                frame += 1u;
                frames[frame] = here;
            }
            case ENTER_WARP: {
                here = enter_warp(code[k], code[k + 1u], here);
                frame += 1u;
                frames[frame] = here;
            }
            case LEAVE_AFFINE: {
                let p = code[k];
                stack[top - 1u].x = stack[top - 1u].x * parameters[p + 6u] + parameters[p + 7u];
                frame -= 1u;
                here = frames[frame];
            }
            case LEAVE_WARP: {
                frame -= 1u;
                here = frames[frame];
            }
            default: {
                // Never encoded.
            }
        }
        pc += length;
    }
    return stack[0];
}

// Whether every loop of this invocation ran until its condition ended it. A driver may hold all of them together to a number
// of iterations (Mesa's processor to 65,535) and leave them silently from then on: a loop that still runs `often` shows that
// none before it was cut. The count is data, so that no compiler knows how often the loop runs.
fn whole(often: u32) -> bool {
    var ran = 0u;
    while ran < often {
        ran += 1u;
    }
    return ran == often;
}
