//! Pairs of images as a page that a browser shows: one file, without a network.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use etendue::color::luminance;
use etendue::compare::map::{Scale, robust_top};
use etendue::compare::seeds::TILE;
use etendue::display::{DisplayTransform, srgb};
use etendue::error::Result;
use etendue::file;
use etendue::image::{Codes, Encoding, Image, Layout, Picture};
use exr::prelude::f16;
use serde_json::{Value, json};

const TEMPLATE: &str = include_str!("page.html");
/// Where the template wants the data.
const PLACE: &str = "/*DATA*/";

/// Tiles that are listed.
const WORST: usize = 8;
/// Bytes of exact values that a pair of images may have: those of 96 × 64 pixels fit, and three pairs of 640 × 360 pixels
/// are a page of 2 MB.
const MOST_EXACT: usize = 96 << 10;
/// Bytes a pixel that a picture may take, and a map: so three pairs of 640 × 480 pixels are a page of 2 MB, however noisy
/// they are.
const PICTURE: f64 = 0.5;
const MAP: f64 = 0.25;
/// Qualities of JPEG, of which the first is taken that fits, or else the last.
const QUALITIES: [u8; 6] = [95, 90, 80, 65, 50, 30];
/// Steps of a colour bar.
const STEPS: u8 = 16;

/// What is shown.
#[derive(Debug)]
pub(super) struct Page<'a> {
    /// The heading.
    pub(super) title: &'a str,
    /// What both sides of each pair are called, the reference first.
    pub(super) sides: [&'a str; 2],
    pub(super) scenes: Vec<Scene<'a>>,
}

/// A part of the page, with at most one pair of images.
#[derive(Debug)]
pub(super) struct Scene<'a> {
    pub(super) name: &'a str,
    /// Such as `agree`.
    pub(super) status: &'a str,
    /// What is said of it, with labels.
    pub(super) lines: Vec<(String, String)>,
    pub(super) pair: Option<Pair<'a>>,
}

/// Two images of the same size and channels, and where they differ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair<'a> {
    pub(super) reference: &'a Image,
    pub(super) other: &'a Image,
    /// What the values of both mean.
    pub(super) encoding: Encoding,
    /// The channels of red, green and blue, if they are colours.
    pub(super) rgb: Option<[usize; 3]>,
    /// How far apart they are, row by row.
    pub(super) distance: &'a [f32],
    /// What that is, such as `|b - a|`.
    pub(super) label: &'a str,
    /// The distance that takes the last colour.
    pub(super) top: f32,
    /// By how much the other is brighter: see [`etendue::compare::signed::relative`].
    pub(super) brighter: &'a [f32],
}

/// The file of a page.
fn file_of(folder: &Path) -> PathBuf {
    folder.join("index.html")
}

/// Finds out before the work what would stop the page from being written.
pub(super) fn check_writable(folder: &Path) -> Result<()> {
    file::check_writable(&file_of(folder))
}

impl Page<'_> {
    /// Writes `index.html` into the folder, which is made where it is not there.
    pub(super) fn write(&self, folder: &Path) -> Result<()> {
        let scenes: Result<Vec<Value>> = self.scenes.iter().map(scene).collect();
        let data = json!({
            "title": self.title,
            "sides": self.sides,
            "scenes": scenes?,
            "about": concat!("Made by etendue ", env!("CARGO_PKG_VERSION"), "."),
        });
        // What would end the script's element.
        let data = data.to_string().replace("</", "<\\/");
        let page = TEMPLATE.replace(PLACE, &data);
        file::write_atomically(&file_of(folder), page.as_bytes())
    }
}

fn scene(scene: &Scene<'_>) -> Result<Value> {
    let pair = scene.pair.as_ref().map(Pair::object).transpose()?;
    Ok(json!({
        "name": scene.name,
        "status": scene.status,
        "lines": scene.lines,
        "pictures": pair,
    }))
}

