"""BSDF `phong` and integrator `phong` for Mitsuba 3, as Étendue has them.

The BSDF is Mitsuba 0.6's (Lafortune and Willems, 1994): f = k_d/π + k_s·(n + 2)/2π·max(0, R·V)ⁿ from
`diffuse_reflectance` (0.5), `specular_reflectance` (0.2) and `exponent` (30), scaled where k_d + k_s passes 1;
`ambient_reflectance` (0) is what it returns of an `ambient` emitter's light. It runs in every variant.

The integrator evaluates I = I_a·k_a + Σ I_i·[k_d·max(0, L·N) + k_s·max(0, R·V)ⁿ] with a shadow ray to every
light and follows mirrors and clear boundaries, one ray at a time. It needs an `llvm_*` or `cuda_*` variant:
Mitsuba 3.9 cannot run integrators written in Python in `scalar_*`. Properties: `falloff` (`none`,
`inverse_square`), `shadows`, `max_depth`, `rr_depth`, `hide_emitters`; `layers` is read and does nothing.

Set the variant, then import this file: it registers both. Mitsuba keeps plugins of all kinds under one set of
names. So `phong` makes the integrator where it has one of the properties above, and the BSDF otherwise; an
integrator without any must give one (`falloff` `none`) or be called `phong_integrator`, as `etendue crosscheck`
does with all.
"""
import drjit as dr
import mitsuba as mi

# A bit of BSDFContext.type_mask that Mitsuba's own BSDFs do not know: asks for the textbook's terms over π.
TEXTBOOK = 1 << 30
STEPS = 16
INTEGRATOR = {'falloff', 'shadows', 'max_depth', 'rr_depth', 'hide_emitters', 'layers'}


