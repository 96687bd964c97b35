//! A chart as SVG: points with their intervals, fits as lines, axes that are linear or logarithmic, and a legend
//! below. Colours are of middling lightness, and ink and ground follow the reader's scheme, light or dark.

use std::fmt::Write as _;

use super::Fit;

/// What is drawn.
#[derive(Clone, Debug)]
pub(super) struct Chart {
    pub(super) title: String,
    pub(super) x: Scale,
    pub(super) y: Scale,
    pub(super) curves: Vec<Curve>,
}

/// An axis.
#[derive(Clone, Debug)]
pub(super) struct Scale {
    pub(super) label: String,
    /// `s` or `ns` where values are times, else nothing.
    pub(super) unit: &'static str,
    pub(super) logarithmic: bool,
}

/// Points of one colour.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    pub(super) label: String,
    /// Which of the colours: 0 to 3.
    pub(super) color: usize,
    pub(super) points: Vec<Spot>,
    /// Each with what the legend says of it, and where it begins.
    pub(super) fits: Vec<(String, Fit, f64)>,
}

/// A point with its interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) interval: [f64; 2],
}

/// The plot's place on the picture.
const LEFT: f64 = 62.0;
const TOP: f64 = 34.0;
const WIDTH: f64 = 440.0;
const HEIGHT: f64 = 250.0;
/// The picture's.
const FULL_WIDTH: f64 = LEFT + WIDTH + 18.0;
/// From one line of the legend to the next.
const LINE: f64 = 17.0;
/// Lines between the ends of a fit.
const STEPS: usize = 64;

/// Classes, so that a page that holds the picture can set others.
const STYLE: &str = "\
.plot text{font:12px system-ui,sans-serif;fill:#24292f}.plot .title{font-weight:600;font-size:13px}\
.plot .ground{fill:#ffffff}.plot .grid{stroke:#8884;stroke-width:1}.plot .frame{stroke:#888;fill:none}\
.plot .c0{stroke:#3b82d6;fill:#3b82d6}.plot .c1{stroke:#d9772b;fill:#d9772b}.plot .c2{stroke:#2f9e63;fill:#2f9e63}\
.plot .c3{stroke:#9a63d1;fill:#9a63d1}.plot .line{fill:none;stroke-width:1.5}\
@media(prefers-color-scheme:dark){.plot text{fill:#d6dae0}.plot .ground{fill:#16191e}}";