impl Pair<'_> {
    fn object(&self) -> Result<Value> {
        let [width, height] = [self.reference.width(), self.reference.height()];
        let channels = self.channels();
        let means = [self.reference, self.other].map(|image| tiles(image, &channels));
        let across = (width as usize).div_ceil(TILE);
        let mut worst: Vec<(f64, usize)> = (0..means[0].len())
            .map(|tile| (self.part(&means[0][tile], &means[1][tile]), tile))
            .collect();
        worst.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
        let exact = self.exact(worst.iter().map(|(_, tile)| *tile), &channels);
        worst.truncate(WORST);
        let named = worst.iter().map(|(part, tile)| {
            let (x, y) = (tile % across * TILE, tile / across * TILE);
            json!([x, y, format!("{:+.2} %", 100.0 * part)])
        });
        let range = self.range(&channels);
        let shown = |image| self.shown(image, &channels, range);
        let brightest = robust_top(self.brighter);
        let percent = format!("{:.2} %", 100.0 * brightest);
        let names: Vec<&String> = (channels.iter())
            .map(|&c| &self.reference.channels()[c])
            .collect();
        Ok(json!({
            "width": width,
            "height": height,
            "tile": TILE,
            "across": across,
            "channels": names,
            "shown": self.legend(&names, range),
            "range": range.or((self.encoding == Encoding::Srgb).then_some([0.0, 1.0])),
            "a": address(&shown(self.reference)?, PICTURE)?,
            "b": address(&shown(self.other)?, PICTURE)?,
            "exact": exact,
            "error": address(&map([width, height], self.distance, Scale::FromZero, self.top)?, MAP)?,
            "error_label": self.label,
            "error_bar": bar(Scale::FromZero),
            "error_ends": ["0", short(self.top)],
            "signed": address(&map([width, height], self.brighter, Scale::AboutZero, brightest)?, MAP)?,
            "signed_bar": bar(Scale::AboutZero),
            "signed_ends": [format!("-{percent}"), format!("+{percent}")],
            "means": means,
            "worst": named.collect::<Value>(),
        }))
    }

    /// The pixels of tiles as numbers of half precision, for as many of them as there is room for: tile by tile, each row by
    /// row, and of each pixel the channels of the reference, then those of the other.
    fn exact(&self, order: impl Iterator<Item = usize>, channels: &[usize]) -> Value {
        let (width, height) = (self.reference.width(), self.reference.height());
        let across = (width as usize).div_ceil(TILE) as u32;
        let side = TILE as u32;
        let (mut tiles, mut bytes) = (Vec::new(), Vec::new());
        for tile in order {
            let (x, y) = (tile as u32 % across * side, tile as u32 / across * side);
            let (right, bottom) = ((x + side).min(width), (y + side).min(height));
            let pixels = (right - x) as usize * (bottom - y) as usize;
            if bytes.len() + 4 * pixels * channels.len() > MOST_EXACT {
                break;
            }
            tiles.push(tile);
            for (x, y) in (y..bottom).flat_map(|y| (x..right).map(move |x| (x, y))) {
                for image in [self.reference, self.other] {
                    let values = channels.iter().map(|&c| f16::from_f32(image.get(x, y, c)));
                    bytes.extend(values.flat_map(f16::to_le_bytes));
                }
            }
        }
        json!({ "tiles": tiles, "values": BASE64_STANDARD.encode(bytes) })
    }

    /// What is told in numbers: red, green and blue, or the first three of other channels.
    fn channels(&self) -> Vec<usize> {
        match self.rgb {
            Some([r, g, b]) if r != g => vec![r, g, b],
            Some([y, ..]) => vec![y],
            None => (0..self.reference.channels().len()).take(3).collect(),
        }
    }

    /// By which part of itself a mean differs: the luminance of colours, of other channels the one that differs most.
    fn part(&self, reference: &[f64], other: &[f64]) -> f64 {
        let part = |a: f64, b: f64| if a == 0.0 { b } else { (b - a) / a.abs() };
        match (reference, other) {
            (&[ar, ag, ab], &[br, bg, bb]) if self.rgb.is_some() => {
                let [a, b] = [[ar, ag, ab], [br, bg, bb]]
                    .map(|rgb| f64::from(luminance(rgb.map(|v| v as f32))));
                part(a, b)
            }
            _ => {
                let parts = reference.iter().zip(other).map(|(a, b)| part(*a, *b));
                parts.fold(
                    0.0,
                    |most: f64, part| {
                        if part.abs() > most.abs() { part } else { most }
                    },
                )
            }
        }
    }

    /// The least and the greatest value of both, where they are no colours.
    fn range(&self, channels: &[usize]) -> Option<[f32; 2]> {
        if self.rgb.is_some() {
            return None;
        }
        let values = [self.reference, self.other].into_iter().flat_map(|image| {
            let pixels = image.data().chunks_exact(image.channels().len());
            pixels.flat_map(|pixel| channels.iter().map(|&c| pixel[c]))
        });
        let start = [f32::INFINITY, f32::NEG_INFINITY];
        Some(values.fold(start, |[least, most], v| [least.min(v), most.max(v)]))
    }

    /// How an image is seen: as a screen shows colours, and other channels from black, the least value, to the greatest.
    fn shown(&self, image: &Image, channels: &[usize], range: Option<[f32; 2]>) -> Result<Codes> {
        let Some([least, most]) = range else {
            let linear = match self.encoding {
                Encoding::Linear => Cow::Borrowed(image),
                Encoding::Srgb => Cow::Owned(srgb::linear(Picture {
                    image: image.clone(),
                    encoding: self.encoding,
                    metadata: Vec::new(),
                    warnings: Vec::new(),
                })),
            };
            return DisplayTransform::default().shown(&linear);
        };
        let scale = (most - least).max(f32::MIN_POSITIVE);
        let code = |v: f32| (255.0 * ((v - least) / scale).clamp(0.0, 1.0)).round() as u8;
        let pixels = image.data().chunks_exact(image.channels().len());
        let (layout, codes) = match *channels {
            [c] => (Layout::Grey, pixels.map(|pixel| code(pixel[c])).collect()),
            _ => {
                let channel =
                    |pixel: &[f32], i: usize| channels.get(i).map_or(0, |&c| code(pixel[c]));
                let colors = pixels.flat_map(|pixel| [0, 1, 2].map(|i| channel(pixel, i)));
                (Layout::Rgb, colors.collect())
            }
        };
        Codes::new(image.width(), image.height(), layout, codes)
    }

    /// What the colours of [`Pair::shown`] mean, where they are no colours.
    fn legend(&self, names: &[&String], range: Option<[f32; 2]>) -> String {
        let Some([least, most]) = range else {
            return String::new();
        };
        let names: Vec<&str> = names.iter().map(|name| name.as_str()).collect();
        let colors = ["grey", "red and green", "red, green and blue"][names.len() - 1];
        let [least, most] = [least, most].map(short);
        format!(
            "Shown as {colors}: {}, from {least} (dark) to {most} (bright).",
            names.join(", ")
        )
    }
}

