//! Shapes that are built in parallel, each of their files read once: those that are made of one file in one way
//! share what was read, and differ in where they stand.

use std::borrow::Cow;
use std::collections::HashMap;

use rayon::prelude::*;

use crate::description::Properties;
use crate::error::Result;
use crate::mesh::{Loaded, MeshFile, ReadMesh, read};
use crate::shape::{self, Setting, Shape};

/// A shape that is to be built.
#[derive(Clone, Copy)]
pub(super) struct Site<'a> {
    pub(super) properties: &'a Properties<'a>,
    pub(super) setting: Setting<'a>,
}

/// Shapes that share a file, or one that needs none.
struct Task {
    /// Places among the sites.
    sites: Vec<usize>,
    file: Option<MeshFile>,
    /// What is in the file, if that is known.
    read: Option<Loaded>,
}

/// The shapes at `sites`, in this order; `built` is called with the place of each. What is in the file of `given` is
/// not read again.
pub(super) fn build(
    sites: &[Site<'_>],
    given: Option<ReadMesh>,
    built: &(impl Fn(usize) + Sync),
) -> Vec<Result<Shape>> {
    let mut tasks: Vec<Task> = Vec::new();
    let mut known: HashMap<MeshFile, usize> = HashMap::new();
    for (site, Site { properties, .. }) in sites.iter().enumerate() {
        let file = shape::mesh_file(properties).map(resolved);
        let task = match &file {
            Some(file) => *known.entry(file.clone()).or_insert(tasks.len()),
            None => tasks.len(),
        };
        if task == tasks.len() {
            tasks.push(Task {
                sites: Vec::new(),
                file,
                read: None,
            });
        }
        tasks[task].sites.push(site);
    }
    if let Some(ReadMesh { file, loaded }) = given
        && let Some(task) = known.get(&resolved(file))
    {
        tasks[*task].read = Some(loaded);
    }
    let shapes = tasks.into_par_iter().flat_map_iter(|task| {
        let places = task.sites.clone();
        places.into_iter().zip(task.run(sites, built))
    });
    let mut shapes: Vec<(usize, Result<Shape>)> = shapes.collect();
    shapes.sort_unstable_by_key(|(site, _)| *site);
    shapes.into_iter().map(|(_, shape)| shape).collect()
}

/// The same file under the one name that it has, whatever the way to it.
fn resolved(file: MeshFile) -> MeshFile {
    MeshFile {
        path: file.path.canonicalize().unwrap_or(file.path),
        ..file
    }
}

impl Task {
    /// The shapes, in the order of their sites.
    fn run(self, sites: &[Site<'_>], built: &(impl Fn(usize) + Sync)) -> Vec<Result<Shape>> {
        let done = |site: usize, shape: Result<Shape>| {
            built(site);
            shape
        };
        let loaded = match (self.read, self.file) {
            (None, Some(file)) if self.sites.len() > 1 => {
                let budget = sites[self.sites[0]].properties.budget();
                read(&file.path, &file.options, budget).ok()
            }
            (read, _) => read,
        };
        let Some(loaded) = loaded else {
            // Nobody to share with, or nothing to share: each says what is wrong with the file in its own place.
            let build = |&site: &usize| {
                let Site {
                    properties,
                    setting,
                } = &sites[site];
                done(site, shape::build_within(setting, properties))
            };
            return self.sites.par_iter().map(build).collect();
        };
        let place = |site: usize, loaded: Cow<'_, Loaded>| {
            let Site {
                properties,
                setting,
            } = &sites[site];
            done(site, shape::build_from(loaded, setting, properties))
        };
        let (last, others) = self.sites.split_last().expect("a task has sites");
        let copied = |&site: &usize| {
            let properties = sites[site].properties;
            let taken = (properties.budget()).take(shape::room_of(&loaded, properties));
            match taken {
                Ok(()) => place(site, Cow::Borrowed(&loaded)),
                Err(error) => done(site, Err(error.at(properties.location()))),
            }
        };
        let others = others.par_iter().map(copied);
        let mut shapes: Vec<Result<Shape>> = others.collect();
        shapes.push(place(*last, Cow::Owned(loaded)));
        shapes
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::description::{Description, Kind, Options};
    use crate::shape::Placement;

    const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

    const SHAPES: &str = r#"<scene version="3.0.0">
        <shape type="ply"><string name="filename" value="a.ply"/></shape>
        <shape type="sphere"/>
        <shape type="ply"><string name="filename" value="b.ply"/></shape>
        <shape type="ply"><string name="filename" value="x/../a.ply"/>
            <transform name="to_world"><scale value="2"/></transform></shape>
        <shape type="ply"><string name="filename" value="a.ply"/><boolean name="flip_normals" value="true"/></shape>
        <shape type="ply"><string name="filename" value="b.ply"/></shape></scene>"#;

    /// What [`build`] makes of the shapes where this stands in `b.ply`.
    fn built(b: &str) -> Vec<Result<Shape>> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("x")).unwrap();
        std::fs::write(folder.path().join("a.ply"), PLY).unwrap();
        std::fs::write(folder.path().join("b.ply"), b).unwrap();
        let path = folder.path().join("scene.xml");
        let scene = Description::parse(SHAPES, &path, &Options::default()).unwrap();
        let shapes = scene.root().children(Kind::Shape);
        let place = |properties| Placement::of(&shape::declared(properties).unwrap());
        let places: Vec<_> = shapes.iter().map(|p| place(p).unwrap().first).collect();
        let site = |(properties, to_world): (_, &_)| Site {
            properties,
            setting: Setting {
                to_world: *to_world,
                cache: None,
            },
        };
        let sites: Vec<Site<'_>> = shapes.iter().zip(&places).map(site).collect();
        let count = AtomicUsize::new(0);
        let shared = build(&sites, None, &|place| {
            assert!(place < sites.len());
            count.fetch_add(1, Ordering::Relaxed);
        });
        assert_eq!(count.into_inner(), sites.len());
        for (shape, properties) in shared.iter().zip(&shapes) {
            let alone = shape::build(properties);
            assert_eq!(format!("{shape:?}"), format!("{alone:?}"));
        }
        shared
    }

    #[test]
    fn shapes_of_one_file_are_those_that_are_built_by_themselves() {
        assert!(built(PLY).iter().all(Result::is_ok));
    }

    #[test]
    fn what_is_wrong_with_a_file_is_told_wherever_it_is_named() {
        let wrong = built("ply\nformat binary 7\n");
        let wrong = wrong.iter().map(Result::is_err);
        assert!(wrong.eq([false, false, true, false, false, true]));
    }
}
