//! Where a ray may start so that it cannot hit the surface it leaves: the point is moved along the
//! geometric normal by a bound on its own rounding error, and each coordinate rounded outward. The bound
//! scales with the numbers, so that it holds at every scene scale (Pharr, Jakob and Humphreys, *PBRT*
//! 4th ed., 6.8.6).

use glam::Vec3;

/// γ_n = nε / (1 − nε) with half the machine epsilon: a bound on n roundings (Higham 2002).
pub const fn gamma(n: u32) -> f32 {
    let e = n as f32 * (f32::EPSILON * 0.5);
    e / (1.0 - e)
}

/// `position`, known within ±`error` on each axis, moved off its surface to the side to which
/// `direction` points; `normal` has unit length.
#[inline]
pub fn offset(position: Vec3, error: Vec3, normal: Vec3, direction: Vec3) -> Vec3 {
    let distance = normal.abs().dot(error);
    let shift = if direction.dot(normal) < 0.0 {
        -distance * normal
    } else {
        distance * normal
    };
    let moved = position + shift;
    Vec3::new(
        outward(moved.x, shift.x),
        outward(moved.y, shift.y),
        outward(moved.z, shift.z),
    )
}

/// The next number after `p` on the side of `shift`'s sign; `p` itself where there is no shift. Without a branch, for
/// signs cannot be foretold.
#[inline]
fn outward(p: f32, shift: f32) -> f32 {
    let sign = shift.to_bits() & SIGN;
    let bits = p.to_bits();
    let next = if sign == bits & SIGN {
        bits.wrapping_add(1)
    } else {
        bits.wrapping_sub(1)
    };
    // Zero has two signs, and is left for the least number.
    let next = if p == 0.0 { sign | 1 } else { next };
    let stays = shift == 0.0 || !p.is_finite();
    f32::from_bits(if stays { bits } else { next })
}

const SIGN: u32 = 1 << 31;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outward_is_the_next_number_on_that_side() {
        let tiny = f32::from_bits(1);
        let numbers = [
            0.0,
            tiny,
            f32::MIN_POSITIVE,
            1.0,
            1.5,
            1e30,
            f32::MAX,
            f32::INFINITY,
        ];
        for p in numbers.into_iter().flat_map(|p| [p, -p]) {
            for shift in [tiny, 1.0, f32::INFINITY] {
                let expected = if p.is_finite() {
                    [p.next_up(), p.next_down()]
                } else {
                    [p; 2]
                };
                assert_eq!([outward(p, shift), outward(p, -shift)], expected, "{p}");
            }
            assert_eq!([outward(p, 0.0), outward(p, -0.0)], [p; 2]);
        }
    }
}
