//! `aov`: what the camera sees beside light, as channels of their own. `aovs` lists them as
//! `name:kind, …`; nested integrators give the image itself (the first) and, where they have a name,
//! channels `name.R` and so on; without any it is black and clear. Where the camera sees nothing a channel is 0: shapes
//! are counted from 1. Emitters that are hidden from light are seen here. `motion`, Étendue's own, is by how many pixels,
//! to the right and down, what is seen is displaced from when the shutter opens to when it closes; the sky as the camera turns.

use std::collections::HashSet;

use super::limits;
use super::{Context, Cost, Estimate, Estimates, Estimator, Footprint, Integrator, Start};
use crate::color::{ColorModel, Spectral};
use crate::description::declared::{Plugin, nested, string};
use crate::description::properties::STRICT;
use crate::description::{Kind, Properties, Property, Value};
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Ray};
use crate::sampler::Sampler;
use crate::scene::Scene;
use glam::Vec2;

/// What a channel group shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quantity {
    Albedo,
    Depth,
    DpDu,
    DpDv,
    DuvDx,
    DuvDy,
    GeoNormal,
    Motion,
    Position,
    PrimIndex,
    ShapeIndex,
    ShNormal,
    Uv,
}

/// Kinds as scene files name them, and the suffixes of their channels.
const QUANTITIES: &[(&str, Quantity, &[&str])] = &[
    ("albedo", Quantity::Albedo, &["R", "G", "B"]),
    ("depth", Quantity::Depth, &["T"]),
    ("dp_du", Quantity::DpDu, &["X", "Y", "Z"]),
    ("dp_dv", Quantity::DpDv, &["X", "Y", "Z"]),
    ("duv_dx", Quantity::DuvDx, &["U", "V"]),
    ("duv_dy", Quantity::DuvDy, &["U", "V"]),
    ("geo_normal", Quantity::GeoNormal, &["X", "Y", "Z"]),
    ("motion", Quantity::Motion, &["X", "Y"]),
    ("position", Quantity::Position, &["X", "Y", "Z"]),
    ("prim_index", Quantity::PrimIndex, &["I"]),
    ("sh_normal", Quantity::ShNormal, &["X", "Y", "Z"]),
    ("shape_index", Quantity::ShapeIndex, &["I"]),
    ("uv", Quantity::Uv, &["U", "V"]),
];

/// What scene files write, in words.
const KINDS: &str = "name:kind pairs, parted by commas; a kind is albedo, depth (distance), dp_du, dp_dv, duv_dx, duv_dy, \
    geo_normal, position, prim_index, sh_normal, shape_index, uv, or Étendue's own motion (pixels by which what is seen is \
    displaced while the shutter is open)";

/// A nested integrator.
#[derive(Debug)]
struct Nested<C: ColorModel> {
    /// Empty where the file gives none.
    name: String,
    integrator: Box<dyn Estimator<C>>,
}

/// The channels and the nested integrators.
#[derive(Debug)]
pub struct Aov<C: ColorModel> {
    quantities: Vec<(String, Quantity, &'static [&'static str])>,
    nested: Vec<Nested<C>>,
    footprint: Option<Footprint>,
}

