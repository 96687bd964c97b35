//! What "a colour" is during a render: three RGB values or N spectral bands. Everything that carries
//! light is generic over [`ColorModel`]; geometry is not. A scene holds colours in their stored form, made
//! once while it is built, and a path evaluates them at its own wavelengths.

use super::per_lane::PerLane;
use super::samples::{Spectra, Spectral};
use super::texels::Pixels;
use crate::lanes::{Lanes, Vec2};

/// A colour as a scene file gives it.
#[derive(Clone, Debug, PartialEq)]
pub enum Color {
    /// `<float>`: grey, or light of that many times D65's.
    Grey(f64),
    /// `<rgb>`: linear BT.709.
    Rgb([f64; 3]),
    /// `<spectrum value="0.5">`: the same at all wavelengths (as emission: equal energy).
    Flat(f64),
    /// Pairs of a wavelength in nm and a value, wavelengths increasing; linear between them, 0 outside.
    Curve(Vec<(f64, f64)>),
    /// CIE standard illuminant D65 times a colour in linear BT.709, such that 1 is the white of RGB; the same whatever
    /// it stands for.
    D65([f64; 3]),
}

/// What a colour stands for, which decides how it is bounded and upsampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// A fraction in [0, 1]: reflectance, transmittance, opacity.
    Reflectance,
    /// Light: unbounded, D65 times the colour where an RGB triple gives it.
    Emission,
    /// Another physical quantity over wavelength, unbounded: an index of refraction.
    Quantity,
    /// A quantity from Mitsuba's tables of metals, whose RGB is that of light with this spectrum.
    Tabulated,
}

impl Role {
    /// The same for values that a fraction's bounds do not hold for.
    pub(crate) fn unbounded(self) -> Self {
        match self {
            Self::Reflectance => Self::Quantity,
            other => other,
        }
    }
}

