// Between two levels, one thread: what was written is read next, and the arguments of what follows are made. What did not
// fit is counted, so that the host can tell.

const ACROSS: u32 = 65535u;

struct Capacities {
    lists: u32,
    leaves: u32,
    // Vertices that a leaf is drawn with: three for each triangle of its lattice.
    drawn: u32,
}

struct Counters {
    read: u32,
    write: u32,
    leaves: u32,
    most: u32,
}

struct Arguments {
    // Workgroups of the next level; of a kernel with one workgroup of 64 for each four leaves; of an indexed draw.
    level: vec3<u32>,
    four: vec3<u32>,
    draw: array<u32, 5>,
}

@group(0) @binding(0) var<storage, read> capacities: Capacities;
@group(0) @binding(1) var<storage, read_write> counters: Counters;
@group(0) @binding(2) var<storage, read_write> arguments: Arguments;

fn groups(count: u32, each: u32) -> vec3<u32> {
    let all = (count + each - 1u) / each;
    let across = min(all, ACROSS);
    return vec3<u32>(across, (all + max(across, 1u) - 1u) / max(across, 1u), 1u);
}

@compute @workgroup_size(1)
fn advance() {
    let read = min(counters.write, capacities.lists);
    let leaves = min(counters.leaves, capacities.leaves);
    counters.most = max(counters.most, counters.write);
    counters.read = read;
    counters.write = 0u;
    arguments.level = groups(read, 64u);
    arguments.four = groups(leaves, 4u);
    arguments.draw = array<u32, 5>(capacities.drawn, leaves, 0u, 0u, 0u);
}
