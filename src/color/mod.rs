//! Colour: the standard observer and daylight, and smooth reflectance spectra for RGB colours. Wavelengths
//! are in nanometres; RGB is linear with the primaries of ITU-R BT.709 and white D65.

pub mod cie;
pub mod d65;
pub mod upsample;