/// RGB or N bands.
pub trait ColorModel: Clone + std::fmt::Debug + Send + Sync + 'static {
    /// A colour, ready to be evaluated at any wavelength.
    type Stored: Clone + std::fmt::Debug + Send + Sync;
    /// An image's colours, ready to be evaluated: small, for there are millions.
    type Texels: Clone + std::fmt::Debug + Send + Sync;
    /// The wavelengths that one path carries.
    type Wavelengths: Copy + PartialEq + std::fmt::Debug + Send + Sync;
    /// One value for each of them.
    type Sample: Spectral;
    /// The samples of paths in lanes.
    type Columns<F: Lanes>: Spectra<F>;
    /// Stored colours, one a lane.
    type PerLane<F: Lanes>: PerLane<Self, F>;

    /// How many paths a sample takes: more than one where there are more bands than a path carries.
    fn passes(&self) -> u32 {
        1
    }

    /// Wavelengths as a path carries them, evenly over the whole range, from a random number in [0, 1), which is drawn where
    /// there are any.
    fn wavelengths(&self, u: impl FnOnce() -> f32) -> Self::Wavelengths;

    /// The wavelengths of a sample's path of that pass: among the bands every so manieth, so that each pass sees all of the
    /// range.
    fn wavelengths_of(&self, _pass: u32, u: impl FnOnce() -> f32) -> Self::Wavelengths {
        self.wavelengths(u)
    }

    /// The wavelengths of a path that goes on with `throughput`: where a single one carries anything, all are that one, so
    /// that a boundary that parts wavelengths does not part it again.
    #[inline(always)]
    fn narrowed(wavelengths: &Self::Wavelengths, _throughput: &Self::Sample) -> Self::Wavelengths {
        *wavelengths
    }
    /// The throughput at a path's start: 1 in each channel in use.
    fn unit(&self) -> Self::Sample;
    /// A scene's colour in its stored form; the error says what is wrong with the value.
    fn store(&self, color: &Color, role: Role) -> Result<Self::Stored, String>;
    /// What is worth knowing about how [`ColorModel::store`] takes a colour.
    fn remark(&self, _color: &Color, _role: Role) -> Option<String> {
        None
    }
    /// Whether spectra become three numbers.
    fn is_rgb(&self) -> bool {
        false
    }
    /// Whether colours become spectra.
    fn upsamples(&self) -> bool {
        false
    }
    /// A stored colour at a path's wavelengths.
    fn evaluate(stored: &Self::Stored, wavelengths: &Self::Wavelengths) -> Self::Sample;
    /// The same for paths in lanes, whose wavelengths are given from the first lane on.
    #[inline(always)]
    fn evaluate_lanes<F: Lanes>(
        stored: &Self::Stored,
        wavelengths: &[Self::Wavelengths],
    ) -> Self::Columns<F> {
        Spectra::from_samples(|lane| Self::evaluate(stored, &wavelengths[lane]))
    }
    /// A colour of linear BT.709 at a path's wavelengths; reflectances are clamped to [0, 1].
    fn evaluate_rgb(
        &self,
        rgb: [f32; 3],
        role: Role,
        wavelengths: &Self::Wavelengths,
    ) -> Self::Sample;
    /// The most bytes that each of these takes in its stored form.
    fn texel_bytes(pixels: &Pixels) -> usize;
    /// An image's texels in their stored form; reflectances are clamped to [0, 1].
    fn texels(&self, pixels: Pixels, role: Role) -> Self::Texels;
    /// Texels, one a lane, at their paths' wavelengths; what is beyond the last is that.
    fn evaluate_texels<F: Lanes>(
        texels: &Self::Texels,
        index: F::Int,
        wavelengths: &[Self::Wavelengths],
    ) -> Self::Columns<F>;

    /// Texels between four neighbours, two rows of two, at a place between them in [0, 1)².
    #[inline(always)]
    fn evaluate_between<F: Lanes>(
        texels: &Self::Texels,
        corners: [[F::Int; 2]; 2],
        place: Vec2<F>,
        wavelengths: &[Self::Wavelengths],
    ) -> Self::Columns<F> {
        let [upper, lower] = corners;
        let gx = F::one() - place.x;
        let above = Self::evaluate_texels(texels, upper[0], wavelengths) * gx
            + Self::evaluate_texels(texels, upper[1], wavelengths) * place.x;
        let below = Self::evaluate_texels(texels, lower[0], wavelengths) * gx
            + Self::evaluate_texels(texels, lower[1], wavelengths) * place.x;
        above * (F::one() - place.y) + below * place.y
    }

    /// The luminance of a reflectance: 1 for white.
    fn luminance(&self, sample: &Self::Sample, wavelengths: &Self::Wavelengths) -> f32;
    /// The same for paths in lanes, whose wavelengths are given from the first lane on.
    #[inline(always)]
    fn luminance_lanes<F: Lanes>(
        &self,
        samples: Self::Columns<F>,
        wavelengths: &[Self::Wavelengths],
    ) -> F {
        let rows = samples.rows();
        F::from_fn(|lane| {
            let sample = Self::Columns::<F>::of(&rows, lane);
            self.luminance(&sample, &wavelengths[lane])
        })
    }

    /// The channels of an image: `R`, `G`, `B`, and one a band.
    fn channels(&self) -> Vec<String>;
    /// Writes what a sample's path of that pass brings to each of [`Self::channels`] to the start of `out`: all passes' are
    /// added up.
    fn develop(
        &self,
        pass: u32,
        sample: &Self::Sample,
        wavelengths: &Self::Wavelengths,
        out: &mut [f32],
    );
}

/// The luminance of linear BT.709.
#[inline(always)]
pub fn luminance<F: Lanes>([r, g, b]: [F; 3]) -> F {
    F::splat(0.212_671) * r + F::splat(0.715_16) * g + F::splat(0.072_169) * b
}

/// CIE XYZ of linear BT.709.
pub fn rgb_to_xyz(rgb: [f32; 3]) -> [f32; 3] {
    const M: [[f32; 3]; 3] = [
        [0.412_453, 0.357_58, 0.180_423],
        [0.212_671, 0.715_16, 0.072_169],
        [0.019_334, 0.119_193, 0.950_227],
    ];
    M.map(|row| row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2])
}

/// Linear BT.709 of CIE XYZ.
pub fn xyz_to_rgb(xyz: [f64; 3]) -> [f64; 3] {
    const M: [[f64; 3]; 3] = [
        [3.240_479, -1.537_150, -0.498_535],
        [-0.969_256, 1.875_991, 0.041_556],
        [0.055_648, -0.204_043, 1.057_311],
    ];
    M.map(|row| row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2])
}
