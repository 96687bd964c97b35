#!/usr/bin/env bash
# Mitsuba 3.9.1 (PyPI), the emitter `timed_sunsky` with its default, simple sun: where is the sun seen?
#
# One would guess a disk of half a degree, and the sky alone elsewhere, as with `complex_sun` and with the emitter `sunsky`.
# Seen: the sun's radiance is there in every direction above the horizon, thousands of times the sky's.
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
from math import cos, pi, sin

mi.set_variant("scalar_rgb")


def darkest(**settings):
    """The least green radiance over directions all around, at 20, 50 and 90 degrees above the horizon."""
    emitter = mi.load_dict({"type": "timed_sunsky", "window_start_time": 7.0, "window_end_time": 19.0, **settings})
    least = float("inf")
    for height in (20, 50, 90):
        for turn in range(0, 360, 45):
            h, t = height * pi / 180, turn * pi / 180
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wi = -mi.Vector3f(cos(h) * cos(t), cos(h) * sin(t), sin(h))
            si.time = 0.5
            least = min(least, float(emitter.eval(si)[1]))
    return least


sky, simple, complex_sun = darkest(sun_scale=0.0), darkest(), darkest(complex_sun=True)
print("Mitsuba", mi.__version__, "- the darkest of 24 directions, in green")
print(f"without a sun:         {sky:.4f}")
print(f"complex_sun = true:    {complex_sun:.4f}")
print(f"complex_sun = false:   {simple:.4f}")
seen = simple > 100 * sky
print("seen: the simple sun is everywhere" if seen else "changed: the simple sun has its place")
sys.exit(not seen)
PYTHON
