"""Emitter `ambient` for Mitsuba 3, as Étendue has it: `radiance` everywhere, from nowhere and never shadowed.

No direction leads to it, so that Mitsuba's own integrators see nothing of it; the integrator `phong` of
phong.py multiplies it by the `ambient_reflectance` of surfaces.

Set the variant, then import this file: it registers the emitter.
"""
import drjit as dr
import mitsuba as mi


class Ambient(mi.Emitter):
    """The I_a of Phong's equation."""

    is_ambient = True

    def __init__(self, props):
        mi.Emitter.__init__(self, props)
        self.radiance = props.get_emissive_texture('radiance', 1.0)
        self.m_flags = +mi.EmitterFlags.Empty

    def eval(self, si, active=True):
        """What it brings to a point: only the integrator `phong` asks."""
        return self.radiance.eval(si, active)

    def sample_direction(self, it, sample, active=True):
        return dr.zeros(mi.DirectionSample3f), mi.Spectrum(0)

    def pdf_direction(self, it, ds, active=True):
        return mi.Float(0)

    def eval_direction(self, it, ds, active=True):
        return mi.Spectrum(0)

    def bbox(self):
        return mi.ScalarBoundingBox3f()

    def traverse(self, callback):
        callback.put('radiance', self.radiance, mi.ParamFlags.Differentiable)

    def to_string(self):
        return 'Ambient[]'


mi.register_emitter('ambient', Ambient)
