//! Plugin families: a table of names becomes an enum, its `NAMES` and its `build`.
//!
//! A family is a trait (what every member can do) and an enum (all the members there are). The enum
//! derefs to the trait, so a member is called as `sampler.set_size()` and nobody writes a match by hand.
//! A new member is one file and two lines: `mod x;` and a row in the table. It declares a `PLUGIN`, the table of its
//! properties, and has a `build`, which reads them.

/// Declares the enum of a plugin family. `$context` is what a member's `build` is given besides its
/// properties.
macro_rules! family {
    (
        $(#[$meta:meta])*
        $vis:vis enum $family:ident $(<$color:ident>)? : $interface:ident, context $context:ty
            $(, visitor $visitor:ident)? {
            $($name:literal => $member:ident($type:ty)),+ $(,)?
        }
    ) => {
        $(#[$meta])*
        #[allow(missing_docs)] // each variant is documented at the plugin that it holds
        $vis enum $family $(<$color: crate::color::ColorModel>)? {
            $($member($type)),+
        }

        impl $(<$color: crate::color::ColorModel>)? $family $(<$color>)? {
            /// The names of the members, as scene files write them.
            $vis const NAMES: &'static [&'static str] = &[$($name),+];

            /// The members' names, and what they declare.
            $vis const PLUGINS: crate::description::declared::Plugins = &[$(($name, &<$type>::PLUGIN)),+];

            /// Builds the member that `properties` names; an unknown name is an error with a suggestion.
            $vis fn build(
                properties: &crate::description::Properties<'_>,
                context: &$context,
            ) -> crate::error::Result<Self> {
                let properties = &crate::family::declared(properties, Self::PLUGINS.iter().copied())?;
                match properties.plugin() {
                    $($name => Ok(Self::$member(<$type>::build(properties, context)?)),)+
                    _ => unreachable!("a declared plugin is a member"),
                }
            }
        }

        crate::family::visited!($(<$color>)? $family, ($($visitor)?), $($member),+);

        impl $(<$color: crate::color::ColorModel>)? std::ops::Deref for $family $(<$color>)? {
            type Target = dyn $interface $(<$color>)?;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$member(member) => member),+
                }
            }
        }
    };
}

pub(crate) use family;

/// The one match over a family's members: what a visitor asks is compiled for each.
macro_rules! visited {
    ($(<$color:ident>)? $family:ident, (), $($member:ident),+) => {};
    ($(<$color:ident>)? $family:ident, ($visitor:ident), $($member:ident),+) => {
        impl $(<$color: crate::color::ColorModel>)? $family $(<$color>)? {
            #[inline(always)]
            fn visit<V: $visitor $(<$color>)?>(&self, visitor: V) -> V::Output {
                match self {
                    $(Self::$member(member) => visitor.visit(member)),+
                }
            }
        }
    };
}
pub(crate) use visited;

use crate::description::declared::Plugin;
use crate::description::properties::STRICT;
use crate::description::{Kind, Properties};
use crate::error::{Error, Result};

