//! `envmap`: light from all around by the image in `filename`, as latitude and longitude: u = atan2(x, −z)/2π
//! and v = acos(y)/π in the emitter's space, which `to_world` turns. `scale` multiplies the image's values.
//!
//! As in Mitsuba, a texel of a row stands in the middle of its share of the circle, but the first and the
//! last row stand at the poles. Directions are drawn cell by cell: a cell lies between four texels, and its
//! weight is their mean luminance times its solid angle, so that no direction that emits is left out.

use std::f32::consts::{PI, TAU};

use glam::{Mat3, Vec2, Vec3};

use super::block::{self, BlockEmitter};
use super::{Emitter, LightContext, LightSample, LightSamples, rotation};
use crate::color::{ColorModel, Role, Spectra, Spectral, luminance};
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean, file, float};
use crate::error::Result;
use crate::lanes::{self, Lanes, Mask as _};
use crate::math::distribution::Grid;
use crate::texture::Picture;

/// An image of the surroundings.
#[derive(Clone, Debug)]
pub struct Envmap<C: ColorModel> {
    width: usize,
    height: usize,
    texels: Vec<C::Texel>,
    scale: f32,
    to_world: Mat3,
    /// Over [`Point`]s; `None` where all is black.
    cells: Option<Grid>,
    /// The mean luminance over all directions.
    mean: f64,
}

/// A place on the grid of cells, in [0, 1]²: 0 is the first texel's centre across, the first row's down.
type Point = Vec2;

/// The smallest sine of the polar angle that densities know of.
const LEAST_SINE: f32 = 1e-7;

impl<C: ColorModel> Envmap<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "an image all around, by longitude and latitude",
        properties: &[
            &[
                file("filename", "the image"),
                float("scale", 1.0, "what radiance is multiplied by").at_least(0.0),
                boolean(
                    "mis_compensation",
                    false,
                    "which directions are drawn is free",
                )
                .without_effect(),
                super::TO_WORLD,
            ],
            super::SAMPLING,
        ],
    };

    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        let path = properties.file("filename")?;
        let scale = properties.float("scale")?;
        let to_world = rotation(properties)?;
        let picture = Picture::read(&path, false, properties.budget())
            .map_err(|e| e.at(properties.location()))?;
        let [width, height] = size(&picture);
        let color = &context.palettes.colors.color;
        let weights = weights(&picture);
        Ok(Self {
            width,
            height,
            texels: texels(&picture)
                .map(|rgb| color.texel(rgb, Role::Emission))
                .collect(),
            scale: scale as f32,
            to_world,
            cells: Grid::new(width, &weights).filter(|_| scale > 0.0),
            // A cell's weight is four times its luminance, and `width` of them fill a band of the sphere.
            mean: scale * weights.iter().sum::<f64>() / (8 * width) as f64,
        })
    }

    /// Where directions lie.
    #[inline(always)]
    fn point<F: Lanes>(&self, direction: lanes::Vec3<F>) -> lanes::Vec2<F> {
        let across = |axis: Vec3| direction.dot(lanes::Vec3::all(axis));
        let Mat3 {
            x_axis,
            y_axis,
            z_axis,
        } = self.to_world;
        let (x, y, z) = (across(x_axis), across(y_axis), across(z_axis));
        let half = F::splat(0.5 / self.width as f32);
        let u = lanes::atan2(x, -z) * F::splat(1.0 / TAU) - half;
        // Not the arc cosine, which has no precision at the poles.
        let v = lanes::atan2((x * x + z * z).sqrt(), y) * F::splat(1.0 / PI);
        lanes::Vec2::new(u - u.floor(), v)
    }

    /// The directions that lie there, and the sines of their polar angles.
    #[inline(always)]
    fn direction<F: Lanes>(&self, p: lanes::Vec2<F>) -> (lanes::Vec3<F>, F) {
        let half = F::splat(0.5 / self.width as f32);
        let (sin_phi, cos_phi) = lanes::sin_cos_turns(p.x + half);
        let (sin, cos) = lanes::sin_cos(p.y * F::splat(PI));
        let all = |axis: Vec3| lanes::Vec3::all(axis);
        let Mat3 {
            x_axis,
            y_axis,
            z_axis,
        } = self.to_world;
        let world =
            all(x_axis) * (sin * sin_phi) + all(y_axis) * cos - all(z_axis) * (sin * cos_phi);
        (world.normalize(), sin)
    }

    #[inline(always)]
    fn radiance(&self, p: Point, wavelengths: &C::Wavelengths) -> C::Sample {
        let q = p * Vec2::new(self.width as f32, (self.height - 1) as f32);
        let x = (q.x as usize).min(self.width - 1);
        let y = (q.y as usize).min(self.height - 2);
        let f = q - Vec2::new(x as f32, y as f32);
        let texel = |x, y| C::evaluate_texel(&self.texels[y * self.width + x], wavelengths);
        let next = (x + 1) % self.width;
        let row = |y| texel(x, y) * (1.0 - f.x) + texel(next, y) * f.x;
        (row(y) * (1.0 - f.y) + row(y + 1) * f.y) * self.scale
    }

    /// Density per solid angle of a point drawn with that density.
    #[inline(always)]
    fn per_solid_angle<F: Lanes>(density: F, sine: F) -> F {
        density / (F::splat(TAU * PI) * sine.max(F::splat(LEAST_SINE)))
    }
}

