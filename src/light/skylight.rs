//! Light of the clear sky and the sun: Hošek and Wilkie's models (*An analytic model for full spectral sky-dome radiance*,
//! 2012; *Adding a solar-radiance function to the Hošek–Wilkie skylight model*, 2013). Directions are in the sky's own
//! space, z up. The coefficients in `hosek_wilkie.bin` (32-bit floats, little-endian) are theirs, under the licence beside
//! them: for RGB and for wavelengths from 320 to 720 nm in steps of 40, by turbidity from 1 to 10 and, of the sky, by the
//! ground's albedo 0 and 1. Values are W/(m² sr nm), in RGB weighted as Mitsuba weights them.

use std::f32::consts::{FRAC_PI_2, TAU};
use std::f64::consts;
use std::sync::LazyLock;

use glam::{DVec3, Vec2, Vec3};

use crate::color::{Color, ColorModel, Role, Spectral};
use crate::lanes;

/// Wavelengths of the tables.
pub(super) const WAVELENGTHS: usize = 11;
/// The first of them and the step, in nm.
pub(super) const FIRST: f64 = 320.0;
/// See [`FIRST`].
pub(super) const STEP: f64 = 40.0;
/// Turbidities of the tables.
const TURBIDITIES: usize = 10;
/// Of the curves over the sun's elevation.
const CONTROLS: usize = 6;
/// Of the sky's formula.
const PARAMETERS: usize = 9;
/// Of the sun's radiance over elevation, and the coefficients of each.
const SEGMENTS: usize = 45;
const CUBIC: usize = 4;
/// Of the sun's radiance from its middle to its rim.
const LIMB: usize = 6;
/// Half the sun's angle of the model, in degrees.
const HALF_APERTURE: f64 = 0.5 * 0.5358;

/// All tables after one another.
static TABLES: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let bytes = include_bytes!("hosek_wilkie.bin");
    let number = |bytes: &[u8]| f32::from_le_bytes(bytes.try_into().expect("four bytes"));
    bytes.chunks_exact(4).map(number).collect()
});

/// A wavelength's part in linear BT.709: the standard observer's there over the number of wavelengths.
const TO_RGB: [[f64; 3]; WAVELENGTHS] = [
    [0.0, 0.0, 0.0],
    [1.0250467e-05, -8.4882731e-06, 5.8842334e-05],
    [0.0010851762, -0.00093705324, 0.0065867352],
    [0.020206273, -0.020165805, 0.16926127],
    [-0.028096297, 0.018353053, 0.076045204],
    [-0.084123797, 0.11580732, -0.0053286456],
    [0.0359142, 0.11732277, -0.015074231],
    [0.22469966, 0.014021805, -0.00625418],
    [0.10749085, -0.0096209547, -0.00097833092],
    [0.011402332, -0.0012218414, -7.8734009e-05],
    [0.00070780111, -7.6911589e-05, -4.7537523e-06],
];

/// What Mitsuba multiplies the sun's RGB by.
const SUN_TO_RGB: f64 = 467.069_280_386 / 106.750_259_4;
/// What it multiplies the sky's RGB by.
const SKY_TO_RGB: f64 = 1.0 / 106.750_259_4;

/// The elevations at which Mitsuba has the irradiance of a sun that is the same all over, from 2° on in steps of 3°.
const ELEVATIONS: usize = 30;
/// What its table has of the radiance's integral.
const OF_INTEGRAL: f64 = 0.9964;

/// How the air is, and how the light of sky and sun is scaled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Air {
    /// From 1 to 10.
    pub(super) turbidity: f64,
    /// The ground's, at the tables' wavelengths.
    pub(super) albedo: [f64; WAVELENGTHS],
    /// The ground's in linear BT.709.
    pub(super) albedo_rgb: [f64; 3],
    pub(super) sky_scale: f64,
    pub(super) sun_scale: f64,
    /// The sun's angle in degrees; its irradiance does not depend on it.
    pub(super) aperture: f64,
    /// Whether the sun is darker at its rim.
    pub(super) limb: bool,
}

