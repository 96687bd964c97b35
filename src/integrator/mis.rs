//! Multiple importance sampling: several ways to find light, each weighted by how likely it was to find it
//! (Veach and Guibas, *Optimally combining sampling techniques*, 1995).

use crate::lanes::Lanes;

/// The power heuristic (β = 2): the weight of a sample drawn with density `a`, which the other technique
/// would have drawn with density `b`.
#[inline(always)]
pub(super) fn power<F: Lanes>(a: F, b: F) -> F {
    let ratio = b / a;
    F::one() / (F::one() + ratio * ratio)
}

/// The same of three techniques; the densities of the other two are given as multiples of that which drew.
#[inline(always)]
pub(super) fn power_of_three<F: Lanes>(a: F, b: F) -> F {
    let weight = F::one() / (F::one() + a * a + b * b);
    // Ratios that are not finite are those of techniques that hardly ever draw.
    F::select(weight.is_finite(), weight, F::zero())
}
