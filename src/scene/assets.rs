//! The geometry of a scene, loaded in parallel. A `shapegroup` holds shapes in a space of their own, seen only
//! where an `instance` refers to it, through the instance's `to_world`; their materials are the group's, and
//! none of them emits light, as in Mitsuba.
//!
//! A `group`, Étendue's own, is a node of a scene graph: it holds shapes, instances and groups, which stand under its
//! `to_world` (a node's matrix is its parent's times its own), and of which those without a material have the group's.
//! The graph is flattened here: a shape is loaded for each path that leads to it, in world space.
//!
//! What moves is a group of its own with one instance, whose transform has a time: a shape by itself, the shapes of a
//! node together. A mesh that deforms is such a group too, whether it moves or not.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DMat4;

use super::files::{self, Site};
use crate::accel::Instance;
use crate::description::{Description, Kind, NodeId, Properties};
use crate::error::{Error, Problem, Problems, Result};
use crate::math::Moving;
use crate::math::moving::Unscaled;
use crate::mesh::ReadMesh;
use crate::shape::{self, Geometry, Placement, Setting};

/// The geometry of a scene, loaded: it does not depend on colour, sensor or film.
#[derive(Debug)]
pub struct Assets {
    /// In file order.
    pub(super) shapes: Vec<Member>,
    pub(super) instances: Vec<Instance>,
    pub(super) warnings: Vec<Problem>,
    files: Vec<PathBuf>,
}

/// A shape with its place.
#[derive(Debug)]
pub(super) struct Member {
    pub(super) node: NodeId,
    /// 0 for the world.
    pub(super) group: u32,
    /// The material that it has from a group around it, unless it has its own.
    pub(super) bsdf: Option<NodeId>,
    /// From its group's space to the world, where it moves.
    pub(super) motion: Option<Moving>,
    /// In its group's space.
    pub(super) geometry: Arc<Geometry>,
}

impl Assets {
    /// Loads the shapes of a scene, several at once; `loaded` is called after each that stands in the
    /// scene itself. The mesh that is `given` is not read again, and what takes long to compute is kept in the folder
    /// `cache`.
    pub fn load(
        description: &Description,
        given: Option<ReadMesh>,
        cache: Option<&Path>,
        loaded: &(impl Fn() + Sync),
    ) -> Result<Self> {
        let mut plan = Plan::default();
        for properties in description.root().children(Kind::Shape) {
            let placed = plan.place(properties, &Space::WORLD);
            plan.problems.take(placed);
            let last = plan.shapes.last().map(|shape| shape.properties.node_id());
            if last != Some(properties.node_id()) {
                loaded(); // it is a group or an instance
            }
        }
        let Plan {
            shapes,
            instances,
            mut problems,
            mut warnings,
            ..
        } = plan;
        let sites = shapes.iter().map(|planned| Site {
            properties: &planned.properties,
            setting: Setting {
                to_world: planned.space.outer,
                cache,
            },
        });
        let sites: Vec<Site<'_>> = sites.collect();
        let results = files::build(&sites, given, &|place| {
            if shapes[place].space.top {
                loaded();
            }
        });
        let mut members = Vec::with_capacity(shapes.len());
        let mut files = BTreeSet::new();
        for (Planned { properties, space }, result) in shapes.iter().zip(results) {
            if let Some(shape) = problems.take(result) {
                warnings.extend(shape.warnings);
                files.extend(shape.files);
                members.push(Member {
                    node: properties.node_id(),
                    group: space.group,
                    bsdf: space.bsdf,
                    motion: space.motion.clone(),
                    geometry: Arc::new(shape.geometry),
                });
            }
        }
        problems.finish()?;
        Ok(Self {
            shapes: members,
            instances,
            warnings,
            files: files.into_iter().collect(),
        })
    }

    /// What the user should know of the files.
    pub fn warnings(&self) -> &[Problem] {
        &self.warnings
    }

    /// The files that were read, or tried, because files of the scene name them; sorted.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Triangles and other primitives.
    pub fn primitive_count(&self) -> u64 {
        let count = |s: &Member| u64::from(s.geometry.primitive_count());
        self.shapes.iter().map(count).sum()
    }

