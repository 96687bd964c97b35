//! The guide: where light of caustics comes from at a point. Photons are put into cells of a k-d tree, and each cell has the
//! density of their directions, as Jensen has it (*Importance driven path tracing using the photon map*, 1995). Half of a
//! surface's directions are drawn by the guide where it has a cell, half by the material; all are weighted by the mean of both
//! densities, so that nothing depends on how good the guide is but noise.

use glam::Vec3;

use super::directions::Directions;
use super::photons::Photon;
use crate::interaction::Points;
use crate::lanes::{self, Lanes, MAX_LANES, Mask as _};
use crate::math::Bounds;

/// Cells of photons.
#[derive(Debug)]
pub(super) struct Guide {
    /// The first is the root.
    nodes: Vec<Node>,
    cells: Vec<Cell>,
}

#[derive(Clone, Copy, Debug)]
enum Node {
    /// A plane across an axis: what is below it is in the next node.
    Plane {
        axis: u8,
        at: f32,
        above: u32,
    },
    Cell(u32),
}

/// A cell of photons.
#[derive(Debug)]
struct Cell {
    /// What the photons light; world space.
    bounds: Bounds,
    directions: Directions,
}

/// Photons in a cell.
const MOST: usize = 64;
/// How far a cell reaches beyond its photons, by its longest side.
const REACH: f32 = 0.25;
/// The share of directions that the guide draws where it has a cell.
const SHARE: f32 = 0.5;

impl Guide {
    /// The most bytes for so many photons, they themselves included.
    pub(super) fn bytes(photons: u64) -> u64 {
        // Halved, cells have at least half of what they may have.
        let cells = 2 * photons / MOST as u64 + 1;
        let cell =
            Directions::bytes(MOST as u64) + (size_of::<Cell>() + 2 * size_of::<Node>()) as u64;
        // Photons stand in parts before they are put together.
        photons * 2 * size_of::<Photon>() as u64 + cells * cell
    }

    /// Of photons; `None` without any.
    pub(super) fn of(mut photons: Vec<Photon>) -> Option<Self> {
        if photons.is_empty() {
            return None;
        }
        let mut guide = Self {
            nodes: Vec::new(),
            cells: Vec::new(),
        };
        guide.cut(&mut photons);
        Some(guide)
    }

    /// Puts photons into cells.
    fn cut(&mut self, photons: &mut [Photon]) {
        let around = |bounds: Bounds, photon: &Photon| bounds.with(photon.position);
        let bounds = photons.iter().fold(Bounds::EMPTY, around);
        let sides = bounds.max - bounds.min;
        if photons.len() <= MOST {
            let reach = Vec3::splat(sides.max_element() * REACH);
            self.nodes.push(Node::Cell(self.cells.len() as u32));
            self.cells.push(Cell {
                bounds: Bounds {
                    min: bounds.min - reach,
                    max: bounds.max + reach,
                },
                directions: Directions::of(photons.iter().map(|photon| photon.direction)),
            });
            return;
        }
        let axis = sides.max_position();
        let middle = photons.len() / 2;
        // Those at one place are told apart by their directions, so that the order they came in is no matter.
        photons.select_nth_unstable_by(middle, |a, b| {
            let keys = |p: &Photon| {
                let [x, y, z] = p.position.to_array();
                let [dx, dy, dz] = p.direction.to_array();
                [p.position[axis], x, y, z, dx, dy, dz]
            };
            let pairs = keys(a).into_iter().zip(keys(b));
            pairs.fold(std::cmp::Ordering::Equal, |order, (a, b)| {
                order.then(a.total_cmp(&b))
            })
        });
        let index = self.nodes.len();
        let at = photons[middle].position[axis];
        let (below, above) = photons.split_at_mut(middle);
        self.nodes.push(Node::Cell(0));
        self.cut(below);
        self.nodes[index] = Node::Plane {
            axis: axis as u8,
            at,
            above: self.nodes.len() as u32,
        };
        self.cut(above);
    }

    /// The cell of a place, if there is one.
    fn cell(&self, place: Vec3) -> Option<&Cell> {
        let mut index = 0;
        let cell = loop {
            match self.nodes[index] {
                Node::Plane { axis, at, .. } if place[usize::from(axis)] < at => index += 1,
                Node::Plane { above, .. } => index = above as usize,
                Node::Cell(cell) => break &self.cells[cell as usize],
            }
        };
        let Bounds { min, max } = cell.bounds;
        (place.cmpge(min) & place.cmple(max)).all().then_some(cell)
    }

