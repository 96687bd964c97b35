//! The oracle: what a z-buffer sees at pixel centres against what rays see there. Both look at the same scene through the
//! same sensor, and find surfaces by code of their own. They are compared where all rays within a pixel see one surface that
//! goes on, since along silhouettes the last bits decide; and numbers of triangles where the pixel's centre is not on an edge.

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;
use serde::Serialize;

use super::drawn::Drawn;
use super::fragment::{Attributes, Fragment};
use super::projection::Projection;
use super::visibility::{Canvas, Visibility};
use crate::accel::{Counts, Order};
use crate::color::ColorModel;
use crate::error::{Problem, Result};
use crate::interaction::{Hit, Interaction, Ray};
use crate::scene::Scene;
use crate::sensor::{Film, Sensor, Window};

/// How far quantities may be apart, in proportion to their size: the distance from the camera for distances and positions,
/// 1 for normals, and 1 or more for texture coordinates.
pub const TOLERANCE: f64 = 1e-4;
/// Which part of the pixels may differ.
pub const ALLOWED: f64 = 1e-4;
/// So far, in pixels, rays of single precision do not know where they go: next to an edge they do not tell one triangle from
/// its neighbour, and what changes faster than the tolerance over that way, as coordinates on a triangle that is smaller than
/// a pixel, may differ by that change.
const UNKNOWN: f64 = 1.0 / 512.0;

/// How a quantity compares.
#[derive(Clone, Debug, Serialize)]
pub struct Quantity {
    /// What it is.
    pub name: &'static str,
    /// In how many pixels it was compared.
    pub pixels: usize,
    /// In how many the two are further apart than they may be.
    pub differing: usize,
    /// How far they are apart at most.
    pub worst: f64,
    /// Where, on the film.
    pub at: [u32; 2],
}

/// What came of it.
#[derive(Clone, Debug, Serialize)]
pub struct Agreement {
    /// Pixels looked at.
    pub pixels: usize,
    /// Those in which rays meet something.
    pub seen: usize,
    /// Those less than a pixel from a silhouette, which are not compared.
    pub silhouettes: usize,
    /// Those that show a shape that cannot be drawn, or lie beside such, which are not compared.
    pub undrawn: usize,
    /// Those whose centre is on an edge, in which the number of the triangle is not compared.
    pub on_edges: usize,
    /// Triangles that were drawn.
    pub triangles: usize,
    /// What was compared.
    pub quantities: Vec<Quantity>,
    /// Shapes that cannot be drawn, and whatever else is to be known.
    #[serde(skip)]
    pub notes: Vec<Problem>,
}

impl Agreement {
    /// How many pixels were compared.
    pub fn compared(&self) -> usize {
        self.quantities
            .first()
            .map_or(0, |quantity| quantity.pixels)
    }

    /// Whether the two see the same: no quantity differs in more pixels than it may.
    pub fn agrees(&self) -> bool {
        let few = |q: &Quantity| q.differing as f64 <= ALLOWED * q.pixels as f64;
        self.quantities.iter().all(few)
    }
}

/// What the ray through a pixel's centre sees.
struct Sight<'s> {
    ray: Ray,
    hit: Hit,
    at: Option<Interaction<'s>>,
}

/// Quantities in their order.
const NAMES: [&str; 8] = [
    "shape",
    "primitive",
    "depth",
    "position",
    "geo_normal",
    "sh_normal",
    "uv",
    "nothing",
];
const SHAPE: usize = 0;
const PRIMITIVE: usize = 1;
const DEPTH: usize = 2;
const POSITION: usize = 3;
const GEO_NORMAL: usize = 4;
const SH_NORMAL: usize = 5;
const UV: usize = 6;
const NOTHING: usize = 7;

/// How far apart a pixel's quantities are; `None` where they are not compared.
type Differences = [Option<f64>; NAMES.len()];

/// What the raster sees at a place.
type Seen = (Fragment, Attributes);

/// How pixels of a row are counted.
#[derive(Clone, Copy, Default)]
struct Tally {
    seen: usize,
    silhouettes: usize,
    undrawn: usize,
    on_edges: usize,
}