impl Chart {
    /// The chart as a document of its own.
    pub(super) fn svg(&self) -> String {
        let spots = || self.curves.iter().flat_map(|c| &c.points);
        let x = Span::around(spots().map(|s| s.x), &self.x);
        let y = Span::around(
            spots().flat_map(|s| [s.y, s.interval[0], s.interval[1]]),
            &self.y,
        );
        let rows: usize = self.curves.iter().map(|c| 1 + c.fits.len()).sum();
        let legend = TOP + HEIGHT + 48.0;
        let full_height = legend + LINE * rows as f64 + 6.0;
        let mut out = format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" class="plot" viewBox="0 0 {FULL_WIDTH} {full_height}" width="{FULL_WIDTH}" height="{full_height}" role="img"><title>{title}</title><style>{STYLE}</style><rect class="ground" width="100%" height="100%"/><text class="title" x="{LEFT}" y="20">{title}</text>"#,
            title = escaped(&self.title)
        );
        self.axes(&mut out, &x, &y);
        let _ = write!(
            out,
            r#"<clipPath id="inside"><rect x="{LEFT}" y="{TOP}" width="{WIDTH}" height="{HEIGHT}"/></clipPath>"#
        );
        let place =
            |px: f64, py: f64| (LEFT + WIDTH * x.part(px), TOP + HEIGHT * (1.0 - y.part(py)));
        let mut row = legend;
        for curve in &self.curves {
            let color = format!("c{}", curve.color);
            for (j, (label, fit, from)) in curve.fits.iter().enumerate() {
                let dash = DASHES[j % DASHES.len()];
                let begin = x.low.max(*from);
                let line = (0..=STEPS).filter_map(|k| {
                    let at = x.between(begin, x.high, k as f64 / STEPS as f64);
                    let value = fit.at(at);
                    (value > 0.0 || !self.y.logarithmic).then(|| place(at, value))
                });
                let line: Vec<String> = line.map(|(px, py)| format!("{px:.1},{py:.1}")).collect();
                let _ = write!(
                    out,
                    r#"<polyline class="{color} line" clip-path="url(#inside)" {dash} points="{}"/>"#,
                    line.join(" ")
                );
                let at = row + LINE * (j + 1) as f64;
                let _ = write!(
                    out,
                    r#"<polyline class="{color} line" {dash} points="{},{y} {},{y}"/><text x="{}" y="{}">{}</text>"#,
                    LEFT + 14.0,
                    LEFT + 38.0,
                    LEFT + 46.0,
                    at + 4.0,
                    escaped(label),
                    y = at
                );
            }
            for spot in &curve.points {
                let (px, py) = place(spot.x, spot.y);
                let [low, high] = spot.interval.map(|v| place(spot.x, v).1);
                let _ = write!(
                    out,
                    r#"<path class="{color}" d="M{px:.1} {low:.1}V{high:.1}"/><circle class="{color}" cx="{px:.1}" cy="{py:.1}" r="3.2"/>"#
                );
            }
            let _ = write!(
                out,
                r#"<circle class="{color}" cx="{}" cy="{row}" r="3.2"/><text x="{}" y="{}">{}</text>"#,
                LEFT + 6.0,
                LEFT + 14.0,
                row + 4.0,
                escaped(&curve.label)
            );
            row += LINE * (1 + curve.fits.len()) as f64;
        }
        out += "</svg>\n";
        out
    }

    fn axes(&self, out: &mut String, x: &Span, y: &Span) {
        for tick in x.ticks(6) {
            let at = LEFT + WIDTH * x.part(tick);
            let _ = write!(
                out,
                r#"<path class="grid" d="M{at:.1} {TOP}v{HEIGHT}"/><text x="{at:.1}" y="{}" text-anchor="middle">{}</text>"#,
                TOP + HEIGHT + 16.0,
                short(tick, self.x.unit)
            );
        }
        for tick in y.ticks(6) {
            let at = TOP + HEIGHT * (1.0 - y.part(tick));
            let _ = write!(
                out,
                r#"<path class="grid" d="M{LEFT} {at:.1}h{WIDTH}"/><text x="{}" y="{:.1}" text-anchor="end">{}</text>"#,
                LEFT - 6.0,
                at + 4.0,
                short(tick, self.y.unit)
            );
        }
        let _ = write!(
            out,
            r#"<rect class="frame" x="{LEFT}" y="{TOP}" width="{WIDTH}" height="{HEIGHT}"/><text x="{}" y="{}" text-anchor="middle">{}</text><text x="{}" y="20" text-anchor="end">{}</text>"#,
            LEFT + WIDTH / 2.0,
            TOP + HEIGHT + 33.0,
            escaped(&self.x.label),
            LEFT + WIDTH,
            escaped(&self.y.label)
        );
    }
}

