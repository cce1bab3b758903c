//! What is stored: elevations and the parameters of their detail, against meshes and rasters that hold as much.

use super::scenes::{looking, mountain};
use crate::experiment::{Context, Expected, Experiment, ExperimentError};
use crate::report::{Axis, Cell, Outcome, Plot, Style, Table};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use terrain_gpu::tessellate::device::displace::parameter_bytes;
use terrain_gpu::tessellate::displace::{Detail, Space};
use terrain_gpu::tessellate::ground::Ground;
use terrain_gpu::tessellate::refine::Refinement;
use terrain_gpu::tessellate::surface::Surface;
use terrain_gpu::tessellate::triangle::{FINEST, LATTICE, SIDE, Triangle, Vertex};
use terrain_model::io::write_mesh;
use terrain_model::mesh::Mesh;
use terrain_model::noise::{Octaves, mix};
use terrain_papers::verdicts::Verdict;

/// See the module.
pub const EXPERIMENT: Experiment = Experiment {
    id: "tessellation/storage",
    title: "What detail costs in storage",
    section: "§7: without any storage overhead",
    about: "Stored are the raster's elevations and what the kernel reads of the detail, counted from its buffers. Against it stand a mesh of \
            the whole domain whose edges are a quarter of the last octave's wave, positions and indices of four bytes a number, a \
            raster of as many elevations, and the triangles that a flight shows. That the mesh holds as much is measured: its distance \
            from the displaced surface at random places, in root mean squares of the last octave. Controls: a mesh four times as \
            coarse, which loses the octave, and octaves with another lacunarity, of which meshes do not grow fourfold.",
    code: "experiments/src/tessellation/storage.rs",
    test: "experiments/src/tessellation/storage.rs::a_mesh_has_the_vertices_and_triangles_that_are_counted",
    expected: |profile| Expected {
        seconds: profile.pick(5.0, 120.0),
        memory_bytes: profile.pick(512 << 20, 8 << 30),
        disk_bytes: profile.pick(4 << 20, 32 << 20),
    },
    run,
};

/// Octaves at most.
const OCTAVES: u32 = 12;
/// Bytes of a position, and of a triangle's three indices.
const BYTES: [f64; 2] = [12.0, 12.0];

/// Bisections of the domain after which legs of triangles are at most `length` metres, an even number; none finer than the grid.
fn level(ground: &Ground, length: f64) -> u32 {
    let side = ground.sides().into_iter().fold(0.0, f64::max);
    2 * (libm::ceil(libm::log2(side / length)).max(0.0) as u32).min((FINEST + LATTICE) / 2)
}

/// Vertices and triangles of a square that was bisected so often, an even number.
fn counts(level: u32) -> [f64; 2] {
    let along = libm::exp2(f64::from(level / 2));
    [(along + 1.0) * (along + 1.0), 2.0 * along * along]
}

fn bytes([vertices, triangles]: [f64; 2]) -> f64 {
    BYTES[0] * vertices + BYTES[1] * triangles
}

fn with_octaves(ground: &Ground, octaves: u32, lacunarity: f64) -> Result<(Detail, Octaves), ExperimentError> {
    let spacing = ground.spacing()[0];
    let amplitude = if octaves == 0 { 0.0 } else { 3.0 * spacing };
    let shape = Octaves { octaves: octaves.max(1), frequency: 0.5 / spacing, lacunarity, gain: 0.5, amplitude };
    let mut detail = Detail::new(&shape, 3, Space::Volume).ok_or_else(|| ExperimentError::failed("octaves"))?;
    (detail.floor, detail.elevation) = ([0.3, 0.5], ground.range());
    Ok((detail, shape))
}

/// Root mean square distance along z and the plane, metres, of a mesh of all triangles of a level from the displaced surface, and of the
/// surface without its last octave from it.
fn distances(ground: &Ground, [detail, less]: [&Detail; 2], level: u32, seed: u64, places: u32) -> [f64; 2] {
    let squares = |k: u32| {
        let random =
            |axis: u32| ((f64::from(mix(mix(seed as u32, k), axis)) / 4_294_967_296.0) * f64::from(SIDE)) as u32;
        let vertex: Vertex = [random(0), random(1)];
        let root = Triangle::ROOTS[usize::from(vertex[0] + vertex[1] > SIDE)];
        let triangle = root.down_to(vertex, level);
        let (shares, corners) = (triangle.shares(vertex), triangle.corners().map(|c| detail.position(ground, c, 0.0)));
        let here = detail.position(ground, vertex, 0.0);
        let without = less.position(ground, vertex, 0.0);
        let square = |p: [f64; 3]| (0..3).map(|axis| (p[axis] - here[axis]) * (p[axis] - here[axis])).sum::<f64>();
        let mean = [0, 1, 2].map(|axis| (0..3).map(|i| shares[i] * corners[i][axis]).sum());
        [square(mean), square(without)]
    };
    let all: Vec<[f64; 2]> = (0..places).into_par_iter().map(squares).collect();
    [0, 1].map(|k| (all.iter().map(|pair| pair[k]).sum::<f64>() / f64::from(places)).sqrt())
}

