//! `perspective`: a pinhole. The field of view is `fov` in degrees along `fov_axis` (x, y, diagonal,
//! smaller, larger), or follows from `focal_length` (50mm by default) as on 35 mm film, whose diagonal
//! it takes. `principal_point_offset_x` and `_y` (0) move the picture to the left and up, by that part of its width and
//! height. Geometry nearer than `near_clip` or beyond `far_clip` is not seen.

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::{Camera, Connection, Film, Mount};
use crate::description::Properties;
use crate::description::declared::{Plugin, Row, choice, float, string};
use crate::error::{Error, Result};
use crate::interaction::Ray;
use crate::lanes::{self, Lanes};

/// A pinhole camera.
#[derive(Clone, Debug)]
pub struct Perspective {
    pub(super) mount: Mount,
    /// Half the extent of the film at distance 1, in camera space.
    half: Vec2,
    /// How far the picture is moved to the left and up, in fractions of the film.
    principal_point: Vec2,
}

/// Half the diagonal of 35 mm film (36 × 24 mm), in mm.
const HALF_DIAGONAL: f64 = 21.633_307_652_783_937;

/// How wide the view is.
pub(crate) const FIELD_OF_VIEW: &[Row] = &[
    float("fov", 0.0, "field of view in degrees, below 180")
        .positive()
        .absent("from focal_length"),
    choice(
        "fov_axis",
        &["x", "y", "diagonal", "smaller", "larger"],
        "along which side of the film fov is meant",
    ),
    string(
        "focal_length",
        "50mm",
        "as on 35 mm film, whose diagonal it takes; not beside fov",
    ),
];

/// The tangent of half the horizontal field of view.
pub(crate) fn tangent_x(properties: &Properties<'_>, aspect: f64) -> Result<f64> {
    let diagonal = (1.0 + 1.0 / (aspect * aspect)).sqrt();
    let Some(fov) = properties.given::<f64>("fov")? else {
        let text = properties.string("focal_length")?;
        let length = text.trim().trim_end_matches("mm").trim().parse::<f64>();
        return match length {
            Ok(f) if f > 0.0 && f.is_finite() => Ok(HALF_DIAGONAL / f / diagonal),
            _ => Err(properties
                .error("focal_length", format!("\"{text}\" is not a focal length"))
                .help("write it as 50mm")),
        };
    };
    if properties.has("focal_length") {
        return Err(properties.error("focal_length", "fov and focal_length exclude each other"));
    }
    if fov >= 180.0 {
        return Err(properties.error("fov", "a field of view is less than 180°"));
    }
    let tangent = (fov.to_radians() / 2.0).tan();
    Ok(match properties.choice("fov_axis")? {
        "y" => tangent * aspect,
        "diagonal" => tangent / diagonal,
        "smaller" => {
            if aspect > 1.0 {
                tangent * aspect
            } else {
                tangent
            }
        }
        "larger" => {
            if aspect > 1.0 {
                tangent
            } else {
                tangent * aspect
            }
        }
        _ => tangent,
    })
}

impl Perspective {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a pinhole",
        properties: &[
            super::MOUNT,
            super::COMMON,
            FIELD_OF_VIEW,
            &[
                float(
                    "principal_point_offset_x",
                    0.0,
                    "shift of the picture, in widths",
                ),
                float(
                    "principal_point_offset_y",
                    0.0,
                    "shift of the picture, in heights",
                ),
                float("focus_distance", 1e4, "everything is sharp")
                    .positive()
                    .without_effect(),
            ],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, film: &Film) -> Result<Self> {
        let shift = |name| Ok::<_, Error>(properties.float(name)? as f32);
        Ok(Self {
            principal_point: Vec2::new(
                shift("principal_point_offset_x")?,
                shift("principal_point_offset_y")?,
            ),
            ..Self::centred(properties, film)?
        })
    }

    /// The camera whose axis goes through the middle of the picture.
    pub(super) fn centred(properties: &Properties<'_>, film: &Film) -> Result<Self> {
        let tangent = tangent_x(properties, film.aspect())?;
        Ok(Self {
            mount: Mount::build(properties)?,
            half: Vec2::new(tangent as f32, (tangent / film.aspect()) as f32),
            principal_point: Vec2::ZERO,
        })
    }