impl<C: ColorModel> Aov<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "other quantities beside the image",
        properties: &[
            limits::UNUSED,
            &[
                string("aovs", "", KINDS),
                nested(Kind::Integrator, "whose image is written too"),
            ],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        let mut quantities = Vec::new();
        for item in properties.string("aovs")?.split(',').map(str::trim) {
            if item.is_empty() {
                continue;
            }
            let Some((name, kind)) = item.split_once(':') else {
                let error =
                    properties.error("aovs", format!("\"{item}\" does not say what it shows"));
                return Err(error.help("write it as name:kind, such as dd:depth"));
            };
            let kinds = QUANTITIES.iter().map(|(kind, ..)| *kind);
            let Some((_, quantity, suffixes)) = QUANTITIES.iter().find(|(k, ..)| *k == kind.trim())
            else {
                let all = kinds.clone().collect::<Vec<_>>().join(", ");
                let error = properties.error("aovs", format!("unknown kind \"{}\"", kind.trim()));
                return Err(error
                    .suggest(kind.trim(), kinds)
                    .help(format!("there are {all}")));
            };
            if properties.is_strict() && matches!(quantity, Quantity::Motion) {
                let error = properties.error("aovs", "the kind \"motion\" is Étendue's own");
                return Err(error.help(STRICT));
            }
            if context.unprojected && matches!(quantity, Quantity::Motion) {
                let message =
                    "the kind \"motion\" is of sensors that project, and this one does not";
                return Err(properties.error("aovs", message).help(
                    "perspective, thinlens and orthographic do; of a batch render each sensor by itself",
                ));
            }
            quantities.push((name.trim().to_owned(), *quantity, *suffixes));
        }
        let mut nested = Vec::new();
        for child in properties.children(Kind::Integrator) {
            let is_child =
                |p: &&Property| matches!(p.value, Value::Object(id) if id == child.node_id());
            let name = properties
                .all()
                .iter()
                .find(is_child)
                .map_or("", |p| &p.name);
            let integrator = Box::new(Integrator::<C>::build(&child, context)?);
            if integrator.traces_light() && !(name.is_empty() && nested.is_empty()) {
                let message = format!("{} does not give its image beside others", child.plugin());
                return Err(child
                    .error("", message)
                    .help("leave it the first, without a name"));
            }
            nested.push(Nested {
                name: name.to_owned(),
                integrator,
            });
        }
        let aov = Self {
            quantities,
            nested,
            footprint: context.footprint.clone(),
        };
        let mut names = HashSet::new();
        let mut channels = Estimator::<C>::extra_channels(&aov).into_iter();
        match channels.find(|name| !names.insert(name.clone())) {
            None => Ok(aov),
            Some(twice) => {
                let message = format!("two channels would be named \"{twice}\"");
                Err(properties
                    .error("aovs", message)
                    .help("give each name once"))
            }
        }
    }
}

impl<C: ColorModel> Estimator<C> for Aov<C> {
    fn extra_channels(&self) -> Vec<String> {
        let mut channels = Vec::new();
        for Nested { name, integrator } in &self.nested {
            channels.extend(integrator.extra_channels());
            if !name.is_empty() {
                channels.extend(["R", "G", "B", "A"].map(|c| format!("{name}.{c}")));
            }
        }
        for (name, _, suffixes) in &self.quantities {
            channels.extend(suffixes.iter().map(|suffix| format!("{name}.{suffix}")));
        }
        channels
    }

    fn renders_media(&self) -> bool {
        (self.nested.iter()).any(|nested| nested.integrator.renders_media())
    }

    fn leaves_out(&self, scene: &Scene<C>) -> Option<String> {
        let mut nested = self.nested.iter();
        nested.find_map(|nested| nested.integrator.leaves_out(scene))
    }

    fn traces_light(&self) -> bool {
        (self.nested.iter()).any(|nested| nested.integrator.traces_light())
    }

    fn photon_bytes(&self) -> u64 {
        let bytes = self.nested.iter();
        let bytes = bytes.map(|nested| nested.integrator.photon_bytes());
        bytes.fold(0, u64::saturating_add)
    }

    fn prepare(&self, scene: &Scene<C>) {
        for nested in &self.nested {
            nested.integrator.prepare(scene);
        }
    }

