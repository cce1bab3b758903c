//! The text form of a construction tree, RON, format `terrain-volume/1`. Lengths are metres, angles degrees counter-clockwise
//! seen from above, z up.

use super::super::heightfield::Implicitisation;
use super::super::index::Index;
use super::super::primitive::Primitive;
use super::super::sigmoid::Sigmoid;
use super::super::spine::{Noise, Spine};
use super::super::surface::Distance;
use super::{Erosion, Instance, Placement, Volume, Warp};
use crate::brush::Stroke;
use crate::geology::{self, Geology};
use glam::{DVec2, DVec3};
use ron::extensions::Extensions;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use terrain_model::grid::Grid;

/// What a file says it is.
pub const FORMAT: &str = "terrain-volume/1";

const EXTENSIONS: Extensions = Extensions::IMPLICIT_SOME.union(Extensions::UNWRAP_VARIANT_NEWTYPES);

/// A file that is no volume.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VolumeError {
    /// Not RON, or not of this shape.
    #[error("line {line}, column {column}: {problem}")]
    Syntax {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// What was expected.
        problem: String,
    },
    /// A node that cannot be built.
    #[error("{place}: {problem}")]
    Node {
        /// Path in the tree.
        place: String,
        /// What is wrong, and what was expected.
        problem: String,
    },
}

/// A construction tree as it is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Node {
    /// A raster made a volume.
    Ground {
        /// The raster, relative to the file.
        file: String,
        /// R.
        radius: f64,
        /// Elevation of the floor; 2R below the lowest sample when absent.
        #[serde(default)]
        floor: Option<f64>,
        /// Which distance to the surface.
        #[serde(default)]
        distance: Distance,
        /// σ.
        #[serde(default)]
        sigmoid: Sigmoid,
        /// Closed rings of corners that bound the domain Ω; the raster's rectangle when there are none.
        #[serde(default)]
        outline: Vec<Vec<(f64, f64)>>,
    },
    /// Compact primitives, summed.
    Primitives(Vec<Primitive>),
    /// Brush strokes, summed.
    Strokes(Vec<Stroke>),
    /// A point or a curve.
    Spine {
        /// Corners of the skeleton, or points that a curve passes.
        points: Vec<(f64, f64, f64)>,
        /// Makes a smooth curve of the points, flattened to this tolerance.
        #[serde(default)]
        smooth: Option<f64>,
        /// Of the falloff.
        radius: f64,
        /// Negative carves.
        energy: f64,
        /// Perturbs the distance.
        #[serde(default)]
        noise: Option<Noise>,
    },
    /// The sum.
    Blend(Vec<Node>),
    /// The largest.
    Union(Vec<Node>),
    /// The smallest.
    Intersection(Vec<Node>),
    /// The first without the second.
    Carve {
        /// What is carved.
        from: Box<Node>,
        /// What is taken away.
        by: Box<Node>,
    },
    /// Space displaced by turbulence within a region.
    Warp {
        /// What is warped.
        child: Box<Node>,
        /// Where, and how much of it: a field of up to 1.
        region: Box<Node>,
        /// The longest displacement.
        amplitude: f64,
        /// Of the first octave.
        wavelength: f64,
        /// How many, 1 to 16.
        octaves: u32,
        /// Tells this noise from others.
        #[serde(default)]
        seed: u32,
    },
    /// Rock taken away by its weakness within a region.
    Erosion {
        /// What is eroded.
        child: Box<Node>,
        /// Where, and how much: a field of up to 1.
        region: Box<Node>,
        /// The resistance of the rock.
        geology: geology::Node,
        /// Of the geology's noises.
        #[serde(default)]
        seed: u32,
    },
    /// Copies of one tree, summed; it is stored once.
    Instances {
        /// What is copied.
        child: Box<Node>,
        /// Where: position, angle, scale.
        at: Vec<(f64, f64, f64, f64, f64)>,
    },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    volume: Node,
}

/// Reads a tree from its text.
///
/// # Errors
/// [`VolumeError`] with line and column, or the place in the tree.
pub fn parse(text: &str) -> Result<Node, VolumeError> {
    let options = ron::Options::default().with_default_extension(EXTENSIONS);
    let file: File = options.from_str(text).map_err(|error| VolumeError::Syntax {
        line: error.span.start.line,
        column: error.span.start.col,
        problem: error.code.to_string(),
    })?;
    if file.format != FORMAT {
        let problem = format!("expected \"{FORMAT}\", found {:?}", file.format);
        return Err(VolumeError::Node { place: "format".to_owned(), problem });
    }
    Ok(file.volume)
}

