//! Levels of images against closed forms, and what is looked up of them.

use std::path::Path;

use glam::Vec2;

use super::probes::{Probes, Shape};
use super::pyramid::Levels;
use super::*;
use crate::budget::Budget;
use crate::color::{Bands, Samples};
use crate::description::{Description, Options};
use crate::image::Image;
use crate::lanes::{Kernel, Task};
use crate::math::random;

/// Sizes that halve, that do not, and that are thin.
const SIZES: [[usize; 2]; 6] = [[16, 16], [7, 5], [1, 9], [12, 1], [31, 64], [2, 3]];

fn number(i: usize) -> f32 {
    random::unit(random::bits(5, i as u32))
}

/// An image of random colours, row by row.
fn noise([width, height]: [usize; 2]) -> Vec<[f32; 3]> {
    (0..width * height)
        .map(|i| [0, 1, 2].map(|channel| number(3 * i + channel)))
        .collect()
}

/// What becomes of a bitmap of an image that is kept as it is.
fn bitmap<C: ColorModel, T>(
    size: [usize; 2],
    texels: &[[f32; 3]],
    properties: &str,
    palette: &Palette<C>,
    take: impl FnOnce(&Palette<C>, Result<Texture<C>>) -> T,
) -> T {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.exr");
    let names = ["R", "G", "B"].map(String::from).to_vec();
    let [width, height] = size.map(|n| n as u32);
    let image = Image::from_data(width, height, names, texels.concat()).unwrap();
    crate::image::write(&path, &image, &Default::default()).unwrap();
    let text = format!(
        "<scene version='3.0.0'><texture type='bitmap'><string name='filename' value='{}'/>
         <boolean name='raw' value='true'/>{properties}</texture></scene>",
        path.display()
    );
    let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
    let node = scene.root().children(Kind::Texture)[0];
    take(palette, Texture::build(&node, palette))
}

/// A bitmap of such an image.
fn built(size: [usize; 2], texels: &[[f32; 3]], properties: &str) -> Texture<Rgb> {
    let palette = Palette::new(Rgb);
    bitmap(size, texels, properties, &palette, |_, texture| {
        texture.unwrap()
    })
}

fn filtered(filter: &str, wrap: &str) -> String {
    format!(
        "<string name='filter_type' value='{filter}'/><string name='wrap_mode' value='{wrap}'/>"
    )
}

/// The value at a place where a circle of that diameter, in texels of an image of `size`, is seen.
fn seen(texture: &Texture<Rgb>, uv: Vec2, diameter: f32, size: [usize; 2]) -> [f32; 3] {
    let [width, height] = size.map(|n| n as f32);
    let at = Interaction {
        footprint: [
            Vec2::new(diameter / width, 0.0),
            Vec2::new(0.0, diameter / height),
        ],
        ..Interaction::at_uv(uv)
    };
    texture.eval(&at, &()).0
}

fn near(found: [f32; 3], expected: [f32; 3]) -> bool {
    found
        .iter()
        .zip(expected)
        .all(|(found, expected)| (found - expected).abs() < 2e-5)
}

fn mean(texels: &[[f32; 3]]) -> [f32; 3] {
    let sum = |channel: usize| texels.iter().map(|t| f64::from(t[channel])).sum::<f64>();
    [0, 1, 2].map(|channel| (sum(channel) / texels.len() as f64) as f32)
}

/// The levels of an image, each with its size.
fn levels(size: [usize; 2], texels: &[[f32; 3]]) -> Vec<([usize; 2], Vec<[f32; 3]>)> {
    let levels = Levels::new(size, Levels::sizes(size), |i| texels[i]);
    let mut rest = levels.pixels.iter();
    let of = |[width, height]: &[usize; 2]| rest.by_ref().take(width * height).collect();
    let each: Vec<Vec<[f32; 3]>> = levels.sizes.iter().map(of).collect();
    levels.sizes.into_iter().zip(each).collect()
}

