//! The geometry of a scene, loaded in parallel. A `shapegroup` holds shapes in a space of their own, seen only
//! where an `instance` refers to it, through the instance's `to_world`; their materials are the group's, and
//! none of them emits light, as in Mitsuba.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DMat4;
use rayon::prelude::*;

use crate::accel::Instance;
use crate::description::{Description, Kind, NodeId, Properties};
use crate::error::{Error, Problem, Problems, Result};
use crate::math::Transform;
use crate::shape::{self, Geometry, Shape};

/// The geometry of a scene, loaded: it does not depend on colour, sensor or film.
#[derive(Debug)]
pub struct Assets {
    /// In file order.
    pub(super) shapes: Vec<Member>,
    pub(super) instances: Vec<Instance>,
    warnings: Vec<Problem>,
}

/// A shape with its place.
#[derive(Debug)]
pub(super) struct Member {
    pub(super) node: NodeId,
    /// 0 for the world.
    pub(super) group: u32,
    /// In its group's space.
    pub(super) geometry: Arc<Geometry>,
}

impl Assets {
    /// Loads the shapes of a scene, several at once; `loaded` is called after each that stands in the
    /// scene itself.
    pub fn load(description: &Description, loaded: &(impl Fn() + Sync)) -> Result<Self> {
        let mut plan = Plan::default();
        for properties in description.root().children(Kind::Shape) {
            let placed = plan.place(&properties);
            if plan.problems.take(placed) == Some(Placed::Elsewhere) {
                loaded();
            }
        }
        let Plan {
            shapes,
            instances,
            mut problems,
            ..
        } = plan;
        let results: Vec<Result<Shape>> = shapes
            .par_iter()
            .map(|(properties, group)| {
                let shape = shape::build(properties);
                if *group == 0 {
                    loaded();
                }
                shape
            })
            .collect();
        let mut warnings: Vec<Problem> = media(&shapes).into_iter().collect();
        let mut members = Vec::with_capacity(shapes.len());
        for ((properties, group), result) in shapes.iter().zip(results) {
            if let Some(shape) = problems.take(result) {
                warnings.extend(shape.warnings);
                members.push(Member {
                    node: properties.node_id(),
                    group: *group,
                    geometry: Arc::new(shape.geometry),
                });
            }
        }
        problems.finish()?;
        Ok(Self {
            shapes: members,
            instances,
            warnings,
        })
    }

    /// What the user should know of the files.
    pub fn warnings(&self) -> &[Problem] {
        &self.warnings
    }

    /// Triangles and other primitives.
    pub fn primitive_count(&self) -> u64 {
        let count = |s: &Member| u64::from(s.geometry.primitive_count());
        self.shapes.iter().map(count).sum()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.shapes.iter().map(|s| s.geometry.bytes()).sum()
    }
}

