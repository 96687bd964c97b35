//! Colour spaces, with CIE XYZ as the hub between them: X, Y, Z of the 1931 observer, the white's Y being 1.
//!
//! Sources: ITU-R BT.709, BT.2020; SMPTE RP 431-2 (DCI-P3), EG 432-1 (P3 with white D65); SMPTE ST 2065-1 and Academy
//! S-2014-004 (ACES AP0 and AP1); Hunt, Pointer and Estévez's cones; CIE 15:2004 (L\*a\*b\*, L\*u\*v\*); Smith 1978 (HSV, HLS).

use glam::{DMat3, DVec3};

use super::primaries::Primaries;

/// A space of colours of three coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// X, Y, Z.
    Xyz,
    /// x, y, Y.
    Xyy,
    /// Linear ITU-R BT.709.
    Bt709,
    /// BT.709 with sRGB's curve, codes from 0 to 1.
    Srgb,
    /// Linear ITU-R BT.2020.
    Bt2020,
    /// Linear DCI-P3, whose white is the cinema's.
    DciP3,
    /// Linear P3 with the white D65.
    P3D65,
    /// ACES 2065-1.
    Ap0,
    /// ACEScg.
    Ap1,
    /// Responses of the cones L, M, S, which are 1, 1, 1 for D65.
    Lms,
    /// L\*, a\*, b\* under D65.
    Lab,
    /// L\*, u\*, v\* under D65.
    Luv,
    /// Hue in degrees, saturation and value of sRGB codes.
    Hsv,
    /// Hue in degrees, lightness and saturation of sRGB codes.
    Hls,
}

impl Primaries {
    /// DCI-P3.
    pub const DCI_P3: Self = Self {
        red: [0.68, 0.32],
        green: [0.265, 0.69],
        blue: [0.15, 0.06],
        white: [0.314, 0.351],
    };
    /// ACES AP0.
    pub const AP0: Self = Self {
        red: [0.7347, 0.2653],
        green: [0.0, 1.0],
        blue: [0.0001, -0.077],
        white: [0.32168, 0.33767],
    };
    /// ACES AP1.
    pub const AP1: Self = Self {
        red: [0.713, 0.293],
        green: [0.165, 0.83],
        blue: [0.128, 0.044],
        white: [0.32168, 0.33767],
    };
}

/// The chromaticity of D65.
const D65: [f64; 2] = [0.3127, 0.329];

/// X, Y, Z of a chromaticity, of luminance 1.
pub fn xyz_of([x, y]: [f64; 2]) -> [f64; 3] {
    [x / y, 1.0, (1.0 - x - y) / y]
}

/// The chromaticity of X, Y, Z; D65's where they are 0.
pub fn chromaticity([x, y, z]: [f64; 3]) -> [f64; 2] {
    let sum = x + y + z;
    if sum == 0.0 { D65 } else { [x / sum, y / sum] }
}

/// XYZ to the cones' responses by Hunt, Pointer and Estévez, 1, 1, 1 for D65.
const LMS: [[f64; 3]; 3] = [
    [0.40024, 0.7076, -0.08081],
    [-0.2263, 1.16532, 0.0457],
    [0.0, 0.0, 0.91822],
];

/// The sharpened cones of Bradford's adaptation (Lam, 1985).
const BRADFORD: [[f64; 3]; 3] = [
    [0.8951, 0.2664, -0.1614],
    [-0.7502, 1.7135, 0.0367],
    [0.0389, -0.0685, 1.0296],
];

/// A matrix by its rows.
fn matrix(rows: &[[f64; 3]; 3]) -> DMat3 {
    DMat3::from_cols_array_2d(rows).transpose()
}

/// What takes X, Y, Z seen under one white to what looks alike under another, by Bradford's transform.
pub fn adaptation(from: [f64; 2], to: [f64; 2]) -> DMat3 {
    if from == to {
        return DMat3::IDENTITY;
    }
    let cones = matrix(&BRADFORD);
    let of = |white| cones * DVec3::from(xyz_of(white));
    cones.inverse() * DMat3::from_diagonal(of(to) / of(from)) * cones
}

