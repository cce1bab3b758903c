//! Terrain as a tree of landform primitives (Génevaux 2015), and the ground all other crates stand on.

pub mod grid;
pub mod io;
pub mod mesh;
