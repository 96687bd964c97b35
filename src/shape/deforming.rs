//! Meshes that deform: several sets of vertices of one topology, each at a time of its own. Between two sets every vertex
//! goes straight, and so do normals, before the first and after the last set the mesh stands still.

use glam::{Vec2, Vec3};

use super::mesh::{TriangleMesh, Triangles};
use super::{Bounds, Geometry, Shape, Surface, SurfaceSample};
use crate::description::Properties;
use crate::error::{Problem, Result};
use crate::interaction::{Hit, Interaction, Ray};
use crate::mesh::{Mesh, Time};

/// A mesh with its vertices at two times or more.
#[derive(Debug)]
pub struct DeformingMesh {
    /// With the vertices of the first time.
    first: TriangleMesh,
    later: Vec<Vertices>,
    /// Absolute, strictly increasing; one more than there are later sets.
    times: Vec<f32>,
}

/// Vertices at a later time.
#[derive(Debug)]
struct Vertices {
    positions: Vec<Vec3>,
    /// As many as positions, or none.
    normals: Vec<Vec3>,
}

/// Between two sets of vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// The number of the set before.
    pub segment: usize,
    /// The part of the way to the next set, in [0, 1].
    pub part: f32,
}

impl Moment {
    /// Where `time` lies between those of the sets.
    #[inline]
    pub fn of(times: &[f32], time: f32) -> Self {
        let inner = &times[1..times.len() - 1];
        let segment = inner.partition_point(|t| *t <= time);
        let [from, to] = [times[segment], times[segment + 1]];
        let part = ((time - from) / (to - from)).clamp(0.0, 1.0);
        Self { segment, part }
    }
}

/// What keeps meshes from being one mesh at several times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mismatch {
    /// Numbers of vertices, of the first mesh and of another.
    Vertices(usize, usize),
    /// Numbers of triangles, of the first mesh and of another.
    Triangles(usize, usize),
    /// The triangle with this number joins other vertices.
    Triangle(usize),
    /// One has normals and the other has none.
    Normals,
    /// The vertex with this number goes farther from the mesh before than single precision tells.
    Far(usize),
}

impl std::fmt::Display for Mismatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Vertices(a, b) => write!(f, "it has {b} vertices, and the first mesh {a}"),
            Self::Triangles(a, b) => write!(f, "it has {b} triangles, and the first mesh {a}"),
            Self::Triangle(i) => {
                write!(
                    f,
                    "its triangle {i} joins other vertices than that of the first mesh"
                )
            }
            Self::Normals => {
                f.write_str("one of it and the first mesh has normals, and the other has none")
            }
            Self::Far(i) => write!(
                f,
                "its vertex {i} is farther than 3.4e38 from where the mesh before has it"
            ),
        }
    }
}

/// `a` at 0 and, but for rounding, `b` at 1. Trees round alike.
#[inline(always)]
fn between(a: Vec3, b: Vec3, part: f32) -> Vec3 {
    a + (b - a) * part
}

impl DeformingMesh {
    /// From meshes in the order of their times, which are strictly increasing; two at least.
    ///
    /// # Errors
    /// The number of the first mesh that is not of the topology of the first, and why.
    pub fn new(
        meshes: Vec<TriangleMesh>,
        times: Vec<f32>,
    ) -> std::result::Result<Self, (usize, Mismatch)> {
        assert!(
            meshes.len() == times.len() && times.len() > 1,
            "a time a mesh"
        );
        let mut meshes = meshes.into_iter();
        let first = meshes.next().expect("two meshes at least");
        let mut whole = Self {
            first,
            later: Vec::with_capacity(meshes.len()),
            times,
        };
        for (number, mesh) in (1..).zip(meshes) {
            let mesh = mesh.into_mesh();
            if let Some(why) = mismatch(whole.mesh(), &mesh) {
                return Err((number, why));
            }
            let mut ways = whole.positions(number - 1).iter().zip(&mesh.positions);
            if let Some(vertex) = ways.position(|(a, b)| !(*b - *a).is_finite()) {
                return Err((number, Mismatch::Far(vertex)));
            }
            whole.later.push(Vertices {
                positions: mesh.positions,
                normals: mesh.normals,
            });
        }
        Ok(whole)
    }

    /// The mesh at its first time.
    pub fn mesh(&self) -> &Mesh {
        self.first.mesh()
    }

    /// From how many sets of vertices it goes to the next.
    pub fn segments(&self) -> usize {
        self.later.len()
    }

    /// Where `time` lies between sets of vertices.
    #[inline]
    pub fn moment(&self, time: f32) -> Moment {
        Moment::of(&self.times, time)
    }

    /// When its sets of vertices are: absolute, strictly increasing, two at least.
    pub fn times(&self) -> &[f32] {
        &self.times
    }

