//! `measured`: a material as a gonio-photometer has seen it, from the tensor files of EPFL's Realistic Graphics Lab
//! (Dupuy and Jakob, *An adaptive parameterization for efficient material acquisition and rendering*, 2018). Half vectors
//! are drawn as the file's microfacets are visible, and then as the file's luminance says; the value there is looked up
//! where the two warps have come from. As in Mitsuba, files with `rgb` are rendered in RGB, and files with `spectra` in bands:
//! between the file's wavelengths values go straight, beyond them they stay.

use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use super::tensor_file::{Array, TensorFile};
use super::warp2d::Warp2D;
use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, single_face};
use crate::color::{Color, ColorModel, Role, Spectra, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, file};
use crate::error::{Error, Result};
use crate::interaction::Points;
use crate::lanes::{self, Lanes, Vec2, Vec3};
use crate::texture::Palettes;

/// A measured material.
#[derive(Clone, Debug)]
pub struct Measured<C: ColorModel> {
    tables: Arc<Tables>,
    channels: Channels<C>,
}

/// What the file's channels stand for.
#[derive(Clone, Debug)]
enum Channels<C: ColorModel> {
    /// Red, green and blue, of each of which a unit is this.
    Rgb([C::Stored; 3]),
    /// Wavelengths: the function that is as large as they are, in nm.
    Wavelengths(C::Stored),
}

#[derive(Debug)]
struct Tables {
    ndf: Warp2D,
    sigma: Warp2D,
    vndf: Warp2D,
    luminance: Warp2D,
    /// By channel: 0, 1 and 2, or wavelengths in nm.
    values: Warp2D,
    isotropic: bool,
    /// How many parts of the circle of azimuths are alike.
    symmetry: u32,
    /// Whether values are to be multiplied by the density of facets.
    jacobian: bool,
}

/// What a pair of directions comes to.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// The angles of the light's side.
    incident: [f32; 2],
    /// Where values are looked up.
    place: Vec2<f32>,
    /// What they are multiplied by.
    scale: f32,
    /// The density of the direction.
    pdf: f32,
}

impl<C: ColorModel> Measured<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a material that was measured",
        properties: &[&[file(
            "filename",
            "a tensor file (.bsdf) with values in RGB, or at wavelengths",
        )]],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let path = properties.file("filename")?;
        let color = &palettes.colors.color;
        let tensors = TensorFile::read(&path, properties.budget())
            .map_err(|e| e.at(properties.location()))?;
        let (is_rgb, name) = match color.is_rgb() {
            true => (true, "rgb"),
            false => (false, "spectra"),
        };
        if !tensors.has(name) {
            let message = match is_rgb {
                true => "the file has values at wavelengths, which are rendered in bands",
                false => "the file has values in RGB, which are not rendered in bands",
            };
            let help = match is_rgb {
                true => "`--bands N` renders it, or a file of the same material with values in RGB",
                false => "the same material's file with values at wavelengths can be",
            };
            let message = format!("{}: {message}", path.display());
            let error = Error::unsupported(message).at(properties.location());
            return Err(error.help(help));
        }
        let tables = Tables::new(tensors, is_rgb)
            .map_err(|why| properties.error("filename", format!("{}: {why}", path.display())))?;
        let stored = |what: Color| {
            let stored = color.store(&what, Role::Quantity);
            stored.map_err(|why| properties.error("filename", why))
        };
        let channels = if is_rgb {
            let [r, g, b] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let unit = |unit| stored(Color::Rgb(unit));
            Channels::Rgb([unit(r)?, unit(g)?, unit(b)?])
        } else {
            let [low, high] = [1.0, 1e5];
            Channels::Wavelengths(stored(Color::Curve(vec![(low, low), (high, high)]))?)
        };
        Ok(Self {
            tables: Arc::new(tables),
            channels,
        })
    }

    fn color(&self, seen: &Seen, w: &C::Wavelengths) -> C::Sample {
        match &self.channels {
            Channels::Rgb(units) => {
                let mut sum = C::Sample::zero();
                for (unit, channel) in units.iter().zip([0.0, 1.0, 2.0]) {
                    sum += C::evaluate(unit, w) * self.tables.value(seen, channel);
                }
                sum
            }
            Channels::Wavelengths(identity) => {
                let wavelengths = C::evaluate(identity, w);
                C::Sample::from_fn(|channel| self.tables.value(seen, wavelengths[channel]))
            }
        }
    }
}

