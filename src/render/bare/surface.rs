//! What a glTF file says of its materials by their factors, which its mesh has as attributes of its faces: `principled`
//! has the same parts, or where all is matte `diffuse`, which is without its glow at grazing angles. The emission is an area light's, a radiance of 1 being 1 cd/m² as with the file's lights.

use super::{Finish, Staging, color};
use crate::mesh::{BARE_COLOR, Mesh};

/// An attribute as a texture of this name.
pub(super) fn texture(name: &str, attribute: &str) -> String {
    format!(
        r#"<texture name="{name}" type="mesh_attribute"><string name="name" value="{attribute}"/></texture>"#
    )
}

/// Whether the mesh is shown with its own materials.
fn is_own(mesh: &Mesh, staging: &Staging) -> bool {
    staging.finish == Finish::Auto && mesh.attributes.iter().any(|a| a.name == "face_roughness")
}

/// Whether the attribute is there and `differs` anywhere.
fn any(mesh: &Mesh, attribute: &str, differs: impl Fn(f32) -> bool) -> bool {
    let mut named = mesh.attributes.iter().filter(|a| a.name == attribute);
    named.any(|a| a.values.iter().any(|value| differs(*value)))
}

/// The mesh's own material; `None` where it has none, or another is asked for.
pub(super) fn material(mesh: &Mesh, staging: &Staging) -> Option<String> {
    if !is_own(mesh, staging) {
        return None;
    }
    let colored = |name: &str| {
        color(mesh, name).unwrap_or_else(|| {
            let [r, g, b] = BARE_COLOR;
            format!(r#"<rgb name="{name}" value="{r}, {g}, {b}"/>"#)
        })
    };
    let is_matte = !any(mesh, "face_roughness", |roughness| roughness < 1.0)
        && !any(mesh, "face_metallic", |metallic| metallic > 0.0);
    let inside = if is_matte {
        format!(r#"<bsdf type="diffuse">{}</bsdf>"#, colored("reflectance"))
    } else {
        let [roughness, metallic] =
            ["roughness", "metallic"].map(|n| texture(n, &format!("face_{n}")));
        let base_color = colored("base_color");
        format!(r#"<bsdf type="principled">{base_color}{roughness}{metallic}</bsdf>"#)
    };
    let opaque = format!(r#"<bsdf type="twosided">{inside}</bsdf>"#);
    if !is_see_through(mesh) {
        return Some(opaque);
    }
    let opacity = texture("opacity", "face_opacity");
    Some(format!(r#"<bsdf type="mask">{opacity}{opaque}</bsdf>"#))
}

fn is_see_through(mesh: &Mesh) -> bool {
    any(mesh, "face_opacity", |opacity| opacity < 1.0)
}

/// The integrator that suits the material: lights without an extent shine through what is see-through in `volpath` alone.
pub(super) fn integrator(mesh: &Mesh, staging: &Staging) -> &'static str {
    if is_own(mesh, staging) && is_see_through(mesh) {
        "volpath"
    } else {
        "path"
    }
}

/// The light that the mesh itself gives.
pub(super) fn emission(mesh: &Mesh, staging: &Staging) -> String {
    if !is_own(mesh, staging) || !any(mesh, "face_emission", |part| part > 0.0) {
        return String::new();
    }
    let radiance = texture("radiance", "face_emission");
    format!("\n        <emitter type=\"area\">{radiance}</emitter>")
}
