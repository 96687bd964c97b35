#!/usr/bin/env bash
# Mitsuba 3.9.1 (PyPI), the shape `sdfgrid`: a ball in a grid whose three sizes are not the same.
#
# One would guess that the ball is met wherever the grid's samples show it: the documentation asks for a tensor of shape
# (depth, height, width, 1), without saying that the three are equal.
# Seen: of 500 rays through the ball all meet it in a grid of 8 x 8 x 8, and next to none in one of 4 x 6 x 8 or 6 x 8 x 8.
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


def met(sizes):
    """How many of 500 rays through a ball of radius 0.3 in the middle of the unit cube meet it."""
    axes = [np.linspace(0, 1, n) for n in sizes]
    z, y, x = np.meshgrid(*axes, indexing="ij")
    distance = np.sqrt((x - 0.5) ** 2 + (y - 0.5) ** 2 + (z - 0.5) ** 2) - 0.3
    grid = mi.TensorXf(distance[..., None].astype(np.float32))
    scene = mi.load_dict({"type": "scene", "ball": {"type": "sdfgrid", "grid": grid}})
    random, count = np.random.default_rng(1), 0
    for _ in range(500):
        way = random.normal(size=3)
        way /= np.linalg.norm(way)
        ray = mi.Ray3f((0.5 - 2 * way).tolist(), way.tolist())
        count += scene.ray_intersect(ray).is_valid()
    return count


print("Mitsuba", mi.__version__, "- rays of 500 through the middle of a ball that meet it")
even = met((8, 8, 8))
uneven = {sizes: met(sizes) for sizes in ((4, 6, 8), (8, 6, 4), (6, 8, 8))}
print("(8, 8, 8)", even, "expected: 500")
for sizes, count in uneven.items():
    print(sizes, count, "expected: 500")
seen = even == 500 and all(count < 50 for count in uneven.values())
print("seen: grids of unequal sizes are hardly met" if seen else "changed")
sys.exit(not seen)
PYTHON
