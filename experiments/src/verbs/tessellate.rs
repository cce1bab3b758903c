//! `terrain tessellate`: a raster seen from near, with detail made on the way: a picture, a flight, or the refined mesh.

use super::{Rectangle, SceneArguments, Size, VerbError, paged_ground, positive, print, progress, tree_ground};
use crate::tessellation::picture::{Look, Picture, Scene};
use clap::{Args, ValueEnum};
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use terrain_gpu::tessellate::displace::{Detail, Rule, Space};
use terrain_gpu::tessellate::ground::Ground;
use terrain_gpu::tessellate::refine::Refinement;
use terrain_gpu::tessellate::triangle::{FINEST, LATTICE, Triangle, Vertex};
use terrain_gpu::tessellate::view::View;
use terrain_model::grid::Grid;
use terrain_model::io::{read_grid, write_mesh, write_png_rgb8};
use terrain_model::mesh::Mesh;
use terrain_model::noise::Octaves;

/// Shows a raster (.tif, .asc, .hgt, .png, .raw, .exr) or a feature tree (.ron, builtin:NAME) from near: triangles are refined until their edges have the length asked for
/// on the screen, smoothed (Phong tessellation) and displaced by noise along the normal.
///
/// Nothing is stored of the detail. Written is a picture (.png), a flight of them, or the refined mesh (.glb, .ply, .obj). It is
/// computed on the processor; the same arguments give the same bytes.
#[derive(Args, Debug)]
pub struct Tessellate {
    /// The raster, elevations in metres, or a scene; a scene's ground is sampled, with a proved bound of what that misses
    input: PathBuf,
    /// Samples of a scene along its longer side
    #[arg(long, value_name = "N", default_value_t = 1025, value_parser = clap::value_parser!(u32).range(3..=16_385))]
    samples: u32,
    /// Reads a .raw or .r32 raster in pages and keeps so many megabytes of them, at least 16 [default: all of the raster]
    #[arg(long, value_name = "MEGABYTES", value_parser = clap::value_parser!(u32).range(16..=1_000_000), conflicts_with = "region")]
    resident: Option<u32>,
    /// South-west and north-east corners of a scene's part, metres [default: a box around all that has weight]
    #[arg(long, value_name = "X0,Y0,X1,Y1", allow_hyphen_values = true)]
    region: Option<Rectangle>,
    /// Eye and target, metres as in the raster; +Z is above the ground there [default: a view from the south-west]
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", allow_hyphen_values = true)]
    camera: Option<Placement>,
    /// Where a flight ends; --out is then numbered
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", allow_hyphen_values = true, requires = "camera")]
    to: Option<Placement>,
    /// Pictures of the flight
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    frames: u32,
    /// Angle of the picture from top to bottom, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 45.0, value_parser = angle)]
    field_of_view: f64,
    /// Pixels
    #[arg(long, value_name = "WxH", default_value = "960x540")]
    size: Size,
    /// Length of edges on the screen, pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 8.0, value_parser = positive)]
    edge_px: f64,
    /// Octaves of noise, 0 to 16; 0 for none
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(0..=16))]
    octaves: u32,
    /// Wavelength of the first octave, metres [default: two samples]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    wavelength: Option<f64>,
    /// The largest displacement, metres [default: two samples]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    amplitude: Option<f64>,
    /// Frequency of an octave over that of the one before
    #[arg(long, default_value_t = 2.0, value_parser = positive)]
    lacunarity: f64,
    /// Amplitude of an octave over that of the one before
    #[arg(long, default_value_t = 0.5, value_parser = positive)]
    gain: f64,
    /// Where noise is read
    #[arg(long, value_enum, default_value = "volume")]
    noise: Noise,
    /// Combines octaves as a multifractal with this offset instead of a sum; about 1
    #[arg(long, value_name = "OFFSET", value_parser = positive)]
    multifractal: Option<f64>,
    /// Phong tessellation: 0 flat triangles, 1 the smoothest
    #[arg(long, value_name = "0..1", default_value_t = 0.6)]
    phong: f64,
    /// Share of the amplitude that is left on level ground
    #[arg(long, value_name = "0..1", default_value_t = 0.3, value_parser = share)]
    flat: f64,
    /// Share of the amplitude that is left on the lowest ground
    #[arg(long, value_name = "0..1", default_value_t = 0.5, value_parser = share)]
    low: f64,
    /// Share of the amplitude that is left in sharp hollows [default: 1]
    #[arg(long, value_name = "0..1", value_parser = share)]
    hollow: Option<f64>,
    /// Elevation above which snow lies, metres [default: the upper third]
    #[arg(long, value_name = "METRES", allow_hyphen_values = true)]
    snow: Option<f64>,
    /// Tells this detail from others
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// The file to write; its extension is the format
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Where noise is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Noise {
    /// At x, y and z
    Volume,
    /// At x and y: it stretches on cliffs
    Plan,
}

