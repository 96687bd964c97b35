#!/usr/bin/env bash
# Mitsuba 3.9.1 (PyPI), texture `checkerboard`: is it the same pattern whether it gives a colour or a number?
#
# One would guess that `color0` lies in the square at the origin in either case. Seen: as a number (a roughness, an opacity, a
# blend's weight) the two are exchanged: the square at the origin has `color1`.
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

mi.set_variant("scalar_rgb")
texture = mi.load_dict({"type": "checkerboard", "color0": 0.75, "color1": 0.25})
at = mi.SurfaceInteraction3f()
at.uv = mi.Point2f(0.1, 0.1)
color, number = texture.eval(at)[0], texture.eval_1(at)
print("Mitsuba", mi.__version__)
print(f"at uv (0.1, 0.1), color0 = 0.75, color1 = 0.25: as a colour {color:.2f}, as a number {number:.2f}")
seen = abs(color - 0.75) < 1e-3 and abs(number - 0.25) < 1e-3
print("seen: as a number the squares are exchanged" if seen else "changed: both are the same pattern now")
sys.exit(not seen)
PYTHON