    /// How many instances there are.
    pub fn instance_count(&self) -> u64 {
        self.instances.len() as u64
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let shapes: usize = self.shapes.iter().map(|s| s.geometry.bytes()).sum();
        shapes + self.instances.len() * size_of::<Instance>()
    }
}

/// A shape that is to be loaded.
struct Planned<'a> {
    properties: Properties<'a>,
    space: Space<'a>,
}

/// Where a shape stands, or what is in a group.
#[derive(Clone)]
struct Space<'a> {
    /// The `shapegroup`, if it is in one.
    shapegroup: Option<Properties<'a>>,
    /// The number of the `shapegroup`, or of what moves together; 0 for the world.
    group: u32,
    /// From the space of what moves to the world.
    motion: Option<Moving>,
    /// The product of the transforms of the groups around it, the outermost first, and its own, as far as they stand still.
    outer: DMat4,
    /// The material of the nearest of those groups that has one.
    bsdf: Option<NodeId>,
    /// Whether it stands in the scene itself, and in no group.
    top: bool,
}

/// The most shapes that all groups may stand for.
pub(super) const MAX_SHAPES: usize = 1 << 20;

/// What is to be loaded.
#[derive(Default)]
struct Plan<'a> {
    shapes: Vec<Planned<'a>>,
    /// The shapegroups' numbers, from 1.
    groups: HashMap<NodeId, u32>,
    /// How many groups there are, with those of what moves.
    group_count: u32,
    instances: Vec<Instance>,
    /// How many shapes were met in groups, each as often as it is referred to.
    met: usize,
    problems: Problems,
    warnings: Vec<Problem>,
}

impl<'a> Plan<'a> {
    /// Notes what a shape stands for in its space.
    fn place(&mut self, properties: Properties<'a>, space: &Space<'a>) -> Result<()> {
        self.met += usize::from(!space.top);
        if self.met > MAX_SHAPES {
            let message = format!("groups stand for more than {MAX_SHAPES} shapes");
            return Err(properties
                .error("", message)
                .help("place copies as instances of a shapegroup"));
        }
        let properties = shape::declared(&properties)?;
        let plugin = properties.plugin();
        if let (Some(group), shape::GROUP | shape::INSTANCE) = (space.shapegroup, plugin) {
            let message = format!("a shapegroup cannot hold a shape {plugin:?}");
            let error = Error::input(message).at(properties.location());
            return Err(error.related(group.location(), "the group"));
        }
        match plugin {
            shape::GROUP => {
                self.shapegroup(properties);
                Ok(())
            }
            shape::INSTANCE => self.instance(&properties, space),
            shape::NODE => self.node(&properties, space),
            shape::MERGE => {
                let inner = Space {
                    top: false,
                    ..space.clone()
                };
                for child in properties.children(Kind::Shape) {
                    self.place(child, &inner)?;
                }
                Ok(())
            }
            _ => {
                if space.shapegroup.is_some() {
                    for emitter in properties.children(Kind::Emitter) {
                        let error = Error::input("a shape of a shapegroup cannot emit light");
                        self.problems.push(error.at(emitter.location()));
                    }
                }
                let space = self.inside(&properties, space)?;
                self.shapes.push(Planned { properties, space });
                Ok(())
            }
        }
    }

    /// Notes the shapes of a node of the scene graph. Nodes are not nested without end.
    fn node(&mut self, properties: &Properties<'a>, space: &Space<'a>) -> Result<()> {
        let bsdf = properties.child(Kind::Bsdf)?;
        let mut inner = self.inside(properties, space)?;
        inner.bsdf = bsdf.map(|bsdf| bsdf.node_id()).or(space.bsdf);
        inner.top = false;
        for child in properties.children(Kind::Shape) {
            self.place(child, &inner)?;
        }
        Ok(())
    }

