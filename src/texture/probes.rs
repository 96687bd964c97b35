//! From the ellipse that is seen of an image to where, and how finely, it is looked up. By a single probe that is as long as
//! the ellipse; or by several along it that are as long as it is wide, as graphics hardware does (McCormack et al., *Feline*,
//! 1999, without its weights).

use glam::Mat3;

use crate::lanes::{Lanes, Mask as _, Vec2};

/// How an ellipse is looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// By one probe.
    Round,
    /// By up to so many.
    Long(u32),
}

/// Places on a line, evenly apart, from which means are taken of as many texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Probes<F: Lanes> {
    /// How many, from 1.
    pub(super) count: F,
    /// The length of each, in texels.
    pub(super) length: F,
    /// The line from one end to the other, in units of the image.
    line: Vec2<F>,
}

impl<F: Lanes> Probes<F> {
    /// For an ellipse with the conjugate diameters `footprint`, before `to_uv`, of an image of `size` texels.
    #[inline(always)]
    pub(super) fn new(
        footprint: [Vec2<F>; 2],
        to_uv: &Mat3,
        size: [usize; 2],
        shape: Shape,
    ) -> Self {
        let [width, height] = [F::splat(size[0] as f32), F::splat(size[1] as f32)];
        let (x_axis, y_axis) = (
            Vec2::all(to_uv.x_axis.truncate()),
            Vec2::all(to_uv.y_axis.truncate()),
        );
        let a = x_axis * footprint[0].x + y_axis * footprint[0].y;
        let b = x_axis * footprint[1].x + y_axis * footprint[1].y;
        let (ax, ay, bx, by) = (a.x * width, a.y * height, b.x * width, b.y * height);
        // The ellipse's matrix, [a b] times its transpose, has the squares of its axes as eigenvalues.
        let (xx, xy, yy) = (ax * ax + bx * bx, ax * ay + bx * by, ay * ay + by * by);
        let half = F::splat(0.5);
        let (mean, off) = (half * (xx + yy), half * (xx - yy));
        let apart = (off * off + xy * xy).sqrt();
        let long = (mean + apart).sqrt();
        let Shape::Long(most) = shape else {
            return Self {
                count: F::one(),
                length: long,
                line: Vec2::splat(0.0),
            };
        };
        // What is below a texel is looked up as one.
        let short = ((ax * by - ay * bx).abs() / long).max(F::one());
        let ratio = (long / short).clamp(1.0, most as f32);
        let count = (ratio + half).floor();
        let wide = F::zero().le(off);
        let along = Vec2::new(
            F::select(wide, off + apart, xy),
            F::select(wide, xy, apart - off),
        );
        // What the probes at the ends reach beyond the places' line.
        let reach = long * (F::one() - F::one() / count) / along.length();
        let line = Vec2::new(along.x * reach / width, along.y * reach / height);
        let told = F::one().lt(count) & line.x.is_finite() & line.y.is_finite();
        Self {
            count: F::select(told, count, F::one()),
            length: F::select(told, short.max(long / count), long),
            line: Vec2::select(told, line, Vec2::splat(0.0)),
        }
    }

    /// The most that any lane has.
    #[inline(always)]
    pub(super) fn most(&self) -> u32 {
        let mut most = 1;
        while F::splat(most as f32).lt(self.count).any() {
            most += 1;
        }
        most
    }

    /// Where a probe lies, from the middle.
    #[inline(always)]
    pub(super) fn place(&self, number: u32) -> Vec2<F> {
        let steps = (self.count - F::one()).max(F::one());
        let part = F::splat(number as f32) / steps - F::splat(0.5);
        let single = self.count.lt(F::splat(1.5));
        self.line * F::select(single, F::zero(), part)
    }
}