/// The channels' means over tiles, row by row.
fn tiles(image: &Image, channels: &[usize]) -> Vec<Vec<f64>> {
    let [width, height] = [image.width() as usize, image.height() as usize];
    let across = width.div_ceil(TILE);
    let tiles = across * height.div_ceil(TILE);
    let mut sums = vec![vec![0.0_f64; channels.len()]; tiles];
    let mut counts = vec![0.0_f64; tiles];
    let pixels = image.data().chunks_exact(image.channels().len());
    for (i, pixel) in pixels.enumerate() {
        let tile = i / width / TILE * across + i % width / TILE;
        for (sum, &c) in sums[tile].iter_mut().zip(channels) {
            *sum += f64::from(pixel[c]);
        }
        counts[tile] += 1.0;
    }
    // Four digits are shown.
    let short = |v: f64| format!("{v:.4e}").parse().unwrap_or(0.0);
    for (sums, count) in sums.iter_mut().zip(counts) {
        sums.iter_mut().for_each(|sum| *sum = short(*sum / count));
    }
    sums
}

/// A number of three digits.
fn short(value: f32) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if (1e-3..1e4).contains(&size) => {
            let digits = (2.0 - size.log10().floor()).max(0.0) as usize;
            let text = format!("{value:.digits$}");
            match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
                false => text,
            }
        }
        _ => format!("{value:.2e}"),
    }
}

