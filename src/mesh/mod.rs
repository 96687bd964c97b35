//! Triangle meshes: one [`Mesh`] type, a reader a file format, vertex normals and generated shapes. A mesh
//! is arrays of vertices and triangles as they stand in the file, in the vertex order of Mitsuba 3.9.1.
//!
//! What a `shape` of Mitsuba does with a mesh, probed on its wheel, and the method that does it here:
//! `to_world` moves the vertices and never changes the winding, so that a mirroring transform turns the
//! geometric normals over ([`Mesh::transform`]); normals of the file go through the inverse transpose;
//! missing normals are computed *after* that transform ([`Mesh::compute_normals`]), so that they agree
//! with the turned faces; `face_normals` drops the vertex normals ([`Mesh::drop_normals`]);
//! `flip_normals` turns geometric and vertex normals over ([`Mesh::flip_normals`]).

mod cache;
mod colors;
mod displace;
mod far;
mod generate;
mod gltf;
mod mtl;
mod normals;
mod obj;
mod parts;
mod ply;
mod polygon;
mod read;
mod refine;
mod report;
mod select;
mod serialized;
mod source;
mod stl;
mod surface;
#[cfg(test)]
mod tests;
mod weld;

use glam::{DMat4, DVec3, Vec2, Vec3};
use rayon::prelude::*;

pub use displace::Seams;
pub use generate::{
    Bumps, add_bumps, ball, block, bumpy_sphere, cube, flake, flake_balls, flake_scene, grid, hair,
    menger, menger_triangles, rectangle, sphere, terrain,
};
pub use gltf::{
    GltfAnimation, GltfCamera, GltfLight, GltfLightKind, GltfPart, GltfScene, GltfSetting,
    Projection, gltf_image, read_gltf, read_gltf_animation, read_gltf_settings,
};
pub use mtl::BARE_COLOR;
pub use parts::{Part, Parts, read_parts};
pub use ply::{check_writable, write_ply, write_text};
pub(crate) use polygon::triangulate;
pub use read::{FORMATS, Format, Loaded, MeshFile, ReadMesh, ReadOptions, Time, extension, read};
pub(crate) use read::{contents, is_compressed};
pub use refine::TooMany;
pub use report::Report;
pub use surface::{Map, Maps, Surface};

/// Triangles over shared vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices, in object space, or in world space after [`Mesh::transform`]. Those of triangles are finite
    /// after [`Mesh::check`]; a vertex that no triangle has may hold anything.
    pub positions: Vec<Vec3>,
    /// One a vertex, of unit length; empty: the face normal is used.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one a vertex; empty: none.
    pub uvs: Vec<Vec2>,
    /// Counter-clockwise corners seen from outside: indices into `positions`, always in range.
    pub triangles: Vec<[u32; 3]>,
    /// Named data for `mesh_attribute` textures.
    pub attributes: Vec<Attribute>,
}

/// Named data on the vertices or faces of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// The name with its prefix, as the scene file says it: `vertex_color`, `face_temperature`.
    pub name: String,
    /// Numbers a vertex or face: 1, 3 or 4.
    pub channels: usize,
    /// What a row of `values` belongs to.
    pub per: Per,
    /// Rows of `channels` numbers.
    pub values: Vec<f32>,
}

impl Attribute {
    /// The numbers of a vertex or face.
    pub fn row(&self, i: usize) -> &[f32] {
        &self.values[i * self.channels..(i + 1) * self.channels]
    }
}

/// What an [`Attribute`] belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Per {
    /// A row a vertex, interpolated over the triangle.
    Vertex,
    /// A row a triangle.
    Face,
}

/// What [`Mesh::check`] mended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Triangles dropped because a corner is not finite.
    pub dropped_triangles: usize,
    /// Normals of no length or not finite, replaced by computed ones.
    pub mended_normals: usize,
    /// Texture coordinates that were not finite, replaced by 0.
    pub mended_uvs: usize,
}

/// Vertices or triangles that one task works on: enough to make the task worth its while.
const GRAIN: usize = 1 << 14;

