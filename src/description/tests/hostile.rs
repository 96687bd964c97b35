//! Files made to hurt: endless, bottomless, circular or cut short. Each ends in an error, and soon.

use std::time::{Duration, Instant};

use super::{folder, parse, read};
use crate::budget::Budget;
use crate::description::{Description, Kind, Options};

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
fn double_references_that_double_at_every_link_are_refused() {
    let chain = |n: usize| {
        let links: String = (0..n)
            .map(|i| {
                let next = i + 1;
                format!(
                    "<bsdf type='blendbsdf' id='b{i}'><ref id='b{next}'/><ref id='b{next}'/></bsdf>"
                )
            })
            .collect();
        parse(&format!(
            "<scene version='3.0.0'>{links}<bsdf type='diffuse' id='b{n}'/></scene>"
        ))
    };
    assert!(chain(10).is_ok());
    let error = chain(50).unwrap_err().to_string();
    assert!(error.contains("more than 4096 nested objects"), "{error}");
}

#[test]
fn a_thousand_problems_are_not_all_listed() {
    let text = format!("<scene version='3.0.0'>{}</scene>", "<x/>\n".repeat(1000));
    let error = parse(&text).unwrap_err();
    assert_eq!(error.problems().len(), 101);
    assert!(error.to_string().contains("too many problems"));
}

#[test]
fn what_is_not_a_text_file_is_refused() {
    let folder = folder(&[("a.xml", "")]);
    assert!(Description::read(folder.path(), &Options::default(), &Budget::default()).is_err());
    let path = folder.path().join("wide.xml");
    std::fs::write(&path, b"\xff\xfe<\0s").expect("a file");
    let message = read(&folder, "wide.xml").unwrap_err().to_string();
    assert!(message.contains("not valid UTF-16"), "{message}");
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

#[test]
fn a_hundred_thousand_mistakes_of_one_kind_are_sifted_soon() {
    let n = 100_000;
    let long = "x".repeat(60);
    let ids: String = (0..n)
        .map(|i| format!("<bsdf type='a' id='{long}{i}'/>"))
        .collect();
    let unresolved: String = (0..n).map(|i| format!("<ref id='{i}{long}'/>")).collect();
    let duplicates = "<float name='a' value='1'/>".repeat(n);
    let twice = format!("{ids}{ids}");
    let loops: String = (0..n)
        .map(|i| format!("<bsdf type='a' id='{i}'><ref id='{i}'/><ref id='0'/></bsdf>"))
        .collect();
    let undefined = "<float name='a' value='$b'/>".repeat(n);
    for inside in [ids + &unresolved, duplicates, twice, loops, undefined] {
        let start = Instant::now();
        let error = parse(&format!("<scene version='3.0.0'>{inside}</scene>")).unwrap_err();
        assert!(error.problems().len() <= 101);
        assert!(
            start.elapsed() < Duration::from_secs(20),
            "{}",
            &inside[..40]
        );
    }
}
