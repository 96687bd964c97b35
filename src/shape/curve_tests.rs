//! Tubes: against Mitsuba's numbers, and against their own definition, point by point.

use std::path::Path;

use glam::{DVec3, DVec4};

use super::*;
use crate::description::{Description, Options};
use crate::math::random;

/// The first curve bends and is of varying radius, the second is straight but at its end.
const TEXT: &str = "0 0 0 .2\n1 0.3 0.1 .3\n2 0 0.3 .1\n3 1 0 .2\n
0 5 0 .1\n1 5 0 .1\n2 5 0 .1\n3 5 0 .1\n4 5 0.5 .1\n";

fn curves(plugin: &str, text: &str, more: &str) -> Geometry {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("curves.txt");
    std::fs::write(&path, text).unwrap();
    let text = format!(
        r#"<scene version="3.0.0"><shape type="{plugin}">{more}
        <string name="filename" value="{}"/></shape></scene>"#,
        path.display()
    );
    let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
    let shape = build(&scene.root().children(Kind::Shape)[0]).unwrap();
    shape.geometry
}

fn ray(origin: DVec3, direction: DVec3) -> Ray {
    Ray {
        origin: origin.as_vec3(),
        direction: direction.normalize().as_vec3(),
        t_max: f32::INFINITY,
        time: 0.0,
    }
}

fn meet<'g>(geometry: &'g Geometry, ray: &Ray) -> Option<Interaction<'g>> {
    let hits = (0..geometry.primitive_count()).filter_map(|primitive| {
        let (t, u, v) = geometry.intersect(primitive, ray)?;
        let bounds = geometry.bounds(primitive);
        let place = ray.at(t);
        let slack = 1e-4;
        assert!(place.cmpge(bounds.min - slack).all() && place.cmple(bounds.max + slack).all());
        Some(Hit {
            t,
            u,
            v,
            instance: Hit::NONE,
            shape: 0,
            primitive,
        })
    });
    let hit = hits.min_by(|a, b| a.t.total_cmp(&b.t))?;
    Some(geometry.interaction(ray, &hit))
}

/// A ray's origin and direction, and what Mitsuba 3.9.1 says of its hit: distance, normal, texture coordinates, tangents
/// and segment.
type Probe = (
    [f64; 3],
    [f64; 3],
    f32,
    [f32; 3],
    [f32; 2],
    [[f32; 3]; 2],
    u32,
);

fn check(geometry: &Geometry, (origin, direction, t, normal, uv, tangents, segment): Probe) {
    let at = meet(geometry, &ray(origin.into(), direction.into()));
    let at = at.unwrap_or_else(|| panic!("{origin:?} misses"));
    let near = |ours: Vec3, mitsuba: [f32; 3], what: &str| {
        let off = ours.distance(Vec3::from_array(mitsuba));
        let size = Vec3::from_array(mitsuba).length().max(1.0);
        assert!(
            off < 2e-4 * size,
            "{origin:?} {what}: {ours} for {mitsuba:?}"
        );
    };
    near(Vec3::splat(at.t), [t; 3], "t");
    near(at.normal, normal, "normal");
    near(at.uv.extend(0.0), [uv[0], uv[1], 0.0], "uv");
    near(at.dp_du, tangents[0], "dp_du");
    near(at.dp_dv, tangents[1], "dp_dv");
    assert_eq!(at.primitive, segment);
    assert!(
        at.position
            .distance(ray(origin.into(), direction.into()).at(t))
            < 1e-4
    );
}

