//! Does the z-buffer see what rays see? Every scene of `scenes/` and every shape, at pixel centres.

use std::fs;
use std::io::Write;
use std::num::NonZeroUsize;
use std::sync::Mutex;

use etendue::budget::Budget;
use etendue::description::{Description, Options as ReadOptions};
use etendue::image::Image;
use etendue::raster::Agreement;
use etendue::render::{Options, Overrides, Phase, Picture, Progress, Session, Silent, render};
use etendue::sensor::Window;
use etendue::shape;

use super::support::{at, describe, image_of, rendered, scene};

fn agreement(mut description: Description) -> Agreement {
    Overrides {
        size: Some((160, 120)),
        ..Overrides::default()
    }
    .apply(&mut description);
    let mut session = Session::default();
    let agreement = session.agreement(&description, &Options::default(), &Silent);
    agreement.unwrap_or_else(|e| panic!("{e}"))
}

fn describe_all(agreement: &Agreement) -> String {
    let lines = agreement.quantities.iter().map(|q| {
        let [x, y] = q.at;
        format!(
            "  {}: {} of {}, up to {:.1e} at {x}, {y}\n",
            q.name, q.differing, q.pixels, q.worst
        )
    });
    lines.collect()
}

#[test]
fn rays_and_the_z_buffer_see_the_same_in_every_scene() {
    let mut scenes: Vec<_> = fs::read_dir(at("scenes"))
        .expect("there are scenes")
        .map(|entry| entry.expect("the folder can be read").path())
        .filter(|path| path.extension().is_some_and(|e| e == "xml"))
        .collect();
    scenes.sort();
    assert!(!scenes.is_empty());
    for path in scenes {
        let name = path.display();
        let description = Description::read(&path, &ReadOptions::default(), &Budget::default());
        let found = agreement(description.unwrap_or_else(|e| panic!("{e}")));
        assert!(found.agrees(), "{name}:\n{}", describe_all(&found));
        if found.undrawn > 0 {
            let _ = writeln!(
                std::io::stderr(),
                "SKIPPED, {} pixels of {name}: {:?}",
                found.undrawn,
                found.notes
            );
            continue;
        }
        // Spikes and their shadows are silhouettes nearly everywhere.
        let looked_at = found.pixels - found.silhouettes;
        assert!(looked_at * 8 > found.pixels, "{name}: {found:?}");
    }
}

/// The shapes that no table can make by itself: they need files, or are made of others.
const NEEDS_MORE: [&str; 14] = [
    "bsplinecurve",
    "ellipsoids",
    "ellipsoidsmesh",
    "gltf",
    "group",
    "instance",
    "linearcurve",
    "merge",
    "obj",
    "ply",
    "sdfgrid",
    "serialized",
    "shapegroup",
    "stl",
];

/// What a shape needs to be one.
fn corners(shape: &str) -> &'static str {
    match shape {
        "polygon" => {
            "<vector name='p0' value='-1,-1,0'/><vector name='p1' value='1,-1,0'/><vector name='p2' value='1.2,0.7,0'/><vector name='p3' value='0,0.2,0'/><vector name='p4' value='-0.8,1,0'/>"
        }
        "triangle" => {
            "<vector name='p0' value='-1,-1,0'/><vector name='p1' value='1,-1,0'/><vector name='p2' value='0.3,1,0.4'/>"
        }
        _ => "",
    }
}

#[test]
fn every_shape_looks_the_same_to_rays_and_to_the_z_buffer() {
    let mut skipped = Vec::new();
    for (name, _) in shape::plugins() {
        if NEEDS_MORE.contains(&name) {
            continue;
        }
        let inside = corners(name);
        for sensor in ["perspective", "orthographic"] {
            for (stand, turn) in [
                ("", ""),
                (
                    "<scale x='-0.6' y='0.9' z='0.8'/>",
                    "<rotate y='1' angle='25'/>",
                ),
            ] {
                let body = format!(
                    "<sensor type='{sensor}'><float name='near_clip' value='0.1'/><float name='far_clip' value='100'/>
                    <transform name='to_world'><scale x='1.6' y='1.6'/><lookat origin='1,2.2,3.4' target='0,0,0.2' up='0,1,0'/></transform></sensor>
                    <shape type='shapegroup' id='g'><shape type='{name}'>{inside}<transform name='to_world'>{turn}</transform></shape></shape>
                    <shape type='instance'><ref id='g'/><transform name='to_world'>{stand}</transform></shape>"
                );
                let text = scene(&body);
                let found = agreement(describe(&text));
                if !found.notes.is_empty() && found.triangles == 0 {
                    skipped.push(name);
                    continue;
                }
                let table = describe_all(&found);
                assert!(found.agrees(), "{name} {sensor}:\n{table}");
                assert!(found.seen > 500, "{name} {sensor}: {found:?}");
            }
        }
    }
    if !skipped.is_empty() {
        skipped.dedup();
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED, for they have no triangles: {}",
            skipped.join(", ")
        );
    }
}

