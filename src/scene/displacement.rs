//! Displacement, Étendue's own, of any shape that triangles can stand for (meshes and rectangles, spheres, disks, cylinders):
//! the texture or number `displacement` times `displacement_scale` (1) plus `displacement_offset` (0) is how far, in scene
//! units, the surface moves along its normal; a `bumpmap` of the same texture and scale has the same slopes. The shape is cut
//! into triangles while it is loaded, none with an edge longer than `displacement_edge` (1/256 of the diagonal of its box),
//! each vertex moves, and normals are computed from what came of it. A place moves as one, also where texture coordinates
//! have a seam, so that there are no cracks.

use std::sync::Arc;

use glam::Vec2;

use super::Assets;
use crate::color::{Mono, Role};
use crate::description::{Description, Properties};
use crate::error::{Problem, Problems, Result};
use crate::interaction::Interaction;
use crate::mesh::{Mesh, Seams};
use crate::shape::{self, Bounds, Geometry, TriangleMesh, Untessellated};
use crate::texture::{Palette, Texture};

/// The properties; the others have no use without the first.
const HEIGHT: &str = "displacement";
const OWN: [&str; 4] = [
    HEIGHT,
    "displacement_scale",
    "displacement_offset",
    "displacement_edge",
];

/// Edges along the diagonal of a shape's box.
const FINENESS: f32 = 256.0;

/// Triangles that are made where nobody says how much memory there is.
const MOST: u64 = 1 << 26;

/// How a shape is displaced.
struct Displacement<'a> {
    properties: Properties<'a>,
    height: Texture<Mono>,
    /// In scene units.
    scale: f64,
    offset: f64,
    longest_edge: Option<f32>,
}

impl Assets {
    /// Moves the surfaces of shapes with a displacement. `most` is how many triangles there is room for, all shapes
    /// together; 2²⁶ where that is not known.
    pub fn displace(&mut self, description: &Description, most: Option<u64>) -> Result<()> {
        let palette = Palette::new(Mono).with_role(Role::Quantity);
        let most = usize::try_from(most.unwrap_or(MOST)).unwrap_or(usize::MAX);
        let mut left = most.saturating_sub(self.primitive_count() as usize);
        let mut problems = Problems::default();
        for member in &mut self.shapes {
            let properties = description.node(member.node);
            let read = problems.take(Displacement::read(properties, &palette));
            let Some(displacement) = read.flatten() else {
                continue;
            };
            let nothing = Arc::new(Geometry::Mesh(TriangleMesh::new(Mesh::default())));
            let geometry = std::mem::replace(&mut member.geometry, nothing);
            let geometry = Arc::into_inner(geometry).expect("nobody shares what was just loaded");
            if let Some(mesh) =
                problems.take(displacement.apply(geometry, left, &mut self.warnings))
            {
                left = left.saturating_sub(mesh.triangles.len());
                member.geometry = Arc::new(Geometry::Mesh(TriangleMesh::new(mesh)));
            }
        }
        problems.finish()
    }
}

