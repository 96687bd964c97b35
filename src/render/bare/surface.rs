//! What a file says that its faces are made of, as materials of a scene: `principled` has the parts of glTF's materials, or
//! where all is matte `diffuse`, which is without its glow at grazing angles. The emission is an area light's, a radiance of
//! 1 being 1 cd/m² as with the file's lights. What an image says is multiplied by the factor or the mesh's colours.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;

use super::staging::filename;
use super::{Finish, Staging, color};
use crate::budget::Budget;
use crate::error::{Error, Location, Problem};
use crate::image;
use crate::mesh::{BARE_COLOR, Loaded, Map, Maps, Surface, gltf_image};

/// Some of a mesh, that is shown as a shape.
pub(super) struct Body {
    /// Of the file; `None`: it is the whole mesh.
    pub(super) surface: Option<usize>,
    /// As a scene file has it.
    pub(super) material: String,
    /// Likewise, or nothing.
    pub(super) emitter: String,
}

/// An attribute as a texture of this name.
pub(super) fn attribute(name: &str, attribute: &str) -> String {
    format!(
        r#"<texture name="{name}" type="mesh_attribute"><string name="name" value="{attribute}"/></texture>"#
    )
}

/// The surfaces that the mesh is shown with, by images that can be read; none where it has none, or another material is
/// asked for.
pub(super) fn own(
    loaded: &mut Loaded,
    staging: &Staging,
    budget: &Budget,
    place: &Location,
) -> Vec<Surface> {
    if staging.finish != Finish::Auto {
        return Vec::new();
    }
    let mut known: HashMap<(std::path::PathBuf, Option<usize>), bool> = HashMap::new();
    let mut warnings: Vec<Problem> = Vec::new();
    let mut surfaces = loaded.surfaces.clone();
    for surface in &mut surfaces {
        surface.keep_maps(|map| {
            let key = (map.path.clone(), map.image);
            *known.entry(key).or_insert_with(|| {
                let Err(error) = check(map, budget) else {
                    return true;
                };
                warnings.extend_from_slice(error.at(place).problems());
                false
            })
        });
    }
    let shines = |surface: &Surface| surface.emission != [0.0; 3];
    if staging.deforms() && surfaces.iter().any(shines) {
        let message =
            "the emission of its materials is left out: a mesh that deforms cannot be a light";
        let warning = Error::input(message).at(place);
        warnings.extend_from_slice(warning.problems());
        for surface in &mut surfaces {
            surface.emission = [0.0; 3];
        }
    }
    loaded.warnings.extend(warnings);
    surfaces
}

/// Whether an image is there, and of a format that is read.
fn check(map: &Map, budget: &Budget) -> Result<(), Error> {
    const MARK: u64 = 64;
    let Map { path, image, .. } = map;
    let mut bytes = Vec::new();
    match image {
        Some(index) => bytes = gltf_image(path, *index, MARK, &budget.open())?,
        None => {
            let read = crate::file::open(path)
                .and_then(|file: File| file.take(MARK).read_to_end(&mut bytes));
            read.map_err(|e| {
                Error::input(format!("the image {} is not shown: {e}", path.display()))
            })?;
        }
    }
    if image::is_image(path, &bytes) {
        return Ok(());
    }
    let name = match image {
        Some(index) => index.to_string(),
        None => path.display().to_string(),
    };
    Err(Error::input(format!(
        "the image {name} is not shown: it is of no format that is read"
    )))
}

/// The parts of a mesh by these of its file's surfaces.
pub(super) fn bodies(loaded: &Loaded, surfaces: &[Surface]) -> Vec<Body> {
    let numbered = surfaces.iter().enumerate();
    let bodies = numbered.map(|(number, surface)| Body {
        surface: (surfaces.len() > 1).then_some(number),
        material: material(loaded, number, surface),
        emitter: emitter(surface),
    });
    bodies.collect()
}

