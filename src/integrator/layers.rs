//! Layers: what an image is the sum of. `layers` lists what it is taken apart by, `terms` or `lights` or
//! both, and each part becomes channels of its own: `ambient`, then by terms `diffuse`, `emission` and
//! `specular`, by lights `light.NAME`, and by both `light.NAME.diffuse` and so on, each with `.R`, `.G`, `.B`.
//! What a mirror or a glass shows belongs to the layer that it would belong to if seen directly.

use std::collections::HashMap;

use crate::description::Properties;
use crate::error::Result;

/// The terms of an equation of light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Term {
    Diffuse,
    Emission,
    Specular,
}

const TERMS: [&str; 3] = ["diffuse", "emission", "specular"];
const LISTED: [&str; 2] = ["terms", "lights"];

/// What the image is taken apart by.
#[derive(Clone, Debug, Default)]
pub(super) struct Layers {
    terms: bool,
    lights: Option<Lights>,
}

#[derive(Clone, Debug)]
struct Lights {
    /// No two alike.
    names: Vec<String>,
    /// Which name each of the scene's lights has; lights of one id share a layer.
    of_light: Vec<usize>,
}

impl Lights {
    fn new(lights: &[String]) -> Self {
        let (mut known, mut names) = (HashMap::new(), Vec::new());
        let of_light = lights.iter().map(|name| {
            *known.entry(name).or_insert_with(|| {
                names.push(name.clone());
                names.len() - 1
            })
        });
        Self {
            of_light: of_light.collect(),
            names,
        }
    }
}

impl Layers {
    /// The property `layers`, for a scene with lights of these names.
    pub(super) fn build(properties: &Properties<'_>, lights: &[String]) -> Result<Self> {
        let mut layers = Self::default();
        let listed = properties.string("layers")?;
        for name in listed.split(',').map(str::trim).filter(|n| !n.is_empty()) {
            match name {
                "terms" => layers.terms = true,
                "lights" => layers.lights = Some(Lights::new(lights)),
                other => {
                    let message = format!("an image has no layers by {other:?}");
                    let error = properties.error("layers", message).suggest(other, LISTED);
                    return Err(error.help("there are \"terms\" and \"lights\""));
                }
            }
        }
        Ok(layers)
    }

    /// The layers' names, without their channels.
    pub(super) fn names(&self) -> Vec<String> {
        let lights: Option<Vec<String>> = self.lights.as_ref().map(|lights| {
            let names = lights.names.iter();
            names.map(|name| format!("light.{name}")).collect()
        });
        let mut names = match lights {
            Some(lights) if self.terms => {
                let terms = |light: &String| TERMS.map(|term| format!("{light}.{term}"));
                lights.iter().flat_map(terms).collect()
            }
            Some(lights) => lights,
            None if self.terms => TERMS.map(String::from).to_vec(),
            None => return Vec::new(),
        };
        names.insert(0, "ambient".to_owned());
        names
    }

    /// Where ambient light goes, if anywhere.
    pub(super) fn ambient(&self) -> Option<usize> {
        (self.terms || self.lights.is_some()).then_some(0)
    }

    /// Where a term of the light with that index goes, if anywhere.
    pub(super) fn place(&self, term: Term, light: usize) -> Option<usize> {
        let term = term as usize;
        match &self.lights {
            Some(lights) if self.terms => Some(1 + lights.of_light[light] * TERMS.len() + term),
            Some(lights) => Some(1 + lights.of_light[light]),
            None => self.terms.then_some(1 + term),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_is_the_layer_of_its_name() {
        let lights = ["key", "1", "key"].map(String::from);
        for (terms, by_light) in [(true, false), (false, true), (true, true)] {
            let layers = Layers {
                terms,
                lights: by_light.then(|| Lights::new(&lights)),
            };
            let names = layers.names();
            assert_eq!(names[layers.ambient().unwrap()], "ambient");
            for (term, name) in [
                (Term::Diffuse, "diffuse"),
                (Term::Emission, "emission"),
                (Term::Specular, "specular"),
            ] {
                for (i, light) in lights.iter().enumerate() {
                    let expected = match (terms, by_light) {
                        (true, true) => format!("light.{light}.{name}"),
                        (true, false) => name.to_owned(),
                        _ => format!("light.{light}"),
                    };
                    assert_eq!(names[layers.place(term, i).unwrap()], expected);
                }
            }
        }
        assert!(Layers::default().names().is_empty());
        assert_eq!(Layers::default().place(Term::Diffuse, 0), None);
    }
}
