//! ACES, the Academy's view of scene-referred light: the reference rendering transform and the output transform for
//! sRGB displays of version 1 (SMPTE ST 2065-1; the Academy's CTL of version 1.0.3, 2016), with the glow of dark saturated
//! places, the dimming of reds, its two splines, and the dim surround. BT.709 comes in by way of AP0, with
//! Bradford's adaptation of D65 to the white of ACES.

use glam::{DMat3, DVec3};

use super::within_half;
use crate::color::{Primaries, adaptation};

/// What the transforms are made of.
#[derive(Clone, Debug)]
pub(super) struct Aces {
    from_bt709: DMat3,
    ap0_to_ap1: DMat3,
    ap1_to_xyz: DMat3,
    xyz_to_ap1: DMat3,
    /// Of colours seen under the white of ACES, to those under D65.
    xyz_to_bt709: DMat3,
    /// AP1's luminances.
    luminances: DVec3,
    output: Spline<10>,
}

impl Aces {
    pub(super) fn new() -> Self {
        let xyz = |primaries: &Primaries| primaries.to_xyz().expect("they are a space");
        let spaces = [Primaries::AP0, Primaries::AP1, Primaries::BT709];
        let [ap0, ap1, bt709] = spaces.each_ref().map(xyz);
        let adapted = adaptation(Primaries::BT709.white, Primaries::AP0.white);
        Self {
            from_bt709: ap0.inverse() * adapted * bt709,
            ap0_to_ap1: ap1.inverse() * ap0,
            ap1_to_xyz: ap1,
            xyz_to_ap1: ap1.inverse(),
            xyz_to_bt709: bt709.inverse() * adapted.inverse(),
            luminances: ap1.row(1),
            output: output_spline(),
        }
    }

    /// Display-referred linear BT.709 in [0, 1].
    pub(super) fn view(&self, rgb: [f32; 3]) -> [f32; 3] {
        let aces = self.from_bt709 * within_half(rgb);
        let rendered = self.render(aces);
        let shown = self.show(rendered);
        shown.to_array().map(|v| v.clamp(0.0, 1.0) as f32)
    }

    /// The reference rendering transform, from AP0 to AP1.
    fn render(&self, aces: DVec3) -> DVec3 {
        let saturation = {
            let (most, least) = (aces.max_element(), aces.min_element());
            (most.max(1e-10) - least.max(1e-10)) / most.max(1e-2)
        };
        let mut aces = aces * (1.0 + glow(luma(aces), 0.05 * step((saturation - 0.4) / 0.2)));
        aces.x += red(aces) * saturation * (0.03 - aces.x) * (1.0 - 0.82);
        let rgb = self.ap0_to_ap1 * aces.max(DVec3::ZERO);
        let rgb = self.desaturated(rgb.clamp(DVec3::ZERO, DVec3::splat(65504.0)), 0.96);
        rgb.map(|v| RENDERING.at(v))
    }

    /// The output transform of a display of 100 nits in a dim surround, from AP1 to BT.709.
    fn show(&self, rgb: DVec3) -> DVec3 {
        const WHITE: f64 = 48.0;
        const BLACK: f64 = 0.02;
        let linear = rgb.map(|v| (self.output.at(v) - BLACK) / (WHITE - BLACK));
        let surround = self.in_dim_surround(linear);
        let rgb = self.desaturated(surround, 0.93);
        self.xyz_to_bt709 * (self.ap1_to_xyz * rgb)
    }

    /// Drawn toward AP1's grey.
    fn desaturated(&self, rgb: DVec3, factor: f64) -> DVec3 {
        let grey = DVec3::splat(self.luminances.dot(rgb));
        grey + factor * (rgb - grey)
    }

    /// With a gamma on luminance that undoes some of the contrast that is made for dark rooms.
    fn in_dim_surround(&self, rgb: DVec3) -> DVec3 {
        let xyz = self.ap1_to_xyz * rgb;
        if xyz.y <= 0.0 {
            return DVec3::ZERO;
        }
        self.xyz_to_ap1 * (xyz * (xyz.y.powf(0.9811) / xyz.y))
    }
}

/// Mean of the channels, and more where they differ.
fn luma(c: DVec3) -> f64 {
    let [r, g, b] = c.to_array();
    let chroma = (b * (b - g) + g * (g - r) + r * (r - b)).max(0.0).sqrt();
    (b + g + r + 1.75 * chroma) / 3.0
}

