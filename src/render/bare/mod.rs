//! A bare mesh as a scene: framed by its own camera (glTF) or an automatic one, on a ground, under a soft sky
//! and a key light or the file's own lights (glTF), as its materials say or in the colours of its vertices or faces where the file has
//! any: a shape for each look. The ground is a little
//! lower than the mesh, so that what is flat does not lie in it.

mod frame;
mod lights;
mod staging;
mod surface;
mod upright;

use std::path::Path;

use glam::{DMat4, DVec3, Vec3};

use crate::budget::Budget;
use crate::description::{Description, Kind, Options, escaped};
use crate::error::{Error, Location, Result};
use crate::mesh::{
    Attribute, GltfAnimation, GltfCamera, GltfLight, GltfSetting, Loaded, Mesh, MeshFile,
    Projection, ReadMesh, ReadOptions, Time, extension, read, read_gltf_settings,
};
use crate::shape::Bounds;
use frame::FOV;
use staging::{placed, point};
use surface::Body;

pub use staging::{Background, Finish, Lighting, Staging, UpAxis};

/// Whether the file's extension is a mesh's.
pub fn is_mesh(path: &Path) -> bool {
    plugin(path).is_some()
}

/// The shape plugin that reads the file.
fn plugin(path: &Path) -> Option<&'static str> {
    const PLUGINS: [(&str, &str); 6] = [
        ("ply", "ply"),
        ("obj", "obj"),
        ("stl", "stl"),
        ("serialized", "serialized"),
        ("gltf", "gltf"),
        ("glb", "gltf"),
    ];
    let extension = extension(path);
    PLUGINS
        .iter()
        .find_map(|(e, plugin)| (*e == extension).then_some(*plugin))
}

/// How far below the mesh the ground is, as a part of the mesh's radius.
const GROUND_GAP: f32 = 1e-3;

/// A scene around a mesh.
#[derive(Debug)]
pub struct BareMesh {
    /// The scene. Its parameters can be overridden as any scene's.
    pub description: Description,
    /// The same as a file, which other programs read too where they know the mesh's format.
    pub text: String,
    /// The mesh: give it to the [`Session`](super::Session), and it is not read again.
    pub mesh: ReadMesh,
    /// What was framed of an animated file: the [`Staging`] of its next image takes it, and it is not looked at again.
    pub framing: Option<Framing>,
}

/// What a camera sees that stands still from one image of an animated file to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Framing {
    /// Around the mesh at all times.
    all: Bounds,
    /// Those of its boxes at some times.
    corners: Vec<Vec3>,
    /// Whether a triangle has an area at any of them.
    area: bool,
}

impl Framing {
    fn of(times: Vec<f32>, mut at: impl FnMut(f32) -> Result<Mesh>) -> Result<Self> {
        let mut framing = Self {
            all: Bounds::EMPTY,
            corners: Vec::new(),
            area: false,
        };
        for time in times {
            let mesh = at(time)?;
            framing.area |= has_area(&mesh);
            if let Some((min, max)) = mesh.bounds() {
                let seen = Bounds { min, max };
                framing.all = framing.all.union(seen);
                framing.corners.extend(seen.corners());
            }
        }
        Ok(framing)
    }
}

