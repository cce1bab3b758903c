//! The GPU side: adapters, and run-time tessellated detail, on wgpu.
