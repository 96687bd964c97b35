//! What is seen at a place of the picture, exactly: where the ray through it meets the plane of the triangle that the z-buffer
//! found, by homogeneous coordinates (Olano and Greer, *Triangle scan conversion using 2D homogeneous coordinates*, 1997), in
//! double precision and without the grid's rounding. So interpolation is right in perspective, and no triangle has to be cut
//! for it. On a surface with an equation the ray goes on to where the surface's own parameters put it, by Newton's method from
//! the triangle's point.
//!
//! Nothing here asks how rays find shapes: the quantities are the triangles' and the charts' own, for `agreement` to hold
//! against the rays'.

use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};

use super::drawn::{Drawn, Facets, FacetsOf, Placed};
use super::projection::{Line, Place, Projection};
use crate::interaction::{Hit, Ray};
use crate::mesh::Mesh;
use crate::shape::{Geometry, SurfaceSample};

/// A point of a surface that is seen.
#[derive(Clone, Copy, Debug)]
pub struct Fragment {
    /// The same as a ray through the place would say it, but for `t`, which is 0.
    pub hit: Hit,
    /// How far along the projection's line.
    pub a: f64,
    /// World space.
    pub position: DVec3,
    /// The barycentric coordinates of the place on the triangle.
    pub weights: [f64; 3],
    /// The same point as the patch knows it that the triangle stands for.
    on_patch: Option<SurfaceSample>,
}

/// A triangle as its fragments need it, so that neighbours share what is the same for all of them.
#[derive(Debug)]
pub(super) struct Face<'d, 's> {
    projection: &'d Projection,
    placed: &'d Placed,
    facets: &'d Facets<'s>,
    /// Which of the shape's.
    triangle: usize,
    /// In the shape's space.
    corners: [DVec3; 3],
    /// How far along the projection's lines the corners are.
    depths: [f64; 3],
    /// The planes through two corners each in homogeneous coordinates, opposite the corners.
    sides: [DVec3; 3],
    to_world: (DMat3, DVec3),
}

/// What is known of the surface at a fragment.
#[derive(Clone, Copy, Debug)]
pub struct Attributes {
    /// The geometric normal, unit length.
    pub normal: Vec3,
    /// The interpolated normal, unit length; `None` for a mesh that deforms.
    pub shading: Option<Vec3>,
    /// Texture coordinates.
    pub uv: Vec2,
    /// How far the place is from the triangle's nearest edge, in pixels.
    pub edge: f64,
}

impl<'d, 's> Face<'d, 's> {
    /// The triangle with that number.
    pub(super) fn new(drawn: &'d Drawn<'s>, projection: &'d Projection, number: u32) -> Self {
        let (placed, triangle) = drawn.find(number);
        let facets = drawn.facets(placed);
        let corners = facets.corners(triangle);
        let places = places(projection, placed, &corners);
        let [a, b, c] = places.map(|p| DVec3::new(p.x, p.y, p.w));
        Self {
            projection,
            placed,
            facets,
            triangle,
            corners,
            depths: places.map(|place| place.a),
            sides: [b.cross(c), c.cross(a), a.cross(b)],
            to_world: placed.matrix(),
        }
    }

    /// What is seen of it at a place, in pixels.
    pub(super) fn at(&self, at: DVec2) -> Fragment {
        let Self {
            projection,
            placed,
            facets,
            triangle,
            corners,
            depths,
            to_world: (linear, translation),
            ..
        } = *self;
        let weights = weights(&self.sides, at);
        let local = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
        let mut fragment = Fragment {
            hit: Hit {
                t: 0.0,
                u: weights[1] as f32,
                v: weights[2] as f32,
                instance: placed.instance,
                shape: placed.shape,
                primitive: facets.primitive(triangle),
            },
            a: depths[0] * weights[0] + depths[1] * weights[1] + depths[2] * weights[2],
            position: linear * local + translation,
            weights,
            on_patch: None,
        };
        if let FacetsOf::Patches { parameters, .. } = &facets.kind {
            let line = projection.line(at);
            let inverse = linear.inverse();
            let own = Line {
                origin: inverse * (line.origin - translation),
                way: inverse * line.way,
            };
            let begun = Begun {
                geometry: facets.geometry,
                primitive: fragment.hit.primitive,
                parameters: facets.triangles[triangle].map(|i| parameters[i as usize].as_dvec2()),
                weights,
                local,
                a: fragment.a,
            };
            let point = begun.on_patch(&own);
            fragment.a = point.a;
            fragment.position = line.at(point.a);
            (fragment.hit.u, fragment.hit.v) = point.sample.barycentric.into();
            fragment.on_patch = Some(point.sample);
        }
        fragment
    }
}