/// A scene around the mesh in `path`, which is read within the budget.
pub fn describe_mesh(
    path: &Path,
    staging: &Staging,
    options: &Options,
    budget: &Budget,
) -> Result<BareMesh> {
    let Some(plugin) = plugin(path) else {
        return Err(Error::input(format!(
            "{} is no mesh that Étendue reads",
            path.display()
        )));
    };
    let at = |time: Option<f32>| ReadOptions {
        time: time.map(Time::of),
        ..ReadOptions::BARE
    };
    let read_options = at(staging.moments().first().copied());
    let mut loaded = read(path, &read_options, budget)?;
    let Some(bounds) = loaded.mesh.bounds() else {
        let error = match loaded.dropped_triangles {
            0 => Error::input("the file holds no triangle")
                .help("a mesh has faces; points and lines alone are not drawn"),
            dropped => Error::input(format!(
                "no triangle is left: of each of its {dropped} a corner is not finite"
            ))
            .help("`etendue mesh report` says what is in the file"),
        };
        return Err(error.at(&Location::of_file(path)));
    };
    if let Some(animation) = &staging.animation
        && animation.passed_over > 0
    {
        let looks = animation.moments.len();
        let message = format!(
            "while the shutter is open the animation is looked at {looks} times, which passes over {} keyframes and turns",
            animation.passed_over
        );
        tell(&mut loaded, path, message);
    }
    for node in staging.animation.iter().flat_map(|a| &a.turned_over) {
        let message = format!(
            "while the shutter is open the scale of {node} goes through 0: its meshes turn inside out, and keep the sides \
             that their triangles have when it opens"
        );
        tell(&mut loaded, path, message);
    }
    let settings = match plugin {
        "gltf" => read_gltf_settings(path, staging.moments(), budget)?,
        _ => vec![GltfSetting::default()],
    };
    let (mut cameras, mut lights, mut warnings) = (Vec::new(), Vec::new(), Vec::new());
    for setting in settings {
        cameras.extend(setting.camera.filter(|_| !staging.asks_for_camera()));
        lights.push(setting.lights);
        warnings = setting.warnings;
    }
    let camera = own_camera(&cameras, staging.aspect());
    let (mut framing, mut area) = (None, has_area(&loaded.mesh));
    if let Some(animation) = &staging.animation {
        let is_lit = staging.lighting == Lighting::Auto && !lights[0].is_empty();
        let needless = camera.is_some() && is_lit && !staging.has_ground() && area;
        framing = match &staging.framing {
            Some(known) => Some(known.clone()),
            None if needless => None,
            None => Some(Framing::of(looks(animation), |time| {
                Ok(read(path, &at(Some(time)), budget)?.mesh)
            })?),
        };
    }
    let bounds = match &framing {
        Some(Framing { all, .. }) if !all.is_empty() => (all.min, all.max),
        _ => bounds,
    };
    area |= framing.as_ref().is_some_and(|framing| framing.area);
    if !area {
        let message = "none of the triangles has an area: there is nothing to see";
        return Err(Error::input(message).at(&Location::of_file(path)));
    }
    if let Finish::Picture(picture) = &staging.finish
        && loaded.mesh.uvs.is_empty()
    {
        let message = format!(
            "the mesh has no texture coordinates, by which {} would be shown on it",
            picture.display()
        );
        return Err(Error::input(message).at(&Location::of_file(path)));
    }
    let (rule, up) = (staging.up.rule(path), staging.up.of(path, &loaded.mesh));
    if up != rule {
        let [up, rule] = [up, rule].map(|axis| if axis == UpAxis::Z { 'z' } else { 'y' });
        let message = format!(
            "with +{rule} up, as its format has it, it would lie on its side: it is shown with +{up} up"
        );
        let turned = Error::input(message).help(format!("`--up {rule}` leaves it as it is"));
        let turned = turned.at(&Location::of_file(path));
        loaded.warnings.extend_from_slice(turned.problems());
    }
    let staging = &Staging {
        up,
        ..staging.clone()
    };
    let own = staging.own_material(options, budget)?;
    for message in unseen(&loaded.mesh) {
        tell(&mut loaded, path, message);
    }
    let said = if staging.lighting == Lighting::Auto {
        loaded.warnings.extend(warnings);
        let (center, radius) = frame::ball(bounds.0, bounds.1);
        (!lights[0].is_empty()).then(|| lights::warning(&lights[0], center, radius))
    } else {
        let left = lights[0].len();
        lights.clear();
        (left > 0).then(|| Some(format!("the file's own lights ({left}) are left out")))
    };
    if let Some(message) = said.flatten() {
        tell(&mut loaded, path, message);
    }
    if let (Lighting::Environment(_), Background::Color(_) | Background::Environment(_)) =
        (&staging.lighting, &staging.background)
    {
        let message =
            "what is seen beside the mesh is the image of --light: --background is left out";
        tell(&mut loaded, path, message);
    }
    let surfaces = surface::own(&mut loaded, staging, budget, &Location::of_file(path));
    let mut subject = Subject {
        plugin,
        bounds,
        camera,
        lights: &lights,
        mesh: &loaded.mesh,
        framed: match &framing {
            Some(Framing { corners, .. }) if !corners.is_empty() => corners,
            _ => &loaded.mesh.positions,
        },
        bodies: surface::bodies(&loaded, &surfaces),
        integrator: surface::integrator(&surfaces),
        staging,
    };
    if surfaces.is_empty() {
        subject.bodies.push(Body {
            surface: None,
            material: staging.material(|name| color(&loaded.mesh, name)),
            emitter: String::new(),
        });
    }
    let name = Path::new(path.file_name().unwrap_or_default());
    let text = scene(&subject, name, true);
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    // What of these the scene needs only a bare file has; texture coordinates of PLY files may be those of corners.
    let bare = match plugin {
        "gltf" => true,
        "ply" => !surfaces.is_empty(),
        "obj" => {
            let mut attributes = loaded.mesh.attributes.iter();
            surfaces.len() > 1 || attributes.any(|a| a.name.starts_with("face_"))
        }
        _ => false,
    };
    if let Some((file, bsdf)) = &own {
        subject.bodies[0].material = file.written(*bsdf);
    }
    let written = scene(&subject, &absolute, bare);
    // What is written here is nobody's to be refused.
    let options = Options {
        strict: false,
        ..options.clone()
    };
    let mut description = Description::parse(&text, path, &options)?.within(budget);
    if let Some((file, bsdf)) = &own {
        let shapes = description.root().children(Kind::Shape);
        let shape = shapes.last().expect("the mesh is the last").node_id();
        description.graft(shape, file, *bsdf);
    }
    let file = MeshFile {
        path: path.to_owned(),
        options: read_options,
    };
    let mesh = ReadMesh { file, loaded };
    Ok(BareMesh {
        description,
        text: written,
        mesh,
        framing,
    })
}

