//! AgX, Troy Sobotka's view of scene-referred light (github.com/sobotka/AgX, 2022), in the form that Eary Chow gave it
//! (github.com/EaryChow/AgX_LUT_Gen, 2023) and Blender has had since 4.0: what Blender bakes into a table of 57³ colours is
//! computed here. In BT.2020 the primaries are drawn toward grey and turned a little, so that bright saturated colours go to
//! white instead of to a corner; a curve over 16.5 stops, from 10 below to 6.5 above middle grey, has slope 2.4 there and
//! leaves middle grey where it is; hues turn by 40 % of what the curve alone would turn them; the primaries go back out. What
//! lies outside of a gamut is moved toward grey before and after.

use glam::{DMat3, DVec3};

use super::within_half;
use crate::color::{Primaries, hsv_to_rgb, rgb_to_hsv};

/// What draws BT.2020's primaries toward grey, by columns.
const INSET: DMat3 = DMat3::from_cols(
    DVec3::new(
        0.856_627_153_315_983,
        0.137_318_972_929_847,
        0.111_898_212_999_95,
    ),
    DVec3::new(
        0.095_121_240_538_158_8,
        0.761_241_990_602_591,
        0.076_799_418_603_190_3,
    ),
    DVec3::new(
        0.048_251_606_145_858_3,
        0.101_439_036_467_562,
        0.811_302_368_396_859,
    ),
);
/// What takes them out again, further than they were.
const OUTSET: DMat3 = DMat3::from_cols(
    DVec3::new(
        1.127_100_581_814_436_8,
        -0.141_329_763_498_438_3,
        -0.141_329_763_498_438_3,
    ),
    DVec3::new(
        -0.110_606_643_096_603_2,
        1.157_823_702_216_272,
        -0.110_606_643_096_603_2,
    ),
    DVec3::new(
        -0.016_493_938_717_834_6,
        -0.016_493_938_717_834_6,
        1.251_936_406_595_040_5,
    ),
);
/// The luminances of BT.2020's primaries for the standard observer of CIE 2015.
const LUMINANCES: DVec3 = DVec3::new(
    0.265_818_037_025_045,
    0.598_469_860_453_65,
    0.135_712_102_521_305,
);

/// Linear, and its code is [`MIDDLE`].
const GREY: f64 = 0.18;
/// Stops below and above middle grey.
const RANGE: [f64; 2] = [-10.0, 6.5];
/// The exponent of the codes that the curve ends in.
const GAMMA: f64 = 2.4;
/// The curve's slope at middle grey.
const SLOPE: f64 = 2.4;
/// How quickly it bends.
const POWER: f64 = 1.5;
/// How much of the curve's own turning of hues is left.
const TURNED: f64 = 0.4;

/// What the view is made of.
#[derive(Clone, Debug)]
pub(super) struct Agx {
    from_bt709: DMat3,
    to_bt709: DMat3,
    curve: Curve,
    /// Luminances of BT.709's primaries.
    luminances: DVec3,
}

impl Agx {
    pub(super) fn new() -> Self {
        let xyz = |primaries: Primaries| primaries.to_xyz().expect("they are a space");
        let from_bt709 = xyz(Primaries::BT2020).inverse() * xyz(Primaries::BT709);
        Self {
            from_bt709,
            to_bt709: from_bt709.inverse(),
            curve: Curve::new(),
            luminances: from_bt709.transpose() * LUMINANCES,
        }
    }

    /// Display-referred linear BT.709 in [0, 1].
    pub(super) fn view(&self, rgb: [f32; 3]) -> [f32; 3] {
        let wide = self.from_bt709 * within_half(rgb);
        let drawn = INSET * within(wide, |rgb| with_opponent(rgb, LUMINANCES));
        let curved = drawn.map(|v| self.curve.at(v));
        let [before, _, _] = rgb_to_hsv(drawn.into());
        let [after, saturation, value] = rgb_to_hsv(curved.into());
        let turn = (after - before + 540.0).rem_euclid(360.0) - 180.0;
        let mixed = hsv_to_rgb([before + TURNED * turn, saturation, value]);
        let shown = self.to_bt709 * (OUTSET * DVec3::from(mixed));
        // The darker, the more counts the opponent: else greens of BT.2020 would shine.
        let shown = within(shown, |rgb| {
            let luminance = rgb.dot(self.luminances);
            let share = luminance.clamp(0.0, 1.0).powf(0.08);
            let opposed = with_opponent(rgb, self.luminances);
            opposed + share * (luminance - opposed)
        });
        shown.to_array().map(|v| v.clamp(0.0, 1.0) as f32)
    }
}

