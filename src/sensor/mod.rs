//! Sensors: from a place on the film, a point of the lens and a time to a ray.

mod batch;
mod distant;
mod film;
mod irradiancemeter;
mod orthographic;
mod perspective;
mod radiancemeter;
mod thinlens;

use glam::{Mat3, Mat4, Vec2, Vec3};

use crate::description::declared::{Row, float, motion, nested};
use crate::description::{Kind, LATEST, Properties};
use crate::error::Result;
use crate::family::family;
use crate::interaction::Ray;
use crate::lanes::{self, Lanes};
use crate::math::{Moving, Transform};
use crate::shape::Bounds;

pub use film::{Coordinates, FILMS, Film, PixelFormat, Window};
pub(crate) use perspective::{FIELD_OF_VIEW, tangent_x};

/// What every sensor does.
pub trait Camera: std::fmt::Debug + Send + Sync {
    /// The ray through `film` (in [0, 1]², x to the right and y down over the full film) and the lens
    /// point `lens` (in [0, 1]²), at `time`.
    fn ray(&self, film: Vec2, lens: Vec2, time: f32) -> Ray;
    /// Whether the lens point matters.
    fn has_lens(&self) -> bool {
        false
    }
    /// Whether places on the film are directions from a camera, so that [`Camera::projection`] and
    /// [`Camera::neighbours`] have a meaning. What measures light has none.
    fn is_projective(&self) -> bool {
        true
    }
    /// What the radiance along the ray through `film` is multiplied by. 1 for everything that is projective.
    fn weight(&self, _film: Vec2) -> f32 {
        1.0
    }
    /// The way back: the ray of the sensor's through the lens point `lens` that comes to `from`. `None` where none does, and
    /// of sensors that light does not find.
    fn connect(&self, _from: Vec3, _lens: Vec2, _time: f32) -> Option<Connection> {
        None
    }
    /// The density of the sensor's rays, whose places on the film are even, where they come to `at` against `direction`: per
    /// unit area at right angles.
    fn density(&self, _at: Vec3, _direction: Vec3, _time: f32) -> f32 {
        0.0
    }
    /// Whether light finds the sensor, by [`Camera::connect`].
    fn is_found(&self) -> bool {
        false
    }
    /// From world to camera space at `time`: z forward, y up, x to the image's left.
    fn world_to_camera(&self, time: f32) -> Mat4;
    /// From camera space to clip space: x right and y up in [−1, 1], z in [0, 1] from near to far.
    fn projection(&self) -> Mat4;
    /// The rays through the points of the film that lie a `step` (in units of the film, as in [`Camera::ray`]) further to
    /// the right and further down than that of `ray`, which is one of this camera's.
    fn neighbours(&self, ray: &Ray, step: Vec2) -> [Ray; 2];
    /// When the shutter is open: (open, close).
    fn shutter(&self) -> (f32, f32);
}

/// A sensor as seen from a place.
#[derive(Clone, Copy, Debug)]
pub struct Connection {
    /// The place on the film, as in [`Camera::ray`]; it may lie beside that.
    pub film: Vec2,
    /// Where the sensor's ray begins; world space.
    pub target: Vec3,
    /// Toward there, unit length.
    pub direction: Vec3,
    /// See [`Camera::density`].
    pub density: f32,
}

family! {
    /// Every sensor there is.
    #[derive(Clone, Debug)]
    pub enum Sensor: Camera, context Film {
        "batch" => Batch(batch::Batch),
        "distant" => Distant(distant::Distant),
        "irradiancemeter" => IrradianceMeter(irradiancemeter::IrradianceMeter),
        "orthographic" => Orthographic(orthographic::Orthographic),
        "perspective" => Perspective(perspective::Perspective),
        "radiancemeter" => RadianceMeter(radiancemeter::RadianceMeter),
        "thinlens" => ThinLens(thinlens::ThinLens),
    }
}

impl Sensor {
    /// Whether places on the film are directions from one eye, so that there are angles between them.
    pub fn has_field_of_view(&self) -> bool {
        matches!(self, Self::Perspective(_) | Self::ThinLens(_))
    }

    /// Tells the sensor how far the scene reaches, which is known only when that is there.
    pub fn enclose(&mut self, scene: Bounds) {
        match self {
            Self::Batch(batch) => batch.enclose(scene),
            Self::Distant(distant) => distant.enclose(scene),
            _ => {}
        }
    }