/// One colour a pixel.
fn map([width, height]: [u32; 2], values: &[f32], scale: Scale, top: f32) -> Result<Codes> {
    let codes = values.iter().flat_map(|v| scale.color(*v, top)).collect();
    Codes::new(width, height, Layout::Rgb, codes)
}

/// A scale's colours from its beginning to its end, as a browser takes them.
fn bar(scale: Scale) -> String {
    let color = |step: u8| {
        let part = f32::from(step) / f32::from(STEPS);
        let [r, g, b] = match scale {
            Scale::FromZero => scale.color(part, 1.0),
            Scale::AboutZero => scale.color(2.0 * part - 1.0, 1.0),
        };
        format!("rgb({r} {g} {b})")
    };
    let colors: Vec<String> = (0..=STEPS).map(color).collect();
    format!("linear-gradient(to right, {})", colors.join(", "))
}

/// The picture as an address that holds it, in about so many bytes a pixel.
fn address(codes: &Codes, most: f64) -> Result<String> {
    /// Of small pictures what stands before the pixels is most of the file.
    const HEAD: f64 = 2048.0;
    let most = HEAD + most * f64::from(codes.width()) * f64::from(codes.height());
    let mut jpeg = Vec::new();
    for quality in QUALITIES {
        jpeg = codes.to_jpeg_of(quality)?;
        if jpeg.len() as f64 <= most {
            break;
        }
    }
    let bytes = BASE64_STANDARD.encode(jpeg);
    Ok(format!("data:image/jpeg;base64,{bytes}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(names: &[&str], value: f32) -> Image {
        let data = vec![value; 20 * 17 * names.len()];
        let names = names.iter().map(ToString::to_string).collect();
        Image::from_data(20, 17, names, data).unwrap()
    }

    fn pair<'a>(reference: &'a Image, other: &'a Image, rgb: Option<[usize; 3]>) -> Pair<'a> {
        Pair {
            reference,
            other,
            encoding: Encoding::Linear,
            rgb,
            distance: &[1.26; 20 * 17],
            label: "standard errors",
            top: 1.26,
            brighter: &[0.01; 20 * 17],
        }
    }

    #[test]
    fn a_page_is_one_file_with_all_that_it_shows() {
        let names = ["R", "G", "B"];
        let (a, b) = (image(&names, 0.5), image(&names, 0.505));
        let scene = Scene {
            name: "</script><b>",
            status: "differ",
            lines: vec![("mean".to_owned(), "1 % brighter".to_owned())],
            pair: Some(pair(&a, &b, Some([0, 1, 2]))),
        };
        let page = Page {
            title: "A title",
            sides: ["Mitsuba", "Étendue"],
            scenes: vec![scene],
        };
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("new/page");
        check_writable(&folder).unwrap();
        assert!(!folder.exists());
        page.write(&folder).unwrap();
        let page = std::fs::read_to_string(folder.join("index.html")).unwrap();
        assert!(!page.contains("http"), "it needs no network");
        let (_, data) = page.split_once("id=\"data\">").unwrap();
        let (data, _) = data.split_once("</script>").unwrap();
        let data: Value = serde_json::from_str(data).unwrap();
        assert_eq!(data["sides"][1], "Étendue");
        let scene = &data["scenes"][0];
        assert_eq!(scene["name"], "</script><b>");
        assert_eq!(scene["pictures"]["worst"][0][2], "+1.00 %");
        assert_eq!(scene["pictures"]["means"][1][3][0], 0.505);
        // All tiles fit, so that every pixel is there.
        let exact = &scene["pictures"]["exact"];
        assert_eq!(exact["tiles"].as_array().unwrap().len(), 4);
        let values = BASE64_STANDARD.decode(exact["values"].as_str().unwrap());
        let values = values.unwrap();
        let pixels = values.as_chunks::<12>().0;
        assert_eq!(pixels.len(), 20 * 17);
        for pixel in pixels {
            let values = pixel.as_chunks().0.iter().map(|b| f16::from_le_bytes(*b));
            let rounded = [0.5, 0.5, 0.5, 0.505, 0.505, 0.505].map(f16::from_f32);
            assert!(values.eq(rounded), "{pixel:?}");
        }
        for picture in ["a", "b", "error", "signed"] {
            let jpeg = scene["pictures"][picture].as_str().unwrap();
            assert!(jpeg.starts_with("data:image/jpeg;base64,/9j/"), "{jpeg}");
        }
        assert_eq!(scene["pictures"]["error_ends"][1], "1.26");
        assert_eq!(scene["pictures"]["signed_ends"][0], "-1.00 %");
    }

    #[test]
    fn exact_values_are_those_of_the_tiles_that_differ_most_and_have_a_limit() {
        let names = ["R", "G", "B"].map(str::to_owned).to_vec();
        let (width, height) = (640, 360);
        let data = vec![0.5; width * height * 3];
        let a = Image::from_data(width as u32, height as u32, names, data).unwrap();
        let mut b = a.clone();
        b.set(600, 359, 1, 70.0);
        let pair = Pair {
            distance: &vec![0.0; width * height],
            brighter: &vec![0.0; width * height],
            ..pair(&a, &b, Some([0, 1, 2]))
        };
        let object = pair.object().unwrap();
        let exact = &object["exact"];
        let tiles = exact["tiles"].as_array().unwrap();
        assert_eq!(tiles[0], 22 * 40 + 37);
        let bytes = BASE64_STANDARD.decode(exact["values"].as_str().unwrap());
        let bytes = bytes.unwrap();
        assert!((MOST_EXACT - 12 * 256..=MOST_EXACT).contains(&bytes.len()));
        // The tile is 16 by 8, and the pixel the ninth of its last row.
        let at = 12 * (7 * 16 + 8) + 2 * 4;
        assert_eq!(
            f16::from_le_bytes([bytes[at], bytes[at + 1]]).to_f32(),
            70.0
        );
        assert!(tiles.len() < 40 * 23);
    }

    #[test]
    fn what_is_no_colour_is_shown_from_its_least_to_its_greatest_value() {
        for (names, channels) in [(&["Y"][..], 1), (&["X", "Y", "Z"], 3), (&["a", "b"], 2)] {
            let (a, mut b) = (image(names, -1.0), image(names, -1.0));
            b.set(0, 0, 0, 3.0);
            let pair = pair(&a, &b, None);
            let object = pair.object().unwrap();
            let shown = object["shown"].as_str().unwrap();
            assert!(shown.ends_with("from -1 (dark) to 3 (bright)."), "{shown}");
            assert_eq!(object["means"][0][0].as_array().unwrap().len(), channels);
            let codes = pair.shown(&b, &pair.channels(), Some([-1.0, 3.0])).unwrap();
            assert_eq!((codes.data()[0], codes.data()[3]), (255, 0), "{names:?}");
            // By 4 of 256 pixels' sum of -256.
            assert_eq!(object["worst"][0][2], "+1.56 %");
        }
    }

    #[test]
    fn codes_are_shown_as_they_are() {
        let (a, b) = (image(&["Y"], 100.0 / 255.0), image(&["Y"], 7.0 / 255.0));
        let pair = Pair {
            encoding: Encoding::Srgb,
            ..pair(&a, &b, Some([0; 3]))
        };
        let codes = |image| pair.shown(image, &[0], None).unwrap().data()[0];
        assert_eq!((codes(&a), codes(&b)), (100, 7));
    }

    #[test]
    fn numbers_have_three_digits() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (1.264, "1.26"),
            (-0.012_34, "-0.0123"),
            (1234.0, "1234"),
            (1000.0, "1000"),
            (1e6, "1.00e6"),
        ] {
            assert_eq!(short(value), text);
        }
    }
}
