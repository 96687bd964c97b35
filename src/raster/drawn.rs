//! What is drawn: the shapes of a scene as triangles, each wherever it stands in the world at one time, numbered through in the
//! order of hits: by instance, shape and primitive. Meshes are drawn as they are. What has an equation is cut into triangles
//! whose chords leave it by less than an eighth of a pixel, as far as there are not too many; where in a pixel's ray it is
//! then exactly is found by `fragment`. A plane without an end is a square that reaches beyond all that can be seen.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use glam::{DMat3, DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::projection::Projection;
use super::runs::{self, Run};
use crate::accel::{Standing, Tracer};
use crate::error::{Error, Problem, Result};
use crate::lanes::{self, Kernel};
use crate::math::Transform;
use crate::mesh::Mesh;
use crate::shape::{Bounds, Geometry, Untessellated};

/// Triangles of a shape, in its own space.
#[derive(Debug)]
pub(super) struct Facets<'s> {
    /// The shape.
    pub(super) geometry: &'s Geometry,
    pub(super) positions: Cow<'s, [Vec3]>,
    pub(super) triangles: Cow<'s, [[u32; 3]]>,
    pub(super) kind: FacetsOf<'s>,
    /// Each once it has been drawn.
    runs: Vec<OnceLock<Run>>,
}

/// Of what they are.
#[derive(Debug)]
pub(super) enum FacetsOf<'s> {
    /// A mesh that keeps its shape: a triangle is a primitive.
    Mesh(&'s Mesh),
    /// A mesh that deforms, as it is at the time.
    Deforming,
    /// A surface with patches: the parameters of the corners, and of each primitive the first triangle.
    Patches {
        parameters: Vec<Vec2>,
        starts: Vec<usize>,
    },
    /// A plane, with its normal.
    Plane(Vec3),
}

/// A shape where it stands.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub(super) shape: u32,
    pub(super) instance: u32,
    /// Which triangles are its.
    facets: usize,
    /// From its space to the world; `None` where that is the same.
    pub(super) to_world: Option<Transform>,
    /// The number of its first triangle.
    pub(super) first: u32,
}

impl Placed {
    /// To the world, in double precision.
    pub(super) fn matrix(&self) -> (DMat3, DVec3) {
        match &self.to_world {
            None => (DMat3::IDENTITY, DVec3::ZERO),
            Some(to_world) => (
                to_world.linear().as_dmat3(),
                to_world.translation().as_dvec3(),
            ),
        }
    }
}

/// What could not be, with the reason.
type Fallible<T> = std::result::Result<T, Untessellated>;

/// The triangles of a scene at one time.
#[derive(Debug)]
pub struct Drawn<'s> {
    facets: Arc<Vec<Facets<'s>>>,
    placed: Vec<Placed>,
    warnings: Vec<Problem>,
    kernel: Kernel,
}

/// How long edges are of what is not seen, as a part of its radius.
const UNSEEN: f32 = 1.0 / 16.0;
/// The most triangles that one primitive becomes.
const MOST: usize = 1 << 19;

impl<'s> Drawn<'s> {
    /// The shapes of the tracer for which `wanted` holds, as they stand at `time`, fine enough for the projection.
    ///
    /// # Errors
    /// Where there are more triangles than 32 bits count.
    pub fn new(
        tracer: &'s Tracer,
        projection: &Projection,
        time: f32,
        wanted: impl Fn(u32) -> bool,
    ) -> Result<Self> {
        let mut facets: Vec<Facets<'s>> = Vec::new();
        let mut known: HashMap<u32, usize> = HashMap::new();
        let mut missing: Vec<(u32, Untessellated)> = Vec::new();
        // Where the same shape stands several times it is cut as finely as the nearest needs.
        let mut longest: HashMap<u32, f32> = HashMap::new();
        for Standing {
            shape, to_world, ..
        } in tracer.standing().filter(|s| wanted(s.shape))
        {
            let geometry = tracer.shape(shape);
            if geometry.mesh().is_some() {
                continue;
            }
            let to_world = to_world.map(|moving| moving.at(time));
            let edge = edge(geometry, to_world.as_ref(), projection);
            let known = longest.entry(shape).or_insert(edge);
            *known = known.min(edge);
        }
        let mut placed = Vec::new();
        let mut next = 0_u64;
        for standing in tracer.standing().filter(|s| wanted(s.shape)) {
            let shape = standing.shape;
            if missing.iter().any(|(other, _)| *other == shape) {
                continue;
            }
            let number = match known.get(&shape) {
                Some(number) => *number,
                None => {
                    let edge = longest.get(&shape).copied();
                    match Facets::of(tracer.shape(shape), edge, projection, time) {
                        Ok(of_shape) => facets.push(of_shape),
                        Err(why) => {
                            missing.push((shape, why));
                            continue;
                        }
                    }
                    known.insert(shape, facets.len() - 1);
                    facets.len() - 1
                }
            };
            placed.push(Placed {
                shape,
                instance: standing.instance,
                facets: number,
                to_world: standing.to_world.map(|moving| moving.at(time)),
                first: next as u32,
            });
            next += facets[number].triangles.len() as u64;
            if next >= u64::from(u32::MAX) {
                let message =
                    "there are more than 2³² triangles to be drawn, each instance's counted";
                return Err(Error::unsupported(message));
            }
        }
        let warnings = missing.iter().map(|(shape, why)| unseen(*shape, *why));
        Ok(Self {
            facets: Arc::new(facets),
            placed,
            warnings: warnings.collect(),
            kernel: tracer.kernel(),
        })
    }