/// The warning for participating media, which shapes may enclose and Étendue does not render.
fn media(shapes: &[(Properties<'_>, u32)]) -> Option<Problem> {
    let media: Vec<_> = shapes
        .iter()
        .flat_map(|(shape, _)| shape.children(Kind::Medium))
        .collect();
    let message = format!(
        "participating media are not rendered: {} shapes count as empty",
        media.len()
    );
    let warning = Error::unsupported(message).at(media.first()?.location());
    warning.problems().first().cloned()
}

/// What is to be loaded.
#[derive(Default)]
struct Plan<'a> {
    /// Each with its group.
    shapes: Vec<(Properties<'a>, u32)>,
    /// The groups' numbers, from 1.
    groups: HashMap<NodeId, u32>,
    instances: Vec<Instance>,
    problems: Problems,
}

/// Where a shape of the scene went.
#[derive(PartialEq)]
enum Placed {
    /// Among the shapes of the world.
    World,
    /// It is a group or an instance.
    Elsewhere,
}

impl<'a> Plan<'a> {
    fn place(&mut self, properties: &Properties<'a>) -> Result<Placed> {
        match properties.plugin() {
            shape::GROUP => {
                self.group(properties);
            }
            shape::INSTANCE => self.instance(properties)?,
            _ => {
                self.shapes.push((*properties, 0));
                return Ok(Placed::World);
            }
        }
        Ok(Placed::Elsewhere)
    }

    /// The group's number.
    fn group(&mut self, properties: &Properties<'a>) -> u32 {
        if let Some(group) = self.groups.get(&properties.node_id()) {
            return *group;
        }
        let group = self.groups.len() as u32 + 1;
        self.groups.insert(properties.node_id(), group);
        for shape in properties.children(Kind::Shape) {
            if let shape::GROUP | shape::INSTANCE = shape.plugin() {
                let message = format!("a shapegroup cannot hold a shape {:?}", shape.plugin());
                let error = Error::input(message).at(shape.location());
                self.problems
                    .push(error.related(properties.location(), "the group"));
                continue;
            }
            for emitter in shape.children(Kind::Emitter) {
                let error = Error::input("a shape of a shapegroup cannot emit light");
                self.problems.push(error.at(emitter.location()));
            }
            self.shapes.push((shape, group));
        }
        group
    }

    fn instance(&mut self, properties: &Properties<'a>) -> Result<()> {
        let children = properties.children(Kind::Shape);
        let [group] = children[..] else {
            let message = format!(
                "an instance is of one shapegroup, and not of {}",
                children.len()
            );
            return Err(properties
                .error("", message)
                .help(r#"refer to a shapegroup by <ref id="…"/>"#));
        };
        if group.plugin() != shape::GROUP {
            let message = format!(
                "an instance is of a shapegroup, and not of a {}",
                group.plugin()
            );
            return Err(properties
                .error("", message)
                .related(group.location(), "this"));
        }
        let matrix = properties.transform("to_world")?.unwrap_or(DMat4::IDENTITY);
        let to_world = Transform::new(&matrix).ok_or_else(|| {
            properties.error("to_world", "the transform must be affine and invertible")
        })?;
        let group = self.group(&group);
        self.instances.push(Instance { to_world, group });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::description::Options;

    fn load(text: &str) -> Result<Assets> {
        let text = format!(r#"<scene version="3.0.0">{text}</scene>"#);
        let scene = Description::parse(&text, Path::new("test.xml"), &Options::default())?;
        let assets = Assets::load(&scene, &|| ())?;
        assert_eq!(scene.unread(), []);
        Ok(assets)
    }

    #[test]
    fn a_group_is_loaded_once_however_often_and_wherever_it_is_seen() {
        let assets = load(
            r#"<shape type="instance"><ref id="late"/></shape>
               <shape type="sphere"/>
               <shape type="shapegroup" id="late"><shape type="cube"/><shape type="disk"/></shape>
               <shape type="instance"><ref id="late"/>
                   <transform name="to_world"><translate x="3"/></transform></shape>
               <shape type="instance"><shape type="shapegroup"><shape type="disk"/></shape></shape>"#,
        )
        .unwrap();
        let groups: Vec<u32> = assets.shapes.iter().map(|s| s.group).collect();
        assert_eq!(groups, [1, 1, 0, 2]);
        let of: Vec<u32> = assets.instances.iter().map(|i| i.group).collect();
        assert_eq!(of, [1, 1, 2]);
        assert_eq!(assets.instances[1].to_world.translation().x, 3.0);
        assert_eq!(assets.primitive_count(), 12 + 1 + 1 + 1);
    }

    #[test]
    fn groups_in_groups_lights_in_groups_and_instances_of_something_else_are_refused() {
        for (text, message) in [
            (
                r#"<shape type="shapegroup"><shape type="shapegroup"/></shape>"#,
                "cannot hold",
            ),
            (
                r#"<shape type="shapegroup"><shape type="disk"><emitter type="area"/></shape></shape>"#,
                "cannot emit",
            ),
            (r#"<shape type="instance"/>"#, "one shapegroup"),
            (
                r#"<shape type="instance"><shape type="cube"/></shape>"#,
                "not of a cube",
            ),
        ] {
            let error = load(text).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
    }
}
