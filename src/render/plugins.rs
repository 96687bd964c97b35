//! Every plugin that a scene can name, with what it declares; and what a scene says that no plugin declares. This
//! needs nothing to be built, so that it is told along with everything else that is wrong.

use std::collections::{HashMap, HashSet};

use crate::color::Rgb;
use crate::description::declared::{
    Plugin, Plugins, Row, Standing, boolean, float, integer, nested,
};
use crate::description::properties::STRICT;
use crate::description::{Description, Kind, NodeId, Properties, Property, Value};
use crate::error::{Error, Problem};
use crate::family::is_mitsubas;
use crate::filter::Filter;
use crate::integrator::Integrator;
use crate::light::Light;
use crate::material::Material;
use crate::medium::Medium;
use crate::phase::Phase;
use crate::sampler::Sampler;
use crate::sensor::{FILMS, Sensor};
use crate::shape;
use crate::texture::Texture;
use crate::texture::volume::Volume;

/// A plugin that a scene can name.
#[derive(Clone, Copy, Debug)]
pub struct Listed {
    /// Its tag.
    pub kind: Kind,
    /// Its `type`.
    pub name: &'static str,
    /// What it declares.
    pub plugin: &'static Plugin,
    /// Whether Mitsuba lacks it.
    pub own: bool,
}

/// The scene itself. What it holds for others to refer to has no effect by itself.
static SCENE: Plugin = Plugin {
    about: "what is rendered",
    properties: &[&[
        nested(Kind::Integrator, "how light is found"),
        nested(Kind::Sensor, "where it is seen from"),
        nested(Kind::Shape, "what is there"),
        nested(Kind::Emitter, "what gives light"),
        nested(Kind::Bsdf, "to be referred to").without_effect(),
        nested(Kind::Texture, "to be referred to").without_effect(),
        nested(Kind::Spectrum, "to be referred to").without_effect(),
        nested(Kind::Film, "to be referred to").without_effect(),
        nested(Kind::Filter, "to be referred to").without_effect(),
        nested(Kind::Sampler, "to be referred to").without_effect(),
        nested(Kind::Medium, "to be referred to").without_effect(),
        nested(Kind::Phase, "to be referred to").without_effect(),
        nested(Kind::Volume, "to be referred to").without_effect(),
        integer("kd_stop_prims", 3, TREE).without_effect(),
        integer("kd_max_depth", 0, TREE).without_effect(),
        integer("kd_min_max_bins", 128, TREE).without_effect(),
        boolean("kd_clip", true, TREE).without_effect(),
        boolean("kd_retract_bad_splits", true, TREE).without_effect(),
        integer("kd_exact_primitive_threshold", 65536, TREE).without_effect(),
        float("kd_intersection_cost", 20.0, TREE).without_effect(),
        float("kd_traversal_cost", 15.0, TREE).without_effect(),
        float("kd_empty_space_bonus", 0.9, TREE).without_effect(),
        boolean("embree_use_robust_intersections", false, TREE).without_effect(),
        boolean("allow_thread_reordering", true, TREE).without_effect(),
        boolean("compact_acceleration_structures", true, TREE).without_effect(),
    ]],
};

/// What Mitsuba's settings of its trees are about.
const TREE: &str = "how Mitsuba finds what a ray meets";

/// Every plugin, by kind and name; the scene itself comes first.
pub fn plugins() -> Vec<Listed> {
    let listed = |kind| {
        move |(name, plugin): (&'static str, &'static Plugin)| Listed {
            kind,
            name,
            plugin,
            own: kind != Kind::Scene && !is_mitsubas(kind, name),
        }
    };
    let families: [(Kind, Plugins); 11] = [
        (Kind::Integrator, Integrator::<Rgb>::PLUGINS),
        (Kind::Sensor, Sensor::PLUGINS),
        (Kind::Film, FILMS),
        (Kind::Filter, Filter::PLUGINS),
        (Kind::Sampler, Sampler::PLUGINS),
        (Kind::Bsdf, Material::<Rgb>::PLUGINS),
        (Kind::Texture, Texture::<Rgb>::PLUGINS),
        (Kind::Emitter, Light::<Rgb>::PLUGINS),
        (Kind::Medium, Medium::<Rgb>::PLUGINS),
        (Kind::Phase, Phase::PLUGINS),
        (Kind::Volume, Volume::<Rgb>::PLUGINS),
    ];
    let mut all = vec![listed(Kind::Scene)(("scene", &SCENE))];
    for (kind, plugins) in families {
        all.extend(plugins.iter().copied().map(listed(kind)));
    }
    all.extend(shape::plugins().map(listed(Kind::Shape)));
    all
}

