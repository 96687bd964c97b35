//! What files say that faces are made of, beside the colours that the mesh itself has: factors, and images by its texture
//! coordinates. Faces whose materials differ in colour alone have one surface.

use std::path::PathBuf;

use glam::Mat3;

use super::{Attribute, Mesh, Per};

/// The attribute that says which of a file's surfaces a face has, where there are several.
pub(super) const FACE_SURFACE: &str = "face_surface";

/// No file has more: each becomes a shape.
const MOST_SURFACES: usize = 1 << 10;

/// A material beside its base colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// From a mirror to matte, in [0, 1].
    pub roughness: f32,
    /// From a dielectric to a metal, in [0, 1].
    pub metallic: f32,
    /// Linear red, green and blue, in cd/m², as far as it is opaque. Not negative.
    pub emission: [f32; 3],
    /// In [0, 1].
    pub opacity: f32,
    /// Where the opacity is not its map's: it is 0 below this, and otherwise 1.
    pub cutoff: Option<f32>,
    /// Images that the factors are multiplied by.
    pub maps: Maps,
}

impl Surface {
    /// Matte and opaque, without an image.
    pub const MATTE: Self = Self {
        roughness: 1.0,
        metallic: 0.0,
        emission: [0.0; 3],
        opacity: 1.0,
        cutoff: None,
        maps: Maps::NONE,
    };
}

/// The images of a [`Surface`].
#[derive(Clone, Debug, PartialEq)]
pub struct Maps {
    /// The base colour, which the mesh's own colours are multiplied by.
    pub color: Option<Map>,
    /// The roughness.
    pub roughness: Option<Map>,
    /// How much of it is metal.
    pub metallic: Option<Map>,
    /// The emission.
    pub emission: Option<Map>,
    /// The opacity.
    pub opacity: Option<Map>,
    /// Normals: x to the right in the image, y upwards.
    pub normal: Option<Map>,
    /// What their x and y are multiplied by.
    pub normal_scale: f32,
}

impl Surface {
    /// Leaves out the images that are not `usable`. Where a factor alone would be no likeness, it is no metal, does not
    /// shine, and is opaque.
    pub fn keep_maps(&mut self, mut usable: impl FnMut(&Map) -> bool) {
        let Maps {
            color,
            roughness,
            metallic,
            emission,
            opacity,
            normal,
            ..
        } = &mut self.maps;
        let mut lost = |map: &mut Option<Map>| {
            let is_lost = map.as_ref().is_some_and(|map| !usable(map));
            map.take_if(|_| is_lost);
            is_lost
        };
        lost(color);
        lost(roughness);
        lost(normal);
        if lost(metallic) {
            self.metallic = 0.0;
        }
        if lost(emission) {
            self.emission = [0.0; 3];
        }
        if lost(opacity) {
            self.cutoff = None;
        }
    }

    /// Whether light goes through it anywhere.
    pub fn is_see_through(&self) -> bool {
        self.opacity < 1.0 || self.cutoff.is_some() || self.maps.opacity.is_some()
    }
}

impl Maps {
    /// No image.
    pub const NONE: Self = Self {
        color: None,
        roughness: None,
        metallic: None,
        emission: None,
        opacity: None,
        normal: None,
        normal_scale: 1.0,
    };
}

/// An image by texture coordinates, whose origin is its upper left corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// The image, or the glTF file that it is in.
    pub path: PathBuf,
    /// Which of that file's images.
    pub image: Option<usize>,
    /// What of it is meant: `color`, or `r`, `g`, `b` or `a`.
    pub channel: &'static str,
    /// What is beyond its edges along u and v: `repeat`, `mirror` or `clamp`.
    pub wrap: [&'static str; 2],
    /// Whether texels are not interpolated.
    pub nearest: bool,
    /// What is done to the mesh's texture coordinates.
    pub to_uv: Mat3,
}

impl Map {
    /// A whole image that repeats. Wherever its path is spelled from, it is the same.
    pub fn of(path: PathBuf) -> Self {
        Self {
            path: std::path::absolute(&path).unwrap_or(path),
            image: None,
            channel: "color",
            wrap: ["repeat"; 2],
            nearest: false,
            to_uv: Mat3::IDENTITY,
        }
    }

    /// The same image by one channel.
    #[must_use]
    pub fn by(&self, channel: &'static str) -> Self {
        Self {
            channel,
            ..self.clone()
        }
    }
}

/// Surfaces in the order in which faces first have them.
#[derive(Debug, Default)]
pub(super) struct Surfaces {
    list: Vec<Surface>,
    /// Whether there were more than are kept.
    too_many: bool,
}

impl Surfaces {
    /// The number of a surface; the last that is kept stands for those beyond.
    pub(super) fn number(&mut self, surface: Surface) -> u32 {
        let known = self.list.iter().position(|other| *other == surface);
        let number = known.unwrap_or_else(|| {
            if self.list.len() == MOST_SURFACES {
                self.too_many = true;
                return MOST_SURFACES - 1;
            }
            self.list.push(surface);
            self.list.len() - 1
        });
        number as u32
    }

    /// What is to be told where there were more than are kept.
    pub(super) fn excess(&self) -> Option<&'static str> {
        (self.too_many).then_some(
            "materials beyond the first 1024 of different look are shown as the last of those",
        )
    }

    /// Whether they have nothing to say.
    pub(super) fn is_all_matte(&self) -> bool {
        self.list.iter().all(|surface| *surface == Surface::MATTE)
    }

    /// The surfaces of a mesh whose faces have those of these numbers: so many faces in turn of each.
    pub(super) fn of_faces(self, mesh: &mut Mesh, runs: &[(usize, u32)]) -> Vec<Surface> {
        if self.list.len() > 1 {
            // Exact, for there are not so many.
            let values = runs.iter();
            let values = values.flat_map(|&(count, number)| vec![number as f32; count]);
            mesh.attributes.push(Attribute {
                name: FACE_SURFACE.to_owned(),
                channels: 1,
                per: Per::Face,
                values: values.collect(),
            });
        }
        self.list
    }
}

/// The colour that all these faces have, if they have one: of their own, or at their corners.
pub(super) fn color_of(mesh: &Mesh, faces: impl Iterator<Item = u32>) -> Option<[f32; 3]> {
    let named = |name| mesh.attributes.iter().find(|a| a.name == name);
    let colors = named("vertex_color").or_else(|| named("face_color"))?;
    let mut rows = faces.flat_map(|face| match colors.per {
        Per::Face => [face; 3],
        Per::Vertex => mesh.triangles[face as usize],
    });
    let color = |row: u32| colors.row(row as usize).first_chunk().copied();
    let first = color(rows.next()?)?;
    rows.all(|row| color(row) == Some(first)).then_some(first)
}

/// The triangles that have this one of several surfaces.
pub(super) fn faces(mesh: &Mesh, surface: usize) -> Option<Vec<u32>> {
    let mut named = mesh.attributes.iter().filter(|a| a.name == FACE_SURFACE);
    let numbers = (0_u32..).zip(&named.next()?.values);
    let of = numbers.filter(|(_, number)| **number == surface as f32);
    Some(of.map(|(face, _)| face).collect())
}