/// A smooth step from 0 at −2 to 1 at 2.
fn step(x: f64) -> f64 {
    let t = (1.0 - (x / 2.0).abs()).max(0.0);
    (1.0 + x.signum() * (1.0 - t * t)) / 2.0
}

/// What is added to 1, in places as dark as 0.08 and less.
fn glow(luma: f64, gain: f64) -> f64 {
    const MIDDLE: f64 = 0.08;
    if luma <= 2.0 / 3.0 * MIDDLE {
        gain
    } else if luma >= 2.0 * MIDDLE {
        0.0
    } else {
        gain * (MIDDLE / luma - 0.5)
    }
}

/// How red a colour is: 1 at hue 0, none from 67.5° on.
fn red(c: DVec3) -> f64 {
    let [r, g, b] = c.to_array();
    let hue = if r == g && g == b {
        0.0
    } else {
        (3f64.sqrt() * (g - b)).atan2(2.0 * r - g - b).to_degrees()
    };
    let x = (hue + 67.5) / 33.75;
    if !(x > 0.0 && x < 4.0) {
        return 0.0;
    }
    // The four pieces of a uniform cubic B-spline, whose greatest value is 2/3.
    let (piece, t) = (x.floor(), x.fract());
    let value = match piece as u32 {
        0 => t * t * t,
        1 => ((-3.0 * t + 3.0) * t + 3.0) * t + 1.0,
        2 => (3.0 * t - 6.0) * t * t + 4.0,
        _ => (1.0 - t).powi(3),
    };
    value / 6.0 * 1.5
}

/// Pieces of parabolas in the logarithms (base 10) of both sides, below and above a middle; straight beyond.
#[derive(Clone, Debug)]
struct Spline<const N: usize> {
    low: [f64; N],
    high: [f64; N],
    /// The least point, the middle, and the greatest.
    points: [[f64; 2]; 3],
    /// Beyond the greatest.
    slope: f64,
}

impl<const N: usize> Spline<N> {
    fn at(&self, x: f64) -> f64 {
        // The least half float that has all its digits.
        let x = x.max(2f64.powi(-14)).log10();
        let [least, middle, most] = self.points.map(|point| point.map(f64::log10));
        let y = if x <= least[0] {
            least[1]
        } else if x < middle[0] {
            piece(&self.low, (x - least[0]) / (middle[0] - least[0]))
        } else if x < most[0] {
            piece(&self.high, (x - middle[0]) / (most[0] - middle[0]))
        } else {
            most[1] + self.slope * (x - most[0])
        };
        10f64.powf(y)
    }
}

/// The quadratic B-spline of these coefficients; `place` in [0, 1).
fn piece<const N: usize>(coefficients: &[f64; N], place: f64) -> f64 {
    let knot = place * (N - 3) as f64;
    let (first, t) = (knot as usize, knot.fract());
    let [a, b, c] = [0, 1, 2].map(|i| coefficients[(first + i).min(N - 1)]);
    0.5 * (a - 2.0 * b + c) * t * t + (b - a) * t + 0.5 * (a + b)
}

/// The tone scale of the rendering transform.
const RENDERING: Spline<6> = Spline {
    low: [
        -4.0,
        -4.0,
        -3.157_376_577_3,
        -0.485_249_995_8,
        1.847_732_470_6,
        1.847_732_470_6,
    ],
    high: [
        -0.718_548_242_5,
        2.081_030_717_2,
        3.668_124_123_7,
        4.0,
        4.0,
        4.0,
    ],
    points: [[0.18 / 32768.0, 1e-4], [0.18, 4.8], [0.18 * 262_144.0, 1e4]],
    slope: 0.0,
};

/// The tone scale of the output transform, whose points are what the rendering makes of 6.5 stops below and above middle
/// grey.
fn output_spline() -> Spline<10> {
    let rendered = |stops: f64| RENDERING.at(0.18 * stops.exp2());
    Spline {
        low: [
            -1.698_970_004_3,
            -1.698_970_004_3,
            -1.477_9,
            -1.229_1,
            -0.864_8,
            -0.448,
            0.005_18,
            0.451_108_033_4,
            0.911_374_441_4,
            0.911_374_441_4,
        ],
        high: [
            0.515_438_696_5,
            0.847_043_778_3,
            1.135_8,
            1.380_2,
            1.519_7,
            1.598_5,
            1.646_7,
            1.674_609_135_7,
            1.687_873_339,
            1.687_873_339,
        ],
        points: [
            [rendered(-6.5), 0.02],
            [rendered(0.0), 4.8],
            [rendered(6.5), 48.0],
        ],
        slope: 0.04,
    }
}
