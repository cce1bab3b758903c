//! Terrain as a tree of landform primitives (Génevaux 2015), and the ground all other crates stand on.

pub mod certify;
pub mod dual;
pub mod falloff;
pub mod interval;
pub mod lanes;
pub mod noise;
pub mod real;
pub mod rounding;
