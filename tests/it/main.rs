//! The integration tests: one binary, a module a question. The images are rendered in earnest, so run them
//! with `--release`.

mod support;

#[cfg(feature = "bands")]
mod bands;
mod batch;
mod channels;
mod cli;
mod closed_form;
mod color;
mod commands;
mod compare;
mod crosscheck;
mod filters;
mod golden;
mod guided;
mod inputs;
mod instances;
mod known_radiance;
mod layers;
mod light_tracing;
mod lights;
mod media;
mod memory;
mod mesh;
mod mitsuba_data;
mod motion;
mod opacity;
mod parts;
mod phong;
mod profile;
mod raster;
mod renders;
mod resume;
mod same_bits;
mod signs;
mod tev;
mod tour;
