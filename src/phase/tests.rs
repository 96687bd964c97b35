use std::f64::consts::PI;
use std::path::Path;

use glam::Vec3;

use super::*;
use crate::description::{Description, Options, Value};
use crate::image::vol::{Grid, encode};

/// A member with what it needs; `FOLDER` has a grid of matrices.
const EXAMPLES: &[(&str, &str)] = &[
    ("isotropic", ""),
    ("hg", "<float name='g' value='0.8'/>"),
    ("hg", "<float name='g' value='-0.45'/>"),
    ("hg", "<float name='g' value='0.0001'/>"),
    ("rayleigh", ""),
    (
        "tabphase",
        "<string name='values' value='0.5, 1.5, 0, 2, 7'/>",
    ),
    ("tabphase", "<string name='values' value='1 1'/>"),
    (
        "blendphase",
        "<float name='weight' value='0.3'/><phase type='rayleigh'/><phase type='hg'/>",
    ),
    (
        "sggx",
        "<volume name='S' type='gridvolume'><string name='filename' value='s.vol'/></volume>",
    ),
    ("sggx", "<float name='S' value='0.7'/>"),
];

/// A grid of one cell: the matrix of an ellipsoid that stands askew.
fn write_matrix(folder: &Path) {
    let grid = Grid {
        size: [1; 3],
        channels: 6,
        bbox: [Vec3::ZERO, Vec3::ONE],
        values: vec![0.6, 0.3, 0.9, 0.1, -0.2, 0.15],
    };
    std::fs::write(folder.join("s.vol"), encode(&grid)).unwrap();
}

fn phase(folder: &Path, name: &str, inside: &str) -> Phase {
    let text = format!("<scene version='3.0.0'><phase type='{name}'>{inside}</phase></scene>");
    let path = folder.join("test.xml");
    let scene = Description::parse(&text, &path, &Options::default()).unwrap();
    let Value::Object(node) = scene.root().all()[0].value else {
        panic!("the scene holds a phase function");
    };
    Phase::build(&scene.node(node), &Palette::new(Mono)).unwrap_or_else(|e| panic!("{e}"))
}

/// Every example with directions from which light comes.
fn examples() -> impl Iterator<Item = (String, Phase, Vec3)> {
    let folder = tempfile::tempdir().unwrap();
    write_matrix(folder.path());
    let directions = [
        Vec3::Z,
        Vec3::new(0.48, -0.6, 0.64),
        Vec3::new(-0.6, 0.8, 0.0),
    ];
    EXAMPLES.iter().flat_map(move |(name, inside)| {
        let phase = phase(folder.path(), name, inside);
        directions.map(|wi| (format!("{name} {inside} {wi}"), phase.clone(), wi))
    })
}

fn value(phase: &Phase, wi: Vec3, wo: Vec3) -> f64 {
    f64::from(phase.eval_lanes::<f32>(Vec3::splat(0.5).into(), wi.into(), wo.into()))
}

/// A direction by its cosine and its part of a turn.
fn direction(cosine: f64, turn: f64) -> Vec3 {
    let (sine, angle) = ((1.0 - cosine * cosine).sqrt(), turn * 2.0 * PI);
    glam::DVec3::new(sine * angle.cos(), sine * angle.sin(), cosine).as_vec3()
}

#[test]
fn every_phase_function_has_an_example() {
    for name in Phase::NAMES {
        assert!(
            EXAMPLES.iter().any(|(example, _)| example == name),
            "{name}"
        );
    }
}

#[test]
fn the_whole_is_one() {
    const N: u32 = 400;
    for (what, phase, wi) in examples() {
        let mut sum = 0.0;
        for i in 0..N * N {
            let along = |i: u32| (f64::from(i) + 0.5) / f64::from(N);
            let wo = direction(2.0 * along(i / N) - 1.0, along(i % N));
            sum += value(&phase, wi, wo);
        }
        let whole = sum * 4.0 * PI / f64::from(N * N);
        assert!((whole - 1.0).abs() < 2e-3, "{what}: {whole}");
    }
}

