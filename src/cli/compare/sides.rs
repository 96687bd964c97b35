//! Several seeds a side.

use std::path::PathBuf;

use etendue::budget::Budget;
use etendue::compare::seeds::{self, Side, Verdict};
use etendue::compare::{Layer, pair};
use etendue::error::{Error, Location, Result};
use serde_json::Value;

use super::super::verdicts::judged;
use super::{Arguments, Difference, Outcome, T_TOP, head};

pub(super) fn sides(arguments: &Arguments) -> Result<Outcome> {
    let budget = arguments.memory.budget();
    let (a, layer) = side(arguments, &arguments.a, &budget)?;
    let (b, _) = side(arguments, &arguments.b, &budget)?;
    let verdict = seeds::judge(&a, &b, arguments.confidence)?;
    if let Some(precision) = arguments.precision {
        let mean = &verdict.means[0];
        if verdict.agrees && mean.half_width > precision {
            return Err(Error::input(format!(
                "a difference of the mean {} of up to {:.3} % could hide in the noise, more than the {:.3} % asked for",
                mean.channel,
                100.0 * mean.half_width,
                100.0 * precision
            ))
            .help("take more samples or seeds"));
        }
    }
    let difference = match arguments.shows() {
        true => Some(Difference {
            images: [a.mean()?, b.mean()?],
            sides: [("A", &arguments.a), ("B", &arguments.b)].map(|(side, paths)| {
                let paths: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
                (side, paths.join(", "))
            }),
            encoding: layer.encoding,
            rgb: layer.rgb,
            distance: match arguments.shows_distance() {
                true => seeds::map(&a, &b)?,
                false => Vec::new(),
            },
            label: "|t| between seeds",
            top: T_TOP,
        }),
        false => None,
    };
    let mut lines = head(&layer, &[]);
    lines.extend(verdict_lines(&verdict));
    let mut object = serde_json::to_value(&verdict).expect("it has only names and numbers");
    object["a"] = names(&arguments.a);
    object["b"] = names(&arguments.b);
    let rows = judged(&verdict, "B").into_iter();
    Ok(Outcome {
        agrees: verdict.agrees,
        rows: rows.map(|(label, text)| (label.to_owned(), text)).collect(),
        sentence: verdict.sentence,
        lines,
        difference,
        object,
    })
}

fn names(paths: &[PathBuf]) -> Value {
    paths.iter().map(|p| p.display().to_string()).collect()
}

/// Reads the images of a side, one after another; the first layer comes along.
fn side(arguments: &Arguments, paths: &[PathBuf], budget: &Budget) -> Result<(Side, Layer)> {
    let selection = arguments.selection();
    let mut gathered: Option<(Side, Layer)> = None;
    for path in paths {
        let here = |e: Error| e.at(&Location::of_file(path));
        let layer = Layer::read(path, &selection, budget)?;
        pair::check_finite(&layer, "it").map_err(here)?;
        match &mut gathered {
            Some((side, _)) => side.push(&layer.image).map_err(here)?,
            None => {
                let mut side = Side::new(&layer.image, layer.rgb)?;
                side.push(&layer.image).map_err(here)?;
                gathered = Some((side, layer));
            }
        }
    }
    gathered.ok_or_else(|| Error::input("a side has no images"))
}

fn verdict_lines(verdict: &Verdict) -> Vec<String> {
    let mut lines = vec![format!(
        "  {:10} {:>12} {:>12} {:>12} {:>10}",
        "mean", "a", "b", "difference", "±"
    )];
    for mean in &verdict.means {
        // Parts of a, where there are any.
        let (unit, factor) = if mean.a == 0.0 {
            ("  ", 1.0)
        } else {
            (" %", 100.0)
        };
        lines.push(format!(
            "  {:10} {:12.6} {:12.6} {:+10.4}{unit} {:8.4}{unit}{}",
            mean.channel,
            mean.a,
            mean.b,
            factor * mean.difference,
            factor * mean.half_width,
            if mean.agrees { "" } else { "  differs" }
        ));
    }
    for (name, test) in [("tiles", &verdict.tiles), ("pixels", &verdict.pixels)] {
        let worst = &test.worst;
        lines.push(format!(
            "  {name:10} {} of {} tests differ; most t = {:+.2}, p = {:.2e} (limit {:.2e}) at {}, {} in {}",
            test.differing, test.tests, worst.t, worst.p, test.limit, worst.x, worst.y, worst.channel
        ));
    }
    let noise = verdict.noise;
    lines.push(format!(
        "  {:10} {:.4e}, {:.2} times the {:.4e} expected from the noise of both sides",
        "relmse", noise.relmse, noise.ratio, noise.expected
    ));
    lines
}