    #[inline]
    fn positions(&self, set: usize) -> &[Vec3] {
        match set.checked_sub(1) {
            None => &self.first.mesh().positions,
            Some(later) => &self.later[later].positions,
        }
    }

    #[inline]
    fn normals(&self, set: usize) -> &[Vec3] {
        match set.checked_sub(1) {
            None => &self.first.mesh().normals,
            Some(later) => &self.later[later].normals,
        }
    }

    /// A triangle's corners at the beginning and at the end of a segment.
    #[inline]
    pub fn ends(&self, triangle: u32, segment: usize) -> [[Vec3; 3]; 2] {
        let corners = self.mesh().triangles[triangle as usize];
        [segment, segment + 1].map(|set| {
            let positions = self.positions(set);
            corners.map(|i| positions[i as usize])
        })
    }

    /// A triangle's corners at a moment.
    #[inline]
    pub fn corners(&self, triangle: u32, moment: Moment) -> [Vec3; 3] {
        let [a, b] = self.ends(triangle, moment.segment);
        [0, 1, 2].map(|corner| between(a[corner], b[corner], moment.part))
    }

    /// The point of a triangle at a time, by its second and third barycentric coordinate.
    pub fn position(&self, triangle: u32, barycentric: Vec2, time: f32) -> Vec3 {
        let [a, b, c] = self.corners(triangle, self.moment(time));
        let Vec2 { x, y } = barycentric;
        (1.0 - x - y) * a + x * b + y * c
    }
}

/// Why two meshes are not of one topology.
fn mismatch(first: &Mesh, other: &Mesh) -> Option<Mismatch> {
    let (a, b) = (first.positions.len(), other.positions.len());
    if a != b {
        return Some(Mismatch::Vertices(a, b));
    }
    let (a, b) = (first.triangles.len(), other.triangles.len());
    if a != b {
        return Some(Mismatch::Triangles(a, b));
    }
    let mut pairs = first.triangles.iter().zip(&other.triangles);
    if let Some(place) = pairs.position(|(a, b)| a != b) {
        return Some(Mismatch::Triangle(place));
    }
    (first.normals.is_empty() != other.normals.is_empty()).then_some(Mismatch::Normals)
}

impl Surface for DeformingMesh {
    fn primitive_count(&self) -> u32 {
        self.first.primitive_count()
    }

    /// At all times.
    fn bounds(&self, primitive: u32) -> Bounds {
        let corners = self.mesh().triangles[primitive as usize];
        let all =
            (0..self.times.len()).flat_map(|set| corners.map(|i| self.positions(set)[i as usize]));
        let Bounds { min, max } = all.fold(Bounds::EMPTY, Bounds::with);
        // What lies between rounds.
        let room = min.abs().max(max.abs()) * (8.0 * f32::EPSILON);
        Bounds {
            min: min - room,
            max: max + room,
        }
    }

    fn intersect(&self, _primitive: u32, _ray: &Ray) -> Option<(f32, f32, f32)> {
        unreachable!("the tracer intersects triangles itself")
    }

    fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        let moment = self.moment(ray.time);
        let barycentric = Vec2::new(hit.u, hit.v);
        let mut triangles = Triangles::<f32>::default();
        triangles.set(0, &self.first, hit.primitive, barycentric);
        let corners = self.mesh().triangles[hit.primitive as usize];
        let positions = self.corners(hit.primitive, moment);
        for (corner, index) in corners.into_iter().enumerate() {
            let [a, b] = [moment.segment, moment.segment + 1].map(|set| self.normals(set));
            let normal = a.get(index as usize).zip(b.get(index as usize));
            let normal = normal.map(|(a, b)| between(*a, *b, moment.part));
            triangles.place(0, corner, positions[corner], normal);
        }
        triangles.surface().interaction(Some(self.mesh()), ray, hit)
    }

    /// At the first time.
    fn area(&self) -> f64 {
        self.first.area()
    }

    /// None: it is no light.
    fn sample(&self, _from: Vec3, _u: Vec2) -> Option<SurfaceSample> {
        None
    }

    fn uv(&self, point: &SurfaceSample) -> Vec2 {
        self.first.uv(point)
    }

    fn pdf(&self, _from: Vec3, _at: &Interaction<'_>) -> f32 {
        0.0
    }

    fn bytes(&self) -> usize {
        let later = self
            .later
            .iter()
            .map(|set| size_of_val(&*set.positions) + size_of_val(&*set.normals));
        self.first.bytes() + later.sum::<usize>()
    }
}

/// The property that names the file of a later time, counted from 1.
pub(super) fn file_name(number: usize) -> String {
    format!("{STEM}{number}")
}

const STEM: &str = "filename_";