#[test]
fn every_level_halves_the_one_below_and_has_the_mean_of_the_image() {
    for size in SIZES {
        let texels = noise(size);
        let all = mean(&texels);
        let mut below = size;
        for (of, texels) in levels(size, &texels) {
            assert_eq!(of, below.map(|n| (n / 2).max(1)), "{size:?}");
            assert_eq!(texels.len(), of[0] * of[1]);
            assert!(near(mean(&texels), all), "{size:?}, {of:?}");
            below = of;
        }
        assert_eq!(below, [1, 1], "{size:?}");
        let grey = vec![[0.1, 0.7, 3.0]; size[0] * size[1]];
        for (of, texels) in levels(size, &grey) {
            assert!(texels.iter().all(|t| *t == grey[0]), "{size:?}, {of:?}");
        }
    }
    // Three texels in one, and five in two: the middle one is part of both.
    let row = [3.0, 6.0, 9.0].map(|v| [v; 3]);
    assert_eq!(levels([3, 1], &row)[0].1, [[6.0; 3]]);
    let row = [5.0, 10.0, 20.0, 40.0, 80.0].map(|v| [v; 3]);
    assert_eq!(levels([5, 1], &row)[0].1, [[10.0; 3], [52.0; 3]]);
    assert!(levels([1, 1], &[[1.0; 3]]).is_empty());
}

#[test]
fn a_circle_of_two_to_the_k_texels_sees_the_level_k() {
    let size = [16, 32];
    let texels = noise(size);
    let texture = built(size, &texels, &filtered("trilinear", "repeat"));
    let levels = levels(size, &texels);
    for (k, ([width, height], level)) in (1..).zip(&levels) {
        for (i, expected) in level.iter().enumerate() {
            let (x, y) = ((i % width) as f32, (i / width) as f32);
            let uv = Vec2::new((x + 0.5) / *width as f32, (y + 0.5) / *height as f32);
            let found = seen(&texture, uv, f32::from(1_u16 << k), size);
            assert!(near(found, *expected), "{k} {uv}: {found:?} {expected:?}");
        }
    }
    // Between two levels, half of each; beyond the last that.
    let uv = Vec2::new(0.3, 0.6);
    let at = |diameter| seen(&texture, uv, diameter, size);
    for k in 0..5 {
        let [lower, upper] = [k, k + 1].map(|k| at(f32::from(1_u16 << k)));
        let half = at(f32::from(1_u16 << k) * std::f32::consts::SQRT_2);
        let expected = [0, 1, 2].map(|c| 0.5 * (lower[c] + upper[c]));
        assert!(near(half, expected), "{k}: {half:?} {expected:?}");
    }
    for huge in [64.0, 1e9] {
        assert!(near(at(huge), mean(&texels)), "{huge}");
    }
}

#[test]
fn what_is_magnified_or_of_nobody_knows_what_size_is_bilinear() {
    for wrap in ["repeat", "mirror", "clamp"] {
        let size = [7, 5];
        let texels = noise(size);
        let bilinear = built(size, &texels, &filtered("bilinear", wrap));
        for filter in ["trilinear", "anisotropic"] {
            let texture = built(size, &texels, &filtered(filter, wrap));
            for i in 0..200 {
                let uv = Vec2::new(number(i), number(i + 1000)) * 5.0 - 2.0;
                let expected = bilinear.eval(&Interaction::at_uv(uv), &()).0;
                for diameter in [0.0, 0.01, 0.9, f32::NAN] {
                    let found = seen(&texture, uv, diameter, size);
                    assert_eq!(found, expected, "{filter} {wrap} {uv} {diameter}");
                }
            }
            let nowhere = seen(&texture, Vec2::NAN, 3.0, size);
            assert_eq!(nowhere, [0.0; 3]);
        }
    }
}

