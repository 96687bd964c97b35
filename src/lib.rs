//! Étendue: a CPU ray tracer. It reads Mitsuba 3 scene files and bare meshes, traces paths in batches
//! through trees and writes images that agree with Mitsuba's. `ARCHITECTURE.md` says how it is built;
//! the modules stand here in reading order, and each imports only from those above it.

pub mod error;

pub mod budget;
pub mod file;
pub mod math;
pub(crate) mod pages;

pub mod lanes;

pub mod color;

pub mod description;
pub mod image;
pub mod mesh;

pub(crate) mod family;
pub mod interaction;

pub mod compare;
pub mod denoise;
pub mod display;
pub mod filter;
pub mod relight;
pub mod sampler;
pub mod shape;
pub mod texture;

pub mod phase;
pub mod sensor;

pub mod accel;
pub mod light;
pub mod material;
pub mod medium;

pub mod scene;

pub mod raster;

pub mod integrator;

pub(crate) mod film;

pub mod render;

pub mod crosscheck;
pub mod profile;