impl Fragment {
    /// What is seen at a place, in pixels, of the triangle with that number.
    pub fn new(drawn: &Drawn<'_>, projection: &Projection, number: u32, at: DVec2) -> Self {
        Face::new(drawn, projection, number).at(at)
    }

    /// What is known of the surface there, of the arguments of [`Fragment::new`].
    pub fn attributes(
        &self,
        drawn: &Drawn<'_>,
        projection: &Projection,
        number: u32,
        at: DVec2,
    ) -> Attributes {
        let (placed, triangle) = drawn.find(number);
        let facets = drawn.facets(placed);
        if let Some(sample) = &self.on_patch {
            let normal = normal_in_world(placed, sample.normal);
            return Attributes {
                normal,
                shading: Some(normal),
                uv: facets.geometry.uv(sample),
                edge: f64::INFINITY,
            };
        }
        let corners = facets.corners(triangle);
        let [a, b, c] = corners;
        let normal = match facets.kind {
            FacetsOf::Plane(normal) => normal,
            _ => (b - a).cross(c - a).normalize_or_zero().as_vec3(),
        };
        let [u, v, w] = self.weights;
        let sample = SurfaceSample {
            position: (a * u + b * v + c * w).as_vec3(),
            normal,
            primitive: self.hit.primitive,
            barycentric: Vec2::new(self.hit.u, self.hit.v),
            pdf: 0.0,
        };
        let shading = match facets.kind {
            FacetsOf::Mesh(mesh) => {
                Some(interpolated(mesh, facets.triangles[triangle], self.weights).unwrap_or(normal))
            }
            FacetsOf::Plane(_) => Some(normal),
            _ => None,
        };
        Attributes {
            normal: normal_in_world(placed, normal),
            shading: shading.map(|normal| normal_in_world(placed, normal)),
            uv: facets.geometry.uv(&sample),
            edge: distance_to_edges(&places(projection, placed, &corners), at),
        }
    }

    /// The hit of the ray that goes through the place.
    pub fn hit_of(&self, ray: &Ray) -> Hit {
        let way = self.position - ray.origin.as_dvec3();
        Hit {
            t: way.dot(ray.direction.as_dvec3()) as f32,
            ..self.hit
        }
    }
}

/// Where the corners of a shape's triangle are in the picture.
fn places(projection: &Projection, placed: &Placed, corners: &[DVec3; 3]) -> [Place; 3] {
    let (matrix, offset) = projection.along_ways(placed.to_world.as_ref());
    corners.map(|corner| projection.placed(matrix * corner + offset))
}

/// The interpolated normal of a mesh, if it has any.
fn interpolated(mesh: &Mesh, corners: [u32; 3], [u, v, w]: [f64; 3]) -> Option<Vec3> {
    if mesh.normals.is_empty() {
        return None;
    }
    let [a, b, c] = corners.map(|i| mesh.normals[i as usize].as_dvec3());
    let normal = (a * u + b * v + c * w).normalize_or_zero().as_vec3();
    (normal != Vec3::ZERO).then_some(normal)
}

/// A normal of a shape's space in the world.
fn normal_in_world(placed: &Placed, normal: Vec3) -> Vec3 {
    match &placed.to_world {
        None => normal,
        Some(to_world) => {
            let cofactors = to_world.inverse().linear().transpose().as_dmat3();
            (cofactors * normal.as_dvec3())
                .normalize_or_zero()
                .as_vec3()
        }
    }
}