impl Space {
    /// All, by the names that the command line knows.
    pub const ALL: [(&str, Self); 14] = [
        ("xyz", Self::Xyz),
        ("xyy", Self::Xyy),
        ("bt709", Self::Bt709),
        ("srgb", Self::Srgb),
        ("bt2020", Self::Bt2020),
        ("dci-p3", Self::DciP3),
        ("p3-d65", Self::P3D65),
        ("ap0", Self::Ap0),
        ("ap1", Self::Ap1),
        ("lms", Self::Lms),
        ("lab", Self::Lab),
        ("luv", Self::Luv),
        ("hsv", Self::Hsv),
        ("hls", Self::Hls),
    ];

    /// The space of that name.
    pub fn named(name: &str) -> Option<Self> {
        let found = Self::ALL.iter().find(|(known, _)| *known == name);
        found.map(|(_, space)| *space)
    }

    /// The primaries, of a space that has some.
    pub fn primaries(self) -> Option<Primaries> {
        match self {
            Self::Bt709 | Self::Srgb => Some(Primaries::BT709),
            Self::Bt2020 => Some(Primaries::BT2020),
            Self::DciP3 => Some(Primaries::DCI_P3),
            Self::P3D65 => Some(Primaries::P3_D65),
            Self::Ap0 => Some(Primaries::AP0),
            Self::Ap1 => Some(Primaries::AP1),
            _ => None,
        }
    }

    /// Its linear coordinates to X, Y, Z under D65; of a space that has primaries.
    fn linear(self) -> Option<DMat3> {
        let primaries = self.primaries()?;
        let to_xyz = primaries.to_xyz()?;
        Some(adaptation(primaries.white, D65) * to_xyz)
    }

    /// X, Y, Z under D65, to which other whites are adapted by Bradford's transform.
    pub fn to_xyz(self, color: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = color;
        match self {
            Self::Xyz => color,
            Self::Xyy if b == 0.0 => [0.0; 3],
            Self::Xyy => xyz_of([a, b]).map(|v| v * c),
            Self::Lms => (matrix(&LMS).inverse() * DVec3::from(color)).to_array(),
            Self::Lab => lab_to_xyz(color),
            Self::Luv => luv_to_xyz(color),
            Self::Srgb => Self::Bt709.to_xyz(color.map(decode)),
            Self::Hsv => Self::Srgb.to_xyz(hsv_to_rgb(color)),
            Self::Hls => Self::Srgb.to_xyz(hls_to_rgb(color)),
            _ => {
                let matrix = self.linear().expect("these primaries make a space");
                (matrix * DVec3::from(color)).to_array()
            }
        }
    }

    /// The inverse of [`Space::to_xyz`].
    pub fn of_xyz(self, xyz: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Xyz => xyz,
            Self::Xyy => {
                let [x, y] = chromaticity(xyz);
                [x, y, xyz[1]]
            }
            Self::Lms => (matrix(&LMS) * DVec3::from(xyz)).to_array(),
            Self::Lab => xyz_to_lab(xyz),
            Self::Luv => xyz_to_luv(xyz),
            Self::Srgb => Self::Bt709.of_xyz(xyz).map(encode),
            Self::Hsv => rgb_to_hsv(Self::Srgb.of_xyz(xyz)),
            Self::Hls => rgb_to_hls(Self::Srgb.of_xyz(xyz)),
            _ => {
                let matrix = self.linear().expect("these primaries make a space");
                (matrix.inverse() * DVec3::from(xyz)).to_array()
            }
        }
    }
}

/// sRGB's curve in double precision, odd about 0.
fn encode(x: f64) -> f64 {
    let magnitude = x.abs();
    let code = if magnitude <= 0.003_130_8 {
        12.92 * magnitude
    } else {
        1.055 * magnitude.powf(1.0 / 2.4) - 0.055
    };
    code.copysign(x)
}

/// The inverse of [`encode`].
fn decode(code: f64) -> f64 {
    let magnitude = code.abs();
    let x = if magnitude <= 12.92 * 0.003_130_8 {
        magnitude / 12.92
    } else {
        ((magnitude + 0.055) / 1.055).powf(2.4)
    };
    x.copysign(code)
}

/// CIE 15's bounds between a cube root and a line: (6/29)³ and (29/3)³.
const EPSILON: f64 = 216.0 / 24389.0;
const KAPPA: f64 = 24389.0 / 27.0;

/// L\* of a relative luminance.
fn lightness(y: f64) -> f64 {
    if y > EPSILON {
        116.0 * y.cbrt() - 16.0
    } else {
        KAPPA * y
    }
}