    fn estimate(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        starts: &[Start<C>],
        estimates: &mut Estimates<C::Sample>,
        cost: &mut Cost,
    ) {
        let mut children = Vec::with_capacity(self.nested.len());
        for Nested { integrator, .. } in &self.nested {
            let mut child = Estimates::default();
            integrator.estimate(scene, sampler, starts, &mut child, cost);
            children.push((child, integrator.extra_channels().len()));
        }
        let rays: Vec<Ray> = starts.iter().map(|s| s.ray).collect();
        let mut hits = Vec::new();
        cost.closest(scene, 0, &rays, &mut hits);

        estimates.values.clear();
        estimates.extra.clear();
        estimates.splats.clear();
        if let Some((first, _)) = children.first_mut() {
            estimates.splats.append(&mut first.splats);
        }
        let footprint = self.footprint.as_ref().filter(|_| scene.has_mipmaps());
        let mut developed = vec![0.0; scene.color().channels().len()];
        for (i, (start, hit)) in starts.iter().zip(&hits).enumerate() {
            let nothing = Estimate {
                radiance: C::Sample::zero(),
                alpha: 0.0,
            };
            estimates.values.push(
                children
                    .first()
                    .map_or(nothing, |(child, _)| child.values[i]),
            );
            for (Nested { name, .. }, (child, extra)) in self.nested.iter().zip(&children) {
                estimates
                    .extra
                    .extend_from_slice(&child.extra[i * extra..][..*extra]);
                if !name.is_empty() {
                    let Estimate { radiance, alpha } = &child.values[i];
                    scene
                        .color()
                        .develop(start.pass, radiance, &start.wavelengths, &mut developed);
                    estimates.extra.extend_from_slice(&developed[..3]);
                    estimates.extra.push(*alpha);
                }
            }
            let at = (!hit.is_miss()).then(|| {
                let at = scene.interaction(&start.ray, hit);
                match footprint {
                    Some(footprint) => footprint.seen(&start.ray, at),
                    None => at,
                }
            });
            for (_, quantity, suffixes) in &self.quantities {
                let values = match (&at, quantity) {
                    (Some(at), _) => self.show(*quantity, scene, (start, hit), at),
                    (None, Quantity::Motion) => self.sky_motion(start),
                    (None, _) => [0.0; 3],
                };
                estimates.extra.extend_from_slice(&values[..suffixes.len()]);
            }
        }
    }
}

impl<C: ColorModel> Aov<C> {
    /// The quantity's channels at a point; those that it does not have are 0.
    fn show(
        &self,
        quantity: Quantity,
        scene: &Scene<C>,
        (start, hit): (&Start<C>, &Hit),
        at: &Interaction<'_>,
    ) -> [f32; 3] {
        match quantity {
            Quantity::Albedo => {
                let mut row = vec![0.0; scene.color().channels().len()];
                let albedo = scene.material(at).albedo(at, &start.wavelengths);
                scene
                    .color()
                    .develop(start.pass, &albedo, &start.wavelengths, &mut row);
                [row[0], row[1], row[2]]
            }
            Quantity::Depth => [at.t, 0.0, 0.0],
            Quantity::DpDu => at.dp_du.to_array(),
            Quantity::DpDv => at.dp_dv.to_array(),
            Quantity::DuvDx => self.duv(start, at, 0),
            Quantity::DuvDy => self.duv(start, at, 1),
            Quantity::GeoNormal => at.normal.to_array(),
            Quantity::Motion => self.motion(scene, hit, at),
            Quantity::Position => at.position.to_array(),
            Quantity::PrimIndex => [at.primitive as f32, 0.0, 0.0],
            Quantity::ShapeIndex => [(at.shape + 1) as f32, 0.0, 0.0],
            Quantity::ShNormal => at.frame.n.to_array(),
            Quantity::Uv => [at.uv.x, at.uv.y, 0.0],
        }
    }

    /// How far what was hit is displaced over the film, in pixels.
    fn motion(&self, scene: &Scene<C>, hit: &Hit, at: &Interaction<'_>) -> [f32; 3] {
        let motion = self.footprint.as_ref().map_or(Vec2::ZERO, |footprint| {
            footprint.motion(|time| scene.tracer().position_at(hit, at, time))
        });
        [motion.x, motion.y, 0.0]
    }

    /// How far what lies infinitely far is displaced over the film, in pixels.
    fn sky_motion(&self, start: &Start<C>) -> [f32; 3] {
        let motion = self.footprint.as_ref().map_or(Vec2::ZERO, |footprint| {
            footprint.sky_motion(start.ray.direction)
        });
        [motion.x, motion.y, 0.0]
    }

    /// How texture coordinates change along an axis of the film.
    fn duv(&self, start: &Start<C>, at: &Interaction<'_>, axis: usize) -> [f32; 3] {
        let footprint = self.footprint.as_ref();
        let duv = footprint.map_or(Vec2::ZERO, |f| f.duv(&start.ray, at)[axis]);
        [duv.x, duv.y, 0.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_properties_names_every_kind() {
        let named: Vec<&str> = KINDS.split([' ', ',', ';']).collect();
        for (kind, ..) in QUANTITIES {
            assert!(named.contains(kind), "{kind}");
        }
    }
}
