//! Two images: all metrics, limits on them and a map.

use std::path::Path;

use etendue::compare::map;
use etendue::compare::metric::ChannelMeans;
use etendue::compare::pair::{self, Figure, Report};
use etendue::compare::seeds;
use etendue::compare::{Layer, flip};
use etendue::error::{Error, Location, Result};
use etendue::image::Encoding;
use serde_json::json;

use super::{Arguments, Difference, Limit, MapOf, Outcome, head};

pub(super) fn two(arguments: &Arguments, path_a: &Path, path_b: &Path) -> Result<Outcome> {
    let selection = arguments.selection();
    let budget = arguments.memory.budget();
    let (mut a, mut b) = (
        Layer::read(path_a, &selection, &budget)?,
        Layer::read(path_b, &selection, &budget)?,
    );
    Layer::align(&mut a, &mut b)?;
    for (layer, path) in [(&a, path_a), (&b, path_b)] {
        pair::check_finite(layer, "it").map_err(|e| e.at(&Location::of_file(path)))?;
    }
    let options = pair::Options {
        peak: arguments.peak,
        pixels_per_degree: arguments.ppd,
    };
    let report = pair::measure(&a, &b, &options)?;
    let (agrees, sentence) = judge(arguments, &report)?;
    let mut object = serde_json::to_value(&report).expect("it has only names and numbers");
    object["a"] = path_a.display().to_string().into();
    object["b"] = path_b.display().to_string().into();
    object["values"] = pair::kind_of_values(a.encoding).into();
    object["not_compared"] = json!({ "a": a.others, "b": b.others });
    let mut lines = head(&a, &[(path_a, "A"), (path_b, "B")]);
    lines.extend(table(&report));
    let difference = match arguments.shows() {
        true => {
            let (distance, label, top) = match arguments.shows_distance() {
                true => distance(arguments, &a, &b)?,
                false => Default::default(),
            };
            Some(Difference {
                encoding: a.encoding,
                rgb: a.rgb,
                images: [a.image, b.image],
                sides: [("A", path_a), ("B", path_b)]
                    .map(|(side, path)| (side, path.display().to_string())),
                distance,
                label,
                top,
            })
        }
        false => None,
    };
    Ok(Outcome {
        agrees,
        sentence,
        lines,
        rows: rows(&report),
        object,
        difference,
    })
}

fn table(report: &Report) -> Vec<String> {
    let means = report.channels.iter().map(|c| {
        format!(
            "  {:10} {:12.6} {:12.6} {:+12.4e}",
            c.channel, c.a, c.b, c.bias
        )
    });
    let mut lines = vec![format!(
        "  {:10} {:>12} {:>12} {:>12}",
        "channel", "mean a", "mean b", "bias"
    )];
    lines.extend(means);
    lines.push(String::new());
    for Figure { metric, value } in &report.metrics {
        lines.push(format!(
            "  {:10} {:>12}   {}",
            metric.name(),
            figure(value),
            metric.description()
        ));
    }
    lines
}

/// A metric's value, or why there is none.
fn figure(value: &std::result::Result<f64, String>) -> String {
    match value {
        Ok(value) if value.is_infinite() => "∞".to_owned(),
        Ok(value) if *value == 0.0 || (1e-3..1e6).contains(&value.abs()) => {
            format!("{value:.6}")
        }
        Ok(value) => format!("{value:.5e}"),
        Err(why) => format!("none: {why}"),
    }
}

/// The same for a page.
fn rows(report: &Report) -> Vec<(String, String)> {
    let means = report.channels.iter().map(|c| {
        let text = format!("{:.6} in A, {:.6} in B, {:+.4e}", c.a, c.b, c.bias);
        (format!("mean {}", c.channel), text)
    });
    let metrics = report.metrics.iter().map(|Figure { metric, value }| {
        let text = format!("{} ({})", figure(value), metric.description());
        (metric.name().to_owned(), text)
    });
    means.chain(metrics).collect()
}