    /// In camera space, the ways from near to far that leave points of the lens for where the pinhole's have depth `focus`.
    #[inline(always)]
    pub(super) fn segments_through<F: Lanes>(
        &self,
        film: lanes::Vec2<F>,
        lens: lanes::Vec2<F>,
        focus: f32,
    ) -> [lanes::Vec3<F>; 2] {
        let all = |v: Vec2| lanes::Vec2::<F>::all(v);
        let place = (film + all(self.principal_point)) * F::splat(2.0);
        let p = (all(Vec2::ONE) - place).scale(all(self.half));
        // At depth 1; from the lens's centre it is the pinhole's own.
        let way = (p - lens / F::splat(focus)).extend(F::one());
        let start = lens.extend(F::zero());
        let Mount { near, far, .. } = self.mount;
        [start + way * F::splat(near), start + way * F::splat(far)]
    }

    /// The same from the pinhole.
    #[inline(always)]
    pub(super) fn segments<F: Lanes>(&self, film: lanes::Vec2<F>) -> [lanes::Vec3<F>; 2] {
        self.segments_through(film, lanes::Vec2::splat(0.0), 1.0)
    }

    /// The rays beside `ray`, from points that lie by `spread` of the way between them beside its origin.
    pub(super) fn rays_beside(&self, ray: &Ray, step: Vec2, spread: f32) -> [Ray; 2] {
        let to_world = self.mount.to_world.at(ray.time);
        let way = to_world.inverse().vector(ray.direction);
        let way = way / way.z;
        let steps = -2.0 * step * self.half;
        [Vec3::X * steps.x, Vec3::Y * steps.y].map(|step| Ray {
            origin: ray.origin + to_world.vector(step * spread),
            direction: to_world.vector(way + step).normalize(),
            ..*ray
        })
    }

    /// The connection through a point of the lens, as [`Self::segments_through`] has them.
    pub(super) fn connect_through(
        &self,
        from: Vec3,
        lens: Vec2,
        focus: f32,
        time: f32,
    ) -> Option<Connection> {
        let Mount { near, far, .. } = self.mount;
        let to_world = self.mount.to_world.at(time);
        let local = to_world.inverse().point(from);
        if !(near..=far).contains(&local.z) {
            return None;
        }
        // At depth 1.
        let way = (local.truncate() - lens) / local.z;
        let place = Vec2::ONE - (way + lens / focus) / self.half;
        let film = 0.5 * place - self.principal_point;
        let start = (lens + way * near).extend(near);
        Mount::connect(&to_world, from, start, film, self.area(local.z))
    }

    /// What the film covers at a depth, in camera space.
    fn area(&self, depth: f32) -> f32 {
        4.0 * self.half.x * self.half.y * depth * depth
    }

    /// The near clipping distance.
    pub(super) fn near(&self) -> f32 {
        self.mount.near
    }

    /// The far clipping distance.
    pub(super) fn far(&self) -> f32 {
        self.mount.far
    }
}

impl Camera for Perspective {
    fn ray(&self, film: Vec2, _lens: Vec2, time: f32) -> Ray {
        let [start, end] = self.segments::<f32>(film.into());
        self.mount.ray(start.into(), end.into(), time)
    }

    fn connect(&self, from: Vec3, _lens: Vec2, time: f32) -> Option<Connection> {
        self.connect_through(from, Vec2::ZERO, 1.0, time)
    }

    fn density(&self, at: Vec3, direction: Vec3, time: f32) -> f32 {
        let to_world = self.mount.to_world.at(time);
        let depth = to_world.inverse().point(at).z;
        Mount::density(&to_world, direction, self.area(depth))
    }

    fn is_found(&self) -> bool {
        true
    }

    /// All begin where `ray` does, as in Mitsuba.
    fn neighbours(&self, ray: &Ray, step: Vec2) -> [Ray; 2] {
        self.rays_beside(ray, step, 0.0)
    }

    fn world_to_camera(&self, time: f32) -> Mat4 {
        self.mount.world_to_camera(time)
    }

    fn projection(&self) -> Mat4 {
        let (near, far) = (self.mount.near, self.mount.far);
        let depth = far / (far - near);
        Mat4::from_cols(
            Vec4::new(-1.0 / self.half.x, 0.0, 0.0, 0.0),
            Vec4::new(0.0, 1.0 / self.half.y, 0.0, 0.0),
            Vec4::new(
                -2.0 * self.principal_point.x,
                2.0 * self.principal_point.y,
                depth,
                1.0,
            ),
            Vec4::new(0.0, 0.0, -near * depth, 0.0),
        )
    }

