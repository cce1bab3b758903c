//! The implicit terrain: a heightfield made a volume, and the compact primitives that accrete and carve it (Paris 2019 §5).

pub mod heightfield;
pub mod index;
pub mod primitive;
pub mod ray;
pub mod sigmoid;
pub mod skeleton;
pub mod spine;
pub mod terrain;
