//! `sunsky`: the clear sky with its sun (see `skylight`), as a place has it at a time (by default Tokyo on 10 July 2010
//! at three in the afternoon), or with the sun in `sun_direction`, in world space. The sky's own space has z up, and by
//! time the sun goes as in Mitsuba, from −y in the morning to +y in the evening, over +x at noon north of the tropics;
//! `to_world` turns it. Directions are drawn from a table of the sky's brightness or from the sun's cone, in
//! proportion to what each of the two gives.

use std::f32::consts::TAU;

use glam::{DVec3, Mat3, Vec2, Vec3};

use super::grid::Grid;
use super::skylight::{Air, FIRST, Moment, STEP, Skylight};
use super::sun_position::{self, Date, Place, YEARS};
use super::{Emitter, LightContext, LightSample, Rotation};
use crate::color::{Bands, ColorModel, Rgb, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, Row, boolean, color, float, integer, vector};
use crate::error::Result;
use crate::interaction::Reference;
use crate::lanes;
use crate::texture::Palettes;

/// Sky and sun.
#[derive(Clone, Debug)]
pub struct SunSky<C: ColorModel> {
    light: Box<Skylight<C>>,
    moment: Box<Moment>,
    draw: Draw,
    to_world: Rotation,
}

/// How the air is, and how light is scaled.
pub(super) const AIR: &[Row] = &[
    float(
        "turbidity",
        3.0,
        "of the air: 1 is arctic, 10 a warm and humid day",
    )
    .between(1.0, 10.0),
    color("albedo", 0.3, "of the ground"),
    float("sun_scale", 1.0, "what the sun's light is multiplied by").at_least(0.0),
    float("sky_scale", 1.0, "what the sky's light is multiplied by").at_least(0.0),
    float(
        "sun_aperture",
        0.5358,
        "the sun's angle, its irradiance being the same; degrees",
    )
    .above_to(179.0),
    boolean("complex_sun", false, "whether the sun is darker at its rim"),
    super::TO_WORLD,
];

/// A date's rows.
const DATE: &[Row] = &[
    integer("year", 2010, "of the date").between(*YEARS.start(), *YEARS.end()),
    integer("month", 7, "of the date").between(1.0, 12.0),
    integer("day", 10, "of the date").between(1.0, 31.0),
    float("hour", 15.0, "of the day, by the clocks there"),
    float("minute", 0.0, "after that"),
    float("second", 0.0, "after that"),
    vector(
        "sun_direction",
        [0.0; 3],
        "toward the sun in the world, in place of time and place",
    )
    .absent("by time and place"),
];

impl Air {
    pub(super) fn build(properties: &Properties<'_>) -> Result<Self> {
        let one = Bands::<1>::visible(1).expect("one band is possible");
        let spectrum = Palettes::new(one)
            .colors
            .color(properties, "albedo", Role::Reflectance)?;
        let rgb = Palettes::new(Rgb)
            .colors
            .color(properties, "albedo", Role::Reflectance)?;
        let rgb = Rgb::evaluate(&rgb, &());
        Ok(Self {
            turbidity: properties.float("turbidity")?,
            albedo: std::array::from_fn(|i| {
                spectrum
                    .at((FIRST + STEP * i as f64) as f32)
                    .clamp(0.0, 1.0)
                    .into()
            }),
            albedo_rgb: [0, 1, 2].map(|c| rgb[c].clamp(0.0, 1.0).into()),
            sky_scale: properties.float("sky_scale")?,
            sun_scale: properties.float("sun_scale")?,
            aperture: properties.float("sun_aperture")?,
            limb: properties.boolean("complex_sun")?,
        })
    }
}

/// How directions are drawn while the sun stands at some height.
#[derive(Clone, Debug)]
pub(super) struct Draw {
    /// Over azimuths from the sun's, in turns, and cosines of the polar angle; `None` where the sky is black.
    sky: Option<Grid>,
    /// How often the sky is drawn, and not the sun.
    share: f32,
    /// Of the mean over the channels of radiance, over all directions.
    pub(super) total: f64,
}

/// Cells over azimuth and over height.
const CELLS: [usize; 2] = [128, 64];
/// Neither sky nor sun is drawn less often than that, if both shine.
const LEAST_SHARE: f64 = 0.15;
/// What every direction is drawn for at least, as a fraction of the mean.
const FLOOR: f64 = 0.02;

