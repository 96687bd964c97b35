//! `orthographic`: parallel rays; the film covers [−1, 1] in x, and in y what its aspect leaves, both in
//! the units of `to_world`.

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::{Camera, Connection, Film, Mount};
use crate::description::Properties;
use crate::description::declared::{Plugin, float};
use crate::error::Result;
use crate::interaction::Ray;
use crate::lanes::{self, Lanes};

/// A camera without perspective.
#[derive(Clone, Debug)]
pub struct Orthographic {
    pub(super) mount: Mount,
    /// Half the film's extent.
    half: Vec2,
}

impl Orthographic {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "parallel rays; the film covers [−1, 1] in x",
        properties: &[
            super::MOUNT,
            super::COMMON,
            &[float("focus_distance", 1e4, "everything is sharp")
                .positive()
                .without_effect()],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, film: &Film) -> Result<Self> {
        let half = Vec2::new(1.0, 1.0 / film.aspect() as f32);
        Ok(Self {
            mount: Mount::build(properties)?,
            half,
        })
    }
}

impl Orthographic {
    /// What the film covers, in camera space.
    fn area(&self) -> f32 {
        4.0 * self.half.x * self.half.y
    }

    /// In camera space, the ways from near to far.
    #[inline(always)]
    pub(super) fn segments<F: Lanes>(&self, film: lanes::Vec2<F>) -> [lanes::Vec3<F>; 2] {
        let all = |v: Vec2| lanes::Vec2::<F>::all(v);
        let p = (all(Vec2::ONE) - film * F::splat(2.0)).scale(all(self.half));
        let Mount { near, far, .. } = self.mount;
        [p.extend(F::splat(near)), p.extend(F::splat(far))]
    }
}

impl Camera for Orthographic {
    fn ray(&self, film: Vec2, _lens: Vec2, time: f32) -> Ray {
        let [start, end] = self.segments::<f32>(film.into());
        self.mount.ray(start.into(), end.into(), time)
    }

    fn connect(&self, from: Vec3, _lens: Vec2, time: f32) -> Option<Connection> {
        let Mount { near, far, .. } = self.mount;
        let to_world = self.mount.to_world.at(time);
        let local = to_world.inverse().point(from);
        if !(near..=far).contains(&local.z) {
            return None;
        }
        let p = local.truncate();
        let film = 0.5 * (Vec2::ONE - p / self.half);
        Mount::connect(&to_world, from, p.extend(near), film, self.area())
    }

    fn density(&self, _at: Vec3, direction: Vec3, time: f32) -> f32 {
        Mount::density(&self.mount.to_world.at(time), direction, self.area())
    }

    fn is_found(&self) -> bool {
        true
    }

    fn neighbours(&self, ray: &Ray, step: Vec2) -> [Ray; 2] {
        let to_world = self.mount.to_world.at(ray.time);
        let way = -2.0 * step * self.half;
        [Vec3::X * way.x, Vec3::Y * way.y].map(|way| Ray {
            origin: ray.origin + to_world.vector(way),
            ..*ray
        })
    }

    fn world_to_camera(&self, time: f32) -> Mat4 {
        self.mount.world_to_camera(time)
    }

    fn projection(&self) -> Mat4 {
        let (near, far) = (self.mount.near, self.mount.far);
        let scale = Vec3::new(-1.0 / self.half.x, 1.0 / self.half.y, 1.0 / (far - near));
        Mat4::from_cols(
            Vec4::new(scale.x, 0.0, 0.0, 0.0),
            Vec4::new(0.0, scale.y, 0.0, 0.0),
            Vec4::new(0.0, 0.0, scale.z, 0.0),
            Vec4::new(0.0, 0.0, -near * scale.z, 1.0),
        )
    }

    fn shutter(&self) -> (f32, f32) {
        self.mount.shutter
    }
}
