//! Drawings of colour as SVG: a spectrum over wavelength, and colours in the CIE 1931 chromaticity diagram.

use std::fmt::Write as _;

use crate::color::{Primaries, Space, chromaticity, cie};

/// The drawing's width and height, and the margin around what is plotted.
const SIZE: [f64; 2] = [640.0, 420.0];
const MARGIN: f64 = 56.0;

/// A plot's axes: the numbers at its ends.
struct Axes {
    size: [f64; 2],
    x: [f64; 2],
    y: [f64; 2],
}

impl Axes {
    fn x(&self, value: f64) -> f64 {
        let part = (value - self.x[0]) / (self.x[1] - self.x[0]);
        MARGIN + part * (self.size[0] - 1.5 * MARGIN)
    }

    fn y(&self, value: f64) -> f64 {
        let part = (value - self.y[0]) / (self.y[1] - self.y[0]);
        self.size[1] - MARGIN - part * (self.size[1] - 1.75 * MARGIN)
    }

    /// The frame, with numbers at even steps and the names of both axes.
    fn draw(&self, svg: &mut String, steps: [f64; 2], names: [&str; 2]) {
        let (left, right) = (self.x(self.x[0]), self.x(self.x[1]));
        let (bottom, top) = (self.y(self.y[0]), self.y(self.y[1]));
        let multiples = |[least, most]: [f64; 2], step: f64| {
            let first = (least / step).ceil() as i64;
            let last = (most / step + 1e-9).floor() as i64;
            (first..=last).map(move |i| i as f64 * step)
        };
        for value in multiples(self.x, steps[0]) {
            let x = self.x(value);
            let text = short(value, steps[0]);
            let _ = writeln!(
                svg,
                r##"<path d="M{x:.1} {top:.1}V{bottom:.1}" stroke="#ddd"/><text x="{x:.1}" y="{:.1}" text-anchor="middle">{text}</text>"##,
                bottom + 18.0
            );
        }
        for value in multiples(self.y, steps[1]) {
            let y = self.y(value);
            let text = short(value, steps[1]);
            let _ = writeln!(
                svg,
                r##"<path d="M{left:.1} {y:.1}H{right:.1}" stroke="#ddd"/><text x="{:.1}" y="{:.1}" text-anchor="end">{text}</text>"##,
                left - 6.0,
                y + 4.0
            );
        }
        let _ = writeln!(
            svg,
            r##"<path d="M{left:.1} {top:.1}V{bottom:.1}H{right:.1}" fill="none" stroke="#444"/>"##
        );
        let _ = writeln!(
            svg,
            r#"<text x="{:.1}" y="{:.1}" text-anchor="middle">{}</text>"#,
            0.5 * (left + right),
            bottom + 38.0,
            names[0]
        );
        let _ = writeln!(
            svg,
            r#"<text x="{left:.1}" y="{:.1}">{}</text>"#,
            top - 10.0,
            names[1]
        );
    }
}

/// A number that stands at a multiple of `step`.
fn short(value: f64, step: f64) -> String {
    let digits = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

/// A step of 1, 2 or 5 times a power of ten that parts `extent` into about `parts`.
fn step(extent: f64, parts: f64) -> f64 {
    let rough = extent / parts;
    let power = 10f64.powf(rough.log10().floor());
    let factors = [1.0, 2.0, 5.0, 10.0];
    let fits = factors.into_iter().find(|factor| factor * power >= rough);
    fits.unwrap_or(10.0) * power
}

fn begun([width, height]: [f64; 2]) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    )
}

/// `text` as SVG holds it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

