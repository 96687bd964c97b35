//! Colour: what a path carries (RGB or N spectral bands), the standard observer and daylight, smooth
//! spectra for RGB colours, and the sRGB curve. Wavelengths are in nanometres; RGB is linear with the
//! primaries of ITU-R BT.709 and white D65.

pub mod cie;
pub mod d65;
pub mod srgb;
pub mod upsample;

mod bands;
mod comb;
mod difference;
mod model;
mod mono;
mod observed;
mod per_lane;
mod primaries;
mod response;
mod rgb;
mod samples;
mod space;
mod spectrum;
mod texels;

pub use bands::Bands;
pub use comb::{Comb, MAX_BANDS, Teeth, VISIBLE};
pub use difference::{delta_e_76, delta_e_2000};
pub use model::{Color, ColorModel, Role, luminance, rgb_to_xyz, xyz_to_rgb};
pub use mono::Mono;
pub use observed::{Light, to_display, xyz_of_light, xyz_of_surface};
pub use per_lane::PerLane;
pub use primaries::Primaries;
pub use response::Response;
pub use rgb::Rgb;
pub use samples::{Columns, Samples, Spectra, Spectral};
pub use space::{Space, adaptation, chromaticity, hsv_to_rgb, rgb_to_hsv, xyz_of};
pub use spectrum::Spectrum;
pub use texels::{Packed, Pixels};
