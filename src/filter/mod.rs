//! Reconstruction filters: how far, and with what weight, a sample reaches the pixels around it. A
//! filter is the product of two one-dimensional kernels.

mod r#box;
mod catmullrom;
mod gaussian;
mod lanczos;
mod mitchell;
mod tent;

use crate::family::family;
use crate::lanes::Lanes;

/// What every filter does.
pub trait Kernel: std::fmt::Debug + Send + Sync {
    /// Distance in pixels from which on the kernel is 0.
    fn radius(&self) -> f32;
}

family! {
    /// Every reconstruction filter there is.
    #[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
    pub enum Filter: Kernel, context () {
        "box" => Box(r#box::Box),
        "catmullrom" => CatmullRom(catmullrom::CatmullRom),
        "gaussian" => Gaussian(gaussian::Gaussian),
        "lanczos" => Lanczos(lanczos::Lanczos),
        "mitchell" => Mitchell(mitchell::Mitchell),
        "tent" => Tent(tent::Tent),
    }
}

impl Default for Filter {
    /// Mitsuba's: a Gaussian of standard deviation 0.5 and radius 2.
    fn default() -> Self {
        Self::Gaussian(gaussian::Gaussian::default())
    }
}

impl Filter {
    /// Weight 1 on the pixel alone.
    pub fn pixel() -> Self {
        Self::Box(r#box::Box)
    }

    /// The weights at distances of |x| pixels; zero beyond the radius.
    #[inline(always)]
    pub fn weight<F: Lanes>(&self, x: F) -> F {
        match self {
            Self::Box(filter) => filter.weight(x),
            Self::CatmullRom(filter) => filter.weight(x),
            Self::Gaussian(filter) => filter.weight(x),
            Self::Lanczos(filter) => filter.weight(x),
            Self::Mitchell(filter) => filter.weight(x),
            Self::Tent(filter) => filter.weight(x),
        }
    }

    /// How many pixels beyond its own a sample reaches.
    pub fn reach(&self) -> u32 {
        (self.radius() + 0.5).ceil() as u32 - 1
    }
}

/// The widest radius in pixels, so that a tile's border stays small.
pub(crate) const MAX_RADIUS: f64 = 16.0;

/// The two-parameter family of cubics of Mitchell and Netravali, *Reconstruction filters in computer
/// graphics* (1988), radius 2.
#[inline(always)]
fn cubic<F: Lanes>(b: f32, c: f32, x: F) -> F {
    let x = x.abs();
    let x2 = x * x;
    let x3 = x2 * x;
    let n = F::splat;
    let near = n(12.0 - 9.0 * b - 6.0 * c) * x3 + n(-18.0 + 12.0 * b + 6.0 * c) * x2;
    let near = near + n(6.0 - 2.0 * b);
    let far = n(-b - 6.0 * c) * x3 + n(6.0 * b + 30.0 * c) * x2;
    let far = far + n(-12.0 * b - 48.0 * c) * x + n(8.0 * b + 24.0 * c);
    let value = F::select(x.lt(F::one()), near, far);
    F::select(x.lt(n(2.0)), value * n(1.0 / 6.0), F::zero())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Description, Kind, Options};
    use std::path::Path;

    #[test]
    fn every_filter_is_even_ends_at_its_radius_and_has_a_positive_integral() {
        for name in Filter::NAMES {
            let text = format!(r#"<scene version="3.0.0"><rfilter type="{name}"/></scene>"#);
            let scene =
                Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
            let filter = Filter::build(&scene.root().children(Kind::Filter)[0], &()).unwrap();
            let n = 4000;
            let mut integral = 0.0;
            for i in 0..n {
                let x = (i as f32 + 0.5) / n as f32 * filter.radius();
                assert!(
                    (filter.weight(x) - filter.weight(-x)).abs() < 1e-6,
                    "{name}"
                );
                integral += filter.weight(x);
            }
            assert!(
                integral > 0.0 && filter.weight(0.0) >= filter.weight(0.4 * filter.radius()),
                "{name}"
            );
            assert_eq!(filter.weight(filter.radius() + 1e-3), 0.0, "{name}");
        }
    }
}