#[test]
fn every_level_goes_on_beyond_its_edge_as_the_image_does() {
    let size = [8, 4];
    let texels = noise(size);
    let (of, level) = levels(size, &texels).remove(0);
    let row = |y: usize, x: usize| level[y * of[0] + x];
    // At the left edge, in the middle of the first row.
    let uv = Vec2::new(0.0, 0.25);
    for (wrap, beyond) in [("repeat", of[0] - 1), ("mirror", 0), ("clamp", 0)] {
        let texture = built(size, &texels, &filtered("trilinear", wrap));
        let found = seen(&texture, uv, 2.0, size);
        let expected = [0, 1, 2].map(|c| 0.5 * (row(0, 0)[c] + row(0, beyond)[c]));
        assert!(near(found, expected), "{wrap}: {found:?} {expected:?}");
    }
    // A whole image further to the right: again, turned over, or the last texel.
    let uv = Vec2::new(1.125, 0.25);
    for (wrap, there) in [("repeat", 0), ("mirror", of[0] - 1), ("clamp", of[0] - 1)] {
        let texture = built(size, &texels, &filtered("trilinear", wrap));
        let found = seen(&texture, uv, 2.0, size);
        assert!(near(found, row(0, there)), "{wrap}: {found:?}");
    }
}

/// The lengths of the probes of an ellipse, how many they are, and where they lie.
fn probes(ways: [Vec2; 2], size: [usize; 2], shape: Shape) -> (f32, Vec<Vec2>) {
    let probes = Probes::<f32>::new(ways.map(lanes::Vec2::from), &Mat3::IDENTITY, size, shape);
    let places = (0..probes.most()).map(|i| probes.place(i).into());
    (probes.length, places.collect())
}

#[test]
fn probes_lie_along_an_ellipse_and_are_as_long_as_it_is_wide() {
    // 12 texels along the diagonal of texels, and 3 across it; whichever conjugate diameters tell of it.
    let size = [64, 32];
    let texel = Vec2::new(64.0, 32.0).recip();
    let diagonal = Vec2::ONE.normalize();
    for turn in 0..7 {
        let (sin, cos) = (turn as f32 * 0.9).sin_cos();
        let (long, short) = (12.0 * diagonal, 3.0 * diagonal.perp());
        let ways = [cos * long + sin * short, cos * short - sin * long].map(|way| way * texel);
        let (length, places) = probes(ways, size, Shape::Long(16));
        assert!((length - 3.0).abs() < 1e-4, "{length}");
        assert_eq!(places.len(), 4);
        let ends = [places[0], places[3]].map(|place| place / texel);
        assert!((ends[0] + ends[1]).length() < 1e-4, "{ends:?}");
        assert!((ends[0].distance(ends[1]) - 9.0).abs() < 1e-3, "{ends:?}");
        assert!(
            ends[0].perp_dot(diagonal).abs() < 1e-3,
            "{turn}: {ends:?} beside the axis"
        );
        // Too few: each longer.
        let (length, places) = probes(ways, size, Shape::Long(2));
        assert!((length - 6.0).abs() < 1e-4 && places.len() == 2, "{length}");
        let (length, places) = probes(ways, size, Shape::Round);
        assert!((length - 12.0).abs() < 1e-4, "{length}");
        assert_eq!(places, [Vec2::ZERO]);
    }
    // A circle, and what is smaller than a texel, need one.
    for scale in [5.0, 0.2] {
        let ways = [Vec2::X, Vec2::Y].map(|way| scale * way * texel);
        assert_eq!(probes(ways, size, Shape::Long(16)).1, [Vec2::ZERO]);
    }
}

#[test]
fn an_anisotropic_look_along_stripes_sees_them_where_a_round_one_does_not() {
    let size = [64, 64];
    let texels: Vec<[f32; 3]> = (0..64 * 64)
        .map(|i| [if i / 64 % 16 < 8 { 1.0 } else { 0.0 }; 3])
        .collect();
    let at = Interaction {
        footprint: [Vec2::X * (32.0 / 64.0), Vec2::Y * (2.0 / 64.0)],
        ..Interaction::at_uv(Vec2::new(0.5, 4.0 / 64.0))
    };
    let value = |filter: &str, more: &str| {
        let properties = filtered(filter, "repeat") + more;
        built(size, &texels, &properties).eval(&at, &()).0[0]
    };
    let single = "<integer name='max_anisotropy' value='1'/>";
    for (filter, more, expected) in [
        ("anisotropic", "", 1.0),
        ("trilinear", "", 0.5),
        ("anisotropic", single, 0.5),
    ] {
        let found = value(filter, more);
        assert!((found - expected).abs() < 1e-5, "{filter} {more}: {found}");
    }
}