/// Holds the raster's picture of a scene, in the film's crop and at the time when the shutter opens, against rays.
///
/// # Errors
/// Where the sensor's picture cannot be drawn.
pub fn agreement<C: ColorModel>(
    scene: &Scene<C>,
    sensor: &Sensor,
    film: &Film,
) -> Result<Agreement> {
    let crop = film.crop;
    let time = sensor.shutter().0;
    let projection = Projection::of_sensor(sensor, film, time)?;
    let drawn = Drawn::new(scene.tracer(), &projection, time, |_| true)?;
    let canvas = Canvas {
        window: crop,
        ..Canvas::whole([film.width, film.height])
    };
    let visibility = Visibility::draw(&drawn, &projection, &canvas)?;
    let first = DVec2::new(crop.x.into(), crop.y.into());
    let sights = sights(scene, sensor, film, time);
    let is_drawn = |shape: u32| drawn.placed().iter().any(|placed| placed.shape == shape);
    let missing = !drawn.warnings().is_empty();
    let stride = crop.width as usize + 2;
    let rows = (0..crop.height as usize).into_par_iter().map(|y| {
        let mut tally = Tally::default();
        let mut row = Vec::with_capacity(crop.width as usize);
        for x in 0..crop.width as usize {
            let middle = (y + 1) * stride + x + 1;
            let sight = &sights[middle];
            let around = [-1, 0, 1].into_iter().flat_map(|dy: isize| {
                [-1, 0, 1].map(|dx: isize| {
                    let place = middle as isize + dy * stride as isize + dx;
                    &sights[place as usize]
                })
            });
            tally.seen += usize::from(sight.at.is_some());
            let hidden = |s: &Sight<'_>| s.at.as_ref().is_some_and(|at| !is_drawn(at.shape));
            if missing && around.clone().any(hidden) {
                tally.undrawn += 1;
                row.push(None);
                continue;
            }
            if around
                .clone()
                .any(|other| !goes_on(sight, other, &projection))
            {
                tally.silhouettes += 1;
                row.push(None);
                continue;
            }
            let number = visibility.number(y * crop.width as usize + x, 0);
            let place = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) + first;
            let fragment = |number, place| {
                let fragment = Fragment::new(&drawn, &projection, number, place);
                (
                    fragment,
                    fragment.attributes(&drawn, &projection, number, place),
                )
            };
            let seen = number.map(|number| fragment(number, place));
            let mut apart = differences(sight, seen.as_ref(), &mut tally);
            let is_far = |apart: &Option<f64>| apart.is_some_and(|apart| apart > TOLERANCE);
            if let (Some(number), Some(seen), true) =
                (number, &seen, apart[DEPTH..].iter().any(is_far))
            {
                let around = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y]
                    .map(|way| fragment(number, place + UNKNOWN * way));
                forgive(&mut apart, sight, seen, &around);
            }
            row.push(Some(apart));
        }
        (row, tally)
    });
    let rows: Vec<_> = rows.collect();
    let mut quantities = NAMES.map(|name| Quantity {
        name,
        pixels: 0,
        differing: 0,
        worst: 0.0,
        at: [0, 0],
    });
    let mut total = Tally::default();
    for (y, (row, tally)) in (crop.y..).zip(&rows) {
        total.seen += tally.seen;
        total.silhouettes += tally.silhouettes;
        total.undrawn += tally.undrawn;
        total.on_edges += tally.on_edges;
        for (x, differences) in (crop.x..).zip(row) {
            let Some(differences) = differences else {
                continue;
            };
            for (quantity, difference) in quantities.iter_mut().zip(differences) {
                let Some(difference) = *difference else {
                    continue;
                };
                let difference = match difference.is_nan() {
                    true => f64::INFINITY,
                    false => difference,
                };
                quantity.pixels += 1;
                quantity.differing += usize::from(difference > TOLERANCE);
                if quantity.pixels == 1 || difference > quantity.worst {
                    (quantity.worst, quantity.at) = (difference, [x, y]);
                }
            }
        }
    }
    Ok(Agreement {
        pixels: crop.width as usize * crop.height as usize,
        seen: total.seen,
        silhouettes: total.silhouettes,
        undrawn: total.undrawn,
        on_edges: total.on_edges,
        triangles: drawn.triangle_count(),
        quantities: quantities.into_iter().filter(|q| q.pixels > 0).collect(),
        notes: drawn.warnings().to_vec(),
    })
}

/// What rays see in the crop and one pixel around it, row by row.
fn sights<'s, C: ColorModel>(
    scene: &'s Scene<C>,
    sensor: &Sensor,
    film: &Film,
    time: f32,
) -> Vec<Sight<'s>> {
    let Window {
        x: left,
        y: top,
        width,
        height,
    } = film.crop;
    let place = |column: u32, row: u32| {
        // Of the first column the pixel is that to the left of the crop.
        let x = f64::from(left) + f64::from(column) - 0.5;
        let y = f64::from(top) + f64::from(row) - 0.5;
        let place = DVec2::new(x / f64::from(film.width), y / f64::from(film.height));
        place.as_vec2()
    };
    let rows = (0..height + 2).into_par_iter().flat_map_iter(|row| {
        let ray = |column| sensor.ray(place(column, row), Vec2::splat(0.5), time);
        let rays: Vec<Ray> = (0..width + 2).map(ray).collect();
        let mut hits = Vec::new();
        scene.closest(&rays, Order::Coherent, &mut hits, &mut Counts::default());
        rays.into_iter().zip(hits).map(|(ray, hit)| Sight {
            ray,
            hit,
            at: (!hit.is_miss()).then(|| scene.interaction(&ray, &hit)),
        })
    });
    rows.collect()
}