/// The light of sky and sun wherever the sun stands.
#[derive(Clone, Debug)]
pub(super) struct Skylight<C: ColorModel> {
    /// What a unit of each channel of the tables is.
    basis: Vec<C::Stored>,
    /// Of the sky, by control and channel.
    parameters: [[[f64; PARAMETERS]; WAVELENGTHS]; CONTROLS],
    radiance: [[f64; WAVELENGTHS]; CONTROLS],
    /// Of the sun, by segment of elevation and wavelength.
    sun: Vec<[[f32; CUBIC]; WAVELENGTHS]>,
    limb: [[f32; LIMB]; WAVELENGTHS],
    /// Of the sun that is the same all over, by elevation and channel: radiance.
    even: Vec<[f64; WAVELENGTHS]>,
    /// Where the segments begin, in radians.
    breaks: [f32; SEGMENTS],
    /// Whether the channels are red, green and blue.
    rgb: bool,
    darker_rim: bool,
    sun_scale: f32,
    /// The sine of half the sun's angle.
    pub(super) sine: f32,
    /// 1 − the cosine of half the sun's angle.
    pub(super) versine: f32,
}

/// The sky while the sun stands somewhere.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    /// Where the sun is, unit length.
    pub(super) sun: Vec3,
    parameters: [[f32; PARAMETERS]; WAVELENGTHS],
    radiance: [f32; WAVELENGTHS],
    even: [f32; WAVELENGTHS],
}

/// The first number after the tables before.
struct Reader(usize);

impl Reader {
    /// Skips or takes a table of that many numbers.
    fn table(&mut self, count: usize) -> &'static [f32] {
        let start = self.0;
        self.0 += count;
        &TABLES[start..self.0]
    }
}

/// The table's `size` numbers at a turbidity.
fn at_turbidity(table: &[f32], turbidity: f64) -> Vec<f64> {
    let size = table.len() / TURBIDITIES;
    let place = (turbidity - 1.0).clamp(0.0, (TURBIDITIES - 1) as f64);
    let low = (place as usize).min(TURBIDITIES - 2);
    let between = place - low as f64;
    let rows = table[low * size..][..2 * size].split_at(size);
    let both = rows.0.iter().zip(rows.1);
    both.map(|(a, b)| f64::from(*a) * (1.0 - between) + f64::from(*b) * between)
        .collect()
}

