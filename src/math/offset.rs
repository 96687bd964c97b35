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
    let outward = |p: f32, s: f32| match s {
        s if s > 0.0 => p.next_up(),
        s if s < 0.0 => p.next_down(),
        _ => p,
    };
    Vec3::new(
        outward(moved.x, shift.x),
        outward(moved.y, shift.y),
        outward(moved.z, shift.z),
    )
}
