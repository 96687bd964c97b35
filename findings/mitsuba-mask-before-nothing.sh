#!/usr/bin/env bash
# Mitsuba 3.9.1 (PyPI), integrator `path`: how bright is a half transparent (`mask`) lit surface in front of nothing?
#
# One would guess the opacity times what the opaque surface shows: paths that are let through see black behind it. Seen: about the
# opacity squared. Light that a path has gathered at the surface is lost when the path goes on through it and leaves the scene.
# A black wall behind the surface, which ends these paths elsewhere, brings the light back.
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
SCENE = """<scene version="3.0.0"><integrator type="path"/>
<sensor type="orthographic"><transform name="to_world"><lookat origin="0,0,3" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/><rfilter type="box"/></film>
<sampler type="independent"><integer name="sample_count" value="1024"/></sampler></sensor>
<emitter type="directional"><vector name="direction" value="0,0,-1"/><rgb name="irradiance" value="3"/></emitter>
<shape type="rectangle"><bsdf type="mask"><float name="opacity" value="{}"/><bsdf type="diffuse"/></bsdf></shape>{}</scene>"""
WALL = """<shape type="rectangle"><transform name="to_world"><scale value="9"/><translate z="-1"/></transform>
<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf></shape>"""
mean = lambda opacity, behind: float(np.array(mi.render(mi.load_string(SCENE.format(opacity, behind)))).mean())
opaque, open_, walled = mean(1, ""), mean(0.25, ""), mean(0.25, WALL)
print("Mitsuba", mi.__version__)
print(f"opaque                              {opaque:.4f}")
print(f"opacity 0.25, a black wall behind   {walled / opaque:.3f} of that")
print(f"opacity 0.25, nothing behind        {open_ / opaque:.3f} of that")
seen = open_ / opaque < 0.15 and abs(walled / opaque - 0.25) < 0.02
print("seen: before nothing a quarter of the light is left of what a black wall leaves" if seen else "changed")
sys.exit(not seen)
PYTHON