impl Tables {
    fn new(mut file: TensorFile, is_rgb: bool) -> std::result::Result<Self, String> {
        let ascending = |name: &str, file: &mut TensorFile| {
            let values = file.array(name, 1)?.values;
            match values.windows(2).all(|pair| pair[0] < pair[1]) {
                true => Ok(values),
                false => Err(format!("{name} does not ascend")),
            }
        };
        let phi = ascending("phi_i", &mut file)?;
        let theta = ascending("theta_i", &mut file)?;
        let grid = |name: &str, outer: &[usize], file: &mut TensorFile| {
            let Array { shape, values } = file.array(name, outer.len() + 2)?;
            let (before, [height, width]) = shape.split_at(outer.len()) else {
                return Err(format!("{name} has no rows and columns"));
            };
            let size = [*width, *height];
            match before == outer
                && size.iter().all(|n| *n >= 2)
                && values.iter().all(|v| *v >= 0.0)
            {
                true => Ok((size, values)),
                false => Err(format!(
                    "{name} is of another size than phi_i and theta_i, or negative"
                )),
            }
        };
        let outer = [phi.len(), theta.len()];
        let parameters = || vec![phi.clone(), theta.clone()];
        let (size, values) = grid("ndf", &[], &mut file)?;
        let ndf = Warp2D::table(size, Vec::new(), values);
        let (size, values) = grid("sigma", &[], &mut file)?;
        let sigma = Warp2D::table(size, Vec::new(), values);
        let (size, values) = grid("vndf", &outer, &mut file)?;
        let vndf = Warp2D::density(size, parameters(), values);
        let (size, values) = grid("luminance", &outer, &mut file)?;
        let luminance = Warp2D::density(size, parameters(), values);
        let (name, channel_values) = match is_rgb {
            true => ("rgb", vec![0.0, 1.0, 2.0]),
            false => ("spectra", ascending("wavelengths", &mut file)?),
        };
        let Array { shape, values } = file.array(name, 5)?;
        let [phis, thetas, channels, height, width] = shape[..] else {
            return Err(format!("{name} has no five dimensions"));
        };
        if [phis, thetas] != outer || channels != channel_values.len() || [width, height] != size {
            return Err(format!("{name} is of another size than luminance"));
        }
        let mut by_channel = parameters();
        by_channel.push(channel_values);
        let jacobian = file.array("jacobian", 1)?.values[0] != 0.0;
        let reach = phi[phi.len() - 1] - phi[0];
        let isotropic = phi.len() <= 2;
        Ok(Self {
            ndf,
            sigma,
            vndf,
            luminance,
            values: Warp2D::table(size, by_channel, values),
            isotropic,
            // Half vectors of isotropic materials are told from the plane of incidence, so that to turn a pair of
            // directions changes no more than where `sigma` is looked up. Mitsuba 3.9.1 looks there.
            symmetry: if isotropic || reach <= 0.0 {
                2
            } else {
                (TAU / reach).round() as u32
            },
            jacobian,
        })
    }

    /// The signs by which directions are folded into the part of azimuths that was measured.
    fn fold(&self, wi: Vec3<f32>) -> [f32; 2] {
        let away = |x: f32| if x.is_sign_negative() { 1.0 } else { -1.0 };
        match self.symmetry {
            0 | 1 => [1.0, 1.0],
            4 => [away(wi.x), away(wi.y)],
            _ => [away(wi.y); 2],
        }
    }