/// Columns and rows: one at each pole and one between them at the least.
fn size(picture: &Picture) -> [usize; 2] {
    let [width, height] = picture.size();
    [width, height.max(3)]
}

/// The texels of all rows; those that the image lacks are its last one, as in Mitsuba.
fn texels(picture: &Picture) -> impl Iterator<Item = [f32; 3]> {
    let last = picture.size()[1] - 1;
    (0..size(picture)[1]).flat_map(move |y| picture.row(y.min(last)))
}

/// What each cell may emit, row by row.
fn weights(picture: &Picture) -> Vec<f64> {
    let [width, height] = size(picture);
    let bright: Vec<f32> = texels(picture)
        .map(|rgb| luminance(rgb.map(f32::abs)))
        .collect();
    let cosine = |row: usize| (std::f64::consts::PI * row as f64 / (height - 1) as f64).cos();
    let mut weights = Vec::with_capacity(width * (height - 1));
    for y in 0..height - 1 {
        let angle = cosine(y) - cosine(y + 1);
        let column = |x| f64::from(bright[y * width + x]) + f64::from(bright[(y + 1) * width + x]);
        weights.extend((0..width).map(|x| angle * (column(x) + column((x + 1) % width))));
    }
    weights
}

impl<C: ColorModel> BlockEmitter<C> for Envmap<C> {
    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        _from: lanes::Vec3<F>,
        u: lanes::Vec2<F>,
        w: &[C::Wavelengths],
        active: F::Mask,
    ) -> LightSamples<F, C::Columns<F>> {
        let Some(cells) = &self.cells else {
            return LightSamples::none();
        };
        let (mut place, mut density) = ([F::ROW; 2], F::ROW);
        // First all cells, then all texels: so lanes wait for memory together, and not one after another.
        for lane in active.lanes() {
            let cell = cells.sample(u.lane(lane));
            (place[0][lane], place[1][lane]) = (cell.place.x, cell.place.y);
            density[lane] = cell.density;
        }
        let there = active.to_bits();
        let radiance = Spectra::from_samples(|lane| {
            if there >> lane & 1 == 0 {
                return C::Sample::zero();
            }
            self.radiance(Vec2::new(place[0][lane], place[1][lane]), &w[lane])
        });
        let (direction, sine) = self.direction(lanes::Vec2::<F>::load(&place));
        LightSamples {
            direction,
            distant: F::Mask::splat(true),
            radiance,
            pdf: Self::per_solid_angle(F::load(&density), sine),
            ..LightSamples::none()
        }
    }
}

impl<C: ColorModel> Emitter<C> for Envmap<C> {
    fn sample(
        &self,
        from: Vec3,
        u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        block::single_sample(self, from, u, wavelengths)
    }

    fn is_environment(&self) -> bool {
        true
    }

    fn environment_radiance(&self, direction: Vec3, wavelengths: &C::Wavelengths) -> C::Sample {
        self.radiance(self.point::<f32>(direction.into()).into(), wavelengths)
    }

    fn environment_pdf(&self, direction: Vec3) -> f32 {
        let Some(cells) = &self.cells else {
            return 0.0;
        };
        let p = Vec2::from(self.point::<f32>(direction.into()));
        Self::per_solid_angle(cells.pdf(p), lanes::sin_cos(PI * p.y).0)
    }

    fn power(&self, _color: &C, radius: f64) -> f64 {
        4.0 * std::f64::consts::PI.powi(2) * radius * radius * self.mean
    }
}
