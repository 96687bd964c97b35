//! The metrics: their names, what they mean and how they are computed from all values of two images,
//! d = b − a, where a is the reference. Those with a division guard it by 0.01, so that black pixels do not
//! outweigh all others (Rousselle, Knaus and Zwicker, *Adaptive sampling and reconstruction using greedy
//! error minimization*, 2011).

use serde::Serialize;

use crate::image::Image;

/// What keeps divisions by dark values at bay.
pub const GUARD: f64 = 0.01;

macro_rules! metrics {
    ($($variant:ident $name:literal $what:literal,)*) => {
        /// A metric.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
        pub enum Metric {
            $(#[doc = $what] #[serde(rename = $name)] $variant,)*
        }

        impl Metric {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// Its name on the command line and in JSON.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }

            /// What it is, in a line.
            pub fn description(self) -> &'static str {
                match self {
                    $(Self::$variant => $what,)*
                }
            }
        }
    };
}

metrics! {
    Bias "bias" "greatest |mean d| of a channel",
    Max "max" "greatest |d|",
    Mae "mae" "mean |d|",
    Mse "mse" "mean d²",
    Rmse "rmse" "√mse",
    RelMse "relmse" "mean d² / (a² + 0.01)",
    Mape "mape" "mean |d| / (|a| + 0.01)",
    Smape "smape" "mean 2|d| / (|a| + |b| + 0.01)",
    Psnr "psnr" "10 log₁₀(peak² / mse), in dB",
    Ssim "ssim" "structural similarity, windows of 7 × 7",
    FlipLdr "flip_ldr" "mean FLIP of what a screen shows",
    FlipHdr "flip_hdr" "mean FLIP over exposures",
}

impl Metric {
    /// The metric of this name; a hyphen is as good as an underscore.
    pub fn of_name(name: &str) -> Option<Self> {
        let name = name.to_lowercase().replace('-', "_");
        Self::ALL.iter().copied().find(|m| m.name() == name)
    }

    /// Whether more of it is better.
    pub fn is_similarity(self) -> bool {
        matches!(self, Self::Psnr | Self::Ssim)
    }
}

/// Means of a channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelMeans {
    /// The channel's name.
    pub channel: String,
    /// Mean of a.
    pub a: f64,
    /// Mean of b.
    pub b: f64,
    /// Mean of b − a.
    pub bias: f64,
}

/// What one walk over all values gives.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sums {
    /// By channel.
    pub channels: Vec<ChannelMeans>,
    /// The greatest |d|.
    pub max: f64,
    /// Where that is, as an index into the values; the first where several are.
    #[serde(skip)]
    pub worst: usize,
    /// Pixels with any difference.
    pub differing: usize,
    /// Mean |d|.
    pub mae: f64,
    /// Mean d².
    pub mse: f64,
    /// Mean d² / (a² + 0.01).
    pub relmse: f64,
    /// Mean |d| / (|a| + 0.01).
    pub mape: f64,
    /// Mean 2|d| / (|a| + |b| + 0.01).
    pub smape: f64,
}

impl Sums {
    /// Of two finite images of the same size and channels. Rows are summed on their own, so that the
    /// rounding error does not grow with the image.
    pub fn of(a: &Image, b: &Image) -> Self {
        let count = a.channels().len();
        let row = a.width() as usize * count;
        let mut total = Row::new(count);
        for (y, (ra, rb)) in a.data().chunks(row).zip(b.data().chunks(row)).enumerate() {
            total.add(&Row::of(ra, rb, count), y * row);
        }
        let pixels = f64::from(a.width()) * f64::from(a.height());
        let values = pixels * count as f64;
        let means = |(c, [sa, sb, sd]): (usize, &[f64; 3])| ChannelMeans {
            channel: a.channels()[c].clone(),
            a: sa / pixels,
            b: sb / pixels,
            bias: sd / pixels,
        };
        let [mae, mse, relmse, mape, smape] = total.sums.map(|s| s / values);
        Self {
            channels: total.channels.iter().enumerate().map(means).collect(),
            max: total.max,
            worst: total.worst,
            differing: total.differing,
            mae,
            mse,
            relmse,
            mape,
            smape,
        }
    }