/// Whether two rays next to each other see one surface that goes on from the one to the other, or both see nothing.
fn goes_on(one: &Sight<'_>, other: &Sight<'_>, projection: &Projection) -> bool {
    let (a, b) = match (&one.at, &other.at) {
        (None, None) => return true,
        (Some(a), Some(b)) => (a, b),
        _ => return false,
    };
    if (one.hit.instance, one.hit.shape) != (other.hit.instance, other.hit.shape) {
        return false;
    }
    // Surfaces with an equation end where another of the shape's begins, with a crease.
    if a.mesh.is_none() && a.primitive != b.primitive {
        return false;
    }
    let cosines = [(one, a), (other, b)].map(|(sight, at)| -at.normal.dot(sight.ray.direction));
    if (cosines[0] < 0.0) != (cosines[1] < 0.0) {
        return false;
    }
    // How far two points a pixel apart are, at most, on either of the two planes.
    let steepest = cosines
        .iter()
        .map(|c| f64::from(c.abs()).recip())
        .sum::<f64>();
    let [near, far] = [a, b].map(|at| projection.place(at.position.as_dvec3()).a);
    let gap = f64::from((a.position - b.position).length());
    gap <= 2.0 * projection.pixel(near.max(far)) * steepest
}

fn apart(a: Vec3, b: Vec3) -> f64 {
    (a - b).length().into()
}

/// Compares a pixel.
fn differences(sight: &Sight<'_>, seen: Option<&Seen>, tally: &mut Tally) -> Differences {
    let mut differences = [None; NAMES.len()];
    let (at, (fragment, attributes)) = match (&sight.at, seen) {
        (None, None) => {
            differences[NOTHING] = Some(0.0);
            return differences;
        }
        (Some(at), Some(seen)) => (at, seen),
        (at, _) => {
            let which = if at.is_some() { SHAPE } else { NOTHING };
            differences[which] = Some(1.0);
            return differences;
        }
    };
    let unequal = |a: u32, b: u32| Some(if a == b { 0.0 } else { 1.0 });
    let hit = fragment.hit_of(&sight.ray);
    if (hit.instance, hit.shape) != (sight.hit.instance, sight.hit.shape) {
        differences[SHAPE] = Some(1.0);
        return differences;
    }
    differences[SHAPE] = Some(0.0);
    let distance = f64::from(at.t);
    differences[DEPTH] = Some(f64::from((hit.t - at.t).abs()) / distance);
    let position = fragment.position.as_vec3();
    differences[POSITION] = Some(apart(position, at.position) / distance);
    let is_same = hit.primitive == at.primitive;
    if !is_same && attributes.edge < UNKNOWN {
        tally.on_edges += 1;
    } else {
        differences[PRIMITIVE] = unequal(hit.primitive, at.primitive);
    }
    // On another triangle normals and coordinates may be others.
    if is_same {
        differences[GEO_NORMAL] = Some(apart(attributes.normal, at.normal));
        let shading = attributes.shading;
        differences[SH_NORMAL] = shading.map(|normal| apart(normal, at.frame.n));
        let mut uv = attributes.uv - at.uv;
        if at.mesh.is_none() {
            // Where parameters close on themselves 0 is 1.
            uv = uv.abs().min((1.0 - uv.abs()).abs());
        }
        let uv = f64::from(uv.length());
        let size = f64::from(at.uv.length()).max(1.0);
        differences[UV] = Some(uv / size);
    }
    differences
}

/// Takes away what a quantity changes between a fragment and those around it.
fn forgive(differences: &mut Differences, sight: &Sight<'_>, seen: &Seen, around: &[Seen; 4]) {
    let distance = sight.at.as_ref().map_or(1.0, |at| f64::from(at.t));
    let mut forgive = |which: usize, change: &dyn Fn(&Seen) -> f64| {
        let most = around.iter().map(change).fold(0.0, f64::max);
        if let Some(difference) = differences[which].as_mut().filter(|d| d.is_finite()) {
            *difference = (*difference - most).max(0.0);
        }
    };
    let (fragment, attributes) = seen;
    let way = |(other, _): &Seen| (other.position - fragment.position).length() / distance;
    forgive(DEPTH, &way);
    forgive(POSITION, &way);
    forgive(GEO_NORMAL, &|(_, other)| {
        apart(other.normal, attributes.normal)
    });
    forgive(
        SH_NORMAL,
        &|(_, other)| match (other.shading, attributes.shading) {
            (Some(a), Some(b)) => apart(a, b),
            _ => 0.0,
        },
    );
    forgive(UV, &|(_, other)| (other.uv - attributes.uv).length().into());
}
