//! `gridvolume`: values at the centres of the cells of a grid, from a file in Mitsuba's volume format, with one channel
//! (numbers), three (colours) or six (symmetric matrices). `filter_type` is trilinear or nearest; beyond the unit cube
//! `wrap_mode` clamps, repeats or mirrors. With `use_grid_bbox` the grid fills the box that the file tells, before
//! `to_world`.

use std::sync::Arc;

use glam::DMat4;

use super::field::{Field, Placement, TO_WORLD, diagonal};
use crate::color::{ColorModel, Pixels, Spectra};
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean, choice, file, float};
use crate::error::Result;
use crate::image::vol::{self, Grid};
use crate::lanes::{self, Ints, Lanes, MAX_TABLE};
use crate::math::Bounds;
use crate::texture::Palette;
use crate::texture::bitmap::Wrap;

/// What stands in the cells, x fastest.
#[derive(Debug)]
enum Cells<C: ColorModel> {
    Numbers(Vec<f32>),
    Colors {
        colors: C::Texels,
        /// By cell, a number that no channel exceeds.
        most: Vec<f32>,
    },
    /// By entry: xx, yy, zz, xy, xz, yz.
    Matrices([Vec<f32>; 6]),
}

/// Values on a grid.
#[derive(Clone, Debug)]
pub struct GridVolume<C: ColorModel> {
    size: [usize; 3],
    cells: Arc<Cells<C>>,
    nearest: bool,
    wrap: Wrap,
    placement: Placement,
}

/// The eight cells around places, and the places between them.
struct Cell<F: Lanes> {
    /// Indices of the cells at x and x + 1, of the rows at y and y + 1, of the layers at z and z + 1.
    sides: [[F::Int; 2]; 3],
    place: lanes::Vec3<F>,
}

impl<F: Lanes> Cell<F> {
    /// A corner's index: a bit an axis.
    #[inline(always)]
    fn index(&self, corner: usize) -> F::Int {
        let [x, y, z] = self.sides;
        x[corner & 1] + y[corner >> 1 & 1] + z[corner >> 2]
    }

    /// A corner's share.
    #[inline(always)]
    fn share(&self, corner: usize) -> F {
        let mut share = F::one();
        for (axis, place) in [self.place.x, self.place.y, self.place.z]
            .into_iter()
            .enumerate()
        {
            let part = match corner >> axis & 1 {
                0 => F::one() - place,
                _ => place,
            };
            share = share * part;
        }
        share
    }
}

