//! `timed_sunsky`: the sky of a `sunsky` whose sun goes its way while the shutter is open: from `shutter_open` to
//! `shutter_close` pass all days from the start date to the end date, each from `window_start_time` to
//! `window_end_time`. Directions are drawn from tables for some heights of the sun, the nearest being taken.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};

use super::skylight::{Air, Skylight};
use super::sun_position::{self, Date, Place, YEARS};
use super::sunsky::{AIR, Draw, Sky};
use super::{Emitter, LightContext, LightSample, Rotation};
use crate::color::{ColorModel, Spectral as _};
use crate::description::Properties;
use crate::description::declared::{Plugin, Row, float, integer};
use crate::error::Result;
use crate::interaction::Reference;

/// Sky and moving sun.
#[derive(Clone, Debug)]
pub struct TimedSunSky<C: ColorModel> {
    light: Box<Skylight<C>>,
    clock: Clock,
    /// By height of the sun, from the horizon to the zenith.
    draws: Arc<[Draw]>,
    to_world: Rotation,
}

/// Which hour it is while the shutter is open.
#[derive(Clone, Debug)]
struct Clock {
    place: Place,
    start: Date,
    /// At least 1.
    days: f64,
    /// Hours of each day.
    window: [f64; 2],
    shutter: [f64; 2],
}

/// Heights of the sun for which there are tables.
const HEIGHTS: usize = 16;

const fn date(name: &'static str, preset: i64, most: f64) -> Row {
    integer(name, preset, "of the first day").between(1.0, most)
}

const TIMES: &[Row] = &[
    integer("start_year", 2025, "of the first day").between(*YEARS.start(), *YEARS.end()),
    date("start_month", 1, 12.0),
    date("start_day", 1, 31.0),
    integer("end_year", 2026, "of the day after the last")
        .between(*YEARS.start(), *YEARS.end())
        .absent("the one after start_year"),
    integer("end_month", 1, "of the day after the last")
        .between(1.0, 12.0)
        .absent("start_month"),
    integer("end_day", 1, "of the day after the last")
        .between(1.0, 31.0)
        .absent("start_day"),
    float("window_start_time", 7.0, "where each day begins; hours").between(0.0, 24.0),
    float("window_end_time", 19.0, "where each day ends; hours").between(0.0, 24.0),
    float("shutter_open", 0.0, "when the first day begins"),
    float("shutter_close", 1.0, "when the last day ends"),
];

impl Clock {
    fn build(properties: &Properties<'_>) -> Result<Self> {
        let start = Date {
            year: properties.integer("start_year")?,
            month: properties.integer("start_month")?,
            day: properties.integer("start_day")?,
        };
        let or =
            |name, other| Ok::<i64, crate::error::Error>(properties.given(name)?.unwrap_or(other));
        let end = Date {
            year: or("end_year", start.year + 1)?,
            month: or("end_month", start.month)?,
            day: or("end_day", start.day)?,
        };
        let days = end.days() - start.days();
        if days < 0.0 {
            return Err(properties.error("end_year", "the last day lies before the first"));
        }
        let pair = |from: &str, to: &str| {
            let (a, b) = (properties.float(from)?, properties.float(to)?);
            match a <= b {
                true => Ok([a, b]),
                false => {
                    let message = format!("{to} ({b}) lies before {from} ({a})");
                    Err(properties.error(to, message))
                }
            }
        };
        Ok(Self {
            place: Place::build(properties)?,
            start,
            days: days.max(1.0),
            window: pair("window_start_time", "window_end_time")?,
            shutter: pair("shutter_open", "shutter_close")?,
        })
    }

    /// Where the sun is, in the sky's own space.
    fn sun(&self, time: f32) -> DVec3 {
        let [open, close] = self.shutter;
        let share = match close > open {
            true => ((f64::from(time) - open) / (close - open)).clamp(0.0, 1.0),
            false => 0.0,
        };
        let passed = share * self.days;
        let day = passed.floor().min(self.days - 1.0);
        let date = Date {
            day: self.start.day + day as i64,
            ..self.start
        };
        let [begin, end] = self.window;
        let hour = begin + (end - begin) * (passed - day);
        sun_position::sun(&date, hour, &self.place)
    }
}

impl<C: ColorModel> TimedSunSky<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the clear sky with a sun that goes its way while the shutter is open",
        properties: &[AIR, sun_position::PLACE, TIMES, super::SAMPLING],
    };

    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        let color = &context.palettes.colors.color;
        let light = Skylight::new(color, &Air::build(properties)?)
            .map_err(|why| properties.error("", why))?;
        let draw = |i: usize| {
            let (sin, cos) = (std::f64::consts::FRAC_PI_2 * height(i)).sin_cos();
            Draw::new(&light, &light.at(DVec3::new(cos, 0.0, sin)))
        };
        Ok(Self {
            draws: (0..HEIGHTS).map(draw).collect(),
            clock: Clock::build(properties)?,
            to_world: Rotation::of(properties)?,
            light: Box::new(light),
        })
    }

    /// Asks the sky as it stands at a time; `None` while it is dark.
    fn with_sky<T>(&self, time: f32, ask: impl FnOnce(Sky<'_, C>) -> T) -> Option<T> {
        let sun = self.clock.sun(time);
        let elevation = sun.z.clamp(-1.0, 1.0).asin() / std::f64::consts::FRAC_PI_2;
        let index = ((elevation * HEIGHTS as f64) as usize).min(HEIGHTS - 1);
        (sun.z >= 0.0).then(|| {
            ask(Sky {
                light: &self.light,
                moment: &self.light.at(sun),
                draw: &self.draws[index],
                to_world: self.to_world.at(time),
            })
        })
    }
}

/// The middle of a table's heights, as a share of the right angle.
fn height(i: usize) -> f64 {
    (i as f64 + 0.5) / HEIGHTS as f64
}

impl<C: ColorModel> Emitter<C> for TimedSunSky<C> {
    fn sample(
        &self,
        from: Reference,
        u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        self.with_sky(from.time, |sky| sky.sample(u, wavelengths))?
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
        let radiance = self.with_sky(time, |sky| sky.radiance(direction, wavelengths));
        radiance.unwrap_or(C::Sample::zero())
    }

    fn environment_pdf(&self, direction: Vec3, time: f32) -> f32 {
        self.with_sky(time, |sky| sky.pdf(direction)).unwrap_or(0.0)
    }

    fn power(&self, _color: &C, radius: f64) -> f64 {
        let totals = self.draws.iter().map(|draw| draw.total);
        std::f64::consts::PI * radius * radius * totals.sum::<f64>() / HEIGHTS as f64
    }
}