impl<C: ColorModel> Skylight<C> {
    pub(super) fn new(color: &C, air: &Air) -> Result<Self, String> {
        let rgb = color.is_rgb();
        let sky = 2 * CONTROLS;
        let mut reader = Reader(0);
        let all = [3, WAVELENGTHS].map(|channels| {
            [sky * channels * PARAMETERS, sky * channels]
                .map(|size| reader.table(TURBIDITIES * size))
        });
        let sun = reader.table(TURBIDITIES * SEGMENTS * WAVELENGTHS * CUBIC);
        let limb = reader.table(WAVELENGTHS * LIMB);
        let channels = if rgb { 3 } else { WAVELENGTHS };
        let [parameters, radiance] = all[usize::from(!rgb)].map(|t| at_turbidity(t, air.turbidity));
        let albedo = |channel: usize| match rgb {
            true => air.albedo_rgb[channel],
            false => air.albedo[channel],
        };
        // Of a table by albedo, control, channel and `each` numbers.
        let number = |table: &[f64], control: usize, channel: usize, each: usize, i: usize| {
            let at =
                |ground| table[((ground * CONTROLS + control) * channels + channel) * each + i];
            let albedo = albedo(channel);
            at(0) * (1.0 - albedo) + at(1) * albedo
        };
        let mut this = Self {
            basis: basis(color)?,
            parameters: [[[0.0; PARAMETERS]; WAVELENGTHS]; CONTROLS],
            radiance: [[0.0; WAVELENGTHS]; CONTROLS],
            sun: Vec::new(),
            limb: [[0.0; LIMB]; WAVELENGTHS],
            even: Vec::new(),
            breaks: [0.0; SEGMENTS],
            rgb,
            darker_rim: air.limb,
            sun_scale: 0.0,
            sine: 0.0,
            versine: 0.0,
        };
        let scale = air.sky_scale * if rgb { SKY_TO_RGB } else { 1.0 };
        for (control, channel) in
            (0..CONTROLS).flat_map(|control| (0..channels).map(move |channel| (control, channel)))
        {
            for i in 0..PARAMETERS {
                this.parameters[control][channel][i] =
                    number(&parameters, control, channel, PARAMETERS, i);
            }
            this.radiance[control][channel] = scale * number(&radiance, control, channel, 1, 0);
        }
        let sun = at_turbidity(sun, air.turbidity);
        this.sun = sun
            .chunks_exact(WAVELENGTHS * CUBIC)
            .map(|segment| {
                std::array::from_fn(|wavelength| {
                    std::array::from_fn(|k| segment[wavelength * CUBIC + k] as f32)
                })
            })
            .collect();
        for (row, values) in this.limb.iter_mut().zip(limb.chunks_exact(LIMB)) {
            row.copy_from_slice(values);
        }
        this.breaks = std::array::from_fn(|segment| {
            (consts::FRAC_PI_2 * (segment as f64 / SEGMENTS as f64).powi(3)) as f32
        });
        let half = |degrees: f64| 2.0 * (0.5 * degrees.to_radians()).sin().powi(2);
        let (own, model) = (half(0.5 * air.aperture), half(HALF_APERTURE));
        this.versine = own as f32;
        this.sine = (0.5 * air.aperture).to_radians().sin() as f32;
        this.sun_scale = (air.sun_scale * model / own) as f32;
        if !air.limb {
            this.even = (0..ELEVATIONS)
                .map(|i| this.even_radiance(2.0 + 3.0 * i as f64))
                .collect();
        }
        Ok(this)
    }

    /// How many channels the tables have.
    fn channels(&self) -> usize {
        self.basis.len()
    }

    /// The mean radiance over a sun whose middle stands so many degrees high, by channel.
    fn even_radiance(&self, degrees: f64) -> [f64; WAVELENGTHS] {
        const RINGS: usize = 64;
        const SECTORS: usize = 32;
        let half = HALF_APERTURE.to_radians();
        let (sin, cos) = degrees.to_radians().sin_cos();
        let (mut sum, mut angle) = ([0.0; WAVELENGTHS], 0.0);
        for ring in 0..RINGS {
            let gamma = half * (ring as f64 + 0.5) / RINGS as f64;
            let part = gamma.sin();
            let from_rim = (1.0 - (gamma.sin() / half.sin()).powi(2)).max(0.0).sqrt();
            for sector in 0..SECTORS {
                let around = consts::TAU * (sector as f64 + 0.5) / SECTORS as f64;
                angle += part;
                let z = sin * gamma.cos() + cos * gamma.sin() * around.cos();
                if z <= 0.0 {
                    continue;
                }
                let spectrum = self.sun_spectrum(z.min(1.0).asin() as f32);
                for (wavelength, sum) in sum.iter_mut().enumerate() {
                    let dark = polynomial(&self.limb[wavelength], from_rim as f32);
                    *sum += part * f64::from(spectrum[wavelength] * dark);
                }
            }
        }
        let mean = sum.map(|sum| OF_INTEGRAL * sum / angle);
        self.to_channels(mean)
    }

    /// From values by wavelength to channels.
    fn to_channels(&self, values: [f64; WAVELENGTHS]) -> [f64; WAVELENGTHS] {
        if !self.rgb {
            return values;
        }
        let mut channels = [0.0; WAVELENGTHS];
        for (value, part) in values.iter().zip(&TO_RGB) {
            for (channel, part) in channels.iter_mut().zip(part) {
                *channel += SUN_TO_RGB * value * part;
            }
        }
        channels
    }