#[test]
fn tubes_of_splines_are_those_of_mitsuba() {
    let splines = curves("bsplinecurve", TEXT, "");
    assert_eq!(splines.primitive_count(), 3);
    let down = [0.0, 0.0, -1.0];
    let probes: [Probe; 5] = [
        (
            [1.5, 0.1, 5.0],
            down,
            4.620_537,
            [-0.013_88, -0.324_58, 0.945_76],
            [0.303_03, 0.175_15],
            [
                [-0.013_88, -1.169_55, -0.401_59],
                [3.234_32, -0.512_99, -0.128_58],
            ],
            0,
        ),
        (
            [1.0, 0.3, 5.0],
            down,
            4.653_697,
            [-0.074_76, 0.402_42, 0.912_4],
            [0.184_23, 0.010_84],
            [
                [-0.121_08, -1.426_31, 0.619_16],
                [3.095_71, -0.516_48, 0.481_45],
            ],
            0,
        ),
        (
            [1.5, 5.05, 5.0],
            down,
            4.913_398,
            [0.0, 0.5, 0.866_02],
            [0.166_67, 0.5],
            [[0.0, -0.544_14, 0.314_16], [3.0, 0.0, 0.0]],
            1,
        ),
        (
            [2.2, 5.05, 5.0],
            down,
            4.912_726,
            [-0.008_74, 0.5, 0.865_98],
            [0.166_67, 0.733_62],
            [[-0.003_17, -0.544_14, 0.314_14], [2.973_91, 0.0, 0.03]],
            2,
        ),
        (
            [1.7, 5.0, -5.0],
            [0.0, 0.0, 1.0],
            4.9,
            [0.0, 0.0, -1.0],
            [0.75, 1.7 / 3.0],
            [[0.0, 0.628_32, 0.0], [3.0, 0.0, 0.0]],
            1,
        ),
    ];
    for probe in probes {
        check(&splines, probe);
    }
    // A tube has no ends and no inside.
    for (origin, direction) in [
        ([0.5, 0.1, 5.0], down),
        ([2.5, 0.5, 5.0], down),
        ([1.9, 0.05, 0.25], [0.0, 0.0, 1.0]),
        ([-5.0, 5.0, 0.05], [1.0, 0.0, 0.0]),
    ] {
        assert!(
            meet(&splines, &ray(origin.into(), direction.into())).is_none(),
            "{origin:?}"
        );
    }
    let scaled = r#"<transform name="to_world"><scale value="2"/></transform>"#;
    let scaled = curves(
        "bsplinecurve",
        "0 0 0 .2\n1 .3 .1 .3\n2 0 .3 .1\n3 1 0 .2\n",
        scaled,
    );
    check(
        &scaled,
        (
            [2.0, 0.2, 9.0],
            down,
            8.615_904,
            [-0.066_85, -0.801_51, 0.594_24],
            [0.398_19, 0.011_82],
            [
                [0.181_35, -0.936_69, -1.243],
                [1.893_02, -0.043_45, 0.154_35],
            ],
            0,
        ),
    );
}