impl<'a> Displacement<'a> {
    fn read(properties: Properties<'a>, palette: &Palette<Mono>) -> Result<Option<Self>> {
        let properties = shape::declared(&properties)?;
        if properties.value(HEIGHT).is_none() {
            return match OWN.iter().find(|name| properties.has(name)) {
                None => Ok(None),
                Some(name) => Err(properties
                    .error(name, format!("{name} has no use without a displacement"))
                    .help(r#"add <texture name="displacement" type="bitmap">"#)),
            };
        }
        let longest_edge = properties.given::<f64>("displacement_edge")?;
        Ok(Some(Self {
            properties,
            height: palette.number(&properties, HEIGHT)?,
            scale: properties.float("displacement_scale")?,
            offset: properties.float("displacement_offset")?,
            longest_edge: longest_edge.map(|edge| edge as f32),
        }))
    }

    fn apply(&self, geometry: Geometry, most: usize, warnings: &mut Vec<Problem>) -> Result<Mesh> {
        let Self { properties, .. } = self;
        if let Geometry::Deforming(_) = geometry {
            let message = "a mesh that deforms cannot be displaced";
            return Err(properties
                .error(HEIGHT, message)
                .help("leave out its later sets of vertices; <animation> may move it"));
        }
        let bounds = match &geometry {
            Geometry::Mesh(mesh) => mesh.mesh().bounds(),
            other => Some(other.bounds(0)).map(|Bounds { min, max }| (min, max)),
        };
        let diagonal = bounds.map_or(0.0, |(low, high)| low.distance(high));
        let longest = self.longest_edge.unwrap_or(diagonal / FINENESS);
        let mut mesh = geometry.into_triangles(longest, most).map_err(|why| match why {
            Untessellated::NoChart => {
                let message = format!("this {} cannot be displaced", properties.plugin());
                let error = properties.error(HEIGHT, message);
                error.help("a mesh, a rectangle, a sphere, a disk or an open cylinder can")
            }
            Untessellated::TooMany => {
                let message = format!(
                    "edges of {longest} cut this {} into more triangles than the {most} that there is memory for",
                    properties.plugin()
                );
                let error = properties.error("displacement_edge", message);
                error.help("a larger displacement_edge takes fewer, and --memory-limit sets the limit")
            }
        })?;
        let looks_up = matches!(
            self.height,
            Texture::Bitmap(_) | Texture::Checkerboard(_) | Texture::ZonePlate(_)
        );
        if looks_up && mesh.uvs.is_empty() && !mesh.triangles.is_empty() {
            let error = properties.error(HEIGHT, "the shape has no texture coordinates");
            return Err(error.help("without them only a mesh_attribute can displace it"));
        }
        let seams = self.move_vertices(&mut mesh);
        let mut warn = |message: String| {
            warnings.extend_from_slice(properties.error(HEIGHT, message).problems());
        };
        let span = (mesh.bounds()).map_or(0.0, |(low, high)| f64::from(low.distance(high)));
        if seams.gap > TOLD * span {
            warn(format!(
                "heights differ by up to {:.3} in {} places where texture coordinates meet, and their mean is taken",
                seams.gap, seams.places
            ));
        }
        let dropped = mesh.check().dropped_triangles;
        if dropped > 0 {
            warn(format!(
                "{dropped} triangles were dropped, for the displacement carries them out of all bounds"
            ));
        }
        Ok(mesh)
    }

    fn move_vertices(&self, mesh: &mut Mesh) -> Seams {
        // A triangle of each vertex, and which of its corners it is.
        let mut corners = vec![(u32::MAX, Vec2::ZERO); mesh.positions.len()];
        for (triangle, t) in (0..).zip(&mesh.triangles) {
            for (vertex, barycentric) in t.iter().zip([Vec2::ZERO, Vec2::X, Vec2::Y]) {
                corners[*vertex as usize] = (triangle, barycentric);
            }
        }
        mesh.displace(|mesh, vertex| {
            let (primitive, barycentric) = corners[vertex];
            if primitive == u32::MAX {
                return None; // no triangle has it
            }
            let uv = mesh.uvs.get(vertex).copied().unwrap_or_default();
            let at = Interaction {
                position: mesh.positions[vertex],
                mesh: Some(mesh),
                primitive,
                barycentric,
                ..Interaction::at_uv(uv)
            };
            let height = self.height.eval(&at, &()).0[0];
            Some(self.scale * f64::from(height) + self.offset)
        })
    }
}

/// The part of a shape's size from which a difference of heights at a seam is told.
const TOLD: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::path::Path;

    use super::*;
    use crate::description::Options;
    use crate::image::{self, Image, Metadata};
    use crate::mesh::Report;

    fn displaced_in(folder: &Path, shape: &str) -> Result<(Vec<Mesh>, Vec<Problem>)> {
        let text = format!(r#"<scene version="3.0.0">{shape}</scene>"#);
        let scene = Description::parse(&text, &folder.join("test.xml"), &Options::default())?;
        let mut assets = Assets::load(&scene, None, None, &|| ())?;
        assets.displace(&scene, Some(1_000_000))?;
        crate::scene::build(
            &scene,
            &assets,
            crate::color::Rgb,
            crate::accel::Method::Brute,
        )?;
        let meshes = assets
            .shapes
            .iter()
            .filter_map(|s| s.geometry.mesh().cloned());
        Ok((meshes.collect(), assets.warnings))
    }

    /// A shape of that plugin with these properties.
    fn displaced(plugin: &str, properties: &str) -> Result<(Mesh, Vec<Problem>)> {
        let shape = format!(r#"<shape type="{plugin}">{properties}</shape>"#);
        let (mut meshes, warnings) = displaced_in(Path::new(""), &shape)?;
        Ok((meshes.remove(0), warnings))
    }

    const EDGE: &str = r#"<float name="displacement_edge" value="0.05"/>"#;
    const QUARTER: &str = r#"<float name="displacement" value="0.5"/><float name="displacement_scale" value="2"/>
        <float name="displacement_offset" value="-0.75"/>"#;

    #[test]
    fn every_shape_moves_by_a_constant_to_the_shape_that_this_makes_of_it() {
        let scale = r#"<transform name="to_world"><scale value="3"/></transform>"#;
        let inward = r#"<boolean name="flip_normals" value="true"/>"#;
        let radius = r#"<float name="radius" value="2"/>"#;
        for (plugin, properties, area, edges, boundaries) in [
            ("rectangle", "", 4.0, true, 1),
            ("rectangle", scale, 36.0, true, 1),
            ("sphere", "", 4.0 * PI * 1.25 * 1.25, false, 0),
            ("sphere", radius, 4.0 * PI * 2.25 * 2.25, false, 0),
            ("sphere", inward, 4.0 * PI * 0.75 * 0.75, false, 0),
            ("disk", "", PI, true, 1),
            ("disk", inward, PI, true, 1),
            ("cylinder", "", 2.0 * PI * 1.25, true, 2),
            ("cylinder", radius, 4.0 * PI * 1.125, true, 2),
            (
                "triangle",
                r#"<point name="p0" value="0,0,0"/><point name="p1" value="1,0,0"/><point name="p2" value="0,1,0"/>"#,
                0.5,
                true,
                1,
            ),
        ] {
            let (mesh, warnings) =
                displaced(plugin, &format!("{properties}{QUARTER}{EDGE}")).unwrap();
            let report = Report::of(&mesh);
            assert!(
                (report.area / area - 1.0).abs() < 2e-3,
                "{plugin}: {} {area}",
                report.area
            );
            assert_eq!(
                (report.boundary_edges > 0, report.closed),
                (edges, !edges),
                "{plugin}"
            );
            // A disk has χ = 1, a ring 0, a sphere 2.
            assert_eq!(report.euler_characteristic, 2 - boundaries, "{plugin}");
            assert_eq!(
                (report.components, report.degenerate_triangles),
                (1, 0),
                "{plugin}"
            );
            assert_eq!(
                (report.inconsistent_edges, report.non_manifold_edges),
                (0, 0),
                "{plugin}"
            );
            assert_eq!(
                (mesh.uvs.len(), mesh.normals.len()),
                (mesh.positions.len(), mesh.positions.len())
            );
            assert!(warnings.is_empty(), "{plugin}: {warnings:?}");
        }
        let (mesh, _) = displaced("rectangle", &format!("{QUARTER}{EDGE}{inward}")).unwrap();
        assert!(mesh.positions.iter().all(|p| (p.z + 0.25).abs() < 1e-6));
        assert!(mesh.normals.iter().all(|n| n.z < -0.999));
        let (cube, _) = displaced("cube", &format!("{QUARTER}{EDGE}")).unwrap();
        let report = Report::of(&cube);
        // Faces move by 1/4, and the ridges along the mean of two normals.
        assert!(report.closed && report.volume.unwrap() > 14.5 && report.volume.unwrap() < 15.625);
    }

    /// The picture u + v / 2, exact between the middles of its first and last texels.
    fn ramp(folder: &Path) {
        let mut ramp = Image::new(64, 64, vec!["R".into(), "G".into(), "B".into()]);
        for y in 0..64 {
            for x in 0..64 {
                let value = (x as f32 + 0.5) / 64.0 + (y as f32 + 0.5) / 128.0;
                (0..3).for_each(|c| ramp.set(x, y, c, value));
            }
        }
        image::write(&folder.join("ramp.exr"), &ramp, &Metadata::default()).unwrap();
    }

    const BITMAP: &str = r#"<texture name="displacement" type="bitmap"><string name="filename" value="ramp.exr"/>
        <string name="wrap_mode" value="clamp"/></texture>"#;

    #[test]
    fn a_ramp_of_heights_has_its_analytic_slope() {
        let folder = tempfile::tempdir().unwrap();
        ramp(folder.path());
        let scale = r#"<float name="displacement_scale" value="0.8"/>"#;
        let shape = format!(r#"<shape type="rectangle">{BITMAP}{scale}{EDGE}</shape>"#);
        let (meshes, _) = displaced_in(folder.path(), &shape).unwrap();
        let slope = Vec2::new(0.4, 0.2);
        let expected = (-slope).extend(1.0).normalize();
        let inner = |p: &glam::Vec3| p.truncate().abs().max_element() < 0.9;
        let mut seen = 0;
        for (p, n) in meshes[0]
            .positions
            .iter()
            .zip(&meshes[0].normals)
            .filter(|(p, _)| inner(p))
        {
            assert!(
                (p.z - 0.4 * (p.x + 1.0) - 0.2 * (p.y + 1.0)).abs() < 1e-5,
                "{p}"
            );
            assert!(n.distance(expected) < 1e-4, "{n}");
            seen += 1;
        }
        assert!(seen > 1000);
    }

    #[test]
    fn a_seam_is_closed_and_told() {
        let folder = tempfile::tempdir().unwrap();
        ramp(folder.path());
        let shape = format!(r#"<shape type="sphere">{BITMAP}{EDGE}</shape>"#);
        let (meshes, warnings) = displaced_in(folder.path(), &shape).unwrap();
        assert!(Report::of(&meshes[0]).closed);
        assert!(
            warnings[0]
                .message
                .contains("where texture coordinates meet"),
            "{warnings:?}"
        );
    }

    #[test]
    fn attributes_displace_meshes_without_texture_coordinates() {
        let folder = tempfile::tempdir().unwrap();
        let mut mesh = crate::mesh::ball(3);
        let values = mesh.positions.iter().map(|p| p.z).collect();
        let (name, per) = ("vertex_lift".to_owned(), crate::mesh::Per::Vertex);
        mesh.attributes.push(crate::mesh::Attribute {
            name,
            channels: 1,
            per,
            values,
        });
        crate::mesh::write_ply(&folder.path().join("ball.ply"), &mesh).unwrap();
        let ball = |texture: &str| {
            let shape = format!(
                r#"<shape type="ply"><string name="filename" value="ball.ply"/>{texture}</shape>"#
            );
            displaced_in(folder.path(), &shape)
        };
        let lift = r#"<texture name="displacement" type="mesh_attribute"><string name="name" value="vertex_lift"/></texture>"#;
        let (meshes, _) = ball(lift).unwrap();
        for (p, q) in mesh.positions.iter().zip(&meshes[0].positions) {
            assert!(q.distance(*p * (1.0 + p.z)) < 1e-5);
        }
        let error = ball(&lift.replace("lift", "left")).unwrap_err().to_string();
        assert!(error.contains("no attribute \"vertex_left\""), "{error}");
        let error = ball(r#"<texture name="displacement" type="checkerboard"/>"#).unwrap_err();
        assert!(
            error.to_string().contains("no texture coordinates"),
            "{error}"
        );
    }

    #[test]
    fn what_cannot_be_displaced_or_is_too_fine_is_refused_and_mitsuba_knows_none_of_it() {
        for (plugin, properties, message) in [
            ("plane", QUARTER, "this plane cannot be displaced"),
            ("cone", QUARTER, "this cone cannot be displaced"),
            (
                "rectangle",
                r#"<float name="displacement_scale" value="2"/>"#,
                "no use without a displacement",
            ),
            (
                "rectangle",
                r#"<float name="displacement" value="1"/><float name="displacement_edge" value="0"/>"#,
                "must be above 0",
            ),
            (
                "rectangle",
                r#"<float name="displacement" value="1"/><float name="displacement_scale" value="1e38"/>"#,
                "displacement_scale",
            ),
            (
                "rectangle",
                r#"<float name="displacement" value="1"/><float name="displacement_edge" value="1e-4"/>"#,
                "more triangles than the 999998",
            ),
            (
                "sphere",
                r#"<float name="displacement" value="1"/><float name="displacement_edge" value="1e-4"/>"#,
                "more triangles than the 999999",
            ),
        ] {
            let error = displaced(plugin, properties).unwrap_err().to_string();
            assert!(error.contains(message), "{plugin}: {error}");
        }
    }
}
