//! Étendue: a CPU ray tracer. It reads Mitsuba 3 scene files and bare meshes, traces paths in batches
//! through trees and writes images that agree with Mitsuba's. `ARCHITECTURE.md` says how it is built;
//! the modules stand here in reading order, and each imports only from those above it.

pub mod color;
pub mod error;

pub mod description;
pub mod image;
pub mod mesh;

pub mod display;
