//! Where a ray may start so that it cannot hit the surface it leaves: the point is moved along the
//! geometric normal by a bound on its own rounding error, and each coordinate rounded outward. The bound
//! scales with the numbers, so that it holds at every scene scale (Pharr, Jakob and Humphreys, *PBRT*
//! 4th ed., 6.8.6).

use crate::lanes::{Ints as _, Lanes, Vec3};

/// γ_n = nε / (1 − nε) with half the machine epsilon: a bound on n roundings (Higham 2002).
pub const fn gamma(n: u32) -> f32 {
    let e = n as f32 * (f32::EPSILON * 0.5);
    e / (1.0 - e)
}

/// `position`, known within ±`error` on each axis, moved off its surface to the side to which
/// `direction` points; `normal` has unit length.
#[inline(always)]
pub fn offset<F: Lanes>(
    position: Vec3<F>,
    error: Vec3<F>,
    normal: Vec3<F>,
    direction: Vec3<F>,
) -> Vec3<F> {
    let distance = normal.abs().dot(error);
    let away = F::select(direction.dot(normal).lt(F::zero()), -distance, distance);
    let shift = normal * away;
    let moved = position + shift;
    Vec3::new(
        outward(moved.x, shift.x),
        outward(moved.y, shift.y),
        outward(moved.z, shift.z),
    )
}

/// The next number after `p` on the side of `shift`'s sign; `p` itself where there is no shift.
#[inline(always)]
fn outward<F: Lanes>(p: F, shift: F) -> F {
    let (bits, one) = (p.to_bits(), F::Int::splat(1));
    let sign = shift.to_bits() & F::Int::splat(SIGN);
    let alike = sign.eq(bits & F::Int::splat(SIGN));
    let next = F::select(alike, (bits + one).from_bits(), (bits - one).from_bits());
    // Zero has two signs, and is left for the least number.
    let next = F::select(p.eq(F::zero()), (sign | one).from_bits(), next);
    let stays = shift.eq(F::zero()) | !p.is_finite();
    F::select(stays, p, next)
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
                let expected = if f32::is_finite(p) {
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
