//! Fractal noise in space: f(p) = Σᵢ 2⁻ⁱ noise(2ⁱ Rⁱ p), value noise between the corners of a lattice, interpolated with
//! Perlin's quintic (*Improving noise*, 2002), as the terrain's is in the plane. R turns each octave, by an orthogonal matrix
//! of thirds, so that nothing but sums, products and square roots goes into it: a seed gives the same bits everywhere.

use glam::{DMat3, DVec3};

use crate::math::random;

/// Noise with details down to some size.
#[derive(Clone, Debug)]
pub(super) struct Noise {
    /// One an octave.
    keys: Vec<u64>,
}

impl Noise {
    pub(super) fn new(seed: u64, octaves: u32) -> Self {
        let keys = (0..u64::from(octaves)).map(|i| random::key(seed, i));
        Self {
            keys: keys.collect(),
        }
    }

    /// In (−2, 2), and seldom beyond ±1; its largest features are about a unit wide.
    pub(super) fn at(&self, mut p: DVec3) -> f64 {
        let turn = DMat3::from_cols_array(&[2.0, 2.0, -1.0, -1.0, 2.0, 2.0, 2.0, -1.0, 2.0]);
        let turn_and_shrink = turn * (2.0 / 3.0);
        let (mut sum, mut amplitude) = (0.0, 1.0);
        for &key in &self.keys {
            sum += amplitude * octave(p, key);
            amplitude *= 0.5;
            p = turn_and_shrink * p;
        }
        sum
    }
}

/// In [−1, 1]: random at whole numbers, and between them smooth to the second derivative.
fn octave(p: DVec3, key: u64) -> f64 {
    let corner = p.floor();
    let f = p - corner;
    let weight = f * f * f * (f * (6.0 * f - 15.0) + 10.0);
    let [x, y, z] = corner.to_array().map(|c| c as i64);
    let value = |dx: i64, dy: i64, dz: i64| {
        let place = |key: u64, i: i64| random::key(key, i as u64);
        let bits = place(place(place(key, x + dx), y + dy), z + dz);
        2.0 * f64::from(random::unit(bits)) - 1.0
    };
    let mix = |a: f64, b: f64, w: f64| a + w * (b - a);
    let along_x = |dy, dz| mix(value(0, dy, dz), value(1, dy, dz), weight.x);
    let along_xy = |dz| mix(along_x(0, dz), along_x(1, dz), weight.y);
    mix(along_xy(0), along_xy(1), weight.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_smooth_centred_and_as_large_as_is_said() {
        let noise = Noise::new(3, 5);
        let points = (0..20_000).map(|i| DVec3::new(0.37, 0.11, 0.73) * f64::from(i));
        let (mut sum, mut largest) = (0.0, 0.0_f64);
        for p in points {
            let value = noise.at(p);
            let near = noise.at(p + 1e-4);
            assert!((value - near).abs() < 5e-3);
            (sum, largest) = (sum + value, largest.max(value.abs()));
        }
        assert!((sum / 20_000.0).abs() < 0.05, "{sum}");
        assert!((0.8..2.0).contains(&largest), "{largest}");
        assert_ne!(noise.at(DVec3::ONE), Noise::new(4, 5).at(DVec3::ONE));
    }
}
