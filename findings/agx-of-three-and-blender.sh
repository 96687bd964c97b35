#!/usr/bin/env bash
# three.js 0.187.0 (npm) beside Blender 5.0.1 (the colour configuration in PyPI bpy, by OpenColorIO 2.6): do the two views called AgX
# show the same grey?
#
# One would guess so: three.js says that its AgX, by way of Filament, is based on Blender's implementation, and both cut the same
# 16.5 stops. Seen: middle grey, 0.18, is code 128 of 255 in three.js and 118 in Blender, where it stays as bright as it was; at 0.05
# three.js is 12 codes brighter, at 1 and above 5 to 6, and below 0.01 the two are the other way round. three.js has the first
# version's curve and a display of exponent 2.2; Blender's has had another curve and pivot since, and one of 2.4. A picture that was
# judged in one looks washed out in the other.
#
# Needs Python 3.9 or later, Node.js with npm, and the network for PyPI (0.4 GB) and npm. Exits with 0 while this is so, with 1 once
# it has changed.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
npm install --silent --no-audit --no-fund --prefix "$folder" three@0.187.0 >/dev/null
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check opencolorio==2.6.0 numpy==2.2.6
"$folder/venv/bin/pip" download --quiet --disable-pip-version-check --no-deps --only-binary=:all: --dest "$folder" \
    --python-version 3.11 --implementation cp --abi cp311 --platform manylinux_2_28_x86_64 bpy==5.0.1
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import glob
import re
import sys
import zipfile

import numpy as np
import PyOpenColorIO as ocio

with zipfile.ZipFile(glob.glob("bpy-*.whl")[0]) as wheel:
    wheel.extractall(".", [name for name in wheel.namelist() if "/colormanagement/" in name])
config = ocio.Config.CreateFromFile(glob.glob("bpy/*/datafiles/colormanagement/config.ocio")[0])
view = ocio.DisplayViewTransform("Linear Rec.709", "sRGB", "AgX")
processor = config.getProcessor(view).getDefaultCPUProcessor()

# Of greys, which its matrices leave alone, the shader is a logarithm, a polynomial and a power.
shader = open(glob.glob("node_modules/three/src/renderers/shaders/ShaderChunk/tonemapping_pars_fragment.glsl.js")[0]).read()
assert "Blender's implementation" in shader
number = r"(-?\s?[\d.]+)"
least, most = (float(re.search(rf"{name} = {number};", shader)[1].replace(" ", "")) for name in ("AgxMinEv", "AgxMaxEv"))
body = re.search(r"agxDefaultContrastApprox\( vec3 x \) \{(.*?)\n\}", shader, re.S)[1].split("return")[1]
terms = re.findall(r"([+-]) ([\d.]+)((?: \* x\d?)*)", body)
powers = [sum(int(digit or 1) for digit in re.findall(r"x(\d?)", factors)) for _, _, factors in terms]
factors = [float(sign + value) for sign, value, _ in terms]


def three(grey):
    x = np.clip((np.log2(grey) - least) / (most - least), 0, 1)
    linear = max(sum(factor * x**power for factor, power in zip(factors, powers)), 0) ** 2.2
    return 255 * (12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055)


print(f"three.js 0.187.0, Blender 5.0.1 by OpenColorIO {ocio.__version__}; codes of sRGB")
off = {}
for grey in [0.002, 0.01, 0.05, 0.18, 0.5, 1, 4]:
    shown = np.full((1, 3), grey, np.float32)
    processor.applyRGB(shown)
    off[grey] = three(grey) - 255 * shown[0, 0]
    print(f"  grey {grey:<6}  three.js {three(grey):6.1f}   Blender {255 * shown[0, 0]:6.1f}")
holds = off[0.18] > 9 and off[0.05] > 10 and off[1] > 4 and off[4] > 4 and off[0.002] < 0
print("as described" if holds else "this has changed")
sys.exit(not holds)
PYTHON
