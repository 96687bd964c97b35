//! How a bare mesh is shown: what the command line can ask for, and the parts of the scene that say it.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use super::{Framing, lights};
use crate::budget::Budget;
use crate::description::{Description, Kind, NodeId, Options, escaped};
use crate::error::{Error, Location, Result};
use crate::mesh::{GltfAnimation, GltfLight};

/// Which way is up in a mesh file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// As the format has it, or by what the mesh stands on.
    #[default]
    Auto,
    /// +y, as most scanned and modelled meshes have it.
    Y,
    /// +z, as CAD and terrain have it.
    Z,
}

impl UpAxis {
    /// Of unit length; +y until the mesh is known.
    pub fn direction(self) -> Vec3 {
        match self {
            Self::Auto | Self::Y => Vec3::Y,
            Self::Z => Vec3::Z,
        }
    }

    /// Toward who looks at the front, of unit length.
    pub(super) fn front(self) -> Vec3 {
        match self {
            Self::Auto | Self::Y => Vec3::Z,
            Self::Z => Vec3::NEG_Y,
        }
    }
}

/// What a bare mesh is made of.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Finish {
    /// As its file says, or else clay.
    #[default]
    Auto,
    /// Matte, in its own colours or those of clay.
    Clay,
    /// Rough metal in its own colours, or aluminium.
    Metal,
    /// Clear glass.
    Glass,
    /// Glossy plastic in its own colours or those of clay.
    Plastic,
    /// The material of this scene file, the only one at its top.
    File(PathBuf),
    /// Matte, in the colours of this image by the mesh's texture coordinates.
    Picture(PathBuf),
}

/// What lights a bare mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Lighting {
    /// The file's own lights (glTF), and nothing else; a studio's where it has none.
    #[default]
    Auto,
    /// A lamp beside the camera, and a soft sky.
    Studio,
    /// A sun beside the camera, and a blue sky.
    Sun,
    /// An even sky.
    Sky,
    /// An image of all around, by longitude and latitude.
    Environment(PathBuf),
}

/// What is seen beside a bare mesh; all but the sky leave out the ground.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Background {
    /// The sky that lights it.
    #[default]
    Sky,
    /// A sky of this radiance, linear BT.709.
    Color([f32; 3]),
    /// In place of the sky, an image of all around by longitude and latitude.
    Environment(PathBuf),
    /// Nothing: the image has opacity.
    Transparent,
}

/// How a bare mesh is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Staging {
    /// Which way is up.
    pub up: UpAxis,
    /// Degrees that the camera stands to the right of the front.
    pub azimuth: Option<f32>,
    /// Degrees that it stands above the horizon, −90 to 90.
    pub elevation: Option<f32>,
    /// How far it stands, in parts of the distance from which the mesh fills the image.
    pub distance: Option<f32>,
    /// The field of view of the film's smaller side, in degrees, 1 to 170.
    pub fov: Option<f32>,
    /// The point that it looks at.
    pub target: Option<DVec3>,
    /// The film's width and height in pixels, both above 0.
    pub size: [u32; 2],
    /// Samples a pixel, above 0.
    pub samples: u32,
    /// Whether the mesh is to be seen from all around, as a camera on a turntable does.
    pub all_around: bool,
    /// What the mesh is made of.
    pub finish: Finish,
    /// What lights it.
    pub lighting: Lighting,
    /// What is seen beside it.
    pub background: Background,
    /// Whether it stands on a ground.
    pub ground: bool,
    /// When its file's animation is looked at, if it is.
    pub animation: Option<GltfAnimation>,
    /// What was framed for an image of the same animated file before, if anything was.
    pub framing: Option<Framing>,
}

impl Default for Staging {
    fn default() -> Self {
        Self {
            up: UpAxis::Auto,
            azimuth: None,
            elevation: None,
            distance: None,
            fov: None,
            target: None,
            size: [1024, 768],
            samples: 64,
            all_around: false,
            finish: Finish::Auto,
            lighting: Lighting::Auto,
            background: Background::Sky,
            ground: true,
            animation: None,
            framing: None,
        }
    }
}