/// The sRGB codes of X, Y, Z as CSS has them, as bright as the screen shows the colour.
fn css(xyz: [f64; 3]) -> String {
    let rgb = Space::Bt709.of_xyz(xyz).map(|v| v.max(0.0));
    let most = rgb[0].max(rgb[1]).max(rgb[2]).max(1e-9);
    let [r, g, b] = rgb.map(|v| {
        let code = crate::color::srgb::encode((v / most) as f32);
        (255.0 * code).round() as u8
    });
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A spectrum: points of (nm, value), nm increasing; under the line the colours of its wavelengths. Less than two points
/// are no spectrum, and leave the plot empty.
pub fn spectrum(title: &str, unit: &str, points: &[(f64, f64)]) -> String {
    let values = points.iter().map(|p| p.1);
    let (least, most) = values.fold((0.0, 0.0), |(a, b): (f64, f64), v| (a.min(v), b.max(v)));
    let most = if most > least { most } else { least + 1.0 };
    let ends = match (points.first(), points.last()) {
        (Some(first), Some(last)) if last.0 > first.0 => [first.0, last.0],
        _ => [f64::from(cie::FIRST), f64::from(cie::LAST)],
    };
    let axes = Axes {
        size: SIZE,
        x: ends,
        y: [least, most],
    };
    let mut svg = begun(SIZE);
    let zero = axes.y(0.0_f64.max(least));
    for pair in points.windows(2) {
        let [(a, low), (b, high)] = [pair[0], pair[1]];
        let fill = css(cie::xyz((0.5 * (a + b)) as f32).map(f64::from));
        let (left, right) = (axes.x(a), axes.x(b));
        let _ = writeln!(
            svg,
            r#"<path d="M{left:.2} {zero:.2}V{:.2}L{right:.2} {:.2}V{zero:.2}Z" fill="{fill}" fill-opacity="0.6"/>"#,
            axes.y(low),
            axes.y(high)
        );
    }
    axes.draw(
        &mut svg,
        [step(ends[1] - ends[0], 10.0), step(most - least, 5.0)],
        ["wavelength in nm", unit],
    );
    let line: Vec<String> = (points.iter())
        .map(|p| format!("{:.2},{:.2}", axes.x(p.0), axes.y(p.1)))
        .collect();
    let _ = writeln!(
        svg,
        r#"<polyline points="{}" fill="none" stroke="black" stroke-width="1.5"/>"#,
        line.join(" ")
    );
    let _ = writeln!(
        svg,
        r#"<text x="{:.1}" y="20" text-anchor="middle" font-weight="bold">{}</text>"#,
        0.5 * SIZE[0],
        escaped(title)
    );
    svg + "</svg>\n"
}

/// The chromaticities of monochromatic light, from 380 to 700 nm.
fn locus() -> Vec<[f64; 2]> {
    (76..=140)
        .map(|i| chromaticity(cie::xyz(5.0 * i as f32).map(f64::from)))
        .collect()
}

/// Whether a point lies within a polygon.
fn inside(polygon: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let mut inside = false;
    let mut last = polygon.len().wrapping_sub(1);
    for (i, [xi, yi]) in polygon.iter().enumerate() {
        let [xj, yj] = polygon[last];
        if (*yi > y) != (yj > y) && x < (xj - xi) * (y - yi) / (yj - yi) + xi {
            inside = !inside;
        }
        last = i;
    }
    inside
}

/// The CIE 1931 chromaticity diagram with gamuts by name, and points.
pub fn chromaticities(gamuts: &[(&str, Primaries)], points: &[[f64; 2]]) -> String {
    const CELL: f64 = 0.01;
    let axes = Axes {
        size: [560.0, 600.0],
        x: [0.0, 0.8],
        y: [0.0, 0.9],
    };
    let mut svg = begun(axes.size);
    let locus = locus();
    let cells = |most: f64| (0..(most / CELL) as u32).map(|i| (f64::from(i) + 0.5) * CELL);
    let (width, height) = (
        axes.x(CELL) - axes.x(0.0) + 0.3,
        axes.y(0.0) - axes.y(CELL) + 0.3,
    );
    for y in cells(0.9) {
        for x in cells(0.8).filter(|x| inside(&locus, [*x, y])) {
            let fill = css(Space::Xyy.to_xyz([x, y, 1.0]));
            let (left, top) = (axes.x(x - 0.5 * CELL), axes.y(y + 0.5 * CELL));
            let _ = writeln!(
                svg,
                r#"<rect x="{left:.1}" y="{top:.1}" width="{width:.1}" height="{height:.1}" fill="{fill}"/>"#
            );
        }
    }
    axes.draw(&mut svg, [0.1, 0.1], ["x", "y"]);
    let polygon = |corners: &[[f64; 2]]| -> String {
        let corners = corners
            .iter()
            .map(|[x, y]| format!("{:.2},{:.2}", axes.x(*x), axes.y(*y)));
        corners.collect::<Vec<_>>().join(" ")
    };
    let _ = writeln!(
        svg,
        r#"<polygon points="{}" fill="none" stroke="black"/>"#,
        polygon(&locus)
    );
    for [x, y] in points {
        let _ = writeln!(
            svg,
            r#"<circle cx="{:.2}" cy="{:.2}" r="1.2" fill="black" fill-opacity="0.5"/>"#,
            axes.x(*x),
            axes.y(*y)
        );
    }
    for (name, primaries) in gamuts {
        let Primaries {
            red,
            green,
            blue,
            white,
        } = *primaries;
        let _ = writeln!(
            svg,
            r#"<polygon points="{}" fill="none" stroke="white" stroke-width="3"/><polygon points="{}" fill="none" stroke="black" stroke-width="1.2"/>"#,
            polygon(&[red, green, blue]),
            polygon(&[red, green, blue])
        );
        let _ = writeln!(
            svg,
            r#"<circle cx="{:.2}" cy="{:.2}" r="3" fill="none" stroke="black"/>"#,
            axes.x(white[0]),
            axes.y(white[1])
        );
        let _ = writeln!(
            svg,
            r#"<text x="{:.1}" y="{:.1}">{}</text>"#,
            axes.x(green[0]) + 4.0,
            axes.y(green[1]) - 4.0,
            escaped(name)
        );
    }
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawings_are_xml_whatever_they_show() {
        let gamuts = [("bt709 & <more>", Primaries::BT709)];
        for svg in [
            spectrum(
                "a < b & c",
                "W",
                &[(400.0, 1.0), (500.0, -2.0), (700.0, 0.5)],
            ),
            spectrum("none", "W", &[]),
            spectrum("one", "W", &[(500.0, 1.0)]),
            spectrum("dark", "W", &[(400.0, 0.0), (700.0, 0.0)]),
            chromaticities(&gamuts, &[[0.3, 0.3], [0.6, 0.3]]),
        ] {
            let document =
                roxmltree::Document::parse(&svg).unwrap_or_else(|e| panic!("{e}: {svg}"));
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            assert_eq!(document.root_element().tag_name().name(), "svg");
        }
    }

    #[test]
    fn the_locus_is_the_horseshoe() {
        let locus = locus();
        // 520 nm, and the ends, as CIE 15 has them.
        let near =
            |[x, y]: [f64; 2], [a, b]: [f64; 2]| (x - a).abs() < 1e-3 && (y - b).abs() < 1e-3;
        assert!(near(locus[28], [0.0743, 0.8338]), "{:?}", locus[28]);
        assert!(near(locus[0], [0.1741, 0.0050]), "{:?}", locus[0]);
        assert!(near(locus[64], [0.7347, 0.2653]), "{:?}", locus[64]);
        assert!(inside(&locus, [0.3127, 0.329]) && !inside(&locus, [0.1, 0.05]));
    }

    #[test]
    fn steps_are_round() {
        assert_eq!(
            [step(470.0, 10.0), step(1.0, 5.0), step(37.0, 5.0)],
            [50.0, 0.2, 10.0]
        );
    }
}
