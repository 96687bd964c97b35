//! How far apart two colours look: ΔE of 1976 and of 2000 (CIE 15:2004; Sharma, Wu and Dalal, *The CIEDE2000
//! color-difference formula*, 2005).

/// The distance of two colours in L\*, a\*, b\*.
pub fn delta_e_76(one: [f64; 3], other: [f64; 3]) -> f64 {
    let square = |c: usize| (one[c] - other[c]).powi(2);
    (0..3).map(square).sum::<f64>().sqrt()
}

/// CIEDE2000 of two colours in L\*, a\*, b\*, with all weights 1.
pub fn delta_e_2000([l1, a1, b1]: [f64; 3], [l2, a2, b2]: [f64; 3]) -> f64 {
    let seventh = |c: f64| (c.powi(7) / (c.powi(7) + 25f64.powi(7))).sqrt();
    let mean = 0.5 * (a1.hypot(b1) + a2.hypot(b2));
    let stretch = 1.5 - 0.5 * seventh(mean);
    let (a1, a2) = (stretch * a1, stretch * a2);
    let (c1, c2) = (a1.hypot(b1), a2.hypot(b2));
    let hue = |a: f64, b: f64| b.atan2(a).to_degrees().rem_euclid(360.0);
    let (h1, h2) = (hue(a1, b1), hue(a2, b2));
    let grey = c1 * c2 == 0.0;

    let (lightness, chroma) = (l2 - l1, c2 - c1);
    let apart = match h2 - h1 {
        _ if grey => 0.0,
        turn if turn > 180.0 => turn - 360.0,
        turn if turn < -180.0 => turn + 360.0,
        turn => turn,
    };
    let hue_distance = 2.0 * (c1 * c2).sqrt() * (0.5 * apart).to_radians().sin();

    let (l, c) = (0.5 * (l1 + l2), 0.5 * (c1 + c2));
    let h = match h1 + h2 {
        sum if grey => sum,
        sum if (h1 - h2).abs() <= 180.0 => 0.5 * sum,
        sum if sum < 360.0 => 0.5 * (sum + 360.0),
        sum => 0.5 * (sum - 360.0),
    };
    let cos = |degrees: f64| degrees.to_radians().cos();
    let t = 1.0 - 0.17 * cos(h - 30.0) + 0.24 * cos(2.0 * h) + 0.32 * cos(3.0 * h + 6.0)
        - 0.2 * cos(4.0 * h - 63.0);
    let from_middle = (l - 50.0).powi(2);
    let lightness = lightness / (1.0 + 0.015 * from_middle / (20.0 + from_middle).sqrt());
    let chroma = chroma / (1.0 + 0.045 * c);
    let hue_distance = hue_distance / (1.0 + 0.015 * c * t);
    let turn = 60.0 * (-((h - 275.0) / 25.0).powi(2)).exp();
    let rotation = -2.0 * seventh(c) * turn.to_radians().sin();
    let squares = lightness.powi(2) + chroma.powi(2) + hue_distance.powi(2);
    (squares + rotation * chroma * hue_distance).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the pairs that Sharma, Wu and Dalal print.
    #[test]
    fn pairs_are_as_far_apart_as_published() {
        for (one, other, expected) in [
            ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
            ([50.0, 3.1571, -77.2803], [50.0, 0.0, -82.7485], 2.8615),
            ([50.0, -1.3802, -84.2814], [50.0, 0.0, -82.7485], 1.0),
            ([50.0, 0.0, 0.0], [50.0, -1.0, 2.0], 2.3669),
            ([50.0, 2.49, -0.001], [50.0, -2.49, 0.0009], 7.1792),
            ([50.0, 2.49, -0.001], [50.0, -2.49, 0.0011], 7.2195),
            ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
            ([50.0, 2.5, 0.0], [50.0, 3.2592, 0.335], 1.0),
            (
                [60.2574, -34.0099, 36.2677],
                [60.4626, -34.1751, 39.4387],
                1.2644,
            ),
            (
                [22.7233, 20.0904, -46.694],
                [23.0331, 14.973, -42.5619],
                2.0373,
            ),
            (
                [90.8027, -2.0831, 1.441],
                [91.1528, -1.6435, 0.0447],
                1.4441,
            ),
            ([2.0776, 0.0795, -1.135], [0.9033, -0.0636, -0.5514], 0.9082),
        ] {
            for (a, b) in [(one, other), (other, one)] {
                let found = delta_e_2000(a, b);
                assert!((found - expected).abs() < 5e-5, "{a:?} {b:?}: {found}");
            }
        }
    }

    #[test]
    fn the_older_distance_is_euclid_s() {
        assert_eq!(delta_e_76([50.0, 3.0, 0.0], [50.0, 0.0, 4.0]), 5.0);
    }
}
