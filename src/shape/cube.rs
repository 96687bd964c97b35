//! `cube`: the cube [−1, 1]³ with a square of texture a face, under `to_world` and `flip_normals`.

use super::{Geometry, mesh};
use crate::description::Properties;
use crate::error::Result;
use crate::mesh::generate;

pub(super) fn build(properties: &Properties<'_>) -> Result<Geometry> {
    mesh::place(generate::cube(), properties)
}
