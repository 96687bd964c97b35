//! From a description and its loaded shapes to a scene: materials and lights are made from their properties,
//! and all that is wrong is gathered before any of it is reported.

use std::collections::{HashMap, HashSet};

use super::assets::{MAX_SHAPES, Member};
use super::choice::{Choice, Power};
use super::{Assets, Boundary, LightId, MaterialId, MediumId, Scene, Surfacing};
use crate::accel::{Recipe, Tracer};
use crate::color::ColorModel;
use crate::description::{Description, Kind, NodeId, Properties, Value};
use crate::error::{Error, Problems, Result};
use crate::light::{self, Light, LightContext};
use crate::material::Material;
use crate::medium::Medium;
use crate::shape::{self, Geometry};
use crate::texture::Palettes;

/// The lights that stand on a shape.
const AREA: [&str; 2] = ["area", "directionalarea"];
/// What the media of a shape are called.
const INTERIOR: &str = "interior";
const EXTERIOR: &str = "exterior";

/// What is made while a scene is built.
struct Builder<'d, C: ColorModel> {
    description: &'d Description,
    palettes: Palettes<C>,
    materials: Vec<Material<C>>,
    /// The materials that were made already, by node.
    known: HashMap<NodeId, MaterialId>,
    lights: Vec<Light<C>>,
    /// By light: its `sampling_weight`.
    weights: Vec<f64>,
    /// The lights that stand on shapes, by node.
    worn: HashSet<NodeId>,
    ambients: Vec<Light<C>>,
    media: Vec<Medium<C>>,
    /// The media that were made already, by node.
    known_media: HashMap<NodeId, MediumId>,
    problems: Problems,
}