/// Plugins of Mitsuba 3.9 by kind: a name that only this list has is not misspelt, Étendue lacks it; one that
/// only a family has is Étendue's own.
const MITSUBA: &[(Kind, &[&str])] = &[
    (
        Kind::Shape,
        &[
            "bsplinecurve",
            "cube",
            "cylinder",
            "disk",
            "ellipsoids",
            "ellipsoidsmesh",
            "instance",
            "linearcurve",
            "merge",
            "obj",
            "ply",
            "rectangle",
            "sdfgrid",
            "serialized",
            "shapegroup",
            "sphere",
        ],
    ),
    (
        Kind::Bsdf,
        &[
            "blendbsdf",
            "bumpmap",
            "circular",
            "conductor",
            "dielectric",
            "diffuse",
            "hair",
            "mask",
            "measured",
            "measured_polarized",
            "normalmap",
            "null",
            "plastic",
            "polarizer",
            "pplastic",
            "principled",
            "principledthin",
            "retarder",
            "roughconductor",
            "roughdielectric",
            "roughplastic",
            "thindielectric",
            "twosided",
        ],
    ),
    (
        Kind::Emitter,
        &[
            "area",
            "constant",
            "directional",
            "directionalarea",
            "envmap",
            "point",
            "projector",
            "spot",
            "sunsky",
            "timed_sunsky",
            "volumelight",
        ],
    ),
    (
        Kind::Texture,
        &["bitmap", "checkerboard", "mesh_attribute", "volume"],
    ),
    (
        Kind::Spectrum,
        &[
            "blackbody",
            "d65",
            "irregular",
            "rawconstant",
            "regular",
            "srgb",
            "uniform",
        ],
    ),
    (
        Kind::Sensor,
        &[
            "batch",
            "distant",
            "irradiancemeter",
            "orthographic",
            "perspective",
            "radiancemeter",
            "thinlens",
        ],
    ),
    (Kind::Film, &["hdrfilm", "specfilm"]),
    (
        Kind::Filter,
        &[
            "box",
            "catmullrom",
            "gaussian",
            "lanczos",
            "mitchell",
            "tent",
        ],
    ),
    (
        Kind::Sampler,
        &[
            "independent",
            "ldsampler",
            "multijitter",
            "orthogonal",
            "stratified",
        ],
    ),
    (
        Kind::Integrator,
        &[
            "aov",
            "depth",
            "direct",
            "direct_projective",
            "moment",
            "path",
            "prb",
            "prb_basic",
            "prb_projective",
            "prbvolpath",
            "ptracer",
            "stokes",
            "volpath",
            "volpathmis",
            "volprim_rf_basic",
        ],
    ),
    (Kind::Medium, &["heterogeneous", "homogeneous"]),
    (
        Kind::Phase,
        &[
            "blendphase",
            "hg",
            "isotropic",
            "rayleigh",
            "sggx",
            "tabphase",
        ],
    ),
    (Kind::Volume, &["constvolume", "gridvolume"]),
];

/// Whether Mitsuba has a plugin of that name; its textures and spectra are one family.
pub(crate) fn is_mitsubas(kind: Kind, name: &str) -> bool {
    let alike = |k: Kind| match k {
        Kind::Spectrum => Kind::Texture,
        other => other,
    };
    MITSUBA
        .iter()
        .any(|(k, plugins)| alike(*k) == alike(kind) && plugins.contains(&name))
}

/// The properties as the plugin sees them that they name.
///
/// # Errors
/// Where there is no such plugin, or it is Étendue's own and the scene is read strictly.
pub(crate) fn declared<'a>(
    properties: &Properties<'a>,
    plugins: impl Iterator<Item = (&'static str, &'static Plugin)> + Clone,
) -> Result<Properties<'a>> {
    let (kind, name) = (properties.kind(), properties.plugin());
    let Some((_, plugin)) = plugins.clone().find(|(known, _)| *known == name) else {
        return Err(unknown(properties, plugins.map(|(name, _)| name)));
    };
    if properties.is_strict() && !is_mitsubas(kind, name) {
        let error = Error::input(format!("{kind} {name:?} is Étendue's own"));
        return Err(error.at(properties.location()).help(STRICT));
    }
    Ok(properties.declared(plugin))
}

/// The error for a plugin that its family does not have.
fn unknown(
    properties: &Properties<'_>,
    names: impl Iterator<Item = &'static str> + Clone,
) -> Error {
    let (kind, name) = (properties.kind(), properties.plugin());
    let error = if is_mitsubas(kind, name) {
        Error::unsupported(format!(
            "{kind} {name:?} exists in Mitsuba but not in Étendue"
        ))
    } else {
        Error::input(format!("unknown {kind} {name:?}")).suggest(name, names.clone())
    };
    let names: Vec<&str> = names.collect();
    error
        .at(properties.location())
        .help(format!("there are {}", names.join(", ")))
}
