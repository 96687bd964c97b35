//! Haines's sphere flake (*A proposal for standard graphics environments*, 1987): on a ball stand nine of a third of its
//! size, six around its equator and three above, each with an axis outward, and on each of them nine more. (9ⁿ⁺¹ − 1)/8
//! balls; directions are those of densely packed balls and need square roots alone.

use std::fmt::Write;

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::ball;
use crate::mesh::Mesh;

/// A ball, or where one will be.
#[derive(Clone, Copy, Debug)]
struct Ball {
    center: DVec3,
    radius: f64,
    /// Its axis is z.
    frame: DMat3,
}

/// Balls of a flake of that level; `None` beyond 64 bits.
pub fn flake_balls(level: u32) -> Option<u64> {
    Some((9_u64.checked_pow(level.checked_add(1)?)? - 1) / 8)
}

/// A flake of that level on the unit ball, its axis +z, as triangles: 20 · 4ⁿ a ball, cut from an icosahedron
/// `subdivisions` times. Each ball is closed; no texture coordinates; its normals are left to be computed.
///
/// # Panics
/// Where 32 bits do not number the vertices.
pub fn flake(level: u32, subdivisions: u32) -> Mesh {
    let balls: Vec<Ball> = levels(level).concat();
    let unit = ball(subdivisions);
    let count = unit.positions.len();
    assert!(
        u32::try_from(balls.len() * count).is_ok(),
        "32 bits do not number the vertices"
    );
    let mut positions = vec![Vec3::ZERO; balls.len() * count];
    (positions.par_chunks_exact_mut(count).zip(&balls)).for_each(|(places, ball)| {
        for (place, p) in places.iter_mut().zip(&unit.positions) {
            let turned = ball.frame * p.as_dvec3();
            *place = (ball.center + ball.radius * turned).as_vec3();
        }
    });
    let mut triangles = vec![[0; 3]; balls.len() * unit.triangles.len()];
    (triangles
        .par_chunks_exact_mut(unit.triangles.len())
        .enumerate())
    .for_each(|(i, mine)| {
        let first = (i * count) as u32;
        for (triangle, t) in mine.iter_mut().zip(&unit.triangles) {
            *triangle = t.map(|i| first + i);
        }
    });
    Mesh {
        positions,
        triangles,
        ..Mesh::default()
    }
}

/// The flake as a scene of spheres that Mitsuba reads too: the lower half of the levels is a shapegroup, which stands on
/// every ball of the upper half, so that the file grows with the root of the number of balls.
pub fn flake_scene(level: u32) -> String {
    let above = level / 2;
    let tips = levels(above);
    let (last, inner) = tips.split_last().expect("there is level 0");
    let mut text = HEAD.to_owned();
    text += "\n    <shape type=\"shapegroup\" id=\"flake\">\n";
    for ball in levels(level - above).iter().flatten() {
        sphere(&mut text, 8, ball);
    }
    text += "    </shape>\n\n";
    for ball in inner.iter().flatten() {
        sphere(&mut text, 4, ball);
    }
    for tip in last {
        instance(&mut text, tip);
    }
    text + "</scene>\n"
}

const HEAD: &str = r#"<scene version="3.0.0">
    <!-- A sphere flake: spp, width, height and max_depth may be given. -->
    <default name="spp" value="64"/>
    <default name="width" value="768"/>
    <default name="height" value="576"/>
    <default name="max_depth" value="6"/>

    <integrator type="path"><integer name="max_depth" value="$max_depth"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="35"/>
        <transform name="to_world">
            <lookat origin="4.2, -4.8, 3.2" target="0, 0, 0.25" up="0, 0, 1"/>
        </transform>
        <film type="hdrfilm">
            <integer name="width" value="$width"/><integer name="height" value="$height"/>
        </film>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    </sensor>

    <emitter type="constant"><rgb name="radiance" value="0.5, 0.6, 0.75"/></emitter>
    <shape type="rectangle">
        <transform name="to_world">
            <scale value="1.5"/><lookat origin="6, -3, 8" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <emitter type="area"><rgb name="radiance" value="24, 21, 17"/></emitter>
    </shape>
    <shape type="rectangle">
        <transform name="to_world"><scale value="30"/><translate z="-1.5"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.45, 0.43, 0.4"/></bsdf>
    </shape>
    <bsdf type="plastic" id="matter"><rgb name="diffuse_reflectance" value="0.7, 0.35, 0.2"/></bsdf>
"#;