/// The barycentric coordinates of the point of a triangle that is seen at a place: not negative, even where the grid has
/// given a triangle a place that lies beside it.
fn weights(sides: &[DVec3; 3], at: DVec2) -> [f64; 3] {
    let way = at.extend(1.0);
    let weights = sides.map(|side| side.dot(way));
    let sign = weights.iter().sum::<f64>().signum();
    let weights = weights.map(|weight| (weight * sign).max(0.0));
    let sum: f64 = weights.iter().sum();
    match sum > 0.0 && sum.is_finite() {
        true => weights.map(|weight| weight / sum),
        false => [1.0 / 3.0; 3],
    }
}

/// How far a place is from the lines of a triangle's edges, in pixels.
fn distance_to_edges(places: &[Place; 3], at: DVec2) -> f64 {
    let [a, b, c] = places.map(|p| DVec3::new(p.x, p.y, p.w));
    let distance = |from: DVec3, to: DVec3| {
        let line = from.cross(to);
        line.dot(at.extend(1.0)).abs() / line.truncate().length()
    };
    distance(a, b).min(distance(b, c)).min(distance(c, a))
}

/// Where the search for a patch's point begins: at the point of the triangle that stands for it, in the shape's space.
struct Begun<'a> {
    geometry: &'a Geometry,
    primitive: u32,
    /// Of the corners.
    parameters: [DVec2; 3],
    weights: [f64; 3],
    local: DVec3,
    a: f64,
}

/// A point of a patch.
struct OnPatch {
    sample: SurfaceSample,
    a: f64,
}

impl Begun<'_> {
    /// Where the line meets the patch that the triangle stands for: Newton's method for the parameters and `a`. Where that
    /// does not converge it is the triangle's point, with the patch's normal there.
    fn on_patch(&self, line: &Line) -> OnPatch {
        /// Half a step of parameters between places whose difference is a derivative.
        const STEP: f32 = 1.0 / 512.0;
        const ROUNDS: u32 = 12;
        let [a, b, c] = self.parameters;
        let [u, v, w] = self.weights;
        let start = a * u + b * v + c * w;
        let at = |parameters: DVec2| {
            let chart = self.geometry.patch(self.primitive, parameters.as_vec2());
            chart.expect("it was cut into triangles").point
        };
        let (mut place, mut along) = (start, self.a);
        let reach = line.way.length();
        let mut best = (f64::INFINITY, start, self.a);
        for _ in 0..ROUNDS {
            let point = at(place).position.as_dvec3();
            let off = line.at(along) - point;
            let distance = off.length();
            if distance < best.0 {
                best = (distance, place, along);
            } else if distance.is_nan() || distance > 2.0 * best.0 {
                break;
            }
            let change = |step: Vec2| {
                let [back, forth] = [-1.0, 1.0].map(|sign| {
                    let moved = place + (step * sign).as_dvec2();
                    at(moved).position.as_dvec3()
                });
                (forth - back) / f64::from(2.0 * STEP)
            };
            let (mut du, mut dv) = (change(Vec2::new(STEP, 0.0)), change(Vec2::new(0.0, STEP)));
            // At a pole one of them is nothing: a little of anything lets the others be solved for.
            let least = 1e-6 * du.length().max(dv.length());
            let normal = at(place).normal.as_dvec3();
            if du.length() < least {
                du += least * dv.normalize_or_zero().cross(normal);
            }
            if dv.length() < least {
                dv += least * normal.cross(du.normalize_or_zero());
            }
            let step = DMat3::from_cols(du, dv, -line.way).inverse() * off;
            if !step.is_finite() {
                break;
            }
            place += step
                .truncate()
                .clamp(DVec2::splat(-0.05), DVec2::splat(0.05));
            along += step.z;
        }
        let (distance, place, along) = best;
        // Charts are of single precision. Near a silhouette the other side is a solution too.
        let [found, begun] = [place, start].map(|place| at(place).normal.as_dvec3().dot(line.way));
        let near = distance < 1e-5 * (reach * along.abs() + self.local.length());
        let near = near && (found < 0.0) == (begun < 0.0);
        let (place, along) = if near {
            (place, along)
        } else {
            (start, self.a)
        };
        let sample = at(place);
        OnPatch {
            sample: SurfaceSample {
                position: match near {
                    true => line.at(along).as_vec3(),
                    false => sample.position,
                },
                primitive: self.primitive,
                ..sample
            },
            a: along,
        }
    }
}
