//! Volumes: colours (or numbers) that vary over space, for participating media, and the same everywhere in their simplest
//! form. A volume stands in the unit cube, which `to_world` puts into the world.

use glam::{Affine3A, DMat4, Vec3};

use super::{constvolume, gridvolume};
use crate::color::{ColorModel, Role, Spectra};
use crate::description::declared::{Row, transform};
use crate::description::{Kind, Properties, Value};
use crate::error::Result;
use crate::family::family;
use crate::lanes::{self, Call, Lanes};
use crate::math::{Bounds, Transform};
use crate::texture::Palette;

/// What every volume does.
pub trait Field<C: ColorModel>: std::fmt::Debug + Send + Sync {
    /// The value, where it is the same everywhere.
    fn constant(&self) -> Option<&C::Stored> {
        None
    }
    /// The box in world space around the unit cube's image.
    fn bounds(&self) -> Bounds;
    /// Cells along each axis of the unit cube.
    fn resolution(&self) -> [usize; 3] {
        [1; 3]
    }
    /// Whether the values are matrices.
    fn holds_matrices(&self) -> bool {
        false
    }
    /// Whether the value is the same in every channel.
    fn is_grey(&self) -> bool {
        false
    }
    /// A number that no channel's value exceeds within a box in world space; not asked of one that is the same everywhere.
    fn most_within(&self, _bounds: &Bounds) -> f32 {
        f32::INFINITY
    }
}

family! {
    /// Every volume there is.
    #[derive(Clone, Debug)]
    pub enum Volume<C>: Field, context Palette<C> {
        "constvolume" => Const(constvolume::ConstVolume<C>),
        "gridvolume" => Grid(gridvolume::GridVolume<C>),
    }
}

impl<C: ColorModel> Volume<C> {
    /// The volume called `name`: a nested one, or a colour or number that is the same everywhere; `role` is what values
    /// stand for.
    ///
    /// # Errors
    /// Where it is neither, or is not given and has no preset.
    pub fn named(
        properties: &Properties<'_>,
        name: &'static str,
        palette: &Palette<C>,
        role: Role,
    ) -> Result<Self> {
        if let Some(property) = properties.value(name)
            && matches!(property.value, Value::Object(_))
            && let Some(child) = properties.held(property)
            && child.kind() == Kind::Volume
        {
            return Self::build(&child, &palette.with_role(role));
        }
        let value = palette.color(properties, name, role_of(properties, name, role))?;
        Ok(Self::Const(constvolume::ConstVolume::everywhere(value)))
    }

    /// The values at places in the world, whose paths' wavelengths are given from the first lane on.
    #[inline(always)]
    pub fn eval_lanes<F: Lanes>(
        &self,
        at: lanes::Vec3<F>,
        wavelengths: &[C::Wavelengths],
    ) -> C::Columns<F> {
        match self {
            Self::Const(volume) => C::evaluate_lanes(volume.value(), wavelengths),
            Self::Grid(grid) => F::call(LookUp {
                grid,
                at,
                wavelengths,
            }),
        }
    }

    /// The symmetric matrices at places in the world: xx, yy, zz, xy, xz, yz. A number is that multiple of the identity, and
    /// three are its diagonal.
    #[inline(always)]
    pub fn matrices<F: Lanes>(&self, at: lanes::Vec3<F>, wavelengths: &[C::Wavelengths]) -> [F; 6] {
        match self {
            Self::Const(volume) => diagonal(C::evaluate_lanes(volume.value(), wavelengths)),
            Self::Grid(grid) => F::call(Matrices {
                grid,
                at,
                wavelengths,
            }),
        }
    }
}

/// What the colour called `name` stands for. As in Mitsuba a triple in [0, 1] becomes the spectrum of a reflectance, also
/// where it is none, and not a multiple of a darker one's.
pub(super) fn role_of(properties: &Properties<'_>, name: &str, role: Role) -> Role {
    match properties.value(name).map(|property| &property.value) {
        Some(Value::Rgb(rgb))
            if role == Role::Quantity && rgb.min_element() >= 0.0 && rgb.max_element() <= 1.0 =>
        {
            Role::Reflectance
        }
        _ => role,
    }
}

/// The diagonal matrices of the first three channels, or of the only one.
#[inline(always)]
pub(super) fn diagonal<F: Lanes, S: Spectra<F>>(values: S) -> [F; 6] {
    let last = S::CHANNELS - 1;
    let [xx, yy, zz] = [values[0], values[last.min(1)], values[last.min(2)]];
    [xx, yy, zz, F::zero(), F::zero(), F::zero()]
}

/// The arguments of [`Volume::eval_lanes`].
struct LookUp<'a, C: ColorModel, F: Lanes> {
    grid: &'a gridvolume::GridVolume<C>,
    at: lanes::Vec3<F>,
    wavelengths: &'a [C::Wavelengths],
}

impl<C: ColorModel, F: Lanes> Call<F> for LookUp<'_, C, F> {
    type Output = C::Columns<F>;

    #[inline(always)]
    fn run(self) -> C::Columns<F> {
        self.grid.eval_lanes(self.at, self.wavelengths)
    }
}

/// The arguments of [`Volume::matrices`].
struct Matrices<'a, C: ColorModel, F: Lanes> {
    grid: &'a gridvolume::GridVolume<C>,
    at: lanes::Vec3<F>,
    wavelengths: &'a [C::Wavelengths],
}

impl<C: ColorModel, F: Lanes> Call<F> for Matrices<'_, C, F> {
    type Output = [F; 6];

    #[inline(always)]
    fn run(self) -> [F; 6] {
        self.grid.matrices(self.at, self.wavelengths)
    }
}

/// Where the unit cube stands.
pub(super) const TO_WORLD: Row = transform("to_world", "from the unit cube to the world");

const UNIT: Bounds = Bounds {
    min: Vec3::ZERO,
    max: Vec3::ONE,
};

/// The unit cube's place in the world, and the way back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    pub(super) bounds: Bounds,
    to_local: Affine3A,
}

impl Placement {
    /// Of the unit cube as it is.
    pub(super) fn identity() -> Self {
        Self {
            bounds: UNIT,
            to_local: Affine3A::IDENTITY,
        }
    }

    /// By `to_world`, of a unit cube that `inner` has put somewhere before.
    pub(super) fn of(properties: &Properties<'_>, inner: DMat4) -> Result<Self> {
        let to_world = properties.transform("to_world")? * inner;
        let Some(transform) = Transform::new(&to_world) else {
            let message = "a volume needs a transform that can be inverted";
            return Err(properties.error("to_world", message));
        };
        Ok(Self {
            bounds: UNIT.transformed(&transform),
            to_local: Affine3A::from_mat4(to_world.inverse().as_mat4()),
        })
    }

    /// The box, in the unit cube's space, around a box in the world.
    pub(super) fn around(&self, world: &Bounds) -> Bounds {
        let corners = world.corners().into_iter();
        let own = corners.map(|corner| self.to_local.transform_point3(corner));
        own.fold(Bounds::EMPTY, Bounds::with)
    }

    /// Places in the world as they stand in the unit cube.
    #[inline(always)]
    pub(super) fn local<F: Lanes>(&self, at: lanes::Vec3<F>) -> lanes::Vec3<F> {
        let column = |axis: glam::Vec3A| lanes::Vec3::all(axis.into());
        let m = &self.to_local.matrix3;
        let (x, y, z) = (column(m.x_axis), column(m.y_axis), column(m.z_axis));
        x * at.x + y * at.y + z * at.z + column(self.to_local.translation)
    }
}
