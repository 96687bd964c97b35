//! A bare mesh as a scene: framed by an automatic camera, on a ground, under a soft sky and a key light.

use std::path::Path;

use glam::Vec3;

use crate::description::{Description, Options};
use crate::error::{Error, Result};
use crate::mesh::{ReadOptions, read};

/// Which way is up in a mesh file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// +y, as most scanned and modelled meshes have it.
    #[default]
    Y,
    /// +z, as CAD and terrain have it.
    Z,
}

/// Whether the file's extension is a mesh's.
pub fn is_mesh(path: &Path) -> bool {
    plugin(path).is_some()
}

/// The shape plugin that reads the file.
fn plugin(path: &Path) -> Option<&'static str> {
    let extension = path.extension()?.to_str()?.to_lowercase();
    ["ply", "obj"].into_iter().find(|name| *name == extension)
}

/// The camera's vertical field of view in degrees.
const FOV: f32 = 30.0;

/// A scene around the mesh in `path`. Its parameters can be overridden as any scene's.
pub fn describe_mesh(path: &Path, up: UpAxis, options: &Options) -> Result<Description> {
    let Some(plugin) = plugin(path) else {
        return Err(Error::input(format!(
            "{} is no mesh that Étendue reads",
            path.display()
        )));
    };
    let loaded = read(path, &ReadOptions::default())?;
    let Some((min, max)) = loaded.mesh.bounds() else {
        return Err(Error::input(format!(
            "{} holds no triangle",
            path.display()
        )));
    };
    let up = match up {
        UpAxis::Y => Vec3::Y,
        UpAxis::Z => Vec3::Z,
    };
    let text = scene(plugin, path, (min, max), up);
    Description::parse(&text, path, options)
}

fn scene(plugin: &str, path: &Path, (min, max): (Vec3, Vec3), up: Vec3) -> String {
    let center = 0.5 * (min + max);
    let radius = (0.5 * (max - min).length()).max(f32::MIN_POSITIVE);
    // From the front, a little to the right and above: right-handed with `up`.
    let (right, front) = if up == Vec3::Y {
        (Vec3::X, Vec3::Z)
    } else {
        (Vec3::X, Vec3::NEG_Y)
    };
    let view = (0.45 * right + 0.9 * front + 0.35 * up).normalize();
    let distance = radius / (FOV.to_radians() / 2.0).sin();
    let eye = center + distance * view;
    let key = center + 4.0 * radius * (-0.9 * right + 0.7 * front + 1.2 * up).normalize();
    let ground = center + up * (min - center).dot(up);
    let [near, far] = [distance * 1e-3, distance * 100.0];
    let point = |p: Vec3| format!("{}, {}, {}", p.x, p.y, p.z);
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let file = file
        .replace('&', "&amp;")
        .replace('"', "&quot;")
        .replace('<', "&lt;")
        .replace('$', "&#36;");
    format!(
        r#"<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="8"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="{FOV}"/>
        <string name="fov_axis" value="smaller"/>
        <float name="near_clip" value="{near}"/>
        <float name="far_clip" value="{far}"/>
        <transform name="to_world"><lookat origin="{eye}" target="{center}" up="{up}"/></transform>
        <film type="hdrfilm"><integer name="width" value="1024"/><integer name="height" value="768"/></film>
        <sampler type="stratified"><integer name="sample_count" value="64"/></sampler>
    </sensor>
    <emitter type="constant"><rgb name="radiance" value="0.42, 0.47, 0.55"/></emitter>
    <shape type="sphere">
        <point name="center" value="{key}"/>
        <float name="radius" value="{key_radius}"/>
        <emitter type="area"><rgb name="radiance" value="30, 27, 23"/></emitter>
    </shape>
    <shape type="rectangle">
        <transform name="to_world">
            <scale value="{ground_size}"/>
            <lookat origin="{ground}" target="{ground_up}" up="{front}"/>
        </transform>
        <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.35, 0.35, 0.36"/></bsdf></bsdf>
    </shape>
    <shape type="{plugin}">
        <string name="filename" value="{file}"/>
        <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.65, 0.6, 0.52"/></bsdf></bsdf>
    </shape>
</scene>"#,
        eye = point(eye),
        center = point(center),
        up = point(up),
        key = point(key),
        key_radius = 0.6 * radius,
        ground_size = 40.0 * radius,
        ground = point(ground),
        ground_up = point(ground + radius * up),
        front = point(front),
    )
}
