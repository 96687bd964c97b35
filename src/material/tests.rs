//! What every material must do, looped over the family.

use std::path::Path;
use std::sync::LazyLock;

use glam::{Vec2, Vec3};

use super::*;
use crate::color::{Bands, Color, Rgb, Role, Samples, Spectra};
use crate::description::{Description, Options};
use crate::interaction::{Points, Source};
use crate::lanes::{self, Kernel, Lanes, Mask as _, Task, warp};
use crate::math::{Frame, random};
use crate::mesh::Mesh;

/// Scene text of each material under test, a member of the family at least once.
const MATERIALS: &[(&str, &str)] = &[
    (
        "blendbsdf",
        r#"<bsdf type="blendbsdf"><float name="weight" value="0.3"/><bsdf type="conductor"/><bsdf type="diffuse"/></bsdf>"#,
    ),
    (
        "bumpmap",
        r#"<bsdf type="bumpmap"><texture type="checkerboard"/><bsdf type="roughconductor"/></bsdf>"#,
    ),
    (
        "circular",
        r#"<bsdf type="circular"><rgb name="transmittance" value="1, 0.5, 0"/></bsdf>"#,
    ),
    (
        "conductor",
        r#"<bsdf type="conductor"><string name="material" value="Cu"/></bsdf>"#,
    ),
    ("conductor", r#"<bsdf type="conductor"/>"#),
    (
        "dielectric",
        r#"<bsdf type="dielectric"><string name="int_ior" value="diamond"/></bsdf>"#,
    ),
    (
        "diffuse",
        r#"<bsdf type="diffuse"><rgb name="reflectance" value="1, 0.5, 0"/></bsdf>"#,
    ),
    ("hair", r#"<bsdf type="hair"/>"#),
    (
        "hair",
        r#"<bsdf type="hair"><rgb name="sigma_a" value="0, 0.2, 1"/><float name="scale" value="0.5"/><float name="longitudinal_roughness" value="0.15"/><float name="azimuthal_roughness" value="0.8"/><float name="scale_tilt" value="5"/></bsdf>"#,
    ),
    (
        "mask",
        r#"<bsdf type="mask"><float name="opacity" value="0.7"/><bsdf type="diffuse"><float name="reflectance" value="1"/></bsdf></bsdf>"#,
    ),
    (
        "measured",
        r#"<bsdf type="measured"><string name="filename" value="round.bsdf"/></bsdf>"#,
    ),
    (
        "measured",
        r#"<bsdf type="measured"><string name="filename" value="brushed.bsdf"/></bsdf>"#,
    ),
    (
        "normalmap",
        r#"<bsdf type="normalmap"><texture name="normalmap" type="rawconstant"><vector name="value" value="0.6, 0.45, 0.95"/></texture><bsdf type="diffuse"/></bsdf>"#,
    ),
    ("null", r#"<bsdf type="null"/>"#),
    ("phong", r#"<bsdf type="phong"/>"#),
    (
        "phong",
        r#"<bsdf type="phong"><rgb name="diffuse_reflectance" value="0.5, 0.1, 0"/><rgb name="specular_reflectance" value="0.5, 0.9, 1"/><float name="exponent" value="4"/></bsdf>"#,
    ),
    (
        "phong",
        r#"<bsdf type="phong"><float name="diffuse_reflectance" value="0.9"/><float name="specular_reflectance" value="0.8"/><texture type="checkerboard" name="exponent"><float name="color0" value="0"/><float name="color1" value="100"/></texture></bsdf>"#,
    ),
    ("plastic", r#"<bsdf type="plastic"/>"#),
    (
        "plastic",
        r#"<bsdf type="plastic"><boolean name="nonlinear" value="true"/><float name="int_ior" value="1.9"/><rgb name="diffuse_reflectance" value="1, 0.27, 0.36"/></bsdf>"#,
    ),
    ("polarizer", r#"<bsdf type="polarizer"/>"#),
    ("pplastic", r#"<bsdf type="pplastic"/>"#),
    (
        "pplastic",
        r#"<bsdf type="pplastic"><string name="distribution" value="ggx"/><float name="alpha_u" value="0.6"/><float name="alpha_v" value="0.2"/><float name="eta" value="1.8"/><rgb name="diffuse_reflectance" value="1, 0.2, 0"/></bsdf>"#,
    ),
    (
        "pplastic",
        r#"<bsdf type="pplastic"><boolean name="sample_visible" value="false"/><float name="alpha" value="0.3"/></bsdf>"#,
    ),
    ("principled", r#"<bsdf type="principled"/>"#),
    (
        "principled",
        r#"<bsdf type="principled"><rgb name="base_color" value="0.8, 0.3, 0.1"/><float name="metallic" value="0.6"/><float name="anisotropic" value="0.7"/><float name="clearcoat" value="1"/><float name="spec_tint" value="0.5"/><float name="flatness" value="0.5"/></bsdf>"#,
    ),
    (
        "principled",
        r#"<bsdf type="principled"><rgb name="base_color" value="0.8, 0.9, 1"/><float name="spec_trans" value="0.8"/><float name="sheen" value="0.3"/><float name="sheen_tint" value="0.5"/><float name="eta" value="1.6"/></bsdf>"#,
    ),
    (
        "principledthin",
        r#"<bsdf type="principledthin"><float name="spec_trans" value="0.5"/><float name="diff_trans" value="0.8"/><float name="spec_tint" value="0.5"/><float name="sheen" value="0.2"/></bsdf>"#,
    ),
    ("principledthin", r#"<bsdf type="principledthin"/>"#),
    (
        "retarder",
        r#"<bsdf type="retarder"><rgb name="transmittance" value="1, 0.5, 0"/></bsdf>"#,
    ),
    (
        "roughconductor",
        r#"<bsdf type="roughconductor"><string name="material" value="Au"/></bsdf>"#,
    ),
    (
        "roughconductor",
        r#"<bsdf type="roughconductor"><string name="distribution" value="ggx"/><float name="alpha_u" value="0.6"/><float name="alpha_v" value="0.2"/></bsdf>"#,
    ),
    (
        "roughconductor",
        r#"<bsdf type="roughconductor"><boolean name="sample_visible" value="false"/><float name="alpha_u" value="0.3"/><float name="alpha_v" value="0.5"/></bsdf>"#,
    ),
    (
        "roughconductor",
        r#"<bsdf type="roughconductor"><string name="distribution" value="ggx"/><float name="alpha" value="0.05"/></bsdf>"#,
    ),
    (
        "roughdielectric",
        r#"<bsdf type="roughdielectric"><float name="alpha" value="0.5"/></bsdf>"#,
    ),
    (
        "roughdielectric",
        r#"<bsdf type="roughdielectric"><string name="distribution" value="ggx"/><float name="alpha_u" value="0.4"/><float name="alpha_v" value="0.2"/><float name="int_ior" value="2"/></bsdf>"#,
    ),
    (
        "roughdielectric",
        r#"<bsdf type="roughdielectric"><boolean name="sample_visible" value="false"/><float name="alpha" value="0.3"/></bsdf>"#,
    ),
    (
        "roughplastic",
        r#"<bsdf type="roughplastic"><float name="alpha" value="0.3"/></bsdf>"#,
    ),
    (
        "roughplastic",
        r#"<bsdf type="roughplastic"><string name="distribution" value="ggx"/><boolean name="nonlinear" value="true"/><rgb name="diffuse_reflectance" value="1, 0.2, 0"/></bsdf>"#,
    ),
    ("thindielectric", r#"<bsdf type="thindielectric"/>"#),
    (
        "twosided",
        r#"<bsdf type="twosided"><bsdf type="diffuse"/><bsdf type="diffuse"><float name="reflectance" value="0.9"/></bsdf></bsdf>"#,
    ),
    (
        "twosided",
        r#"<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>"#,
    ),
    (
        "twosided",
        r#"<bsdf type="twosided"><bsdf type="phong"><float name="exponent" value="9"/></bsdf></bsdf>"#,
    ),
    (
        "bumpmap",
        r#"<bsdf type="bumpmap"><texture type="checkerboard"/><bsdf type="phong"/></bsdf>"#,
    ),
];

/// Files that some of them read.
static FILES: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let half = -std::f32::consts::PI;
    for (name, phi) in [
        ("round", vec![0.0]),
        ("brushed", vec![half, 0.75 * half, 0.5 * half]),
    ] {
        let theta = vec![0.1, 0.5, 0.9, 1.5];
        let (phis, thetas) = (phi.len(), theta.len());
        let numbers = |count: usize, seed: u64, least: f32, most: f32| -> Vec<f32> {
            let number = |i| least + (most - least) * random::unit(random::bits(seed, i));
            (0..count as u32).map(number).collect()
        };
        let outer = phis * thetas;
        let bytes = tensor_file::tests::written(&[
            ("phi_i", &[phis], phi),
            ("theta_i", &[thetas], theta),
            ("ndf", &[6, 5], numbers(30, 1, 0.5, 1.0)),
            ("sigma", &[4, 4], numbers(16, 2, 0.5, 1.0)),
            (
                "vndf",
                &[phis, thetas, 6, 5],
                numbers(outer * 30, 3, 0.2, 1.0),
            ),
            (
                "luminance",
                &[phis, thetas, 4, 4],
                numbers(outer * 16, 4, 0.2, 1.0),
            ),
            (
                "rgb",
                &[phis, thetas, 3, 4, 4],
                numbers(outer * 48, 5, 0.02, 0.1),
            ),
            (
                "spectra",
                &[phis, thetas, 3, 4, 4],
                numbers(outer * 48, 5, 0.02, 0.1),
            ),
            ("wavelengths", &[3], vec![450.0, 550.0, 650.0]),
            ("description*", &[4], vec![109.0; 4]),
            ("jacobian*", &[1], vec![0.0]),
        ]);
        std::fs::write(folder.path().join(format!("{name}.bsdf")), bytes).unwrap();
    }
    folder
});

fn build(text: &str) -> Material<Rgb> {
    let text = format!(r#"<scene version="3.0.0">{text}</scene>"#);
    let path = FILES.path().join("test.xml");
    let scene = Description::parse(&text, &path, &Options::default()).unwrap();
    Material::build(&scene.root().children(Kind::Bsdf)[0], &Palettes::new(Rgb)).unwrap()
}

fn interaction() -> Interaction<'static> {
    Interaction::at_uv(Vec2::splat(0.3))
}

fn uniforms(i: u32) -> (f32, Vec2) {
    let u = |k| random::unit(random::bits(random::key(11, u64::from(i)), k));
    (u(0), Vec2::new(u(1), u(2)))
}

/// Directions of incidence, from both sides.
fn incidences() -> impl Iterator<Item = Vec3> {
    [0.05f32, 0.4, 0.8, 1.0].into_iter().flat_map(|cos| {
        let sin = (1.0 - cos * cos).sqrt();
        [Vec3::new(sin, 0.0, cos), Vec3::new(0.0, -sin, -cos)]
    })
}

#[test]
fn every_material_of_the_family_is_tested() {
    for name in Material::<Rgb>::NAMES {
        assert!(
            MATERIALS.iter().any(|(n, _)| n == name),
            "add {name} to the table of materials under test"
        );
    }
}

#[test]
fn every_material_reflects_no_more_than_it_receives() {
    for (name, text) in MATERIALS {
        let material = build(text);
        for wi in incidences() {
            let n = 20_000;
            let mut sum = [0.0f64; 3];
            for i in 0..n {
                let (u1, u2) = uniforms(i);
                if let Some(sample) = material.sample(&interaction(), wi, u1, u2, &()) {
                    assert!(
                        (sample.wo.length() - 1.0).abs() < 1e-4,
                        "{name}: {:?}",
                        sample.wo
                    );
                    // In a medium of index η radiance is η² times as high: radiance over η² is the measure.
                    for (c, sum) in sum.iter_mut().enumerate() {
                        *sum += f64::from(sample.weight[c] * sample.eta.powi(2)) / f64::from(n);
                    }
                }
            }
            assert!(sum.iter().all(|s| *s < 1.02), "{name} at {wi}: {sum:?}");
        }
    }
}

#[test]
fn every_material_samples_what_it_evaluates() {
    for (name, text) in MATERIALS {
        let material = build(text);
        for wi in incidences() {
            // Delta lobes have no value to compare: samples that are not delta must agree one by one.
            for i in 0..2000 {
                let (u1, u2) = uniforms(i);
                let Some(sample) = material.sample(&interaction(), wi, u1, u2, &()) else {
                    continue;
                };
                if sample.delta {
                    continue;
                }
                let value = material
                    .eval(&interaction(), wi, sample.wo, &())
                    .unwrap_or_else(|| {
                        panic!(
                            "{name} at {wi} drew {} and evaluates it to nothing",
                            sample.wo
                        )
                    });
                assert!(
                    (value.pdf / sample.pdf - 1.0).abs() < 1e-2,
                    "{name} {wi} {}: {} {}",
                    sample.wo,
                    value.pdf,
                    sample.pdf
                );
                for c in 0..3 {
                    let (a, b) = (value.value[c], sample.weight[c] * sample.pdf);
                    assert!(
                        (a - b).abs() <= 1e-2 * (a.abs() + b.abs()) + 1e-6,
                        "{name} {wi} {}: {a} {b}",
                        sample.wo
                    );
                }
            }
        }
    }
}

/// Pearson's χ² of sampled directions against the density, on a grid over the sphere.
#[test]
fn every_material_draws_directions_with_the_density_that_it_says() {
    const ROWS: usize = 12;
    const COLUMNS: usize = 16;
    for (name, text) in MATERIALS {
        let material = build(text);
        for wi in incidences().filter(|wi| wi.z.abs() > 0.3) {
            let n = 200_000;
            let mut observed = vec![0.0f64; ROWS * COLUMNS];
            let cell = |d: Vec3| {
                let row = ((d.z * 0.5 + 0.5) * ROWS as f32) as usize;
                let turn = d.y.atan2(d.x) / std::f32::consts::TAU + 0.5;
                row.min(ROWS - 1) * COLUMNS + ((turn * COLUMNS as f32) as usize).min(COLUMNS - 1)
            };
            for i in 0..n {
                let (u1, u2) = uniforms(i);
                if let Some(sample) = material
                    .sample(&interaction(), wi, u1, u2, &())
                    .filter(|s| !s.delta)
                {
                    observed[cell(sample.wo)] += 1.0;
                }
            }
            // The density's integral over each cell, by a stratified grid of points.
            let mut expected = vec![0.0f64; ROWS * COLUMNS];
            let fine = 960;
            for i in 0..fine * fine {
                let u = Vec2::new((i / fine) as f32 + 0.5, (i % fine) as f32 + 0.5) / fine as f32;
                let wo = Vec3::from(warp::uniform_sphere(u.into()));
                if let Some(value) = material.eval(&interaction(), wi, wo, &()) {
                    let share = 4.0 * std::f64::consts::PI / f64::from(fine * fine);
                    expected[cell(wo)] += f64::from(value.pdf) * share * f64::from(n);
                }
            }
            // What was measured has a density without bound where a mirror would send light, which no grid of points
            // integrates.
            let mirrored = Vec3::new(-wi.x, -wi.y, wi.z);
            let mut left_out = [false; ROWS * COLUMNS];
            for i in 0..64 {
                let aside = Vec3::from(warp::uniform_sphere(uniforms(i).1.into())) * 0.1;
                left_out[cell((mirrored + aside).normalize())] = *name == "measured";
            }
            let (mut chi2, mut cells) = (0.0, 0.0);
            let compared = observed.iter().zip(&expected).zip(left_out);
            for ((o, e), _) in compared.filter(|((_, e), left_out)| **e > 10.0 && !left_out) {
                chi2 += (o - e).powi(2) / e;
                cells += 1.0;
            }
            // χ² of k cells has mean k and deviation √2k; 5 deviations and 2 % for the integration.
            assert!(
                chi2 < cells * 1.3 + 5.0 * f64::sqrt(2.0 * cells) + 10.0,
                "{name} {wi}: χ² {chi2} over {cells}"
            );
        }
    }
}

#[test]
fn reflection_is_reciprocal() {
    // A turned normal is not the surface's, and its cosine not the one that light is counted by. What a fibre absorbs is
    // told by one of the two directions, and what was measured need not be the same both ways.
    let turned = |name: &str| ["bumpmap", "hair", "measured", "normalmap"].contains(&name);
    for (name, text) in MATERIALS.iter().filter(|(name, _)| !turned(name)) {
        let material = build(text);
        for i in 0..2000 {
            let (_, u) = uniforms(i);
            let (_, v) = uniforms(i + 10_000);
            let (a, b) = (
                Vec3::from(warp::uniform_sphere(u.into())),
                Vec3::from(warp::uniform_sphere(v.into())),
            );
            if a.z * b.z <= 0.01 {
                continue; // transmission scales with the index of refraction
            }
            let f = |wi, wo: Vec3| {
                material
                    .eval(&interaction(), wi, wo, &())
                    .map_or(0.0, |v| v.value[0] / wo.z.abs())
            };
            let (x, y) = (f(a, b), f(b, a));
            assert!((x - y).abs() <= 1e-3 * (x + y) + 1e-6, "{name}: {x} {y}");
        }
    }
}

/// `wi` and `wo`, to be normalised.
type Pair = [[f32; 3]; 2];
const REFLECTED: Pair = [[0.5, 0.2, 0.8], [-0.4, -0.1, 0.7]];
const INWARD: Pair = [[0.3, -0.2, 0.9], [-0.2, 0.15, -0.8]];
const OUTWARD: Pair = [[0.1, 0.3, -0.9], [-0.05, -0.3, 0.8]];

/// Values and densities of Mitsuba 3.9.1, `scalar_rgb`.
const MITSUBA: &[(&str, Pair, [f32; 3], f32)] = &[
    (
        r#"<bsdf type="hair"></bsdf>"#,
        REFLECTED,
        [0.142266, 0.142257, 0.142256],
        0.660124,
    ),
    (
        r#"<bsdf type="hair"></bsdf>"#,
        INWARD,
        [1.10204, 0.495899, 0.0680408],
        2.92065,
    ),
    (
        r#"<bsdf type="hair"></bsdf>"#,
        [[-0.1, 0.7, 0.4], [0.3, -0.6, -0.8]],
        [0.00153125, 0.000575631, 5.1763e-05],
        0.0037185,
    ),
    (
        r#"<bsdf type="hair"><float name="eumelanin" value="0.2"/><float name="pheomelanin" value="0.4"/><float name="longitudinal_roughness" value="0.1"/><float name="azimuthal_roughness" value="0.6"/><float name="scale_tilt" value="5"/></bsdf>"#,
        INWARD,
        [1.45302, 1.09993, 0.5042],
        1.95517,
    ),
    (
        r#"<bsdf type="hair"><float name="eumelanin" value="0.2"/><float name="pheomelanin" value="0.4"/><float name="longitudinal_roughness" value="0.1"/><float name="azimuthal_roughness" value="0.6"/><float name="scale_tilt" value="5"/></bsdf>"#,
        [[0.9, 0.05, 0.2], [-0.9, 0.1, -0.3]],
        [0.653982, 0.650217, 0.647156],
        0.936422,
    ),
    (
        r#"<bsdf type="hair"><rgb name="sigma_a" value="0.1, 0.3, 1.5"/><float name="scale" value="0.5"/><float name="int_ior" value="1.4"/><float name="longitudinal_roughness" value="0.8"/></bsdf>"#,
        REFLECTED,
        [0.0328588, 0.0328359, 0.0328069],
        0.0435666,
    ),
    (
        r#"<bsdf type="hair"><rgb name="sigma_a" value="0.1, 0.3, 1.5"/><float name="scale" value="0.5"/><float name="int_ior" value="1.4"/><float name="longitudinal_roughness" value="0.8"/></bsdf>"#,
        [[-0.1, 0.7, 0.4], [0.3, -0.6, -0.8]],
        [0.218715, 0.169864, 0.0373734],
        0.244561,
    ),
    (
        r#"<bsdf type="plastic"><boolean name="nonlinear" value="true"/><rgb name="specular_reflectance" value=".5,1,.2"/></bsdf>"#,
        REFLECTED,
        [0.0806863, 0.0806863, 0.0806863],
        0.261504,
    ),
    (
        r#"<bsdf type="blendbsdf"><float name="weight" value="0.3"/><bsdf type="plastic"></bsdf><bsdf type="diffuse"></bsdf></bsdf>"#,
        REFLECTED,
        [0.13834, 0.13834, 0.13834],
        0.259042,
    ),
    (
        r#"<bsdf type="roughconductor"><string name="material" value="Cu"/><string name="distribution" value="beckmann"/><float name="alpha_u" value="0.3"/><float name="alpha_v" value="0.05"/><rgb name="specular_reflectance" value=".5,1,.2"/></bsdf>"#,
        REFLECTED,
        [1.12938, 1.47061, 0.242776],
        2.37381,
    ),
    (
        r#"<bsdf type="roughconductor"><string name="material" value="Cu"/><string name="distribution" value="ggx"/><float name="alpha_u" value="0.3"/><float name="alpha_v" value="0.05"/><rgb name="specular_reflectance" value=".5,1,.2"/></bsdf>"#,
        REFLECTED,
        [0.75532, 0.983532, 0.162366],
        1.59918,
    ),
    (
        r#"<bsdf type="roughconductor"><string name="distribution" value="ggx"/><float name="alpha" value="0.3"/><boolean name="sample_visible" value="false"/><spectrum name="eta" value="400:0.5, 500:1, 600:2, 700:3"/><spectrum name="k" value="2"/></bsdf>"#,
        REFLECTED,
        [0.380545, 0.422758, 0.603035],
        0.987811,
    ),
    (
        r#"<bsdf type="roughdielectric"><string name="distribution" value="beckmann"/><float name="alpha_u" value="0.3"/><float name="alpha_v" value="0.1"/><string name="int_ior" value="diamond"/><string name="ext_ior" value="water"/><rgb name="specular_transmittance" value=".5,1,.2"/></bsdf>"#,
        REFLECTED,
        [0.215852, 0.215852, 0.215852],
        0.215852,
    ),
    (
        r#"<bsdf type="roughdielectric"><string name="distribution" value="beckmann"/><float name="alpha_u" value="0.3"/><float name="alpha_v" value="0.1"/><string name="int_ior" value="diamond"/><string name="ext_ior" value="water"/><rgb name="specular_transmittance" value=".5,1,.2"/></bsdf>"#,
        INWARD,
        [0.726558, 1.45312, 0.290623],
        4.78533,
    ),
    (
        r#"<bsdf type="roughdielectric"><string name="distribution" value="ggx"/><float name="alpha" value="0.3"/><boolean name="sample_visible" value="false"/><float name="int_ior" value="1.2"/></bsdf>"#,
        INWARD,
        [51.6607, 51.6607, 51.6607],
        76.0204,
    ),
    (
        r#"<bsdf type="roughdielectric"><string name="distribution" value="ggx"/><float name="alpha" value="0.3"/><boolean name="sample_visible" value="false"/><float name="int_ior" value="1.2"/></bsdf>"#,
        OUTWARD,
        [22.4059, 22.4059, 22.4059],
        14.4917,
    ),
    (
        r#"<bsdf type="roughplastic"><string name="distribution" value="beckmann"/><float name="alpha" value="0.1"/><rgb name="diffuse_reflectance" value=".1,.27,.36"/></bsdf>"#,
        REFLECTED,
        [0.325817, 0.371243, 0.395293],
        1.34567,
    ),
    (
        r#"<bsdf type="roughplastic"><string name="distribution" value="ggx"/><float name="alpha" value="0.4"/><rgb name="diffuse_reflectance" value=".1,.27,.9"/><boolean name="nonlinear" value="true"/><string name="int_ior" value="diamond"/></bsdf>"#,
        REFLECTED,
        [0.101617, 0.108211, 0.159508],
        0.383586,
    ),
    (
        r#"<bsdf type="principled"><rgb name="base_color" value=".8,.3,.1"/><float name="metallic" value="0.7"/><float name="anisotropic" value="0.6"/><float name="roughness" value="0.3"/><float name="spec_tint" value="0.5"/></bsdf>"#,
        REFLECTED,
        [2.49791, 0.953485, 0.335715],
        3.30148,
    ),
    (
        r#"<bsdf type="principled"><rgb name="base_color" value=".8,.3,.1"/><float name="clearcoat" value="0.9"/><float name="clearcoat_gloss" value="0.3"/><float name="flatness" value="0.5"/><float name="sheen" value="0.5"/><float name="sheen_tint" value="0.4"/></bsdf>"#,
        REFLECTED,
        [0.309624, 0.190357, 0.14265],
        0.988356,
    ),
    (
        r#"<bsdf type="principled"><rgb name="base_color" value=".8,.3,.1"/><float name="spec_trans" value="0.6"/><float name="eta" value="1.6"/><float name="metallic" value="0.2"/><float name="clearcoat" value="0.5"/><float name="main_specular_sampling_rate" value="0.7"/><float name="sheen" value="0.3"/></bsdf>"#,
        REFLECTED,
        [0.37938, 0.195547, 0.122014],
        0.720527,
    ),
    (
        r#"<bsdf type="principled"><rgb name="base_color" value=".8,.3,.1"/><float name="spec_trans" value="0.6"/><float name="eta" value="1.6"/><float name="metallic" value="0.2"/><float name="clearcoat" value="0.5"/><float name="main_specular_sampling_rate" value="0.7"/><float name="sheen" value="0.3"/></bsdf>"#,
        INWARD,
        [2.68299, 1.64299, 0.948581],
        4.70184,
    ),
    (
        r#"<bsdf type="principled"><rgb name="base_color" value=".8,.3,.1"/><float name="spec_trans" value="0.6"/><float name="eta" value="1.6"/><float name="metallic" value="0.2"/><float name="clearcoat" value="0.5"/><float name="main_specular_sampling_rate" value="0.7"/><float name="sheen" value="0.3"/></bsdf>"#,
        OUTWARD,
        [2.51277, 1.53875, 0.888397],
        2.29141,
    ),
    (
        r#"<bsdf type="principledthin"><rgb name="base_color" value=".8,.3,.1"/><float name="spec_trans" value="0.6"/><float name="eta" value="1.6"/><float name="diff_trans" value="0.7"/><float name="spec_tint" value="0.4"/><float name="sheen" value="0.3"/><float name="sheen_tint" value="0.5"/><float name="flatness" value="0.5"/><float name="anisotropic" value="0.5"/></bsdf>"#,
        REFLECTED,
        [0.109996, 0.057637, 0.0366932],
        0.46783,
    ),
    (
        r#"<bsdf type="principledthin"><rgb name="base_color" value=".8,.3,.1"/><float name="spec_trans" value="0.6"/><float name="eta" value="1.6"/><float name="diff_trans" value="0.7"/><float name="spec_tint" value="0.4"/><float name="sheen" value="0.3"/><float name="sheen_tint" value="0.5"/><float name="flatness" value="0.5"/><float name="anisotropic" value="0.5"/></bsdf>"#,
        INWARD,
        [2.38712, 0.89517, 0.29839],
        1.59713,
    ),
];

#[test]
fn values_and_densities_are_those_of_mitsuba() {
    for (text, pair, value, pdf) in MITSUBA {
        let [wi, wo] = pair.map(|d| Vec3::from_array(d).normalize());
        let ours = build(text).eval(&interaction(), wi, wo, &()).unwrap();
        // Mitsuba's Bessel function is up to 0.5 % too small where its argument is just above 12.
        let tolerance = if text.contains("hair") { 5e-3 } else { 5e-4 };
        let near = |a: f32, b: f32| (a - b).abs() <= tolerance * b.abs() + 1e-7;
        assert!(near(ours.pdf, *pdf), "{text}: {} {pdf}", ours.pdf);
        for c in 0..3 {
            assert!(near(ours.value[c], value[c]), "{text}: {ours:?} {value:?}");
        }
    }
}

#[test]
fn a_nearly_smooth_metal_reflects_as_much_as_a_mirror() {
    let gold = r#"<string name="material" value="Au"/>"#;
    let mirror = build(&format!(r#"<bsdf type="conductor">{gold}</bsdf>"#));
    for distribution in ["beckmann", "ggx"] {
        let rough = build(&format!(
            r#"<bsdf type="roughconductor">{gold}<float name="alpha" value="0.0001"/>
            <string name="distribution" value="{distribution}"/></bsdf>"#
        ));
        for wi in incidences().filter(|wi| wi.z > 0.0) {
            let of = |material: &Material<Rgb>, u1, u2| {
                let sample = material.sample(&interaction(), wi, u1, u2, &());
                sample.map_or(Vec3::ZERO, |s| Vec3::from_array(s.weight.0))
            };
            let n = 2000;
            let mean = (0..n).fold(Vec3::ZERO, |sum, i| {
                let (u1, u2) = uniforms(i);
                sum + of(&rough, u1, u2) / n as f32
            });
            let expected = of(&mirror, 0.5, Vec2::splat(0.5));
            assert!((mean - expected).length() < 5e-3, "{wi}: {mean} {expected}");
        }
    }
}

#[test]
fn twosided_refuses_what_transmits() {
    let text = r#"<scene version="3.0.0"><bsdf type="twosided"><bsdf type="null"/></bsdf></scene>"#;
    let scene = Description::parse(text, Path::new("test.xml"), &Options::default()).unwrap();
    let bsdf = &scene.root().children(Kind::Bsdf)[0];
    let error = Material::build(bsdf, &Palettes::new(Rgb)).unwrap_err();
    assert!(error.to_string().contains("transmits light"), "{error}");
}

/// Materials whose textures differ between the points of a block.
const VARYING: &[(&str, &str)] = &[
    (
        "blendbsdf",
        r#"<bsdf type="blendbsdf"><texture name="weight" type="zoneplate"/><bsdf type="null"/><bsdf type="mask"><texture name="opacity" type="checkerboard"/><bsdf type="roughplastic"/></bsdf></bsdf>"#,
    ),
    (
        "bumpmap",
        r#"<bsdf type="bumpmap"><float name="scale" value="0.2"/><texture type="zoneplate"/><bsdf type="roughdielectric"><texture name="alpha" type="zoneplate"/></bsdf></bsdf>"#,
    ),
    (
        "mask",
        r#"<bsdf type="mask"><float name="cutoff" value="0.3"/><texture name="opacity" type="zoneplate"/><bsdf type="diffuse"/></bsdf>"#,
    ),
    (
        "normalmap",
        r#"<bsdf type="normalmap"><float name="scale" value="0.4"/><boolean name="against_v" value="true"/><texture name="normalmap" type="zoneplate"/><bsdf type="plastic"/></bsdf>"#,
    ),
    (
        "normalmap",
        r#"<bsdf type="normalmap"><boolean name="flip_invalid_normals" value="false"/><boolean name="use_shadowing_function" value="false"/><texture name="normalmap" type="checkerboard"/><bsdf type="plastic"/></bsdf>"#,
    ),
    (
        "phong",
        r#"<bsdf type="twosided"><bsdf type="phong"><texture name="exponent" type="zoneplate"><float name="color1" value="200"/></texture></bsdf></bsdf>"#,
    ),
    (
        "principled",
        r#"<bsdf type="principled"><rgb name="base_color" value="0.8, 0.9, 1"/><texture name="spec_trans" type="zoneplate"/><texture name="clearcoat" type="checkerboard"><float name="color0" value="0"/></texture><texture name="clearcoat_gloss" type="zoneplate"/><texture name="metallic" type="checkerboard"/><float name="specular" value="0.3"/></bsdf>"#,
    ),
    (
        "principledthin",
        r#"<bsdf type="principledthin"><texture name="base_color" type="checkerboard"><float name="color0" value="0"/></texture><texture name="spec_trans" type="zoneplate"/><texture name="eta" type="checkerboard"><float name="color0" value="1"/><float name="color1" value="1.7"/></texture><texture name="diff_trans" type="zoneplate"/></bsdf>"#,
    ),
];

/// A point, and what a material is asked there.
#[derive(Clone, Debug)]
struct Question {
    at: Interaction<'static>,
    wo: Vec3,
    u1: f32,
    u2: Vec2,
}

impl Question {
    /// The `i`-th; some are at the edges.
    fn new(i: u32) -> Self {
        let of = |k: u32| uniforms(k * 100_000 + i);
        let direction = |k| Vec3::from(warp::uniform_sphere(of(k).1.into()));
        let (u1, u2) = of(0);
        let wi = match i % 19 {
            0 => Vec3::Z,
            1 => Vec3::X,
            _ => direction(1),
        };
        let normal = Vec3::from(warp::cosine_hemisphere(of(2).1.into()));
        let shading = (normal + 0.5 * direction(3)).normalize();
        let dp_du = 3.0 * direction(4);
        let (time, uv) = of(5);
        Self {
            at: Interaction {
                position: 10.0 * direction(6),
                normal,
                frame: Frame::along(shading, dp_du),
                dp_du,
                dp_dv: 2.0 * direction(7),
                wi,
                time,
                ..Interaction::at_uv(3.0 * uv)
            },
            wo: if i % 19 == 2 { -wi } else { direction(8) },
            u1: if i % 19 == 3 { 0.0 } else { u1 },
            u2,
        }
    }
}

/// A value, and a direction drawn.
type Answer = (
    Option<BsdfValue<Samples<3>>>,
    Option<BsdfSample<Samples<3>>>,
);

/// What a material says one by one.
fn answer(material: &Material<Rgb>, question: &Question) -> Answer {
    let Question { at, wo, u1, u2 } = question;
    (
        material.eval(at, at.wi, *wo, &()),
        material.sample(at, at.wi, *u1, *u2, &()),
    )
}

/// The bits of an answer.
fn bits((value, sample): &Answer) -> Vec<Option<u32>> {
    let mut bits = Vec::new();
    let mut push = |numbers: &[f32]| bits.extend(numbers.iter().map(|x| Some(x.to_bits())));
    if let Some(BsdfValue { value, pdf }) = value {
        push(&[value[0], value[1], value[2], *pdf]);
    }
    if let Some(s) = sample {
        push(&s.wo.to_array());
        push(&[s.weight[0], s.weight[1], s.weight[2], s.pdf, s.eta]);
        push(&[s.delta, s.null].map(|flag| f32::from(u8::from(flag))));
    }
    bits.extend([value.is_none(), sample.is_none()].map(|none| none.then_some(0)));
    bits
}

/// A block of questions.
struct Block<'a>(&'a [Question]);

impl Source for Block<'_> {
    fn interaction(&self, lane: usize) -> Interaction<'_> {
        self.0[lane].at.clone()
    }

    fn time(&self, lane: usize) -> f32 {
        self.0[lane].at.time
    }

    fn on_mesh(&self, _lane: usize) -> Option<(&Mesh, u32, Vec2)> {
        None
    }
}

impl Block<'_> {
    fn numbers<F: Lanes>(&self, of: impl Fn(&Question) -> f32) -> F {
        F::from_fn(|lane| of(&self.0[lane]))
    }

    fn vectors<F: Lanes>(&self, of: impl Fn(&Question) -> Vec3) -> lanes::Vec3<F> {
        lanes::Vec3::new(
            self.numbers(|question| of(question).x),
            self.numbers(|question| of(question).y),
            self.numbers(|question| of(question).z),
        )
    }

    fn points<F: Lanes>(&self) -> Points<'_, F> {
        Points {
            active: F::Mask::from_bits(!(u32::MAX << F::WIDTH)),
            position: self.vectors(|q| q.at.position),
            error: self.vectors(|q| q.at.error),
            normal: self.vectors(|q| q.at.normal),
            frame: lanes::Frame {
                s: self.vectors(|q| q.at.frame.s),
                t: self.vectors(|q| q.at.frame.t),
                n: self.vectors(|q| q.at.frame.n),
            },
            uv: self.vectors(|q| q.at.uv.extend(0.0)).xy(),
            dp_du: self.vectors(|q| q.at.dp_du),
            dp_dv: self.vectors(|q| q.at.dp_dv),
            footprint: [0, 1].map(|i| self.vectors(|q| q.at.footprint[i].extend(0.0)).xy()),
            wi: self.vectors(|q| q.at.wi),
            source: self,
        }
    }
}

/// Asks a material block by block.
struct Ask<'a> {
    material: &'a Material<Rgb>,
    questions: &'a [Question],
}

impl Task for Ask<'_> {
    type Output = Vec<Answer>;

    #[inline(always)]
    fn run<F: Lanes>(self) -> Vec<Answer> {
        let mut answers = Vec::new();
        for questions in self.questions.chunks_exact(F::WIDTH) {
            let block = Block(questions);
            let at = block.points::<F>();
            let wo = block.vectors(|q| q.wo);
            let u1 = block.numbers(|q| q.u1);
            let u2 = block.vectors(|q| q.u2.extend(0.0)).xy();
            let w = &[(); lanes::MAX_LANES];
            let surface = self.material.surface(&at, w);
            let (values, samples) = (surface.eval(wo), surface.sample(u1, u2));
            let of = |mask: F::Mask, lane: usize| mask.to_bits() >> lane & 1 == 1;
            answers.extend((0..F::WIDTH).map(|lane| {
                let value: Samples<3> = values.value.sample(lane);
                let pdf = values.pdf.lane(lane);
                let value = BsdfValue { value, pdf };
                let sample = BsdfSample {
                    wo: samples.wo.lane(lane),
                    weight: samples.weight.sample(lane),
                    pdf: samples.pdf.lane(lane),
                    eta: samples.eta.lane(lane),
                    delta: of(samples.delta, lane),
                    null: of(samples.null, lane),
                };
                let there = pdf > 0.0 || !value.value.is_black();
                let drawn = of(samples.drawn, lane);
                (there.then_some(value), drawn.then_some(sample))
            }));
        }
        answers
    }
}

#[test]
fn a_block_is_told_what_its_points_are_told_one_by_one() {
    let questions: Vec<Question> = (0..640).map(Question::new).collect();
    for (name, text) in MATERIALS.iter().chain(VARYING) {
        let material = build(text);
        let expected = questions.iter().map(|q| answer(&material, q));
        let expected: Vec<Answer> = expected.collect();
        for kernel in Kernel::all() {
            let found = kernel.run(Ask {
                material: &material,
                questions: &questions,
            });
            assert_eq!(found.len(), expected.len());
            for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
                assert!(
                    bits(found) == bits(expected),
                    "{name}, {}, {:?}: {found:?} {expected:?}",
                    kernel.name(),
                    questions[i]
                );
            }
        }
    }
}

/// The files hold the same numbers as red, green and blue and at three wavelengths.
#[test]
fn what_was_measured_goes_straight_between_wavelengths_and_stays_beyond_them() {
    let bands = Bands::<8>::visible(8).unwrap();
    let identity = Color::Curve(vec![(100.0, 100.0), (2000.0, 2000.0)]);
    let identity = bands.store(&identity, Role::Quantity).unwrap();
    for (_, text) in MATERIALS.iter().filter(|(name, _)| *name == "measured") {
        let text = format!(r#"<scene version="3.0.0">{text}</scene>"#);
        let path = FILES.path().join("test.xml");
        let scene = Description::parse(&text, &path, &Options::default()).unwrap();
        let node = scene.root().children(Kind::Bsdf)[0];
        let in_rgb = Material::build(&node, &Palettes::new(Rgb)).unwrap();
        let in_bands = Material::build(&node, &Palettes::new(bands.clone())).unwrap();
        for i in 0..50 {
            let (u, v) = (uniforms(i), uniforms(1000 + i));
            let [wi, wo] = [u.1, v.1].map(|u| Vec3::from(warp::cosine_hemisphere(u.into())));
            let w = bands.wavelengths(|| u.0);
            let expected = in_rgb.eval(&interaction(), wi, wo, &()).unwrap().value;
            let found = in_bands.eval(&interaction(), wi, wo, &w).unwrap().value;
            let nm = Bands::<8>::evaluate(&identity, &w);
            for band in 0..8 {
                let place = ((nm[band] - 450.0) / 100.0).clamp(0.0, 2.0);
                let low = (place as usize).min(1);
                let part = place - low as f32;
                let expected = expected[low] * (1.0 - part) + expected[low + 1] * part;
                let error = (found[band] - expected).abs();
                assert!(
                    error < 1e-4 * expected.max(1e-3),
                    "{} nm: {} {expected}",
                    nm[band],
                    found[band]
                );
            }
            assert!((380.0..=780.0).contains(&nm[3]), "{}", nm[3]);
        }
    }
}
