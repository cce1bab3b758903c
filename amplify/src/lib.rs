//! Heightfields amplified to implicit 3D terrain (Paris 2019).

pub mod brush;
mod buckets;
pub mod field;
pub mod geology;
pub mod hydrology;
pub mod implicit;
pub mod landform;
pub mod polygonize;
pub mod recipe;
pub mod sampling;
pub mod stacks;
mod turbulence;
