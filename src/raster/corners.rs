//! Corners in the picture, over lanes: those of a run of triangles, which are few enough to stay in a processor's cache until
//! the triangles have been looked at. What is linear over the picture is computed again for triangles that cover a sample,
//! which are few where it matters.

use glam::{DMat3, DVec3, Vec3};

use super::clip::Limits;
use super::projection::{Place, Projection};
use super::setup::{Corner, Grid, Reach};
use crate::lanes::{Doubles, Ints, Lanes, Mask as _, Task};

/// From a shape's space to the picture's grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placing<'a> {
    pub(super) projection: &'a Projection,
    pub(super) limits: &'a Limits,
    pub(super) grid: &'a Grid,
    /// To coordinates along the projection's ways.
    pub(super) matrix: DMat3,
    pub(super) offset: DVec3,
}

impl Placing<'_> {
    /// Where a position is.
    #[inline]
    pub(super) fn place(&self, position: Vec3) -> Place {
        let along = self.matrix * position.as_dvec3() + self.offset;
        self.projection.placed(along)
    }
}

/// Corners of a run, with room for those of another.
#[derive(Debug, Default)]
pub(super) struct Corners {
    corners: Vec<[i32; 2]>,
    /// Of each; those beyond the run's mean nothing.
    pub(super) reaches: Vec<Reach>,
}

impl Corners {
    #[inline]
    pub(super) fn corner(&self, place: usize) -> Corner {
        let [x, y] = self.corners[place];
        Corner { x, y }
    }
}

/// Places positions on the grid.
pub(super) struct PlaceCorners<'a> {
    pub(super) placing: &'a Placing<'a>,
    pub(super) positions: &'a [Vec3],
    pub(super) to: &'a mut Corners,
}

impl Task for PlaceCorners<'_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(self) {
        let Placing {
            projection,
            limits,
            grid,
            matrix,
            offset,
        } = *self.placing;
        let wide = <F::Double as Doubles>::splat;
        let axes = [Axis::<F>::new(grid, 0), Axis::<F>::new(grid, 1)];
        // The least and the greatest within the range: doubles answer whether they are less, and no more.
        let (before, after) = (wide(limits.near.next_down()), wide(limits.far.next_up()));
        let endless = wide(f64::INFINITY);
        let Corners { corners, reaches } = self.to;
        let room = self.positions.len().next_multiple_of(F::WIDTH);
        if corners.len() < room {
            corners.resize(room, [0; 2]);
            reaches.resize(room, Reach::default());
        }
        let runs = self.positions.chunks(F::WIDTH);
        let to = corners.chunks_mut(F::WIDTH);
        for (positions, (corners, reaches)) in runs.zip(to.zip(reaches.chunks_mut(F::WIDTH))) {
            let mut rows = [F::ROW; 3];
            for (lane, position) in positions.iter().enumerate() {
                rows[0][lane] = position.x;
                rows[1][lane] = position.y;
                rows[2][lane] = position.z;
            }
            let p = [
                F::load(&rows[0]).widen(),
                F::load(&rows[1]).widen(),
                F::load(&rows[2]).widen(),
            ];
            let [x, y, a] = transformed::<F>(&matrix, offset, p);
            let w = match projection.is_perspective() {
                true => a,
                false => wide(1.0),
            };
            let reach = wide(limits.band) * w;
            // Beyond no limit, as `Limits::beyond` has it.
            let inside = before.lt(a)
                & a.lt(after)
                & !reach.lt(x.abs())
                & x.abs().lt(endless)
                & !reach.lt(y.abs())
                & y.abs().lt(endless);
            let scale = wide(grid.scale()) / w;
            let [x, first_x, last_x] = axes[0].along((x * scale).to_nearest());
            let [y, first_y, last_y] = axes[1].along((y * scale).to_nearest());
            store::<F>(&x.interleave(y), corners.as_flattened_mut());
            let (x, y) = (first_x.interleave(last_x), first_y.interleave(last_y));
            let ([a, b], [c, d]) = (x[0].interleave(y[0]), x[1].interleave(y[1]));
            store::<F>(&[a, b, c, d], reaches.as_flattened_mut());
            for lane in (!inside).lanes().take_while(|lane| *lane < positions.len()) {
                let place = self.placing.place(positions[lane]);
                let Corner { x, y } = Corner::outside(limits.beyond(&place));
                corners[lane] = [x, y];
                reaches[lane] = Grid::EVERYWHERE;
            }
        }
    }
}

/// The integers of these bits, one after another.
#[inline(always)]
fn store<F: Lanes>(lanes: &[F], values: &mut [i32]) {
    for (i, lanes) in lanes.iter().enumerate() {
        lanes.to_bits().store_to(&mut values[i * F::WIDTH..]);
    }
}