impl Staging {
    /// The film's width over its height.
    pub(super) fn aspect(&self) -> f64 {
        f64::from(self.size[0]) / f64::from(self.size[1])
    }

    /// When the file's animation is looked at; nothing where it is at rest.
    pub(super) fn moments(&self) -> &[f32] {
        let animation = self.animation.as_ref();
        animation.map_or(&[], |animation| &animation.moments)
    }

    /// Whether the file's animation is seen while a shutter is open.
    pub(super) fn deforms(&self) -> bool {
        self.moments().len() > 1
    }

    /// Whether another camera is asked for than the file's own.
    pub(super) fn asks_for_camera(&self) -> bool {
        let angles = [self.azimuth, self.elevation, self.distance, self.fov];
        angles.iter().any(Option::is_some) || self.target.is_some()
    }

    /// Whether there is a ground: from below it would be all that is seen, and mostly it hides any background.
    pub(super) fn has_ground(&self) -> bool {
        let is_below = self.elevation.is_some_and(|elevation| elevation < 0.0);
        self.ground && !is_below && self.background == Background::Sky
    }

    /// The scene file of the mesh's material, and that material, where it comes from a file. `options` and `budget` are for
    /// reading it.
    ///
    /// # Errors
    /// As [`Description::read`], and unless there is one material at its top.
    pub(super) fn own_material(
        &self,
        options: &Options,
        budget: &Budget,
    ) -> Result<Option<(Description, NodeId)>> {
        let Finish::File(path) = &self.finish else {
            return Ok(None);
        };
        let options = Options {
            strict: options.strict,
            ..Options::default()
        };
        let file = Description::read(path, &options, budget)?;
        let materials = file.root().children(Kind::Bsdf);
        let wrong = match materials[..] {
            [only] => {
                let id = only.node_id();
                return Ok(Some((file, id)));
            }
            [] => Error::input("there is no <bsdf> at the top of the file"),
            [_, second, ..] => {
                let message = format!("the file has {} <bsdf>s at its top", materials.len());
                Error::input(message).at(second.location())
            }
        };
        Err(wrong
            .at(&Location::of_file(path))
            .help("a material's file is a scene with one <bsdf>, in which others may be nested"))
    }