impl Draw {
    pub(super) fn new<C: ColorModel>(light: &Skylight<C>, moment: &Moment) -> Self {
        let [across, up] = CELLS;
        let corners: Vec<f64> = (0..=up)
            .flat_map(|y| (0..=across).map(move |x| (x, y)))
            .map(|(x, y)| {
                let place = Vec2::new(x as f32 / across as f32, y as f32 / up as f32);
                light.brightness(moment, from_place(moment.sun, place), false)
            })
            .collect();
        let at = |x: usize, y: usize| corners[y * (across + 1) + x];
        let mut cells: Vec<f64> = (0..up)
            .flat_map(|y| (0..across).map(move |x| (x, y)))
            .map(|(x, y)| 0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)))
            .collect();
        let mean = cells.iter().sum::<f64>() / cells.len() as f64;
        cells.iter_mut().for_each(|cell| *cell += FLOOR * mean);
        let sky = std::f64::consts::TAU * mean;
        let above = light.brightness(moment, moment.sun, true)
            - light.brightness(moment, moment.sun, false);
        let sun = above.max(0.0) * f64::from(light.sun_angle());
        let share = match (sky > 0.0, sun > 0.0) {
            (true, true) => (sky / (sky + sun)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE),
            (true, false) => 1.0,
            (false, _) => 0.0,
        };
        Self {
            sky: Grid::new(across, &cells),
            share: share as f32,
            total: sky + sun,
        }
    }

    /// A direction, its density and whether the sun is seen there.
    pub(super) fn sample<C: ColorModel>(
        &self,
        light: &Skylight<C>,
        moment: &Moment,
        u: Vec2,
    ) -> Option<(Vec3, f32, bool)> {
        let below = 1f32.next_down();
        let (direction, sun) = match &self.sky {
            Some(sky) if u.x < self.share => {
                let u = Vec2::new((u.x / self.share).min(below), u.y);
                let (place, _) = sky.sample::<f32>(u.into());
                let direction = from_place(moment.sun, place.into());
                (direction, light.meets_sun(moment, direction))
            }
            _ => {
                let rest = (u.x - self.share) / (1.0 - self.share);
                let u = Vec2::new(rest.clamp(0.0, below), u.y);
                (light.sun_direction(moment, u), true)
            }
        };
        let pdf = self.pdf(light, moment, direction, sun);
        (pdf > 0.0 && pdf.is_finite()).then_some((direction, pdf, sun))
    }

    /// The density of a direction.
    pub(super) fn pdf<C: ColorModel>(
        &self,
        light: &Skylight<C>,
        moment: &Moment,
        direction: Vec3,
        sun: bool,
    ) -> f32 {
        // Below the horizon, or with the sun below it, all is black.
        if direction.z < 0.0 || moment.sun.z < 0.0 || self.total <= 0.0 {
            return 0.0;
        }
        let sky = self.sky.as_ref().map_or(0.0, |sky| {
            sky.pdf::<f32>(to_place(moment.sun, direction).into()) / TAU
        });
        let sun = if sun { 1.0 / light.sun_angle() } else { 0.0 };
        self.share * sky + (1.0 - self.share) * sun
    }
}

/// The sun's azimuth, as a unit vector.
fn azimuth(sun: Vec3) -> Vec2 {
    let flat = Vec2::new(sun.x, sun.y).normalize_or_zero();
    if flat == Vec2::ZERO { Vec2::X } else { flat }
}

/// The direction at a place of the table.
fn from_place(sun: Vec3, place: Vec2) -> Vec3 {
    let (sin, cos) = lanes::sin_cos_turns(place.x);
    let across = (1.0 - place.y * place.y).max(0.0).sqrt();
    let flat = azimuth(sun).rotate(Vec2::new(cos, sin)) * across;
    flat.extend(place.y)
}

/// The place of the table at a direction.
fn to_place(sun: Vec3, direction: Vec3) -> Vec2 {
    let toward = azimuth(sun);
    let (x, y) = (
        toward.x * direction.x + toward.y * direction.y,
        toward.x * direction.y - toward.y * direction.x,
    );
    let turns = lanes::atan2(y, x) / TAU;
    let below = 1f32.next_down();
    Vec2::new(
        (turns - turns.floor()).min(below),
        direction.z.clamp(0.0, below),
    )
}

