#!/usr/bin/env python3
"""Writes tests/golden/compare/metrics.json: what NumPy, scikit-image, flip-evaluator and ztest.py say of ten
pairs of images, for tests/it/compare.rs to hold `etendue::compare` against. The images are made here and
there by the same arithmetic.

Needs numpy, scikit-image and flip-evaluator==1.7; ztest.py is looked for in ../shared/tools.
"""
import json
import sys
from pathlib import Path

import flip_evaluator
import numpy as np
from skimage.metrics import structural_similarity

TOP = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(TOP.parent / 'shared/tools'))
from ztest import ztest  # noqa: E402

TINT = np.array([1.0, 0.7, 0.4])
PAIRS = [('gradient', 'brighter', 64, 48), ('gradient', 'noisy', 64, 48), ('checker', 'offset', 64, 48),
         ('checker', 'shifted', 64, 48), ('noise', 'noisy', 64, 48), ('noise', 'brighter', 64, 48),
         ('light', 'noisy', 64, 48), ('light', 'shifted', 64, 48), ('hill', 'firefly', 40, 33),
         ('hill', 'noisy', 33, 70)]


def mix(x):
    """`math::random::mix`."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xbf58476d1ce4e5b9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94d049bb133111eb)
    return x ^ (x >> np.uint64(31))


def noise(seed, x, y, width):
    index = np.uint64(seed << 40) + (y * width + x).astype(np.uint64)[..., None] * np.uint64(3)
    return (mix(index + np.arange(3, dtype=np.uint64)) >> np.uint64(40)) / 2.0 ** 24


def pattern(name, x, y, width, height):
    u, v = ((x + 0.5) / width)[..., None], ((y + 0.5) / height)[..., None]
    if name == 'gradient':
        return 2 * u * TINT
    if name == 'checker':
        return ((x // 8 + y // 8) % 2)[..., None] * (0.8 * TINT) + 0.1
    if name == 'noise':
        return noise(1, x, y, width)
    if name == 'light':
        return np.where((u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5) < 0.04, 30, 0.05 + 0.3 * v) * TINT
    if name == 'hill':
        return 16 * u * (1 - u) * v * (1 - v) * TINT
    raise ValueError(name)


def images(name, change, width, height):
    y, x = np.mgrid[:height, :width]
    a = pattern(name, x, y, width, height)
    if change == 'brighter':
        b = a * 1.1
    elif change == 'offset':
        b = a + 0.02
    elif change == 'noisy':
        b = a * (0.5 + noise(2, x, y, width))
    elif change == 'shifted':
        b = pattern(name, np.minimum(x + 1, width - 1), y, width, height)
    elif change == 'firefly':
        b = a.copy()
        b[height // 2, width // 2] = 100
    return a.astype(np.float32), b.astype(np.float32)


def encode(x):
    x = np.clip(x.astype(np.float64), 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055).astype(np.float32)


def figures(a32, b32):
    a, b = a32.astype(np.float64), b32.astype(np.float64)
    d = b - a
    mse = (d ** 2).mean()

    def flip(x, y, range):
        return float(flip_evaluator.evaluate(x, y, range, applyMagma=False)[1])
    return dict(
        bias=np.abs(d.mean((0, 1))).max(), max=np.abs(d).max(), mae=np.abs(d).mean(), mse=mse,
        rmse=np.sqrt(mse), relmse=(d ** 2 / (a ** 2 + 0.01)).mean(), mape=(np.abs(d) / (np.abs(a) + 0.01)).mean(),
        smape=(2 * np.abs(d) / (np.abs(a) + np.abs(b) + 0.01)).mean(), psnr=10 * np.log10(1 / mse),
        ssim=structural_similarity(a, b, channel_axis=2, data_range=1.0),
        flip_ldr=flip(encode(a32), encode(b32), 'LDR'), flip_hdr=flip(a32, b32, 'HDR'))


def main():
    table = []
    for pair in PAIRS:
        a, b = images(*pair)
        # The reference itself as the variance, and two numbers of samples.
        z, _ = ztest(b.astype(float), 64, a.astype(float), a.astype(float), 4000)
        table.append(dict(name=' '.join(map(str, pair)), metrics=figures(a, b),
                          ztest={k: z[k] for k in ('passed', 'accepted', 'gain', 'gain_se', 'z_rms', 'z_max',
                                                   'z_threshold', 'not_finite')}))
    path = TOP / 'tests/golden/compare/metrics.json'
    path.write_text(json.dumps(table, indent=1, default=float) + '\n')


if __name__ == '__main__':
    main()
