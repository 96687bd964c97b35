//! `thinlens`: a `perspective` camera whose aperture has a size (Cook, Porter and Carpenter, *Distributed ray
//! tracing*, 1984). All rays through a point of the film meet where the pinhole's ray has the depth
//! `focus_distance` (`far_clip` by default); a point at depth z is blurred over a disc whose radius on the plane
//! in focus is r·|focus − z|/z, with the `aperture_radius` r.
//!
//! An extension: `aperture_blades` (3 or more; 0, the default, is a disc) makes the aperture a regular polygon
//! with its corners on that radius, one of them on top; `aperture_rotation` turns it, in degrees, clockwise as
//! seen from behind the camera.

use std::f32::consts::TAU;

use glam::{Mat4, Vec2, Vec3};

use super::Mount;
use super::perspective::Perspective;
use super::{Camera, Connection, Film};
use crate::description::Properties;
use crate::description::declared::{Plugin, float, integer};
use crate::error::Result;
use crate::interaction::Ray;
use crate::lanes::{self, Ints as _, Lanes, atan2, warp};

/// A camera with depth of field.
#[derive(Clone, Debug)]
pub struct ThinLens {
    pinhole: Perspective,
    focus_distance: f32,
    aperture: Aperture,
}

/// Where light enters, in camera space at z = 0.
#[derive(Clone, Debug)]
struct Aperture {
    radius: f32,
    /// Corners of the polygon that the unit circle is around; none for a disc.
    corners: Vec<[f32; 2]>,
}

impl Aperture {
    fn build(properties: &Properties<'_>) -> Result<Self> {
        let radius = properties.float("aperture_radius")?;
        let blades = properties.integer("aperture_blades")?;
        if (1..3).contains(&blades) {
            let message = format!("{blades} blades make no polygon");
            return Err(properties
                .error("aperture_blades", message)
                .help("0 is a disc"));
        }
        let rotation = properties.float("aperture_rotation")?;
        let corner = |i: i64| {
            let angle = rotation.to_radians() as f32 + TAU * i as f32 / blades as f32;
            // +x is to the image's left.
            [-angle.sin(), angle.cos()]
        };
        Ok(Self {
            radius: radius as f32,
            corners: (0..blades).map(corner).collect(),
        })
    }

    /// A point of the aperture, uniform over it. A polygon's is the disc's at the same share of its sector's
    /// angle and the same fraction of the way from the centre to the rim: areas stay in proportion, and what
    /// was near stays near.
    #[inline(always)]
    fn point<F: Lanes>(&self, u: lanes::Vec2<F>) -> lanes::Vec2<F> {
        let (p, radius) = (warp::concentric_disk(u), F::splat(self.radius));
        let n = self.corners.len() as u32;
        if n == 0 {
            return p * radius;
        }
        let turns = atan2(p.y, p.x) * F::splat(1.0 / TAU);
        let sector = (turns - turns.floor()) * F::splat(n as f32);
        let i = sector.to_int().min(F::Int::splat(n - 1));
        let (corners, one) = (self.corners.as_flattened(), F::Int::splat(1));
        let next = F::Int::select(i.eq(F::Int::splat(n - 1)), F::Int::splat(0), i + one);
        let (i2, next2) = (i.shl::<1>(), next.shl::<1>());
        let from = lanes::Vec2::new(F::gather(corners, i2), F::gather(corners, i2 + one));
        let to = lanes::Vec2::new(F::gather(corners, next2), F::gather(corners, next2 + one));
        let rim = from + (to - from) * (sector - i.to_float());
        rim * (radius * p.length_squared().sqrt())
    }
}

impl ThinLens {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a lens of finite size, sharp at one distance",
        properties: &[
            super::MOUNT,
            super::COMMON,
            super::FIELD_OF_VIEW,
            &[
                float("aperture_radius", 0.0, "of the lens; scene units")
                    .between(0.0, f32::MAX as f64)
                    .required(),
                float(
                    "focus_distance",
                    1e4,
                    "where the image is sharp; scene units",
                )
                .above_to(f32::MAX as f64)
                .absent("far_clip"),
                integer(
                    "aperture_blades",
                    0,
                    "corners of the aperture, 3 to 64; 0 is a disc",
                )
                .between(0.0, 64.0)
                .own(),
                float("aperture_rotation", 0.0, "of those corners, in degrees").own(),
            ],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, film: &Film) -> Result<Self> {
        let pinhole = Perspective::centred(properties, film)?;
        let focus_distance = match properties.given::<f64>("focus_distance")? {
            Some(distance) if distance as f32 == 0.0 => {
                return Err(properties.error("focus_distance", "focus_distance is too small"));
            }
            Some(distance) => distance as f32,
            None => pinhole.far(),
        };
        Ok(Self {
            pinhole,
            focus_distance,
            aperture: Aperture::build(properties)?,
        })
    }
}