/// What is wrong with a scene's properties, and what is worth knowing of them.
#[derive(Debug, Default)]
pub(super) struct Findings {
    /// Properties and nested plugins that nobody declares; in a strict scene, Étendue's own too.
    pub(super) problems: Vec<Problem>,
    /// The note that some plugins serve nobody.
    pub(super) notes: Vec<Problem>,
}

/// Holds what a scene says against what its plugins declare. What serves nobody is not looked at, and a plugin
/// that is not known is for its family to name.
pub(super) fn examine(description: &Description) -> Findings {
    let listed = plugins().into_iter().map(|p| ((p.kind, p.name), p.plugin));
    let tables: HashMap<(Kind, &str), &'static Plugin> = listed.collect();
    let table = |node: &Properties<'_>| {
        // Either tag serves both.
        let kind = match node.kind() {
            Kind::Spectrum => Kind::Texture,
            kind => kind,
        };
        tables.get(&(kind, node.plugin())).copied()
    };
    let root = description.root();
    let mut met = HashSet::from([root.node_id()]);
    let mut waiting = vec![root.node_id()];
    let mut findings = Findings::default();
    let mut problems: Vec<(NodeId, Error)> = Vec::new();
    while let Some(id) = waiting.pop() {
        let node = description.node(id);
        let Some(plugin) = table(&node) else {
            continue;
        };
        for property in node.all() {
            let child = match property.value {
                Value::Object(child) => Some(description.node(child)),
                _ => None,
            };
            let nested = match property.value {
                Value::Spectrum(_) => plugin.nested(Kind::Spectrum),
                _ => child.and_then(|child| plugin.nested(child.kind())),
            };
            let Some(row) = plugin.row(&property.name).or(nested) else {
                problems.push((id, undeclared(&node, plugin, property, child.as_ref())));
                continue;
            };
            if row.standing == Standing::Own
                && description.root().is_strict()
                && is_mitsubas(node.kind(), node.plugin())
            {
                problems.push((id, of_our_own(&node, row, property)));
            }
            // What is at the top of the scene for others waits for them.
            let serves = id != root.node_id() || row.standing == Standing::Common;
            if let Some(child) = child.filter(|_| serves)
                && met.insert(child.node_id())
            {
                waiting.push(child.node_id());
            }
        }
    }
    problems.sort_by_key(|(id, _)| *id);
    for (_, error) in problems {
        findings.problems.extend_from_slice(error.problems());
    }
    findings.notes.extend(idle(description, &met));
    findings
}

fn undeclared(
    node: &Properties<'_>,
    plugin: &'static Plugin,
    property: &Property,
    child: Option<&Properties<'_>>,
) -> Error {
    let (kind, name) = (node.kind(), property.name.as_str());
    let error = match child {
        Some(child) if name.is_empty() => Error::input(format!(
            "{kind} {:?} has no use for the {} {:?}",
            node.plugin(),
            child.kind(),
            child.plugin()
        )),
        _ => {
            let names = plugin.rows().map(|row| row.name);
            let message = format!("{kind} {:?} has no property {name:?}", node.plugin());
            Error::input(message).suggest(name, names.filter(|name| !name.is_empty()))
        }
    };
    error.at(&property.location)
}

fn of_our_own(node: &Properties<'_>, row: &Row, property: &Property) -> Error {
    let message = format!(
        "property {:?} of {} {:?} is Étendue's own",
        row.name,
        node.kind(),
        node.plugin()
    );
    Error::input(message).at(&property.location).help(STRICT)
}

