//! `perspective`: a pinhole. The field of view is `fov` in degrees along `fov_axis` (x, y, diagonal,
//! smaller, larger), or follows from `focal_length` (50mm by default) as on 35 mm film, whose diagonal
//! it takes. Geometry nearer than `near_clip` or beyond `far_clip` is not seen.

use glam::{Mat4, Vec2, Vec4};

use super::{Camera, Film, Mount};
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::Ray;

/// A pinhole camera.
#[derive(Clone, Debug)]
pub struct Perspective {
    mount: Mount,
    /// Half the extent of the film at distance 1, in camera space.
    half: Vec2,
    /// Shift of the image's centre, in fractions of the film.
    principal_point: Vec2,
}

/// Half the diagonal of 35 mm film (36 × 24 mm), in mm.
const HALF_DIAGONAL: f64 = 21.633_307_652_783_937;

/// The tangent of half the horizontal field of view.
pub(crate) fn tangent_x(properties: &Properties<'_>, aspect: f64) -> Result<f64> {
    let diagonal = (1.0 + 1.0 / (aspect * aspect)).sqrt();
    let Some(fov) = properties.float("fov")? else {
        let text = properties.string("focal_length")?.unwrap_or("50mm");
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
    if !(fov > 0.0 && fov < 180.0) {
        return Err(properties.error(
            "fov",
            format!("a field of view of {fov}° is not between 0° and 180°"),
        ));
    }
    let tangent = (fov.to_radians() / 2.0).tan();
    Ok(match properties.string("fov_axis")?.unwrap_or("x") {
        "x" => tangent,
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
        other => {
            let error = properties.error("fov_axis", format!("unknown fov_axis \"{other}\""));
            return Err(error
                .suggest(other, ["diagonal", "smaller", "larger"])
                .help("there are x, y, diagonal, smaller and larger"));
        }
    })
}

impl Perspective {
    pub(super) fn build(properties: &Properties<'_>, film: &Film) -> Result<Self> {
        let tangent = tangent_x(properties, film.aspect())?;
        let shift = |name| Ok(properties.float(name)?.unwrap_or(0.0) as f32);
        Ok(Self {
            mount: Mount::build(properties)?,
            half: Vec2::new(tangent as f32, (tangent / film.aspect()) as f32),
            principal_point: Vec2::new(
                shift("principal_point_offset_x")?,
                shift("principal_point_offset_y")?,
            ),
        })
    }

    /// The ray that leaves the camera-space point `lens` for where the pinhole's ray has depth `focus`.
    pub(super) fn ray_through(&self, film: Vec2, lens: Vec2, focus: f32, time: f32) -> Ray {
        let p = (Vec2::ONE - 2.0 * (film - self.principal_point)) * self.half;
        // At depth 1; from the lens's centre it is the pinhole's own.
        let way = (p - lens / focus).extend(1.0);
        let start = lens.extend(0.0);
        let Mount { near, far, .. } = self.mount;
        self.mount.ray(start + way * near, start + way * far, time)
    }

    /// The far clipping distance.
    pub(super) fn far(&self) -> f32 {
        self.mount.far
    }
}

impl Camera for Perspective {
    fn ray(&self, film: Vec2, _lens: Vec2, time: f32) -> Ray {
        self.ray_through(film, Vec2::ZERO, 1.0, time)
    }

    fn world_to_camera(&self) -> Mat4 {
        self.mount.world_to_camera()
    }

    fn projection(&self) -> Mat4 {
        let (near, far) = (self.mount.near, self.mount.far);
        let depth = far / (far - near);
        Mat4::from_cols(
            Vec4::new(-1.0 / self.half.x, 0.0, 0.0, 0.0),
            Vec4::new(0.0, 1.0 / self.half.y, 0.0, 0.0),
            Vec4::new(
                2.0 * self.principal_point.x,
                -2.0 * self.principal_point.y,
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
    use glam::Vec3;
    use std::path::Path;

    fn camera(inside: &str, film: &Film) -> Result<Perspective> {
        let text = format!(
            r#"<scene version="3.0.0"><sensor type="perspective">{inside}</sensor></scene>"#
        );
        let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
        Perspective::build(&scene.root().children(Kind::Sensor)[0], film)
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
        let inside = r#"<transform name="to_world"><lookat origin="1,2,3" target="4,0,1" up="0,0,1"/></transform>"#;
        let camera = camera(inside, &film).unwrap();
        let place = Vec2::new(0.8, 0.3);
        let ray = camera.ray(place, Vec2::ZERO, 0.0);
        for (t, depth) in [(0.0, 0.0), (ray.t_max, 1.0)] {
            let clip = camera.projection() * camera.world_to_camera() * ray.at(t).extend(1.0);
            let ndc = clip.truncate() / clip.w;
            let expected = Vec3::new(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y, depth);
            assert!((ndc - expected).length() < 2e-3, "{ndc} {expected}");
        }
    }
}