impl<C: ColorModel> Builder<'_, C> {
    fn add_material(&mut self, material: Material<C>) -> MaterialId {
        self.materials.push(material);
        MaterialId(self.materials.len() as u32 - 1)
    }

    fn material(&mut self, properties: &Properties<'_>) -> Option<MaterialId> {
        if let Some(id) = self.known.get(&properties.node_id()) {
            return Some(*id);
        }
        let material = self
            .problems
            .take(Material::build(properties, &self.palettes))?;
        let id = self.add_material(material);
        self.known.insert(properties.node_id(), id);
        Some(id)
    }

    fn medium(&mut self, properties: &Properties<'_>) -> Option<MediumId> {
        if let Some(id) = self.known_media.get(&properties.node_id()) {
            return Some(*id);
        }
        let medium = Medium::build(properties, &self.palettes);
        self.media.push(self.problems.take(medium)?);
        let id = MediumId(self.media.len() as u32 - 1);
        self.known_media.insert(properties.node_id(), id);
        Some(id)
    }

    /// The media on both sides of a shape's surface, if it has any.
    fn boundary(&mut self, shape: &Properties<'_>) -> Option<Boundary> {
        let mut sides = [INTERIOR, EXTERIOR].map(|name| {
            let medium = self.problems.take(shape.object(name)).flatten()?;
            (medium.kind() == Kind::Medium).then_some(medium)
        });
        let [interior, exterior] = &mut sides;
        if interior.is_none() && exterior.is_none() {
            return None;
        }
        Some(Boundary {
            interior: interior.take().and_then(|medium| self.medium(&medium)),
            exterior: exterior.take().and_then(|medium| self.medium(&medium)),
        })
    }

    /// Adds a light, which stands on a shape or on none, and says where it is if it is somewhere.
    fn light(&mut self, properties: &Properties<'_>, stands: Option<&Member>) -> Option<LightId> {
        let context = LightContext {
            palettes: &self.palettes,
            shape: stands.map(|member| &member.geometry),
            motion: stands.and_then(|member| member.motion.as_ref()),
        };
        let light = self.problems.take(Light::build(properties, &context))?;
        if light.is_ambient() {
            self.ambients.push(light);
            return None;
        }
        let weight = self.problems.take(light::sampling_weight(properties))?;
        self.lights.push(light);
        self.weights.push(weight);
        Some(LightId(self.lights.len() as u32 - 1))
    }

    /// That the shape has the attributes that textures in `user` look for.
    fn check_attributes(
        &mut self,
        shape: &Properties<'_>,
        geometry: &Geometry,
        user: &Properties<'_>,
    ) {
        let mesh = geometry.mesh();
        let has = |name: &str| mesh.is_some_and(|m| m.attributes.iter().any(|a| a.name == name));
        if let (Kind::Texture, "mesh_attribute") = (user.kind(), user.plugin())
            && let Some(Value::String(name)) = self.description.get(user.node_id(), "name")
            && !has(name)
        {
            let attributes = mesh.map_or(&[][..], |m| &m.attributes);
            let names: Vec<&str> = attributes.iter().map(|a| a.name.as_str()).collect();
            let error = user.error("name", format!("the shape has no attribute {name:?}"));
            let error = error.suggest(name, names.iter().copied());
            self.problems.push(
                if names.is_empty() {
                    error
                } else {
                    error.help(format!("it has {}", names.join(", ")))
                }
                .related(shape.location(), "this shape"),
            );
        }
        for property in user.all() {
            if let Value::Object(id) = property.value {
                self.check_attributes(shape, geometry, &self.description.node(id));
            }
        }
    }

    fn surfacing(&mut self, member: &Member) -> Option<Surfacing> {
        let Member { geometry, .. } = member;
        let properties = &self.description.node(member.node);
        let emitter = self
            .problems
            .take(properties.child(Kind::Emitter))
            .flatten();
        let own = self.problems.take(properties.child(Kind::Bsdf)).flatten();
        let bsdf = own.or_else(|| Some(self.description.node(member.bsdf?)));
        let displacement = properties.children(Kind::Texture);
        for user in emitter.into_iter().chain(bsdf).chain(displacement) {
            self.check_attributes(properties, geometry, &user);
        }
        // What is not known is for the lights' family to name.
        let known = |emitter: &Properties<'_>| Light::<C>::NAMES.contains(&emitter.plugin());
        let light = match &emitter {
            Some(emitter) if !AREA.contains(&emitter.plugin()) && known(emitter) => {
                let error = Error::input(format!(
                    "emitter \"{}\" cannot stand on a shape",
                    emitter.plugin()
                ));
                self.problems.push(
                    error
                        .at(emitter.location())
                        .help("only \"area\" and \"directionalarea\" can"),
                );
                None
            }
            Some(emitter) if geometry.area().is_infinite() => {
                let plugin = properties.plugin();
                let error = match **geometry {
                    Geometry::Plane(_) => {
                        Error::input(format!("a {plugin} has no end, and cannot be a light"))
                            .help("let a large rectangle emit")
                    }
                    _ => Error::input(format!("a {plugin} cannot be a light"))
                        .help("let a mesh emit"),
                };
                self.problems.push(error.at(emitter.location()));
                None
            }
            Some(emitter) if matches!(**geometry, Geometry::Deforming(_)) => {
                let error = Error::unsupported("a mesh that deforms cannot be a light");
                self.problems.push(
                    error
                        .at(emitter.location())
                        .help("let a mesh emit that keeps its shape; it may move"),
                );
                None
            }
            Some(emitter) => {
                self.worn.insert(emitter.node_id());
                self.light(emitter, Some(member))
            }
            None => None,
        };
        let material = match bsdf {
            Some(bsdf) => self.material(&bsdf)?,
            None => self.add_material(Material::default_of_shape(
                &self.palettes,
                emitter.is_some(),
            )),
        };
        let shape = self.problems.take(shape::declared(properties))?;
        let boundary = self.boundary(&shape);
        Some(Surfacing {
            material,
            light,
            boundary,
        })
    }
}