/// The balls of each level up to `last`.
fn levels(last: u32) -> Vec<Vec<Ball>> {
    let mut levels = vec![vec![Ball {
        center: DVec3::ZERO,
        radius: 1.0,
        frame: DMat3::IDENTITY,
    }]];
    for _ in 0..last {
        let above = levels.last().expect("there is level 0");
        levels.push(above.iter().flat_map(children).collect());
    }
    levels
}

fn children(ball: &Ball) -> [Ball; 9] {
    let (half, third) = (0.75_f64.sqrt(), (1.0 / 3.0_f64).sqrt());
    let (low, up) = (0.5 * third, (2.0 / 3.0_f64).sqrt());
    [
        DVec3::X,
        DVec3::new(0.5, half, 0.0),
        DVec3::new(-0.5, half, 0.0),
        DVec3::NEG_X,
        DVec3::new(-0.5, -half, 0.0),
        DVec3::new(0.5, -half, 0.0),
        DVec3::new(0.5, low, up),
        DVec3::new(-0.5, low, up),
        DVec3::new(0.0, -third, up),
    ]
    .map(|axis| {
        let across = DVec3::Z.cross(axis).normalize();
        let frame = DMat3::from_cols(across, axis.cross(across), axis);
        Ball {
            center: ball.center + ball.frame * axis * (ball.radius * 4.0 / 3.0),
            radius: ball.radius / 3.0,
            frame: ball.frame * frame,
        }
    })
}

fn sphere(text: &mut String, indent: usize, ball: &Ball) {
    let [x, y, z] = ball.center.as_vec3().to_array();
    let r = ball.radius as f32;
    let _ = writeln!(
        text,
        r#"{:indent$}<shape type="sphere"><point name="center" x="{x}" y="{y}" z="{z}"/><float name="radius" value="{r}"/><ref id="matter"/></shape>"#,
        ""
    );
}

fn instance(text: &mut String, tip: &Ball) {
    let m = tip.frame * tip.radius;
    let rows: Vec<String> = (0..3)
        .map(|i| {
            let row = m.row(i).as_vec3();
            format!("{} {} {} {}", row.x, row.y, row.z, tip.center[i] as f32)
        })
        .collect();
    let _ = writeln!(
        text,
        r#"    <shape type="instance"><ref id="flake"/><transform name="to_world"><matrix value="{} 0 0 0 1"/></transform></shape>"#,
        rows.join(" ")
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Report;

    #[test]
    fn a_flake_has_nine_balls_a_ball_that_touch_it_and_do_not_meet() {
        let levels = levels(2);
        let balls: Vec<Ball> = levels.concat();
        assert_eq!(balls.len() as u64, flake_balls(2).unwrap());
        for (i, a) in balls.iter().enumerate() {
            let touching = |b: &&Ball| {
                let gap = a.center.distance(b.center) - a.radius - b.radius;
                assert!(gap > -1e-9 || std::ptr::eq(a, *b), "{gap}");
                gap.abs() < 1e-9
            };
            let smaller = balls
                .iter()
                .filter(|b| b.radius < 0.5 * a.radius)
                .filter(touching);
            let wanted = if a.radius > 0.2 { 9 } else { 0 };
            assert!(smaller.count() >= wanted, "ball {i}");
            let axis = a.frame.z_axis;
            assert!(
                (a.frame.determinant() - 1.0).abs() < 1e-9 && (axis.length() - 1.0).abs() < 1e-9
            );
        }
        assert_eq!(flake_balls(u32::MAX), None);
    }

    #[test]
    fn a_flake_of_triangles_is_closed_balls() {
        // Cut once, balls would have a vertex where they touch.
        let report = Report::of(&flake(2, 0));
        assert_eq!(
            (report.triangles, report.components, report.closed),
            (91 * 20, 91, true)
        );
        assert_eq!(report.euler_characteristic, 2 * 91);
        // Nine balls of a third's radius have a third of the volume.
        let one = Report::of(&flake(0, 0)).volume.unwrap();
        assert!(
            (report.volume.unwrap() / (one * (1.0 + 1.0 / 3.0 + 1.0 / 9.0)) - 1.0).abs() < 1e-4
        );
    }

    #[test]
    fn the_scene_stands_for_as_many_spheres_as_the_flake_has_balls() {
        for level in 0..6 {
            let text = flake_scene(level);
            let group = text
                .split("</shape>\n\n")
                .next()
                .unwrap()
                .matches("\"sphere\"")
                .count();
            let spheres = text.matches("\"sphere\"").count() - group;
            let instances = text.matches("\"instance\"").count();
            let balls = spheres + instances * group;
            assert_eq!(balls as u64, flake_balls(level).unwrap(), "{level}");
        }
    }
}