    /// Radiance of the sun's middle at an elevation in radians, by wavelength.
    fn sun_spectrum(&self, elevation: f32) -> [f32; WAVELENGTHS] {
        let after = self.breaks.partition_point(|begin| *begin <= elevation);
        let segment = after.clamp(1, SEGMENTS) - 1;
        let x = elevation - self.breaks[segment];
        self.sun[segment].map(|cubic| polynomial(&cubic, x))
    }

    /// The sky while the sun is at `sun`, unit length.
    pub(super) fn at(&self, sun: DVec3) -> Moment {
        const BINOMIALS: [f64; CONTROLS] = [1.0, 5.0, 10.0, 10.0, 5.0, 1.0];
        let elevation = sun.z.clamp(-1.0, 1.0).asin();
        let x = (elevation.max(0.0) / consts::FRAC_PI_2).cbrt().min(1.0);
        let weights: [f64; CONTROLS] = std::array::from_fn(|i| {
            let rest = (CONTROLS - 1 - i) as i32;
            BINOMIALS[i] * x.powi(i as i32) * (1.0 - x).powi(rest)
        });
        let mut moment = Moment {
            sun: sun.as_vec3(),
            parameters: [[0.0; PARAMETERS]; WAVELENGTHS],
            radiance: [0.0; WAVELENGTHS],
            even: [0.0; WAVELENGTHS],
        };
        for channel in 0..self.channels() {
            let blend = |value: &dyn Fn(usize) -> f64| -> f32 {
                let parts = weights.iter().enumerate();
                parts.map(|(i, weight)| weight * value(i)).sum::<f64>() as f32
            };
            for i in 0..PARAMETERS {
                moment.parameters[channel][i] = blend(&|c| self.parameters[c][channel][i]);
            }
            moment.radiance[channel] = blend(&|c| self.radiance[c][channel]);
        }
        if !self.even.is_empty() {
            let last = ELEVATIONS - 1;
            let place = ((elevation.to_degrees() - 2.0) / 3.0).clamp(0.0, last as f64);
            let low = (place as usize).min(last - 1);
            let between = place - low as f64;
            moment.even = std::array::from_fn(|c| {
                let (a, b) = (self.even[low][c], self.even[low + 1][c]);
                (a * (1.0 - between) + b * between) as f32
            });
        }
        moment
    }

    /// Whether the sun is seen in a direction.
    pub(super) fn meets_sun(&self, moment: &Moment, direction: Vec3) -> bool {
        // The square of the chord, which unlike the cosine does not cancel.
        direction.distance_squared(moment.sun) <= 2.0 * self.versine
    }

    /// Radiance by channel from a direction of unit length; `sun` says whether the sun is seen there.
    fn values(&self, moment: &Moment, direction: Vec3, sun: bool) -> [f32; WAVELENGTHS] {
        let mut values = [0.0; WAVELENGTHS];
        let z = direction.z;
        if z < 0.0 || moment.sun.z < 0.0 {
            return values;
        }
        let cos_gamma = direction.dot(moment.sun).clamp(-1.0, 1.0);
        let across = direction.cross(moment.sun).length();
        let gamma = lanes::atan2(across, cos_gamma);
        let view = View {
            cos: z,
            root: z.sqrt(),
            gamma,
            cos_gamma,
        };
        for (channel, value) in values.iter_mut().enumerate().take(self.channels()) {
            *value = moment.radiance[channel] * view.sky(&moment.parameters[channel]);
        }
        if sun {
            let radiance = match self.darker_rim {
                false => moment.even,
                true => self.with_rim(z, across),
            };
            for (value, radiance) in values.iter_mut().zip(radiance) {
                *value += self.sun_scale * radiance;
            }
        }
        values
    }

    /// The sun's radiance by channel at the cosine `z` of the polar angle, that sine away from its middle.
    fn with_rim(&self, z: f32, across: f32) -> [f32; WAVELENGTHS] {
        let horizontal = (1.0 - z * z).max(0.0).sqrt();
        let elevation = lanes::atan2(z, horizontal).min(FRAC_PI_2);
        let spectrum = self.sun_spectrum(elevation);
        let ratio = across / self.sine;
        let from_rim = (1.0 - ratio * ratio).max(0.0).sqrt();
        let radiance: [f64; WAVELENGTHS] = std::array::from_fn(|wavelength| {
            f64::from(spectrum[wavelength] * polynomial(&self.limb[wavelength], from_rim))
        });
        self.to_channels(radiance).map(|value| value as f32)
    }

