//! Arguments on how a bare mesh is shown.

use std::path::{Path, PathBuf};

use clap::Args;
use etendue::render::{Background, Finish, Lighting, Overrides, Staging, UpAxis};
use glam::DVec3;

use super::parse;
use super::scene::{is_image, is_scene};

/// How a bare mesh is shown.
#[derive(Args, Clone, Debug)]
pub(super) struct StagingArguments {
    /// Let the camera stand so many degrees to the right of the front, by default 27
    #[arg(long, value_name = "DEGREES", value_parser = degrees::<360>, allow_hyphen_values = true, help_heading = BARE)]
    azimuth: Option<f32>,
    /// And so many above the horizon, by default 19; from below there is no ground
    #[arg(long, value_name = "DEGREES", value_parser = degrees::<90>, allow_hyphen_values = true, help_heading = BARE)]
    elevation: Option<f32>,
    /// So many times as far away as where the mesh fills the image
    #[arg(long, value_name = "TIMES", value_parser = distance, help_heading = BARE)]
    distance: Option<f32>,
    /// The field of view of the image's smaller side, by default 30
    #[arg(long, value_name = "DEGREES", value_parser = fov, help_heading = BARE)]
    fov: Option<f32>,
    /// The point that the camera looks at, instead of the one that puts the mesh in the middle
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::point, allow_hyphen_values = true, help_heading = BARE)]
    target: Option<DVec3>,
    /// What the mesh is made of: "clay" (matte), "metal" (rough) or "plastic" (glossy) in the mesh's own colours where it has
    /// any, "glass" (clear), the one material of a scene file (.xml), or matte with an image as its base colour; "auto" is
    /// what the file's own materials say with their images (glTF, OBJ, PLY), or else clay
    #[arg(long, default_value = "auto", value_name = "NAME|FILE", value_parser = material, help_heading = BARE)]
    material: Finish,
    /// What lights it: "studio", "sun", "sky", or an image of all around by longitude and latitude; "auto" is the file's own
    /// lights (glTF, in candela and lux: a radiance of 1 is 1 cd/m²) and nothing else, or else the studio
    #[arg(long, default_value = "auto", value_name = "NAME|IMAGE", value_parser = lighting, help_heading = BARE)]
    light: Lighting,
    /// What is seen beside it: "sky", or in place of sky and ground a radiance such as 1,1,1 or an image of all around, which
    /// light it too, or nothing ("transparent")
    #[arg(long, default_value = "sky", value_name = "R,G,B|IMAGE|transparent", value_parser = background, help_heading = BARE)]
    background: Background,
    /// Let it float
    #[arg(long, help_heading = BARE)]
    no_ground: bool,
    /// Write the scene around the mesh to this file too, to change it or to let Mitsuba render it
    #[arg(long, value_name = "OUT.xml", help_heading = BARE)]
    pub(super) write_scene: Option<PathBuf>,
}

const BARE: &str = "A bare mesh";

impl StagingArguments {
    /// The first of them that asks for something.
    pub(super) fn given(&self) -> Option<&'static str> {
        let given = [
            (self.azimuth.is_some(), "--azimuth"),
            (self.elevation.is_some(), "--elevation"),
            (self.distance.is_some(), "--distance"),
            (self.fov.is_some(), "--fov"),
            (self.target.is_some(), "--target"),
            (self.material != Finish::Auto, "--material"),
            (self.light != Lighting::Auto, "--light"),
            (!matches!(self.background, Background::Sky), "--background"),
            (self.no_ground, "--no-ground"),
            (self.write_scene.is_some(), "--write-scene"),
        ];
        let given = given.into_iter().find(|(is_given, _)| *is_given);
        given.map(|(_, option)| option)
    }

    /// What they ask for, of such an image.
    pub(super) fn staging(&self, up: UpAxis, image: &Overrides, turns: bool) -> Staging {
        let default = Staging::default();
        let size = image.size.map(|(width, height)| [width, height]);
        Staging {
            up,
            azimuth: self.azimuth,
            elevation: self.elevation,
            distance: self.distance,
            fov: self.fov,
            target: self.target,
            size: size.filter(|s| !s.contains(&0)).unwrap_or(default.size),
            samples: image.spp.filter(|n| *n > 0).unwrap_or(default.samples),
            all_around: turns,
            finish: self.material.clone(),
            lighting: self.light.clone(),
            background: self.background.clone(),
            ground: !self.no_ground,
            animation: None,
            framing: None,
        }
    }
}

/// Where light comes from.
fn lighting(text: &str) -> Result<Lighting, String> {
    match text {
        "auto" => Ok(Lighting::Auto),
        "studio" => Ok(Lighting::Studio),
        "sun" => Ok(Lighting::Sun),
        "sky" => Ok(Lighting::Sky),
        image if Path::new(image).is_file() => Ok(Lighting::Environment(image.into())),
        _ => Err("write auto, studio, sun, sky, or the name of an image that is there".to_owned()),
    }
}

/// What a mesh is made of.
fn material(text: &str) -> Result<Finish, String> {
    let path = Path::new(text);
    match text {
        "auto" => Ok(Finish::Auto),
        "clay" => Ok(Finish::Clay),
        "metal" => Ok(Finish::Metal),
        "glass" => Ok(Finish::Glass),
        "plastic" => Ok(Finish::Plastic),
        _ if !path.is_file() => Err(
            "write auto, clay, metal, glass, plastic, or the name of a scene file \
             or an image that is there"
                .to_owned(),
        ),
        _ if is_scene(path) => Ok(Finish::File(path.to_owned())),
        _ if is_image(path) => Ok(Finish::Picture(path.to_owned())),
        _ => Err("a material's file is a scene (.xml) or an image".to_owned()),
    }
}

/// An angle of at most so many degrees to either side.
fn degrees<const MOST: i32>(text: &str) -> Result<f32, String> {
    let most = MOST as f32;
    let angle: Option<f32> = text.parse().ok();
    let angle = angle.filter(|angle| (-most..=most).contains(angle));
    angle.ok_or_else(|| format!("write degrees from -{MOST} to {MOST}"))
}

/// A field of view.
fn fov(text: &str) -> Result<f32, String> {
    let angle: Option<f32> = text.parse().ok();
    let angle = angle.filter(|angle| (1.0..=170.0).contains(angle));
    angle.ok_or_else(|| "write degrees from 1 to 170".to_owned())
}

/// A multiple of a distance.
fn distance(text: &str) -> Result<f32, String> {
    let times: Option<f32> = text.parse().ok();
    let times = times.filter(|times| (0.01..=1000.0).contains(times));
    times.ok_or_else(|| "write a number from 0.01 to 1000".to_owned())
}

/// A radiance, an image, or none.
fn background(text: &str) -> Result<Background, String> {
    match text {
        "sky" => return Ok(Background::Sky),
        "transparent" => return Ok(Background::Transparent),
        _ => {}
    }
    let numbers: Option<Vec<f32>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
    let possible = |v: &f32| v.is_finite() && *v >= 0.0;
    match numbers.as_deref() {
        Some(&[r, g, b]) if [r, g, b].iter().all(possible) => Ok(Background::Color([r, g, b])),
        None if Path::new(text).is_file() => Ok(Background::Environment(text.into())),
        _ => Err(
            "write sky, transparent, a radiance as R,G,B, such as 1,1,1, or the name of an image that is there"
                .to_owned(),
        ),
    }
}