    /// The greatest bias of a channel, as a magnitude.
    pub fn bias(&self) -> f64 {
        let biases = self.channels.iter().map(|c| c.bias.abs());
        biases.fold(0.0, f64::max)
    }

    /// The signal-to-noise ratio in decibels for values up to `peak`; infinite for equal images.
    pub fn psnr(&self, peak: f64) -> f64 {
        10.0 * (peak * peak / self.mse).log10()
    }
}

/// The sums of a row.
struct Row {
    /// Of a, b and d.
    channels: Vec<[f64; 3]>,
    /// |d|, d², and the three relative ones.
    sums: [f64; 5],
    max: f64,
    worst: usize,
    differing: usize,
}

impl Row {
    fn new(channels: usize) -> Self {
        Self {
            channels: vec![[0.0; 3]; channels],
            sums: [0.0; 5],
            max: 0.0,
            worst: 0,
            differing: 0,
        }
    }

    fn of(a: &[f32], b: &[f32], count: usize) -> Self {
        let mut row = Self::new(count);
        for (x, (pa, pb)) in a.chunks(count).zip(b.chunks(count)).enumerate() {
            row.differing += usize::from(pa != pb);
            for (c, (va, vb)) in pa.iter().zip(pb).enumerate() {
                let (va, vb) = (f64::from(*va), f64::from(*vb));
                let d = vb - va;
                for (sum, value) in row.channels[c].iter_mut().zip([va, vb, d]) {
                    *sum += value;
                }
                let terms = [
                    d.abs(),
                    d * d,
                    d * d / (va * va + GUARD),
                    d.abs() / (va.abs() + GUARD),
                    2.0 * d.abs() / (va.abs() + vb.abs() + GUARD),
                ];
                for (sum, term) in row.sums.iter_mut().zip(terms) {
                    *sum += term;
                }
                if d.abs() > row.max {
                    (row.max, row.worst) = (d.abs(), x * count + c);
                }
            }
        }
        row
    }

    /// Adds a row whose first value has this index.
    fn add(&mut self, other: &Self, first: usize) {
        for (mine, its) in self.channels.iter_mut().zip(&other.channels) {
            for (m, i) in mine.iter_mut().zip(its) {
                *m += i;
            }
        }
        for (m, i) in self.sums.iter_mut().zip(other.sums) {
            *m += i;
        }
        if other.max > self.max {
            (self.max, self.worst) = (other.max, first + other.worst);
        }
        self.differing += other.differing;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_pixels_have_the_figures_of_a_pocket_calculator() {
        let image = |data: [f32; 4]| {
            Image::from_data(2, 1, vec!["R".into(), "G".into()], data.to_vec()).unwrap()
        };
        let sums = Sums::of(&image([1.0, 0.0, 2.0, 0.5]), &image([1.5, 0.0, 1.0, 0.5]));
        assert_eq!(sums.channels[0].bias, -0.25);
        assert_eq!(sums.channels[1].bias, 0.0);
        assert_eq!((sums.bias(), sums.max, sums.worst), (0.25, 1.0, 2));
        assert_eq!(sums.differing, 2);
        assert_eq!((sums.mae, sums.mse), (1.5 / 4.0, 1.25 / 4.0));
        assert!((sums.relmse - (0.25 / 1.01 + 1.0 / 4.01) / 4.0).abs() < 1e-15);
        assert!((sums.mape - (0.5 / 1.01 + 1.0 / 2.01) / 4.0).abs() < 1e-15);
        assert!((sums.smape - (1.0 / 2.51 + 2.0 / 3.01) / 4.0).abs() < 1e-15);
        assert!((sums.psnr(1.0) - 10.0 * (4.0_f64 / 1.25).log10()).abs() < 1e-12);
    }

    #[test]
    fn names_lead_to_their_metrics() {
        for &metric in Metric::ALL {
            assert_eq!(Metric::of_name(metric.name()), Some(metric));
        }
        assert_eq!(Metric::of_name("FLIP-HDR"), Some(Metric::FlipHdr));
        assert_eq!(Metric::of_name("flip"), None);
    }
}