/// From what a mesh comes.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Sets {
    /// A file.
    One,
    /// A file for each of these times, two at least.
    Files(Vec<f32>),
    /// A file with an animation, which is looked at at these times, one at least.
    Animation(Vec<f32>),
}

impl Sets {
    /// What the properties of a mesh from a file say.
    pub(super) fn of(properties: &Properties<'_>) -> Result<Self> {
        let numbered = properties
            .all()
            .iter()
            .filter(|p| p.name.starts_with(STEM))
            .count();
        let count = 1 + (1..).take_while(|i| properties.has(&file_name(*i))).count();
        if properties.has(&file_name(0)) {
            return Err(properties
                .error(
                    &file_name(0),
                    "the first file is \"filename\", without a number",
                )
                .help("number the later ones from 1: \"filename_1\""));
        }
        if numbered >= count {
            let missing = file_name(count);
            let message =
                format!("there is no {missing:?}, and there are files with other numbers");
            return Err(properties
                .error("filename", message)
                .help("number them from 1 without a gap"));
        }
        let animated = properties.plugin() == "gltf" && count == 1;
        let Some(text) = properties.given::<&str>("times")? else {
            let last = (count - 1) as f32;
            return Ok(match count {
                1 => Self::One,
                _ => Self::Files((0..count).map(|i| i as f32 / last).collect()),
            });
        };
        if count == 1 && !animated {
            return Err(properties
                .error(
                    "times",
                    "times are those of several files, and there is one",
                )
                .help("add \"filename_1\""));
        }
        let numbers = text.split(|c: char| c == ',' || c.is_whitespace());
        let numbers = numbers.filter(|number| !number.is_empty());
        let times: Option<Vec<f32>> = numbers.map(|number| number.parse().ok()).collect();
        let times = times.filter(|times| !times.is_empty()).ok_or_else(|| {
            let error = properties.error("times", format!("{text:?} are no numbers"));
            error.help("write them as 0, 0.5, 1")
        })?;
        if times.len() != count && !animated {
            let message = format!("there are {} times, and {count} files", times.len());
            let error = properties.error("times", message);
            return Err(error.help("give each file a time, in the order of their numbers"));
        }
        let ascend = times
            .windows(2)
            .all(|pair| pair[0] < pair[1] && (pair[1] - pair[0]).is_finite());
        if !(ascend && times.iter().all(|time| time.is_finite())) {
            let message = "times must be finite, and each after the one before";
            return Err(properties.error("times", message));
        }
        Ok(match animated {
            true => Self::Animation(times),
            false => Self::Files(times),
        })
    }

    /// When an animation is looked at first.
    pub(super) fn first_time(&self) -> Option<Time> {
        match self {
            Self::Animation(times) => times.first().map(|time| Time::of(*time)),
            _ => None,
        }
    }

    /// Whether the mesh deforms.
    pub(super) fn deform(&self) -> bool {
        match self {
            Self::One => false,
            Self::Files(_) => true,
            Self::Animation(times) => times.len() > 1,
        }
    }
}

/// Turns triangles back that turned over, with their normals: where a node's scale goes through 0, its mesh goes through a
/// plane, and what was its outside is its inside then.
pub(super) fn keep_winding(first: &[[u32; 3]], mesh: &mut Mesh) {
    if first.len() != mesh.triangles.len() {
        return;
    }
    let mut turned = vec![false; mesh.normals.len()];
    for (first, triangle) in first.iter().zip(&mut mesh.triangles) {
        let [a, b, c] = *triangle;
        if *first == [a, c, b] && b != c {
            *triangle = *first;
            for corner in first {
                if let Some(turned) = turned.get_mut(*corner as usize) {
                    *turned = true;
                }
            }
        }
    }
    for (normal, turned) in mesh.normals.iter_mut().zip(turned) {
        if turned {
            *normal = -*normal;
        }
    }
}

