//! The text of a scene: RON with named definitions, layers and cameras.

use super::value::{Finite, Point, Point3, Positive, one};
use crate::operator::WeightRule;
use crate::operator::lod::Passage;
use crate::operator::masked::{Joining, Ramp};
use crate::primitive::{self, for_each_primitive};
use serde::Deserialize;
use std::collections::BTreeMap;

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    pub(super) format: String,
    #[serde(default)]
    pub(super) seed: u64,
    #[serde(default)]
    pub(super) definitions: BTreeMap<String, NodeFile>,
    pub(super) layers: BTreeMap<String, NodeFile>,
    /// Where detail is wanted; everywhere when absent.
    #[serde(default)]
    pub(super) focus: Option<FocusFile>,
    #[serde(default)]
    pub(super) look: LookFile,
    #[serde(default)]
    pub(super) cameras: BTreeMap<String, CameraFile>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraFile {
    pub(super) eye: Point3,
    pub(super) target: Point3,
    #[serde(default = "field_of_view")]
    pub(super) field_of_view_degrees: Positive,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FocusFile {
    pub(super) position: Point,
    pub(super) near: Finite,
    pub(super) far: Positive,
}

/// How the scene is lit and what grows; what is left out follows from its size.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct LookFile {
    /// Where the sun stands: degrees from north, clockwise, and above the horizon.
    pub(super) sun: Option<Point>,
    /// Elevation above which snow lies, metres.
    pub(super) snow: Option<Finite>,
    pub(super) arid: bool,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ControlFile {
    pub(super) centre: Point,
    pub(super) radius: Positive,
    pub(super) shift: Point,
}

fn field_of_view() -> Positive {
    Positive::of(45.0)
}
fn unit() -> Finite {
    Finite::of(1.0)
}

macro_rules! define {
    ($($(#[$doc:meta])* $name:ident $file:ident $authored:ident,)*) => {
        #[derive(Clone, Debug, Deserialize)]
        #[serde(rename_all = "snake_case", deny_unknown_fields)]
        pub(super) enum NodeFile {
            $($name(primitive::$file::File),)*
            River(primitive::river::File),
            Road(primitive::road::File),
            Blend(Vec<NodeFile>),
            Replace {
                a: Box<NodeFile>,
                b: Box<NodeFile>,
                #[serde(default)]
                weight_rule: WeightRule,
            },
            Add {
                a: Box<NodeFile>,
                b: Box<NodeFile>,
                #[serde(default)]
                weight_rule: WeightRule,
            },
            Lod {
                a: Box<NodeFile>,
                b: Box<NodeFile>,
                /// Levels of detail between which `a` gives way to `b`.
                from: Finite,
                to: Finite,
                #[serde(default)]
                passage: Passage,
            },
            Masked {
                a: Box<NodeFile>,
                b: Box<NodeFile>,
                /// Metres to each side over which the slope of `a` is measured.
                probe: Positive,
                #[serde(default)]
                elevation: Option<Ramp>,
                #[serde(default)]
                slope: Option<Ramp>,
                #[serde(default)]
                joining: Joining,
            },
            Warp {
                node: Box<NodeFile>,
                controls: Vec<ControlFile>,
            },
            Affine {
                node: Box<NodeFile>,
                #[serde(default = "one")]
                scale: Positive,
                #[serde(default)]
                rotation_degrees: Finite,
                #[serde(default)]
                translation: Point,
                #[serde(default = "unit")]
                elevation_scale: Finite,
                #[serde(default)]
                elevation_offset: Finite,
            },
            Instance(String),
        }
    };
}
for_each_primitive!(define);