/// Eye and target; a third coordinate may be above the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Placement {
    at: [f64; 6],
    above: [bool; 2],
}

impl FromStr for Placement {
    type Err = String;
    fn from_str(text: &str) -> Result<Placement, String> {
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        let numbers: Option<Vec<f64>> =
            parts.iter().map(|part| part.parse().ok().filter(|value: &f64| value.is_finite())).collect();
        let at = numbers.and_then(|numbers| <[f64; 6]>::try_from(numbers).ok());
        let at = at.ok_or("expected six numbers: eye x, y, z, target x, y, z, as in 500,200,+2,900,800,350")?;
        Ok(Placement { at, above: [2, 5].map(|k| parts[k].starts_with('+')) })
    }
}

fn share(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value| (0.0..=1.0).contains(value));
    value.ok_or_else(|| "expected a number from 0 to 1".to_owned())
}
fn angle(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value| (1.0..=150.0).contains(value));
    value.ok_or_else(|| "expected 1 to 150 degrees".to_owned())
}

/// What a run works on.
struct Work {
    ground: Ground,
    detail: Detail,
    /// The raster's south-west corner.
    origin: DVec2,
}

impl Tessellate {
    /// Runs the verb.
    ///
    /// # Errors
    /// [`VerbError`]: a raster that cannot be read or tessellated, a camera that looks straight down, or a file that cannot be
    /// written.
    pub fn run(&self) -> Result<(), VerbError> {
        let extension = self.out.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let picture = extension.as_deref() == Some("png");
        if !picture && !matches!(extension.as_deref(), Some("ply" | "obj" | "glb")) {
            let problem = format!("{}: expected .png for a picture, .glb, .ply or .obj for a mesh", self.out.display());
            return Err(VerbError::Other(problem));
        }
        if self.to.is_some() && !picture {
            let problem = format!("{}: a flight is written as .png pictures", self.out.display());
            return Err(VerbError::Other(problem));
        }
        let work = self.work()?;
        let view = self.looking(&work, placed(&work, self.camera.unwrap_or_else(|| overview(&work))))?;
        if !picture {
            return self.mesh(&work, view);
        }
        let Some(to) = self.to else {
            let drawn = self.draw(&work, view, &self.out)?;
            let share = 100.0 * drawn.background as f64 / (self.size.width * self.size.height) as f64;
            return print(&format!(
                "{}: {} triangles in {} leaves, sky in {share:.1} % of the picture{}",
                self.out.display(),
                drawn.triangles,
                drawn.leaves,
                paged_ground::told(&work.ground),
            ));
        };
        let from = self.camera.unwrap_or(to);
        let bar = progress(self.frames.into(), "pictures");
        let stem = self.out.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        // A flight that enters the ground is refused before its first picture.
        let [a, b] = [from, to].map(|placement| placed(&work, placement));
        let view = |frame: u32| {
            let t = f64::from(frame) / f64::from(self.frames - 1);
            self.looking(&work, std::array::from_fn(|k| a[k].lerp(b[k], t)))
        };
        let views: Vec<View> = (0..self.frames).map(view).collect::<Result<_, _>>()?;
        let mut most = 0;
        for (frame, view) in views.into_iter().enumerate() {
            let drawn = self.draw(&work, view, &self.out.with_file_name(format!("{stem}_{frame:05}.png")))?;
            most = most.max(drawn.triangles);
            bar.inc(1);
        }
        bar.finish_and_clear();
        let last = self.out.with_file_name(format!("{stem}_{:05}.png", self.frames - 1));
        print(&format!("{}: the last of {} pictures, {most} triangles at most", last.display(), self.frames))
    }