/// A color moved toward grey until no component is negative, and dimmed to the brightness it had, if it had less.
fn within(rgb: DVec3, brightness: impl Fn(DVec3) -> f64) -> DVec3 {
    let moved = rgb + (-rgb.min_element()).max(0.0);
    let [had, has] = [rgb, moved].map(brightness);
    if has > had {
        moved * (had.max(0.0) / has)
    } else {
        moved
    }
}

/// A luminance, and by how much the opponent colour is darker than it could be.
fn with_opponent(rgb: DVec3, luminances: DVec3) -> f64 {
    let opponent = DVec3::splat(rgb.max_element()) - rgb;
    rgb.dot(luminances) + opponent.max_element() - opponent.dot(luminances)
}

/// From linear values by way of stops to linear values: straight at middle grey, and below and above it bent by
/// x/(1 + xᵖ)^(1/p).
#[derive(Clone, Debug)]
struct Curve {
    /// Middle grey in parts of the range, and its code.
    pivot: [f64; 2],
    /// So that the ends are met, below and above.
    scales: [f64; 2],
}

impl Curve {
    fn new() -> Self {
        let [x, y] = [-RANGE[0] / (RANGE[1] - RANGE[0]), GREY.powf(1.0 / GAMMA)];
        let scale = |[x, y]: [f64; 2]| {
            let straight = SLOPE * x;
            straight / ((straight / y).powf(POWER) - 1.0).powf(1.0 / POWER)
        };
        Self {
            pivot: [x, y],
            scales: [scale([x, y]), scale([1.0 - x, 1.0 - y])],
        }
    }

    /// In [0, 1].
    fn at(&self, linear: f64) -> f64 {
        let stops = (linear / GREY).max(1e-10).log2();
        let x = ((stops - RANGE[0]) / (RANGE[1] - RANGE[0])).clamp(0.0, 1.0);
        let [middle, code] = self.pivot;
        let bent = |scale: f64| {
            let t = SLOPE * (x - middle).abs() / scale;
            scale * t / (1.0 + t.powf(POWER)).powf(1.0 / POWER)
        };
        let [below, above] = self.scales;
        let code = if x < middle {
            code - bent(below)
        } else {
            code + bent(above)
        };
        code.max(0.0).powf(GAMMA)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Colours of the table that Blender 5.0.1 has for sRGB, which OpenColorIO interpolates in; codes of a display with
    /// exponent 2.4. What lies outside of BT.709 was weighted there with other luminances.
    #[test]
    fn colours_are_those_of_blenders_table() {
        let inside = [
            (
                [0.1864287, 0.9000336, 0.17537631],
                [0.581524, 0.764953, 0.542245],
            ),
            (
                [0.023458264, 0.00009295578, 0.0016823973],
                [0.171045, 0.0, 0.047509],
            ),
            (
                [0.31899933, 0.11199654, 0.03055993],
                [0.614038, 0.388778, 0.20469],
            ),
            (
                [0.011154942, 0.0017793422, 0.02235233],
                [0.123668, 0.072907, 0.177353],
            ),
            ([8.446396, 0.091274136, 0.232217], [1.0, 0.755212, 0.738304]),
        ];
        let outside = [
            (
                [1.1731261, 4.525684, -1.0666798],
                [0.830673, 0.931418, 0.625665],
            ),
            (
                [-0.2691785, 0.058822428, 0.981034],
                [0.0, 0.489438, 0.738827],
            ),
            (
                [-8.300512, 16.655953, -2.8523263],
                [0.723843, 1.0, 0.757673],
            ),
            (
                [0.76331291, -0.068683353, -0.026610318],
                [0.769988, 0.0, 0.170278],
            ),
        ];
        let agx = Agx::new();
        for (colors, tolerance) in [(&inside[..], 1e-4), (&outside[..], 2e-3)] {
            for (rgb, codes) in colors {
                let seen = agx.view(*rgb).map(|v| f64::from(v).powf(1.0 / 2.4));
                let near = (0..3).all(|c| (seen[c] - codes[c]).abs() < tolerance);
                assert!(near, "{rgb:?}: {seen:?}, not {codes:?}");
            }
        }
    }

    #[test]
    fn greys_stay_grey_and_what_is_no_color_is_shown_too() {
        let agx = Agx::new();
        assert!(agx.view([0.0; 3]).iter().all(|v| *v < 1e-30));
        for (grey, shown) in [(0.18, 0.18), (0.18 * 2f32.powf(6.5), 1.0)] {
            let seen = agx.view([grey; 3]);
            assert!(seen.iter().all(|v| (v - shown).abs() < 1e-4), "{seen:?}");
        }
        for odd in [f32::NAN, -1.0, f32::INFINITY, f32::MIN] {
            let seen = agx.view([odd, 0.5, -0.0]);
            assert!(seen.iter().all(|v| (0.0..=1.0).contains(v)), "{seen:?}");
        }
    }
}