/// The note that there are plugins at the top of the scene that serve nobody.
fn idle(description: &Description, met: &HashSet<NodeId>) -> Option<Problem> {
    let root = description.root();
    let objects = root
        .all()
        .iter()
        .filter_map(|property| match property.value {
            Value::Object(id) => Some(id),
            _ => None,
        });
    let mut idle: Vec<NodeId> = objects.filter(|id| !met.contains(id)).collect();
    idle.sort_unstable();
    let first = description.node(*idle.first()?);
    let what = format!("{} {:?}", first.kind(), first.plugin());
    let message = match idle.len() {
        1 => format!("nothing refers to the {what}"),
        n => format!(
            "nothing refers to the {what}, nor to {} other objects",
            n - 1
        ),
    };
    let note = Error::input(message).at(first.location());
    note.problems().first().cloned()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::description::Options;
    use crate::description::declared::{Preset, Takes};

    fn scene(text: &str, strict: bool) -> Findings {
        let text = format!("<scene version='3.0.0'>{text}</scene>");
        let options = Options {
            strict,
            ..Options::default()
        };
        examine(&Description::parse(&text, Path::new("test.xml"), &options).unwrap())
    }

    fn told(problems: &[Problem]) -> Vec<String> {
        problems.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn what_nobody_declares_is_told_in_file_order_with_the_name_that_was_meant() {
        let Findings { problems, notes } = scene(
            "<shape type='sphere'><float name='raduis' value='1'/><sampler type='independent'/>
             <bsdf type='diffuse'><float name='reflectence' value='1'/></bsdf></shape>
             <float name='kd_max_deph' value='1'/><shape type='spher'><float name='x' value='1'/></shape>",
            false,
        );
        let problems = told(&problems);
        assert_eq!(problems.len(), 4, "{problems:?}");
        assert!(
            problems[0].contains("no property \"kd_max_deph\"; did you mean \"kd_max_depth\"?")
        );
        assert!(problems[1].contains("no property \"raduis\"; did you mean \"radius\"?"));
        assert!(problems[2].contains("no use for the sampler \"independent\""));
        assert!(problems[3].contains("did you mean \"reflectance\"?"));
        assert!(notes.is_empty());
    }

    #[test]
    fn what_serves_nobody_is_noted_and_what_is_referred_to_is_looked_at() {
        let Findings { problems, notes } = scene(
            "<bsdf type='diffuse' id='a'><float name='wrong' value='1'/></bsdf>
             <bsdf type='diffuse' id='b'><float name='worse' value='1'/></bsdf>
             <texture type='bitmap'/>
             <shape type='sphere'><ref id='b'/></shape>",
            false,
        );
        let (problems, notes) = (told(&problems), told(&notes));
        assert_eq!(problems.len(), 1, "{problems:?}");
        assert!(problems[0].contains("worse"));
        assert_eq!(notes.len(), 1);
        assert!(
            notes[0].ends_with("nothing refers to the bsdf \"diffuse\", nor to 1 other objects")
        );
    }

    #[test]
    fn a_strict_scene_has_nothing_of_our_own() {
        let text = "<shape type='cylinder'><boolean name='caps' value='true'/><float name='displacement' value='1'/></shape>";
        assert!(scene(text, false).problems.is_empty());
        let problems = told(&scene(text, true).problems);
        assert_eq!(problems.len(), 2);
        assert!(problems[0].contains("\"caps\" of shape \"cylinder\" is Étendue's own"));
    }

    #[test]
    fn every_row_stands_once_has_a_meaning_and_a_preset_that_it_can_have() {
        for Listed {
            kind, name, plugin, ..
        } in plugins()
        {
            assert!(!plugin.about.is_empty(), "{kind} {name}");
            let mut names = HashSet::new();
            for row in plugin.rows() {
                let place = format!("{kind} {name}: {} {}", row.name, row.takes);
                let unnamed = matches!(row.takes, Takes::Nested(_));
                assert!(names.insert((row.name, row.takes.to_string())), "{place}");
                assert_eq!(row.name.is_empty(), unnamed, "{place}");
                assert!(!row.about.is_empty(), "{place}");
                match row.preset {
                    Preset::Float(x) => assert!(row.range.contains(x), "{place}"),
                    Preset::Integer(i) => assert!(row.range.contains(i as f64), "{place}"),
                    _ => {}
                }
            }
        }
    }

    /// A property as a scene writes it, with a value that it can have.
    fn written(row: &Row, name: &str) -> String {
        let tagged = |tag: &str, value: &str| format!("<{tag} name='{name}' value='{value}'/>");
        let least = row.range.least.max(1.0).min(row.range.most);
        let number = match row.preset {
            Preset::Float(x) if row.range.contains(x) && x != 0.0 => x,
            _ => least,
        };
        match row.takes {
            Takes::Boolean => tagged("boolean", "true"),
            Takes::Integer => tagged(
                "integer",
                &format!("{}", least.max(2.0).min(row.range.most)),
            ),
            Takes::Float
            | Takes::Color
            | Takes::Texture
            | Takes::Volume
            | Takes::Number
            | Takes::Substance
            | Takes::Index => match (row.takes, name) {
                (Takes::Color, "color") => tagged("rgb", "0.5"),
                (_, "wavelength_max") => tagged("float", "700"),
                _ => tagged("float", &number.to_string()),
            },
            Takes::Choice(choices) => tagged("string", choices[choices.len() - 1]),
            Takes::String => tagged(
                "string",
                match name {
                    "name" => "face_color",
                    "aovs" => "a:depth",
                    "layers" => "terms",
                    "focal_length" => "35mm",
                    "b" | "c" => "0.5, 0.01",
                    "wavelengths" => "400, 500",
                    "uv" => "0 0 1 0 0 1",
                    "material" => "Au",
                    _ => "0.1, 0.2",
                },
            ),
            Takes::File => tagged("string", "FILE"),
            Takes::Vector => match name {
                "p1" | "n1" => tagged("vector", "1, 0, 0.5"),
                "p2" | "n2" => tagged("vector", "0, 1, 0.5"),
                _ => tagged("vector", "0, 0, -0.5"),
            },
            Takes::Transform | Takes::Motion => {
                format!("<transform name='{name}'><translate x='1'/></transform>")
            }
            Takes::Map => format!("<texture name='{name}' type='checkerboard'/>"),
            Takes::Nested(_) | Takes::Medium => String::new(),
        }
    }

    /// What a plugin cannot do without, beside what its table says.
    fn filling(kind: Kind, name: &str) -> &'static str {
        match (kind, name) {
            (Kind::Bsdf, "blendbsdf") => "<bsdf type='diffuse'/><bsdf type='diffuse'/>",
            (Kind::Bsdf, "bumpmap") => "<texture type='checkerboard'/><bsdf type='diffuse'/>",
            (Kind::Bsdf, "mask" | "normalmap" | "twosided") => "<bsdf type='diffuse'/>",
            (Kind::Shape, "instance") => "<shape type='shapegroup'><shape type='sphere'/></shape>",
            (Kind::Shape, "group" | "shapegroup") => "<shape type='sphere'/>",
            (Kind::Integrator, "moment") => "<integrator type='path'/>",
            (Kind::Phase, "blendphase") => "<phase type='hg'/><phase type='hg'/>",
            (Kind::Sensor, "batch") => "<sensor type='perspective'/>",
            (Kind::Film, "specfilm") => "<spectrum name='red' value='550:0, 600:1, 650:0'/>",
            _ => "",
        }
    }

    /// The plugin in a scene around it.
    fn around(kind: Kind, plugin: &str) -> String {
        let sensor = |inside: &str| format!("<sensor type='perspective'>{inside}</sensor>");
        match kind {
            Kind::Film | Kind::Sampler => sensor(plugin),
            Kind::Filter => sensor(&format!("<film type='hdrfilm'>{plugin}</film>")),
            Kind::Bsdf => format!("<shape type='sphere'>{plugin}</shape>{}", sensor("")),
            Kind::Texture => {
                let named = plugin.replacen("<texture", "<texture name='reflectance'", 1);
                let bsdf = format!("<bsdf type='diffuse'>{named}</bsdf>");
                format!(
                    "<shape type='obj'><string name='filename' value='m.obj'/><boolean name='materials' value='true'/>{bsdf}</shape>{}",
                    sensor("")
                )
            }
            Kind::Emitter if plugin.contains("area'") => {
                format!("<shape type='sphere'>{plugin}</shape>{}", sensor(""))
            }
            Kind::Sensor if plugin.contains("'irradiancemeter'") => {
                format!("<shape type='sphere'>{plugin}</shape>")
            }
            Kind::Medium => {
                let named = plugin.replacen("<medium", "<medium name='interior'", 1);
                format!("<shape type='sphere'>{named}</shape>{}", sensor(""))
            }
            Kind::Phase => around(
                Kind::Medium,
                &format!("<medium type='homogeneous'>{plugin}</medium>"),
            ),
            Kind::Volume => {
                let named = plugin.replacen("<volume", "<volume name='albedo'", 1);
                around(
                    Kind::Medium,
                    &format!("<medium type='homogeneous'>{named}</medium>"),
                )
            }
            Kind::Sensor => plugin.to_owned(),
            _ => format!("{plugin}{}", sensor("")),
        }
    }

    /// Every plugin is built once for each of its rows, with that property and those that go with it.
    #[test]
    fn what_is_declared_is_read_and_what_is_read_is_declared() {
        use crate::description::properties::asked;
        use crate::render::{Session, Silent};
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("m.mtl"), "newmtl a\nKd 0.1 0.2 0.3\n").unwrap();
        let mesh = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
        std::fs::write(path("m.obj"), mesh).unwrap();
        let image = crate::image::Image::new(4, 3, ["R", "G", "B"].map(String::from).to_vec());
        crate::image::write(&path("i.exr"), &image, &Default::default()).unwrap();
        let grid = crate::image::vol::encode(&crate::image::vol::Grid {
            size: [2; 3],
            channels: 1,
            bbox: [glam::Vec3::ZERO, glam::Vec3::ONE],
            values: vec![1.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5, -0.5],
        });
        std::fs::write(path("g.vol"), grid).unwrap();
        std::fs::write(path("c.txt"), "0 0 0 1\n1 0 0 1\n2 0 0 1\n3 0 0 1\n").unwrap();
        let columns = [
            "x", "y", "z", "nx", "ny", "nz", "scale_0", "scale_1", "scale_2",
        ];
        let columns = [&columns[..], &["rot_0", "rot_1", "rot_2", "rot_3"]].concat();
        let columns: String = (columns.iter())
            .map(|name| format!("property float {name}\n"))
            .collect();
        let cloud = format!(
            "ply\nformat ascii 1.0\nelement vertex 1\n{columns}end_header\n0 0 0 0 0 0 -1 -1 -1 1 0 0 0\n"
        );
        std::fs::write(path("e.ply"), cloud).unwrap();
        let mut unread = Vec::new();
        for Listed {
            kind, name, plugin, ..
        } in plugins()
        {
            if kind == Kind::Scene {
                continue;
            }
            let read = |row: &&Row| !matches!(row.takes, Takes::Nested(_) | Takes::Medium);
            let rows = || plugin.rows().filter(read);
            for row in rows().map(Some).chain([None]) {
                let together = |other: &Row| {
                    let given = |row: &Row| row.name == other.name;
                    let pair = row.is_some_and(|row| {
                        row.name.starts_with("alpha_") && other.name.starts_with("alpha_")
                            || row.name.starts_with("displacement_") && other.name == "displacement"
                    });
                    other.preset == Preset::Required || pair || row.is_some_and(given)
                };
                let mut inside = String::new();
                for other in rows().filter(|other| together(other)) {
                    match other.name.strip_suffix('#') {
                        Some(stem) => {
                            for i in 0..3 {
                                let corner = format!("{stem}{i}");
                                inside += &written(other, &corner).replace("0.5", "0");
                            }
                        }
                        None => inside += &written(other, other.name),
                    }
                }
                let file = match name {
                    "bitmap" | "envmap" => "i.exr",
                    "gridvolume" | "sdfgrid" => "g.vol",
                    "bsplinecurve" | "linearcurve" => "c.txt",
                    "ellipsoids" | "ellipsoidsmesh" => "e.ply",
                    _ => "m.obj",
                };
                let text = format!(
                    "<{kind} type='{name}'>{}{}</{kind}>",
                    inside.replace("FILE", file),
                    filling(kind, name)
                );
                let text = format!("<scene version='3.0.0'>{}</scene>", around(kind, &text));
                let scene = Description::parse(&text, &path("s.xml"), &Options::default());
                let scene = scene.unwrap_or_else(|e| panic!("{text}: {e}"));
                // Some pairs exclude each other, and no reader of PLY takes an OBJ: what counts is what was asked.
                let _ = Session::default().check(&scene, &Default::default(), &Silent);
            }
            for row in rows().filter(|row| row.standing != Standing::WithoutEffect) {
                let name_read = row.name.replace('#', "0");
                if !row.name.ends_with('#') && !asked::for_(kind, name, &name_read) {
                    unread.push(format!("{kind} {name}: {}", row.name));
                }
            }
        }
        assert_eq!(unread, [""; 0]);
    }
}