    /// The space inside a shape or a node that stands in `space`. What moves or deforms is a group of its own.
    fn inside(&mut self, properties: &Properties<'a>, space: &Space<'a>) -> Result<Space<'a>> {
        let own = Placement::of(properties)?;
        let still = Space {
            outer: space.outer * own.first,
            ..space.clone()
        };
        if own.moving.is_none() && !shape::deforms(properties) {
            return Ok(still);
        }
        if let Some(group) = space.shapegroup {
            let message = "what is in a shapegroup cannot move by itself, nor deform";
            return Err(properties
                .error("to_world", message)
                .help("animate the instance, or a shape that is in no shapegroup")
                .related(group.location(), "the group"));
        }
        self.group_count += 1;
        let group = self.group_count;
        let Some(moving) = own.moving else {
            // It moves with what is around it, and has a tree of its own.
            let to_world = space.motion.clone().unwrap_or(Moving::IDENTITY);
            self.instances.push(Instance { to_world, group });
            return Ok(Space { group, ..still });
        };
        let Unscaled { scale, moving } =
            Moving::unscaled(space.motion.as_ref(), &space.outer, &moving)
                .ok_or_else(|| not_invertible(properties))?;
        self.instances.push(Instance {
            to_world: moving.clone(),
            group,
        });
        Ok(Space {
            group,
            motion: Some(moving),
            outer: scale,
            ..still
        })
    }

    /// The shapegroup's number.
    fn shapegroup(&mut self, properties: Properties<'a>) -> u32 {
        if let Some(group) = self.groups.get(&properties.node_id()) {
            return *group;
        }
        if let Ok(Some(_)) = properties.animation("to_world") {
            let message = "a shapegroup has no place of its own: this <animation> moves nothing";
            let warning = properties.error("to_world", message);
            let warning = warning.help("animate the instances of it");
            self.warnings.extend_from_slice(warning.problems());
        }
        self.group_count += 1;
        let group = self.group_count;
        self.groups.insert(properties.node_id(), group);
        let space = Space {
            shapegroup: Some(properties),
            group,
            top: false,
            ..Space::WORLD
        };
        for shape in properties.children(Kind::Shape) {
            let placed = self.place(shape, &space);
            self.problems.take(placed);
        }
        group
    }

    fn instance(&mut self, properties: &Properties<'a>, space: &Space<'a>) -> Result<()> {
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
        let own = Placement::of(properties)?;
        let between = match own.moving {
            Some(_) => space.outer,
            None => space.outer * own.first,
        };
        let to_world = Moving::product(space.motion.as_ref(), &between, own.moving.as_ref())
            .ok_or_else(|| not_invertible(properties))?;
        let group = self.shapegroup(group);
        self.instances.push(Instance { to_world, group });
        Ok(())
    }
}

fn not_invertible(properties: &Properties<'_>) -> Error {
    properties.error("to_world", "the transform must be affine and invertible")
}

