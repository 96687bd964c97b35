#!/usr/bin/env bash
# Mitsuba 3.9.1 (PyPI), `<rotate>` with an axis that is not of unit length: what does it do to lengths?
#
# One would guess that the axis is a direction, and its length of no account. Seen: the axis is not normalised, so that the matrix is
# no rotation, and a rectangle's area changes without a word.
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
SHAPE = '<scene version="3.0.0"><shape type="rectangle"><transform name="to_world"><rotate {} angle="40"/></transform></shape></scene>'
area = lambda axis: float(mi.load_string(SHAPE.format(axis)).shapes()[0].surface_area())
unit, diagonal = area('x="0.70710678" y="0.70710678"'), area('x="1" y="1"')
print("Mitsuba", mi.__version__)
print(f'axis of length 1:                 area {unit:.4f}')
print(f'the same direction, x="1" y="1":  area {diagonal:.4f}')
seen = abs(diagonal / unit - 1) > 0.01
print("seen: the length of the axis changes the shape" if seen else "changed: only the axis's direction counts")
sys.exit(not seen)
PYTHON