impl ThinLens {
    pub(super) fn mount(&self) -> &Mount {
        &self.pinhole.mount
    }

    /// In camera space, the ways from near to far.
    #[inline(always)]
    pub(super) fn segments<F: Lanes>(
        &self,
        film: lanes::Vec2<F>,
        lens: lanes::Vec2<F>,
    ) -> [lanes::Vec3<F>; 2] {
        let lens = self.aperture.point(lens);
        self.pinhole
            .segments_through(film, lens, self.focus_distance)
    }
}

impl Camera for ThinLens {
    fn ray(&self, film: Vec2, lens: Vec2, time: f32) -> Ray {
        let [start, end] = self.segments::<f32>(film.into(), lens.into());
        self.mount().ray(start.into(), end.into(), time)
    }

    fn connect(&self, from: Vec3, lens: Vec2, time: f32) -> Option<Connection> {
        let lens = self.aperture.point::<f32>(lens.into()).into();
        self.pinhole
            .connect_through(from, lens, self.focus_distance, time)
    }

    fn density(&self, at: Vec3, direction: Vec3, time: f32) -> f32 {
        self.pinhole.density(at, direction, time)
    }

    fn is_found(&self) -> bool {
        true
    }

    /// All go through one point of the lens.
    fn neighbours(&self, ray: &Ray, step: Vec2) -> [Ray; 2] {
        self.pinhole.rays_beside(ray, step, self.pinhole.near())
    }

    fn has_lens(&self) -> bool {
        true
    }

    fn world_to_camera(&self, time: f32) -> Mat4 {
        self.pinhole.world_to_camera(time)
    }

    fn projection(&self) -> Mat4 {
        self.pinhole.projection()
    }

