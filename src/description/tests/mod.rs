//! The format as a whole: what is written is what is read.

mod hostile;
mod malformed;
mod shared;

use std::path::Path;

use glam::DVec3;

use super::*;
use crate::budget::Budget;

fn parse(text: &str) -> Result<Description> {
    Description::parse(text, Path::new("test.xml"), &Options::default())
}

fn parse_with(text: &str, defines: &[(&str, &str)]) -> Result<Description> {
    let defines = defines
        .iter()
        .map(|&(name, value)| (name.to_owned(), value.to_owned()))
        .collect();
    let options = Options {
        defines,
        ..Options::default()
    };
    Description::parse(text, Path::new("test.xml"), &options)
}

/// A temporary folder with these files in it.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("it is in the folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    }
    folder
}

fn read(folder: &tempfile::TempDir, name: &str) -> Result<Description> {
    Description::read(
        &folder.path().join(name),
        &Options::default(),
        &Budget::default(),
    )
}

#[test]
fn every_value_is_read_as_it_is_written() {
    let scene = parse(
        "<scene version='3.0.0'><shape type='a'>
            <boolean name='b' value='True'/> <integer name='i' value=' -12 '/>
            <float name='f' value='1.5e-3'/> <string name='s' value=' a  b '/>
            <point name='p' x='1' y='2' z='3'/> <vector name='v' value='4, 5 6'/>
            <rgb name='c' value='.1 .2 .3'/> <spectrum name='l' value='400:1 500:2'/>
            <animation name='m'><transform time='0'/><transform time='1'><translate x='1'/></transform></animation>
            <spectrum name='o' type='d65'/>
        </shape></scene>",
    )
    .unwrap();
    let shape = scene.root().children(Kind::Shape)[0];
    assert_eq!(shape.plugin(), "a");
    assert!(shape.boolean("b").unwrap());
    assert_eq!(shape.integer("i").unwrap(), -12);
    assert_eq!(shape.float("f").unwrap(), 1.5e-3);
    assert_eq!(shape.string("s").unwrap(), " a  b ");
    assert_eq!(shape.vector("p").unwrap(), DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(shape.vector("v").unwrap(), DVec3::new(4.0, 5.0, 6.0));
    let value = |name| &shape.value(name).expect("it is there").value;
    assert!(matches!(value("c"), Value::Rgb(c) if *c == DVec3::new(0.1, 0.2, 0.3)));
    assert!(matches!(value("l"), Value::Spectrum(Spectrum::Curve(c)) if c.len() == 2));
    assert_eq!(shape.animation("m").unwrap().unwrap()[1].1.w_axis.x, 1.0);
    assert_eq!(shape.object("o").unwrap().unwrap().kind(), Kind::Spectrum);
}

#[test]
fn references_and_aliases_lead_to_one_node_whatever_the_order() {
    let scene = parse(
        "<scene version='3.0.0'>
            <shape type='a'><ref id='later'/></shape>
            <bsdf type='diffuse' id='later'/><alias id='later' as='other'/>
            <shape type='b'><ref name='named' id='other'/></shape>
        </scene>",
    )
    .unwrap();
    let shapes = scene.root().children(Kind::Shape);
    let first = shapes[0].children(Kind::Bsdf)[0];
    let second = shapes[1].object("named").unwrap().unwrap();
    assert_eq!(first.node_id(), second.node_id());
    assert_eq!((first.plugin(), first.id()), ("diffuse", Some("later")));
}

#[test]
fn a_definition_overrides_the_default() {
    let text = "<scene version='3.0.0'><default name='n' value='1'/><default name='n' value='2'/>
        <sampler type='$t'><integer name='count' value='$n'/></sampler></scene>";
    let sampler = |defines: &[(&str, &str)]| {
        let scene = parse_with(text, defines)?;
        let sampler = scene.root().children(Kind::Sampler)[0];
        Ok::<_, crate::error::Error>((sampler.plugin().to_owned(), sampler.integer("count")?))
    };
    assert_eq!(sampler(&[("t", "grid")]).unwrap(), ("grid".into(), 1));
    let given = [("t", "grid"), ("n", "8")];
    assert_eq!(sampler(&given).unwrap(), ("grid".into(), 8));
    assert!(
        sampler(&[])
            .unwrap_err()
            .to_string()
            .contains("undefined parameter $t")
    );
    let mistyped = sampler(&[("t", "grid"), ("nn", "8")])
        .unwrap_err()
        .to_string();
    assert!(mistyped.contains("no parameter $nn"), "{mistyped}");
    assert!(mistyped.contains("did you mean \"n\"?"), "{mistyped}");
}

#[test]
fn an_older_version_is_upgraded_and_said_to_be() {
    let scene = parse(
        "<scene version='0.6.0'><bsdf type='diffuse' id='d'>
            <texture type='bitmap' name='diffuseReflectance'>
                <float name='uscale' value='2'/><float name='voffset' value='3'/><ref id='x' name='a'/>
            </texture></bsdf><texture type='b' id='x'/></scene>",
    )
    .unwrap();
    let diffuse = scene.root().children(Kind::Bsdf)[0];
    let texture = diffuse.object("reflectance").unwrap().unwrap();
    let to_uv = texture.transform("to_uv").unwrap();
    let moved = to_uv.transform_point3(DVec3::new(1.0, 1.0, 0.0));
    assert_eq!(moved, DVec3::new(2.0, 4.0, 0.0));
    assert!(!texture.has("uscale"));
    assert_eq!(texture.object("a").unwrap().unwrap().plugin(), "b");
    assert!(scene.warnings()[0].to_string().contains("version 0.6.0"));
    assert!(
        parse("<scene version='2.0.0'/>")
            .unwrap()
            .warnings()
            .is_empty()
    );
}

#[test]
fn an_include_brings_its_folder_its_plugins_and_its_defaults() {
    let folder = folder(&[
        (
            "main.xml",
            "<scene version='3.0.0'><path value='data'/><include filename='parts/a.xml'/>
             <shape type='$later'><include filename='parts/b.xml' name='inner'/></shape></scene>",
        ),
        (
            "parts/a.xml",
            "<scene version='0.6.0'><default name='later' value='sphere'/>
             <shape type='first'><string name='fileName' value='a.obj'/>
             <string name='other' value='c.obj'/></shape></scene>",
        ),
        ("parts/b.xml", "<bsdf version='3.0.0' type='diffuse'/>"),
        ("parts/a.obj", ""),
        ("data/c.obj", ""),
    ]);
    let scene = read(&folder, "main.xml").unwrap();
    let shapes = scene.root().children(Kind::Shape);
    assert_eq!(
        (shapes[0].plugin(), shapes[1].plugin()),
        ("first", "sphere")
    );
    let found = shapes[0].file("file_name").unwrap();
    assert_eq!(found, folder.path().join("parts/a.obj"));
    let found = shapes[0].file("other").unwrap();
    assert_eq!(found, folder.path().join("data/c.obj"));
    assert_eq!(
        shapes[1].object("inner").unwrap().unwrap().plugin(),
        "diffuse"
    );
    assert!(shapes[0].location().to_string().ends_with("a.xml:2:14"));
}

#[test]
fn a_description_can_be_read_from_many_threads() {
    fn shared<T: Send + Sync>() {}
    shared::<Description>();
    shared::<Properties<'_>>();
}

#[test]
fn a_byte_order_mark_and_comments_are_passed_over() {
    let scene = parse(
        "\u{feff}<?xml version='1.0' encoding='utf-8'?><!-- one --><scene version='3.0.0'>
         <!-- <shape type='a'/> --> words <shape type='b'/></scene>",
    )
    .unwrap();
    assert_eq!(scene.root().children(Kind::Shape)[0].plugin(), "b");
}

#[test]
fn what_mitsuba_takes_otherwise_is_told_and_what_it_passes_over_is_passed_over() {
    let text = "<!DOCTYPE scene SYSTEM 'x'><scene version='3.0.0'><!-- a -- b -->
        <shape type='cube'><transform name='to_world'><rotate x='1' y='1' angle='40'/></transform></shape>
        <shape type='cube'><transform name='to_world'><scale z='0'/></transform></shape>
        <shape type='cube'><transform name='to_world'><rotate x='.70711' y='.70711' angle='40'/>
            <rotate y='2' angle='0'/></transform></shape>
        <texture type='t'><transform name='to_uv'><scale x='4' y='0'/></transform></texture></scene>";
    let scene = parse(text).unwrap();
    let warnings: Vec<_> = scene.warnings().iter().map(ToString::to_string).collect();
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(
        warnings[0].contains(":2:55: the axis has length 1.4142"),
        "{warnings:?}"
    );
    assert!(
        warnings[1].contains(":3:28: the transform is singular"),
        "{warnings:?}"
    );
}

#[test]
fn what_stands_in_a_merge_stands_as_if_that_were_not_there() {
    let scene = parse(
        "<scene version='3.9.1'><shape type='merge' id='m'><sensor type='s'/><bsdf type='b' id='b'/>
         <shape type='merge'><shape type='cube'><ref id='b'/></shape></shape></shape>
         <shape type='group'><shape type='merge'><shape type='ply'/></shape></shape></scene>",
    )
    .unwrap();
    let root = scene.root();
    assert_eq!(root.children(Kind::Sensor).len(), 1);
    let shapes = root.children(Kind::Shape);
    assert_eq!(shapes.len(), 2);
    assert_eq!(shapes[0].children(Kind::Bsdf)[0].id(), Some("b"));
    assert_eq!(shapes[1].children(Kind::Shape)[0].plugin(), "ply");
}

#[test]
fn what_older_versions_meant_is_read_in_today_s_words_and_told() {
    let text = |version: &str| {
        format!(
            "<scene version='{version}'>
             <sensor type='a'><film type='ldrfilm'><boolean name='high_quality_edges' value='true'/>
                <boolean name='banner' value='false'/><float name='gamma' value='2.2'/></film></sensor>
             <texture type='bitmap' id='t'><string name='filter_type' value='trilinear'/>
                <float name='gamma' value='1'/></texture>
             <bsdf type='roughconductor' id='c'><float name='ext_eta' value='1'/></bsdf>
             <bsdf type='conductor' id='d'><float name='ext_eta' value='1.3'/></bsdf></scene>"
        )
    };
    let scene = parse(&text("2.1.0")).unwrap();
    assert_eq!(scene.warnings().len(), 7, "{:?}", scene.warnings());
    let film = scene.root().children(Kind::Sensor)[0].children(Kind::Film)[0];
    assert_eq!(film.plugin(), "hdrfilm");
    assert!(film.has("sample_border") && film.all().len() == 1);
    let texture = scene.root().children(Kind::Texture)[0];
    assert!(texture.has("raw") && !texture.has("gamma"));
    assert_eq!(texture.string("filter_type").unwrap(), "bilinear");
    let bsdfs = scene.root().children(Kind::Bsdf);
    assert!(!bsdfs[0].has("ext_eta") && bsdfs[1].has("ext_eta"));
    let today = parse(&text("3.0.0")).unwrap();
    assert!(today.warnings().is_empty());
    let film = today.root().children(Kind::Sensor)[0].children(Kind::Film)[0];
    assert!(film.plugin() == "ldrfilm" && film.has("banner"));
    let tags = "<camera type='a'/><luminaire type='b'/>";
    let old = parse(&format!("<scene version='0.3.0'>{tags}</scene>")).unwrap();
    assert_eq!(old.root().children(Kind::Sensor)[0].plugin(), "a");
    assert!(parse(&format!("<scene version='3.0.0'>{tags}</scene>")).is_err());
}