impl<C: ColorModel> SunSky<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the clear sky with its sun, by time and place",
        properties: &[AIR, sun_position::PLACE, DATE, super::SAMPLING],
    };

    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        let colors = &context.palettes.colors;
        let to_world = Rotation::of(properties)?;
        let light = Skylight::new(&colors.color, &Air::build(properties)?)
            .map_err(|why| properties.error("", why))?;
        let light = Box::new(light);
        let sun = sun(properties, &to_world)?;
        if sun.z < 0.0 {
            let warning = properties.error("", "the sun is below the horizon, and all is dark");
            colors
                .warn(warning.help("hour and timezone go together; sun_direction places the sun"));
        }
        let moment = Box::new(light.at(sun));
        Ok(Self {
            draw: Draw::new(&light, &moment),
            moment,
            light,
            to_world,
        })
    }
}

/// Where the sun is, in the sky's own space.
fn sun(properties: &Properties<'_>, to_world: &Rotation) -> Result<DVec3> {
    let given = ["year", "month", "day", "hour", "minute", "second"];
    let places = sun_position::PLACE.iter().map(|row| row.name);
    let given = given
        .into_iter()
        .chain(places)
        .find(|name| properties.has(name));
    if let Some(direction) = properties.given::<DVec3>("sun_direction")? {
        if let Some(name) = given {
            let message = format!("{name} and sun_direction exclude each other");
            return Err(properties.error(name, message));
        }
        let direction = direction.normalize_or_zero();
        if direction == DVec3::ZERO {
            let message = "a direction cannot have length 0";
            return Err(properties.error("sun_direction", message));
        }
        let own = to_world.at(0.0).as_dmat3().transpose() * direction;
        return Ok(own.normalize());
    }
    let date = Date {
        year: properties.integer("year")?,
        month: properties.integer("month")?,
        day: properties.integer("day")?,
    };
    let minutes = properties.float("minute")? + properties.float("second")? / 60.0;
    let hour = properties.float("hour")? + minutes / 60.0;
    Ok(sun_position::sun(&date, hour, &Place::build(properties)?))
}

/// A sky as it stands at a moment.
pub(super) struct Sky<'a, C: ColorModel> {
    pub(super) light: &'a Skylight<C>,
    pub(super) moment: &'a Moment,
    pub(super) draw: &'a Draw,
    pub(super) to_world: Mat3,
}

impl<C: ColorModel> Sky<'_, C> {
    pub(super) fn sample(&self, u: Vec2, w: &C::Wavelengths) -> Option<LightSample<C::Sample>> {
        let (direction, pdf, sun) = self.draw.sample(self.light, self.moment, u)?;
        Some(LightSample {
            direction: self.to_world * direction,
            target: None,
            radiance: self.light.radiance(self.moment, direction, sun, w),
            pdf,
            delta: false,
        })
    }

    /// A world direction in the sky's own space, and whether the sun is seen there.
    fn own(&self, direction: Vec3) -> (Vec3, bool) {
        let own = self.to_world.transpose() * direction;
        (own, self.light.meets_sun(self.moment, own))
    }

    pub(super) fn radiance(&self, direction: Vec3, w: &C::Wavelengths) -> C::Sample {
        let (own, sun) = self.own(direction);
        self.light.radiance(self.moment, own, sun, w)
    }

    pub(super) fn pdf(&self, direction: Vec3) -> f32 {
        let (own, sun) = self.own(direction);
        self.draw.pdf(self.light, self.moment, own, sun)
    }
}

impl<C: ColorModel> SunSky<C> {
    fn sky(&self, time: f32) -> Sky<'_, C> {
        Sky {
            light: &self.light,
            moment: &self.moment,
            draw: &self.draw,
            to_world: self.to_world.at(time),
        }
    }
}

impl<C: ColorModel> Emitter<C> for SunSky<C> {
    fn sample(
        &self,
        from: Reference,
        u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        self.sky(from.time).sample(u, wavelengths)
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
        self.sky(time).radiance(direction, wavelengths)
    }

    fn environment_pdf(&self, direction: Vec3, time: f32) -> f32 {
        self.sky(time).pdf(direction)
    }

    fn power(&self, _color: &C, radius: f64) -> f64 {
        std::f64::consts::PI * radius * radius * self.draw.total
    }
}