/// A scene with a floor, a sphere, a cube in an instance and a mirror, lit by lights without extent.
fn lit(integrator: &str) -> String {
    scene(&format!(
        "<integrator type='{integrator}'/>
        <sensor type='perspective'><transform name='to_world'><lookat origin='1,3,4' target='0,0,0' up='0,1,0'/></transform>
        <film type='hdrfilm'><integer name='width' value='60'/><integer name='height' value='45'/><rfilter type='box'/></film>
        <sampler type='stratified'><integer name='sample_count' value='16'/></sampler></sensor>
        <emitter type='ambient'><rgb name='radiance' value='0.1'/></emitter>
        <emitter type='directional'><vector name='direction' value='-0.4,-1,-0.3'/><rgb name='irradiance' value='0.5'/></emitter>
        <emitter type='point'><point name='position' value='2,3,1'/><rgb name='intensity' value='0.7,0.6,0.4'/></emitter>
        <shape type='rectangle'><bsdf type='phong'><rgb name='ambient_reflectance' value='0.3'/></bsdf>
        <transform name='to_world'><rotate x='1' angle='-90'/><scale value='4'/><translate y='-1'/></transform></shape>
        <shape type='sphere'><bsdf type='phong'><rgb name='diffuse_reflectance' value='0.5,0.2,0.1'/></bsdf></shape>
        <shape type='shapegroup' id='g'><shape type='cube'/></shape>
        <shape type='instance'><ref id='g'/><transform name='to_world'><scale value='0.4'/><rotate y='1' angle='30'/><translate x='1.3' z='0.9'/></transform></shape>"
    ))
}

/// How far values are apart, on average.
fn mean_difference(a: &Image, b: &Image) -> f32 {
    let differences = a.data().iter().zip(b.data()).map(|(a, b)| (a - b).abs());
    differences.sum::<f32>() / a.data().len() as f32
}

#[test]
fn what_the_z_buffer_draws_is_what_the_integrator_phong_renders() {
    let [drawn, rendered] = ["raster", "phong"].map(|name| image_of(&lit(name), 0));
    let stride = drawn.channels().len();
    let pairs = drawn
        .data()
        .chunks(stride)
        .zip(rendered.data().chunks(stride));
    let apart = pairs.map(|(a, b)| {
        let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        differences.fold(0.0, f32::max)
    });
    let apart: Vec<f32> = apart.collect();
    let far = apart.iter().filter(|apart| **apart > 0.02).count();
    // Edges of things, and of shadows, which a map has in steps.
    assert!(far * 10 < apart.len(), "{far} of {}", apart.len());
    let mean = apart.iter().sum::<f32>() / apart.len() as f32;
    assert!(mean < 0.02, "{mean}");
}

#[test]
fn textures_lie_on_every_shape_where_rays_see_them() {
    for (name, _) in shape::plugins() {
        if NEEDS_MORE.contains(&name) {
            continue;
        }
        let inside = corners(name);
        let [drawn, rendered] = ["raster", "phong"].map(|integrator| {
            let text = scene(&format!(
                "<integrator type='{integrator}'><boolean name='shadows' value='false'/></integrator>
                <sensor type='perspective'><transform name='to_world'><lookat origin='1,2.2,3.4' target='0,0,0.2' up='0,1,0'/></transform>
                <film type='hdrfilm'><integer name='width' value='48'/><integer name='height' value='36'/><rfilter type='box'/></film>
                <sampler type='stratified'><integer name='sample_count' value='16'/></sampler></sensor>
                <emitter type='point'><point name='position' value='2,3,4'/></emitter>
                <shape type='{name}'>{inside}<bsdf type='twosided'><bsdf type='diffuse'><texture name='reflectance' type='checkerboard'>
                <transform name='to_uv'><scale x='2' y='2'/></transform></texture></bsdf></bsdf></shape>"
            ));
            image_of(&text, 0)
        });
        let brightest = rendered.data().iter().copied().fold(0.0, f32::max);
        let mean = mean_difference(&drawn, &rendered) / brightest;
        assert!(mean < 0.04, "{name}: {mean}");
    }
}