def over_surface(*textures):
    """The sum of textures at points spread over texture coordinates."""
    values = []
    for i in range(STEPS * STEPS):
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.uv = mi.Point2f((i % STEPS + 0.5) / STEPS, (i // STEPS + 0.5) / STEPS)
        values.append(sum((texture.eval(si, True) for texture in textures), mi.Spectrum(0)))
    return values


def number(value):
    """A plain float of an array of one element."""
    return float(value) if dr.depth_v(value) == 0 else float(value[0])


class Phong(mi.BSDF):
    """The modified Phong model."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.ambient = props.get_texture('ambient_reflectance', 0.0)
        self.diffuse = props.get_texture('diffuse_reflectance', 0.5)
        self.specular = props.get_texture('specular_reflectance', 0.2)
        self.exponent = props.get_unbounded_texture('exponent', 30.0)
        largest = max(number(dr.max(v)) for v in over_surface(self.diffuse, self.specular))
        self.scale = 0.99 / largest if largest > 1 else 1.0
        diffuse, specular = (sum(number(dr.mean(v)) for v in over_surface(t)) for t in (self.diffuse, self.specular))
        self.specular_weight = specular / (diffuse + specular) if specular > 0 else 0.0
        front = mi.BSDFFlags.FrontSide
        self.m_components = [mi.BSDFFlags.GlossyReflection | front, mi.BSDFFlags.DiffuseReflection | front]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def lobe(self, si, wo, active):
        """max(0, R·V)ⁿ and n."""
        n = dr.maximum(self.exponent.eval_1(si, active), 0)
        cosine = dr.dot(mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z), wo)
        return dr.select(cosine > 0, dr.power(dr.minimum(dr.maximum(cosine, 1e-30), 1), n), 0), n

    def eval_pdf(self, ctx, si, wo, active=True):
        lit = active & (si.wi.z > 0) & (wo.z > 0)
        lobe, n = self.lobe(si, wo, lit)
        diffuse, specular = self.diffuse.eval(si, lit), self.specular.eval(si, lit)
        if ctx.type_mask & TEXTBOOK:
            value = (diffuse * wo.z + specular * lobe) * dr.inv_pi
        else:
            value = (diffuse * dr.inv_pi + specular * ((n + 2) * lobe / dr.two_pi)) * (self.scale * wo.z)
        w = self.specular_weight
        pdf = w * (n + 1) * lobe / dr.two_pi + (1 - w) * mi.warp.square_to_cosine_hemisphere_pdf(wo)
        return value & lit, dr.select(lit, pdf, 0)

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def sample(self, ctx, si, sample1, sample2, active=True):
        n = dr.maximum(self.exponent.eval_1(si, active), 0)
        cosine = dr.power(dr.maximum(1 - sample2.x, 1e-30), 1 / (n + 1))
        sine = dr.safe_sqrt(1 - cosine * cosine)
        y, x = dr.sincos(dr.two_pi * sample2.y)
        around = mi.Frame3f(mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z))
        glossy = around.to_world(mi.Vector3f(x * sine, y * sine, cosine))
        is_glossy = sample1 < self.specular_weight
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = dr.select(is_glossy, glossy, mi.warp.square_to_cosine_hemisphere(sample2))
        bs.eta = 1.0
        bs.sampled_component = dr.select(is_glossy, mi.UInt32(0), mi.UInt32(1))
        bs.sampled_type = dr.select(is_glossy, mi.UInt32(+mi.BSDFFlags.GlossyReflection),
                                    mi.UInt32(+mi.BSDFFlags.DiffuseReflection))
        value, pdf = self.eval_pdf(ctx, si, bs.wo, active)
        bs.pdf = pdf
        usable = pdf > 0
        return bs, (value / dr.select(usable, pdf, 1)) & usable

    def has_attribute(self, name, active=True):
        return name == 'ambient_reflectance'

    def eval_attribute(self, name, si, active=True):
        return self.ambient.eval(si, active & (si.wi.z > 0)) & (si.wi.z > 0)

    def eval_attribute_3(self, name, si, active=True):
        return mi.Color3f(self.eval_attribute(name, si, active))

    def eval_diffuse_reflectance(self, si, active=True):
        return self.diffuse.eval(si, active) * self.scale

    def traverse(self, callback):
        for name in ('ambient', 'diffuse', 'specular'):
            callback.put(f'{name}_reflectance', getattr(self, name), mi.ParamFlags.Differentiable)
        callback.put('exponent', self.exponent, mi.ParamFlags.Differentiable)

    def to_string(self):
        return f'Phong[scale={self.scale}]'


class PhongIntegrator(mi.SamplingIntegrator):
    """The textbook's equation."""

    def __init__(self, props):
        mi.SamplingIntegrator.__init__(self, props)
        depth = props.get('max_depth', -1)
        self.max_depth = depth if depth >= 0 else 0xffffffff
        self.rr_depth = props.get('rr_depth', 5)
        self.shadows = props.get('shadows', True)
        falloff = props.get('falloff', 'none')
        if falloff not in ('none', 'inverse_square'):
            raise ValueError(f'unknown falloff "{falloff}"; there are "none" and "inverse_square"')
        self.inverse_square = falloff == 'inverse_square'
        props.get('layers', '')

    def light(self, scene, sampler, emitter, bsdf, si, active):
        """One light's part of the sum."""
        ctx = mi.BSDFContext()
        ctx.type_mask = ctx.type_mask | TEXTBOOK
        ds, intensity = emitter.sample_direction(si, sampler.next_2d(active), active)
        active = active & (ds.pdf > 0)
        nowhere = mi.has_flag(emitter.flags(), mi.EmitterFlags.Infinite) \
            or mi.has_flag(emitter.flags(), mi.EmitterFlags.DeltaDirection)
        if not self.inverse_square and not nowhere:
            intensity = intensity * dr.square(ds.dist)
        terms = bsdf.eval(ctx, si, si.to_local(ds.d), active) * dr.pi
        value = (terms * intensity) & active
        if self.shadows:
            lit = active & dr.any(value != 0)
            value &= ~scene.ray_test(si.spawn_ray_to(ds.p), lit)
        return value

    @dr.syntax
    def sample(self, scene, sampler, ray, medium=None, active=True):
        emitters = scene.emitters()
        ambients = [e for e in emitters if getattr(e, 'is_ambient', False)]
        lights = [e for e in emitters if not getattr(e, 'is_ambient', False)]
        ctx = mi.BSDFContext()
        ray, active = mi.Ray3f(ray), mi.Bool(active)
        result, throughput = mi.Spectrum(0), mi.Spectrum(1)
        eta, depth, valid = mi.Float(1), mi.UInt32(0), mi.Bool(False)
        while active:
            si = scene.ray_intersect(ray, active)
            bsdf = si.bsdf(ray)
            emitter = si.emitter(scene, active)
            shown = active & ((depth > 0) | (not self.hide_emitters))
            result += throughput * emitter.eval(si, shown)
            valid |= (depth == 0) & (si.is_valid() | ((not self.hide_emitters) & (emitter != None)))
            active &= si.is_valid()
            if dr.hint(len(ambients) > 0, mode='scalar'):
                k = bsdf.eval_attribute_3('ambient_reflectance', si, active)
                for ambient in ambients:
                    result += throughput * (mi.Spectrum(k) * ambient.eval(si, active)) & active
            active &= depth + 1 < self.max_depth
            for light in lights:
                result += throughput * self.light(scene, sampler, light, bsdf, si, active)
            bs, weight = bsdf.sample(ctx, si, sampler.next_1d(active), sampler.next_2d(active), active)
            active &= mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
            throughput = dr.select(active, throughput * weight, throughput)
            eta = dr.select(active, eta * bs.eta, eta)
            ray = si.spawn_ray(si.to_world(bs.wo))
            most = dr.max(throughput)
            survival = dr.select(depth + 1 >= self.rr_depth, dr.minimum(most * dr.square(eta), 0.95), 1)
            active &= (most > 0) & (sampler.next_1d(active) < survival)
            throughput = throughput / dr.select(survival > 0, survival, 1)
            depth += 1
        return result, valid, []

    def to_string(self):
        return f'PhongIntegrator[inverse_square={self.inverse_square}, shadows={self.shadows}]'


def phong(props):
    """The integrator where a property is one of an integrator's, else the BSDF."""
    return PhongIntegrator(props) if INTEGRATOR.intersection(props.keys()) else Phong(props)


mi.register_bsdf('phong', phong)
mi.register_integrator('phong_integrator', PhongIntegrator)