impl Space<'_> {
    /// The scene itself.
    const WORLD: Self = Self {
        shapegroup: None,
        group: 0,
        motion: None,
        outer: DMat4::IDENTITY,
        bsdf: None,
        top: true,
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Options;

    fn load(text: &str) -> Result<Assets> {
        let text = format!(r#"<scene version="3.0.0">{text}</scene>"#);
        let scene = Description::parse(&text, Path::new("test.xml"), &Options::default())?;
        Assets::load(&scene, None, None, &|| ())
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
        assert_eq!(assets.instances[1].to_world.at(0.0).translation().x, 3.0);
        assert_eq!(assets.primitive_count(), 12 + 1 + 1 + 1);
    }

    #[test]
    fn a_shapegroup_that_is_to_move_is_told_to_move_its_instances() {
        let assets = load(
            r#"<shape type="instance"><ref id="g"/></shape><shape type="instance"><ref id="g"/></shape>
               <shape type="shapegroup" id="g"><shape type="disk"/><animation name="to_world">
               <transform time="0"/><transform time="1"><translate x="1"/></transform></animation></shape>"#,
        );
        let warnings = assets.unwrap().warnings;
        let [warning] = &warnings[..] else {
            panic!("{warnings:?}")
        };
        assert!(warning.to_string().contains("moves nothing"), "{warning}");
    }

    #[test]
    fn what_moves_is_built_with_the_scale_of_all_that_is_around_it() {
        let groups = [
            r#"<scale value="3"/>"#,
            r#"<rotate z="1" angle="30"/><scale value="-2"/>"#,
            // A shear: there is no scale apart.
            r#"<scale x="4" y="-1"/>"#,
        ];
        for group in groups {
            let with = |to_world: String| {
                let assets = load(&format!(
                    r#"<shape type="group"><transform name="to_world">{group}</transform>
                       <shape type="rectangle">{to_world}</shape></shape>"#
                ));
                assets.unwrap().shapes.remove(0)
            };
            let first = r#"<scale x="2"/><rotate z="1" angle="45"/><translate x="1"/>"#;
            let still = with(format!(r#"<transform name="to_world">{first}</transform>"#));
            let moves = with(format!(
                r#"<animation name="to_world"><transform time="1">{first}</transform>
                   <transform time="2"><scale value="5"/></transform></animation>"#
            ));
            let (area, expected) = (moves.geometry.area(), still.geometry.area());
            assert!((area - expected).abs() < 1e-5 * expected, "{group}: {area}");
            let at = moves.motion.unwrap().at(1.0);
            let round = at.linear().transpose() * at.linear();
            assert!(round.abs_diff_eq(glam::Mat3::IDENTITY, 1e-5), "{group}");
            assert!(at.linear().determinant() > 0.0, "{group}");
        }
    }

    #[test]
    fn a_node_s_matrix_is_its_parent_s_times_its_own_and_materials_are_inherited() {
        let assets = load(
            r#"<bsdf type="diffuse" id="outer"/><bsdf type="diffuse" id="inner"/><bsdf type="diffuse" id="own"/>
               <shape type="group"><ref id="outer"/>
                   <transform name="to_world"><scale value="2"/></transform>
                   <shape type="disk" id="disk"/>
                   <shape type="group" id="arm"><ref id="inner"/>
                       <transform name="to_world"><translate x="1"/></transform>
                       <shape type="disk"><transform name="to_world"><translate x="0.5"/></transform></shape>
                       <shape type="disk"><ref id="own"/><emitter type="area"/></shape>
                       <shape type="instance"><ref id="shared"/></shape>
                   </shape>
               </shape>
               <shape type="group"><ref id="arm"/><ref id="disk"/></shape>
               <shape type="shapegroup" id="shared"><shape type="group">
                   <transform name="to_world"><translate x="7"/></transform><shape type="disk"/></shape></shape>"#,
        )
        .unwrap();
        let places: Vec<(u32, f32, f64)> = (assets.shapes.iter())
            .map(|s| {
                let bounds = s.geometry.bounds(0);
                let center = 0.5 * (bounds.min + bounds.max);
                let radius = (s.geometry.area() / std::f64::consts::PI).sqrt();
                (
                    s.group,
                    (center.x * 1e3).round() / 1e3,
                    (radius * 1e6).round() / 1e6,
                )
            })
            .collect();
        let expected = [
            (0, 0.0, 2.0),
            (0, 3.0, 2.0),
            (0, 2.0, 2.0),
            (1, 7.0, 1.0),
            (0, 1.5, 1.0),
            (0, 1.0, 1.0),
            (0, 0.0, 1.0),
        ];
        assert_eq!(places, expected);
        let inherited: Vec<bool> = assets.shapes.iter().map(|s| s.bsdf.is_some()).collect();
        assert_eq!(inherited, [true, true, true, false, true, true, false]);
        assert_eq!(assets.shapes[1].bsdf, assets.shapes[4].bsdf);
        assert_ne!(assets.shapes[0].bsdf, assets.shapes[1].bsdf);
        let x: Vec<f32> = (assets.instances.iter())
            .map(|i| i.to_world.at(0.0).translation().x)
            .collect();
        assert_eq!(x, [2.0, 1.0]);
    }

    #[test]
    fn nodes_that_double_at_every_reference_are_refused_in_time() {
        let mut text = r#"<shape type="group" id="n0"><shape type="disk"/></shape>"#.to_owned();
        for i in 1..40 {
            let child = format!(r#"<ref id="n{}"/>"#, i - 1);
            text += &format!(r#"<shape type="group" id="n{i}">{child}{child}</shape>"#);
        }
        let error = load(&text).unwrap_err().to_string();
        assert!(error.contains("groups stand for more than"), "{error}");
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
            (
                r#"<shape type="shapegroup"><shape type="group"><shape type="instance"/></shape></shape>"#,
                "cannot hold",
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