    /// The rays through places of the film and of the lens, as [`Camera::ray`], at `times`; as many as there are of these,
    /// which fit into the lanes.
    #[inline(always)]
    pub fn rays<F: Lanes>(
        &self,
        film: lanes::Vec2<F>,
        lens: lanes::Vec2<F>,
        times: &[f32],
        mut take: impl FnMut(Ray),
    ) {
        let (mount, [start, end]) = match self {
            Self::Orthographic(sensor) => (&sensor.mount, sensor.segments(film)),
            Self::Perspective(sensor) => (&sensor.mount, sensor.segments(film)),
            Self::ThinLens(sensor) => (sensor.mount(), sensor.segments(film, lens)),
            _ => {
                for (lane, time) in times.iter().enumerate() {
                    take(self.ray(film.lane(lane), lens.lane(lane), *time));
                }
                return;
            }
        };
        if !mount.to_world.is_still() {
            for (lane, time) in times.iter().enumerate() {
                take(mount.ray(start.lane(lane), end.lane(lane), *time));
            }
            return;
        }
        let rays = Mount::place(&mount.to_world.at(mount.shutter.0), [start, end]);
        let (origins, directions) = (rays.0.rows(), rays.1.rows());
        let ends = rays.2.row();
        for (lane, time) in times.iter().enumerate() {
            take(Ray {
                origin: lanes::Vec3::<F>::of(&origins, lane),
                direction: lanes::Vec3::<F>::of(&directions, lane),
                t_max: ends[lane],
                time: *time,
            });
        }
    }
}

/// What all sensors have in common.
#[derive(Clone, Debug)]
struct Mount {
    to_world: Moving,
    near: f32,
    far: f32,
    shutter: (f32, f32),
}

/// Where a sensor stands.
const TO_WORLD: Row = motion(
    "to_world",
    "from camera space (z forward, y up, x to the left) to the world",
);

/// What every camera reads besides [`COMMON`].
const MOUNT: &[Row] = &[
    TO_WORLD,
    float("near_clip", 1e-2, "what is nearer is not seen; scene units").positive(),
    float("far_clip", 1e4, "what is farther is not seen; scene units").positive(),
];

/// What every sensor reads.
const COMMON: &[Row] = &[
    float("shutter_open", 0.0, "when light begins to count").between(-LATEST, LATEST),
    float("shutter_close", 0.0, "when it ends")
        .between(-LATEST, LATEST)
        .absent("shutter_open"),
    nested(Kind::Film, "size, pixel format and filter"),
    nested(Kind::Sampler, "where samples lie, and how many"),
    nested(Kind::Medium, "what the sensor stands in"),
];

impl Mount {
    fn build(properties: &Properties<'_>) -> Result<Self> {
        let to_world = properties.motion("to_world")?;
        let near = properties.float("near_clip")?;
        let far = properties.float("far_clip")?;
        if far <= near {
            let message = format!("far_clip ({far}) must be greater than near_clip ({near})");
            return Err(properties.error("far_clip", message));
        }
        Ok(Self {
            to_world,
            near: near as f32,
            far: far as f32,
            shutter: shutter(properties)?,
        })
    }

    fn world_to_camera(&self, time: f32) -> Mat4 {
        inverse(&self.to_world, time)
    }

    /// The ray from the camera-space point `start` to `end`.
    fn ray(&self, start: Vec3, end: Vec3, time: f32) -> Ray {
        let segment = [start.into(), end.into()];
        let (origin, direction, t_max) = Self::place::<f32>(&self.to_world.at(time), segment);
        Ray {
            origin: origin.into(),
            direction: direction.into(),
            t_max,
            time,
        }
    }

    /// The density of rays in a world direction where the whole film covers `area`.
    fn density(to_world: &Transform, direction: Vec3, area: f32) -> f32 {
        let linear = to_world.linear();
        let across = linear.x_axis.cross(linear.y_axis).dot(direction).abs();
        (across * area).recip()
    }

    /// The connection of `from` with the camera-space point `start`, of a ray through the place `film`; the whole film covers
    /// `area` where `from` lies, at right angles to the camera's axis and in its space.
    fn connect(
        to_world: &Transform,
        from: Vec3,
        start: Vec3,
        film: Vec2,
        area: f32,
    ) -> Option<Connection> {
        let target = to_world.point(start);
        let direction = (target - from).try_normalize()?;
        let density = Self::density(to_world, direction, area);
        (density.is_finite() && film.is_finite()).then_some(Connection {
            film,
            target,
            direction,
            density,
        })
    }

    /// Where rays from camera-space points to others start, their directions and their lengths.
    #[inline(always)]
    fn place<F: Lanes>(
        to_world: &Transform,
        [start, end]: [lanes::Vec3<F>; 2],
    ) -> (lanes::Vec3<F>, lanes::Vec3<F>, F) {
        let linear = to_world.linear();
        let origin = product(linear, start) + lanes::Vec3::all(to_world.translation());
        // Through the linear part: the difference of two far points would cancel.
        let way = product(linear, end - start);
        let length = way.length();
        (origin, way / length, length)
    }
}

/// The inverse of `to_world` at `time`.
fn inverse(to_world: &Moving, time: f32) -> Mat4 {
    let inverse = to_world.at(time).inverse();
    Mat4::from_translation(inverse.translation()) * Mat4::from_mat3(inverse.linear())
}

