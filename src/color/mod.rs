//! Colour: how numbers stand for light.

pub mod srgb;