/// Builds the materials of a scene's shapes for nothing but their problems, where the shapes themselves
/// cannot be loaded.
pub fn check_materials<C: ColorModel>(description: &Description, color: C) -> Result<()> {
    let palettes = Palettes::new(color);
    let mut problems = Problems::default();
    let mut seen = HashSet::new();
    let mut shapes = description.root().children(Kind::Shape);
    while let Some(shape) = shapes.pop() {
        if !seen.insert(shape.node_id()) {
            continue;
        }
        shapes.extend(shape.children(Kind::Shape));
        for bsdf in shape.children(Kind::Bsdf) {
            if seen.insert(bsdf.node_id()) {
                problems.take(Material::<C>::build(&bsdf, &palettes));
            }
        }
    }
    problems.finish()
}

/// The names of a scene's [`Scene::lights`] in their order: a light's id, or its shape's, or its number where it
/// has none or another light has the name.
pub fn light_names(description: &Description) -> Vec<String> {
    let root = description.root();
    let mut names = LightNames::default();
    for shape in root.children(Kind::Shape) {
        names.visit(&shape);
    }
    for light in root.children(Kind::Emitter) {
        if light.plugin() != "ambient" && !AREA.contains(&light.plugin()) {
            names.add(light.id());
        }
    }
    names.names
}

#[derive(Default)]
struct LightNames {
    names: Vec<String>,
    taken: HashSet<String>,
    /// Shapes in groups.
    visited: usize,
}

impl LightNames {
    /// In the order in which [`Assets::load`] flattens groups, and no further than it does.
    fn visit(&mut self, shape: &Properties<'_>) {
        for light in shape.children(Kind::Emitter) {
            self.add(light.id().or(shape.id()));
        }
        if [shape::NODE, shape::MERGE].contains(&shape.plugin()) {
            for child in shape.children(Kind::Shape) {
                self.visited += 1;
                if self.visited > MAX_SHAPES {
                    return;
                }
                self.visit(&child);
            }
        }
    }

    fn add(&mut self, id: Option<&str>) {
        let number = self.names.len().to_string();
        let free = id.filter(|id| !self.taken.contains(*id));
        let name = free.map_or(number, str::to_owned);
        self.taken.insert(name.clone());
        self.names.push(name);
    }
}

