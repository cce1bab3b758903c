// A copy: what the device moves when it does nothing else.

@group(0) @binding(0) var<storage, read> from_here: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read_write> to_there: array<vec4<u32>>;

@compute @workgroup_size(256)
fn stream(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&to_there) {
        to_there[id.x] = from_here[id.x];
    }
}
