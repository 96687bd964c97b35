#!/usr/bin/env bash
# Mitsuba 3.9.1 (PyPI), scalar variants: the time of a ray that meets nothing.
#
# One would guess that the interaction of a missed ray carries the ray's time, as that of a ray that meets a surface does, and
# as in the llvm variants: an emitter all around, such as `timed_sunsky`, is asked with it.
# Seen: it is 0. With the shutter open at 0.5 a surface is lit by the sun of that time, before the sky of time 0.
#
# Needs Python 3 with venv, and the network for pip. Exits with 0 while this is so, with 1 once it has changed.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import sys
import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
# The sky alone: its simple sun is another matter.
sky = {"type": "timed_sunsky", "sun_scale": 0.0}
up = mi.ScalarTransform4f().look_at(origin=[0, 0, 4], target=[0, 0, 8], up=[0, 1, 0])


def rendered(time):
    """The green of the sky at the zenith."""
    sensor = {"type": "perspective", "fov": 0.1, "to_world": up, "shutter_open": time, "shutter_close": time,
              "film": {"type": "hdrfilm", "width": 4, "height": 4}}
    scene = {"type": "scene", "integrator": {"type": "path"}, "sky": sky, "sensor": sensor}
    return float(np.array(mi.render(mi.load_dict(scene), spp=4))[..., 1].mean())


def asked(time):
    """What the emitter says of it."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi, si.time = mi.Vector3f(0, 0, -1), time
    return float(mi.load_dict(sky).eval(si)[1])


scene = mi.load_dict({"type": "scene", "ball": {"type": "sphere"}})
times = {}
for name, direction in (("missed", [0, 0, 1]), ("met", [0, 0, -1])):
    ray = mi.Ray3f([0, 0, 4], direction)
    ray.time = 0.5
    times[name] = float(scene.ray_intersect(ray).time)
print("Mitsuba", mi.__version__, "- rays of time 0.5")
print("time of what was met:   ", times["met"])
print("time of what was missed:", times["missed"], "expected: 0.5")
for time in (0.0, 0.5):
    print(f"zenith at {time}: rendered {rendered(time):.5f}, expected {asked(time):.5f}")
seen = times["missed"] == 0 and rendered(0.5) < 0.5 * asked(0.5)
print("seen: missed rays have time 0" if seen else "changed")
sys.exit(not seen)
PYTHON