    fn shutter(&self) -> (f32, f32) {
        self.pinhole.shutter()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::description::{Description, Kind, Options};

    fn camera(inside: &str) -> Result<ThinLens> {
        let text =
            format!(r#"<scene version="3.0.0"><sensor type="thinlens">{inside}</sensor></scene>"#);
        let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
        let film = Film {
            width: 200,
            height: 100,
            ..Film::default()
        };
        let camera = ThinLens::build(
            &scene.root().children(Kind::Sensor)[0].declared(&ThinLens::PLUGIN),
            &film,
        )?;
        Ok(camera)
    }

    /// Film, lens, origin, direction and length as Mitsuba 3.9.1 has them.
    type Probe = ([f32; 2], [f32; 2], [f32; 3], [f32; 3], f32);

    #[test]
    fn rays_are_those_of_mitsuba() {
        let camera = camera(
            r#"<float name="fov" value="40"/><float name="aperture_radius" value="0.3"/>
            <float name="focus_distance" value="2.5"/><float name="near_clip" value="0.05"/>
            <float name="far_clip" value="50"/>
            <transform name="to_world"><lookat origin="1,2,3" target="4,0,1" up="0,0,1"/></transform>"#,
        )
        .unwrap();
        let probes: [Probe; 4] = [
            (
                [0.8, 0.3],
                [0.2, 0.9],
                [1.038_239, 1.804_338, 3.149_943],
                [0.624_752, -0.612_211, -0.484_648],
                50.626_98,
            ),
            (
                [0.8, 0.3],
                [0.7, 0.4],
                [1.073_896, 2.068_192, 2.939_575],
                [0.596_046, -0.701_58, -0.390_532],
                51.845_52,
            ),
            (
                [0.1, 0.6],
                [0.2, 0.9],
                [1.050_168, 1.827_006, 3.145_169],
                [0.819_326, -0.157_089, -0.551_387],
                53.149_105,
            ),
            (
                [0.5, 0.5],
                [0.5, 0.5],
                [1.036_38, 1.975_746, 2.975_746],
                [0.727_607, -0.485_071, -0.485_071],
                49.95,
            ),
        ];
        for (film, lens, origin, direction, length) in probes {
            let ray = camera.ray(Vec2::from(film), Vec2::from(lens), 0.0);
            assert!(ray.origin.distance(Vec3::from(origin)) < 2e-6, "{ray:?}");
            assert!(
                ray.direction.distance(Vec3::from(direction)) < 2e-6,
                "{ray:?}"
            );
            assert!((ray.t_max - length).abs() < 1e-4, "{ray:?}");
        }
    }

    #[test]
    fn neighbours_go_through_the_same_point_of_the_lens() {
        let camera = camera(
            r#"<float name="aperture_radius" value="0.3"/><float name="focus_distance" value="2.5"/>
            <float name="near_clip" value="0.5"/>"#,
        )
        .unwrap();
        let (place, lens) = (Vec2::new(0.8, 0.3), Vec2::new(0.2, 0.9));
        let step = Vec2::new(0.01, 0.02);
        let ray = camera.ray(place, lens, 0.0);
        let [right, down] = camera.neighbours(&ray, step);
        for (neighbour, beside) in [(right, Vec2::X), (down, Vec2::Y)] {
            let exact = camera.ray(place + step * beside, lens, 0.0);
            assert!(neighbour.direction.distance(exact.direction) < 1e-6);
            assert!(neighbour.origin.distance(exact.origin) < 1e-6);
        }
    }

    #[test]
    fn a_lens_has_no_principal_point() {
        for name in ["principal_point_offset_x", "principal_point_offset_y"] {
            assert!(ThinLens::PLUGIN.row(name).is_none());
        }
    }

    #[test]
    fn every_aperture_is_covered_evenly_and_its_cells_stay_whole() {
        for blades in [0, 3, 5, 6, 17] {
            let camera = camera(&format!(
                r#"<float name="aperture_radius" value="2"/><float name="aperture_rotation" value="20"/>
                <integer name="aperture_blades" value="{blades}"/>"#
            ))
            .unwrap();
            let expected_area = match blades {
                0 => 4.0 * std::f64::consts::PI,
                n => {
                    let n = f64::from(n);
                    2.0 * n * (std::f64::consts::TAU / n).sin()
                }
            };
            // The area of each cell's image is the same share of the whole.
            let side = 96;
            let at = |x: i32, y: i32| {
                let u = Vec2::new(x as f32, y as f32) / side as f32;
                Vec2::from(camera.aperture.point::<f32>(u.into())).as_dvec2()
            };
            let mut total = 0.0;
            let share = expected_area / f64::from(side * side);
            for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
                let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
                let area = 0.5 * (c - a).perp_dot(d - b).abs();
                assert!(
                    area < 1.6 * share,
                    "{blades} blades: {area} {share} {x} {y}"
                );
                assert!(a.length() <= 2.0 + 1e-6);
                total += area;
            }
            assert!(
                (total / expected_area - 1.0).abs() < 5e-3,
                "{blades} blades: {total}, {expected_area}"
            );
        }
    }

    #[test]
    fn a_polygon_has_a_corner_on_top_until_it_is_turned() {
        let corner = |rotation: f64| {
            let camera = camera(&format!(
                r#"<float name="aperture_radius" value="1"/><integer name="aperture_blades" value="4"/>
                <float name="aperture_rotation" value="{rotation}"/>"#
            ));
            camera.unwrap().aperture.corners[0]
        };
        assert!(Vec2::from(corner(0.0)).distance(Vec2::Y) < 1e-6);
        // The image's right.
        assert!(Vec2::from(corner(90.0)).distance(Vec2::NEG_X) < 1e-6);
    }

    #[test]
    fn a_lens_without_an_opening_is_a_pinhole_and_one_that_cannot_be_is_refused() {
        let film = Vec2::new(0.3, 0.8);
        let pinhole = camera(r#"<float name="aperture_radius" value="0"/>"#).unwrap();
        let ray = pinhole.ray(film, Vec2::new(0.1, 0.9), 0.0);
        assert_eq!(ray, pinhole.pinhole.ray(film, Vec2::ZERO, 0.0));
        let radius = r#"<float name="aperture_radius" value="0.1"/>"#;
        for (inside, message) in [
            ("", "needs \"aperture_radius\""),
            (r#"<float name="aperture_radius" value="-1"/>"#, "from 0 to"),
            (
                &format!(r#"{radius}<float name="focus_distance" value="0"/>"#),
                "must be above 0",
            ),
            (
                &format!(r#"{radius}<integer name="aperture_blades" value="2"/>"#),
                "2 blades",
            ),
        ] {
            let error = camera(inside).unwrap_err().to_string();
            assert!(error.contains(message), "{inside}: {error}");
        }
    }
}
