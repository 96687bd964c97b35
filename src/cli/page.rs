//! Crosschecks as a page that a browser shows: one file, without a network.

use std::path::Path;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use etendue::color::luminance;
use etendue::compare::map::{Scale, robust_top};
use etendue::compare::seeds::TILE;
use etendue::crosscheck::Pictures;
use etendue::display::DisplayTransform;
use etendue::error::{Error, Result};
use etendue::file;
use etendue::image::{Codes, Image, Layout};
use serde_json::{Value, json};

const TEMPLATE: &str = include_str!("page.html");
/// Where the template wants the data.
const PLACE: &str = "/*DATA*/";

/// Tiles that are listed.
const WORST: usize = 8;

/// A scene of the page.
#[derive(Debug)]
pub(super) struct Scene<'a> {
    pub(super) name: &'a str,
    /// Such as `agree`.
    pub(super) status: &'a str,
    /// What is said of it, with labels.
    pub(super) lines: Vec<(String, String)>,
    pub(super) pictures: Option<&'a Pictures>,
}

/// Writes `index.html` into the folder.
pub(super) fn write(folder: &Path, scenes: &[Scene<'_>]) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::system("make", folder, &e))?;
    let scenes: Result<Vec<Value>> = scenes.iter().map(scene).collect();
    let data = json!({
        "scenes": scenes?,
        "about": concat!("Made by etendue ", env!("CARGO_PKG_VERSION"), "."),
    });
    // What would end the script's element.
    let data = data.to_string().replace("</", "<\\/");
    let page = TEMPLATE.replace(PLACE, &data);
    file::write_atomically(&folder.join("index.html"), page.as_bytes())
}

fn scene(scene: &Scene<'_>) -> Result<Value> {
    let pictures = scene.pictures.map(pictures).transpose()?;
    Ok(json!({
        "name": scene.name,
        "status": scene.status,
        "lines": scene.lines,
        "pictures": pictures,
    }))
}

fn pictures(pictures: &Pictures) -> Result<Value> {
    let Pictures {
        reference,
        ours,
        standard_errors,
        brighter,
    } = pictures;
    let [width, height] = [reference.width() as usize, reference.height() as usize];
    let means = [tiles(reference), tiles(ours)];
    let across = width.div_ceil(TILE);
    let mut worst: Vec<(f64, usize)> = (0..means[0].len())
        .map(|tile| {
            let [a, b] =
                [&means[0], &means[1]].map(|means| luminance(means[tile].map(|v| v as f32)));
            let [a, b] = [a, b].map(f64::from);
            let part = if a > 0.0 { b / a - 1.0 } else { b };
            (part, tile)
        })
        .collect();
    worst.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    worst.truncate(WORST);
    let named = worst.iter().map(|(part, tile)| {
        let (x, y) = (tile % across * TILE, tile / across * TILE);
        json!([x, y, format!("{:+.2} %", 100.0 * part)])
    });
    Ok(json!({
        "width": width,
        "height": height,
        "tile": TILE,
        "across": across,
        "a": address(&DisplayTransform::default().shown(reference)?)?,
        "b": address(&DisplayTransform::default().shown(ours)?)?,
        "error": address(&map(width, standard_errors)?)?,
        "signed": address(&signed(width, brighter)?)?,
        "signed_top": format!("{:.2} %", 100.0 * robust_top(brighter)),
        "means": means,
        "worst": named.collect::<Value>(),
    }))
}

/// The mean colours of tiles, row by row.
fn tiles(image: &Image) -> Vec<[f64; 3]> {
    let rgb = image.rgb().unwrap_or([0; 3]);
    let [width, height] = [image.width() as usize, image.height() as usize];
    let across = width.div_ceil(TILE);
    let mut sums = vec![[0.0_f64; 4]; across * height.div_ceil(TILE)];
    for (i, pixel) in image
        .data()
        .chunks_exact(image.channels().len())
        .enumerate()
    {
        let sum = &mut sums[i / width / TILE * across + i % width / TILE];
        for c in 0..3 {
            sum[c] += f64::from(pixel[rgb[c]]);
        }
        sum[3] += 1.0;
    }
    // Four digits are shown.
    let short = |v: f64| format!("{v:.4e}").parse().unwrap_or(0.0);
    sums.iter()
        .map(|[r, g, b, n]| [r / n, g / n, b / n].map(short))
        .collect()
}

/// How many standard errors pixels are apart, as brightness.
fn map(width: usize, values: &[f32]) -> Result<Codes> {
    let top = robust_top(values);
    let code = |v: &f32| (255.0 * (v / top).clamp(0.0, 1.0)).round() as u8;
    let height = values.len() / width.max(1);
    let codes = values.iter().map(code).collect();
    Codes::new(width as u32, height as u32, Layout::Grey, codes)
}

/// By how much pixels are brighter, from blue to red.
fn signed(width: usize, values: &[f32]) -> Result<Codes> {
    let top = robust_top(values);
    let color = |v: &f32| Scale::AboutZero.color(*v, top);
    let height = values.len() / width.max(1);
    let codes = values.iter().flat_map(color).collect();
    Codes::new(width as u32, height as u32, Layout::Rgb, codes)
}

/// The picture as an address that holds it.
fn address(codes: &Codes) -> Result<String> {
    let bytes = BASE64_STANDARD.encode(codes.to_jpeg()?);
    Ok(format!("data:image/jpeg;base64,{bytes}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_one_file_with_all_that_it_shows() {
        let image = |value: f32| {
            let names = ["R", "G", "B"].map(String::from).to_vec();
            Image::from_data(20, 17, names, vec![value; 20 * 17 * 3]).unwrap()
        };
        let pictures = Pictures {
            reference: image(0.5),
            ours: image(0.505),
            standard_errors: vec![1.26; 20 * 17],
            brighter: vec![0.01; 20 * 17],
        };
        let scenes = [Scene {
            name: "</script><b>",
            status: "differ",
            lines: vec![("mean".to_owned(), "1 % brighter".to_owned())],
            pictures: Some(&pictures),
        }];
        let folder = tempfile::tempdir().unwrap();
        write(&folder.path().join("new/page"), &scenes).unwrap();
        let page = std::fs::read_to_string(folder.path().join("new/page/index.html")).unwrap();
        assert!(!page.contains("http"), "it needs no network");
        let (_, data) = page.split_once("id=\"data\">").unwrap();
        let (data, _) = data.split_once("</script>").unwrap();
        let data: Value = serde_json::from_str(data).unwrap();
        let scene = &data["scenes"][0];
        assert_eq!(scene["name"], "</script><b>");
        assert_eq!(scene["pictures"]["worst"][0][2], "+1.00 %");
        assert_eq!(scene["pictures"]["means"][1][3][0], 0.505);
        let jpeg = scene["pictures"]["a"].as_str().unwrap();
        assert!(jpeg.starts_with("data:image/jpeg;base64,/9j/"), "{jpeg}");
        let jpeg = scene["pictures"]["signed"].as_str().unwrap();
        assert!(jpeg.starts_with("data:image/jpeg;base64,/9j/"), "{jpeg}");
        assert_eq!(scene["pictures"]["signed_top"], "1.00 %");
    }
}
