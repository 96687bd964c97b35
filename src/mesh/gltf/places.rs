//! Where a node's mesh stands: in the node's place, or by EXT_mesh_gpu_instancing in several that are relative to it.

use glam::DMat4;

use super::OrWhy;
use super::accessor::Accessors;
use super::json::Instancing;
use super::stage::{Placed, placement};
use crate::mesh::Mesh;

/// The places of a node's mesh.
pub(super) struct Places {
    to_world: DMat4,
    /// `None`: the one place of the node.
    instances: Option<Instances>,
}

/// Each list as long as `count`, where it is there.
struct Instances {
    count: usize,
    translations: Option<Vec<[f32; 3]>>,
    rotations: Option<Vec<[f32; 4]>>,
    scales: Option<Vec<[f32; 3]>>,
}

impl Places {
    pub(super) fn of(placed: &Placed<'_>, accessors: &Accessors<'_>) -> OrWhy<Self> {
        let instancing = placed.node.extensions.instancing.as_ref();
        let instances = instancing.map(|i| Instances::read(i, accessors));
        Ok(Self {
            to_world: placed.to_world,
            instances: instances.transpose()?,
        })
    }

    pub(super) fn len(&self) -> usize {
        self.instances.as_ref().map_or(1, |i| i.count)
    }

    /// From the mesh's space to the world.
    fn get(&self, place: usize) -> DMat4 {
        match &self.instances {
            Some(instances) => self.to_world * instances.get(place),
            None => self.to_world,
        }
    }

    /// The mesh in all of its places. Where they mirror it, its winding turns.
    pub(super) fn put(&self, mesh: Mesh) -> Mesh {
        let put = |mut mesh: Mesh, place: usize| {
            let to_world = self.get(place);
            mesh.transform(&to_world);
            if to_world.determinant() < 0.0 {
                mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            }
            mesh
        };
        let Some(last) = self.len().checked_sub(1) else {
            return Mesh::default();
        };
        let mut all = Mesh::default();
        for place in 0..last {
            all.append(put(mesh.clone(), place));
        }
        all.append(put(mesh, last));
        all
    }
}

impl Instances {
    fn read(instancing: &Instancing, accessors: &Accessors<'_>) -> OrWhy<Self> {
        let attribute = |name: &str| instancing.attributes.get(name).copied();
        let vectors = |name: &str| attribute(name).map(|a| accessors.rows(a)).transpose();
        let translations = vectors("TRANSLATION")?;
        let scales = vectors("SCALE")?;
        let rotations = attribute("ROTATION").map(|a| accessors.rows(a));
        let rotations = rotations.transpose()?;
        let counts = [
            translations.as_ref().map(Vec::len),
            rotations.as_ref().map(Vec::len),
            scales.as_ref().map(Vec::len),
        ];
        let mut counts = counts.into_iter().flatten();
        let count = counts.next().unwrap_or(0);
        if counts.any(|other| other != count) {
            let why = "the instances of a node have translations, rotations and scales of different counts";
            return Err(why.to_owned());
        }
        Ok(Self {
            count,
            translations,
            rotations,
            scales,
        })
    }

    fn get(&self, place: usize) -> DMat4 {
        placement(
            self.translations.as_ref().map(|t| t[place].map(f64::from)),
            self.rotations.as_ref().map(|r| r[place].map(f64::from)),
            self.scales.as_ref().map(|s| s[place].map(f64::from)),
        )
    }
}
