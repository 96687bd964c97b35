//! `envmap`: light from all around by the image in `filename`, as latitude and longitude: u = atan2(x, −z)/2π
//! and v = acos(y)/π in the emitter's space, which `to_world` turns. `scale` multiplies the image's values.
//!
//! As in Mitsuba, a texel of a row stands in the middle of its share of the circle, but the first and the
//! last row stand at the poles. Directions are drawn cell by cell: a cell lies between four texels, and its
//! weight is their mean luminance times its solid angle, so that no direction that emits is left out.

use std::f32::consts::{PI, TAU};

use glam::{Mat3, Vec2, Vec3};

use super::block::{self, BlockEmitter};
use super::grid::Grid;
use super::{Emitter, LightContext, LightSample, LightSamples, Rotation};
use crate::color::{ColorModel, PerLane as _, Pixels, Role, Spectra as _, luminance};
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean, file, float};
use crate::error::Result;
use crate::interaction::Reference;
use crate::lanes::{self, Ints as _, Lanes, Mask as _};
use crate::texture::{Picture, Wanted};

/// An image of the surroundings.
#[derive(Clone, Debug)]
pub struct Envmap<C: ColorModel> {
    width: usize,
    height: usize,
    texels: C::Texels,
    scale: f32,
    to_world: Rotation,
    /// Over points in [0, 1]²: 0 is the first texel's centre across, the first row's down. `None` where all is black.
    cells: Option<Grid>,
    /// The mean luminance over all directions.
    mean: f64,
}

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
        let to_world = Rotation::of(properties)?;
        let picture = Picture::read(&Wanted::colors(path), properties.budget())
            .map_err(|e| e.at(properties.location()))?;
        let picture = completed(picture);
        let [width, height] = picture.size;
        let color = &context.palettes.colors.color;
        let weights = weights(&picture);
        Ok(Self {
            width,
            height,
            texels: picture.into_texels(color, Role::Emission)?,
            scale: scale as f32,
            to_world,
            cells: Grid::new(width, &weights).filter(|_| scale > 0.0),
            // A cell's weight is four times its luminance, and `width` of them fill a band of the sphere.
            mean: scale * weights.iter().sum::<f64>() / (8 * width) as f64,
        })
    }

    /// Whether it is the same at all times, so that it is written over lanes.
    pub(super) fn is_still(&self) -> bool {
        self.to_world.is_still()
    }

    /// Where directions lie, the image being turned by `to_world`.
    #[inline(always)]
    fn point<F: Lanes>(&self, to_world: &Mat3, direction: lanes::Vec3<F>) -> lanes::Vec2<F> {
        let across = |axis: Vec3| direction.dot(lanes::Vec3::all(axis));
        let Mat3 {
            x_axis,
            y_axis,
            z_axis,
        } = *to_world;
        let (x, y, z) = (across(x_axis), across(y_axis), across(z_axis));
        let half = F::splat(0.5 / self.width as f32);
        let u = lanes::atan2(x, -z) * F::splat(1.0 / TAU) - half;
        // Not the arc cosine, which has no precision at the poles.
        let v = lanes::atan2((x * x + z * z).sqrt(), y) * F::splat(1.0 / PI);
        lanes::Vec2::new(u - u.floor(), v)
    }

    /// The directions that lie there, and the sines of their polar angles.
    #[inline(always)]
    fn direction<F: Lanes>(&self, to_world: &Mat3, p: lanes::Vec2<F>) -> (lanes::Vec3<F>, F) {
        let half = F::splat(0.5 / self.width as f32);
        let (sin_phi, cos_phi) = lanes::sin_cos_turns(p.x + half);
        let (sin, cos) = lanes::sin_cos(p.y * F::splat(PI));
        let all = |axis: Vec3| lanes::Vec3::all(axis);
        let Mat3 {
            x_axis,
            y_axis,
            z_axis,
        } = *to_world;
        let world =
            all(x_axis) * (sin * sin_phi) + all(y_axis) * cos - all(z_axis) * (sin * cos_phi);
        (world.normalize(), sin)
    }

    /// The radiance of points.
    #[inline(always)]
    fn radiance<F: Lanes>(&self, p: lanes::Vec2<F>, w: &[C::Wavelengths]) -> C::Columns<F> {
        let [width, height] = [self.width, self.height].map(|n| n as u32);
        let all = |n: u32| F::Int::splat(n);
        let (qx, qy) = (
            p.x * F::splat(width as f32),
            p.y * F::splat((height - 1) as f32),
        );
        let x = qx.to_int().min(all(width - 1));
        let y = qy.to_int().min(all(height - 2));
        let (fx, fy) = (qx - x.to_float(), qy - y.to_float());
        let next = F::Int::select(x.eq(all(width - 1)), all(0), x + all(1));
        let (upper, lower) = (y * all(width), (y + all(1)) * all(width));
        let corners = [[upper + x, upper + next], [lower + x, lower + next]];
        let place = lanes::Vec2::new(fx, fy);
        C::evaluate_between(&self.texels, corners, place, w) * F::splat(self.scale)
    }

    /// Density per solid angle of a point drawn with that density.
    #[inline(always)]
    fn per_solid_angle<F: Lanes>(density: F, sine: F) -> F {
        density / (F::splat(TAU * PI) * sine.max(F::splat(LEAST_SINE)))
    }
}

