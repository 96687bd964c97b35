#!/usr/bin/env bash
# Mitsuba 3.9.1 (PyPI), the shape `ellipsoids`: a binary PLY file whose head says `format binary_big_endian 1.0`.
#
# One would guess that its numbers are read as the head says, or that the file is refused.
# Seen: the bytes are taken in the machine's own order, without a word, and the ellipsoids are anywhere or nowhere.
#
# Needs Python 3 with venv, and the network for pip. Exits with 0 while this is so, with 1 once it has changed.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.4.6
"$folder/venv/bin/python" - "$folder" <<'PYTHON'
import struct
import sys
import mitsuba as mi

mi.set_variant("scalar_rgb")
COLUMNS = "x y z nx ny nz scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split()
ROW = (1, 2, 3, 0, 0, 0, -1, -1, -1, 1, 0, 0, 0)  # a ball around (1, 2, 3)


def bounds(name, order):
    path = f"{sys.argv[1]}/{name}.ply"
    head = f"ply\nformat {name} 1.0\nelement vertex 1\n"
    head += "".join(f"property float {column}\n" for column in COLUMNS) + "end_header\n"
    with open(path, "wb") as file:
        file.write(head.encode() + struct.pack(f"{order}13f", *ROW))
    box = mi.load_dict({"type": "ellipsoids", "filename": path}).bbox()
    return [float(x) for x in (*box.min, *box.max)]


print("Mitsuba", mi.__version__, "- the box of a ball around (1, 2, 3)")
little, big = bounds("binary_little_endian", "<"), bounds("binary_big_endian", ">")
print("binary_little_endian:", little)
print("binary_big_endian:   ", big)
print("expected: the same")
seen = not all(abs(a - b) < 1e-3 for a, b in zip(little, big))
print("seen: another box" if seen else "changed: the same box")
sys.exit(not seen)
PYTHON
