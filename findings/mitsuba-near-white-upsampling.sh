#!/usr/bin/env bash
# Mitsuba 3.9.1 (PyPI), spectral variants: an `rgb` colour that is nearly white, such as the albedo of milk or cloud.
#
# One would guess that (0.99, 0.999, 0.99) under D65 comes back to within a twentieth of what it absorbs, as (0.9, 0.95, 0.9)
# does.
# Seen: it comes back as (0.998, 0.998, 0.997): red and blue lose a fifth and a third of what was asked, green twice as much.
# That is 0.8 % in one bounce, and a factor of two after a hundred scatterings.
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

mi.set_variant("scalar_spectral")
STEP = 4  # wavelengths that are asked for at once
WAVELENGTHS = np.arange(360.0, 832.0)
XYZ_TO_SRGB = np.array([[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]])


def values(description):
    """The spectrum of a texture, nanometre by nanometre."""
    texture, found = mi.load_dict(description), []
    for first in range(0, len(WAVELENGTHS), STEP):
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.wavelengths = mi.Spectrum(WAVELENGTHS[first : first + STEP].tolist())
        found.extend(np.array(texture.eval(si)).ravel())
    return np.array(found)


observer = np.array([np.array(mi.cie1931_xyz(float(w))).ravel() for w in WAVELENGTHS])
daylight = values({"type": "d65"})
white = (observer[:, 1] * daylight).sum()


def back(rgb):
    """What a surface of that colour looks like under D65, as linear sRGB."""
    light = daylight * values({"type": "rgb", "value": rgb})
    return XYZ_TO_SRGB @ ((observer * light[:, None]).sum(axis=0) / white)


print("Mitsuba", mi.__version__, "- asked for, and what it is under D65: what is absorbed, of what was asked")
kept = {}
for rgb in ([0.999] * 3, [0.5, 0.55, 0.5], [0.9, 0.95, 0.9], [0.95, 0.99, 0.95], [0.99, 0.999, 0.99], [0.99, 0.99, 0.999]):
    found = back(rgb)
    kept[tuple(rgb)] = (1 - found) / (1 - np.array(rgb))
    print(rgb, np.round(found, 4), np.round(kept[tuple(rgb)], 2))
pale = all(abs(kept[rgb] - 1).max() < 0.05 for rgb in ((0.5, 0.55, 0.5), (0.9, 0.95, 0.9)))
near_white = kept[0.99, 0.999, 0.99]
seen = pale and near_white[0] < 0.5 and near_white[2] < 0.5
print("seen: a nearly white colour absorbs less than half of what was asked" if seen else "changed")
sys.exit(not seen)
PYTHON
