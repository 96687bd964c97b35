#!/usr/bin/env bash
# Mitsuba 3.9.1 (PyPI), texture `mesh_attribute`: is a mesh's number above 1 the same reflectance in all variants?
#
# One would guess that a reflectance is either clamped to 1 or not, whatever the variant. Seen: the RGB variant keeps the
# number 2 and multiplies it by `scale`; the spectral variant clamps the number to 1 first and multiplies then, so that the
# product may be above 1 all the same.
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


def reflectance(variant, number, scale):
    """The brightness of a wall, white under a white sky, whose vertices all have the number."""
    mi.set_variant(variant)
    properties = mi.Properties()
    texture = {"type": "mesh_attribute", "name": "vertex_color", "scale": scale}
    properties["mesh_bsdf"] = mi.load_dict({"type": "diffuse", "reflectance": texture})
    mesh = mi.Mesh("wall", 4, 2, props=properties)
    mesh.add_attribute("vertex_color", 3, [number] * 12)
    values = mi.traverse(mesh)
    values["vertex_positions"] = [-9, -9, 0, 9, -9, 0, 9, 9, 0, -9, 9, 0]
    values["faces"] = [0, 1, 2, 0, 2, 3]
    values.update()
    scene = mi.load_dict({
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2},
        "emitter": {"type": "constant"},
        "sensor": {
            "type": "perspective",
            "fov": 30,
            "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": 16, "height": 16, "pixel_format": "rgb"},
            "sampler": {"type": "independent", "sample_count": 256},
        },
        "wall": mesh,
    })
    return float(np.array(mi.render(scene))[..., 1].mean())


cases = [("scalar_rgb", 2.0, 0.5), ("scalar_spectral", 2.0, 0.5), ("scalar_rgb", 2.0, 2.0), ("scalar_spectral", 2.0, 2.0)]
seen = [reflectance(*case) for case in cases]
print("Mitsuba", mi.__version__)
for (variant, number, scale), value in zip(cases, seen):
    print(f"{variant}: number {number}, scale {scale}: reflects {value:.2f}")
expected = [1.0, 0.5, 4.0, 2.0]
same = all(abs(a / b - 1) < 0.05 for a, b in zip(seen, expected))
print("seen: RGB keeps the number, spectral clamps it before the scale" if same else "changed: not as described above")
sys.exit(not same)
PYTHON