/// Pearson's χ² on a grid over the sphere, whose cells are integrated by midpoints.
#[test]
fn directions_are_drawn_with_the_density_that_is_told() {
    const ROWS: usize = 20;
    const COLUMNS: usize = 16;
    const PARTS: usize = 16;
    const COUNT: usize = 200_000;
    for (what, phase, wi) in examples() {
        let mut seen = vec![0.0; ROWS * COLUMNS];
        for i in 0..COUNT {
            let number = |dimension: u64| {
                let bits = crate::math::random::mix((i as u64) << 3 | dimension);
                crate::math::random::unit(bits)
            };
            let sample = phase.sample_lanes::<f32>(
                Vec3::splat(0.5).into(),
                wi.into(),
                number(0),
                Vec2::new(number(1), number(2)),
            );
            let wo = Vec3::from(sample.wo);
            assert!((wo.length() - 1.0).abs() < 1e-4, "{what}: {wo}");
            let told = value(&phase, wi, wo);
            let drawn = f64::from(sample.pdf);
            assert!(
                (told - drawn).abs() < 2e-2 * drawn + 1e-5,
                "{what}: {told} {drawn}"
            );
            let turn = f64::from(wo.y.atan2(wo.x)) / (2.0 * PI);
            let row = (f64::from(wo.z + 1.0) / 2.0 * ROWS as f64) as usize;
            let column = (turn.rem_euclid(1.0) * COLUMNS as f64) as usize;
            seen[row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)] += 1.0;
        }
        let (mut chi2, mut cells) = (0.0, 0.0);
        for (cell, seen) in seen.iter().enumerate() {
            let mut expected = 0.0;
            for part in 0..PARTS * PARTS {
                let along = |cell: usize, part: usize, cells: usize| {
                    (cell as f64 + (part as f64 + 0.5) / PARTS as f64) / cells as f64
                };
                let cosine = 2.0 * along(cell / COLUMNS, part / PARTS, ROWS) - 1.0;
                let turn = along(cell % COLUMNS, part % PARTS, COLUMNS);
                expected += value(&phase, wi, direction(cosine, turn));
            }
            let cells_of_all = (ROWS * COLUMNS * PARTS * PARTS) as f64;
            expected *= 4.0 * PI / cells_of_all * COUNT as f64;
            if expected > 10.0 {
                chi2 += (seen - expected).powi(2) / expected;
                cells += 1.0;
            }
        }
        // χ² of k cells has mean k and deviation √2k; 5 deviations and some for the integration.
        let most = cells * 1.1 + 5.0 * f64::sqrt(2.0 * cells);
        assert!(chi2 < most, "{what}: χ² {chi2} over {cells}");
    }
}

#[test]
fn light_goes_on_forward_where_it_should() {
    let mean = |phase: &Phase| {
        const N: u32 = 2000;
        let cosine = |i| -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(N);
        // Light comes along z.
        let terms = (0..N).map(|i| cosine(i) * value(phase, -Vec3::Z, direction(cosine(i), 0.1)));
        terms.sum::<f64>() * 4.0 * PI / f64::from(N)
    };
    let folder = Path::new("");
    for g in [-0.5, 0.0, 0.8] {
        let inside = format!("<float name='g' value='{g}'/>");
        assert!(
            (mean(&phase(folder, "hg", &inside)) - g).abs() < 1e-3,
            "{g}"
        );
    }
    assert!(mean(&phase(folder, "rayleigh", "")).abs() < 1e-3);
    let forward = "<string name='values' value='0, 1'/>";
    assert!((mean(&phase(folder, "tabphase", forward)) - 1.0 / 3.0).abs() < 1e-3);
}

#[test]
fn what_is_no_table_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let told = |name: &str, inside: &str| {
        let text = format!("<scene version='3.0.0'><phase type='{name}'>{inside}</phase></scene>");
        let path = folder.path().join("test.xml");
        let scene = Description::parse(&text, &path, &Options::default()).unwrap();
        let Value::Object(node) = scene.root().all()[0].value else {
            panic!("the scene holds a phase function");
        };
        let error = Phase::build(&scene.node(node), &Palette::new(Mono)).unwrap_err();
        error.to_string()
    };
    let table = |values: &str| {
        told(
            "tabphase",
            &format!("<string name='values' value='{values}'/>"),
        )
    };
    for values in ["1", "", "1, -2", "1, x", "0, 0", "1, nan"] {
        let error = table(values);
        assert!(error.contains("test.xml:1"), "{values}: {error}");
    }
    let error = told(
        "blendphase",
        "<float name='weight' value='1'/><phase type='hg'/>",
    );
    assert!(error.contains("needs 2"), "{error}");
    let error = told("hg", "<float name='g' value='1'/>");
    assert!(error.contains("from"), "{error}");
}
