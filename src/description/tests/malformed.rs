//! What a user does wrong, and what the message says.

use super::parse;

#[test]
fn every_malformed_scene_is_told_what_is_wrong_with_it() {
    // (what stands inside <scene>, place and part of the message)
    const INSIDE: [(&str, &str, &str); 51] = [
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
    const WHOLE: [(&str, &str, &str); 14] = [
        ("", "", "not well-formed XML"),
        (
            "<scene version='3.0.0'>",
            "",
            "the file ends inside an element",
        ),
        (
            "<scene version='3.0.0'></sceen>",
            "1:24",
            "<scene> is still open at </sceen>: close it by </scene>",
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
            "<!DOCTYPE a [<!ENTITY e '1'>]><scene version='&e;'/>",
            "1:47",
            "write out what &e; stands for",
        ),
        (
            "<!DOCTYPE scene [<scene version='3.0.0'/>",
            "1:1",
            "the document type does not end",
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