/// Warns of what is odd about the file.
fn tell(loaded: &mut Loaded, path: &Path, message: impl Into<String>) {
    let warning = Error::input(message.into()).at(&Location::of_file(path));
    loaded.warnings.extend_from_slice(warning.problems());
}

/// What the scene shows.
struct Subject<'a> {
    plugin: &'static str,
    bounds: (Vec3, Vec3),
    camera: Option<OwnCamera>,
    /// That light it at each moment, in place of what else there is.
    lights: &'a [Vec<GltfLight>],
    mesh: &'a Mesh,
    /// What the camera is to see.
    framed: &'a [Vec3],
    /// What of it is made of what; one at least.
    bodies: Vec<Body>,
    integrator: &'static str,
    staging: &'a Staging,
}

/// A camera that comes with the file.
struct OwnCamera {
    /// From Mitsuba's camera space, at each moment.
    to_world: Vec<DMat4>,
    /// The vertical angle of view, in degrees; `None`: its rays are parallel.
    fov_y: Option<f64>,
    near: f64,
    /// `None`: infinite.
    far: Option<f64>,
}

/// A camera at each moment as a scene file says it, of a film of this width over its height; `None` where there is none or it
/// sees nothing.
fn own_camera(cameras: &[GltfCamera], aspect: f64) -> Option<OwnCamera> {
    let GltfCamera {
        near,
        far,
        projection,
        ..
    } = *cameras.first()?;
    // Mitsuba's camera looks along +z with +x to the left: half a turn around y.
    let turn = DMat4::from_scale(DVec3::new(-1.0, 1.0, -1.0));
    let (scale, fov_y) = match projection {
        Projection::Perspective { fov_y, .. } if fov_y > 0.0 && fov_y < std::f64::consts::PI => {
            (DMat4::IDENTITY, Some(fov_y.to_degrees()))
        }
        // The film's width is 2 in the units of `to_world`.
        Projection::Orthographic { half_height, .. } if half_height > 0.0 => {
            let half_width = half_height * aspect;
            let scale = DVec3::new(half_width, half_width, 1.0);
            (DMat4::from_scale(scale), None)
        }
        _ => return None,
    };
    let to_world = cameras.iter().map(|camera| camera.to_world * turn * scale);
    Some(OwnCamera {
        to_world: to_world.collect(),
        fov_y,
        near,
        far,
    })
}