    /// The mesh's material, around its colour, a `<rgb>` or `<texture>` of this name that `color` makes; `None` of a mesh
    /// without colours of its own. Nothing where it comes from a file.
    pub(super) fn material(&self, color: impl Fn(&str) -> Option<String>) -> String {
        let picture = |path: &Path| {
            let file = filename(path);
            format!(r#"<texture name="reflectance" type="bitmap">{file}</texture>"#)
        };
        let clay = |name: &str| {
            let [r, g, b] = crate::mesh::BARE_COLOR;
            color(name).unwrap_or_else(|| format!(r#"<rgb name="{name}" value="{r}, {g}, {b}"/>"#))
        };
        let twosided = |inside: String| format!(r#"<bsdf type="twosided">{inside}</bsdf>"#);
        match &self.finish {
            Finish::Auto | Finish::Clay => {
                let reflectance = clay("reflectance");
                twosided(format!(r#"<bsdf type="diffuse">{reflectance}</bsdf>"#))
            }
            Finish::Plastic => {
                let reflectance = clay("diffuse_reflectance");
                twosided(format!(
                    r#"<bsdf type="roughplastic"><float name="alpha" value="0.1"/>{reflectance}</bsdf>"#
                ))
            }
            Finish::Metal => {
                let metal = match color("specular_reflectance") {
                    Some(own) => format!(r#"<string name="material" value="none"/>{own}"#),
                    None => r#"<string name="material" value="Al"/>"#.to_owned(),
                };
                twosided(format!(
                    r#"<bsdf type="roughconductor"><float name="alpha" value="0.2"/>{metal}</bsdf>"#
                ))
            }
            Finish::Glass => r#"<bsdf type="dielectric"/>"#.to_owned(),
            Finish::Picture(path) => {
                let reflectance = picture(path);
                twosided(format!(r#"<bsdf type="diffuse">{reflectance}</bsdf>"#))
            }
            Finish::File(_) => String::new(),
        }
    }

    /// The lights around a mesh at `center`: those of its own file at all moments, where there are any, else what is asked
    /// for; `key` points to where the lamp or the sun is.
    pub(super) fn lights(
        &self,
        center: Vec3,
        radius: f32,
        key: Vec3,
        own: &[Vec<GltfLight>],
    ) -> String {
        let even = |[r, g, b]: [f32; 3]| {
            format!(
                r#"<emitter type="constant"><rgb name="radiance" value="{r}, {g}, {b}"/></emitter>"#
            )
        };
        let background = match &self.background {
            Background::Sky | Background::Transparent => None,
            Background::Color(color) => Some(even(*color)),
            Background::Environment(path) => Some(self.environment(path)),
        };
        if own.iter().any(|lights| !lights.is_empty()) {
            return background.unwrap_or_default() + &lights::emitters(own, self.moments());
        }
        let sky = |own: [f32; 3]| background.clone().unwrap_or_else(|| even(own));
        match &self.lighting {
            Lighting::Auto | Lighting::Studio => {
                let lamp = point(center + 4.0 * radius * key);
                let size = 0.6 * radius;
                format!(
                    r#"{}
    <shape type="sphere">
        <point name="center" value="{lamp}"/>
        <float name="radius" value="{size}"/>
        <emitter type="area"><rgb name="radiance" value="30, 27, 23"/></emitter>
    </shape>"#,
                    sky([0.42, 0.47, 0.55])
                )
            }
            Lighting::Sun => {
                let direction = point(-key);
                format!(
                    r#"{}
    <emitter type="directional">
        <vector name="direction" value="{direction}"/>
        <rgb name="irradiance" value="3, 2.75, 2.3"/>
    </emitter>"#,
                    sky([0.22, 0.32, 0.5])
                )
            }
            Lighting::Sky => sky([0.9, 0.95, 1.0]),
            Lighting::Environment(path) => self.environment(path),
        }
    }

    /// An image of all around as a light.
    fn environment(&self, path: &Path) -> String {
        let file = filename(path);
        // Such images have y up.
        let turn = match self.up {
            UpAxis::Auto | UpAxis::Y => "",
            UpAxis::Z => r#"<transform name="to_world"><rotate x="1" angle="90"/></transform>"#,
        };
        format!(r#"<emitter type="envmap">{file}{turn}</emitter>"#)
    }
}

/// An image's file as a scene file has it, wherever that stands.
pub(super) fn filename(path: &Path) -> String {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let path = escaped(&path.to_string_lossy());
    format!(r#"<string name="filename" value="{path}"/>"#)
}

/// A point as a scene file has it.
pub(super) fn point(p: Vec3) -> String {
    format!("{}, {}, {}", p.x, p.y, p.z)
}

/// The property `to_world` of what stands in `places` at some `moments`: `one` says one of them.
pub(super) fn placed<P: PartialEq>(
    places: &[P],
    moments: &[f32],
    one: impl Fn(&P) -> String,
) -> String {
    let first = &places[0];
    if places.iter().all(|place| place == first) {
        return format!(r#"<transform name="to_world">{}</transform>"#, one(first));
    }
    let keyframes = moments
        .iter()
        .zip(places)
        .map(|(time, place)| format!(r#"<transform time="{time}">{}</transform>"#, one(place)));
    let keyframes: String = keyframes.collect();
    format!(r#"<animation name="to_world">{keyframes}</animation>"#)
}