/// Solid, dashed, dotted.
const DASHES: [&str; 3] = ["", r#"stroke-dasharray="6 4""#, r#"stroke-dasharray="2 3""#];

/// What an axis shows.
#[derive(Clone, Copy, Debug)]
struct Span {
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Span {
    /// Around the values, with some room.
    fn around(values: impl Iterator<Item = f64>, scale: &Scale) -> Self {
        let logarithmic = scale.logarithmic;
        let usable = values.filter(|v| v.is_finite() && (*v > 0.0 || !logarithmic));
        let (low, high) = usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        if low > high {
            return Self {
                low: 1.0,
                high: 10.0,
                logarithmic,
            };
        }
        if logarithmic {
            let room = (high / low).powf(0.04).max(1.05);
            return Self {
                low: low / room,
                high: high * room,
                logarithmic,
            };
        }
        // A linear axis begins at 0: what is twice as high is twice as much.
        Self {
            low: 0.0,
            high: (1.06 * high).max(f64::MIN_POSITIVE),
            logarithmic,
        }
    }

    /// Where a value lies, from 0 to 1.
    fn part(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value.max(f64::MIN_POSITIVE) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// The value at a part of the way between two.
    fn between(&self, a: f64, b: f64, part: f64) -> f64 {
        if self.logarithmic {
            a * (b / a).powf(part)
        } else {
            a + part * (b - a)
        }
    }

    /// About so many round values.
    fn ticks(&self, wanted: usize) -> Vec<f64> {
        let within = |v: &f64| (self.low..=self.high).contains(v);
        if self.logarithmic {
            let (first, last) = (
                self.low.log10().floor() as i32,
                self.high.log10().ceil() as i32,
            );
            let of = |digits: &[f64]| -> Vec<f64> {
                let all =
                    (first..=last).flat_map(|e| digits.iter().map(move |d| d * 10_f64.powi(e)));
                all.filter(within).collect()
            };
            let choices = [
                of(&[1.0, 2.0, 3.0, 5.0, 7.0]),
                of(&[1.0, 2.0, 5.0]),
                of(&[1.0, 3.0]),
            ];
            let dense = choices.into_iter().find(|ticks| ticks.len() <= wanted + 2);
            return dense.unwrap_or_else(|| {
                let all = of(&[1.0]);
                let step = all.len().div_ceil(wanted + 2);
                all.into_iter().step_by(step).collect()
            });
        }
        let rough = (self.high - self.low) / wanted as f64;
        let power = 10_f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|d| d * power);
        let step = step.into_iter().find(|s| *s >= rough).unwrap_or(rough);
        (0..=(self.high / step) as u32)
            .map(|i| f64::from(i) * step)
            .filter(within)
            .collect()
    }
}

/// A number with its prefix and unit: `20 ms`, `64k`.
fn short(value: f64, unit: &str) -> String {
    const PREFIXES: [(f64, &str); 7] = [
        (1e9, "G"),
        (1e6, "M"),
        (1e3, "k"),
        (1.0, ""),
        (1e-3, "m"),
        (1e-6, "µ"),
        (1e-9, "n"),
    ];
    if value == 0.0 {
        return "0".to_owned();
    }
    let (value, unit) = if unit == "ns" {
        (1e-9 * value, "s")
    } else {
        (value, unit)
    };
    let fits = |prefix: &&(f64, &str)| value >= 0.9999 * prefix.0;
    let (scale, prefix) = match PREFIXES.iter().find(fits) {
        _ if unit.is_empty() && value < 1.0 => (1.0, ""),
        found => *found.unwrap_or(&PREFIXES[6]),
    };
    let text = format!("{:.2}", value / scale);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    match unit {
        "" => format!("{text}{prefix}"),
        unit => format!("{text} {prefix}{unit}"),
    }
}

/// Text between tags and in attributes.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::{Model, Observed};

    #[test]
    fn a_chart_is_xml_with_a_point_for_each_value_and_a_line_for_each_fit() {
        let values = [(1e3, 10.0), (1e4, 12.0), (1e5, 14.5), (1e6, 17.0)];
        let observed = values.map(|(x, y)| Observed { x, values: vec![y] });
        let fits = [Model::Logarithm, Model::Power]
            .map(|m| ("a < b".to_owned(), Fit::new(m, &observed).unwrap(), 0.0));
        let curve = Curve {
            label: "tree & all".to_owned(),
            color: 1,
            points: values
                .map(|(x, y)| Spot {
                    x,
                    y,
                    interval: [y - 1.0, y + 1.0],
                })
                .to_vec(),
            fits: fits.to_vec(),
        };
        for logarithmic in [false, true] {
            let chart = Chart {
                title: "steps".to_owned(),
                x: Scale {
                    label: "O".to_owned(),
                    unit: "",
                    logarithmic: true,
                },
                y: Scale {
                    label: "y".to_owned(),
                    unit: "",
                    logarithmic,
                },
                curves: vec![curve.clone()],
            };
            let text = chart.svg();
            let svg = roxmltree::Document::parse(&text).unwrap();
            let count = |tag: &str| svg.descendants().filter(|n| n.has_tag_name(tag)).count();
            assert_eq!(count("circle"), 4 + 1);
            assert_eq!(count("polyline"), 2 * 2);
            assert!(!text.contains("NaN") && !text.contains("inf"));
        }
    }

    #[test]
    fn ticks_are_round_and_not_too_many() {
        for (low, high, logarithmic) in [
            (1.0, 9.0, true),
            (3e-4, 0.2, true),
            (1.0, 1e12, true),
            (0.0, 7.3, false),
            (0.0, 0.02, false),
        ] {
            let ticks = Span {
                low,
                high,
                logarithmic,
            }
            .ticks(6);
            assert!((3..=9).contains(&ticks.len()), "{low} {high}: {ticks:?}");
            assert!(ticks.iter().all(|t| (low..=high).contains(t)));
        }
    }

    #[test]
    fn numbers_are_short() {
        for (value, unit, text) in [
            (0.02, "s", "20 ms"),
            (1.5e-6, "s", "1.5 µs"),
            (65_536.0, "", "65.54k"),
            (1e6, "", "1M"),
            (250.0, "ns", "250 ns"),
            (2e5, "ns", "200 µs"),
            (0.5, "", "0.5"),
            (0.0, "s", "0"),
        ] {
            assert_eq!(short(value, unit), text);
        }
    }
}
