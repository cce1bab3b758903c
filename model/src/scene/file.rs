//! The text of a scene: RON with named definitions, layers and cameras.

use super::value::{Finite, Point, Point3, Positive, one};
use crate::operator::WeightRule;
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