/// The least rows: one at each pole and one between them.
const LEAST_ROWS: usize = 3;

/// With rows enough: those that the image lacks are its last one, as in Mitsuba.
fn completed(mut picture: Picture) -> Picture {
    let [width, height] = picture.size;
    if height >= LEAST_ROWS {
        return picture;
    }
    let last = (width * (height - 1)..width * height).cycle();
    let lacking = last.take(width * (LEAST_ROWS - height));
    let all = (0..width * height).chain(lacking);
    let pixels = all.map(|index| picture.pixels.get(index)).collect();
    picture.size[1] = LEAST_ROWS;
    picture.pixels = Pixels::Linear(pixels);
    picture
}

/// What each cell may emit, row by row.
fn weights(Picture { size, pixels, .. }: &Picture) -> Vec<f64> {
    let [width, height] = *size;
    let bright: Vec<f32> = (pixels.iter())
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

impl<C: ColorModel> Envmap<C> {
    /// Directions, the image being turned by `to_world`, and their places on it; `None` where all of it is black.
    #[inline(always)]
    fn sample_turned<F: Lanes>(
        &self,
        to_world: &Mat3,
        u: lanes::Vec2<F>,
    ) -> Option<(LightSamples<F>, lanes::Vec2<F>)> {
        let (place, density) = self.cells.as_ref()?.sample(u);
        let (direction, sine) = self.direction(to_world, place);
        let samples = LightSamples {
            direction,
            distant: F::Mask::splat(true),
            pdf: Self::per_solid_angle(density, sine),
            ..LightSamples::none()
        };
        Some((samples, place))
    }
}

impl<C: ColorModel> BlockEmitter<C> for Envmap<C> {
    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        _from: lanes::Vec3<F>,
        u: lanes::Vec2<F>,
        w: &[C::Wavelengths],
        active: F::Mask,
        radiance: &mut C::PerLane<F>,
    ) -> LightSamples<F> {
        // Of one that stands still; another is asked lane by lane.
        let Some((samples, place)) = self.sample_turned(&self.to_world.at(0.0), u) else {
            return LightSamples::none();
        };
        radiance.put_values(active, self.radiance(place, w));
        samples
    }
}

impl<C: ColorModel> Emitter<C> for Envmap<C> {
    fn sample(
        &self,
        from: Reference,
        u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        let to_world = self.to_world.at(from.time);
        let w = std::slice::from_ref(wavelengths);
        let (samples, place) = self.sample_turned::<f32>(&to_world, u.into())?;
        block::single(samples.with(self.radiance(place, w)))
    }

    fn is_environment(&self) -> bool {
        true
    }

    fn environment_radiance(
        &self,
        direction: Vec3,
        time: f32,
        wavelengths: &C::Wavelengths,
    ) -> C::Sample {
        let to_world = self.to_world.at(time);
        let place = self.point::<f32>(&to_world, direction.into());
        let w = std::slice::from_ref(wavelengths);
        self.radiance(place, w).sample(0)
    }

    fn environment_pdf(&self, direction: Vec3, time: f32) -> f32 {
        let Some(cells) = &self.cells else {
            return 0.0;
        };
        let to_world = self.to_world.at(time);
        let p = self.point::<f32>(&to_world, direction.into());
        Self::per_solid_angle(cells.pdf(p), lanes::sin_cos(PI * p.y).0)
    }

    fn power(&self, _color: &C, radius: f64) -> f64 {
        4.0 * std::f64::consts::PI.powi(2) * radius * radius * self.mean
    }
}