/// Times of an animation at which it is looked at to frame it, whatever the image: both ends, and between them by the golden
/// ratio, which keeps step with no turn.
fn looks(animation: &GltfAnimation) -> Vec<f32> {
    const LOOKS: u8 = 12;
    const GOLDEN: f32 = 0.618_034;
    let [first, last] = animation.span;
    let between = (0..LOOKS).map(|i| first + (last - first) * (f32::from(i) * GOLDEN).fract());
    let looks = between.chain([last]);
    looks.filter(|time| time.is_finite()).collect()
}

/// Whether a triangle can be seen from somewhere.
fn has_area(mesh: &Mesh) -> bool {
    mesh.triangles.iter().any(|t| {
        let [a, b, c] = mesh.corners(t).map(Vec3::as_dvec3);
        (b - a).cross(c - a) != DVec3::ZERO
    })
}

/// The mesh's own colours, those first that are shown.
fn colors(mesh: &Mesh) -> impl Iterator<Item = &Attribute> {
    let named = |name| mesh.attributes.iter().find(move |a| a.name == name);
    let colors = ["vertex_color", "face_color"].into_iter().filter_map(named);
    colors.filter(|a| a.channels >= 3)
}

/// What of the mesh's colours is not shown, in words.
fn unseen(mesh: &Mesh) -> Vec<String> {
    let mut colors = colors(mesh);
    let Some(shown) = colors.next() else {
        return Vec::new();
    };
    let mut unseen = Vec::new();
    if shown.channels == 4 && shown.values.chunks_exact(4).any(|color| color[3] < 1.0) {
        unseen.push(format!("the alpha channel of {} is not shown", shown.name));
    }
    unseen.extend(colors.map(|other| format!("{} is not shown, but {}", other.name, shown.name)));
    unseen
}

/// The mesh's own colours as a texture of this name.
fn color(mesh: &Mesh, name: &str) -> Option<String> {
    Some(surface::attribute(name, &colors(mesh).next()?.name))
}