    fn work(&self) -> Result<Work, VerbError> {
        let named = |problem: &dyn std::fmt::Display| VerbError::Other(format!("{}: {problem}", self.input.display()));
        if let Some(megabytes) = self.resident {
            let (ground, origin) = paged_ground::open(&self.input, self.phong, megabytes)?;
            return self.detailed(ground, origin);
        }
        let text = self.input.to_string_lossy();
        let tree = text.starts_with("builtin:") || text.to_ascii_lowercase().ends_with(".ron");
        let grid: Grid<f64> = if tree {
            self.sampled(&text)?
        } else {
            read_grid(&self.input)?.map(None, |z| z.map_or(f64::NAN, f64::from))
        };
        let ground = Ground::new(&grid, self.phong).map_err(|error| named(&error))?;
        self.detailed(ground, grid.origin())
    }

    fn detailed(&self, ground: Ground, origin: DVec2) -> Result<Work, VerbError> {
        let spacing = ground.spacing().into_iter().fold(0.0, f64::max);
        let octaves = Octaves {
            octaves: self.octaves.max(1),
            frequency: 1.0 / self.wavelength.unwrap_or(2.0 * spacing),
            lacunarity: self.lacunarity,
            gain: self.gain,
            amplitude: if self.octaves == 0 { 0.0 } else { self.amplitude.unwrap_or(2.0 * spacing) },
        };
        let space = if self.noise == Noise::Volume { Space::Volume } else { Space::Plan };
        let detail = Detail::new(&octaves, self.seed, space);
        let mut detail = detail.ok_or_else(|| VerbError::Other("octaves: frequencies out of range".to_owned()))?;
        let [low, high] = ground.range();
        detail.rule = self.multifractal.map_or(Rule::Sum, |offset| Rule::Multifractal { offset });
        (detail.floor, detail.elevation) = ([self.flat, self.low], [low, high]);
        // Sharp is a hollow that a slope of 1 in 2 turns within a sample.
        detail.concavity = self.hollow.map(|floor| [floor, 0.5 / spacing]);
        Ok(Work { ground, detail, origin })
    }

    /// The ground of a scene, square samples as nearly as they fit.
    fn sampled(&self, scene: &str) -> Result<Grid<f64>, VerbError> {
        let arguments = SceneArguments { scene: scene.to_owned(), layer: None };
        let (_, program) = arguments.load()?;
        let (low, high) = match self.region {
            Some(region) => (region.low, region.high),
            None => arguments.support(&program)?,
        };
        let (side, steps) = (high - low, f64::from(self.samples - 1));
        let size = [side.x, side.y].map(|x| ((steps * x / side.max_element()).round() as usize).max(1) + 1);
        let none = || VerbError::Other(format!("{scene}: no sample lies on the terrain; choose another --region"));
        let made = tree_ground::sample(&program, low, high, size).ok_or_else(none)?;
        let [cells, samples] = [(size[0] - 1) * (size[1] - 1), size[0] * size[1]];
        let [proved, off] =
            [(cells - made.open, cells), (made.off, samples)].map(|(n, of)| 100.0 * n as f64 / of as f64);
        let missed = if made.open == cells {
            "no bound of what they miss is proved".to_owned()
        } else {
            format!("within {:.3} m of the tree, proved of {proved:.1} % of the cells", made.bound)
        };
        let [width, height] = size;
        print(&format!("{scene}: {width} × {height} samples, {missed}; {off:.1} % lie off the terrain"))?;
        Ok(made.grid)
    }

