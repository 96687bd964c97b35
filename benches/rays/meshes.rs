//! What is traced: meshes from `../shared/data/meshes` where they are present, and generated ones.

use std::path::Path;
use std::sync::Arc;

use clap::ValueEnum;
use etendue::budget::Budget;
use etendue::mesh::{self, Mesh, ReadOptions};
use etendue::shape::{Geometry, TriangleMesh};
use glam::Vec3;

/// A mesh, or the test of watertightness.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Named {
    /// 69 k triangles
    Bunny,
    /// 871 k triangles
    Dragon,
    /// 3.5 M triangles
    Crown,
    /// 2 M triangles, generated
    Hair,
    /// 10 M triangles, generated
    Terrain,
    /// 2 M segments of curves, generated
    Strands,
    /// Rays at the vertices and edges of a closed surface: who misses it?
    Watertight,
}

impl Named {
    /// In the order of the report.
    pub(crate) const ALL: [Self; 7] = [
        Self::Bunny,
        Self::Dragon,
        Self::Crown,
        Self::Hair,
        Self::Terrain,
        Self::Strands,
        Self::Watertight,
    ];

    /// As on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Bunny => "bunny",
            Self::Dragon => "dragon",
            Self::Crown => "crown",
            Self::Hair => "hair",
            Self::Terrain => "terrain",
            Self::Strands => "strands",
            Self::Watertight => "watertight",
        }
    }
}

/// The mesh; `None`, and a line that says so, where its file is not here.
pub(crate) fn load(name: Named) -> Result<Option<Arc<Geometry>>, String> {
    let mesh = match name {
        Named::Bunny => read("stanford-bunny.obj")?,
        Named::Dragon => read("dragon.ply")?,
        Named::Crown => read("crown.ply")?,
        Named::Hair => Some(mesh::hair(2_000_000, 1)),
        Named::Terrain => Some(mesh::terrain(10_000_000, 1)),
        Named::Watertight => Some(mesh::bumpy_sphere(7, 1)),
        Named::Strands => None, // no mesh
    };
    if mesh.is_none() {
        println!(
            "\n{}: its file is not in ../shared/data/meshes",
            name.name()
        );
    }
    Ok(mesh.map(geometry))
}

fn read(file: &str) -> Result<Option<Mesh>, String> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/meshes");
    let path = Path::new(folder).join(file);
    if !path.exists() {
        return Ok(None);
    }
    let loaded = mesh::read(&path, &ReadOptions::default(), &Budget::default())
        .map_err(|e| e.to_string())?;
    Ok(Some(loaded.mesh))
}

/// Positions and triangles alone, with a spare vertex at the end: Embree reads 16 bytes at each.
fn geometry(mesh: Mesh) -> Arc<Geometry> {
    let mut positions = mesh.positions;
    positions.push(Vec3::ZERO);
    let bare = Mesh {
        positions,
        triangles: mesh.triangles,
        ..Mesh::default()
    };
    Arc::new(Geometry::Mesh(TriangleMesh::new(bare)))
}

/// The triangles of what [`load`] gave.
pub(crate) fn triangles(geometry: &Geometry) -> &Mesh {
    geometry.mesh().expect("only meshes are loaded")
}