/// The scene around the mesh that the shape reads from `file`, `bare` with what that says of materials.
fn scene(subject: &Subject<'_>, file: &Path, bare: bool) -> String {
    let Subject {
        bounds: (min, max),
        framed,
        staging,
        ..
    } = *subject;
    let (center, radius) = frame::ball(min, max);
    let up = staging.up.direction();
    let pose = frame::pose(framed, (min, max), staging);
    let distance = pose.eye.distance(pose.target);
    let [mut near, mut far] = [distance * 1e-3, (distance + f64::from(radius)) * 100.0];
    let field = |fov: f64, axis: &str| {
        format!(
            r#"
        <float name="fov" value="{fov}"/>
        <string name="fov_axis" value="{axis}"/>"#
        )
    };
    let (sensor, field, to_world) = match &subject.camera {
        Some(camera) => {
            // It sees nothing nearer than where it stands.
            near = camera.near.max(1e-6 * distance);
            far = camera.far.unwrap_or(far.max(1e6 * near));
            let matrix = |to_world: &DMat4| {
                let rows = to_world.transpose().to_cols_array();
                let rows = rows.map(|v| v.to_string()).join(" ");
                format!(r#"<matrix value="{rows}"/>"#)
            };
            let to_world = placed(&camera.to_world, staging.moments(), matrix);
            match camera.fov_y {
                Some(fov) => ("perspective", field(fov, "y"), to_world),
                None => ("orthographic", String::new(), to_world),
            }
        }
        None => {
            let [eye, target, upright] =
                [pose.eye, pose.target, pose.up].map(|p| format!("{}, {}, {}", p.x, p.y, p.z));
            let lookat = format!(r#"<lookat origin="{eye}" target="{target}" up="{upright}"/>"#);
            let fov = staging.fov.unwrap_or(FOV).into();
            let to_world = format!(r#"<transform name="to_world">{lookat}</transform>"#);
            ("perspective", field(fov, "smaller"), to_world)
        }
    };
    let hidden = match &staging.background {
        Background::Transparent => r#"<boolean name="hide_emitters" value="true"/>"#,
        Background::Sky | Background::Color(_) | Background::Environment(_) => "",
    };
    let pixels = match &staging.background {
        Background::Transparent => r#"<string name="pixel_format" value="rgba"/>"#,
        Background::Sky | Background::Color(_) | Background::Environment(_) => "",
    };
    let shutter = match staging.moments() {
        [open, .., close] => format!(
            r#"
        <float name="shutter_open" value="{open}"/>
        <float name="shutter_close" value="{close}"/>"#
        ),
        _ => String::new(),
    };
    let [width, height] = staging.size;
    let samples = staging.samples;
    // Which of them takes such a number.
    let sampler = if samples.isqrt().pow(2) == samples {
        "stratified"
    } else {
        "multijitter"
    };
    let key = (-0.9 * pose.right + 0.7 * pose.front + 1.2 * up).normalize();
    format!(
        r#"<scene version="3.0.0">
    <integrator type="{integrator}"><integer name="max_depth" value="8"/>{hidden}</integrator>
    <sensor type="{sensor}">{field}
        <float name="near_clip" value="{near}"/>
        <float name="far_clip" value="{far}"/>
        {to_world}{shutter}
        <film type="hdrfilm"><integer name="width" value="{width}"/><integer name="height" value="{height}"/>{pixels}</film>
        <sampler type="{sampler}"><integer name="sample_count" value="{samples}"/></sampler>
    </sensor>
    {lights}{ground}{bodies}
</scene>"#,
        lights = staging.lights(center, radius, key, subject.lights),
        ground = if staging.has_ground() {
            ground(center, min, radius, staging.up)
        } else {
            String::new()
        },
        integrator = subject.integrator,
        bodies = bodies(subject, file, bare),
    )
}

/// The mesh, as one shape or several.
fn bodies(subject: &Subject<'_>, file: &Path, bare: bool) -> String {
    let Subject {
        plugin,
        mesh,
        bodies,
        staging,
        ..
    } = subject;
    // A glTF without normals is meant to be flat; other formats leave them to be computed, which would round off the
    // parts of machines that STL is for.
    let flat = match *plugin {
        "gltf" => mesh.normals.is_empty(),
        "stl" => upright::is_angular(mesh),
        _ => false,
    };
    let file = escaped(&file.to_string_lossy());
    let line = |text: &str| format!("\n        {text}");
    let shapes = bodies.iter().map(|body| {
        let mut more = String::new();
        if bare {
            more += &line(r#"<boolean name="bare" value="true"/>"#);
        }
        if !staging.moments().is_empty() {
            let times: Vec<String> = staging.moments().iter().map(f32::to_string).collect();
            let times = times.join(", ");
            more += &line(&format!(r#"<string name="times" value="{times}"/>"#));
        }
        if let Some(surface) = body.surface {
            more += &line(&format!(r#"<integer name="surface" value="{surface}"/>"#));
        }
        more += &line(&body.material);
        if !body.emitter.is_empty() {
            more += &line(&body.emitter);
        }
        format!(
            r#"
    <shape type="{plugin}">
        <string name="filename" value="{file}"/>
        <boolean name="face_normals" value="{flat}"/>{more}
    </shape>"#
        )
    });
    shapes.collect()
}

/// The ground under a mesh that lies above `min`.
fn ground(center: Vec3, min: Vec3, radius: f32, up: UpAxis) -> String {
    let (up, front) = (up.direction(), up.front());
    let ground = center + up * ((min - center).dot(up) - GROUND_GAP * radius);
    format!(
        r#"
    <shape type="rectangle">
        <transform name="to_world">
            <scale value="{size}"/>
            <lookat origin="{ground}" target="{above}" up="{front}"/>
        </transform>
        <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.35, 0.35, 0.36"/></bsdf></bsdf>
    </shape>"#,
        size = 40.0 * radius,
        ground = point(ground),
        above = point(ground + radius * up),
        front = point(front),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Kind;

    fn describe(name: &str, text: &str) -> Description {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let bare = describe_mesh(
            &path,
            &Staging::default(),
            &Options::default(),
            &Budget::default(),
        );
        bare.unwrap().description
    }

    const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n3 0 1 2\n";

    /// A red triangle, and a camera at z = 4 that looks at it.
    const GLTF: &str = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0,1]}],
        "nodes":[{"mesh":0},{"camera":0,"translation":[0,0,4]}],
        "cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":0.1}}],
        "materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.8,0.1,0.1,1]}}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

    #[test]
    fn a_gltf_file_is_seen_through_its_own_camera() {
        let scene = describe("camera.gltf", GLTF);
        let sensor = scene.root().children(Kind::Sensor)[0];
        let fov = sensor.float("fov").unwrap();
        assert!((fov - 0.5f64.to_degrees()).abs() < 1e-5);
        let to_world = sensor.transform("to_world").unwrap();
        let near = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-9, "{a}");
        near(
            to_world.transform_point3(DVec3::ZERO),
            DVec3::new(0.0, 0.0, 4.0),
        );
        near(to_world.transform_vector3(DVec3::Z), DVec3::NEG_Z);
        near(to_world.transform_vector3(DVec3::X), DVec3::NEG_X);
    }

    /// What stands on the camera's node goes 2 to the right in a second, as does what the file's other node shows.
    #[test]
    fn a_gltf_files_camera_and_lights_move_with_their_nodes() {
        use base64::Engine as _;
        let keys = [0.0_f32, 1.0, 0.0, 0.0, 4.0, 2.0, 0.0, 4.0];
        let bytes: Vec<u8> = keys.iter().flat_map(|v| v.to_le_bytes()).collect();
        let data = base64::engine::general_purpose::STANDARD.encode(bytes);
        let light = r#""extensions":{"KHR_lights_punctual":{"light":0}}"#;
        let text = GLTF
            .replace("\"camera\":0", &format!("\"camera\":0,{light}"))
            .replace(
                r#""asset""#,
                r#""extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":40}]}},
                "animations":[{"channels":[{"sampler":0,"target":{"node":1,"path":"translation"}}],
                "samplers":[{"input":1,"output":2}]}],"asset""#,
            )
            .replace(
                r#""accessors":["#,
                r#""accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
                {"bufferView":1,"componentType":5126,"count":2,"type":"SCALAR"},
                {"bufferView":1,"byteOffset":8,"componentType":5126,"count":2,"type":"VEC3"},"#,
            )
            .replace("\"byteLength\":36}],", "\"byteLength\":36},{\"buffer\":1,\"byteLength\":32}],")
            .replace(
                r#""buffers":["#,
                r#""buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"},"#,
            )
            .replace(
                r#"{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]"#,
                &format!(r#"{{"byteLength":32,"uri":"data:application/octet-stream;base64,{data}"}}]"#),
            );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("moves.gltf");
        std::fs::write(&path, text).unwrap();
        let budget = Budget::default();
        let seen = |shutter: Option<[f32; 2]>| {
            let animation = shutter.map(|shutter| {
                let animation = crate::mesh::read_gltf_animation(&path, shutter, &budget);
                animation.unwrap().unwrap()
            });
            let staging = Staging {
                animation,
                ..Staging::default()
            };
            let bare = describe_mesh(&path, &staging, &Options::default(), &budget).unwrap();
            let root = bare.description.root();
            let places = |kind: Kind, time: f32| {
                let node = root.children(kind)[0];
                node.motion("to_world").unwrap().at(time).translation()
            };
            [0.25, 0.75].map(|time| [Kind::Sensor, Kind::Emitter].map(|kind| places(kind, time)))
        };
        let [rest, middle] = [0.0, 1.0].map(|x| Vec3::new(x, 0.0, 4.0));
        let near = |found: [[Vec3; 2]; 2], expected: [Vec3; 2]| {
            let pairs = found.into_iter().zip(expected);
            let off = pairs.flat_map(|(found, expected)| found.map(|p| p.distance(expected)));
            assert!(off.into_iter().all(|off| off < 1e-5), "{found:?}");
        };
        near(seen(None), [rest; 2]);
        near(seen(Some([0.5, 0.5])), [middle; 2]);
        near(
            seen(Some([0.0, 1.0])),
            [0.5, 1.5].map(|x| Vec3::new(x, 0.0, 4.0)),
        );
        // What frames it is found once, and only where the ground needs it.
        let with = |ground: bool, framing: Option<Framing>| {
            let animation = crate::mesh::read_gltf_animation(&path, [0.5, 0.5], &budget);
            let staging = Staging {
                animation: animation.unwrap(),
                framing,
                ground,
                ..Staging::default()
            };
            describe_mesh(&path, &staging, &Options::default(), &budget).unwrap()
        };
        let first = with(true, None);
        let framing = first.framing.unwrap();
        assert_eq!(with(true, Some(framing.clone())).text, first.text);
        let larger = Framing {
            all: framing.all.with(Vec3::splat(-9.0)),
            ..framing
        };
        assert_ne!(with(true, Some(larger)).text, first.text);
        assert!(with(false, None).framing.is_none());
    }

    #[test]
    fn a_gltf_cameras_clips_and_parallel_rays_are_kept_and_the_scaling_of_its_node_is_not() {
        let sensor = |camera: &str| {
            let text = GLTF
                .replace(
                    "\"translation\":[0,0,4]",
                    "\"translation\":[0,0,4],\"scale\":[-3,2,5]",
                )
                .replace(
                    r#""perspective","perspective":{"yfov":0.5,"znear":0.1}"#,
                    camera,
                );
            let scene = describe("camera.gltf", &text);
            let sensor = scene.root().children(Kind::Sensor)[0];
            let [near, far] = ["near_clip", "far_clip"].map(|name| sensor.float(name).unwrap());
            let to_world = sensor.transform("to_world").unwrap();
            (sensor.plugin().to_owned(), to_world, near, far)
        };
        let turned = DVec3::new(-1.0, 1.0, -1.0);
        let from = DMat4::from_translation(DVec3::new(0.0, 0.0, 4.0));
        let (plugin, to_world, near, far) =
            sensor(r#""perspective","perspective":{"yfov":0.5,"znear":3.5,"zfar":4.5}"#);
        assert_eq!((plugin.as_str(), near, far), ("perspective", 3.5, 4.5));
        assert!(to_world.abs_diff_eq(from * DMat4::from_scale(turned), 1e-9));
        let (plugin, to_world, near, far) =
            sensor(r#""orthographic","orthographic":{"xmag":7,"ymag":1.5,"znear":0,"zfar":9}"#);
        assert!(plugin == "orthographic" && near > 0.0 && near < 1e-4 && far == 9.0);
        // The film is 4:3.
        let scale = DMat4::from_scale(turned * DVec3::new(2.0, 2.0, 1.0));
        assert!(to_world.abs_diff_eq(from * scale, 1e-6), "{to_world}");
    }

    #[test]
    fn a_mesh_with_vertex_colours_shows_them() {
        let mesh = |scene: &Description| {
            let shape = scene.root().children(Kind::Shape)[2];
            let twosided = shape.children(Kind::Bsdf)[0];
            let diffuse = twosided.children(Kind::Bsdf)[0];
            !diffuse.children(Kind::Texture).is_empty()
        };
        assert!(mesh(&describe("colored.ply", PLY)));
        let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        assert!(!mesh(&describe("plain.obj", obj)));
    }

    #[test]
    fn a_gltf_file_shows_the_factors_of_its_materials() {
        let parts = |factors: &str, material: &str| {
            let text = GLTF.replace("1]}}", &format!("1]{factors}}}{material}}}"));
            let scene = describe("made.gltf", &text);
            let integrator = scene.root().children(Kind::Integrator)[0];
            let shape = scene.root().children(Kind::Shape)[2];
            let mut named = vec![integrator.plugin().to_owned()];
            let mut bsdf = shape.children(Kind::Bsdf)[0];
            while let [inner] = bsdf.children(Kind::Bsdf)[..] {
                named.push(bsdf.plugin().to_owned());
                bsdf = inner;
            }
            named.push(bsdf.plugin().to_owned());
            let emitters = shape.children(Kind::Emitter).len();
            (
                named.join(" "),
                bsdf.children(Kind::Texture).len(),
                emitters,
            )
        };
        let of = |named: &str, textures, emitters| (named.to_owned(), textures, emitters);
        assert_eq!(parts("", ""), of("path twosided principled", 0, 0));
        let matte = r#","metallicFactor":0"#;
        assert_eq!(parts(matte, ""), of("path twosided diffuse", 0, 0));
        let cut = r#","alphaMode":"MASK","alphaCutoff":2,"emissiveFactor":[1,1,1]"#;
        // Nothing of it is left to shine.
        let expected = of("volpath mask twosided diffuse", 0, 0);
        assert_eq!(parts(matte, cut), expected);
        let shining = r#","emissiveFactor":[0,0,1]"#;
        assert_eq!(parts(matte, shining), of("path twosided diffuse", 0, 1));
    }

    #[test]
    fn an_obj_file_shows_the_colours_of_its_materials() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("red.obj");
        let obj = "mtllib red.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
        std::fs::write(&path, obj).unwrap();
        let textures = || {
            let bare = describe_mesh(
                &path,
                &Staging::default(),
                &Options::default(),
                &Budget::default(),
            );
            let scene = bare.unwrap().description;
            let shape = scene.root().children(Kind::Shape)[2];
            assert!(shape.boolean("bare").unwrap());
            let diffuse = shape.children(Kind::Bsdf)[0].children(Kind::Bsdf)[0];
            let textures = diffuse.children(Kind::Texture);
            let plugins = textures.iter().map(|t| t.plugin().to_owned());
            plugins.collect::<Vec<_>>()
        };
        assert!(textures().is_empty());
        std::fs::write(folder.path().join("red.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
        assert_eq!(textures(), ["mesh_attribute"]);
    }

    #[test]
    fn a_material_comes_from_a_file_of_which_it_is_the_only_one() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a.ply"), PLY).unwrap();
        let of = |text: &str| {
            let text = format!(r#"<scene version="3.0.0">{text}</scene>"#);
            std::fs::write(at("m.xml"), text).unwrap();
            let staging = Staging {
                finish: Finish::File(at("m.xml")),
                ..Staging::default()
            };
            let options = Options::default();
            describe_mesh(&at("a.ply"), &staging, &options, &Budget::default())
        };
        let one = r#"<bsdf type="plastic"><float name="int_ior" value="1.3"/></bsdf>"#;
        let scene = of(&format!(r#"<shape type="sphere"/>{one}"#)).unwrap();
        let material = |scene: &Description| {
            let shape = *scene.root().children(Kind::Shape).last().unwrap();
            let bsdf = shape.children(Kind::Bsdf)[0];
            assert_eq!((bsdf.plugin(), bsdf.float("int_ior")), ("plastic", Ok(1.3)));
        };
        material(&scene.description);
        assert!(scene.description.sources().contains(&at("m.xml")));
        material(&Description::parse(&scene.text, &at("b.xml"), &Options::default()).unwrap());
        for (text, told) in [
            ("", "m.xml: there is no <bsdf> at the top"),
            (
                &format!("{one}\n{one}"),
                "m.xml:2:1: the file has 2 <bsdf>s",
            ),
            ("<bsdf/>", "m.xml:1"),
        ] {
            let error = of(text).unwrap_err().to_string();
            assert!(error.contains(told), "{error}");
        }
    }

    #[test]
    fn a_picture_needs_texture_coordinates() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        let staging = Staging {
            finish: Finish::Picture("wood.png".into()),
            ..Staging::default()
        };
        let of = |text: &str| {
            std::fs::write(&path, text).unwrap();
            describe_mesh(&path, &staging, &Options::default(), &Budget::default())
        };
        let error = of("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap_err();
        assert!(error.to_string().contains("wood.png"), "{error}");
        let with = of("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
        assert!(with.unwrap().text.contains("wood.png"));
    }
}