impl Mesh {
    /// The least box around all triangles, as its low and high corner; `None` without triangles.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let union = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
        self.triangles
            .par_chunks(GRAIN)
            .map(|triangles| {
                // A box for each corner: none waits for another.
                let mut boxes = [(Vec3::INFINITY, Vec3::NEG_INFINITY); 3];
                for triangle in triangles {
                    for (bounds, corner) in boxes.iter_mut().zip(self.corners(triangle)) {
                        *bounds = (bounds.0.min(corner), bounds.1.max(corner));
                    }
                }
                let [a, b, c] = boxes;
                union(union(a, b), c)
            })
            .reduce_with(union)
    }

    /// The sum of the triangles' areas, in squared scene units.
    pub fn area(&self) -> f64 {
        let partial: Vec<f64> = self
            .triangles
            .par_chunks(GRAIN)
            .map(|triangles| {
                let doubled = triangles.iter().map(|t| {
                    let [a, b, c] = self.corners(t).map(Vec3::as_dvec3);
                    (b - a).cross(c - a).length()
                });
                doubled.sum::<f64>() / 2.0
            })
            .collect();
        // Added in order, so that the sum is the same whatever the threads; that of nothing is −0.
        partial.iter().sum::<f64>() + 0.0
    }

    /// A hash of the vertices and triangles, and of nothing else, by all threads.
    pub fn triangles_hash(&self) -> blake3::Hash {
        let positions = self.positions.par_chunks(GRAIN).map(|positions| {
            let mut bytes = vec![[0; 4]; 3 * positions.len()];
            for (bytes, position) in bytes.as_chunks_mut().0.iter_mut().zip(positions) {
                *bytes = position.to_array().map(f32::to_le_bytes);
            }
            blake3::hash(bytes.as_flattened())
        });
        let triangles = self.triangles.par_chunks(GRAIN).map(|triangles| {
            let mut bytes = vec![[0; 4]; 3 * triangles.len()];
            for (bytes, triangle) in bytes.as_chunks_mut().0.iter_mut().zip(triangles) {
                *bytes = triangle.map(u32::to_le_bytes);
            }
            blake3::hash(bytes.as_flattened())
        });
        let parts: Vec<blake3::Hash> = positions.chain(triangles).collect();
        let mut hasher = blake3::Hasher::new();
        hasher.update(&(self.positions.len() as u64).to_le_bytes());
        parts.iter().for_each(|part| {
            hasher.update(part.as_bytes());
        });
        hasher.finalize()
    }

    /// Moves the vertices by the affine `matrix`, computed in f64, and turns the normals by its inverse
    /// transpose. The winding stays, also under a mirroring matrix: see the module's introduction.
    pub fn transform(&mut self, matrix: &DMat4) {
        self.positions
            .par_iter_mut()
            .with_min_len(GRAIN)
            .for_each(|p| *p = matrix.transform_point3(p.as_dvec3()).as_vec3());
        // The cofactors are det · inverse transpose, and exist where the inverse does not.
        let [x, y, z] = [0, 1, 2].map(|i| matrix.col(i).truncate());
        let side = if x.dot(y.cross(z)) < 0.0 { -1.0 } else { 1.0 };
        let cofactors = [y.cross(z), z.cross(x), x.cross(y)].map(|c| c * side);
        self.normals
            .par_iter_mut()
            .with_min_len(GRAIN)
            .for_each(|n| {
                let turned = n.x as f64 * cofactors[0]
                    + n.y as f64 * cofactors[1]
                    + n.z as f64 * cofactors[2];
                *n = unit_or(turned, *n);
            });
    }

    /// Replaces the vertex normals by the mean of the faces' normals, weighted with the faces' angles at the
    /// vertex. Call it after [`Mesh::transform`], as Mitsuba does.
    pub fn compute_normals(&mut self) {
        self.normals = self.mean_normals();
    }

    /// The normals of [`Mesh::compute_normals`].
    pub(crate) fn mean_normals(&self) -> Vec<Vec3> {
        normals::angle_weighted(&self.positions, &self.triangles)
    }

    /// Shades with the geometric normal (`face_normals`).
    pub fn drop_normals(&mut self) {
        self.normals = Vec::new();
    }

    /// Turns the surface's outside in (`flip_normals`): the winding and the vertex normals.
    pub fn flip_normals(&mut self) {
        for triangle in &mut self.triangles {
            triangle.swap(1, 2);
        }
        for normal in &mut self.normals {
            *normal = -*normal;
        }
    }

    /// Bytes that the mesh holds on the heap.
    pub fn bytes(&self) -> usize {
        let attributes = self.attributes.iter().map(|a| {
            size_of::<Attribute>() + a.name.capacity() + a.values.capacity() * size_of::<f32>()
        });
        self.positions.capacity() * size_of::<Vec3>()
            + self.normals.capacity() * size_of::<Vec3>()
            + self.uvs.capacity() * size_of::<Vec2>()
            + self.triangles.capacity() * size_of::<[u32; 3]>()
            + attributes.sum::<usize>()
    }

    /// Bytes that the mesh holds on the heap when all of its vertices have normals.
    pub fn room(&self) -> u64 {
        let missing = self.positions.len() - self.normals.len().min(self.positions.len());
        (self.bytes() + missing * size_of::<Vec3>()) as u64
    }

    /// Gives back memory that the arrays do not need.
    pub(crate) fn shrink(&mut self) {
        self.positions.shrink_to_fit();
        self.normals.shrink_to_fit();
        self.uvs.shrink_to_fit();
        self.triangles.shrink_to_fit();
        for attribute in &mut self.attributes {
            attribute.values.shrink_to_fit();
        }
    }

    /// Drops triangles with a corner that is not finite, and mends normals and texture coordinates that are
    /// unusable. The readers have called it; call it again after a transform that may overflow.
    ///
    /// # Panics
    /// Where an index or the length of an array breaks what the fields promise.
    pub fn check(&mut self) -> Repairs {
        let vertices = self.positions.len();
        assert!(
            self.normals.is_empty() || self.normals.len() == vertices,
            "one normal a vertex"
        );
        assert!(
            self.uvs.is_empty() || self.uvs.len() == vertices,
            "one uv a vertex"
        );
        Repairs {
            dropped_triangles: self.drop_unfinite_triangles(),
            mended_normals: self.mend_normals(),
            mended_uvs: self.mend_uvs(),
        }
    }

    /// The corners of `triangle`.
    pub fn corners(&self, triangle: &[u32; 3]) -> [Vec3; 3] {
        triangle.map(|i| self.positions[i as usize])
    }

    /// Appends `other`, whose vertices follow those of `self`. What one has and the other lacks is lost,
    /// but for normals: they are filled with face normals, for which such a part's vertices are unshared.
    /// Attributes are dropped unless both have the same.
    pub(crate) fn append(&mut self, mut other: Mesh) {
        if self.triangles.is_empty() {
            *self = other;
            return;
        }
        if self.normals.is_empty() != other.normals.is_empty() {
            let flat = if self.normals.is_empty() {
                &mut *self
            } else {
                &mut other
            };
            flat.unshare_vertices();
        }
        let first = u32::try_from(self.positions.len()).expect("readers keep indices in 32 bits");
        if self.uvs.is_empty() || other.uvs.is_empty() {
            self.uvs.clear();
        } else {
            self.uvs.append(&mut other.uvs);
        }
        let shape = |m: &Mesh| -> Vec<_> {
            let of = |a: &Attribute| (a.name.clone(), a.channels, a.per);
            m.attributes.iter().map(of).collect()
        };
        if shape(self) == shape(&other) {
            for (mine, mut theirs) in self.attributes.iter_mut().zip(other.attributes) {
                mine.values.append(&mut theirs.values);
            }
        } else {
            self.attributes.clear();
        }
        self.positions.append(&mut other.positions);
        self.normals.append(&mut other.normals);
        let shifted = other.triangles.iter().map(|t| t.map(|i| first + i));
        self.triangles.extend(shifted);
    }

    /// Gives each triangle vertices of its own, with its face normal.
    fn unshare_vertices(&mut self) {
        let order: Vec<usize> = self
            .triangles
            .iter()
            .flatten()
            .map(|&i| i as usize)
            .collect();
        self.normals = (self.triangles.iter())
            .flat_map(|t| [normals::face_normal(self.corners(t)); 3])
            .collect();
        self.positions = order.iter().map(|&i| self.positions[i]).collect();
        if !self.uvs.is_empty() {
            self.uvs = order.iter().map(|&i| self.uvs[i]).collect();
        }
        for attribute in self.attributes.iter_mut().filter(|a| a.per == Per::Vertex) {
            let row = |i: usize| i * attribute.channels..(i + 1) * attribute.channels;
            attribute.values = order
                .iter()
                .flat_map(|&i| attribute.values[row(i)].to_vec())
                .collect();
        }
        for (i, triangle) in (0_u32..).zip(&mut self.triangles) {
            *triangle = [3 * i, 3 * i + 1, 3 * i + 2];
        }
    }

    fn drop_unfinite_triangles(&mut self) -> usize {
        let before = self.triangles.len();
        if self
            .positions
            .par_iter()
            .with_min_len(GRAIN)
            .all(|p| p.is_finite())
        {
            return 0;
        }
        let positions = &self.positions;
        let keep: Vec<bool> = (self.triangles.iter())
            .map(|t| t.iter().all(|&i| positions[i as usize].is_finite()))
            .collect();
        self.keep_triangles(&keep);
        before - self.triangles.len()
    }

    /// Drops the triangles without their flag in `keep`, and their attributes.
    fn keep_triangles(&mut self, keep: &[bool]) {
        let mut kept = keep.iter();
        self.triangles
            .retain(|_| *kept.next().expect("one flag a triangle"));
        for attribute in self.attributes.iter_mut().filter(|a| a.per == Per::Face) {
            let channels = attribute.channels;
            let mut i = 0;
            attribute.values.retain(|_| {
                i += 1;
                keep[(i - 1) / channels]
            });
        }
    }

    fn mend_normals(&mut self) -> usize {
        let count = (self.normals.par_iter_mut().with_min_len(GRAIN))
            .filter_map(|n| {
                *n = unit_or(n.as_dvec3(), Vec3::ZERO);
                (*n == Vec3::ZERO).then_some(())
            })
            .count();
        if count > 0 {
            let computed = normals::angle_weighted(&self.positions, &self.triangles);
            for (normal, computed) in self.normals.iter_mut().zip(computed) {
                if *normal == Vec3::ZERO {
                    *normal = computed;
                }
            }
        }
        count
    }

    fn mend_uvs(&mut self) -> usize {
        (self.uvs.par_iter_mut().with_min_len(GRAIN))
            .filter(|uv| !uv.is_finite())
            .map(|uv| *uv = Vec2::ZERO)
            .count()
    }

    /// Turns texture coordinates over, `v` → `1 − v`.
    fn flip_uvs(&mut self) {
        for uv in &mut self.uvs {
            uv.y = 1.0 - uv.y;
        }
    }
}