/// What lanes need of [`Grid::reach`] along an axis.
struct Axis<F: Lanes> {
    origin: F::Int,
    whole: F::Int,
    to_first: F::Int,
    to_last: F::Int,
    last: F::Int,
}

impl<F: Lanes> Axis<F> {
    #[inline(always)]
    fn new(grid: &Grid, axis: usize) -> Self {
        let steps = grid.steps(axis);
        let all = |value: i32| F::Int::splat(value.cast_unsigned());
        Self {
            origin: all(steps.origin),
            whole: all(steps.whole),
            to_first: all(steps.to_first),
            to_last: all(steps.to_last),
            last: all(steps.last),
        }
    }

    /// The coordinates of corners by those on the picture's grid, and the two of their reach, as bits.
    #[inline(always)]
    fn along(&self, coordinate: F::Int) -> [F; 3] {
        let zero = F::Int::splat(0);
        let own = coordinate - self.origin;
        let first = (own + self.to_first) & self.whole;
        let last = (own + self.to_last) & self.whole;
        let first = F::Int::select(first.lt(zero), zero, first);
        let last = zero - F::Int::select(self.last.lt(last), self.last, last);
        [own.from_bits(), first.from_bits(), last.from_bits()]
    }
}

/// `matrix · p + offset`, with the bits of single vectors.
#[inline(always)]
pub(super) fn transformed<F: Lanes>(
    matrix: &DMat3,
    offset: DVec3,
    p: [F::Double; 3],
) -> [F::Double; 3] {
    [
        along::<F>(matrix.row(0), offset.x, p),
        along::<F>(matrix.row(1), offset.y, p),
        along::<F>(matrix.row(2), offset.z, p),
    ]
}

/// The products' sum, in the order of a matrix's product with a vector.
#[inline(always)]
fn along<F: Lanes>(row: DVec3, offset: f64, [x, y, z]: [F::Double; 3]) -> F::Double {
    let wide = <F::Double as Doubles>::splat;
    wide(row.x) * x + wide(row.y) * y + wide(row.z) * z + wide(offset)
}

#[cfg(test)]
mod tests {
    use super::super::Pattern;
    use super::super::tests::{scene, sensor};
    use super::*;
    use crate::lanes::Kernel;
    use crate::sensor::Window;

    #[test]
    fn corners_lie_where_places_do_on_every_processor() {
        const ODD: [f32; 9] = [
            0.0,
            -0.3,
            1.7,
            -4.0,
            30.0,
            1e10,
            f32::MAX,
            f32::NEG_INFINITY,
            f32::NAN,
        ];
        let window = Window {
            x: 20,
            y: 10,
            width: 30,
            height: 25,
        };
        let grid = Grid::new([80, 60], &window, &Pattern::CENTRE);
        let ways = ODD.iter().flat_map(|x| ODD.map(|y| (*x, y)));
        let positions: Vec<Vec3> = ways
            .flat_map(|(x, y)| ODD.map(|z| Vec3::new(x, y, z)))
            .collect();
        for plugin in ["perspective", "orthographic"] {
            let (_, sensor, film) = scene(&sensor(plugin, ""));
            let projection = Projection::of_sensor(&sensor, &film, 0.0).unwrap();
            let limits = Limits::new(&projection, grid.band());
            let (matrix, offset) = projection.along_ways(None);
            let placing = Placing {
                projection: &projection,
                limits: &limits,
                grid: &grid,
                matrix,
                offset,
            };
            let expected = positions.iter().map(|position| {
                let place = placing.place(*position);
                match limits.beyond(&place) {
                    0 => {
                        let corner = grid.corner(&place);
                        (corner, grid.reach(&corner))
                    }
                    beyond => (Corner::outside(beyond), Grid::EVERYWHERE),
                }
            });
            let expected: (Vec<Corner>, Vec<Reach>) = expected.unzip();
            let outside = expected.0.iter().filter(|corner| corner.beyond() != 0);
            let outside = outside.count();
            assert!(outside > 100 && positions.len() - outside > 50, "{outside}");
            for kernel in Kernel::all() {
                let mut corners = Corners::default();
                kernel.run(PlaceCorners {
                    placing: &placing,
                    positions: &positions,
                    to: &mut corners,
                });
                let places = 0..positions.len();
                let found = places.map(|place| (corners.corner(place), corners.reaches[place]));
                let found: (Vec<Corner>, Vec<Reach>) = found.unzip();
                assert_eq!(found, expected, "{plugin} {}", kernel.name());
            }
        }
    }
}