    /// The cells of points.
    #[inline(always)]
    pub(super) fn cells<F: Lanes>(&self, at: &Points<'_, F>) -> Cells<'_, F> {
        let positions = at.position.rows();
        let (mut cells, mut known) = ([None; MAX_LANES], 0);
        for lane in at.lanes() {
            cells[lane] = self.cell(lanes::Vec3::<F>::of(&positions, lane));
            known |= u32::from(cells[lane].is_some()) << lane;
        }
        Cells {
            known: F::Mask::from_bits(known),
            cells,
        }
    }
}

/// The cells of points in lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells<'g, F: Lanes> {
    /// Those that have one.
    pub(super) known: F::Mask,
    cells: [Option<&'g Cell>; MAX_LANES],
}

impl<F: Lanes> Cells<'_, F> {
    /// The share of directions that the guide draws.
    #[inline(always)]
    pub(super) fn share(&self) -> F {
        F::select(self.known, F::splat(SHARE), F::zero())
    }

    /// World directions from numbers in [0, 1)² for points that have a cell and are in `drawn`, and the others given.
    #[inline(always)]
    pub(super) fn sample(
        &self,
        drawn: F::Mask,
        u: lanes::Vec2<F>,
        others: lanes::Vec3<F>,
    ) -> lanes::Vec3<F> {
        let (numbers, mut rows) = (u.rows(), others.rows());
        for lane in (self.known & drawn).lanes() {
            if let Some(cell) = self.cells[lane] {
                let direction = cell.directions.sample(lanes::Vec2::<F>::of(&numbers, lane));
                for axis in 0..3 {
                    rows[axis][lane] = direction[axis];
                }
            }
        }
        lanes::Vec3::<F>::load(&rows)
    }

    /// The density of world directions: the mean of the material's and the guide's, or the material's alone.
    #[inline(always)]
    pub(super) fn mixed(&self, direction: lanes::Vec3<F>, material: F) -> F {
        let rows = direction.rows();
        let mut own = F::ROW;
        for lane in self.known.lanes() {
            if let Some(cell) = self.cells[lane] {
                own[lane] = cell.directions.pdf(lanes::Vec3::<F>::of(&rows, lane));
            }
        }
        let share = self.share();
        material * (F::one() - share) + F::load(&own) * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random;

    fn photons(count: u32) -> Vec<Photon> {
        let unit = |i, d| random::unit(random::bits(u64::from(i), d));
        let point = |i| Vec3::new(unit(i, 0), 3.0 * unit(i, 1), 0.0);
        let photon = |i| Photon {
            position: point(i),
            direction: (Vec3::Z - 0.3 * point(i)).normalize(),
        };
        (0..count).map(photon).collect()
    }

    #[test]
    fn every_photon_is_in_a_cell_and_what_is_far_from_all_is_in_none() {
        let all = photons(5000);
        let guide = Guide::of(all.clone()).unwrap();
        assert!(guide.cells.len() >= 5000 / MOST && guide.cells.len() <= 2 * 5000 / MOST + 1);
        let pdf = |photon: &Photon| {
            let cell = guide.cell(photon.position).unwrap();
            cell.directions.pdf(photon.direction)
        };
        // Where photons come from is far likelier than at random.
        let mean = all.iter().map(pdf).sum::<f32>() / all.len() as f32;
        assert!(mean > 10.0 / (4.0 * std::f32::consts::PI), "{mean}");
        assert!(guide.cell(Vec3::new(0.5, 1.0, 1.0)).is_none());
        assert!(guide.cell(Vec3::NAN).is_none());
        assert!(Guide::of(Vec::new()).is_none());
    }

    #[test]
    fn photons_at_one_place_are_parted() {
        let all = vec![photons(1)[0]; 300];
        let guide = Guide::of(all.clone()).unwrap();
        assert!(guide.cells.len() > 4);
        assert!(guide.cell(all[0].position).is_some());
    }

    #[test]
    fn the_guide_takes_no_more_than_it_says() {
        for count in [1, 64, 65, 5000] {
            let guide = Guide::of(photons(count)).unwrap();
            let cells = guide.cells.len() * size_of::<Cell>();
            let held = cells + guide.nodes.len() * size_of::<Node>();
            assert!(held as u64 <= Guide::bytes(u64::from(count)));
        }
    }
}
