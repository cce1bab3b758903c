//! Terrain as a tree of landform primitives (Génevaux 2015), and the ground all other crates stand on.

pub mod bounds;
pub mod certify;
pub mod detail;
pub mod dual;
pub mod falloff;
pub mod grid;
pub mod interval;
pub mod io;
pub mod lanes;
pub mod mesh;
pub mod noise;
pub mod operator;
pub mod primitive;
pub mod profile;
pub mod program;
pub mod real;
pub mod rounding;
pub mod scene;
pub mod skeleton;
pub mod spline;
pub mod trace;
pub mod tree;