    /// The same but for some shapes. Triangles keep their numbers.
    pub fn without(&self, hidden: impl Fn(u32) -> bool) -> Self {
        let placed = self.placed.iter().filter(|placed| !hidden(placed.shape));
        Self {
            facets: Arc::clone(&self.facets),
            placed: placed.cloned().collect(),
            warnings: Vec::new(),
            kernel: self.kernel,
        }
    }

    /// What cannot be drawn.
    pub fn warnings(&self) -> &[Problem] {
        &self.warnings
    }

    /// The instructions that they are drawn with.
    pub(super) fn kernel(&self) -> Kernel {
        self.kernel
    }

    pub(super) fn placed(&self) -> &[Placed] {
        &self.placed
    }

    pub(super) fn facets(&self, placed: &Placed) -> &Facets<'s> {
        &self.facets[placed.facets]
    }

    /// Where a triangle with that number stands, and which of the shape's it is.
    pub(super) fn find(&self, number: u32) -> (&Placed, usize) {
        let after = self.placed.partition_point(|placed| placed.first <= number);
        // Shapes without triangles begin where the next does, and are passed over.
        let placed = &self.placed[after - 1];
        (placed, (number - placed.first) as usize)
    }

    /// The corners of the triangle with that number, world space.
    pub fn corners(&self, number: u32) -> [DVec3; 3] {
        let (placed, triangle) = self.find(number);
        let (linear, translation) = placed.matrix();
        let corners = self.facets(placed).corners(triangle);
        corners.map(|corner| linear * corner + translation)
    }

    /// Asks for a triangle's memory ahead: which corners it has.
    pub fn fetch(&self, number: u32) {
        let (placed, triangle) = self.find(number);
        lanes::fetch(&self.facets(placed).triangles[triangle]);
    }

    /// And where those are, with their normals, once [`Drawn::fetch`] has been done for a while.
    pub fn fetch_corners(&self, number: u32) {
        let (placed, triangle) = self.find(number);
        let facets = self.facets(placed);
        for corner in facets.triangles[triangle] {
            lanes::fetch(&facets.positions[corner as usize]);
            if let FacetsOf::Mesh(mesh) = facets.kind
                && let Some(normal) = mesh.normals.get(corner as usize)
            {
                lanes::fetch(normal);
            }
        }
    }

    /// How many triangles there are.
    pub fn triangle_count(&self) -> usize {
        let count = |placed| self.facets(placed).triangles.len();
        self.placed.iter().map(count).sum()
    }
}

fn unseen(shape: u32, why: Untessellated) -> Problem {
    let why = match why {
        Untessellated::NoChart => "it has no triangles and no parameters",
        Untessellated::TooMany => "it would take too many triangles",
    };
    let message = format!("shape {} of the scene is not drawn: {why}", shape + 1);
    let error = Error::unsupported(message).help("rays see it");
    error.problems()[0].clone()
}

/// A box around all of a shape's primitives.
fn bounds(geometry: &Geometry) -> Bounds {
    let primitives = 0..geometry.primitive_count();
    primitives.fold(Bounds::EMPTY, |bounds, primitive| {
        bounds.union(geometry.bounds(primitive))
    })
}

/// How long edges of its triangles may be, in its own space.
fn edge(geometry: &Geometry, to_world: Option<&Transform>, projection: &Projection) -> f32 {
    let own = bounds(geometry);
    let diagonal = (own.max - own.min).length();
    if !diagonal.is_finite() || own.is_empty() {
        return f32::INFINITY;
    }
    let inner = match to_world {
        Some(to_world) => own.transformed(to_world),
        None => own,
    };
    let in_world = (inner.max - inner.min).length();
    let [near, _] = projection.range();
    let places = inner
        .corners()
        .map(|corner| projection.place(corner.as_dvec3()));
    let nearest = places.iter().map(|place| place.a);
    let nearest = nearest.fold(f64::INFINITY, f64::min).max(near);
    // A chord of length h leaves a circle of radius r by h²/8r. A long thing is bent around its second side.
    let sides = (own.max - own.min).to_array();
    let [small, large] = [f32::min, f32::max].map(|pick| pick(pick(sides[0], sides[1]), sides[2]));
    let radius = 0.5 * (sides.iter().sum::<f32>() - small - large).max(diagonal / 512.0);
    let scale = f64::from(diagonal / in_world);
    if projection.misses_all(&places) {
        return radius * UNSEEN; // it may cast a shadow all the same
    }
    let longest = (f64::from(radius) * projection.pixel(nearest) * scale).sqrt();
    (longest as f32).clamp(radius / 128.0, radius / 4.0)
}