/// The relative luminance of L\*.
fn luminance(lightness: f64) -> f64 {
    if lightness > KAPPA * EPSILON {
        ((lightness + 16.0) / 116.0).powi(3)
    } else {
        lightness / KAPPA
    }
}

fn xyz_to_lab(xyz: [f64; 3]) -> [f64; 3] {
    let white = xyz_of(D65);
    let f = |c: usize| (lightness(xyz[c] / white[c]) + 16.0) / 116.0;
    let (x, y, z) = (f(0), f(1), f(2));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn lab_to_xyz([l, a, b]: [f64; 3]) -> [f64; 3] {
    let white = xyz_of(D65);
    let y = (l + 16.0) / 116.0;
    let (x, z) = (y + a / 500.0, y - b / 200.0);
    let back = |f: f64, c: usize| white[c] * luminance(116.0 * f - 16.0);
    [back(x, 0), back(y, 1), back(z, 2)]
}

/// u′ and v′; those of D65 where X, Y, Z are 0.
fn uv(xyz: [f64; 3]) -> [f64; 2] {
    let [x, y] = chromaticity(xyz);
    let scale = -2.0 * x + 12.0 * y + 3.0;
    [4.0 * x / scale, 9.0 * y / scale]
}

fn xyz_to_luv(xyz: [f64; 3]) -> [f64; 3] {
    let ([u, v], [white_u, white_v]) = (uv(xyz), uv(xyz_of(D65)));
    let l = lightness(xyz[1]);
    [l, 13.0 * l * (u - white_u), 13.0 * l * (v - white_v)]
}

fn luv_to_xyz([l, u, v]: [f64; 3]) -> [f64; 3] {
    if l == 0.0 {
        return [0.0; 3];
    }
    let [white_u, white_v] = uv(xyz_of(D65));
    let (u, v) = (u / (13.0 * l) + white_u, v / (13.0 * l) + white_v);
    let y = luminance(l);
    [
        y * 9.0 * u / (4.0 * v),
        y,
        y * (12.0 - 3.0 * u - 20.0 * v) / (4.0 * v),
    ]
}

/// Hue in degrees, [0, 360), with the largest and the smallest component.
fn hue([r, g, b]: [f64; 3]) -> (f64, f64, f64) {
    let (most, least) = (r.max(g).max(b), r.min(g).min(b));
    let chroma = most - least;
    let sixth = if chroma == 0.0 {
        0.0
    } else if most == r {
        (g - b) / chroma
    } else if most == g {
        2.0 + (b - r) / chroma
    } else {
        4.0 + (r - g) / chroma
    };
    ((60.0 * sixth).rem_euclid(360.0), most, least)
}

/// The colour of that hue, of so much chroma above `least`.
fn of_hue(degrees: f64, chroma: f64, least: f64) -> [f64; 3] {
    let sixth = degrees.rem_euclid(360.0) / 60.0;
    let second = chroma * (1.0 - (sixth % 2.0 - 1.0).abs());
    let rgb = match sixth as u32 {
        0 => [chroma, second, 0.0],
        1 => [second, chroma, 0.0],
        2 => [0.0, chroma, second],
        3 => [0.0, second, chroma],
        4 => [second, 0.0, chroma],
        _ => [chroma, 0.0, second],
    };
    rgb.map(|v| v + least)
}

/// Hue in degrees from 0 to 360, saturation, and the value, which is the greatest component.
pub fn rgb_to_hsv(rgb: [f64; 3]) -> [f64; 3] {
    let (hue, most, least) = hue(rgb);
    let saturation = if most == 0.0 {
        0.0
    } else {
        (most - least) / most
    };
    [hue, saturation, most]
}

/// The opposite of [`rgb_to_hsv`]. Hues of other degrees go round.
pub fn hsv_to_rgb([hue, saturation, value]: [f64; 3]) -> [f64; 3] {
    let chroma = saturation * value;
    of_hue(hue, chroma, value - chroma)
}

fn rgb_to_hls(rgb: [f64; 3]) -> [f64; 3] {
    let (hue, most, least) = hue(rgb);
    let lightness = 0.5 * (most + least);
    let room = 1.0 - (2.0 * lightness - 1.0).abs();
    let saturation = if room == 0.0 {
        0.0
    } else {
        (most - least) / room
    };
    [hue, lightness, saturation]
}

fn hls_to_rgb([hue, lightness, saturation]: [f64; 3]) -> [f64; 3] {
    let chroma = saturation * (1.0 - (2.0 * lightness - 1.0).abs());
    of_hue(hue, chroma, lightness - 0.5 * chroma)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(found: [f64; 3], expected: [f64; 3], tolerance: f64, what: &str) {
        for c in 0..3 {
            let error = (found[c] - expected[c]).abs();
            assert!(error < tolerance, "{what}: {found:?} is not {expected:?}");
        }
    }

    #[test]
    fn every_space_takes_colours_there_and_back() {
        for (name, space) in Space::ALL {
            for i in 0..1000_u32 {
                let part = |k: u32| f64::from(i.wrapping_mul(k) % 97) / 97.0 * 0.9 + 0.05;
                let rgb = [part(31), part(57), part(83)];
                let there = space.of_xyz(Space::Bt709.to_xyz(rgb));
                let back = Space::Bt709.of_xyz(space.to_xyz(there));
                assert_near(back, rgb, 1e-6, name);
            }
        }
    }

    #[test]
    fn black_and_white_are_that_everywhere() {
        let white = xyz_of(D65);
        for (name, space) in Space::ALL {
            assert_near(space.to_xyz(space.of_xyz([0.0; 3])), [0.0; 3], 1e-9, name);
            if space.primaries().is_some() || space == Space::Lms {
                assert_near(space.of_xyz(white), [1.0; 3], 2e-4, name);
            }
        }
        assert_near(Space::Lab.of_xyz(white), [100.0, 0.0, 0.0], 1e-9, "lab");
        assert_near(Space::Luv.of_xyz(white), [100.0, 0.0, 0.0], 1e-9, "luv");
    }

    /// The matrices that the standards print.
    #[test]
    fn primaries_have_their_published_matrices() {
        for (space, published) in [
            (
                Space::Bt709,
                [
                    [0.4124, 0.3576, 0.1805],
                    [0.2126, 0.7152, 0.0722],
                    [0.0193, 0.1192, 0.9505],
                ],
            ),
            (
                Space::Bt2020,
                [
                    [0.6370, 0.1446, 0.1689],
                    [0.2627, 0.6780, 0.0593],
                    [0.0000, 0.0281, 1.0610],
                ],
            ),
            (
                Space::P3D65,
                [
                    [0.4866, 0.2657, 0.1982],
                    [0.2290, 0.6917, 0.0793],
                    [0.0000, 0.0451, 1.0439],
                ],
            ),
        ] {
            for column in 0..3 {
                let mut unit = [0.0; 3];
                unit[column] = 1.0;
                let expected = published.map(|row| row[column]);
                assert_near(space.to_xyz(unit), expected, 6e-5, &format!("{space:?}"));
            }
        }
        // Without adaptation, as ST 2065-1 and RP 431-2 have them.
        for (primaries, published) in [
            (
                Primaries::AP0,
                [
                    [0.9525, 0.0, 0.0001],
                    [0.3440, 0.7282, -0.0721],
                    [0.0, 0.0, 1.0088],
                ],
            ),
            (
                Primaries::AP1,
                [
                    [0.6625, 0.1340, 0.1562],
                    [0.2722, 0.6741, 0.0537],
                    [-0.0056, 0.0041, 1.0103],
                ],
            ),
            (
                Primaries::DCI_P3,
                [
                    [0.4452, 0.2771, 0.1723],
                    [0.2095, 0.7216, 0.0689],
                    [0.0, 0.0471, 0.9074],
                ],
            ),
        ] {
            let matrix = primaries.to_xyz().unwrap().transpose().to_cols_array_2d();
            for row in 0..3 {
                assert_near(matrix[row], published[row], 6e-5, &format!("{primaries:?}"));
            }
        }
    }

    /// BT.709 to ACES AP0 by Bradford's transform: Academy TB-2014-004's values.
    /// The ColorChecker's patches before November 2014 under D50: x, y, Y as PyPI `colour-science` 0.4.7 has them, and
    /// L\*a\*b\* as X-Rite published them.
    const CHECKER: [([f64; 3], [f64; 3]); 24] = [
        ([0.431627, 0.377724, 0.100802], [37.986, 13.555, 14.059]),
        ([0.419681, 0.374415, 0.349516], [65.711, 18.130, 17.810]),
        ([0.276132, 0.301660, 0.183576], [49.927, -4.880, -21.905]),
        ([0.370369, 0.449964, 0.132510], [43.139, -13.095, 21.905]),
        ([0.299925, 0.285618, 0.230385], [55.112, 8.844, -25.399]),
        ([0.284842, 0.391182, 0.417800], [70.719, -33.397, -0.199]),
        ([0.529536, 0.405529, 0.311820], [62.661, 36.067, 57.096]),
        ([0.230572, 0.210692, 0.112630], [40.020, 10.410, -45.964]),
        ([0.501210, 0.327298, 0.193758], [51.124, 48.239, 16.248]),
        ([0.331911, 0.248286, 0.063690], [30.325, 22.976, -21.587]),
        ([0.398363, 0.500822, 0.444556], [72.532, -23.709, 57.255]),
        ([0.495693, 0.442727, 0.435713], [71.941, 19.363, 67.857]),
        ([0.201868, 0.169254, 0.057520], [28.778, 14.179, -50.297]),
        ([0.325280, 0.503280, 0.231836], [55.261, -38.342, 31.370]),
        ([0.568601, 0.330299, 0.125654], [42.101, 53.378, 28.190]),
        ([0.469689, 0.473381, 0.598067], [81.733, 4.039, 79.819]),
        ([0.415901, 0.268833, 0.200866], [51.935, 49.986, -14.574]),
        ([0.213162, 0.302336, 0.193014], [51.038, -28.631, -28.638]),
        ([0.346980, 0.360811, 0.913135], [96.539, -0.425, 1.186]),
        ([0.344058, 0.358467, 0.589371], [81.257, -0.638, -0.335]),
        ([0.343225, 0.358175, 0.363230], [66.766, -0.734, -0.504]),
        ([0.344624, 0.357990, 0.191541], [50.867, -0.153, -0.270]),
        ([0.340182, 0.354821, 0.088306], [35.656, -0.421, -1.231]),
        ([0.340609, 0.353789, 0.031054], [20.461, -0.079, -0.973]),
    ];

    #[test]
    fn a_colour_checker_has_its_published_lab() {
        let white = xyz_of([0.34570291, 0.3585386]);
        let to_d65 = |xyz: [f64; 3]| {
            let d65 = xyz_of(D65);
            [0, 1, 2].map(|c| xyz[c] / white[c] * d65[c])
        };
        for (xyy, lab) in CHECKER {
            // L*a*b* asks for parts of the white alone.
            let xyz = to_d65(Space::Xyy.to_xyz(xyy));
            assert_near(Space::Lab.of_xyz(xyz), lab, 2e-3, "Lab");
            assert_near(Space::Lab.to_xyz(lab), xyz, 1e-5, "XYZ");
        }
    }

    #[test]
    fn whites_are_adapted_by_bradford() {
        let ap0 = |rgb| Space::Ap0.of_xyz(Space::Bt709.to_xyz(rgb));
        assert_near(ap0([1.0, 0.0, 0.0]), [0.4397, 0.0897, 0.0175], 2e-4, "red");
        assert_near(
            ap0([0.0, 1.0, 0.0]),
            [0.3830, 0.8134, 0.1116],
            2e-4,
            "green",
        );
        assert_near(ap0([0.0, 0.0, 1.0]), [0.1774, 0.0968, 0.8709], 2e-4, "blue");
    }

    /// The same in other words: the angles and lengths that Smith's formulas give.
    #[test]
    fn pickers_see_pure_colours() {
        let of = |space: Space, rgb| space.of_xyz(Space::Srgb.to_xyz(rgb));
        assert_near(
            of(Space::Hsv, [1.0, 0.5, 0.0]),
            [30.0, 1.0, 1.0],
            1e-6,
            "orange",
        );
        assert_near(
            of(Space::Hls, [1.0, 0.5, 0.0]),
            [30.0, 0.5, 1.0],
            1e-6,
            "orange",
        );
        assert_near(
            of(Space::Hsv, [0.2, 0.2, 0.4]),
            [240.0, 0.5, 0.4],
            1e-6,
            "dull blue",
        );
        assert_near(
            of(Space::Hls, [0.2, 0.2, 0.4]),
            [240.0, 0.3, 1.0 / 3.0],
            1e-6,
            "dull blue",
        );
    }
}