/// What blocks of places see.
struct Looks<'a> {
    texture: &'a Texture<Rgb>,
    places: &'a [Interaction<'static>],
}

impl Task for Looks<'_> {
    type Output = Vec<[u32; 3]>;

    #[inline(always)]
    fn run<F: Lanes>(self) -> Self::Output {
        let mut found = Vec::new();
        for places in self.places.chunks_exact(F::WIDTH) {
            let load = |of: fn(&Interaction<'static>) -> Vec2| {
                let number = |axis: usize| F::from_fn(|lane| of(&places[lane])[axis]);
                lanes::Vec2::new(number(0), number(1))
            };
            let one = Points::one(&places[0]);
            let all = |v: lanes::Vec3<f32>| lanes::Vec3::<F>::all(v.into());
            let zero = lanes::Vec3::splat(0.0);
            let points = Points {
                active: F::Mask::splat(true),
                position: zero,
                error: zero,
                normal: all(one.normal),
                frame: lanes::Frame::around(all(one.normal)),
                uv: load(|at| at.uv),
                dp_du: all(one.dp_du),
                dp_dv: all(one.dp_dv),
                footprint: [load(|at| at.footprint[0]), load(|at| at.footprint[1])],
                wi: all(one.wi),
                source: one.source,
            };
            let values = self.texture.eval_lanes(&points, &[(); MAX_LANES]);
            found.extend((0..F::WIDTH).map(|lane| {
                let value: Samples<3> = values.sample(lane);
                value.0.map(f32::to_bits)
            }));
        }
        found
    }
}

#[test]
fn lanes_see_what_places_see_one_by_one() {
    let size = [31, 20];
    let texels = noise(size);
    let places: Vec<Interaction<'static>> = (0..640)
        .map(|i| {
            let way = |n: usize| {
                let pair = Vec2::new(number(7 * i + n), number(7 * i + n + 1)) - 0.5;
                // From far below a texel to far beyond the image.
                pair * 10_f32.powf(4.0 * number(7 * i + 6) - 3.0)
            };
            Interaction {
                footprint: [way(2), way(4)],
                ..Interaction::at_uv(8.0 * Vec2::new(number(i), number(9 * i)) - 4.0)
            }
        })
        .collect();
    let to_uv = "<transform name='to_uv'><rotate z='1' angle='20'/><scale x='3'/></transform>";
    for filter in ["trilinear", "anisotropic"] {
        for wrap in ["repeat", "mirror", "clamp"] {
            let texture = built(size, &texels, &(filtered(filter, wrap) + to_uv));
            let alone = |at: &Interaction<'_>| texture.eval(at, &()).0.map(f32::to_bits);
            let expected: Vec<[u32; 3]> = places.iter().map(alone).collect();
            for kernel in Kernel::all() {
                let found = kernel.run(Looks {
                    texture: &texture,
                    places: &places,
                });
                assert!(found == expected, "{filter} {wrap} {}", kernel.name());
            }
        }
    }
}

