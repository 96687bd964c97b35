//! Two images, value by value: all metrics, and where they differ most. Metrics cannot tell noise from
//! error; without limits on them two images agree only if they are equal.

use serde::{Serialize, Serializer};

use crate::compare::metric::{ChannelMeans, Metric, Sums};
use crate::compare::{Layer, flip, ssim};
use crate::error::{Error, Result};
use crate::image::Encoding;

/// How a pair is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The greatest value that is meant to occur: the peak of PSNR and the range of SSIM.
    pub peak: f64,
    /// Pixels in a degree of the visual field, for FLIP.
    pub pixels_per_degree: f32,
}

impl Default for Options {
    /// A screen's white, on FLIP's authors' desk.
    fn default() -> Self {
        Self {
            peak: 1.0,
            pixels_per_degree: flip::PIXELS_PER_DEGREE,
        }
    }
}

/// A metric's value.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Of which metric.
    pub metric: Metric,
    /// The value, or why there is none. PSNR is infinite for equal images.
    pub value: std::result::Result<f64, String>,
}

/// The place of the greatest difference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Worst {
    /// Column, from 0.
    pub x: usize,
    /// Row, from 0.
    pub y: usize,
    /// The channel's name.
    pub channel: String,
    /// The value in a.
    pub a: f32,
    /// The value in b.
    pub b: f32,
}

/// What can be said of two images.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Means by channel.
    pub channels: Vec<ChannelMeans>,
    /// Every metric.
    #[serde(serialize_with = "as_map")]
    pub metrics: Vec<Figure>,
    /// Pixels with any difference.
    pub differing_pixels: usize,
    /// Where they differ most; `None` where they are equal.
    pub worst: Option<Worst>,
}

/// Measures `b` against the reference `a`; both come from [`Layer::align`].
///
/// # Errors
/// Where a value of either is not finite.
pub fn measure(a: &Layer, b: &Layer, options: &Options) -> Result<Report> {
    for (layer, name) in [(a, "A"), (b, "B")] {
        check_finite(layer, name)?;
    }
    let sums = Sums::of(&a.image, &b.image);
    let figure = |&metric: &Metric| Figure {
        metric,
        value: value(metric, &sums, a, b, options),
    };
    let names = a.image.channels();
    let width = a.image.width() as usize;
    let pixel = sums.worst / names.len();
    let worst = Worst {
        x: pixel % width,
        y: pixel / width,
        channel: names[sums.worst % names.len()].clone(),
        a: a.image.data()[sums.worst],
        b: b.image.data()[sums.worst],
    };
    Ok(Report {
        size: [a.image.width(), a.image.height()],
        metrics: Metric::ALL.iter().map(figure).collect(),
        differing_pixels: sums.differing,
        worst: (sums.differing > 0).then_some(worst),
        channels: sums.channels,
    })
}

/// Refuses a layer with values that are not finite; `name` is what it is called.
///
/// # Errors
/// That, with counts and the first place.
pub fn check_finite(layer: &Layer, name: &str) -> Result<()> {
    let found = layer.not_finite();
    let Some(first) = found.first else {
        return Ok(());
    };
    Err(Error::input(format!(
        "{name} has {} NaN and {} infinite values, the first at pixel {}, {} in {}",
        found.nan, found.infinite, first.x, first.y, first.channel
    )))
}

impl Report {
    /// The value of a metric, or why there is none.
    ///
    /// # Errors
    /// Where it cannot be computed for these images.
    pub fn value(&self, metric: Metric) -> Result<f64> {
        let figure = self.metrics.iter().find(|f| f.metric == metric);
        match figure.map(|f| &f.value) {
            Some(Ok(value)) => Ok(*value),
            Some(Err(why)) => Err(Error::input(format!("no {}: {why}", metric.name()))),
            None => Err(Error::input(format!("no {}", metric.name()))),
        }
    }

    /// Whether all values are equal.
    pub fn is_equal(&self) -> bool {
        self.differing_pixels == 0
    }
}

fn value(
    metric: Metric,
    sums: &Sums,
    a: &Layer,
    b: &Layer,
    options: &Options,
) -> std::result::Result<f64, String> {
    let mean = |map: Result<Vec<f32>>| {
        let map = map.map_err(|e| e.to_string())?;
        Ok(map.iter().map(|v| f64::from(*v)).sum::<f64>() / map.len() as f64)
    };
    match metric {
        Metric::Bias => Ok(sums.bias()),
        Metric::Max => Ok(sums.max),
        Metric::Mae => Ok(sums.mae),
        Metric::Mse => Ok(sums.mse),
        Metric::Rmse => Ok(sums.mse.sqrt()),
        Metric::RelMse => Ok(sums.relmse),
        Metric::Mape => Ok(sums.mape),
        Metric::Smape => Ok(sums.smape),
        Metric::Psnr => Ok(sums.psnr(options.peak)),
        Metric::Ssim => ssim::ssim(&a.image, &b.image, options.peak)
            .ok_or_else(|| "a window of 7 × 7 pixels does not fit".to_owned()),
        Metric::FlipLdr => mean(flip::ldr(a, b, options.pixels_per_degree)),
        Metric::FlipHdr => mean(flip::hdr(a, b, options.pixels_per_degree)),
    }
}

/// `{"mse": 0.1, "flip_hdr": null}`
fn as_map<S: Serializer>(
    figures: &[Figure],
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    let entries = figures.iter();
    serializer.collect_map(entries.map(|f| (f.metric.name(), f.value.as_ref().ok())))
}

/// What the values of a pair of layers are called.
pub fn kind_of_values(encoding: Encoding) -> &'static str {
    match encoding {
        Encoding::Linear => "linear",
        Encoding::Srgb => "sRGB codes",
    }
}