/// The same octaves without the last; the others keep their share of the amplitude.
fn without_last(ground: &Ground, shape: &Octaves) -> Result<Detail, ExperimentError> {
    let sum = |octaves: u32| (0..octaves).map(|k| libm::pow(shape.gain, f64::from(k))).sum::<f64>();
    let octaves = shape.octaves - 1;
    let amplitude = shape.amplitude * sum(octaves) / sum(shape.octaves);
    let less = Octaves { octaves: octaves.max(1), amplitude, ..*shape };
    let mut detail = Detail::new(&less, 3, Space::Volume).ok_or_else(|| ExperimentError::failed("octaves"))?;
    (detail.floor, detail.elevation) = ([0.3, 0.5], ground.range());
    Ok(detail)
}

fn run(ctx: &Context) -> Result<Outcome, ExperimentError> {
    let ground = Ground::new(&mountain(ctx.profile.pick(65, 129))?, 0.6).map_err(ExperimentError::failed)?;
    let samples = ground.inside().map(|cells| cells as f64 + 1.0);
    let elevations = 4.0 * samples[0] * samples[1];
    let size = ctx.profile.pick([640, 360], [1920, 1080]);
    let (six, _) = with_octaves(&ground, 6, 2.0)?;
    let view = looking((&ground, &six), [0.325, 0.1875, 400.0], [0.5375, 0.525, 100.0], size)?;
    let mut outcome = Outcome::new(Verdict::Reproduced);
    let mut table = Table::new("octaves", "Bytes, by octaves")
        .column("octaves")
        .column("elevations and parameters")
        .column("a mesh that holds them")
        .column("a raster that does")
        .column("mesh over ours")
        .column("distance of the mesh, in last octaves")
        .column("of one four times as coarse");
    let (mut ours, mut meshes) = (Vec::new(), Vec::new());
    let (mut holds, mut loses) = (0.0f64, f64::INFINITY);
    let places = ctx.profile.pick(2000, 20_000);
    for octaves in 0..=OCTAVES {
        let (detail, shape) = with_octaves(&ground, octaves, 2.0)?;
        let refinement = Refinement::new(&ground, &detail, view, 8.0, FINEST);
        let parameters = parameter_bytes(&Surface::new(&refinement, [0; 2]));
        // No octave is none that is silent: its parameters are not counted.
        let [whole, each] = parameters.map(|bytes| bytes as f64);
        let stored = elevations + whole + if octaves == 0 { 0.0 } else { each };
        let wave = libm::pow(2.0, 1.0 - f64::from(octaves)) / shape.frequency;
        let length = if octaves == 0 { ground.spacing()[0] } else { wave / 4.0 };
        let level = level(&ground, length);
        let [vertices, triangles] = counts(level);
        let mesh = bytes([vertices, triangles]);
        let mut cells = vec![
            Cell::count(octaves.into()),
            Cell::number(stored, "B", 4),
            Cell::number(mesh, "B", 4),
            Cell::number(4.0 * vertices, "B", 4),
            Cell::number(mesh / stored, "", 3),
        ];
        if octaves == 0 {
            cells.extend([Cell::missing("no octave"), Cell::missing("no octave")]);
        } else {
            let less = without_last(&ground, &shape)?;
            let seed = ctx.seed_for("places");
            let [near, octave] = distances(&ground, [&detail, &less], level, seed, places);
            let [far, _] = distances(&ground, [&detail, &less], level - 4, seed, places);
            (holds, loses) = (holds.max(near / octave), loses.min(far / octave));
            cells.extend([Cell::number(near / octave, "", 3), Cell::number(far / octave, "", 3)]);
            ours.push((f64::from(octaves), stored));
            meshes.push((f64::from(octaves), mesh));
        }
        outcome.metric(&format!("octaves{octaves}.stored_bytes"), stored)?;
        outcome.metric(&format!("octaves{octaves}.mesh_bytes"), mesh)?;
        table.row(cells);
    }
    outcome.table(table)?;
    let growth = (meshes[11].1 / meshes[0].1, ours[11].1 - ours[0].1);
    outcome.metric("mesh_growth_per_octave", libm::pow(growth.0, 1.0 / 11.0))?;
    outcome.metric("bytes_per_octave", growth.1 / 11.0)?;
    outcome.metric("mesh_distance_in_octaves", holds)?;
    outcome.metric("control_distance_in_octaves", loses)?;
    outcome.plot(
        Plot::new("bytes", "Bytes by octaves", Axis::linear("octaves"), Axis::log("bytes"))
            .series("elevations and parameters", Style::LineAndPoints, ours)
            .series("mesh of the domain", Style::LineAndPoints, meshes),
    )?;
    let (shown, written) = flight(ctx, (&ground, &six), view, &mut outcome)?;
    outcome.attachment("view.glb", "What one camera sees at edges of 16 px, six octaves: positions, normals, indices");
    outcome.metric("view_glb_bytes", written)?;
    outcome.metric("flight_mesh_bytes", shown)?;
    let [six, half] = [2.0, 1.5].map(|lacunarity| {
        let waves = [1, 9].map(|k| libm::pow(lacunarity, f64::from(1 - k)) * 2.0 * ground.spacing()[0] / 4.0);
        let [first, last] = waves.map(|length| bytes(counts(level(&ground, length))));
        libm::pow(last / first, 1.0 / 8.0)
    });
    outcome.control(
        "a mesh four times as coarse",
        "its edges are a wave long",
        "it loses half the octave",
        loses > 0.5,
    );
    let fourfold = |growth: f64| (growth / 4.0 - 1.0).abs() < 0.05;
    outcome.control("another lacunarity", "1.5", "meshes do not grow fourfold", fourfold(six) && !fourfold(half));
    outcome.deviation("storage is claimed, not measured", "four bytes a number, nothing compressed");
    if holds > 0.5 || !fourfold(libm::pow(growth.0, 1.0 / 11.0)) || growth.1 / 11.0 > 64.0 {
        let why = format!("a mesh misses {holds} of an octave; {} bytes an octave", growth.1 / 11.0);
        outcome.set_verdict(Verdict::NotReproduced, why);
    }
    Ok(outcome)
}

