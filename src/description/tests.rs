//! The format as a whole: what is written is what is read, what is wrong is named where it stands, hostile
//! files end in an error soon, and real scenes are read without one.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use glam::DVec3;

use super::*;

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
    Description::read(&folder.path().join(name), &Options::default())
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
    assert_eq!(shape.boolean("b").unwrap(), Some(true));
    assert_eq!(shape.integer("i").unwrap(), Some(-12));
    assert_eq!(shape.float("f").unwrap(), Some(1.5e-3));
    assert_eq!(shape.string("s").unwrap(), Some(" a  b "));
    assert_eq!(shape.vector("p").unwrap(), Some(DVec3::new(1.0, 2.0, 3.0)));
    assert_eq!(shape.vector("v").unwrap(), Some(DVec3::new(4.0, 5.0, 6.0)));
    let value = |name| &shape.value(name).expect("it is there").value;
    assert!(matches!(value("c"), Value::Rgb(c) if *c == DVec3::new(0.1, 0.2, 0.3)));
    assert!(matches!(value("l"), Value::Spectrum(Spectrum::Curve(c)) if c.len() == 2));
    assert_eq!(shape.animation("m").unwrap().unwrap()[1].1.w_axis.x, 1.0);
    assert_eq!(shape.object("o").unwrap().unwrap().kind(), Kind::Spectrum);
    assert!(scene.unread().is_empty(), "{:?}", scene.unread());
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
        Ok::<_, Error>((sampler.plugin().to_owned(), sampler.integer("count")?))
    };
    assert_eq!(sampler(&[("t", "grid")]).unwrap(), ("grid".into(), Some(1)));
    let given = [("t", "grid"), ("n", "8")];
    assert_eq!(sampler(&given).unwrap(), ("grid".into(), Some(8)));
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
    let to_uv = texture.transform("to_uv").unwrap().unwrap();
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
    let found = shapes[0].file("file_name").unwrap().unwrap();
    assert_eq!(found, folder.path().join("parts/a.obj"));
    let found = shapes[0].file("other").unwrap().unwrap();
    assert_eq!(found, folder.path().join("data/c.obj"));
    assert_eq!(
        shapes[1].object("inner").unwrap().unwrap().plugin(),
        "diffuse"
    );
    assert!(shapes[0].location().to_string().ends_with("a.xml:2:14"));
}

#[test]
fn an_include_that_includes_itself_is_named_with_both_places() {
    let folder = folder(&[
        (
            "main.xml",
            "<scene version='3.0.0'>\n<include filename='a.xml'/></scene>",
        ),
        (
            "a.xml",
            "<scene version='3.0.0'>\n\n<include filename='./b.xml'/></scene>",
        ),
        (
            "b.xml",
            "<scene version='3.0.0'><include filename='a.xml'/></scene>",
        ),
    ]);
    let message = read(&folder, "main.xml").unwrap_err().to_string();
    assert!(message.contains("includes itself"), "{message}");
    assert!(message.contains("b.xml:1:24"), "{message}");
    assert!(message.contains("main.xml:2:1"), "{message}");
}

#[test]
fn includes_that_multiply_end_in_an_error() {
    let many = |next: &str| {
        format!(
            "<scene version='3.0.0'>{}</scene>",
            format!("<include filename='{next}'/>").repeat(2000)
        )
    };
    let folder = folder(&[
        ("main.xml", &many("a.xml")),
        ("a.xml", &many("b.xml")),
        ("b.xml", &many("c.xml")),
        ("c.xml", "<scene version='3.0.0'/>"),
    ]);
    let start = Instant::now();
    let message = read(&folder, "main.xml").unwrap_err().to_string();
    assert!(message.contains("more than"), "{message}");
    assert!(start.elapsed() < Duration::from_secs(20));
}

