//! Skins: a vertex goes where the weighted mean of its joints' matrices takes it. The node that has the mesh does not
//! move it, says the specification.

use std::collections::BTreeMap;

use glam::{DMat3, DMat4, DVec3};

use super::OrWhy;
use super::accessor::Accessors;
use super::json::{Skin, at};
use crate::mesh::Mesh;

impl Skin {
    /// Takes the vertices of a mesh from its own space to the world; `attributes` are its primitive's accessors, and
    /// `world` has the matrices of the scene's nodes. Where there are no weights, all stand by the first joint.
    pub(super) fn pose(
        &self,
        mesh: &mut Mesh,
        attributes: &BTreeMap<String, usize>,
        accessors: &Accessors<'_>,
        world: &[Option<DMat4>],
    ) -> OrWhy<()> {
        let matrices = self.matrices(accessors, world)?;
        let first = matrices.first().ok_or("its skin has no joints")?;
        let sets = Influences::sets(mesh.positions.len(), attributes, accessors)?;
        for vertex in 0..mesh.positions.len() {
            let (mut sum, mut total) = (DMat4::ZERO, 0.0);
            for Influences { joints, weights } in &sets {
                for (joint, weight) in joints[vertex].into_iter().zip(weights[vertex]) {
                    if weight > 0.0 {
                        sum += *at(&matrices, joint as usize, "joint")? * f64::from(weight);
                        total += f64::from(weight);
                    }
                }
            }
            let matrix = if total > 0.0 {
                sum * (1.0 / total)
            } else {
                *first
            };
            let position = &mut mesh.positions[vertex];
            *position = matrix.transform_point3(position.as_dvec3()).as_vec3();
            if let Some(normal) = mesh.normals.get_mut(vertex) {
                *normal = turned(normal.as_dvec3(), &matrix).as_vec3();
            }
        }
        if first.determinant() < 0.0 {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        Ok(())
    }

    /// For each joint the way from the mesh's space to the world.
    fn matrices(&self, accessors: &Accessors<'_>, world: &[Option<DMat4>]) -> OrWhy<Vec<DMat4>> {
        let inverse = match self.inverse_bind_matrices {
            Some(accessor) => accessors.rows::<16>(accessor)?,
            None => Vec::new(),
        };
        let joints = self.joints.iter().enumerate();
        let matrices = joints.map(|(i, &node)| {
            let placed = world.get(node).copied().flatten();
            let placed =
                placed.ok_or_else(|| format!("its joint, node {node}, is not in the scene"))?;
            let inverse = match inverse.get(i) {
                Some(columns) => DMat4::from_cols_array(&columns.map(f64::from)),
                None => DMat4::IDENTITY,
            };
            Ok(placed * inverse)
        });
        matrices.collect()
    }
}

/// Four joints for each vertex, with their weights.
struct Influences {
    joints: Vec<[u32; 4]>,
    weights: Vec<[f32; 4]>,
}

impl Influences {
    fn sets(
        vertices: usize,
        attributes: &BTreeMap<String, usize>,
        accessors: &Accessors<'_>,
    ) -> OrWhy<Vec<Self>> {
        let mut sets = Vec::new();
        loop {
            let of = |what: &str| attributes.get(&format!("{what}_{}", sets.len()));
            let (Some(joints), Some(weights)) = (of("JOINTS"), of("WEIGHTS")) else {
                return Ok(sets);
            };
            let joints = accessors.whole_rows(*joints)?;
            let weights = accessors.rows(*weights)?;
            let counts = [joints.len(), weights.len()];
            if counts != [vertices; 2] {
                let [joints, weights] = counts;
                return Err(format!(
                    "{joints} joints and {weights} weights for {vertices} vertices"
                ));
            }
            sets.push(Self { joints, weights });
        }
    }
}

/// A normal under a matrix: by its inverse transpose, whatever the sign.
fn turned(normal: DVec3, matrix: &DMat4) -> DVec3 {
    let DMat3 {
        x_axis: x,
        y_axis: y,
        z_axis: z,
    } = DMat3::from_mat4(*matrix);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    let side = if x.dot(y.cross(z)) < 0.0 { -1.0 } else { 1.0 };
    let turned = cofactors * normal * side;
    turned.try_normalize().unwrap_or(normal)
}