    fn shutter(&self) -> (f32, f32) {
        self.mount.shutter
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Description, Kind, Options};
    use std::path::Path;

    fn camera(inside: &str, film: &Film) -> Result<Perspective> {
        let text = format!(
            r#"<scene version="3.0.0"><sensor type="perspective">{inside}</sensor></scene>"#
        );
        let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
        Perspective::build(
            &scene.root().children(Kind::Sensor)[0].declared(&Perspective::PLUGIN),
            film,
        )
    }

    #[test]
    fn the_field_of_view_lies_along_the_axis_that_is_named() {
        let film = Film {
            width: 200,
            height: 100,
            ..Film::default()
        };
        let half = (15f32).to_radians().tan();
        let cases = [
            ("x", half, half / 2.0),
            ("y", half * 2.0, half),
            ("smaller", half * 2.0, half),
            ("larger", half, half / 2.0),
            ("diagonal", half * 0.8f32.sqrt(), half * 0.2f32.sqrt()),
        ];
        for (axis, x, y) in cases {
            let inside = format!(
                r#"<float name="fov" value="30"/><string name="fov_axis" value="{axis}"/>"#
            );
            let camera = camera(&inside, &film).unwrap();
            assert!(
                (camera.half - Vec2::new(x, y)).length() < 1e-6,
                "{axis}: {}",
                camera.half
            );
        }
        assert!(camera(r#"<float name="fov" value="180"/>"#, &film).is_err());
    }

    #[test]
    fn the_projection_takes_a_ray_s_points_to_its_place_on_the_film() {
        let film = Film {
            width: 200,
            height: 100,
            ..Film::default()
        };
        let inside = r#"<float name="principal_point_offset_x" value="0.1"/>
            <float name="principal_point_offset_y" value="-0.25"/><transform name="to_world"><lookat origin="1,2,3" target="4,0,1" up="0,0,1"/></transform>"#;
        let camera = camera(inside, &film).unwrap();
        let place = Vec2::new(0.8, 0.3);
        let ray = camera.ray(place, Vec2::ZERO, 0.0);
        for (t, depth) in [(0.0, 0.0), (ray.t_max, 1.0)] {
            let clip = camera.projection() * camera.world_to_camera(0.0) * ray.at(t).extend(1.0);
            let ndc = clip.truncate() / clip.w;
            let expected = Vec3::new(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y, depth);
            assert!((ndc - expected).length() < 2e-3, "{ndc} {expected}");
        }
    }

    #[test]
    fn the_principal_point_moves_the_picture_to_the_left_and_up() {
        let film = Film {
            width: 20,
            height: 10,
            ..Film::default()
        };
        let shifted = |x: f32, y: f32| {
            let inside = format!(
                r#"<float name="fov" value="40"/><float name="principal_point_offset_x" value="{x}"/>
                <float name="principal_point_offset_y" value="{y}"/>"#
            );
            camera(&inside, &film).unwrap()
        };
        let (still, moved) = (shifted(0.0, 0.0), shifted(0.1, 0.2));
        let place = Vec2::new(0.6, 0.7);
        let before = still.ray(place, Vec2::ZERO, 0.0);
        let after = moved.ray(place - Vec2::new(0.1, 0.2), Vec2::ZERO, 0.0);
        assert!(before.direction.distance(after.direction) < 1e-6);
    }

    #[test]
    fn neighbours_are_the_rays_of_the_places_beside() {
        let film = Film {
            width: 200,
            height: 100,
            ..Film::default()
        };
        let inside = r#"<transform name="to_world"><lookat origin="1,2,3" target="4,0,1" up="0,0,1"/></transform>"#;
        let camera = camera(inside, &film).unwrap();
        let (place, step) = (Vec2::new(0.8, 0.3), Vec2::new(0.01, 0.02));
        let ray = camera.ray(place, Vec2::ZERO, 0.0);
        let [right, down] = camera.neighbours(&ray, step);
        for (neighbour, beside) in [(right, Vec2::X), (down, Vec2::Y)] {
            let exact = camera.ray(place + step * beside, Vec2::ZERO, 0.0);
            assert!(neighbour.direction.distance(exact.direction) < 1e-6);
            assert_eq!(neighbour.origin, ray.origin);
        }
    }
}