    /// Radiance from a direction of unit length; `sun` says whether the sun is seen there.
    pub(super) fn radiance(
        &self,
        moment: &Moment,
        direction: Vec3,
        sun: bool,
        w: &C::Wavelengths,
    ) -> C::Sample {
        let values = self.values(moment, direction, sun);
        let mut sum = C::Sample::zero();
        for (stored, value) in self.basis.iter().zip(values) {
            sum += C::evaluate(stored, w) * value;
        }
        sum
    }

    /// The mean over the channels of what [`Self::radiance`] is made of, in absolute value.
    pub(super) fn brightness(&self, moment: &Moment, direction: Vec3, sun: bool) -> f64 {
        let values = self.values(moment, direction, sun);
        let channels = self.channels();
        let sum: f64 = values[..channels].iter().map(|v| f64::from(v.abs())).sum();
        sum / channels as f64
    }

    /// The sun's solid angle.
    pub(super) fn sun_angle(&self) -> f32 {
        TAU * self.versine
    }

    /// A direction in the sun for numbers in [0, 1)².
    pub(super) fn sun_direction(&self, moment: &Moment, u: Vec2) -> Vec3 {
        let below = u.x * self.versine;
        let sine = (below * (2.0 - below)).sqrt();
        let (sin, cos) = lanes::sin_cos_turns(u.y);
        let local = Vec3::new(sine * cos, sine * sin, 1.0 - below);
        crate::math::Frame::around(moment.sun)
            .to_world(local)
            .normalize()
    }
}

/// What a unit of each channel of the tables is: red, green and blue, or the wavelengths between which values are linear.
fn basis<C: ColorModel>(color: &C) -> Result<Vec<C::Stored>, String> {
    if color.is_rgb() {
        let units = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let stored = units.map(|unit| color.store(&Color::Rgb(unit), Role::Emission));
        return stored.into_iter().collect();
    }
    let at = |i: usize| FIRST + STEP * i as f64;
    let tent = |i: usize| {
        let before = i.checked_sub(1).map(|before| (at(before), 0.0));
        let after = (i + 1 < WAVELENGTHS).then(|| (at(i + 1), 0.0));
        let points = before.into_iter().chain([(at(i), 1.0)]).chain(after);
        color.store(&Color::Curve(points.collect()), Role::Emission)
    };
    (0..WAVELENGTHS).map(tent).collect()
}

/// Where one looks, in the terms of the sky's formula.
struct View {
    /// The cosine of the polar angle, and its root.
    cos: f32,
    root: f32,
    /// The angle to the sun, and its cosine.
    gamma: f32,
    cos_gamma: f32,
}

impl View {
    /// Formula 8 of 2012, but for the factor: (1 + A e^(B/(cos θ + 0.01))) (C + D e^(Eγ) + F cos²γ + G χ(H, γ) + I √cos θ).
    fn sky(&self, p: &[f32; PARAMETERS]) -> f32 {
        let squared = self.cos_gamma * self.cos_gamma;
        let chi = 1.0 + p[8] * p[8] - 2.0 * p[8] * self.cos_gamma;
        let chi = (1.0 + squared) / (chi * chi.sqrt());
        let horizon = 1.0 + p[0] * lanes::exp(p[1] / (self.cos + 0.01));
        horizon
            * (p[2]
                + p[3] * lanes::exp(p[4] * self.gamma)
                + p[5] * squared
                + p[6] * chi
                + p[7] * self.root)
    }
}

/// The polynomial with these coefficients, the constant first.
fn polynomial(coefficients: &[f32], x: f32) -> f32 {
    let terms = coefficients.iter().rev();
    terms.fold(0.0, |sum, coefficient| sum * x + coefficient)
}
