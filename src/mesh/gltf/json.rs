//! The JSON of a glTF file, as far as it is read: every field that the specification lets be left out has its
//! default, and what is unknown is passed over. Indices are as they stand in the file: [`at`] holds them against what
//! they index.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;

use super::OrWhy;

/// The whole file.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Root<'a> {
    pub(super) asset: Asset,
    pub(super) extensions_required: Vec<String>,
    pub(super) extensions: RootExtensions,
    pub(super) scene: Option<usize>,
    pub(super) scenes: Vec<Scene>,
    pub(super) nodes: Vec<Node>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<Texture>,
    #[serde(rename = "samplers")]
    pub(super) lookups: Vec<Lookup>,
    #[serde(borrow)]
    pub(super) images: Vec<Image<'a>>,
    pub(super) cameras: Vec<Camera>,
    pub(super) skins: Vec<Skin>,
    pub(super) animations: Vec<Animation>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<BufferView>,
    #[serde(borrow)]
    pub(super) buffers: Vec<Buffer<'a>>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Asset {
    pub(super) version: Option<String>,
    pub(super) min_version: Option<String>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct RootExtensions {
    /// Read by those alone who show lights.
    #[serde(rename = "KHR_lights_punctual")]
    pub(super) lights: Option<Value>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Scene {
    pub(super) nodes: Vec<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Node {
    pub(super) name: Option<String>,
    pub(super) children: Vec<usize>,
    pub(super) mesh: Option<usize>,
    pub(super) camera: Option<usize>,
    pub(super) skin: Option<usize>,
    /// By columns; stands instead of the three below.
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    /// A quaternion x, y, z, w.
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
    /// Of the mesh's morph targets, in place of the mesh's own.
    pub(super) weights: Option<Vec<f32>>,
    pub(super) extensions: NodeExtensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(super) instancing: Option<Instancing>,
    #[serde(rename = "KHR_lights_punctual")]
    pub(super) light: Option<NodeLight>,
    #[serde(rename = "KHR_node_visibility")]
    pub(super) visibility: Option<Visibility>,
}

#[derive(Deserialize)]
pub(super) struct NodeLight {
    /// Which of the file's lights.
    pub(super) light: usize,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Instancing {
    /// Accessors of `TRANSLATION`, `ROTATION` and `SCALE`.
    pub(super) attributes: BTreeMap<String, usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Visibility {
    pub(super) visible: Option<bool>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub(super) name: Option<String>,
    pub(super) primitives: Vec<Primitive>,
    #[serde(default)]
    pub(super) weights: Vec<f32>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    /// Accessors by what they hold.
    pub(super) attributes: BTreeMap<String, usize>,
    pub(super) indices: Option<usize>,
    pub(super) material: Option<usize>,
    /// Points, lines (3) or triangles (3); `None`: triangles.
    pub(super) mode: Option<u32>,
    /// For each morph target, accessors of what is added.
    #[serde(default)]
    pub(super) targets: Vec<BTreeMap<String, usize>>,
    #[serde(default)]
    pub(super) extensions: PrimitiveExtensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub(super) draco: Option<IgnoredAny>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Material {
    pub(super) pbr_metallic_roughness: Pbr,
    pub(super) normal_texture: Option<TextureInfo>,
    pub(super) occlusion_texture: Option<IgnoredAny>,
    pub(super) emissive_texture: Option<TextureInfo>,
    pub(super) emissive_factor: [f32; 3],
    pub(super) alpha_mode: Option<String>,
    pub(super) alpha_cutoff: Option<f32>,
    pub(super) extensions: BTreeMap<String, Value>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Pbr {
    /// Linear red, green, blue, and alpha.
    pub(super) base_color_factor: Option<[f32; 4]>,
    pub(super) base_color_texture: Option<TextureInfo>,
    pub(super) metallic_factor: Option<f32>,
    pub(super) roughness_factor: Option<f32>,
    pub(super) metallic_roughness_texture: Option<TextureInfo>,
}

#[derive(Clone, Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct TextureInfo {
    /// Which of the file's textures.
    pub(super) index: usize,
    /// What x and y of normals are multiplied by.
    pub(super) scale: Option<f32>,
    /// Which of the primitive's texture coordinates.
    pub(super) tex_coord: u32,
    pub(super) extensions: TextureExtensions,
}

#[derive(Clone, Deserialize, Default)]
#[serde(default)]
pub(super) struct TextureExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub(super) transform: Option<TextureTransform>,
}

#[derive(Clone, Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct TextureTransform {
    pub(super) offset: [f32; 2],
    /// In radians.
    pub(super) rotation: f32,
    pub(super) scale: Option<[f32; 2]>,
    /// In place of [`TextureInfo::tex_coord`].
    pub(super) tex_coord: Option<u32>,
}

/// An image, and how it is looked up.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Texture {
    pub(super) sampler: Option<usize>,
    /// An image; `None`: an extension knows it.
    pub(super) source: Option<usize>,
    pub(super) extensions: BTreeMap<String, IgnoredAny>,
}

/// How texels are looked up, in numbers of OpenGL.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Lookup {
    pub(super) mag_filter: Option<u32>,
    pub(super) wrap_s: Option<u32>,
    pub(super) wrap_t: Option<u32>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Image<'a> {
    #[serde(borrow)]
    pub(super) uri: Option<Cow<'a, str>>,
    pub(super) buffer_view: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Camera {
    pub(super) perspective: Option<Perspective>,
    pub(super) orthographic: Option<Orthographic>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Perspective {
    /// In radians.
    pub(super) yfov: f64,
    pub(super) aspect_ratio: Option<f64>,
    pub(super) znear: f64,
    pub(super) zfar: Option<f64>,
}

#[derive(Deserialize)]
pub(super) struct Orthographic {
    pub(super) xmag: f64,
    pub(super) ymag: f64,
    pub(super) znear: f64,
    pub(super) zfar: f64,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Animation {
    pub(super) channels: Vec<Channel>,
    pub(super) samplers: Vec<Sampler>,
}

#[derive(Deserialize)]
pub(super) struct Channel {
    pub(super) sampler: usize,
    pub(super) target: Target,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Target {
    pub(super) node: Option<usize>,
    /// `translation`, `rotation`, `scale` or `weights`; others are passed over.
    pub(super) path: String,
}

#[derive(Deserialize)]
pub(super) struct Sampler {
    /// An accessor of times in seconds.
    pub(super) input: usize,
    /// An accessor of values.
    pub(super) output: usize,
    pub(super) interpolation: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    /// Nodes.
    pub(super) joints: Vec<usize>,
    /// An accessor of matrices; `None`: identities.
    pub(super) inverse_bind_matrices: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    /// `None`: zeros.
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) kind: ElementKind,
    pub(super) sparse: Option<Sparse>,
}

/// What an element of an accessor is.
#[derive(Deserialize, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum ElementKind {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
}

impl ElementKind {
    /// Numbers an element.
    pub(super) fn components(self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Vec2 => 2,
            Self::Vec3 => 3,
            Self::Vec4 | Self::Mat2 => 4,
            Self::Mat3 => 9,
            Self::Mat4 => 16,
        }
    }
}

/// Elements that stand in place of the accessor's.
#[derive(Deserialize)]
pub(super) struct Sparse {
    pub(super) count: usize,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: Option<usize>,
    #[serde(default)]
    pub(super) extensions: ViewExtensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct ViewExtensions {
    #[serde(rename = "EXT_meshopt_compression", alias = "KHR_meshopt_compression")]
    pub(super) meshopt: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer<'a> {
    /// `None`: what is in the GLB file.
    #[serde(borrow)]
    pub(super) uri: Option<Cow<'a, str>>,
    pub(super) byte_length: usize,
}

/// Extensions that must be understood, and are.
const UNDERSTOOD: [&str; 3] = [
    "EXT_mesh_gpu_instancing",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
];

/// Those that change how a thing looks or moves, and not what it is, have these in their names.
const APPEARANCE: [&str; 4] = ["_materials_", "_texture_", "_lights_", "_animation_"];

impl<'a> Root<'a> {
    /// Reads `text`, which must be of version 2 and ask for no unknown extension.
    pub(super) fn parse(text: &'a [u8]) -> OrWhy<Self> {
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        // Some writers fill a GLB chunk up with zeros.
        let end = text.iter().rposition(|&byte| byte != 0);
        let text = &text[..end.map_or(0, |end| end + 1)];
        let root: OrWhy<Self> =
            serde_json::from_slice(text).map_err(|e| format!("the JSON is malformed: {e}"));
        let root = root.map_err(|why| older(text).unwrap_or(why))?;
        let Asset {
            version,
            min_version,
        } = &root.asset;
        if let Some(version) = min_version.as_ref().or(version.as_ref())
            && version != "2"
            && !version.starts_with("2.")
        {
            return Err(unknown_version(version));
        }
        if min_version.as_ref().is_some_and(|least| least != "2.0") {
            return Err("the file asks for a reader of a later version than 2.0".to_owned());
        }
        (root.extensions_required.iter()).try_for_each(|name| understood(name))?;
        Ok(root)
    }
}

fn unknown_version(version: &str) -> String {
    format!("glTF version {version:?} is unknown; version 2.0 is wanted")
}

/// What is wrong with a file of version 1, whose JSON is of another structure.
fn older(text: &[u8]) -> Option<String> {
    #[derive(Deserialize)]
    struct File {
        asset: Asset,
    }
    let file: File = serde_json::from_slice(text).ok()?;
    let version = file.asset.version?;
    version.starts_with("1.").then(|| unknown_version(&version))
}

fn understood(extension: &str) -> OrWhy<()> {
    if UNDERSTOOD.contains(&extension) || APPEARANCE.iter().any(|word| extension.contains(word)) {
        return Ok(());
    }
    Err(match extension {
        "KHR_draco_mesh_compression" => draco(),
        "EXT_meshopt_compression" | "KHR_meshopt_compression" => meshopt(),
        _ => format!("the file requires the extension {extension:?}, which is not supported"),
    })
}

pub(super) fn draco() -> String {
    "its meshes are compressed by Draco (KHR_draco_mesh_compression), which is not read: save the file without \
     compression"
        .to_owned()
}

pub(super) fn meshopt() -> String {
    "its buffers are compressed by meshoptimizer (EXT_meshopt_compression), which is not read: save the file without \
     compression"
        .to_owned()
}

/// Entry `index` of a list, or what is wrong: `what` names an entry.
pub(super) fn at<'a, T>(list: &'a [T], index: usize, what: &str) -> OrWhy<&'a T> {
    list.get(index).ok_or_else(|| {
        format!(
            "{what} {index} is out of range; there are {} of them",
            list.len()
        )
    })
}
