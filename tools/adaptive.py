#!/usr/bin/env python3
"""What adaptive sampling saves, and whether it biases the mean.

  saves: for each scene, uniform renders at rising samples a pixel and adaptive ones at falling noise thresholds,
         several seeds each, against a reference of many samples. Printed is the share of a uniform budget's samples
         that the adaptive one needs for the same error, interpolated between the uniform renders.
  bias:  for each scene, the image means of many adaptive renders against those of uniform ones of the same size,
         with Welch's 95 % interval of the relative difference.

Needs numpy and OpenEXR (tools/venv).
"""
import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR

LUMINANCE = np.array([0.212671, 0.715160, 0.072169])


def read(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name: c.pixels for name, c in file.channels().items()}
    return np.dstack([channels[c].astype(np.float64) for c in 'RGB'])


def render(a, scene, seed, *arguments):
    """The image and the mean number of samples."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / 'image.exr'
        command = [a.etendue, 'render', str(scene), '-o', str(out), '--seed', str(seed), '--json', '--quiet',
                   '--sampler', a.sampler, *arguments]
        if '--noise-threshold' in arguments:
            command += ['--max-spp', str(a.max_spp)]
        if a.size:
            command += ['--size', a.size]
        report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        spp = report['adaptive']['mean_spp'] if 'adaptive' in report else report['spp']
        return read(out), spp


def errors(images, reference):
    """MSE, and MSE in proportion to luminance."""
    squares = np.mean([((image - reference) ** 2).mean(-1) for image in images], 0)
    return np.array([squares.mean(), (squares / np.maximum(reference @ LUMINANCE, 0.01)).mean()])


def saves(a, scene):
    reference, _ = render(a, scene, 10 ** 6, '--spp', str(a.reference))
    seeds = range(a.seeds)
    uniform = []
    for spp in a.uniform:
        runs = [render(a, scene, seed, '--spp', str(spp)) for seed in seeds]
        uniform.append((runs[0][1], errors([image for image, _ in runs], reference)))
    print(f'{Path(scene).name}, {a.sampler}')
    for spp, error in uniform:
        print(f'  uniform  {spp:8.1f} spp   MSE {error[0]:.3e}   MSE/L {error[1]:.3e}')
    for threshold in a.thresholds:
        runs = [render(a, scene, seed, '--noise-threshold', str(threshold)) for seed in seeds]
        spp = np.mean([spp for _, spp in runs])
        error = errors([image for image, _ in runs], reference)
        shares = []
        for i in range(2):
            log = np.log([[n, e[i]] for n, e in uniform])
            order = np.argsort(log[:, 1])
            inside = log[:, 1].min() <= np.log(error[i]) <= log[:, 1].max()
            needed = np.exp(np.interp(np.log(error[i]), log[order, 1], log[order, 0]))
            shares.append(f'{spp / needed:6.2f}' if inside else 'beyond')
        print(f'  adaptive {spp:8.1f} spp   MSE {error[0]:.3e}   MSE/L {error[1]:.3e}   of uniform\'s samples:'
              f' {shares[0]} by MSE, {shares[1]} by MSE/L   (threshold {threshold})', flush=True)


def bias(a, scene):
    def means(*arguments, first):
        runs = [render(a, scene, first + seed, *arguments) for seed in range(a.seeds)]
        return np.array([(image @ LUMINANCE).mean() for image, _ in runs]), np.mean([spp for _, spp in runs])
    for threshold in a.thresholds:
        adaptive, spp = means('--noise-threshold', str(threshold), first=0)
        uniform, _ = means('--spp', str(a.reference), first=10 ** 6)
        va, vb = adaptive.var(ddof=1) / len(adaptive), uniform.var(ddof=1) / len(uniform)
        difference = (adaptive.mean() - uniform.mean()) / uniform.mean()
        half = 1.98 * np.sqrt(va + vb) / uniform.mean()
        verdict = 'contains 0' if abs(difference) <= half else 'DOES NOT CONTAIN 0'
        print(f'{Path(scene).name}, {a.sampler}, threshold {threshold} ({spp:.1f} spp), {a.seeds} seeds:'
              f' {difference:+.4%} ± {half:.4%}, {verdict}', flush=True)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument('what', choices=['saves', 'bias'])
    p.add_argument('scenes', nargs='+')
    p.add_argument('--etendue', default='target/release/etendue')
    p.add_argument('--sampler', default='independent')
    p.add_argument('--seeds', type=int, default=4)
    p.add_argument('--size', help='WIDTHxHEIGHT')
    p.add_argument('--reference', type=int, default=16384, help='samples a pixel of reference or uniform renders')
    p.add_argument('--uniform', type=int, nargs='+', default=[16, 32, 64, 128, 256, 512])
    p.add_argument('--thresholds', type=float, nargs='+', default=[0.08, 0.04, 0.02])
    p.add_argument('--max-spp', type=int, default=1024)
    a = p.parse_args()
    for scene in a.scenes:
        (saves if a.what == 'saves' else bias)(a, scene)


if __name__ == '__main__':
    main()
