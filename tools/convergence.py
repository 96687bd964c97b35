#!/usr/bin/env python3
"""How fast do Étendue's samplers converge? Mean squared error against samples a pixel, with fitted slopes.

Each scene is rendered with every sampler at growing sample counts and several seeds, and compared with a
reference of many more samples. Printed are, for each count, the error of independent samples at that count
over the sampler's (above 1: it is better), and the slope of log error over log count, −1 for independent
samples. Counts that a sampler rounds up are taken as it rounds them.

Exit status: 0 stratified, poisson and sobol beat independent at every count on every scene, 1 one of them
does not, 2 something could not be rendered. Needs numpy and OpenEXR (tools/venv has them).
"""
import argparse
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
SCENES = [ROOT / 'scenes/zone-plate.xml', ROOT / 'scenes/soft-shadow.xml', ROOT / 'tools/convergence-lens.xml']
YARDSTICK = 'independent'
# In the order of the legend.
SAMPLERS = [YARDSTICK, 'grid', 'stratified', 'multijitter', 'orthogonal', 'poisson', 'ldsampler', 'sobol']
MUST_WIN = ['stratified', 'poisson', 'sobol']
COLORS = dict(zip(SAMPLERS, ['#222222', '#999999', '#1f77b4', '#17becf', '#9467bd', '#2ca02c', '#ff7f0e',
                             '#d62728']))


def read_exr(path):
    import OpenEXR
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return np.dstack([np.asarray(file.channels()[name].pixels, np.float64) for name in 'RGB'])


def render(a, scene, sampler, spp, seed, folder):
    """The image, and the samples a pixel that the sampler made of `spp`."""
    out = folder / 'image.exr'
    command = [a.etendue, 'render', str(scene), '-o', str(out), '--sampler', sampler, '--spp', str(spp),
               '--seed', str(seed), '--size', a.size, '--json', '--quiet']
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f'{scene.name} with {sampler}: {done.stderr.strip()}')
    return read_exr(out), json.loads(done.stdout)['spp']


def measure(a, scene, folder):
    """For each sampler the counts and their mean squared errors over pixels, channels and seeds."""
    reference = np.mean([render(a, scene, 'sobol', a.reference, 1000 + seed, folder)[0] for seed in range(2)], 0)
    errors = {}
    for sampler in a.samplers:
        rows = []
        for wanted in a.spp:
            images = [render(a, scene, sampler, wanted, seed, folder) for seed in range(1, a.seeds + 1)]
            error = np.mean([np.mean((image - reference) ** 2) for image, _ in images])
            rows.append((images[0][1], float(error)))
        errors[sampler] = sorted(set(rows))
    return errors


def slope(rows):
    """Of the line through log error over log count, by least squares; and the line's height at log 1."""
    x, y = np.log([n for n, _ in rows]), np.log([error for _, error in rows])
    return np.polyfit(x, y, 1)


def gains(errors):
    """The yardstick's error over each sampler's, at the sampler's own counts."""
    falling, height = slope(errors[YARDSTICK])
    expected = lambda n: math.exp(height + falling * math.log(n))
    return {sampler: [expected(n) / error for n, error in rows] for sampler, rows in errors.items()}


def report(scene, errors):
    won = True
    print(f'{scene}: error of independent samples / error, at the samples a pixel')
    for sampler, factors in gains(errors).items():
        cells = [f'{factor:7.2f} at {n:<5d}' for (n, _), factor in zip(errors[sampler], factors)]
        beaten = sampler in MUST_WIN and min(factors) <= 1
        won &= not beaten
        print(f'  {sampler:12s} slope {slope(errors[sampler])[0]:6.2f}  {"".join(cells)}'
              f'{"  no better than independent" if beaten else ""}')
    return won