/// So many zeros, by all threads: what takes long is that the system makes each page when it is first touched.
fn zeros(count: usize) -> Vec<Vec3> {
    let zeros = (0..count).into_par_iter().with_min_len(GRAIN);
    zeros.map(|_| Vec3::ZERO).collect()
}

/// `v` at unit length, or `otherwise` where it has no direction.
fn unit_or(v: DVec3, otherwise: Vec3) -> Vec3 {
    v.try_normalize().map_or(otherwise, DVec3::as_vec3)
}

#[cfg(test)]
mod transform_tests {
    use super::*;

    /// Its faces look outwards.
    fn tetrahedron() -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, 2.0 * Vec3::Y, 3.0 * Vec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn normals_computed_after_a_mirroring_transform_follow_the_winding_as_mitsubas_do() {
        let mut mesh = tetrahedron();
        mesh.transform(&DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)));
        mesh.compute_normals();
        assert_eq!(mesh.triangles, tetrahedron().triangles);
        let mitsuba = Vec3::new(0.791_601_06, 0.411_490_05, 0.451_711_83);
        assert!(
            mesh.normals[1].distance(mitsuba) < 1e-6,
            "{}",
            mesh.normals[1]
        );
    }

    #[test]
    fn given_normals_turn_by_the_inverse_transpose_whatever_the_sign() {
        let mut mesh = tetrahedron();
        mesh.normals = vec![Vec3::new(0.0, 1.0, 1.0).normalize(); 4];
        let before = mesh.normals.clone();
        mesh.transform(&DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)));
        assert_eq!(mesh.normals, before);
        mesh.transform(&DMat4::from_scale(DVec3::new(1.0, 4.0, 1.0)));
        let mitsuba = Vec3::new(0.0, 0.242_535_62, 0.970_142_5);
        assert!(mesh.normals[0].distance(mitsuba) < 1e-6);
        mesh.transform(&DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0)));
        assert_eq!(mesh.normals[0], Vec3::Y);
        mesh.transform(&DMat4::from_scale(DVec3::ZERO));
        assert_eq!(mesh.normals[0], Vec3::Y);
    }

    #[test]
    fn bounds_and_area_are_those_of_the_triangles_alone() {
        let mut mesh = rectangle();
        mesh.positions.push(Vec3::splat(100.0));
        mesh.positions.push(Vec3::NAN);
        assert_eq!(
            mesh.bounds(),
            Some((Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0)))
        );
        assert_eq!(mesh.area(), 4.0);
        assert_eq!(Mesh::default().bounds(), None);
        assert!(rectangle().bytes() >= 4 * (12 + 12 + 8) + 2 * 12);
    }

    #[test]
    fn flipping_turns_faces_and_normals_over() {
        let mut mesh = rectangle();
        mesh.flip_normals();
        assert_eq!(
            normals::face_normal(mesh.corners(&mesh.triangles[0])),
            Vec3::NEG_Z
        );
        assert_eq!(mesh.normals, [Vec3::NEG_Z; 4]);
        mesh.drop_normals();
        assert!(mesh.normals.is_empty());
    }

    #[test]
    fn a_transform_that_overflows_leaves_triangles_for_the_check_to_drop() {
        let mut mesh = cube();
        mesh.positions[0].x = 1e30;
        mesh.transform(&DMat4::from_scale(DVec3::splat(1e10)));
        let repairs = mesh.check();
        assert_eq!((repairs.dropped_triangles, mesh.triangles.len()), (2, 10));
    }

    #[test]
    fn a_flat_part_stays_flat_beside_a_smooth_one() {
        let mut both = sphere(8, 4);
        let vertices = both.positions.len();
        let mut flat = cube();
        flat.drop_normals();
        both.append(flat);
        assert_eq!(both.normals.len(), vertices + 36);
        assert_eq!(both.uvs.len(), both.positions.len());
        let last = both.triangles.last().unwrap();
        assert_eq!(both.normals[last[0] as usize], Vec3::NEG_Z);
    }
}
