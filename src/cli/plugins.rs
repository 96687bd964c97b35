//! `etendue plugins`: what scenes can name, with every property, its default, its range and its meaning.

use clap::Args;
use etendue::description::Kind;
use etendue::description::declared::{Preset, Range, Row, Standing, Takes};
use etendue::error::{Error, Result};
use etendue::render::{Listed, plugins};
use serde_json::{Value, json};

use super::{output, status};

/// Print the plugins that a scene can name, and their properties
///
/// Without a name every plugin is listed in a line. A plugin's name prints its properties, with defaults, ranges and
/// meanings; a tag (bsdf, shape, …) lists its plugins. Names, defaults and units are Mitsuba's but where it is said.
#[derive(Args, Debug)]
#[command(after_help = status::HELP)]
pub(super) struct Arguments {
    /// Plugins such as roughplastic, or tags such as bsdf
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Print a JSON object: format, plugins
    #[arg(long, conflicts_with = "markdown")]
    json: bool,
    /// Print the page docs/plugins.md
    #[arg(long)]
    markdown: bool,
}

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let all = plugins();
    let (mut chosen, mut whole) = (Vec::new(), Vec::new());
    for name in &arguments.names {
        let of_kind = all
            .iter()
            .filter(|p| p.kind.tag() == name && p.name != name);
        let before = chosen.len() + whole.len();
        whole.extend(of_kind);
        chosen.extend(all.iter().filter(|p| p.name == name));
        if chosen.len() + whole.len() == before {
            let known = all.iter().map(|p| p.name);
            let known = known.chain(Kind::ALL.map(Kind::tag));
            let error = Error::input(format!("no plugin and no tag is called {name:?}"));
            return Err(error
                .suggest(name, known)
                .help("etendue plugins lists them"));
        }
    }
    if arguments.names.is_empty() {
        whole = all.iter().collect();
    }
    if arguments.json {
        let shown: Vec<Value> = whole.iter().chain(&chosen).map(|p| object(p)).collect();
        output::object(json!({ "plugins": shown }));
    } else if arguments.markdown {
        output::line(&page(whole.iter().chain(&chosen).copied()));
    } else {
        list(&whole);
        for listed in chosen {
            table(listed);
        }
    }
    Ok(status::DONE)
}

/// A line a plugin.
fn list(whole: &[&Listed]) {
    let width = whole.iter().map(|p| p.name.len()).max().unwrap_or_default();
    let mut kind = None;
    for listed in whole {
        if kind.replace(listed.kind) != Some(listed.kind) {
            output::line(listed.kind.tag());
        }
        output::line(&format!("  {:width$}  {}", listed.name, about(listed)));
    }
}

/// What a plugin is.
fn about(listed: &Listed) -> String {
    let own = if listed.own { " (Étendue's own)" } else { "" };
    format!("{}{own}", listed.plugin.about)
}

/// A plugin with a line a property.
fn table(listed: &Listed) {
    output::line(&format!(
        "{} {}: {}",
        listed.kind,
        listed.name,
        about(listed)
    ));
    let cells: Vec<[String; 4]> = listed.plugin.rows().map(cells).collect();
    let width = |column: usize| {
        let widths = cells.iter().map(|row| row[column].chars().count());
        widths.max().unwrap_or_default()
    };
    let [first, second, third] = [width(0), width(1), width(2)];
    for [name, takes, preset, meaning] in &cells {
        output::line(&format!(
            "  {name:first$}  {takes:second$}  {preset:third$}  {meaning}"
        ));
    }
    if cells.is_empty() {
        output::line("  no properties");
    }
}

/// What a property is called and takes, its default and its meaning.
fn cells(row: &Row) -> [String; 4] {
    let name = match row.takes {
        Takes::Nested(kind) if row.name.is_empty() => format!("<{kind}>"),
        _ => row.name.to_owned(),
    };
    let range = match row.range {
        Range::ANY => String::new(),
        range => format!("; {range}"),
    };
    let standing = match row.standing {
        Standing::Common => "",
        Standing::WithoutEffect => " (no effect here)",
        Standing::Own => " (Étendue's own)",
    };
    let preset = match row.preset {
        Preset::Text("") => "none".to_owned(),
        preset => preset.to_string(),
    };
    let meaning = format!("{}{range}{standing}", row.about);
    [name, row.takes.to_string(), preset, meaning]
}

/// The page of the manual.
fn page<'p>(shown: impl Iterator<Item = &'p Listed>) -> String {
    let mut page = String::from(
        "# Plugins\n\nEvery plugin that a scene can name, with its properties. `etendue plugins NAME` prints the same, and\n\
         `etendue plugins --markdown` makes this page. Names, defaults and units are Mitsuba 3.9's, but for what is\n\
         Étendue's own. A color is a number, an `<rgb>` or a `<spectrum>`; a `<tag>` is a nested plugin of any name.\n",
    );
    let mut kind = None;
    for listed in shown {
        if kind.replace(listed.kind) != Some(listed.kind) {
            page += &format!("\n## {}\n", listed.kind);
        }
        page += &format!("\n### {}\n\n{}\n", listed.name, about(listed));
        let mut rows = listed.plugin.rows().map(cells).peekable();
        if rows.peek().is_some() {
            page += "\n| property | takes | default | meaning |\n|---|---|---|---|\n";
        }
        for [name, takes, preset, meaning] in rows {
            let takes = takes.replace('|', "\\|");
            page += &format!("| `{name}` | {takes} | {preset} | {meaning} |\n");
        }
    }
    page.truncate(page.trim_end().len());
    page
}

fn object(listed: &Listed) -> Value {
    let number = |x: f64| x.is_finite().then_some(x);
    let property = |row: &'static Row| {
        let preset = match row.preset {
            Preset::Required | Preset::Absent(_) => Value::Null,
            Preset::Boolean(value) => value.into(),
            Preset::Integer(value) => value.into(),
            Preset::Float(value) => value.into(),
            Preset::Text(text) => text.into(),
            Preset::Vector(vector) => json!(vector),
            Preset::Identity => "identity".into(),
        };
        json!({
            "name": row.name,
            "takes": row.takes.to_string(),
            "required": row.preset == Preset::Required,
            "default": preset,
            "otherwise": match row.preset {
                Preset::Absent(words) => Some(words),
                _ => None,
            },
            "least": number(row.range.least),
            "least_excluded": row.range.above,
            "most": number(row.range.most),
            "meaning": row.about,
            "effect": row.standing != Standing::WithoutEffect,
            "own": row.standing == Standing::Own,
        })
    };
    json!({
        "kind": listed.kind.tag(),
        "name": listed.name,
        "about": listed.plugin.about,
        "own": listed.own,
        "properties": listed.plugin.rows().map(property).collect::<Vec<_>>(),
    })
}