/// By how much B is brighter, over all channels.
fn in_words(report: &Report) -> String {
    let mean = |of: fn(&ChannelMeans) -> f64| report.channels.iter().map(of).sum::<f64>();
    let (a, b) = (mean(|c| c.a), mean(|c| c.b));
    let scale = if a == 0.0 { 1.0 } else { a };
    seeds::brighter("B", "luminance", a, (b - a) / scale)
}

/// Whether a pair keeps within the limits or, without any, is equal; and that in words.
fn judge(arguments: &Arguments, report: &Report) -> Result<(bool, String)> {
    let above = arguments.fail_above.iter().map(|l| (l, true));
    let below = arguments.fail_below.iter().map(|l| (l, false));
    let limits: Vec<(&Limit, bool)> = above.chain(below).collect();
    if limits.is_empty() {
        let Some(worst) = &report.worst else {
            return Ok((true, "A and B are equal".to_owned()));
        };
        let [width, height] = report.size.map(u64::from);
        let sentence = format!(
            "A and B differ in {} of {} pixels, most at {}, {} in {} ({} and {}); {}",
            report.differing_pixels,
            width * height,
            worst.x,
            worst.y,
            worst.channel,
            worst.a,
            worst.b,
            in_words(report)
        );
        return Ok((false, sentence));
    }
    let mut failed = Vec::new();
    let mut kept = Vec::new();
    for (limit, is_above) in limits {
        let name = limit.metric.name();
        if is_above == limit.metric.is_similarity() {
            let right = if is_above {
                "--fail-below"
            } else {
                "--fail-above"
            };
            let better = if is_above { "more" } else { "less" };
            return Err(Error::input(format!("{better} {name} is better"))
                .help(format!("use {right} {name}={}", limit.value)));
        }
        let value = report.value(limit.metric)?;
        let fails = if is_above {
            value > limit.value
        } else {
            value < limit.value
        };
        let side = if fails == is_above { "above" } else { "below" };
        let text = format!("{name} {value:.6} {side} {}", limit.value);
        if fails { &mut failed } else { &mut kept }.push(text);
    }
    Ok(if failed.is_empty() {
        (true, format!("A and B agree: {}", kept.join(", ")))
    } else {
        (false, format!("A and B differ: {}", failed.join(", ")))
    })
}

/// How far apart pixels are, what that is, and where the scale ends.
fn distance(arguments: &Arguments, a: &Layer, b: &Layer) -> Result<(Vec<f32>, &'static str, f32)> {
    let is_color = a.rgb.is_some();
    let of = arguments.map_of.unwrap_or(if is_color {
        MapOf::Flip
    } else {
        MapOf::Difference
    });
    let greatest = |term: fn(f32, f32) -> f32| -> Vec<f32> {
        let count = a.image.channels().len();
        let pixels = a
            .image
            .data()
            .chunks(count)
            .zip(b.image.data().chunks(count));
        let pixel = |(pa, pb): (&[f32], &[f32])| {
            pa.iter()
                .zip(pb)
                .map(|(a, b)| term(*a, *b))
                .fold(0.0, f32::max)
        };
        pixels.map(pixel).collect()
    };
    let ppd = arguments.ppd;
    let (values, label) = match of {
        MapOf::Flip if a.encoding == Encoding::Linear => (flip::hdr(a, b, ppd)?, "HDR-FLIP"),
        MapOf::Flip => (flip::ldr(a, b, ppd)?, "FLIP"),
        MapOf::Difference => (greatest(|a, b| (b - a).abs()), "|b - a|"),
        MapOf::Relative => (
            greatest(|a, b| (b - a).abs() / (a.abs() + 0.01)),
            "relative |b - a|",
        ),
    };
    let top = if of == MapOf::Flip {
        1.0
    } else {
        map::robust_top(&values)
    };
    Ok((values, label, top))
}