/// The mesh that deforms as the shapes are one after another; of each some triangles were dropped, which had a corner that is
/// no number.
pub(super) fn joined(
    shapes: Vec<Shape>,
    dropped: &[usize],
    times: Vec<f32>,
    properties: &Properties<'_>,
) -> Result<Shape> {
    let (mut warnings, mut files): (Vec<Problem>, _) = (Vec::new(), Vec::new());
    let mut meshes = Vec::with_capacity(shapes.len());
    for shape in shapes {
        warnings.extend(shape.warnings);
        files.extend(shape.files);
        if let Geometry::Mesh(mesh) = shape.geometry {
            meshes.push(mesh);
        }
    }
    let mesh = DeformingMesh::new(meshes, times).map_err(|(number, why)| {
        // Of an animation there are times in place of files.
        let name_of = |number: usize| match number {
            0 => "filename".to_owned(),
            _ if properties.has(&file_name(number)) => file_name(number),
            _ => "times".to_owned(),
        };
        let (first, now) = (dropped[0], dropped[number]);
        if first != now && !matches!(why, Mismatch::Vertices(..)) {
            let worse = if first > now { 0 } else { number };
            let (most, least) = (first.max(now), first.min(now));
            let message = format!(
                "{most} of its triangles have a corner whose place is not finite, and {least} of another mesh's"
            );
            let error = properties.error(&name_of(worse), message);
            return error.help("give each vertex a place at all times");
        }
        let error = properties.error(&name_of(number), why.to_string());
        match why {
            Mismatch::Far(_) => error.help("make it smaller"),
            _ => error.help("a mesh that deforms has the same triangles at all times"),
        }
    })?;
    Ok(Shape {
        geometry: Geometry::Deforming(mesh),
        warnings,
        files,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh;

    fn moved(by: Vec3) -> TriangleMesh {
        let mut cube = mesh::cube();
        for position in &mut cube.positions {
            *position += by;
        }
        TriangleMesh::new(cube)
    }

    #[test]
    fn vertices_go_straight_between_their_times_and_stand_before_and_after() {
        let sets = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 4.0, 0.0)].map(moved);
        let mesh = DeformingMesh::new(sets.into(), vec![0.0, 1.0, 3.0]).unwrap();
        let start = mesh.position(0, Vec2::ZERO, 0.0);
        for (time, expected) in [
            (-1.0, Vec3::ZERO),
            (0.25, Vec3::X * 0.25),
            (1.0, Vec3::X),
            (2.0, Vec3::new(1.0, 2.0, 0.0)),
            (9.0, Vec3::new(1.0, 4.0, 0.0)),
        ] {
            let found = mesh.position(0, Vec2::ZERO, time) - start;
            assert!(found.distance(expected) < 1e-6, "{time}: {found}");
        }
        let bounds = mesh.bounds(0);
        for step in 0..=30 {
            let corners = mesh.corners(0, mesh.moment(step as f32 / 10.0));
            assert!(corners.iter().all(|c| bounds.with(*c) == bounds));
        }
    }

    #[test]
    fn a_mesh_that_goes_through_a_plane_keeps_its_winding() {
        let first = mesh::cube();
        let mut mirrored = first.clone();
        mirrored.transform(&glam::DMat4::from_scale(glam::DVec3::new(-1.0, 1.0, 1.0)));
        mirrored.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        keep_winding(&first.triangles, &mut mirrored);
        assert_eq!(mirrored.triangles, first.triangles);
        // By the cofactors of diag(s, 1, 1), which are diag(1, s, s).
        for (before, after) in first.normals.iter().zip(&mirrored.normals) {
            let expected = *before * Vec3::new(1.0, -1.0, -1.0);
            assert!(after.distance(expected) < 1e-6, "{before} {after}");
        }
        let sets = [first, mirrored].map(TriangleMesh::new);
        DeformingMesh::new(sets.into(), vec![0.0, 1.0]).unwrap();
    }

    #[test]
    fn meshes_of_other_topologies_are_told_apart() {
        let cube = || TriangleMesh::new(mesh::cube());
        let changed = |change: fn(&mut Mesh)| {
            let mut other = mesh::cube();
            change(&mut other);
            DeformingMesh::new(
                vec![cube(), cube(), TriangleMesh::new(other)],
                vec![0.0, 1.0, 2.0],
            )
            .map(|_| ())
        };
        assert_eq!(changed(|_| ()), Ok(()));
        let count = mesh::cube().triangles.len();
        assert_eq!(
            changed(|m| m.triangles.truncate(5)),
            Err((2, Mismatch::Triangles(count, 5)))
        );
        assert_eq!(
            changed(|m| m.triangles[3].reverse()),
            Err((2, Mismatch::Triangle(3)))
        );
        assert_eq!(changed(|m| m.normals.clear()), Err((2, Mismatch::Normals)));
        assert_eq!(changed(|m| m.positions[4].y = 3e38), Ok(()));
        let vertices = mesh::cube().positions.len();
        let more = changed(|m| m.positions.push(Vec3::ZERO));
        assert_eq!(more, Err((2, Mismatch::Vertices(vertices, vertices + 1))));
    }

    #[test]
    fn what_goes_farther_than_numbers_tell_is_refused() {
        let at = |z: f32| {
            let mut cube = mesh::cube();
            cube.positions[4].z = z;
            TriangleMesh::new(cube)
        };
        let way = |a: f32, b: f32| {
            let sets = vec![at(a), at(0.0), at(a), at(b)];
            DeformingMesh::new(sets, vec![0.0, 1.0, 2.0, 3.0]).map(|_| ())
        };
        assert_eq!(way(3e38, 1e37), Ok(()));
        assert_eq!(way(3e38, -1e38), Err((3, Mismatch::Far(4))));
    }
}
