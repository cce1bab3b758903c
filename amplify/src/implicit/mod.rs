//! The implicit terrain: a heightfield made a volume, and what accretes and carves it (Paris 2019 §5).

pub mod heightfield;
pub mod index;
pub mod outline;
pub mod primitive;
pub mod prism;
pub mod ray;
mod recent;
pub mod sigmoid;
pub mod skeleton;
pub mod spine;
mod squares;
pub mod surface;
pub mod volume;
