//! From a description to a scene: shapes are loaded in parallel, materials and lights made from their
//! properties, and all that is wrong is gathered before any of it is reported.

use std::collections::HashMap;
use std::sync::Arc;

use rayon::prelude::*;

use super::{LightId, MaterialId, Scene, Surfacing};
use crate::accel::{Method, Tracer};
use crate::color::ColorModel;
use crate::description::{Description, Kind, NodeId, Properties};
use crate::error::{Error, Problem, Problems, Result};
use crate::light::{Light, LightContext};
use crate::material::Material;
use crate::shape::{self, Geometry, Shape};
use crate::texture::Palettes;

/// The geometry of a scene, loaded: it does not depend on colour, sensor or film.
#[derive(Debug)]
pub struct Assets {
    /// Each shape's node, in file order.
    nodes: Vec<NodeId>,
    /// Each shape's geometry in world space.
    geometry: Vec<Arc<Geometry>>,
    warnings: Vec<Problem>,
}

impl Assets {
    /// Loads the shapes of a scene, several at once; `loaded` is called after each.
    pub fn load(description: &Description, loaded: &(impl Fn() + Sync)) -> Result<Self> {
        let shapes = description.root().children(Kind::Shape);
        let results: Vec<Result<Shape>> = shapes
            .par_iter()
            .map(|properties| {
                let shape = shape::build(properties);
                loaded();
                shape
            })
            .collect();
        let mut problems = Problems::default();
        let (mut geometry, mut warnings) = (Vec::with_capacity(shapes.len()), Vec::new());
        for shape in results.into_iter().filter_map(|r| problems.take(r)) {
            geometry.push(Arc::new(shape.geometry));
            warnings.extend(shape.warnings);
        }
        problems.finish()?;
        Ok(Self {
            nodes: shapes.iter().map(Properties::node_id).collect(),
            geometry,
            warnings,
        })
    }

    /// What the user should know of the files.
    pub fn warnings(&self) -> &[Problem] {
        &self.warnings
    }

    /// Triangles and other primitives.
    pub fn primitive_count(&self) -> u64 {
        self.geometry
            .iter()
            .map(|g| u64::from(g.primitive_count()))
            .sum()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.geometry.iter().map(|g| g.bytes()).sum()
    }
}

/// What is made while a scene is built.
struct Builder<C: ColorModel> {
    palettes: Palettes<C>,
    materials: Vec<Material<C>>,
    /// The materials that were made already, by node.
    known: HashMap<NodeId, MaterialId>,
    lights: Vec<Light<C>>,
    problems: Problems,
}

impl<C: ColorModel> Builder<C> {
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

    fn light(
        &mut self,
        properties: &Properties<'_>,
        shape: Option<&Arc<Geometry>>,
    ) -> Option<LightId> {
        let context = LightContext {
            palettes: &self.palettes,
            shape,
        };
        let light = self.problems.take(Light::build(properties, &context))?;
        self.lights.push(light);
        Some(LightId(self.lights.len() as u32 - 1))
    }

    /// At most one nested plugin of a kind.
    fn single<'a>(&mut self, properties: &Properties<'a>, kind: Kind) -> Option<Properties<'a>> {
        let children = properties.children(kind);
        if let Some(second) = children.get(1) {
            let error = Error::input(format!(
                "{} \"{}\" has a second {kind}",
                properties.kind(),
                properties.plugin()
            ));
            self.problems.push(
                error
                    .at(second.location())
                    .related(children[0].location(), "the first"),
            );
        }
        children.first().copied()
    }

    fn surfacing(
        &mut self,
        properties: &Properties<'_>,
        geometry: &Arc<Geometry>,
    ) -> Option<Surfacing> {
        let emitter = self.single(properties, Kind::Emitter);
        let bsdf = self.single(properties, Kind::Bsdf);
        let light = match &emitter {
            Some(emitter) if emitter.plugin() != "area" => {
                let error = Error::input(format!(
                    "emitter \"{}\" cannot stand on a shape",
                    emitter.plugin()
                ));
                self.problems
                    .push(error.at(emitter.location()).help("only \"area\" can"));
                None
            }
            Some(emitter) => self.light(emitter, Some(geometry)),
            None => None,
        };
        let material = match bsdf {
            Some(bsdf) => self.material(&bsdf)?,
            None => self.add_material(Material::default_of_shape(
                &self.palettes,
                emitter.is_some(),
            )),
        };
        Some(Surfacing { material, light })
    }
}

/// Builds the scene that `description` holds, with its geometry loaded.
pub fn build<C: ColorModel>(
    description: &Description,
    assets: &Assets,
    color: C,
    method: Method,
) -> Result<Scene<C>> {
    let mut builder = Builder {
        palettes: Palettes::new(color.clone()),
        materials: Vec::new(),
        known: HashMap::new(),
        lights: Vec::new(),
        problems: Problems::default(),
    };
    let root = description.root();
    let mut surfacing = Vec::with_capacity(assets.nodes.len());
    for (node, geometry) in assets.nodes.iter().zip(&assets.geometry) {
        surfacing.extend(builder.surfacing(&description.node(*node), geometry));
    }
    let mut environment: Option<(LightId, Properties<'_>)> = None;
    for emitter in root.children(Kind::Emitter) {
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
    builder.problems.finish()?;
    let Builder {
        materials, lights, ..
    } = builder;
    let tracer = Tracer::new(
        assets.geometry.clone(),
        &vec![0; surfacing.len()],
        Vec::new(),
        method,
    );
    Ok(Scene {
        color,
        tracer,
        materials,
        lights,
        environment: environment.map(|(id, _)| id),
        surfacing,
    })
}