/// Reads rasters by the names that a file gives them.
pub type Rasters<'a> = dyn FnMut(&str) -> Result<Grid<f32>, String> + 'a;

impl Node {
    /// Builds the volume; `rasters` reads grounds.
    ///
    /// # Errors
    /// [`VolumeError::Node`] with the place in the tree.
    pub fn build(&self, rasters: &mut Rasters<'_>) -> Result<Volume, VolumeError> {
        self.at("volume", rasters)
    }

    fn at(&self, place: &str, rasters: &mut Rasters<'_>) -> Result<Volume, VolumeError> {
        let fail = |problem: String| VolumeError::Node { place: place.to_owned(), problem };
        let mut all = |name: &str, parts: &[Node]| -> Result<Vec<Volume>, VolumeError> {
            parts.iter().enumerate().map(|(k, part)| part.at(&format!("{place}.{name}[{k}]"), rasters)).collect()
        };
        Ok(match self {
            Node::Ground { file, radius, floor, distance, sigmoid, outline } => {
                let grid = rasters(file).map_err(fail)?;
                let made = Implicitisation::of(&grid, *radius);
                let settings = Implicitisation {
                    sigmoid: *sigmoid,
                    distance: *distance,
                    floor: floor.unwrap_or(made.floor),
                    ..made
                };
                let rings: Vec<Vec<DVec2>> =
                    outline.iter().map(|ring| ring.iter().map(|&(x, y)| DVec2::new(x, y)).collect()).collect();
                let made = if rings.is_empty() { settings.volume(&grid) } else { settings.volume_over(&grid, &rings) };
                made.map_err(|error| fail(format!("{file}: {error}")))?
            }
            Node::Primitives(primitives) => index(primitives.clone(), fail)?,
            Node::Strokes(strokes) => {
                let mut made = Vec::new();
                for (k, stroke) in strokes.iter().enumerate() {
                    made.extend(stroke.primitives().map_err(|error| fail(format!("stroke {k}: {error}")))?);
                }
                index(made, fail)?
            }
            Node::Spine { points, smooth, radius, energy, noise } => {
                let points: Vec<DVec3> = points.iter().map(|&(x, y, z)| DVec3::new(x, y, z)).collect();
                let spine = match smooth {
                    Some(tolerance) => Spine::curve(&points, *tolerance, *radius, *energy, *noise),
                    None => Spine::new(points, *radius, *energy, *noise),
                };
                Volume::Spine(Arc::new(spine.map_err(|error| fail(error.to_string()))?))
            }
            Node::Blend(parts) => Volume::Blend(all("blend", parts)?),
            Node::Union(parts) => Volume::Union(all("union", parts)?),
            Node::Intersection(parts) => Volume::Intersection(all("intersection", parts)?),
            Node::Carve { from, by } => {
                let from = from.at(&format!("{place}.carve.from"), rasters)?;
                from.carve(by.at(&format!("{place}.carve.by"), rasters)?)
            }
            Node::Warp { child, region, amplitude, wavelength, octaves, seed } => {
                let child = child.at(&format!("{place}.warp.child"), rasters)?;
                let region = region.at(&format!("{place}.warp.region"), rasters)?;
                let warp = Warp::new(child, region, *amplitude, *wavelength, *octaves, *seed).map_err(fail)?;
                Volume::Warp(Arc::new(warp))
            }
            Node::Erosion { child, region, geology, seed } => {
                let child = child.at(&format!("{place}.erosion.child"), rasters)?;
                let region = region.at(&format!("{place}.erosion.region"), rasters)?;
                let geology = Geology::new(*seed, geology.clone()).map_err(|error| fail(error.to_string()))?;
                Volume::Erosion(Arc::new(Erosion { child, region, geology: Arc::new(geology) }))
            }
            Node::Instances { child, at } => {
                let child = child.at(&format!("{place}.instances.child"), rasters)?;
                let copy = |&(x, y, z, angle, scale): &(f64, f64, f64, f64, f64)| {
                    let placement = Placement::new(DVec3::new(x, y, z), angle.to_radians(), scale);
                    let problem = || {
                        fail(format!(
                            "a copy at ({x}, {y}, {z}) turned by {angle}, scaled by {scale}: expected finite numbers, scale 1e-6 to 1e9"
                        ))
                    };
                    let placement = placement.ok_or_else(problem)?;
                    Ok(Volume::Instance(Arc::new(Instance { child: child.clone(), placement })))
                };
                Volume::Blend(at.iter().map(copy).collect::<Result<_, VolumeError>>()?)
            }
        })
    }

