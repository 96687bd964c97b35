#!/usr/bin/env python3
"""Writes scenes/smoke.vol, a plume: needs NumPy. The same file each time.

  tools/smoke.py [OUT.vol]
"""
import struct
import sys
from pathlib import Path

import numpy as np

SIZE = (32, 32, 48)  # cells along x, y and z, which is up


def noise(shape, cells, rng):
    """Numbers in [-1, 1] at `cells` a side, linear between them."""
    values = rng.uniform(-1, 1, [c + 2 for c in cells])
    axes = [np.linspace(0, c, n, endpoint=False) for n, c in zip(shape, cells)]
    grids = np.meshgrid(*axes, indexing="ij")
    low = [g.astype(int) for g in grids]
    part = [g - l for g, l in zip(grids, low)]
    part = [p * p * (3 - 2 * p) for p in part]
    total = np.zeros(shape)
    for corner in range(8):
        bits = [corner >> axis & 1 for axis in range(3)]
        weight = np.prod([p if b else 1 - p for p, b in zip(part, bits)], axis=0)
        total += weight * values[tuple(l + b for l, b in zip(low, bits))]
    return total


def plume():
    rng = np.random.default_rng(7)
    octaves = [noise(SIZE, [n * s // 32 for s in SIZE], rng) / n for n in (4, 8, 16)]
    rough = 4 * sum(octaves)
    x, y, z = np.meshgrid(*[(np.arange(n) + 0.5) / n for n in SIZE], indexing="ij")
    wind = 0.18 * np.sin(4 * z) * z
    radius = np.hypot(x - 0.5 - wind, y - 0.5) / (0.10 + 0.28 * z)
    density = np.clip(1.2 - radius + 0.9 * rough, 0, 1) * np.clip(8 * z, 0, 1) * np.clip(4 * (1 - z), 0, 1)
    edge = np.minimum.reduce([x, y, 1 - x, 1 - y])
    return density * np.clip(12 * edge, 0, 1)


def main():
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent.parent / "scenes/smoke.vol"
    values = plume().astype("<f4").transpose(2, 1, 0)  # x fastest
    head = b"VOL\x03" + struct.pack("<5i6f", 1, *SIZE, 1, 0, 0, 0, 1, 1, 1)
    out.write_bytes(head + values.tobytes())


if __name__ == "__main__":
    main()
