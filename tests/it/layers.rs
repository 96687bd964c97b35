//! Are the layers what `ARCHITECTURE.md` says? Every `crate::` path in `src/`, and every `super::` path that
//! leaves a module, is an arrow from one module to another, and must run down the table.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The modules from the ground up. Those in one row are siblings and do not import each other.
const LAYERS: &[&[&str]] = &[
    &["error"],
    &["budget", "file", "math", "pages"],
    &["lanes"],
    &["color"],
    &["description", "image", "mesh"],
    &["family", "interaction"],
    &[
        "compare", "denoise", "display", "filter", "relight", "sampler", "shape", "texture",
    ],
    &["phase", "sensor"],
    &["accel", "light", "material", "medium"],
    &["scene"],
    &["raster"],
    &["integrator"],
    &["film"],
    &["render"],
    &["crosscheck", "profile"],
];

/// What stands above the library and uses it by its public name.
const ABOVE: &[&str] = &["cli", "main", "lib"];

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|row| row.contains(&module))
}

/// Every `.rs` file under `folder`.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("src can be read") {
        let path = entry.expect("src can be read").path();
        if path.is_dir() {
            files.extend(self::files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// The modules that enclose a file's contents, outermost first: `light/area.rs` is `[light, area]`.
fn module_path(file: &Path) -> Vec<String> {
    let relative = file.strip_prefix(source()).expect("the file is in src");
    let mut path: Vec<String> = relative
        .with_extension("")
        .iter()
        .map(|part| part.to_string_lossy().into_owned())
        .collect();
    if path.last().is_some_and(|last| last == "mod") {
        path.pop();
    }
    path
}

/// The text with comments and the contents of strings blanked, lines kept.
fn code(text: &str) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let mut in_string = false;
        let mut previous = ' ';
        let mut rest = line.chars().peekable();
        while let Some(c) = rest.next() {
            match c {
                '"' if previous != '\\' && previous != '\'' => in_string = !in_string,
                '/' if !in_string && rest.peek() == Some(&'/') => break,
                _ if !in_string => out.push(c),
                _ => {}
            }
            previous = c;
        }
        out.push('\n');
    }
    out
}

/// The first identifiers after a path's `crate::` or `super::`: several where braces follow.
fn heads(rest: &str) -> Vec<String> {
    let word = |text: &str| -> String {
        text.trim_start()
            .chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect()
    };
    let Some(inner) = rest.strip_prefix('{') else {
        return vec![word(rest)];
    };
    let (mut heads, mut depth, mut start) = (Vec::new(), 0, 0);
    for (i, c) in inner.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => {
                heads.push(word(&inner[start..i]));
                break;
            }
            '}' => depth -= 1,
            ',' if depth == 0 => {
                heads.push(word(&inner[start..i]));
                start = i + 1;
            }
            _ => {}
        }
    }
    heads
}

/// How deep in inline modules each line of `code` stands.
fn inline_depths(code: &str) -> Vec<usize> {
    let (mut braces, mut modules, mut depths) = (0_usize, Vec::new(), Vec::new());
    for line in code.lines() {
        depths.push(modules.len());
        let opens_module = line.trim_start().starts_with("mod ")
            || line.trim_start().starts_with("pub mod ")
            || line.trim_start().starts_with("pub(crate) mod ");
        if opens_module && line.contains('{') {
            modules.push(braces);
        }
        braces += line.matches('{').count();
        braces = braces.saturating_sub(line.matches('}').count());
        while modules.last().is_some_and(|start| braces <= *start) {
            modules.pop();
        }
    }
    depths
}

/// The top-level modules that `text`, the file at `path` in the module tree, refers to, with line numbers.
fn arrows(path: &[String], text: &str) -> Vec<(usize, String)> {
    let code = code(text);
    let depths = inline_depths(&code);
    let mut found = Vec::new();
    let mut offset = 0;
    for (number, line) in code.lines().enumerate() {
        let all = &code[offset..];
        for (at, _) in line.match_indices("crate::") {
            let heads = heads(&all[at + "crate::".len()..]);
            found.extend(heads.into_iter().map(|head| (number + 1, head)));
        }
        for (at, _) in line.match_indices("super::") {
            if line[..at].ends_with("super::") {
                continue; // counted with the first
            }
            let mut rest = &all[at..];
            let mut ups = 0;
            while let Some(after) = rest.strip_prefix("super::") {
                (rest, ups) = (after, ups + 1);
            }
            // Up to the crate itself: the path leaves the module.
            if ups == path.len() + depths[number] {
                found.extend(heads(rest).into_iter().map(|head| (number + 1, head)));
            }
        }
        offset += line.len() + 1;
    }
    found
}

#[test]
fn every_module_has_its_place_in_the_table() {
    for entry in fs::read_dir(source()).expect("src can be read") {
        let name = entry.expect("src can be read").file_name();
        let name = name.to_string_lossy();
        let module = name.strip_suffix(".rs").unwrap_or(&name);
        assert!(
            layer(module).is_some() || ABOVE.contains(&module),
            "src/{name} is in no layer: tests/it/layers.rs wants to know where it stands"
        );
    }
}

#[test]
fn every_arrow_runs_down() {
    let (mut wrong, mut seen) = (Vec::new(), BTreeSet::new());
    for file in files(&source()) {
        let path = module_path(&file);
        let (from, text) = (&path[0], fs::read_to_string(&file).expect("src is text"));
        for (line, to) in arrows(&path, &text) {
            if ABOVE.contains(&from.as_str()) {
                continue;
            }
            // A macro that the crate exports is no module.
            let Some(height) = layer(&to) else {
                wrong.push(format!("{}:{line}: {to} is in no layer", file.display()));
                continue;
            };
            seen.insert((from.clone(), to.clone()));
            if *from != to && layer(from).is_none_or(|own| height >= own) {
                wrong.push(format!("{}:{line}: {from} imports {to}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "arrows run up:\n{}", wrong.join("\n"));
    let arrow = |from: &str, to: &str| seen.contains(&(from.to_owned(), to.to_owned()));
    assert!(
        arrow("render", "scene") && arrow("interaction", "mesh"),
        "the test sees nothing: {seen:?}"
    );
}

#[test]
fn the_library_lists_its_modules_from_the_ground_up() {
    let text = fs::read_to_string(source().join("lib.rs")).expect("src is text");
    let order: Vec<usize> = code(&text)
        .lines()
        .filter_map(|line| line.split_once("mod ")?.1.strip_suffix(';'))
        .map(|module| layer(module).expect("checked above"))
        .collect();
    assert!(order.is_sorted(), "lib.rs has the layers {order:?}");
}

#[test]
fn the_scan_finds_what_it_is_to_find() {
    let text = r#"
//! crate::comment
use crate::{accel::{Hit, Ray}, math};
use super::sibling;
fn f() { crate::scene::g("crate::string"); super::super::light::h(); }
mod inner {
    use super::super::super::mesh;
}
mod tests {
    use super::super::super::image;
    use super::super::stays;
}
"#;
    let path = ["render".to_owned(), "unit".to_owned()];
    let heads: Vec<String> = arrows(&path, text).into_iter().map(|a| a.1).collect();
    assert_eq!(heads, ["accel", "math", "scene", "light", "mesh", "image"]);
}
