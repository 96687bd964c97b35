//! The nodes of a glTF scene, with their places in the world, its first camera and its lights.

use glam::{DMat3, DMat4, DQuat, DVec3};

use super::json::{Camera, Node, Root, Scene, at};
use super::{GltfCamera, Notes, OrWhy, Projection};

/// What stands in a scene.
pub(super) struct Stage<'r> {
    /// In the order of the file, parents before their children.
    pub(super) nodes: Vec<Placed<'r>>,
    /// From the space of each node of the file to the world; `None`: not in the scene.
    pub(super) world: Vec<Option<DMat4>>,
    /// The first camera of the scene.
    pub(super) camera: Option<GltfCamera>,
    /// Lights of the file, by number, and from their spaces to the world.
    pub(super) lights: Vec<(usize, DMat4)>,
}

/// A node in its place.
pub(super) struct Placed<'r> {
    pub(super) node: &'r Node,
    pub(super) to_world: DMat4,
}

impl<'r> Stage<'r> {
    /// The default scene's nodes, or the first scene's; where there is none, all that no other node has for a child.
    pub(super) fn set(root: &'r Root<'_>, notes: &mut Notes) -> OrWhy<Self> {
        let mut stage = Self {
            nodes: Vec::new(),
            world: vec![None; root.nodes.len()],
            camera: None,
            lights: Vec::new(),
        };
        let roots = match (root.scene, root.scenes.first()) {
            (Some(index), _) => at(&root.scenes, index, "scene")?.nodes.clone(),
            (None, Some(Scene { nodes })) => nodes.clone(),
            (None, None) => {
                notes.add("the file has no scene: all of its nodes are shown");
                orphans(&root.nodes)
            }
        };
        let mut left: Vec<(usize, DMat4)> = roots.iter().map(|&n| (n, DMat4::IDENTITY)).collect();
        left.reverse();
        while let Some((index, parent)) = left.pop() {
            let node = at(&root.nodes, index, "node")?;
            let to_world = parent * node.matrix();
            if stage.world[index].replace(to_world).is_some() {
                return Err(format!(
                    "node {index} has two parents, or is its own ancestor"
                ));
            }
            let visibility = node.extensions.visibility.as_ref();
            if visibility.and_then(|v| v.visible) == Some(false) {
                notes.add("invisible nodes are left out (KHR_node_visibility)");
                continue;
            }
            stage.look(root, node, &to_world, notes)?;
            stage.nodes.push(Placed { node, to_world });
            let first = left.len();
            left.extend(node.children.iter().map(|&child| (child, to_world)));
            left[first..].reverse();
        }
        Ok(stage)
    }

    /// Notes the node's camera and light.
    fn look(
        &mut self,
        root: &Root<'_>,
        node: &Node,
        to_world: &DMat4,
        notes: &mut Notes,
    ) -> OrWhy<()> {
        if let Some(light) = &node.extensions.light {
            self.lights.push((light.light, *to_world));
        }
        let Some(camera) = node.camera else {
            return Ok(());
        };
        let camera = at(&root.cameras, camera, "camera")?.placed(to_world);
        match camera {
            Some(_) if self.camera.is_some() => notes.add("cameras after the first are left out"),
            None => {
                notes.add("a camera without numbers, or of a node without an extent, is left out")
            }
            Some(_) => {}
        }
        self.camera = self.camera.or(camera);
        Ok(())
    }
}

/// The nodes that no other node has for a child.
fn orphans(nodes: &[Node]) -> Vec<usize> {
    let mut orphan = vec![true; nodes.len()];
    for &child in nodes.iter().flat_map(|node| &node.children) {
        if let Some(orphan) = orphan.get_mut(child) {
            *orphan = false;
        }
    }
    (0..nodes.len()).filter(|&node| orphan[node]).collect()
}

impl Node {
    /// From its own space to its parent's.
    fn matrix(&self) -> DMat4 {
        match &self.matrix {
            Some(columns) => DMat4::from_cols_array(columns),
            None => placement(self.translation, self.rotation, self.scale),
        }
    }
}

/// A translation after a rotation after a scale.
pub(super) fn placement(
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
) -> DMat4 {
    // Files have them in single precision at best.
    let rotation = DQuat::from_array(rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    let length = rotation.length();
    let rotation = if length > 0.0 && length.is_finite() {
        rotation / length
    } else {
        DQuat::IDENTITY
    };
    DMat4::from_scale_rotation_translation(
        DVec3::from(scale.unwrap_or([1.0; 3])),
        rotation,
        DVec3::from(translation.unwrap_or_default()),
    )
}

/// A camera's place without scaling, says the specification, and so without a mirror or slanting axes too.
fn unscaled(to_world: &DMat4) -> Option<DMat4> {
    let [_, up, back] =
        [to_world.x_axis, to_world.y_axis, to_world.z_axis].map(|axis| axis.truncate());
    let back = back.try_normalize()?;
    let up = (up.try_normalize()?).reject_from_normalized(back);
    let up = up.try_normalize()?;
    let axes = DMat3::from_cols(up.cross(back), up, back);
    let origin = to_world.w_axis.truncate();
    Some(DMat4::from_mat3_translation(axes, origin))
}

impl Camera {
    /// `None` where the file leaves out the numbers, or the node has no extent.
    fn placed(&self, to_world: &DMat4) -> Option<GltfCamera> {
        let (projection, near, far) = if let Some(p) = &self.perspective {
            let projection = Projection::Perspective {
                fov_y: p.yfov,
                aspect: p.aspect_ratio,
            };
            (projection, p.znear, p.zfar)
        } else {
            let o = self.orthographic.as_ref()?;
            let projection = Projection::Orthographic {
                half_width: o.xmag,
                half_height: o.ymag,
            };
            (projection, o.znear, Some(o.zfar))
        };
        Some(GltfCamera {
            to_world: unscaled(to_world)?,
            projection,
            near,
            far,
        })
    }
}