/// Red, green and blue.
fn rgb(name: &str, [r, g, b]: [f32; 3]) -> String {
    format!(r#"<rgb name="{name}" value="{r}, {g}, {b}"/>"#)
}

/// An image as a texture of this name.
fn bitmap(name: &str, map: &Map, raw: bool) -> String {
    let Map {
        path,
        image,
        channel,
        wrap,
        nearest,
        to_uv,
    } = map;
    let mut text = format!(r#"<texture name="{name}" type="bitmap">{}"#, filename(path));
    if let Some(index) = image {
        text += &format!(r#"<integer name="image" value="{index}"/>"#);
    }
    for (property, value, usual) in [
        ("channel", *channel, "color"),
        ("wrap_mode", wrap[0], "repeat"),
        ("wrap_mode_v", wrap[1], wrap[0]),
        (
            "filter_type",
            if *nearest { "nearest" } else { "bilinear" },
            "bilinear",
        ),
    ] {
        if value != usual {
            text += &format!(r#"<string name="{property}" value="{value}"/>"#);
        }
    }
    if raw {
        text += r#"<boolean name="raw" value="true"/>"#;
    }
    if *to_uv != glam::Mat3::IDENTITY {
        let [x, y, t] = [to_uv.x_axis, to_uv.y_axis, to_uv.z_axis];
        text += &format!(
            r#"<transform name="to_uv"><matrix value="{} {} 0 {} {} {} 0 {} 0 0 1 0 0 0 0 1"/></transform>"#,
            x.x, y.x, t.x, x.y, y.y, t.y
        );
    }
    text + "</texture>"
}

/// A texture of this name that is the product of two, which are called `color0` and `color1`.
fn product(name: &str, first: &str, second: &str) -> String {
    format!(r#"<texture name="{name}" type="product">{first}{second}</texture>"#)
}

/// A number, or an image's times that.
fn number(name: &str, factor: f32, map: Option<&Map>) -> String {
    let constant = |name: &str| format!(r#"<float name="{name}" value="{factor}"/>"#);
    match map {
        None => constant(name),
        Some(map) if factor == 1.0 => bitmap(name, map, true),
        Some(map) => product(name, &bitmap("color0", map, true), &constant("color1")),
    }
}

/// A colour, or an image's times that; `None`: white.
fn tinted(name: &str, map: Option<&Map>, tint: impl Fn(&str) -> Option<String>) -> String {
    let white = || rgb(name, [1.0; 3]);
    match map {
        None => tint(name).unwrap_or_else(white),
        Some(map) => match tint("color1") {
            None => bitmap(name, map, false),
            Some(tint) => product(name, &bitmap("color0", map, false), &tint),
        },
    }
}

/// The material of the file's surface of this number.
fn material(loaded: &Loaded, surface_number: usize, surface: &Surface) -> String {
    let Maps {
        color: image,
        roughness,
        metallic,
        opacity,
        normal,
        normal_scale,
        ..
    } = &surface.maps;
    let even = loaded.color_of(surface_number);
    let even = even.filter(|color| color.iter().all(|part| (0.0..=1.0).contains(part)));
    let tint = |name: &str| match (even, image) {
        (Some([1.0, 1.0, 1.0]), _) => None,
        (Some(even), _) => Some(rgb(name, even)),
        (None, Some(_)) => color(&loaded.mesh, name),
        (None, None) => color(&loaded.mesh, name).or_else(|| Some(rgb(name, BARE_COLOR))),
    };
    let colored = |name: &str| tinted(name, image.as_ref(), tint);
    let is_matte = surface.roughness >= 1.0
        && surface.metallic <= 0.0
        && roughness.is_none()
        && metallic.is_none();
    let mut text = if is_matte {
        format!(r#"<bsdf type="diffuse">{}</bsdf>"#, colored("reflectance"))
    } else {
        let parts = [
            colored("base_color"),
            number("roughness", surface.roughness, roughness.as_ref()),
            number("metallic", surface.metallic, metallic.as_ref()),
        ];
        format!(r#"<bsdf type="principled">{}</bsdf>"#, parts.concat())
    };
    if let Some(normal) = normal {
        let normals = bitmap("normalmap", normal, true);
        let scale = match *normal_scale {
            1.0 => String::new(),
            scale => format!(r#"<float name="scale" value="{scale}"/>"#),
        };
        let side = r#"<boolean name="against_v" value="true"/>"#;
        text = format!(r#"<bsdf type="normalmap">{normals}{scale}{side}{text}</bsdf>"#);
    }
    text = format!(r#"<bsdf type="twosided">{text}</bsdf>"#);
    if surface.is_see_through() {
        let opacity = number("opacity", surface.opacity, opacity.as_ref());
        let cutoff = surface.cutoff.map_or_else(String::new, |cutoff| {
            format!(r#"<float name="cutoff" value="{cutoff}"/>"#)
        });
        text = format!(r#"<bsdf type="mask">{opacity}{cutoff}{text}</bsdf>"#);
    }
    text
}

/// The light that a surface gives.
fn emitter(surface: &Surface) -> String {
    let emission = surface.emission;
    if emission == [0.0; 3] {
        return String::new();
    }
    let tint = |name: &str| (emission != [1.0; 3]).then(|| rgb(name, emission));
    let radiance = |name: &str| tinted(name, surface.maps.emission.as_ref(), tint);
    // What is not there does not shine.
    let radiance = match &surface.maps.opacity {
        None => radiance("radiance"),
        Some(map) => product(
            "radiance",
            &radiance("color0"),
            &bitmap("color1", map, true),
        ),
    };
    format!(r#"<emitter type="area">{radiance}</emitter>"#)
}

/// The integrator that suits the surfaces: lights without an extent shine through what is see-through in `volpath` alone.
pub(super) fn integrator(surfaces: &[Surface]) -> &'static str {
    match surfaces.iter().any(Surface::is_see_through) {
        true => "volpath",
        false => "path",
    }
}