impl<C: ColorModel> GridVolume<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "values on a grid, from a .vol file",
        properties: &[&[
            file("filename", "the grid, in Mitsuba's volume format"),
            choice(
                "filter_type",
                &["trilinear", "nearest"],
                "how cells are looked up",
            ),
            choice(
                "wrap_mode",
                &["clamp", "repeat", "mirror"],
                "what lies beyond the unit cube",
            ),
            boolean(
                "use_grid_bbox",
                false,
                "whether the grid fills the box that its file tells, and not the unit cube",
            ),
            TO_WORLD,
            boolean("raw", false, "numbers that are no colors").without_effect(),
            float(
                "max_value",
                0.0,
                "the greatest value, which is looked for here",
            )
            .absent("none")
            .without_effect(),
            boolean("accel", true, "whether Mitsuba lets a GPU look cells up").without_effect(),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let path = properties.file("filename")?;
        let budget = properties.budget();
        let grid = vol::read(&path, budget).map_err(|e| e.at(properties.location()))?;
        let inner = match properties.boolean("use_grid_bbox")? {
            true => {
                let [min, max] = grid.bbox.map(|corner| corner.as_dvec3());
                DMat4::from_translation(min) * DMat4::from_scale(max - min)
            }
            false => DMat4::IDENTITY,
        };
        let size = grid.size.map(|n| n as usize);
        let count: usize = size.iter().product();
        if count > MAX_TABLE / 3 {
            return Err(
                properties.error("filename", format!("a grid of {count} cells is too large"))
            );
        }
        let wrap = match properties.choice("wrap_mode")? {
            "repeat" => Wrap::Repeat,
            "mirror" => Wrap::Mirror,
            _ => Wrap::Clamp,
        };
        let cells = Self::cells(properties, palette, grid)?;
        Ok(Self {
            size,
            cells: Arc::new(cells),
            nearest: properties.choice("filter_type")? == "nearest",
            wrap,
            placement: Placement::of(properties, inner)?,
        })
    }

    fn cells(properties: &Properties<'_>, palette: &Palette<C>, grid: Grid) -> Result<Cells<C>> {
        let Grid {
            channels, values, ..
        } = grid;
        let account = properties.budget().open();
        match channels {
            1 => Ok(Cells::Numbers(values)),
            3 => {
                let colors: Vec<[f32; 3]> = values.as_chunks().0.to_vec();
                let count = colors.len();
                // A smooth spectrum of a colour rises above it, but not to twice as much.
                let rise = if palette.color.upsamples() { 2.0 } else { 1.0 };
                let most = colors.iter().map(|[r, g, b]| r.max(*g).max(*b) * rise);
                let most = most.collect();
                let pixels = Pixels::Linear(colors);
                let bytes = C::texel_bytes(&pixels) + size_of::<f32>();
                account.take_rows(count, bytes)?;
                account.keep((count * bytes) as u64);
                let colors = palette.color.texels(pixels, palette.role);
                Ok(Cells::Colors { colors, most })
            }
            6 => {
                let entry = |i: usize| values.iter().skip(i).step_by(6).copied().collect();
                Ok(Cells::Matrices(std::array::from_fn(entry)))
            }
            _ => {
                let message = format!("a grid has 1, 3 or 6 channels, and this one has {channels}");
                Err(properties.error("filename", message))
            }
        }
    }

    /// The cells around places in the world.
    #[inline(always)]
    fn cell<F: Lanes>(&self, at: lanes::Vec3<F>) -> Cell<F> {
        let at = self.placement.local(at);
        let half = F::splat(if self.nearest { 0.0 } else { 0.5 });
        let next = F::splat(if self.nearest { 0.0 } else { 1.0 });
        let mut sides = [[F::Int::splat(0); 2]; 3];
        let mut place = [F::zero(); 3];
        let mut stride = 1_u32;
        for (axis, coordinate) in [at.x, at.y, at.z].into_iter().enumerate() {
            let n = self.size[axis];
            let p = coordinate * F::splat(n as f32) - half;
            let low = p.floor();
            let step = F::Int::splat(stride);
            sides[axis] = [
                self.wrap.apply(low, n) * step,
                self.wrap.apply(low + next, n) * step,
            ];
            place[axis] = if self.nearest { F::zero() } else { p - low };
            stride = stride.wrapping_mul(n as u32);
        }
        let [x, y, z] = place;
        Cell {
            sides,
            place: lanes::Vec3::new(x, y, z),
        }
    }

    /// Interpolated numbers, one a cell.
    #[inline(always)]
    fn numbers<F: Lanes>(&self, table: &[f32], cell: &Cell<F>) -> F {
        if self.nearest {
            return F::gather(table, cell.index(0));
        }
        let mut sum = F::zero();
        for corner in 0..8 {
            sum = sum + F::gather(table, cell.index(corner)) * cell.share(corner);
        }
        sum
    }

    /// See [`super::Volume::eval_lanes`]; of matrices the mean of the entries.
    #[inline(always)]
    pub(super) fn eval_lanes<F: Lanes>(
        &self,
        at: lanes::Vec3<F>,
        wavelengths: &[C::Wavelengths],
    ) -> C::Columns<F> {
        let cell = self.cell(at);
        match &*self.cells {
            Cells::Numbers(table) => C::Columns::<F>::splat(self.numbers(table, &cell)),
            Cells::Colors { colors, .. } if self.nearest => {
                C::evaluate_texels(colors, cell.index(0), wavelengths)
            }
            Cells::Colors { colors, .. } => {
                let mut sum = C::Columns::<F>::zero();
                for corner in 0..8 {
                    let value = C::evaluate_texels(colors, cell.index(corner), wavelengths);
                    sum = sum + value * cell.share(corner);
                }
                sum
            }
            Cells::Matrices(entries) => {
                let mut sum = F::zero();
                for table in entries {
                    sum = sum + self.numbers(table, &cell);
                }
                C::Columns::<F>::splat(sum * F::splat(1.0 / 6.0))
            }
        }
    }

    /// See [`super::Volume::matrices`].
    #[inline(always)]
    pub(super) fn matrices<F: Lanes>(
        &self,
        at: lanes::Vec3<F>,
        wavelengths: &[C::Wavelengths],
    ) -> [F; 6] {
        let Cells::Matrices(tables) = &*self.cells else {
            return diagonal(self.eval_lanes(at, wavelengths));
        };
        let cell = self.cell(at);
        let mut entries = [F::zero(); 6];
        for (entry, table) in entries.iter_mut().zip(tables) {
            *entry = self.numbers(table, &cell);
        }
        entries
    }

    /// The cells along an axis that places from `low` to `high` in the unit cube may need.
    fn range(&self, axis: usize, low: f32, high: f32) -> std::ops::RangeInclusive<usize> {
        let n = self.size[axis];
        // Half a cell for the filter, and some room for rounding.
        let reach = if self.nearest { 0.01 } else { 0.51 };
        let last = n - 1;
        let first = (low * n as f32 - reach).floor();
        let end = (high * n as f32 + reach).floor();
        let outside = first < 0.0 || end > last as f32;
        if !first.is_finite() || !end.is_finite() || outside && !matches!(self.wrap, Wrap::Clamp) {
            return 0..=last;
        }
        (first as usize).min(last)..=(end as usize).min(last)
    }

    /// The greatest of some numbers, one a cell, within a box in the world.
    fn most(&self, bounds: &Bounds, number: impl Fn(usize) -> f32) -> f32 {
        let Bounds { min, max } = self.placement.around(bounds);
        let [xs, ys, zs] = [0, 1, 2].map(|axis| self.range(axis, min[axis], max[axis]));
        let mut most = 0.0_f32;
        for z in zs {
            for y in ys.clone() {
                let row = (z * self.size[1] + y) * self.size[0];
                for x in xs.clone() {
                    most = most.max(number(row + x));
                }
            }
        }
        most
    }
}

impl<C: ColorModel> Field<C> for GridVolume<C> {
    fn bounds(&self) -> Bounds {
        self.placement.bounds
    }

    fn resolution(&self) -> [usize; 3] {
        self.size
    }

    fn holds_matrices(&self) -> bool {
        matches!(*self.cells, Cells::Matrices(_))
    }

    fn is_grey(&self) -> bool {
        !matches!(*self.cells, Cells::Colors { .. })
    }

    fn most_within(&self, bounds: &Bounds) -> f32 {
        match &*self.cells {
            Cells::Numbers(table) => self.most(bounds, |i| table[i]),
            Cells::Colors { most, .. } => self.most(bounds, |i| most[i]),
            // No value of the matrix is greater than its trace.
            Cells::Matrices([xx, yy, zz, ..]) => self.most(bounds, |i| xx[i] + yy[i] + zz[i]),
        }
    }
}
