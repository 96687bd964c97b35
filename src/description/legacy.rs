//! Names of Mitsuba 0.3 to 2 that Mitsuba 3 has no more, where the meaning is clear: tags, plugins and properties of files
//! of versions below 3.0 become today's, or are left out where they change nothing here. Each change is told; a file
//! of today's version, or one that is read strictly, must say it in today's words.

use super::{Kind, Node, Property, Value};
use crate::error::Error;

/// What a plugin was called.
const PLUGINS: &[(Kind, &str, &str)] = &[
    (Kind::Bsdf, "bump", "bumpmap"),
    (Kind::Bsdf, "lambertian", "diffuse"),
    (Kind::Film, "exrfilm", "hdrfilm"),
    (Kind::Film, "ldrfilm", "hdrfilm"),
    (Kind::Film, "pngfilm", "hdrfilm"),
    (Kind::Sampler, "halton", "independent"),
    (Kind::Sampler, "hammersley", "independent"),
    (Kind::Texture, "exrtexture", "bitmap"),
    (Kind::Texture, "ldrtexture", "bitmap"),
];

/// What became of a property.
#[derive(Clone, Copy, Debug)]
enum Fate {
    /// It has another name.
    Renamed(&'static str),
    /// It changes nothing here.
    LeftOut,
    /// It changes nothing here where it is 1.
    LeftOutIfOne,
    /// Any value but today's choices is the one given.
    Otherwise(&'static [&'static str], &'static str),
    /// The exponent 1 says that texels are plain numbers; others are the file's own curve.
    Gamma,
}

use Fate::{Gamma, LeftOut, LeftOutIfOne, Otherwise, Renamed};

const FILM: &[(&str, Fate)] = &[
    ("high_quality_edges", Renamed("sample_border")),
    ("attach_log", LeftOut),
    ("banner", LeftOut),
    ("burn", LeftOut),
    ("exposure", LeftOut),
    ("gamma", LeftOut),
    ("key", LeftOut),
    ("tonemap_method", LeftOut),
];

const SAMPLER: &[(&str, Fate)] = &[("dimension", LeftOut), ("scramble", LeftOut)];

const BITMAP: &[(&str, Fate)] = &[
    ("wrap_mode_u", Renamed("wrap_mode")),
    ("wrap_mode_v", LeftOut),
    ("cache", LeftOut),
    ("max_anisotropy", LeftOut),
    (
        "filter_type",
        Otherwise(&["bilinear", "nearest"], "bilinear"),
    ),
    ("gamma", Gamma),
];

const ENVMAP: &[(&str, Fate)] = &[("cache", LeftOut), ("gamma", LeftOut)];

const MESH: &[(&str, Fate)] = &[
    ("collapse", LeftOut),
    ("max_smooth_angle", LeftOut),
    ("srgb", LeftOut),
];

const INTEGRATOR: &[(&str, Fate)] = &[("strict_normals", LeftOut)];

const CONDUCTOR: &[(&str, Fate)] = &[("ext_eta", LeftOutIfOne)];

/// The old properties of a plugin of today's name.
fn properties(kind: Kind, plugin: &str) -> &'static [(&'static str, Fate)] {
    match (kind, plugin) {
        (Kind::Film, "hdrfilm") => FILM,
        (Kind::Sampler, _) => SAMPLER,
        (Kind::Texture, "bitmap") => BITMAP,
        (Kind::Emitter, "envmap") => ENVMAP,
        (Kind::Shape, "obj" | "ply" | "serialized") => MESH,
        (Kind::Integrator, _) => INTEGRATOR,
        (Kind::Bsdf, "conductor" | "roughconductor") => CONDUCTOR,
        _ => &[],
    }
}

/// The kind of plugin that a tag of versions 0.2 and 0.3 described.
pub(super) fn kind(tag: &str) -> Option<Kind> {
    match tag {
        "camera" => Some(Kind::Sensor),
        "luminaire" => Some(Kind::Emitter),
        _ => None,
    }
}

/// Today's name of a plugin that has another one.
pub(super) fn plugin(kind: Kind, name: &str) -> Option<&'static str> {
    let mut plugins = PLUGINS.iter();
    let (_, _, today) = plugins.find(|(k, old, _)| (*k, *old) == (kind, name))?;
    Some(today)
}

/// Brings a node's properties up to date; what was changed is returned.
pub(super) fn update(node: &mut Node) -> Vec<Error> {
    let table = properties(node.kind, &node.plugin);
    let mut told = Vec::new();
    let plugin = &node.plugin;
    node.properties.retain_mut(|property| {
        let Some((_, fate)) = table.iter().find(|(name, _)| *name == property.name) else {
            return true;
        };
        match apply(property, *fate) {
            Outcome::Same => true,
            Outcome::Changed(now) => {
                let message = format!("{now}, as older versions of {plugin:?} meant it");
                told.push(Error::input(message).at(&property.location));
                true
            }
            Outcome::Gone => {
                let message = format!(
                    "{:?} of older versions of {plugin:?} is left out",
                    property.name
                );
                told.push(Error::input(message).at(&property.location));
                false
            }
        }
    });
    told
}

enum Outcome {
    Same,
    /// What it is now.
    Changed(String),
    Gone,
}

fn apply(property: &mut Property, fate: Fate) -> Outcome {
    let number = match property.value {
        Value::Float(x) => Some(x),
        Value::Integer(i) => Some(i as f64),
        _ => None,
    };
    match fate {
        Renamed(name) => {
            let now = format!("{:?} is read as {name:?}", property.name);
            name.clone_into(&mut property.name);
            Outcome::Changed(now)
        }
        LeftOut => Outcome::Gone,
        LeftOutIfOne if number == Some(1.0) => Outcome::Gone,
        LeftOutIfOne => Outcome::Same,
        Otherwise(choices, instead) => match &mut property.value {
            Value::String(text) if !choices.contains(&text.as_str()) => {
                let now = format!("{text:?} is read as {instead:?}");
                instead.clone_into(text);
                Outcome::Changed(now)
            }
            _ => Outcome::Same,
        },
        Gamma if number == Some(1.0) => {
            let now = format!("{:?} 1 is read as \"raw\"", property.name);
            "raw".clone_into(&mut property.name);
            property.value = Value::Boolean(true);
            Outcome::Changed(now)
        }
        Gamma => Outcome::Gone,
    }
}