    /// The file's text; [`parse`] gives an equal tree.
    pub fn to_ron(&self) -> String {
        let file = File { format: FORMAT.to_owned(), volume: self.clone() };
        let pretty = ron::ser::PrettyConfig::new().extensions(EXTENSIONS);
        let options = ron::Options::default().with_default_extension(EXTENSIONS);
        options.to_string_pretty(&file, pretty).expect("numbers are always written")
    }
}

fn index(primitives: Vec<Primitive>, fail: impl Fn(String) -> VolumeError) -> Result<Volume, VolumeError> {
    match Index::new(primitives) {
        Ok(index) => Ok(Volume::Primitives(Arc::new(index))),
        Err(k) => Err(fail(format!("primitive {k}: expected finite coordinates, positive sizes and radius"))),
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::heightfield::tests::waves;
    use super::*;
    use crate::field::Density;

    const TEXT: &str = r#"(
        format: "terrain-volume/1",
        volume: erosion(
            child: warp(
                child: blend([
                    ground(file: "waves.tif", radius: 4, distance: vertical, outline: [[(102, -18), (162, -18), (162, 50), (102, 50)]]),
                    primitives([
                        (skeleton: point(120, 10, 0), radius: 6, energy: -0.9),
                        (skeleton: cuboid(centre: (140, 20, 3), half: (2, 3, 4)), radius: 3, energy: 0.8),
                    ]),
                    strokes([(tool: Intrude, path: [(110, 0, 0), (130, 0, 2)], radius: 3, step: 2, strength: 0.6)]),
                    spine(points: [(105, 0, 2), (115, 8, 0), (125, 4, -2)], smooth: 0.05, radius: 2, energy: -0.7,
                        noise: (amplitude: 0.5, wavelength: 3, octaves: 2, seed: 1, signed: true)),
                    instances(child: primitives([(skeleton: point(0, 0, 0), radius: 2, energy: 1)]),
                        at: [(150, 30, 5, 45, 1), (150, 40, 5, 90, 2)]),
                ]),
                region: primitives([(skeleton: point(130, 10, 0), radius: 30, energy: 1)]),
                amplitude: 1.5, wavelength: 12, octaves: 2, seed: 3,
            ),
            region: carve(
                from: primitives([(skeleton: sphere(centre: (130, 10, 0), radius: 10), radius: 15, energy: 0.5)]),
                by: intersection([union([]), blend([])]),
            ),
            geology: strata(wavelength: 3, octaves: 2, seed: 4),
            seed: 5,
        ),
    )"#;

    #[test]
    fn a_tree_of_every_node_is_read_built_and_written_again() {
        let node = parse(TEXT).unwrap();
        assert_eq!(parse(&node.to_ron()).unwrap(), node);
        let mut asked = Vec::new();
        let volume = node
            .build(&mut |name| {
                asked.push(name.to_owned());
                Ok(waves())
            })
            .unwrap();
        assert_eq!(asked, ["waves.tif"]);
        assert!(volume.value(DVec3::new(150.0, -10.0, -15.0)) > 0.9);
        assert!(volume.value(DVec3::new(150.0, 30.0, 5.0)) > 0.9, "a copy stands here");
        assert_eq!(volume.value(DVec3::new(130.0, 10.0, 60.0)), 0.0);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let error = |text: &str| match parse(text) {
            Ok(node) => node.build(&mut |_| Err("no such file".to_owned())).unwrap_err().to_string(),
            Err(error) => error.to_string(),
        };
        assert!(error(TEXT).starts_with("volume.erosion.child.warp.child.blend[0]: no such file"));
        let bad = TEXT.replace("ground(file: \"waves.tif\"", "ground(file: \"waves.tif\", floor: -40");
        assert!(error(&bad).contains("no such file"));
        let from = bad.find("ground(").unwrap();
        let to = from + bad[from..].find("]]),").unwrap() + 4;
        let bad = format!("{}{}", &bad[..from], &bad[to..]);
        let bad = bad.replace("radius: 6, energy: -0.9", "radius: -6, energy: -0.9");
        assert!(error(&bad).starts_with("volume.erosion.child.warp.child.blend[0]: primitive "), "{}", error(&bad));
        assert!(error(&TEXT.replace("amplitude: 1.5", "amplitud: 1.5")).starts_with("line "));
        assert!(error(&TEXT.replace("volume/1", "volume/2")).starts_with("format: expected \"terrain-volume/1\""));
        assert!(error("nothing").starts_with("line 1, "));
    }
}