#[test]
fn a_hundred_thousand_nested_tags_end_in_one_error_soon() {
    for (tag, attributes) in [
        ("bsdf", " type='mask'"),
        ("float", ""),
        ("what", ""),
        ("transform", " name='t'"),
    ] {
        let n = 100_000;
        let text = format!(
            "<scene version='3.0.0'>{}{}</scene>",
            format!("<{tag}{attributes}>").repeat(n),
            format!("</{tag}>").repeat(n)
        );
        let start = Instant::now();
        let error = parse(&text).unwrap_err();
        assert_eq!(error.problems().len(), 1, "{error}");
        assert!(start.elapsed() < Duration::from_secs(10), "<{tag}>");
        let unclosed = format!("<scene version='3.0.0'>{}", "<bsdf>".repeat(n));
        assert!(parse(&unclosed).is_err());
    }
}

#[test]
fn a_hundred_thousand_shapes_on_one_line_are_read_soon() {
    let text = format!(
        "<scene version='3.0.0'>é{}</scene>",
        "<shape type='sphere' name='' ><float name='radius' value='1'/></shape>".repeat(100_000)
    );
    let start = Instant::now();
    let scene = parse(&text).unwrap();
    assert_eq!(scene.root().children(Kind::Shape).len(), 100_000);
    assert!(start.elapsed() < Duration::from_secs(10));
}

#[test]
fn a_long_chain_of_references_is_refused_and_a_short_one_is_not() {
    let chain = |n: usize| {
        let links: String = (0..n)
            .map(|i| format!("<bsdf type='mask' id='b{i}'><ref id='b{}'/></bsdf>", i + 1))
            .collect();
        parse(&format!(
            "<scene version='3.0.0'>{links}<bsdf type='diffuse' id='b{n}'/></scene>"
        ))
    };
    assert!(chain(50).is_ok());
    assert!(
        chain(100_000)
            .unwrap_err()
            .to_string()
            .contains("levels deep through references")
    );
}

#[test]
fn independent_problems_are_reported_together() {
    let error = parse(
        "<scene version='3.0.0'>
            <bsdf type='a' id='x'><flaot name='f' value='1'/></bsdf>
            <shape type='b'><ref id='y'/><integer name='i' value='1.5'/></shape>
            <bdsf type='c' id='lost'/><shape type='d'><ref id='lost'/></shape>
        </scene>",
    )
    .unwrap_err();
    let lines: Vec<_> = error
        .problems()
        .iter()
        .map(|p| p.location.as_ref().expect("it is located").line)
        .collect();
    assert_eq!(lines, [2, 3, 4, 3], "{error}");
}

#[test]
fn a_thousand_problems_are_not_all_listed() {
    let text = format!("<scene version='3.0.0'>{}</scene>", "<x/>\n".repeat(1000));
    let error = parse(&text).unwrap_err();
    assert_eq!(error.problems().len(), 101);
    assert!(error.to_string().contains("too many problems"));
}