def svg(results):
    """One log-log panel a scene."""
    width, height, margin = 360, 320, 56
    parts = []
    for panel, (scene, errors) in enumerate(results.items()):
        points = [p for rows in errors.values() for p in rows]
        x0, x1 = (f(math.log10(n) for n, _ in points) for f in (min, max))
        y0, y1 = (f(math.log10(e) for _, e in points) for f in (min, max))
        left = panel * (width + margin) + margin
        at = lambda n, e: (left + (math.log10(n) - x0) / (x1 - x0) * width,
                           margin + (y1 - math.log10(e)) / (y1 - y0) * height)
        parts.append(f'<rect x="{left}" y="{margin}" width="{width}" height="{height}" fill="none" stroke="#888"/>'
                     f'<text x="{left + width / 2}" y="{margin - 12}" text-anchor="middle" font-size="15">{scene}'
                     '</text>')
        for power in range(math.ceil(y0), math.floor(y1) + 1):
            y = at(10 ** x0, 10.0 ** power)[1]
            parts.append(f'<line x1="{left}" x2="{left + width}" y1="{y:.1f}" y2="{y:.1f}" stroke="#ddd"/>'
                         f'<text x="{left - 4}" y="{y + 4:.1f}" text-anchor="end">1e{power}</text>')
        for n in sorted({n for n, _ in errors[YARDSTICK]}):
            x = at(n, 10 ** y0)[0]
            parts.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{margin}" y2="{margin + height}" stroke="#ddd"/>'
                         f'<text x="{x:.1f}" y="{margin + height + 16}" text-anchor="middle">{n}</text>')
        for i, sampler in enumerate(errors):
            color = COLORS[sampler]
            line = ' '.join('{:.1f},{:.1f}'.format(*at(*p)) for p in errors[sampler])
            y = margin + height - 14 * (len(errors) - i) + 4
            parts.append(f'<polyline points="{line}" fill="none" stroke="{color}" stroke-width="1.8"/>'
                         f'<text x="{left + 8}" y="{y}" fill="{color}">{sampler}'
                         f' {slope(errors[sampler])[0]:.2f}</text>')
        parts.append(f'<text x="{left + width / 2}" y="{margin + height + 34}" text-anchor="middle">samples a pixel'
                     '</text>')
    size = (len(results) * (width + margin) + margin, height + 2 * margin)
    return ('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {} {}" font-family="sans-serif" font-size="11">'
            '<rect width="100%" height="100%" fill="white"/>{}</svg>\n'.format(*size, '\n'.join(parts)))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument('scenes', nargs='*', type=Path, help='scene files (a zone plate, soft shadows, a lens)')
    p.add_argument('--etendue', required=True, help='the binary')
    p.add_argument('--samplers', nargs='+', default=SAMPLERS, choices=SAMPLERS, metavar='NAME',
                   help=f'all of them by default; {YARDSTICK} is always measured')
    p.add_argument('--spp', type=int, nargs='+', default=[4, 16, 64, 256], help='samples a pixel (4 16 64 256)')
    p.add_argument('--seeds', type=int, default=4, help='renders of each kind (4)')
    p.add_argument('--reference', type=int, default=8192, help='samples a pixel of the two reference images (8192)')
    p.add_argument('--size', default='64x48', help='WIDTHxHEIGHT (64x48)')
    p.add_argument('--svg', type=Path, help='write the plot here')
    p.add_argument('--json', type=Path, help='write the figures here')
    a = p.parse_args()
    a.samplers = [name for name in SAMPLERS if name == YARDSTICK or name in a.samplers]
    results, won = {}, True
    with tempfile.TemporaryDirectory(prefix='convergence-') as folder:
        for scene in a.scenes or SCENES:
            try:
                errors = measure(a, scene, Path(folder))
            except (OSError, RuntimeError) as error:
                print(error)
                return 2
            results[scene.stem] = errors
            won &= report(scene.stem, errors)
            sys.stdout.flush()
    if a.svg:
        a.svg.write_text(svg(results))
    if a.json:
        a.json.write_text(json.dumps(results, indent=1) + '\n')
    return 0 if won else 1


if __name__ == '__main__':
    sys.exit(main())
