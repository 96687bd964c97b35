#!/usr/bin/env bash
# Mitsuba 3.9.1 (PyPI), texture `bitmap` as the radiance of an area light: how bright is a texel of (3, 0.6, 0.3)?
#
# One would guess the same in RGB and in spectral variants, as it is for <rgb>. Seen: in `scalar_rgb` the light is (3, 0.6,
# 0.3), in `scalar_spectral` about (1.17, 0.57, 0.27): the texel is clamped to [0, 1], becomes the spectrum of a reflectance,
# and is not multiplied by D65. And who hands over an `mi.Bitmap` finds it changed: its pixels are coefficients then, and
# the next texture made of it has other colours.
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

TEXEL = np.array([3, 0.6, 0.3], np.float32)


def light(variant, radiance):
    mi.set_variant(variant)
    mi.set_log_level(mi.LogLevel.Error)
    look = mi.ScalarTransform4f().look_at([0, 0, 2], [0, 0, 0], [0, 1, 0]).scale([0.01, 0.01, 1])
    scene = mi.load_dict({
        "type": "scene", "integrator": {"type": "path"},
        "sensor": {"type": "orthographic", "to_world": look,
                   "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}, "pixel_format": "rgb"},
                   "sampler": {"type": "independent", "sample_count": 16384}},
        "shape": {"type": "rectangle", "emitter": {"type": "area", "radiance": radiance()}}})
    return np.array(mi.render(scene)).ravel()


bitmap = lambda: {"type": "bitmap", "bitmap": mi.Bitmap(np.tile(TEXEL, (2, 2, 1)))}
rgb = lambda: {"type": "rgb", "value": [float(v) for v in TEXEL]}
results = {(v, n): light(v, r) for v in ("scalar_rgb", "scalar_spectral") for n, r in (("bitmap", bitmap), ("rgb", rgb))}
print("Mitsuba", mi.__version__)
for (variant, name), value in results.items():
    print(f"{name:6} in {variant:15} {value.round(2)}")
mine = mi.Bitmap(np.tile(TEXEL, (2, 2, 1)))
mi.load_dict({"type": "bitmap", "bitmap": mine})
changed = not np.allclose(np.array(mine)[..., :3], TEXEL)
print("a bitmap that was handed over is", "changed" if changed else "as it was")
alike = lambda a, b: np.allclose(a, b, rtol=0.05)
seen = (alike(results["scalar_rgb", "bitmap"], TEXEL) and alike(results["scalar_spectral", "rgb"], TEXEL)
        and results["scalar_spectral", "bitmap"][0] < 1.3 and changed)
print("seen: as light a bitmap is clamped and has no illuminant in spectral variants" if seen else "changed")
sys.exit(not seen)
PYTHON