/// Bytes of all triangles that a flight shows, each once; those of single frames go to a table, a mesh of the first is written.
fn flight(
    ctx: &Context,
    (ground, detail): (&Ground, &Detail),
    from: terrain_gpu::tessellate::view::View,
    outcome: &mut Outcome,
) -> Result<(f64, f64), ExperimentError> {
    let frames = ctx.profile.pick(6u32, 60);
    let (mut vertices, mut triangles) = (HashSet::<Vertex>::new(), HashSet::<[Vertex; 3]>::new());
    let mut table = Table::new("flight", "What a flight of 100 m a frame shows, edges of 16 px")
        .column("frames")
        .column("triangles of the last")
        .column("triangles of all, each once")
        .column("bytes");
    let mut written = 0.0;
    for frame in 0..frames {
        let mut view = from;
        let [x, y, _] = from.axes[2];
        let along = 100.0 * f64::from(frame) / (x * x + y * y).sqrt();
        (view.eye[0], view.eye[1]) = (from.eye[0] + along * x, from.eye[1] + along * y);
        let refinement = Refinement::new(ground, detail, view, 16.0, FINEST);
        let leaves = refinement.leaves(true);
        let all: Vec<[Vertex; 3]> =
            leaves.iter().flat_map(|leaf| leaf.lattice(LATTICE)).map(|triangle| triangle.corners()).collect();
        vertices.extend(all.iter().flatten());
        triangles.extend(&all);
        if frame == 0 {
            let mesh = mesh(&refinement, &all);
            ctx.write_with("view.glb", |path| write_mesh(path, &mesh))?;
            written = std::fs::metadata(ctx.out.join("view.glb")).map_err(ExperimentError::failed)?.len() as f64;
            // Normals are twelve more; the rest is a header.
            let counted = bytes([mesh.positions.len() as f64, mesh.triangles.len() as f64]);
            let normals = 12.0 * mesh.positions.len() as f64;
            outcome.metric("view_mesh_bytes", counted)?;
            if (written - counted - normals).abs() > 4096.0 {
                return Err(ExperimentError::failed(format!("the mesh has {written} bytes, {counted} are counted")));
            }
        }
        let so_far = bytes([vertices.len() as f64, triangles.len() as f64]);
        table.row([
            Cell::count(u64::from(frame) + 1),
            Cell::count(all.len() as u64),
            Cell::count(triangles.len() as u64),
            Cell::number(so_far, "B", 4),
        ]);
    }
    outcome.table(table)?;
    Ok((bytes([vertices.len() as f64, triangles.len() as f64]), written))
}

fn mesh(refinement: &Refinement<'_>, triangles: &[[Vertex; 3]]) -> Mesh {
    let (mut known, mut mesh, mut normals) = (HashMap::<Vertex, u32>::new(), Mesh::default(), Vec::new());
    for corners in triangles {
        let corners = corners.map(|vertex| {
            *known.entry(vertex).or_insert_with(|| {
                mesh.positions.push(refinement.position(vertex));
                normals.push(refinement.normal(vertex));
                mesh.positions.len() as u32 - 1
            })
        });
        mesh.triangles.push(corners);
    }
    mesh.normals = Some(normals);
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn a_mesh_has_the_vertices_and_triangles_that_are_counted() {
        for level in [0, 2, 6, 10] {
            let all: Vec<Triangle> = Triangle::ROOTS.iter().flat_map(|root| root.lattice(level)).collect();
            let vertices: HashSet<Vertex> = all.iter().flat_map(Triangle::corners).collect();
            assert_eq!(counts(level), [vertices.len() as f64, all.len() as f64]);
            // Control: two bisections more are another mesh.
            assert_ne!(counts(level + 2), counts(level));
        }
    }
}
