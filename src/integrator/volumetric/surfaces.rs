//! What paths do at surfaces: light is asked for, and they go on, through boundaries of media also into another one.

use super::{Carried, LIGHT, Mean, Path, Segment, WAY, over};
use crate::color::{ColorModel, Spectra, Spectral as _};
use crate::integrator::Estimate;
use crate::integrator::limits::Limits;
use crate::integrator::wave::{Block, Outcome, Shading, Ways};
use crate::lanes::{Lanes, Mask as _, Vec3};
use crate::material::Surface;

/// A round at surfaces.
pub(super) struct Surfaces<'a, C: ColorModel> {
    pub(super) limits: &'a Limits,
    pub(super) mean: Mean,
    pub(super) estimates: &'a mut [Estimate<C::Sample>],
}

type At<'a, C, F> = Block<'a, C, F, Carried<<C as ColorModel>::Sample>>;
type Out<'a, C> = Outcome<'a, C, Segment<C>, Carried<<C as ColorModel>::Sample>>;

impl<C: ColorModel> Shading<C, Carried<C::Sample>> for Surfaces<'_, C> {
    type Shadow = Segment<C>;

    #[inline(always)]
    fn shade<F: Lanes>(&mut self, block: &At<'_, C, F>, out: &mut Out<'_, C>) {
        let surface = block.material.surface(&block.at, block.wavelengths);
        if block.material.is_smooth() {
            self.light(block, &surface, out);
        }
        self.way(block, &surface, out);
    }
}

impl<C: ColorModel> Surfaces<'_, C> {
    /// Draws light toward the points of paths that may be longer by one edge.
    #[inline(always)]
    fn light<F: Lanes>(
        &self,
        block: &At<'_, C, F>,
        surface: &Surface<'_, C, F>,
        out: &mut Out<'_, C>,
    ) {
        let numbers = block.decisions(LIGHT);
        let (u2, u1) = (numbers.u2(), numbers.u1());
        let (at, w) = (&block.at, block.wavelengths);
        let light = block.scene.sample_lights(at, u1, u2, w);
        let wo = at.frame.to_local(light.direction);
        let value = surface.eval(wo);
        let contribution = block.throughput * value.value * light.radiance;
        let lit = at.active & F::zero().lt(light.pdf) & !contribution.is_black();
        let lit = lit & !self.ends(block, lit);
        if !lit.any() {
            return;
        }
        let values = contribution.rows();
        let (light_pdfs, pdfs) = (light.pdf.row(), value.pdf.row());
        let (normals, directions) = (at.normal.rows(), light.direction.rows());
        let delta = light.delta.to_bits();
        out.ask(block, &light, lit, |lane| {
            let path = block.walker(lane);
            let boundary = block.scene.boundary(block.hit(lane));
            let normal = Vec3::<F>::of(&normals, lane);
            let direction = Vec3::<F>::of(&directions, lane);
            Segment {
                value: C::Columns::<F>::of(&values, lane),
                light_pdf: light_pdfs[lane],
                other_pdf: match delta >> lane & 1 {
                    0 => pdfs[lane],
                    _ => 0.0,
                },
                medium: boundary.map_or(path.media.medium, |b| b.beyond(normal, direction)),
                ..Segment::of(path)
            }
        });
    }

    /// Of some paths those that may not become a bounce longer.
    #[inline(always)]
    fn ends<F: Lanes>(&self, block: &At<'_, C, F>, paths: F::Mask) -> F::Mask {
        let mut ends = 0_u32;
        for lane in paths.lanes() {
            let longer = block.walker(lane).media.depth.saturating_add(1);
            ends |= u32::from(longer >= self.limits.max_depth) << lane;
        }
        F::Mask::from_bits(ends)
    }

    /// Turns the paths.
    #[inline(always)]
    fn way<F: Lanes>(
        &mut self,
        block: &At<'_, C, F>,
        surface: &Surface<'_, C, F>,
        out: &mut Out<'_, C>,
    ) {
        let (at, numbers) = (&block.at, block.decisions(WAY));
        let sample = surface.sample(numbers.lobe(surface), numbers.u2());
        for lane in (at.active & !(sample.drawn & sample.null)).lanes() {
            self.estimates[block.walker(lane).slot as usize].alpha = 1.0;
        }
        let eta = block.eta() * sample.eta;
        let throughput = block.throughput * sample.weight;
        let lives = sample.drawn & at.active & !throughput.is_black();
        // Where a path is scattered, and not merely let pass, it is a bounce longer.
        let longer = lives & !sample.null;
        let mut plays = 0_u32;
        for lane in longer.lanes() {
            let depth = block.walker(lane).media.depth;
            plays |= u32::from(self.limits.plays(depth)) << lane;
        }
        // Whoever does not play is not looked up.
        let densities = C::Columns::<F>::from_samples(|lane| match plays >> lane & 1 {
            0 => C::Sample::zero(),
            _ => block.walker(lane).media.density,
        });
        let plays = F::Mask::from_bits(plays);
        let (survives, throughput) = self
            .mean
            .roulette(plays, throughput, densities, eta, &numbers);
        let lives = lives & survives & !self.ends(block, longer);
        if !lives.any() {
            return;
        }
        let ways = Ways {
            lives,
            wo: sample.wo,
            throughput,
            eta,
            pdf: sample.pdf,
            delta: sample.delta,
            light_share: 1.0,
        };
        let (normals, pdfs, null) = (at.normal.rows(), sample.pdf.row(), sample.null.to_bits());
        out.send_changed(block, &ways, |lane, direction, path: &mut Path<C>| {
            let before = block.walker(lane);
            let pdf = pdfs[lane];
            if null >> lane & 1 == 1 {
                // Light sampling would have come as far, and passed without a choice.
                path.scattered = before.scattered;
                path.media.asked = over(path.media.asked, pdf);
            } else {
                path.media.depth += 1;
                path.media.asked = over(path.media.density, pdf);
            }
            if let Some(boundary) = block.scene.boundary(block.hit(lane)) {
                let normal = Vec3::<F>::of(&normals, lane);
                path.media.medium = boundary.beyond(normal, direction);
            }
        });
    }
}