#[test]
fn every_malformed_scene_is_told_what_is_wrong_with_it() {
    // (what stands inside <scene>, place and part of the message)
    const INSIDE: [(&str, &str, &str); 52] = [
        (
            "<shap type='a'/>",
            "1:24",
            "unknown tag <shap>; did you mean \"shape\"?",
        ),
        (
            "<shape typ='a'/>",
            "1:31",
            "no attribute \"typ\"; did you mean \"type\"?",
        ),
        ("<shape/>", "1:24", "<shape> needs the attribute \"type\""),
        (
            "<shape type=''/>",
            "1:31",
            "the attribute \"type\" is empty",
        ),
        (
            "<float value='1'/>",
            "1:24",
            "<float> needs the attribute \"name\"",
        ),
        (
            "<float name='a'/>",
            "1:24",
            "<float> needs the attribute \"value\"",
        ),
        (
            "<float name='a' value='1,5'/>",
            "1:40",
            "\"1,5\" is not a number",
        ),
        (
            "<float name='a' value='inf'/>",
            "1:40",
            "\"inf\" is not finite",
        ),
        ("<float name='a' value='NaN'/>", "1:40", "not finite"),
        ("<float name='a' value=''/>", "1:40", "\"\" is not a number"),
        (
            "<float name='a' value='1' unit='m'/>",
            "1:50",
            "no attribute \"unit\"",
        ),
        (
            "<float name='a' value='1'><rgb/></float>",
            "1:50",
            "<rgb> cannot stand inside <float>",
        ),
        (
            "<integer name='a' value='1.0'/>",
            "1:42",
            "\"1.0\" is not an integer",
        ),
        (
            "<integer name='a' value='99999999999999999999'/>",
            "1:42",
            "not an integer",
        ),
        (
            "<boolean name='a' value='yes'/>",
            "1:42",
            "\"yes\" is not a boolean; write \"true\" or \"false\"",
        ),
        (
            "<string name='' value='x'/>",
            "1:32",
            "the attribute \"name\" is empty",
        ),
        (
            "<point name='a' x='1' y='2'/>",
            "1:24",
            "<point> needs the attribute \"z\"",
        ),
        (
            "<point name='a' value='1 2'/>",
            "1:40",
            "expected 1 or 3 numbers, found 2",
        ),
        (
            "<point name='a' value='1' x='2'/>",
            "1:50",
            "takes either \"value\" or",
        ),
        (
            "<vector name='a' x='1' y='b' z='2'/>",
            "1:47",
            "\"b\" is not a number",
        ),
        ("<rgb name='a' value='1 2 3 4'/>", "1:38", "found 4"),
        ("<rgb name='a' value='#12345'/>", "1:38", "is not a colour"),
        (
            "<spectrum name='a' value='500:1 400:1'/>",
            "1:43",
            "wavelengths must increase: 400 follows 500",
        ),
        (
            "<spectrum name='a' value='.1 .2 .3'/>",
            "1:43",
            "write <rgb> for a colour",
        ),
        (
            "<spectrum name='a'/>",
            "1:24",
            "takes either \"value\" or \"filename\"",
        ),
        (
            "<spectrum name='a' filename='no.spd'/>",
            "1:43",
            "cannot find the file \"no.spd\"",
        ),
        (
            "<float name='a' value='1'/><rgb name='a' value='1'/>",
            "1:51",
            "second property \"a\" (the first at test.xml:1:24)",
        ),
        (
            "<bsdf type='a' id='x'/><bsdf type='b' id='x'/>",
            "1:62",
            "the id \"x\" is taken (the first at test.xml:1:39)",
        ),
        (
            "<ref id='nope'/><bsdf type='a' id='hope'/>",
            "1:24",
            "nothing has the id \"nope\"; did you mean \"hope\"?",
        ),
        ("<ref/>", "1:24", "<ref> needs the attribute \"id\""),
        (
            "<alias id='x' as='y'/><bsdf type='a' id='x'/>",
            "1:31",
            "nothing above has the id \"x\"",
        ),
        (
            "<bsdf type='a' id='x'/><alias id='x' as='x'/>",
            "1:61",
            "the id \"x\" is taken",
        ),
        (
            "<bsdf type='a' id='x'><bsdf type='b'><ref id='x'/></bsdf></bsdf>",
            "1:61",
            "bsdf \"x\" contains itself (it begins at test.xml:1:24)",
        ),
        (
            "<bsdf type='a' id='x'><ref id='y'/></bsdf><bsdf type='b' id='y'><ref id='x'/></bsdf>",
            "1:88",
            "contains itself",
        ),
        (
            "<float name='a' value='$b'/>",
            "1:40",
            "undefined parameter $b",
        ),
        ("<float name='a' value='$'/>", "1:40", "no name after $"),
        (
            "<float name='a' value='$b'/><default name='b' value='1'/>",
            "1:40",
            "undefined parameter $b",
        ),
        (
            "<default value='1'/>",
            "1:24",
            "<default> needs the attribute \"name\"",
        ),
        (
            "<path value='no/such/folder'/>",
            "1:30",
            "cannot find the file",
        ),
        (
            "<shape type='a'><path value='.'/></shape>",
            "1:40",
            "<path> stands directly inside <scene>",
        ),
        (
            "<include filename='no.xml'/>",
            "1:33",
            "cannot find the file \"no.xml\"",
        ),
        (
            "<translate x='1'/>",
            "1:24",
            "<translate> stands inside <transform>",
        ),
        (
            "<transform name='a'><scal value='2'/></transform>",
            "1:44",
            "did you mean \"scale\"?",
        ),
        (
            "<transform name='a'><scale value='0'/></transform>",
            "1:24",
            "the transform is singular",
        ),
        (
            "<transform name='a'><rotate angle='3'/></transform>",
            "1:44",
            "axis of a rotation must have a length",
        ),
        (
            "<transform name='a'><rotate x='1'/></transform>",
            "1:44",
            "<rotate> needs the attribute \"angle\"",
        ),
        (
            "<transform name='a'><matrix value='1 2'/></transform>",
            "1:52",
            "9 or 16 numbers, found 2",
        ),
        (
            "<transform name='a'><matrix value='1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1'/></transform>",
            "1:52",
            "last row",
        ),
        (
            "<transform name='a'><lookat origin='0 0 1' target='0 0 1'/></transform>",
            "1:44",
            "origin and target coincide",
        ),
        (
            "<transform name='a'><lookat origin='0 0 1' target='0 0 0' up='0 0 2'/></transform>",
            "1:44",
            "parallel",
        ),
        (
            "<animation name='a'><transform time='1'/><transform time='1'/></animation>",
            "1:76",
            "1 follows 1",
        ),
        (
            "<scene type='a'/>",
            "1:24",
            "<scene> cannot stand inside another tag",
        ),
    ];
    const WHOLE: [(&str, &str, &str); 13] = [
        ("", "", "not well-formed XML"),
        (
            "<scene version='3.0.0'>",
            "",
            "the file ends inside an element",
        ),
        (
            "<scene version='3.0.0'></sceen>",
            "1:24",
            "expected 'scene' tag, not 'sceen'",
        ),
        (
            "<scene version='3.0.0'/><scene/>",
            "1:",
            "not well-formed XML",
        ),
        (
            "<scene version='3.0.0' version='3.0.0'/>",
            "1:24",
            "already defined",
        ),
        (
            "<scene version='3.0.0'>\n  <float name='a' value='<'/></scene>",
            "2:",
            "close the quotes, or write &lt;",
        ),
        (
            "<!DOCTYPE scene><scene version='3.0.0'/>",
            "",
            "remove <!DOCTYPE",
        ),
        ("<scene xmlns='x' version='3.0.0'/>", "1:1", "remove xmlns"),
        (
            "<scene/>",
            "1:1",
            "needs the attribute \"version\"; write version=\"3.0.0\"",
        ),
        (
            "<scene version='three'/>",
            "1:8",
            "\"three\" is not a version",
        ),
        (
            "<scene version='3.0.0' foo='1'/>",
            "1:24",
            "no attribute \"foo\"",
        ),
        (
            "<shape type='sphere' version='3.0.0'/>",
            "1:1",
            "expected <scene>, found <shape>",
        ),
        ("v 1 2 3", "1:", "not well-formed XML"),
    ];
    let inside = INSIDE.map(|(text, place, part)| {
        (
            format!("<scene version='3.0.0'>{text}</scene>"),
            place,
            part,
        )
    });
    let whole = WHOLE.map(|(text, place, part)| (text.to_owned(), place, part));
    for (text, place, part) in inside.into_iter().chain(whole) {
        let message = match parse(&text) {
            Ok(_) => panic!("{text} is accepted"),
            Err(error) => error.to_string(),
        };
        assert!(
            message.starts_with(&format!("test.xml:{place}")),
            "{text}: {message}"
        );
        assert!(message.contains(part), "{text}: {message}");
        assert!(!message.contains('\n'), "{text}: {message}");
    }
}