/// A primitive as triangles, as fine as their number allows.
fn patch(geometry: &Geometry, primitive: u32, longest: f32) -> Fallible<Mesh> {
    const COARSER: i32 = 12;
    let mut tried = (0..COARSER).map(|step| {
        let longest = longest * 1.5_f32.powi(step);
        geometry.patch_triangles(primitive, longest, MOST)
    });
    let is_final = |result: &Fallible<Mesh>| !matches!(result, Err(Untessellated::TooMany));
    tried.find(is_final).unwrap_or(Err(Untessellated::TooMany))
}

impl<'s> Facets<'s> {
    fn of(
        geometry: &'s Geometry,
        longest: Option<f32>,
        projection: &Projection,
        time: f32,
    ) -> Fallible<Self> {
        let (positions, triangles, kind) = match geometry {
            Geometry::Mesh(mesh) => {
                let mesh = mesh.mesh();
                (
                    Cow::Borrowed(&*mesh.positions),
                    Cow::Borrowed(&*mesh.triangles),
                    FacetsOf::Mesh(mesh),
                )
            }
            Geometry::Deforming(deforming) => {
                let triangles = &*deforming.mesh().triangles;
                let mut positions = deforming.mesh().positions.clone();
                for (number, corners) in (0..).zip(triangles) {
                    let places = deforming.corners(number, deforming.moment(time));
                    for (corner, place) in corners.iter().zip(places) {
                        positions[*corner as usize] = place;
                    }
                }
                (
                    Cow::Owned(positions),
                    Cow::Borrowed(triangles),
                    FacetsOf::Deforming,
                )
            }
            Geometry::Plane(plane) => {
                let half = 4.0 * projection.range()[1] * projection.reach();
                let (normal, corners) = plane.square(projection.origin(), half);
                (
                    Cow::Owned(corners.to_vec()),
                    Cow::Owned(vec![[0, 1, 2], [0, 2, 3]]),
                    FacetsOf::Plane(normal),
                )
            }
            other => {
                let longest = longest.unwrap_or(f32::INFINITY);
                let (mut positions, mut triangles) = (Vec::new(), Vec::new());
                let (mut parameters, mut starts) = (Vec::new(), Vec::new());
                for primitive in 0..other.primitive_count() {
                    let patch = patch(other, primitive, longest)?;
                    let first = positions.len() as u32;
                    starts.push(triangles.len());
                    triangles.extend(patch.triangles.iter().map(|t| t.map(|i| first + i)));
                    positions.extend(patch.positions);
                    parameters.extend(patch.uvs);
                }
                (
                    Cow::Owned(positions),
                    Cow::Owned(triangles),
                    FacetsOf::Patches { parameters, starts },
                )
            }
        };
        let runs = triangles.chunks(runs::LENGTH).map(|_| OnceLock::new());
        Ok(Self {
            geometry,
            runs: runs.collect(),
            positions,
            triangles,
            kind,
        })
    }

    /// The triangles by runs.
    pub(super) fn runs(
        &self,
        kernel: Kernel,
    ) -> impl IndexedParallelIterator<Item = (&Run, &[[u32; 3]])> {
        let chunks = self.triangles.par_chunks(runs::LENGTH).zip(&self.runs);
        chunks.map(move |(triangles, run)| {
            let run = run.get_or_init(|| Run::of(kernel, &self.positions, triangles));
            (run, triangles)
        })
    }

    /// A box around all of it, in its own space.
    pub(super) fn bounds(&self, kernel: Kernel) -> Bounds {
        if let FacetsOf::Patches { .. } = self.kind {
            return bounds(self.geometry);
        }
        let boxes = self.runs(kernel).map(|(run, _)| run.bounds);
        boxes.reduce(|| Bounds::EMPTY, Bounds::union)
    }

    /// A triangle's corners.
    pub(super) fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize].as_dvec3())
    }

    /// The shape's primitive that a triangle belongs to.
    pub(super) fn primitive(&self, triangle: usize) -> u32 {
        match &self.kind {
            FacetsOf::Mesh(_) | FacetsOf::Deforming => triangle as u32,
            FacetsOf::Patches { starts, .. } => {
                starts.partition_point(|start| *start <= triangle) as u32 - 1
            }
            FacetsOf::Plane(_) => 0,
        }
    }
}