#[test]
fn every_color_model_has_levels() {
    let size = [6, 4];
    let texels: Vec<[f32; 3]> = (0..24).map(|i| [number(i); 3]).collect();
    let expected = mean(&texels)[0];
    let at = Interaction {
        footprint: [Vec2::X, Vec2::Y],
        ..Interaction::at_uv(Vec2::new(0.2, 0.9))
    };
    let trilinear = filtered("trilinear", "repeat");
    let numbers = bitmap(size, &texels, &trilinear, &Palette::new(Mono), |_, t| {
        t.unwrap()
    });
    assert!((numbers.eval(&at, &())[0] - expected).abs() < 1e-5);
    let bands = Bands::<8>::visible(8).unwrap();
    let wavelengths = bands.wavelengths(|| 0.5);
    let spectra = bitmap(size, &texels, &trilinear, &Palette::new(bands), |_, t| {
        t.unwrap()
    });
    let value = spectra.eval(&at, &wavelengths);
    for band in 0..8 {
        assert!((value[band] - expected).abs() < 1e-5, "{value:?}");
    }
}

#[test]
fn levels_are_made_where_they_are_asked_for_and_counted() {
    let kept = |filter: &str| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.exr");
        let names = ["R", "G", "B"].map(String::from).to_vec();
        let image = Image::from_data(64, 64, names, noise([64, 64]).concat()).unwrap();
        crate::image::write(&path, &image, &Default::default()).unwrap();
        let text = format!(
            "<scene version='3.0.0'><texture type='bitmap'><string name='filename' value='{}'/>{}</texture></scene>",
            path.display(),
            filtered(filter, "repeat")
        );
        let budget = Budget::new(Some(1 << 30));
        let scene = Description::parse(&text, Path::new("test.xml"), &Options::default());
        let scene = scene.unwrap().within(&budget);
        let before = budget.left().unwrap();
        let palettes = Palettes::new(Rgb);
        let node = scene.root().children(Kind::Texture)[0];
        Texture::build(&node, &palettes.colors).unwrap();
        Texture::build(&node, &palettes.colors).unwrap();
        (before - budget.left().unwrap(), palettes.have_mipmaps())
    };
    let (plain, mipmapped) = kept("bilinear");
    assert!(!mipmapped);
    let above: u64 = [32_u64, 16, 8, 4, 2, 1].map(|n| n * n).iter().sum();
    assert_eq!(kept("trilinear"), (plain + 12 * above, true));
    assert_eq!(kept("nearest"), (plain, false));
}

#[test]
fn a_strict_scene_has_no_filters_of_our_own() {
    for (filter, taken) in [
        ("bilinear", true),
        ("nearest", true),
        ("trilinear", false),
        ("anisotropic", false),
    ] {
        let text = format!(
            "<scene version='3.0.0'><texture type='bitmap'><string name='filename' value='none.png'/>{}</texture></scene>",
            filtered(filter, "repeat")
        );
        let options = Options {
            strict: true,
            ..Options::default()
        };
        let scene = Description::parse(&text, Path::new("test.xml"), &options).unwrap();
        let node = scene.root().children(Kind::Texture)[0];
        let error = Texture::build(&node, &Palette::new(Rgb)).unwrap_err();
        let says = error.to_string().contains("Étendue's own");
        assert_eq!(says, !taken, "{filter}: {error}");
    }
}

#[test]
fn heights_far_away_slope_as_their_means_do() {
    // A steep zigzag of one texel on a gentle slope.
    let size = [64, 64];
    let texels: Vec<[f32; 3]> = (0..64 * 64)
        .map(|i| {
            let x = i % 64;
            [0.01 * x as f32 + if x % 2 == 0 { 0.5 } else { 0.0 }; 3]
        })
        .collect();
    let texture = bitmap(
        size,
        &texels,
        &filtered("trilinear", "clamp"),
        &Palette::new(Mono),
        |_, t| t.unwrap(),
    );
    let at = Interaction {
        footprint: [Vec2::X * (8.0 / 64.0), Vec2::Y * (8.0 / 64.0)],
        ..Interaction::at_uv(Vec2::new(0.45, 0.5))
    };
    let [along_u, along_v] = texture.gradient(&at, &());
    assert!((along_u[0] - 0.01 * 64.0).abs() < 1e-3, "{along_u:?}");
    assert!(along_v[0].abs() < 1e-3, "{along_v:?}");
}