    fn looking(&self, work: &Work, [eye, target]: [DVec3; 2]) -> Result<View, VerbError> {
        let inside = work.ground.extent().into_iter().zip([eye.x, eye.y]).all(|(side, at)| (0.0..=side).contains(&at));
        let under = work.detail.elevation_over(&work.ground, [eye.x, eye.y]) - eye.z;
        if inside && under > 0.0 {
            let problem =
                format!("--camera: the eye is {under:.0} m below the ground; a z with + is above it, as in +20");
            return Err(VerbError::Other(problem));
        }
        let half = [self.size.width, self.size.height].map(|pixels| 0.5 * pixels as f64);
        let focal = half[1] / libm::tan(0.5 * self.field_of_view.to_radians());
        let view = View::new(eye.to_array(), (target - eye).to_array(), focal, half);
        view.ok_or_else(|| {
            VerbError::Other("--camera looks straight up or down, or nowhere: move the target aside".to_owned())
        })
    }

    fn draw(&self, work: &Work, view: View, out: &Path) -> Result<Picture, VerbError> {
        let mut look = Look::over(&work.ground);
        look.snow = self.snow.unwrap_or(look.snow);
        let refinement = Refinement::new(&work.ground, &work.detail, view, self.edge_px, FINEST);
        let scene = Scene { ground: &work.ground, detail: &work.detail, view, refinement, look };
        let picture = scene.picture([self.size.width, self.size.height]);
        paged_ground::sound(&self.input, &work.ground)?;
        write_png_rgb8(out, self.size.width, self.size.height, &picture.pixels)?;
        Ok(picture)
    }

    fn mesh(&self, work: &Work, view: View) -> Result<(), VerbError> {
        let refinement = Refinement::new(&work.ground, &work.detail, view, self.edge_px, FINEST);
        let leaves = refinement.leaves(false);
        let (mut known, mut mesh, mut normals) = (HashMap::<Vertex, u32>::new(), Mesh::default(), Vec::new());
        let drawn = |triangle: &Triangle| work.ground.holds(triangle);
        for triangle in leaves.iter().flat_map(|leaf| leaf.lattice(LATTICE)).filter(drawn) {
            let corners = triangle.corners().map(|vertex| {
                *known.entry(vertex).or_insert_with(|| {
                    let [x, y, z] = refinement.position(vertex);
                    mesh.positions.push([x + work.origin.x, y + work.origin.y, z]);
                    normals.push(refinement.normal(vertex));
                    mesh.positions.len() as u32 - 1
                })
            });
            mesh.triangles.push(corners);
        }
        mesh.normals = Some(normals);
        paged_ground::sound(&self.input, &work.ground)?;
        write_mesh(&self.out, &mesh)?;
        print(&format!(
            "{}: {} vertices, {} triangles in {} leaves",
            self.out.display(),
            mesh.positions.len(),
            mesh.triangles.len(),
            leaves.len(),
        ))
    }
}

/// Eye and target in metres from the south-west corner.
fn placed(work: &Work, Placement { at, above }: Placement) -> [DVec3; 2] {
    [0, 1].map(|k| {
        let p = DVec2::new(at[3 * k], at[3 * k + 1]) - work.origin;
        let ground = if above[k] { work.detail.elevation_over(&work.ground, p.to_array()) } else { 0.0 };
        p.extend(at[3 * k + 2] + ground)
    })
}

/// From the south-west, over the whole.
fn overview(work: &Work) -> Placement {
    let ([x, y], [low, high]) = (work.ground.extent(), work.ground.range());
    let DVec2 { x: x0, y: y0 } = work.origin;
    let eye = [x0 - 0.1 * x, y0 - 0.2 * y, high + 0.25 * x.max(y)];
    let target = [x0 + 0.42 * x, y0 + 0.42 * y, low];
    Placement { at: [eye[0], eye[1], eye[2], target[0], target[1], target[2]], above: [false; 2] }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn a_camera_is_six_numbers_and_a_plus_is_above_the_ground() {
        let read: Placement = "1,-2, +3.5,4,5,6".parse().unwrap();
        assert_eq!(read, Placement { at: [1.0, -2.0, 3.5, 4.0, 5.0, 6.0], above: [true, false] });
        for wrong in ["1,2,3", "1,2,3,4,5,x", "1,2,3,4,5,inf", ""] {
            assert!(wrong.parse::<Placement>().unwrap_err().starts_with("expected six numbers"), "{wrong}");
        }
    }
}