#[test]
fn tubes_of_lines_are_those_of_mitsuba() {
    let lines = curves("linearcurve", TEXT, "");
    assert_eq!(lines.primitive_count(), 7);
    let down = [0.0, 0.0, -1.0];
    // Mitsuba 3.9.1 leaves the tangents 0; these are those of the texture coordinates.
    for (origin, direction, t, normal, uv, segment) in [
        (
            [0.5, 0.1, 5.0],
            down,
            4.702_804,
            [-0.125_81, -0.235_23, 0.963_76],
            [0.280_43, 0.075_98],
            0,
        ),
        (
            [0.6, 0.05, 5.0],
            [0.0, 0.01, -1.0],
            4.692_625,
            [-0.090_35, -0.343_74, 0.934_71],
            [0.299_27, 0.089_1],
            0,
        ),
        (
            [1.5, 0.1, 5.0],
            down,
            4.605_899,
            [-0.064_21, -0.233_95, 0.970_13],
            [0.289_71, 0.216_1],
            1,
        ),
        (
            [2.5, 0.5, 5.0],
            down,
            4.698_523,
            [0.098_54, 0.098_54, 0.990_24],
            [0.25, 0.355_05],
            2,
        ),
        (
            [-5.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            4.8,
            [-1.0, 0.0, 0.0],
            [0.048_98, 0.0],
            0,
        ),
        (
            [-0.15, 0.0, 5.0],
            down,
            4.867_712,
            [-0.75, 0.0, 0.661_44],
            [0.204_13, 0.0],
            0,
        ),
        (
            [3.1, 1.1, 5.0],
            down,
            4.858_579,
            [0.5, 0.5, std::f32::consts::FRAC_1_SQRT_2],
            [0.25, 0.428_57],
            2,
        ),
        (
            [5.0, 1.0, 0.0],
            [-1.0, 0.0, 0.0],
            1.8,
            [1.0, 0.0, 0.0],
            [0.467_44, 0.428_57],
            2,
        ),
        (
            [2.2, 5.05, 5.0],
            down,
            4.913_398,
            [0.0, 0.5, 0.866_02],
            [0.166_67, 0.742_86],
            5,
        ),
    ] {
        let at = meet(&lines, &ray(origin.into(), direction.into())).unwrap();
        let tangents = [at.dp_du.to_array(), at.dp_dv.to_array()];
        assert!(at.dp_du.dot(at.normal).abs() < 1e-5);
        check(
            &lines,
            (origin, direction, t, normal, uv, tangents, segment),
        );
    }
    for (origin, direction) in [
        ([0.5, 0.15, 0.05], down),
        ([1.9, 0.05, 0.25], [0.0, 0.0, 1.0]),
    ] {
        assert!(
            meet(&lines, &ray(origin.into(), direction.into())).is_none(),
            "{origin:?}"
        );
    }
    // Where a line bends, each segment has the part outside of the others, and rays within leave unmet.
    let bent = curves("linearcurve", "0 0 0 .2\n1 0 0 .2\n2 .8 0 .2\n", "");
    for (x, y, t, segment) in [
        (0.95, 0.1, 4.826_795, 0),
        (1.05, 0.1, 4.805_565, 1),
        (1.05, 0.15, 4.819_385, 1),
    ] {
        let at = meet(&bent, &ray(DVec3::new(x, y, 5.0), DVec3::NEG_Z)).unwrap();
        assert!(
            (at.t - t).abs() < 1e-4 && at.primitive == segment,
            "{x} {y}: {}",
            at.t
        );
    }
    for (from, to) in [
        ([0.5, 0.0, 0.0], [1.0, 0.0, 0.0]),
        ([0.5, 0.0, 0.0], [1.0, 0.3, 0.0]),
        ([1.0, 0.0, 0.0], [1.0, 0.3, 0.0]),
        ([1.5, 0.4, 0.0], [-1.0, -0.8, 0.0]),
        ([1.5, 0.4, 0.0], [-1.0, -0.5, 0.0]),
        ([0.7, 0.0, 0.0], [1.0, 0.5, 0.0]),
        ([0.9, 0.0, 0.0], [-1.0, 0.0, 0.0]),
    ] {
        assert!(
            meet(&bent, &ray(from.into(), to.into())).is_none(),
            "{from:?} {to:?}"
        );
    }
}

/// Where Mitsuba 3.9.1 has no surface.
#[test]
fn a_radius_below_0_makes_no_surface() {
    let text = "0 0 0 .1\n1 0 0 .1\n2 0 0 -.1\n3 0 0 -.1\n4 0 0 -.1\n";
    for (plugin, x) in [
        ("bsplinecurve", 2.7),
        ("linearcurve", 1.3),
        ("linearcurve", 2.7),
    ] {
        let negative = curves(plugin, text, "");
        assert!(
            meet(&negative, &ray(DVec3::new(x, 0.0, 5.0), DVec3::NEG_Z)).is_none(),
            "{plugin}"
        );
    }
    let becoming = curves("bsplinecurve", text, "");
    let at = meet(&becoming, &ray(DVec3::new(1.3, 0.0, 5.0), DVec3::NEG_Z));
    assert!((at.unwrap().t - 4.970_533).abs() < 1e-5);
}

fn number(seed: u64, i: u32) -> f64 {
    f64::from(random::unit(random::bits(seed, i)))
}

/// A ray goes through outside space alone until it meets a tube, and there it is at the tube's surface: held against the
/// distance to the curve, at many places on it.
#[test]
fn a_ray_meets_a_tube_where_it_first_comes_within_the_radius() {
    for (plugin, bend, radius) in [
        ("bsplinecurve", 0.3, 0.03),
        ("bsplinecurve", 1.0, 0.1),
        ("linearcurve", 0.6, 0.1),
    ] {
        let (mut met, mut wrong) = (0, 0);
        for case in 0..400 {
            let signed = |i| 2.0 * number(31 + case, i) - 1.0;
            let points: Vec<DVec4> = (0..4)
                .map(|i| {
                    let place = DVec3::X * f64::from(i)
                        + bend * DVec3::new(signed(3 * i), signed(3 * i + 1), signed(3 * i + 2));
                    place.extend(radius * (1.0 + 0.5 * signed(20 + i)))
                })
                .collect();
            let text: String = points
                .iter()
                .map(|p| format!("{} {} {} {}\n", p.x, p.y, p.z, p.w))
                .collect();
            let geometry = curves(plugin, &text, "");
            // Balls along the curve: those of lines make up the tube, those of splines nearly do.
            let balls: Vec<DVec4> = (0..=3000)
                .map(|i| {
                    let u = f64::from(i) / 1000.0;
                    let (k, f) = ((u as usize).min(2), u - f64::from(u.min(2.0) as u32));
                    if plugin == "linearcurve" {
                        return points[k] + f * (points[k + 1] - points[k]);
                    }
                    let f = u / 3.0;
                    let weights = [
                        (1.0 - f).powi(3),
                        3.0 * f.powi(3) - 6.0 * f * f + 4.0,
                        1.0 + 3.0 * f + 3.0 * f * f - 3.0 * f.powi(3),
                        f.powi(3),
                    ];
                    (0..4).map(|i| points[i] * weights[i] / 6.0).sum()
                })
                .collect();
            for i in 0..20 {
                let target = balls[(number(77, 100 * case as u32 + i) * 2400.0) as usize + 300];
                let eye = DVec3::new(
                    1.5 + 2.0 * signed(40 + i),
                    2.5 + signed(70 + i),
                    3.0 * signed(100 + i),
                );
                let aim = target.truncate()
                    + 1.3
                        * target.w
                        * DVec3::new(signed(130 + i), signed(160 + i), signed(190 + i));
                let ray = ray(eye, aim - eye);
                let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
                let entry = |ball: &DVec4| {
                    let near = (ball.truncate() - o).dot(d);
                    let gap = (o + near * d - ball.truncate()).length_squared();
                    (gap < ball.w * ball.w).then(|| near - (ball.w * ball.w - gap).sqrt())
                };
                let first = balls.iter().filter_map(entry).fold(f64::INFINITY, f64::min);
                // A spline's tube is open at its ends, and not quite the balls'.
                let at_end = [balls[0], balls[3000]]
                    .iter()
                    .any(|ball| entry(ball).is_some_and(|t| t < first + 2.0 * radius));
                if at_end && plugin != "linearcurve" {
                    continue;
                }
                let ours = meet(&geometry, &ray).map_or(f64::INFINITY, |at| f64::from(at.t));
                met += u32::from(first.is_finite());
                let same = (ours - first).abs() < 0.05 * radius || (ours == first);
                wrong += u32::from(!same);
            }
        }
        assert!(met > 3000, "{plugin}: {met}");
        // Those that only just touch.
        assert!(
            f64::from(wrong) < 0.02 * f64::from(met),
            "{plugin}: {wrong} of {met}"
        );
    }
}

/// What a ray meets on a segment is the same wherever the ray ends behind it, also where points are doubled and the curve
/// has kinks: else it would depend on what was met before.
#[test]
fn the_ray_s_end_does_not_change_what_is_met_before_it() {
    for (plugin, copies) in [("bsplinecurve", 1), ("bsplinecurve", 4), ("linearcurve", 2)] {
        let mut met = 0;
        for case in 0..60 {
            let signed = |i| 2.0 * number(900 + case, i) - 1.0;
            let points = (0..6)
                .map(|i| 0.1 * DVec3::new(signed(4 * i), signed(4 * i + 1), signed(4 * i + 2)));
            let points: Vec<DVec3> = points.collect();
            let lines = points.iter().flat_map(|p| {
                let line = format!("{} {} {} 0.04\n", p.x, p.y, p.z);
                std::iter::repeat_n(line, copies)
            });
            let geometry = curves(plugin, &lines.collect::<String>(), "");
            for i in 0..60 {
                let eye = 0.5 * DVec3::new(signed(50 + i), signed(200 + i), signed(350 + i));
                let aim = points[i as usize % 6]
                    + 0.04 * DVec3::new(signed(500 + i), signed(650 + i), 0.0);
                let whole = ray(eye, aim - eye);
                for segment in 0..geometry.primitive_count() {
                    let first = geometry.intersect(segment, &whole);
                    met += u32::from(first.is_some());
                    let t_max = 0.6 * number(77, 100 * case as u32 + i) as f32;
                    let found = geometry.intersect(segment, &Ray { t_max, ..whole });
                    assert_eq!(
                        found,
                        first.filter(|met| met.0 <= t_max),
                        "{plugin} {copies}"
                    );
                }
            }
        }
        assert!(met > 300, "{plugin} {copies}: {met}");
    }
}

/// A place in [0, 1)², the `i`th of a sequence.
fn pair(seed: u64, i: u32) -> Vec2 {
    Vec2::new(
        random::unit(random::bits(seed, 2 * i)),
        random::unit(random::bits(seed, 2 * i + 1)),
    )
}

/// Straight tubes of a radius that changes evenly, and one that has no length.
#[test]
fn tubes_have_the_areas_of_cylinders_cones_and_balls() {
    use std::f64::consts::PI;
    let cone = (1.0 - 0.1_f64 * 0.1).sqrt();
    for (plugin, text, area) in [
        (
            "bsplinecurve",
            "0 0 0 .2\n1 0 0 .2\n2 0 0 .2\n3 0 0 .2\n4 0 0 .2\n",
            0.8 * PI,
        ),
        (
            "bsplinecurve",
            "0 0 0 .1\n1 0 0 .2\n2 0 0 .3\n3 0 0 .4\n",
            0.5 * PI * 1.01_f64.sqrt(),
        ),
        ("linearcurve", "0 0 0 .2\n1 0 0 .2\n", 0.4 * PI + 0.16 * PI),
        (
            "linearcurve",
            "0 0 0 .2\n0 1 0 .3\n",
            0.5 * PI * cone * cone + 2.0 * PI * (0.04 * 0.9 + 0.09 * 1.1),
        ),
        (
            "linearcurve",
            "0 0 0 .2\n0 0.05 0 .3\n",
            4.0 * PI * (0.04 + 0.09),
        ),
    ] {
        let found = curves(plugin, text, "").area();
        assert!((found / area - 1.0).abs() < 1e-6, "{text}: {found} {area}");
    }
}

/// The mean of the reciprocal density, where nothing is in between, is the solid angle that rays in even directions find;
/// and a point that a ray meets has the density with which it was drawn.
#[test]
fn points_are_drawn_on_tubes_with_the_density_that_is_told() {
    let places = [DVec3::new(1.0, 2.0, 0.5), DVec3::new(1.2, 0.9, 0.1)];
    let cases = ["bsplinecurve", "linearcurve"].map(|plugin| places.map(|from| (plugin, from)));
    for (plugin, from) in cases.into_iter().flatten() {
        let tubes = curves(plugin, TEXT, "");
        let n = 20_000_u32;
        let (mut drawn, mut squared, mut found) = (0.0, 0.0, 0.0);
        for i in 0..n {
            let direction = lanes::warp::uniform_sphere::<f32>(pair(7, i).into());
            let direction = Vec3::from(direction).as_dvec3();
            found += f64::from(u8::from(meet(&tubes, &ray(from, direction)).is_some()));
            let Some(point) = tubes.sample(from.as_vec3(), pair(3, i)) else {
                continue;
            };
            let way = point.position.as_dvec3() - from;
            let Some(at) = meet(&tubes, &ray(from, way)) else {
                continue;
            };
            if (f64::from(at.t) / way.length() - 1.0).abs() > 1e-4 {
                continue;
            }
            // Where two segments meet in a crease, the ray may meet the other.
            let same = at.primitive == point.primitive;
            assert!(!same || point.normal.dot(at.normal) > 0.999, "{plugin}");
            let pdf = tubes.pdf(from.as_vec3(), &at);
            let cosine = -point.normal.as_dvec3().dot(way.normalize());
            if cosine > 0.3 && same {
                assert!(
                    (pdf / point.pdf - 1.0).abs() < 0.05,
                    "{plugin}: {pdf} {}",
                    point.pdf
                );
                assert!((tubes.uv(&point).y - at.uv.y).abs() < 1e-2, "{plugin}");
            }
            drawn += f64::from(1.0 / point.pdf);
            squared += f64::from(1.0 / point.pdf).powi(2);
        }
        let n = f64::from(n);
        let whole = 4.0 * std::f64::consts::PI;
        let (share, mean) = (found / n, drawn / n);
        let errors = [
            (squared / n - mean * mean) / n,
            whole * whole * share * (1.0 - share) / n,
        ];
        let error = errors.iter().sum::<f64>().sqrt();
        assert!(
            (mean - whole * share).abs() < 4.0 * error && error < 0.1 * mean,
            "{plugin} from {from}: {mean} {} ± {error}",
            whole * share
        );
    }
}
