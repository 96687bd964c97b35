//! `measured`: a material as a gonio-photometer has seen it, from the tensor files of EPFL's Realistic Graphics Lab
//! (Dupuy and Jakob, *An adaptive parameterization for efficient material acquisition and rendering*, 2018). Half vectors
//! are drawn as the file's microfacets are visible, and then as the file's luminance says; the value there is looked up
//! where the two warps have come from. Files in RGB are read and rendered in RGB.

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
    /// What a unit of red, of green and of blue is.
    basis: [C::Stored; 3],
}

#[derive(Debug)]
struct Tables {
    ndf: Warp2D,
    sigma: Warp2D,
    vndf: Warp2D,
    luminance: Warp2D,
    rgb: Warp2D,
    isotropic: bool,
    /// How many parts of the circle of azimuths are alike.
    symmetry: u32,
    /// Whether values are to be multiplied by the density of facets.
    jacobian: bool,
}

/// A value and the density of its direction.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    rgb: [f32; 3],
    pdf: f32,
}

impl<C: ColorModel> Measured<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a material that was measured, in RGB",
        properties: &[&[file("filename", "a tensor file (.bsdf) with values in RGB")]],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let path = properties.file("filename")?;
        let color = &palettes.colors.color;
        let tensors = TensorFile::read(&path, properties.budget())
            .map_err(|e| e.at(properties.location()))?;
        let fails = |what: &str| format!("{}: measured materials {what}", path.display());
        let unsupported = match (color.is_rgb(), tensors.has("rgb")) {
            (true, true) => None,
            (false, _) => Some("are rendered in RGB alone, and not in bands"),
            (true, false) => Some("are read in RGB alone, and this one is spectral"),
        };
        if let Some(what) = unsupported {
            return Err(Error::unsupported(fails(what)).at(properties.location()));
        }
        let tables = Tables::new(tensors)
            .map_err(|why| properties.error("filename", format!("{}: {why}", path.display())))?;
        let units = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let [r, g, b] = units.map(|unit| color.store(&Color::Rgb(unit), Role::Quantity));
        let stored = |unit: std::result::Result<C::Stored, String>| {
            unit.map_err(|why| properties.error("filename", why))
        };
        Ok(Self {
            tables: Arc::new(tables),
            basis: [stored(r)?, stored(g)?, stored(b)?],
        })
    }

    fn color(&self, rgb: [f32; 3], w: &C::Wavelengths) -> C::Sample {
        let mut sum = C::Sample::zero();
        for (stored, value) in self.basis.iter().zip(rgb) {
            sum += C::evaluate(stored, w) * value;
        }
        sum
    }
}

impl Tables {
    fn new(mut file: TensorFile) -> std::result::Result<Self, String> {
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
        let Array { shape, values } = file.array("rgb", 5)?;
        let [phis, thetas, channels, height, width] = shape[..] else {
            return Err("rgb has no five dimensions".to_owned());
        };
        if [phis, thetas] != outer || channels != 3 || [width, height] != size {
            return Err("rgb is of another size than luminance".to_owned());
        }
        let mut by_channel = parameters();
        by_channel.push(vec![0.0, 1.0, 2.0]);
        let jacobian = file.array("jacobian", 1)?.values[0] != 0.0;
        let reach = phi[phi.len() - 1] - phi[0];
        let isotropic = phi.len() <= 2;
        Ok(Self {
            ndf,
            sigma,
            vndf,
            luminance,
            rgb: Warp2D::table(size, by_channel, values),
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

    /// The value and the density of a pair of directions above the surface.
    fn eval(&self, wi: Vec3<f32>, wo: Vec3<f32>) -> Seen {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return Seen::default();
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
        let value = |channel: f32| {
            let mix = self.rgb.mix(&[phi_i, theta_i, channel]);
            scale * self.rgb.eval(&mix, visible.place)
        };
        let seen = Seen {
            rgb: [value(0.0), value(1.0), value(2.0)],
            pdf: visible.density * bright / jacobian,
        };
        match seen.pdf.is_finite() && seen.rgb.iter().all(|v| v.is_finite()) {
            true => seen,
            false => Seen::default(),
        }
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
            let seen = self.tables.eval(wi.into(), wo.into());
            pdf[lane] = seen.pdf;
            self.color(seen.rgb, &w[lane])
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