#[test]
fn what_is_not_a_text_file_is_refused() {
    let folder = folder(&[("a.xml", "")]);
    assert!(Description::read(folder.path(), &Options::default()).is_err());
    let path = folder.path().join("latin.xml");
    std::fs::write(&path, b"<scene>\n\xe9</scene>").expect("a file");
    let message = read(&folder, "latin.xml").unwrap_err().to_string();
    assert!(
        message.contains("latin.xml:2: the text is not UTF-8"),
        "{message}"
    );
    let message = read(&folder, "none.xml").unwrap_err().to_string();
    assert!(message.contains("cannot read"), "{message}");
}

#[test]
fn a_scene_cut_or_changed_anywhere_never_panics() {
    let text = "<?xml version='1.0'?><scene version='0.6.0'><default name='n' value='1'/>
        <shape type='sphere' id='é'><transform name='toWorld'><rotate y='1' angle='9'/>
        <lookAt origin='0 0 $n' target='1,1,1' up='0 1 0'/></transform><ref id='é'/>
        <spectrum name='s' value='400:1 500:$n'/><rgb name='c' value='#ff00ff'/></shape></scene>";
    for (i, _) in text.char_indices() {
        let (before, after) = text.split_at(i);
        let _ = parse(before);
        for c in ["<", "'", "$", "&", "0", "é", "\0"] {
            let rest = after.get(1..).unwrap_or_default();
            let _ = parse(&format!("{before}{c}{after}"));
            let _ = parse(&format!("{before}{c}{rest}"));
        }
    }
}

