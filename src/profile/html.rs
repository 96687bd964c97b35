//! A profile as one page that asks nobody for anything: verdicts first, then the charts, what the machine did, and
//! all numbers. Light or dark as the reader has it.

use std::fmt::Write as _;

use super::chart::escaped;
use super::plot::law;
use super::{Comparison, Outcome, Profile, Quantity, Series, median, median_interval};

const STYLE: &str = "\
:root{color-scheme:light dark}body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:1120px;\
padding:0 1rem;color:#24292f;background:#fff}h1{font-size:1.5rem}h2{font-size:1.1rem;margin-top:2rem}\
table{border-collapse:collapse;font-size:13px}td,th{padding:.2rem .7rem;text-align:right;\
border-bottom:1px solid #8883}td:first-child,th:first-child,.words td,.words th{text-align:left}\
.plots{display:flex;flex-wrap:wrap;gap:1rem;align-items:flex-start}.plots svg{max-width:100%;height:auto;border:1px solid #8883;\
border-radius:6px}.yes{color:#1a7f45}.no{color:#c2410c}.open{color:#8a6d00}.warning{border-left:4px solid #d97706;\
padding:.4rem 1rem;background:#d977061a}details{margin:.5rem 0}summary{cursor:pointer}.wide{overflow-x:auto}\
@media(prefers-color-scheme:dark){body{color:#d6dae0;background:#0f1115}.yes{color:#4cc383}.no{color:#fb923c}\
.open{color:#e0b93f}}";

impl Profile {
    /// The page, with what changed since an older profile.
    pub fn to_html(&self, comparison: Option<&Comparison>) -> String {
        let mut page = format!(
            r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>Profile of {subject}</title><link rel="icon" href="data:,"><style>{STYLE}</style></head><body>
<h1>What it costs as it grows: {subject}</h1>
<p><strong>{answer}</strong></p>
<p>Étendue {version} on {machine}; {rounds} rounds over {renders} renders in {seconds:.0} s. The textbook says
O(P·O·L) by brute force, × N/3 for N bands, and log O for a tree: P pixels, O triangles, L lights. Counts are the same
on every machine; times are medians, with intervals that hold them in 95 of 100 cases.</p>
"#,
            answer = escaped(&self.answer().unwrap_or_default()),
            machine = escaped(&self.machine),
            subject = escaped(&self.subject),
            version = escaped(&self.version),
            rounds = self.rounds,
            renders = self.series.iter().map(|s| s.points.len()).sum::<usize>(),
            seconds = self.seconds,
        );
        if let Some(warning) = self.noise.warning() {
            let warning = escaped(&warning);
            let _ = writeln!(
                page,
                r#"<p class="warning">{warning}. Times are not judged.</p>"#
            );
        }
        self.verdict_table(&mut page);
        page += "<h2>Charts</h2>\n<div class=\"plots\">\n";
        for plot in self.plots() {
            // One picture's ids are not another's.
            page += &plot.svg.replace("inside", &format!("inside-{}", plot.name));
        }
        page += "</div>\n";
        self.fits_table(&mut page);
        self.limits(&mut page);
        if let Some(comparison) = comparison {
            changes(&mut page, comparison);
        }
        page += "<h2>All numbers</h2>\n";
        for series in &self.series {
            numbers(&mut page, series);
        }
        for note in &self.notes {
            let _ = writeln!(page, "<p>{}</p>", escaped(note));
        }
        page += "</body></html>\n";
        page
    }

    fn verdict_table(&self, page: &mut String) {
        *page += "<h2>Verdicts</h2>\n<div class=\"wide\"><table class=\"words\"><tr><th>what</th><th>predicted</th>\
                  <th>measured</th><th>verdict</th></tr>\n";
        for verdict in &self.verdicts {
            let class = match verdict.outcome {
                Outcome::Confirmed => "yes",
                Outcome::NotConfirmed => "no",
                Outcome::TooNoisy => "open",
            };
            let _ = writeln!(
                page,
                r#"<tr><td>{}</td><td>{}</td><td>{}</td><td class="{class}">{}</td></tr>"#,
                escaped(&verdict.subject),
                escaped(&verdict.predicted),
                escaped(&verdict.measured),
                verdict.outcome.name()
            );
        }
        *page += "</table></div>\n";
    }

    fn fits_table(&self, page: &mut String) {
        *page += "<h2>Fits</h2>\n<div class=\"wide\"><table class=\"words\"><tr><th>axis</th><th>way</th>\
                  <th>quantity</th><th>law</th></tr>\n";
        for series in &self.series {
            for growth in &series.fits {
                let _ = writeln!(
                    page,
                    "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                    series.axis,
                    series.way.name(),
                    growth.quantity.name(),
                    escaped(&law(series.axis, &growth.fit))
                );
            }
        }
        *page += "</table></div>\n";
    }

    fn limits(&self, page: &mut String) {
        *page += "<h2>Tree, threads and the machine</h2>\n<ul>\n";
        for line in self.facts() {
            let _ = writeln!(page, "<li>{}</li>", escaped(&line));
        }
        *page += "</ul>\n";
    }
}

fn changes(page: &mut String, comparison: &Comparison) {
    let _ = writeln!(
        page,
        "<h2>Since version {}</h2>\n<p>{}.</p>",
        escaped(&comparison.version),
        escaped(&comparison.summary())
    );
    *page += "<div class=\"wide\"><table><tr><th>series</th><th>x</th><th>quantity</th><th>now in parts of then\
              </th></tr>\n";
    for change in &comparison.changes {
        let [low, high] = change.interval;
        let _ = writeln!(
            page,
            "<tr><td>{} · {}</td><td>{}</td><td>{}</td><td>{:.4} [{low:.4}, {high:.4}]</td></tr>",
            change.axis,
            change.way.name(),
            change.place(),
            change.quantity.bare_name(),
            change.ratio
        );
    }
    *page += "</table></div>\n";
}

fn numbers(page: &mut String, series: &Series) {
    const TIMES: [Quantity; 6] = [
        Quantity::Load,
        Quantity::Build,
        Quantity::Render,
        Quantity::Trace,
        Quantity::Shade,
        Quantity::Film,
    ];
    let _ = write!(
        page,
        "<details><summary>{}</summary><div class=\"wide\"><table><tr><th>{}</th><th>camera rays</th><th>bounces</th>\
         <th>shadow rays</th><th>shaded</th><th>node steps</th><th>tests</th>",
        escaped(&series.title()),
        series.axis
    );
    for quantity in TIMES {
        let _ = write!(page, "<th>{}</th>", quantity.name());
    }
    *page += "</tr>\n";
    for point in &series.points {
        let stats = &point.stats;
        let counts = [
            stats.camera_rays,
            stats.bounce_rays,
            stats.shadow_rays,
            stats.shaded,
            stats.tracing.node_steps,
            stats.tracing.primitive_tests,
        ];
        let _ = write!(page, "<tr><td>{}</td>", point.x);
        for count in counts {
            let _ = write!(page, "<td>{count}</td>");
        }
        for quantity in TIMES {
            let values = quantity.of(point);
            let [low, high] = median_interval(&values);
            let _ = write!(
                page,
                "<td title=\"{low:.6} to {high:.6}\">{:.6}</td>",
                median(&values)
            );
        }
        *page += "</tr>\n";
    }
    *page += "</table></div></details>\n";
}
