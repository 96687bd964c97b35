//! Why an image is black: there is no light, the camera sees nothing, or light does not reach what it sees.

use glam::Vec2;

use super::prepare::Job;
use crate::accel::{Counts, Order};
use crate::color::ColorModel;
use crate::description::{Description, Kind};
use crate::error::{Error, Problem};
use crate::image::Image;
use crate::interaction::{Hit, Ray};
use crate::sensor::Film;

/// Integrators that need no light.
const DARK: [&str; 2] = ["aov", "depth"];

/// Whether the scene's integrator makes an image of light.
fn gathers_light(description: &Description) -> bool {
    let integrators = description.root().children(Kind::Integrator);
    let mut plugins: Vec<String> = Vec::new();
    let mut open: Vec<_> = integrators.iter().map(|i| i.node_id()).collect();
    while let Some(id) = open.pop() {
        plugins.push(description.node(id).plugin().to_owned());
        open.extend(description.children_of(id, Kind::Integrator));
    }
    plugins.is_empty()
        || plugins
            .iter()
            .any(|plugin| !DARK.contains(&plugin.as_str()))
}

/// The warning that a scene has no light for its integrator.
pub(super) fn no_light(description: &Description, lights: usize) -> Option<Problem> {
    if lights > 0 || !gathers_light(description) {
        return None;
    }
    let error = Error::input("the scene has no light, so its image is black")
        .at(description.root().location())
        .help("add an <emitter>, such as <emitter type=\"constant\"/>");
    error.problems().first().cloned()
}

/// The warning that a whole image is black, with the likely cause; of a scene without light it was said before.
pub(super) fn black<C: ColorModel>(
    job: &Job<'_, C>,
    description: &Description,
    image: &Image,
) -> Option<Problem> {
    let film = &job.view.film;
    let is_whole = film.crop == film.full();
    if !is_whole || job.scene.light_count() == 0 || !gathers_light(description) {
        return None;
    }
    let rgb = image.rgb()?;
    let channels = image.channels().len();
    let mut pixels = image.data().chunks(channels);
    if pixels.any(|pixel| rgb.iter().any(|c| pixel[*c] != 0.0)) {
        return None;
    }
    let (message, help) = match sees_something(job) {
        true => (
            "the image is black: the camera sees shapes, and no light comes from them",
            "an area light shines from the front of its shape alone (flip_normals turns it over), light may be shut in \
             or its radiance 0, and with a max_depth of 1 only lights are seen",
        ),
        false => (
            "the image is black: the camera sees nothing of the scene",
            "look at the sensor's to_world, near_clip and far_clip; `etendue info` tells where the scene is",
        ),
    };
    let sensors = description.sensors();
    let error = Error::input(message).help(help);
    let error = match sensors.get(job.sensor) {
        Some(sensor) => error.at(description.node(*sensor).location()),
        None => error,
    };
    error.problems().first().cloned()
}

/// Whether any of a grid of camera rays meets a shape.
fn sees_something<C: ColorModel>(job: &Job<'_, C>) -> bool {
    const MOST: u32 = 128;
    let Film { width, height, .. } = job.view.film;
    let [across, down] = [width, height].map(|n| n.min(MOST));
    let ray = |x: u32, y: u32| -> Ray {
        let place = Vec2::new(
            (x as f32 + 0.5) / across as f32,
            (y as f32 + 0.5) / down as f32,
        );
        let (open, _) = job.view.sensor.shutter();
        job.view.sensor.ray(place, Vec2::splat(0.5), open)
    };
    let rays: Vec<Ray> = (0..down)
        .flat_map(|y| (0..across).map(move |x| (x, y)))
        .map(|(x, y)| ray(x, y))
        .collect();
    let mut hits: Vec<Hit> = Vec::new();
    job.scene
        .closest(&rays, Order::Any, &mut hits, &mut Counts::default());
    hits.iter().any(|hit| !hit.is_miss())
}
