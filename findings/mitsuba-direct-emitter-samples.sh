#!/usr/bin/env bash
# Mitsuba 3.9.1 (PyPI), integrator `direct`: does the image's brightness depend on `emitter_samples`?
#
# One would guess that more samples of the lights make less noise and the same mean. Seen: in a scene lit by one point light the
# mean is proportional to the number of light samples, although a point light leaves nothing to chance.
#
# Needs Python 3 with venv, and the network for pip. Exits with 0 while this is so, with 1 once it has changed.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import sys
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
SCENE = """<scene version="3.0.0">
<integrator type="direct"><integer name="emitter_samples" value="{}"/><integer name="bsdf_samples" value="1"/></integrator>
<sensor type="orthographic"><transform name="to_world"><lookat origin="0,0,3" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film>
<sampler type="independent"><integer name="sample_count" value="64"/></sampler></sensor>
<emitter type="point"><point name="position" value="0,0,2"/><rgb name="intensity" value="10"/></emitter>
<shape type="rectangle"><bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape></scene>"""
means = {n: float(np.array(mi.render(mi.load_string(SCENE.format(n)))).mean()) for n in (1, 2, 4)}
print("Mitsuba", mi.__version__)
for n, mean in means.items():
    print(f"emitter_samples {n}: mean {mean:.4f}, {mean / means[1]:.3f} of that with one")
seen = all(abs(means[n] / means[1] - 1) > 0.05 for n in (2, 4))
print("seen: the mean depends on the number of samples" if seen else "changed: the mean no longer depends on it")
sys.exit(not seen)
PYTHON