/// Builds the scene that `description` holds, with its geometry loaded.
pub fn build<C: ColorModel>(
    description: &Description,
    assets: &Assets,
    color: C,
    recipe: impl Into<Recipe>,
) -> Result<Scene<C>> {
    let mut builder = Builder {
        description,
        palettes: Palettes::new(color.clone()),
        materials: Vec::new(),
        known: HashMap::new(),
        lights: Vec::new(),
        weights: Vec::new(),
        worn: HashSet::new(),
        ambients: Vec::new(),
        media: Vec::new(),
        known_media: HashMap::new(),
        problems: Problems::default(),
    };
    let root = description.root();
    let mut surfacing = Vec::with_capacity(assets.shapes.len());
    for member in &assets.shapes {
        surfacing.extend(builder.surfacing(member));
    }
    let mut environment: Option<(LightId, Properties<'_>)> = None;
    for emitter in root.children(Kind::Emitter) {
        // It is the light of the shapes that refer to it.
        if AREA.contains(&emitter.plugin()) {
            if !builder.worn.contains(&emitter.node_id()) {
                let warning =
                    emitter.error("", "no shape refers to this light, which lights nothing");
                builder
                    .palettes
                    .colors
                    .warn(warning.help("nest it in a <shape>"));
            }
            continue;
        }
        let Some(id) = builder.light(&emitter, None) else {
            continue;
        };
        if !builder.lights[id.0 as usize].is_environment() {
            continue;
        }
        if let Some((_, first)) = &environment {
            let error = Error::input("a scene can have one environment, and this is a second");
            builder.problems.push(
                error
                    .at(emitter.location())
                    .related(first.location(), "the first"),
            );
        }
        environment = Some((id, emitter));
    }
    for sensor in root.children(Kind::Sensor) {
        for medium in sensor.children(Kind::Medium) {
            builder.medium(&medium);
        }
    }
    builder.problems.finish()?;
    let warnings = builder.palettes.warnings();
    let has_mipmaps = builder.palettes.have_mipmaps();
    let Builder {
        materials,
        lights,
        weights,
        ambients,
        media,
        known_media,
        ..
    } = builder;
    let has_passages = materials.iter().any(|material| material.passes());
    let tracer = Tracer::new(
        assets.shapes.iter().map(|s| s.geometry.clone()).collect(),
        &assets.shapes.iter().map(|s| s.group).collect::<Vec<_>>(),
        assets.instances.clone(),
        recipe,
    );
    let chosen = |power: Power<C>| Choice::new(&lights, &weights, power, &color, tracer.bounds());
    let (choice, departures) = (
        chosen(|light, color, radius| light.power(color, radius)),
        chosen(|light, color, radius| light.emitted_power(color, radius)),
    );
    Ok(Scene {
        color,
        tracer,
        materials,
        lights,
        choice,
        departures,
        ambients,
        environment: environment.map(|(id, _)| id),
        media,
        known_media,
        surfacing,
        has_passages,
        has_mipmaps,
        warnings,
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::accel::Method;
    use crate::color::Rgb;
    use crate::description::Options;

    #[test]
    fn a_texture_that_looks_for_an_attribute_its_shape_lacks_is_an_error_that_names_both() {
        let text = r#"<scene version="3.0.0"><shape type="cube"><bsdf type="twosided"><bsdf type="diffuse">
            <texture name="reflectance" type="mesh_attribute"><string name="name" value="face_color"/></texture>
            </bsdf></bsdf></shape></scene>"#;
        let scene = Description::parse(text, Path::new("test.xml"), &Options::default()).unwrap();
        let assets = Assets::load(&scene, None, None, &|| ()).unwrap();
        let error = build(&scene, &assets, Rgb, Method::Tree)
            .unwrap_err()
            .to_string();
        assert!(error.starts_with("test.xml:2"), "{error}");
        assert!(error.contains("no attribute \"face_color\""), "{error}");
    }

    #[test]
    fn lights_are_named_in_their_order_those_of_groups_where_the_groups_stand() {
        let lamp = |id: &str| format!("<shape type='disk'{id}><emitter type='area'/></shape>");
        let text = format!(
            "<scene version='3.0.0'><emitter type='point' id='last'/>{}
            <shape type='group'>{}<shape type='group'>{}</shape></shape>{}</scene>",
            lamp(" id='first'"),
            lamp(" id='nested'"),
            lamp(""),
            lamp(" id='after'")
        );
        let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
        let names = light_names(&scene);
        assert_eq!(names, ["first", "nested", "2", "after", "last"]);
        let assets = Assets::load(&scene, None, None, &|| ()).unwrap();
        let built = build(&scene, &assets, Rgb, Method::Tree).unwrap();
        assert_eq!(built.lights().len(), names.len());
    }

    #[test]
    fn an_area_light_at_the_top_is_that_of_the_shape_that_refers_to_it() {
        let light = "<emitter type='area' id='l'><rgb name='radiance' value='2'/></emitter>";
        for (shape, lights) in [
            (
                "<shape type='sphere' id='s'><ref id='l'/></shape>",
                vec!["l"],
            ),
            (
                "<shape type='sphere'><ref name='emitter' id='l'/></shape>",
                vec!["l"],
            ),
            ("<shape type='sphere'/>", vec![]),
        ] {
            let text = format!("<scene version='3.0.0'>{light}{shape}</scene>");
            let scene =
                Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
            assert_eq!(light_names(&scene), lights);
            let assets = Assets::load(&scene, None, None, &|| ()).unwrap();
            let built = build(&scene, &assets, Rgb, Method::Tree).unwrap();
            assert_eq!(built.lights().len(), lights.len());
            assert_eq!(built.warnings().is_empty(), !lights.is_empty());
        }
    }
}