/// The scenes below `folder` of the shared data: every file that is a scene of its own.
fn shared_scenes(folder: &str) -> Vec<PathBuf> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data")).join(folder);
    let mut scenes = Vec::new();
    let mut folders = vec![root];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else {
            continue;
        };
        for path in entries.filter_map(|entry| entry.ok().map(|e| e.path())) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "xml")
                && !folder.ends_with("fragments")
                && !folder.ends_with("include")
            {
                scenes.push(path);
            }
        }
    }
    scenes.sort();
    scenes
}

#[test]
fn every_shared_scene_is_read() {
    for (folder, least) in [("mitsuba-data/tests/scenes", 41), ("scenes", 15)] {
        let scenes = shared_scenes(folder);
        if scenes.is_empty() {
            use std::io::Write as _;
            let _ = writeln!(std::io::stderr(), "skipped: no ../shared/data/{folder}");
            continue;
        }
        assert!(scenes.len() >= least, "{} scenes in {folder}", scenes.len());
        for path in scenes {
            let scene = Description::read(&path, &Options::default())
                .unwrap_or_else(|e| panic!("{}:\n{e}", path.display()));
            let root = scene.root();
            assert_eq!(root.children(Kind::Sensor).len(), 1, "{}", path.display());
            assert!(!root.children(Kind::Shape).is_empty(), "{}", path.display());
            for shape in root.children(Kind::Shape) {
                if shape.has("filename") {
                    shape.file("filename").unwrap_or_else(|e| panic!("{e}"));
                }
                shape
                    .animation("to_world")
                    .unwrap_or_else(|e| panic!("{e}"));
            }
        }
    }
}

#[test]
fn the_shared_scenes_take_their_samples_from_the_command_line() {
    let defines = vec![("spp".to_owned(), "7".to_owned())];
    let options = Options {
        defines,
        ..Options::default()
    };
    for path in shared_scenes("mitsuba-data/tests/scenes") {
        let text = std::fs::read_to_string(&path).expect("it was listed");
        let scene = match Description::read(&path, &options) {
            Ok(scene) => scene,
            Err(error) => {
                assert!(!text.contains("$spp"), "{error}");
                continue;
            }
        };
        let sensor = scene.root().children(Kind::Sensor)[0];
        let sampler = sensor.children(Kind::Sampler)[0];
        assert_eq!(sampler.integer("sample_count").unwrap(), Some(7));
    }
}

#[test]
fn a_description_can_be_read_from_many_threads() {
    fn shared<T: Send + Sync>() {}
    shared::<Description>();
    shared::<Properties<'_>>();
}