/// When the shutter is open: (open, close).
fn shutter(properties: &Properties<'_>) -> Result<(f32, f32)> {
    let open = properties.float("shutter_open")?;
    let close = properties.given("shutter_close")?.unwrap_or(open);
    if close < open {
        let message = format!("shutter_close ({close}) lies before shutter_open ({open})");
        return Err(properties.error("shutter_close", message));
    }
    Ok((open as f32, close as f32))
}

/// A matrix times vectors.
#[inline(always)]
fn product<F: Lanes>(matrix: Mat3, v: lanes::Vec3<F>) -> lanes::Vec3<F> {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(lanes::Vec3::<F>::all);
    x * v.x + y * v.y + z * v.z
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::description::declared::Preset;
    use crate::description::{Description, Options};

    /// Every camera of the family, with the least that it needs.
    fn every_camera(film: &Film) -> impl Iterator<Item = (&'static str, Sensor)> {
        let cameras = Sensor::PLUGINS
            .iter()
            .filter(|(_, plugin)| plugin.row("near_clip").is_some());
        cameras.map(|(name, plugin)| {
            let required = plugin.rows().filter(|row| row.preset == Preset::Required);
            let needs: String = required
                .map(|row| format!("<float name='{}' value='{}'/>", row.name, row.range.least))
                .collect();
            let text = format!(
                "<scene version='3.0.0'><sensor type='{name}'>{needs}<float name='near_clip' value='0.5'/>
                <transform name='to_world'><lookat origin='1,2,3' target='4,0,1' up='0,0,1'/></transform></sensor></scene>"
            );
            let scene = Description::parse(&text, Path::new("test.xml"), &Options::default());
            let sensor = Sensor::build(&scene.unwrap().root().children(Kind::Sensor)[0], film);
            (*name, sensor.unwrap())
        })
    }

    #[test]
    fn every_camera_s_rays_go_from_near_to_far_where_its_projection_puts_them() {
        let film = Film {
            width: 200,
            height: 100,
            ..Film::default()
        };
        for (name, sensor) in every_camera(&film) {
            for (x, y) in [(0.5, 0.5), (0.8, 0.3), (0.01, 0.99)] {
                let ray = sensor.ray(Vec2::new(x, y), Vec2::splat(0.5), 0.0);
                assert!((ray.direction.length() - 1.0).abs() < 1e-5, "{name}");
                for (t, depth) in [(0.0, 0.0), (ray.t_max, 1.0)] {
                    let world = ray.at(t).extend(1.0);
                    let clip = sensor.projection() * sensor.world_to_camera(0.0) * world;
                    let found = clip.truncate() / clip.w;
                    let expected = Vec3::new(2.0 * x - 1.0, 1.0 - 2.0 * y, depth);
                    assert!(
                        (found - expected).length() < 3e-3,
                        "{name}: {found} {expected}"
                    );
                }
            }
        }
    }

    /// What a ray comes to is connected with the place on the film and the point of the lens that it went through.
    #[test]
    fn every_camera_is_found_where_its_rays_come_from() {
        let film = Film {
            width: 200,
            height: 100,
            ..Film::default()
        };
        for (name, sensor) in every_camera(&film) {
            assert!(sensor.is_found(), "{name}");
            let lens = Vec2::new(0.3, 0.8);
            for place in [Vec2::splat(0.5), Vec2::new(0.8, 0.3), Vec2::new(0.01, 0.99)] {
                let ray = sensor.ray(place, lens, 0.0);
                let (from, step) = (ray.at(2.0), 1e-2);
                let found = sensor.connect(from, lens, 0.0).unwrap();
                assert!((found.film - place).length() < 1e-4, "{name} {found:?}");
                assert!(found.target.distance(ray.origin) < 1e-4, "{name} {found:?}");
                assert!(found.direction.distance(-ray.direction) < 1e-4, "{name}");
                // The area at right angles that a piece of the film covers, by neighbours through the same point of the lens.
                let beside = |x, y| {
                    let ray = sensor.ray(place + step * Vec2::new(x, y), lens, 0.0);
                    let way = from - ray.origin;
                    let t = way.dot(found.direction) / ray.direction.dot(found.direction);
                    ray.at(t)
                };
                let [right, left] = [beside(1.0, 0.0), beside(-1.0, 0.0)];
                let [down, up] = [beside(0.0, 1.0), beside(0.0, -1.0)];
                let area = (right - left).cross(down - up).length() / (4.0 * step * step);
                assert_eq!(found.density, sensor.density(from, found.direction, 0.0));
                let product = area * found.density;
                assert!((product - 1.0).abs() < 1e-2, "{name} {product}");
            }
        }
    }

    #[test]
    fn every_camera_without_a_lens_ignores_the_place_on_it() {
        for (name, sensor) in every_camera(&Film::default()) {
            let through = |lens| sensor.ray(Vec2::new(0.3, 0.6), lens, 0.0);
            let same = through(Vec2::new(0.1, 0.2)) == through(Vec2::new(0.9, 0.4));
            // An aperture of radius 0 is no lens either.
            assert!(same, "{name}");
        }
    }
}
