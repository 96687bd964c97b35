//! Multiple importance sampling: two ways to find light, each weighted by how likely it was to find it
//! (Veach and Guibas, *Optimally combining sampling techniques*, 1995).

/// The power heuristic (β = 2): the weight of a sample drawn with density `a`, which the other technique
/// would have drawn with density `b`.
#[inline]
pub(super) fn power(a: f32, b: f32) -> f32 {
    let ratio = b / a;
    1.0 / (1.0 + ratio * ratio)
}