#[test]
fn in_place_of_another_integrator_lights_are_as_bright_as_they_were() {
    let text = scene(
        "<integrator type='path'><integer name='max_depth' value='2'/></integrator>
        <sensor type='perspective'><transform name='to_world'><lookat origin='0,3,4' target='0,0,0' up='0,1,0'/></transform>
        <film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='18'/><rfilter type='box'/></film>
        <sampler type='stratified'><integer name='sample_count' value='16'/></sampler></sensor>
        <emitter type='point'><point name='position' value='0,3,0'/></emitter><shape type='sphere'/>",
    );
    let [path, phong, raster] = [None, Some("phong"), Some("raster")].map(|integrator| {
        let overrides = Overrides {
            integrator: integrator.map(str::to_owned),
            ..Overrides::default()
        };
        rendered(&text, &overrides, &Options::default()).image
    });
    let brightest = path.data().iter().copied().fold(0.0, f32::max);
    for image in [phong, raster] {
        let mean = mean_difference(&path, &image) / brightest;
        assert!(mean < 0.02, "{mean}");
    }
}

#[test]
fn what_is_drawn_depends_neither_on_threads_nor_on_the_crop() {
    let text = lit("raster");
    let with = |threads: usize, crop: Option<Window>| {
        let options = Options {
            threads: NonZeroUsize::new(threads),
            ..Options::default()
        };
        let overrides = Overrides {
            crop,
            ..Overrides::default()
        };
        rendered(&text, &overrides, &options).image
    };
    let whole = with(1, None);
    assert_eq!(whole.data(), with(3, None).data());
    let window = Window {
        x: 13,
        y: 7,
        width: 20,
        height: 22,
    };
    let part = with(2, Some(window));
    let stride = whole.channels().len();
    let far = (0..22)
        .flat_map(|y| (0..20).map(move |x| (x, y)))
        .filter(|(x, y)| {
            let of_part = &part.data()[(y * 20 + x) * stride..][..stride];
            let of_whole = &whole.data()[((y + 7) * 60 + x + 13) * stride..][..stride];
            of_part != of_whole
        });
    assert_eq!(far.count(), 0);
}

#[test]
fn where_samples_come_one_by_one_rays_take_the_z_buffer_s_place() {
    let text = lit("raster");
    let nested = text.replace(
        "<integrator type='raster'/>",
        "<integrator type='moment'><integrator type='raster'/></integrator>",
    );
    let [drawn, traced] = [&text, &nested].map(|text| image_of(text, 0));
    let mean = mean_difference(&drawn, &traced);
    assert!(mean < 0.02, "{mean}");
}

#[test]
fn a_preview_comes_before_the_image_and_changes_nothing_of_it() {
    #[derive(Default)]
    struct Seen(Mutex<Vec<Picture>>);
    impl Progress for Seen {
        fn begin(&self, _: Phase, _: u64) {}
        fn advance(&self, _: u64, _: u64) {}
        fn picture(&self, picture: &Picture) {
            self.0.lock().unwrap().push(picture.clone());
        }
    }
    let description = describe(&lit("path"));
    let with = |preview: bool| {
        let options = Options {
            preview,
            ..Options::default()
        };
        let seen = Seen::default();
        let image = render(&description, &options, &seen).unwrap().image;
        (image, seen.0.into_inner().unwrap())
    };
    let ((image, none), (same, pictures)) = (with(false), with(true));
    assert_eq!(image.data(), same.data());
    assert!(none.is_empty());
    assert_eq!(pictures.len(), 1);
    // It is as bright as the image.
    let mean = |image: &Image| image.data().iter().sum::<f32>() / image.data().len() as f32;
    let ratio = mean(&pictures[0].image) / mean(&image);
    assert!((0.7..1.3).contains(&ratio), "{ratio}");
}
