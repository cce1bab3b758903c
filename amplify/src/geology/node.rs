//! The authored tree and its text: RON with a header; what cannot be read or makes no sense is one line of error.

use super::Geology;
use glam::DVec3;
use ron::extensions::Extensions;
use serde::{Deserialize, Serialize};

/// The header every geology file starts with.
pub const FORMAT: &str = "terrain-geology/1";

/// A node ρ: R³ → [0, 1]. Lengths are metres.
///
/// The paper blends by sums, which leave [0, 1] (claims P2). Here a blend is a convex combination and a local change is
/// added and clamped. t is the paper's turbulence, normalised to [0, 1] (claims P1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Node {
    /// The same everywhere, in [0, 1].
    Constant(f64),
    /// Horizontal strata t(0, 0, z/λ) (§4.1; claims P4).
    Strata {
        /// λ of the first octave.
        wavelength: f64,
        /// How many octaves, 1 to 16; the paper's o is one less.
        octaves: u32,
        /// Tells this noise from the others of the tree.
        seed: u32,
    },
    /// t(p/λ) in space (§4.1).
    Turbulence {
        /// λ of the first octave.
        wavelength: f64,
        /// How many octaves, 1 to 16.
        octaves: u32,
        /// Tells this noise from the others of the tree.
        seed: u32,
    },
    /// A sheet of rock, (1 − roughness) · resistance · g(|d|/radius) + roughness · t(p/λ) with the distance d to a plane
    /// and Wyvill's falloff g (§4.2; claims P3).
    Plane {
        /// A point of the plane.
        point: DVec3,
        /// Its normal, of any length.
        normal: DVec3,
        /// Where the sheet ends.
        radius: f64,
        /// On the plane, in [0, 1].
        resistance: f64,
        /// Share of the noise, in [0, 1].
        roughness: f64,
        /// λ of the noise.
        wavelength: f64,
        /// Octaves of the noise, 1 to 16.
        octaves: u32,
        /// Tells this noise from the others of the tree.
        seed: u32,
    },
    /// Σ wᵢ ρᵢ / Σ wᵢ over weights wᵢ > 0.
    Blend(Vec<(f64, Node)>),
    /// clamp(ρ + Σ changeᵢ · g(dᵢ/radiusᵢ), 0, 1): promontories, caves, arches (§4.2).
    Change {
        /// What is changed.
        child: Box<Node>,
        /// Where and by how much.
        by: Vec<Local>,
    },
    /// ρ(p + δ(p)), δ three independent signed turbulences with ‖δ‖ ≤ amplitude (§4.3; claims P4).
    ///
    /// Refused where the bound of Lip(δ) reaches 1, as the map may then overturn the rock (claims P5).
    Fold {
        /// Largest displacement.
        amplitude: f64,
        /// λ of the first octave.
        wavelength: f64,
        /// How many octaves, 1 to 16.
        octaves: u32,
        /// Tells this noise from the others of the tree.
        seed: u32,
        /// Accept a fold that may overturn.
        #[serde(default)]
        allow_overturned: bool,
        /// What is folded.
        child: Box<Node>,
    },
    /// ρ(x, y, z + k·u·g(u/height)·g(r/radius)) with u = z − centre.z and r the horizontal distance to the centre: strata
    /// at the centre are 1 + k times thinner, and the map is increasing in z for −1 < k < 49/32 (§4.3).
    Taper {
        /// Where the strata are most compressed.
        centre: DVec3,
        /// Horizontal reach.
        radius: f64,
        /// Vertical reach.
        height: f64,
        /// k; negative thickens.
        compression: f64,
        /// What is tapered.
        child: Box<Node>,
    },
    /// ρ(p − translation) strictly inside the half-space (p − point)·normal > 0, ρ(p) on its boundary and beyond:
    /// discontinuous (§4.4).
    Fault {
        /// A point of the boundary.
        point: DVec3,
        /// Towards the block that moved, of any length.
        normal: DVec3,
        /// How it moved.
        translation: DVec3,
        /// What is faulted.
        child: Box<Node>,
        /// Other rock on the boundary and beyond, so that strata end at the fault (Fig. 3).
        #[serde(default)]
        against: Option<Box<Node>>,
    },
}

/// A place where resistance is raised or lowered by `change` in [−1, 1], fading out at `radius`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Local {
    /// Around a point.
    Sphere {
        /// The point.
        centre: DVec3,
        /// Where the change ends.
        radius: f64,
        /// At the centre.
        change: f64,
    },
    /// Around a polyline.
    Curve {
        /// Its vertices, two or more, neighbours distinct.
        points: Vec<DVec3>,
        /// Where the change ends.
        radius: f64,
        /// On the line.
        change: f64,
    },
}

/// Why a geology was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GeologyError {
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
    /// A value out of its range.
    #[error("{place}: {problem}")]
    Value {
        /// Path in the tree.
        place: String,
        /// What was expected and what was found.
        problem: String,
    },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    seed: u32,
    geology: Node,
}

const EXTENSIONS: Extensions = Extensions::IMPLICIT_SOME.union(Extensions::UNWRAP_VARIANT_NEWTYPES);

impl Geology {
    /// Reads a geology.
    ///
    /// # Errors
    /// [`GeologyError`] with line and column, or with the place in the tree.
    pub fn parse(text: &str) -> Result<Geology, GeologyError> {
        let options = ron::Options::default().with_default_extension(EXTENSIONS);
        let file: File = options.from_str(text).map_err(|error| GeologyError::Syntax {
            line: error.span.start.line,
            column: error.span.start.col,
            problem: error.code.to_string(),
        })?;
        if file.format != FORMAT {
            let problem = format!("expected \"{FORMAT}\", found {:?}", file.format);
            return Err(GeologyError::Value { place: "format".to_owned(), problem });
        }
        Geology::new(file.seed, file.geology)
    }
    /// Its text; [`Geology::parse`] gives an equal tree.
    pub fn to_ron(&self) -> String {
        let file = File { format: FORMAT.to_owned(), seed: self.seed(), geology: self.node().clone() };
        let pretty = ron::ser::PrettyConfig::new().extensions(EXTENSIONS);
        let options = ron::Options::default().with_default_extension(EXTENSIONS);
        options.to_string_pretty(&file, pretty).expect("numbers are always written")
    }
}