    /// What a pair of directions comes to; `None` unless they are above the surface.
    fn eval(&self, wi: Vec3<f32>, wo: Vec3<f32>) -> Option<Seen> {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return None;
        }
        let [sx, sy] = self.fold(wi);
        let turned = |v: Vec3<f32>| Vec3::new(v.x * sx, v.y * sy, v.z);
        let (wi, wo) = (turned(wi), turned(wo));
        let m = (wi + wo).normalize();
        let (theta_i, phi_i) = angles(wi);
        let (theta_m, phi_m) = angles(m);
        let around = if self.isotropic { phi_m - phi_i } else { phi_m };
        let around = unit_of_phi(around);
        let u_m = Vec2::new(unit_of_theta(theta_m), around - around.floor());
        let mix = self.vndf.mix(&[phi_i, theta_i]);
        let visible = self.vndf.invert(&mix, u_m);
        let bright = self
            .luminance
            .eval(&self.luminance.mix(&[phi_i, theta_i]), visible.place);
        let sine = (m.x * m.x + m.y * m.y).sqrt();
        let jacobian = (2.0 * PI * PI * u_m.x * sine).max(1e-6) * 4.0 * wi.dot(m);
        let mut scale = 1.0;
        if self.jacobian {
            let u_wi = Vec2::new(unit_of_theta(theta_i), unit_of_phi(phi_i));
            let none = self.ndf.mix(&[]);
            scale = self.ndf.eval(&none, u_m) / (4.0 * self.sigma.eval(&none, u_wi));
        }
        let pdf = visible.density * bright / jacobian;
        let seen = Seen {
            incident: [phi_i, theta_i],
            place: visible.place,
            scale,
            pdf,
        };
        (pdf.is_finite() && scale.is_finite()).then_some(seen)
    }

    /// The value of a channel; 0 where it is no number.
    fn value(&self, seen: &Seen, channel: f32) -> f32 {
        let [phi_i, theta_i] = seen.incident;
        let mix = self.values.mix(&[phi_i, theta_i, channel]);
        let value = seen.scale * self.values.eval(&mix, seen.place);
        if value.is_finite() { value } else { 0.0 }
    }

    /// A direction, which may be below the surface.
    fn sample(&self, wi: Vec3<f32>, u: Vec2<f32>) -> Vec3<f32> {
        let [sx, sy] = self.fold(wi);
        let folded = Vec3::new(wi.x * sx, wi.y * sy, wi.z);
        let (theta_i, phi_i) = angles(folded);
        let at = [phi_i, theta_i];
        let bright = self
            .luminance
            .sample(&self.luminance.mix(&at), Vec2::new(u.y, u.x));
        let visible = self.vndf.sample(&self.vndf.mix(&at), bright.place);
        let theta = visible.place.x * visible.place.x * FRAC_PI_2;
        let phi = (2.0 * visible.place.y - 1.0) * PI + if self.isotropic { phi_i } else { 0.0 };
        let (sin_theta, cos_theta) = lanes::sin_cos(theta);
        let (sin_phi, cos_phi) = lanes::sin_cos_turns(phi / TAU);
        let m = Vec3::new(cos_phi * sin_theta, sin_phi * sin_theta, cos_theta);
        let wo = m * (2.0 * folded.dot(m)) - folded;
        Vec3::new(wo.x * sx, wo.y * sy, wo.z)
    }
}

/// The angle from the normal, exact near it, and the azimuth.
fn angles(v: Vec3<f32>) -> (f32, f32) {
    let across = (v.x * v.x + v.y * v.y).sqrt();
    (lanes::atan2(across, v.z), lanes::atan2(v.y, v.x))
}

fn unit_of_theta(theta: f32) -> f32 {
    (theta / FRAC_PI_2).max(0.0).sqrt()
}

fn unit_of_phi(phi: f32) -> f32 {
    (phi + PI) / TAU
}

impl<C: ColorModel> Bsdf<C> for Measured<C> {
    fn lobes(&self) -> Lobes {
        Lobes::REFLECTION
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for Measured<C> {
    /// Lane by lane: to look into tables is most of it.
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        _at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let mut pdf = F::ROW;
        let (wi, wo) = (wi.rows(), wo.rows());
        let value = Spectra::from_samples(|lane| {
            let (wi, wo) = (Vec3::<F>::of(&wi, lane), Vec3::<F>::of(&wo, lane));
            match self.tables.eval(wi.into(), wo.into()) {
                Some(seen) => {
                    pdf[lane] = seen.pdf;
                    self.color(&seen, &w[lane])
                }
                None => {
                    pdf[lane] = 0.0;
                    C::Sample::zero()
                }
            }
        });
        BsdfValues {
            value,
            pdf: F::load(&pdf),
        }
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        _u1: F,
        u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        let (mut x, mut y, mut z) = (F::ROW, F::ROW, F::ROW);
        for lane in 0..F::WIDTH {
            let seen = Vec3::<f32>::from(wi.lane(lane));
            let wo = match seen.z > 0.0 {
                true => self.tables.sample(seen, u2.lane(lane).into()),
                false => Vec3::new(0.0, 0.0, -1.0),
            };
            (x[lane], y[lane], z[lane]) = (wo.x, wo.y, wo.z);
        }
        let wo = Vec3::<F>::load(&[x, y, z]);
        self.eval_lanes(at, wi, wo, w).as_samples(wo, F::one())
    }
}
