#!/usr/bin/env python3
"""Do Étendue and Mitsuba 3 render the same image of a scene? A statistical test with several seeds a side.

The scene is rendered with seeds 1 … N by `etendue render` and by Mitsuba's Python module. The images agree if

  1. no pixel is NaN or infinite;
  2. for luminance and each channel, the 99 % confidence interval of the relative difference of the image
     means contains 0 (Welch's t over the seeds);
  3. in no tile of 16 × 16 pixels do the means of a channel differ significantly (Welch's t over the seeds,
     Šidák-corrected for the number of tests, so that a scene fails by chance once in a hundred).

Half the width of the interval is printed: a difference below it would have gone unnoticed.
Exit status: 0 they agree, 1 they do not, 2 they could not be compared. Needs numpy, OpenEXR and mitsuba.
"""
import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

CONFIDENCE = 0.99
TILE = 16
LUMINANCE = np.array([0.212671, 0.715160, 0.072169])
# Differences that single-precision sums explain: a part of the mean in question, and of the image's mean.
ROUNDING, ROUNDING_OF_IMAGE = 1e-5, 1e-6


class CannotCompare(Exception):
    """One side gave no image, or not one of the other's size."""


# ---- Student's t -----------------------------------------------------------------------------------------

def incomplete_beta(a, b, x):
    """The regularised incomplete beta function I_x(a, b), by Lentz's continued fraction (DLMF 8.17.22)."""
    if x <= 0 or x >= 1:
        return float(x >= 1)
    if x > (a + 1) / (a + b + 2):
        return 1 - incomplete_beta(b, a, 1 - x)
    front = math.exp(math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
                     + a * math.log(x) + b * math.log1p(-x)) / a
    tiny = 1e-300
    c, d = 1.0, 1 - (a + b) * x / (a + 1)
    d = 1 / (d or tiny)
    fraction = d
    for m in range(1, 500):
        even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
        for term in (even, odd):
            d = 1 / ((1 + term * d) or tiny)
            c = (1 + term / c) or tiny
            fraction *= c * d
        if abs(c * d - 1) < 1e-14:
            break
    return front * fraction


def t_two_sided(t, df):
    """The probability that |T| exceeds |t| for Student's T with `df` degrees of freedom."""
    return incomplete_beta(df / 2, 0.5, df / (df + t * t))


def t_quantile(confidence, df):
    """The t that |T| stays below with probability `confidence`."""
    low, high = 0.0, 1.0
    while t_two_sided(high, df) > 1 - confidence:
        high *= 2
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if t_two_sided(middle, df) > 1 - confidence else (low, middle)
    return high


def welch(a, b, floor):
    """Difference of the means of b and a along axis 0, its standard error and Welch's degrees of freedom."""
    va, vb = a.var(0, ddof=1) / len(a), b.var(0, ddof=1) / len(b)
    spread = va ** 2 / (len(a) - 1) + vb ** 2 / (len(b) - 1)
    df = np.where(spread > 0, (va + vb) ** 2 / np.where(spread > 0, spread, 1), len(a) + len(b) - 2)
    return b.mean(0) - a.mean(0), np.sqrt(va + vb + floor ** 2), df


# ---- judging ---------------------------------------------------------------------------------------------

def compare_means(reference, ours):
    """Relative difference of the image means of luminance, R, G and B, each with its confidence interval."""
    def means(images):
        rgb = images.mean((1, 2))
        return np.column_stack([rgb @ LUMINANCE, rgb])
    a, b = means(reference), means(ours)
    mean = np.abs(a.mean(0))
    floor = ROUNDING * mean + ROUNDING_OF_IMAGE * mean[0]
    difference, error, df = welch(a, b, floor)
    rows = []
    for i, name in enumerate(['luminance', 'R', 'G', 'B']):
        scale = mean[i] or 1.0
        half = t_quantile(CONFIDENCE, df[i]) * error[i] / scale
        relative = difference[i] / scale
        rows.append(dict(channel=name, reference=a[:, i].mean(), ours=b[:, i].mean(), difference=relative,
                         half_width=half, agrees=bool(abs(relative) <= half)))
    return rows


def tile_means(images):
    """Means over tiles, shape (seeds, rows, columns, 3); tiles at the right and lower edge may be smaller."""
    starts = [np.arange(0, size, TILE) for size in images.shape[1:3]]
    sums = np.add.reduceat(np.add.reduceat(images, starts[0], axis=1), starts[1], axis=2)
    sizes = [np.diff(np.append(start, size)) for start, size in zip(starts, images.shape[1:3])]
    return sums / np.multiply.outer(*sizes)[None, :, :, None]


def compare_tiles(reference, ours):
    """The most different tile, and how many tiles differ significantly."""
    a, b = tile_means(reference), tile_means(ours)
    floor = ROUNDING * np.abs(a.mean(0)) + ROUNDING_OF_IMAGE * np.abs(a.mean())
    difference, error, df = welch(a, b, floor)
    t = difference / np.where(error > 0, error, 1)
    p = np.vectorize(t_two_sided, otypes=[float])(t, df)
    threshold = 1 - CONFIDENCE ** (1 / p.size)
    row, column, channel = np.unravel_index(np.argmin(p), p.shape)
    worst = (row, column, channel)
    mean = a.mean(0)[worst]
    return dict(tests=int(p.size), differing=int((p < threshold).any(-1).sum()), threshold=threshold,
                p=p[worst], t=t[worst], channel='RGB'[channel], x=int(column * TILE), y=int(row * TILE),
                difference=difference[worst] / mean if mean else difference[worst],
                agrees=bool(p[worst] >= threshold))


def judge(reference, ours):
    """Both image stacks (seeds, height, width, 3) against each other."""
    bad = [int((~np.isfinite(images)).sum()) for images in (reference, ours)]
    if any(bad):
        return dict(agrees=False, not_finite=dict(mitsuba=bad[0], etendue=bad[1]))
    means, tiles = compare_means(reference, ours), compare_tiles(reference, ours)
    return dict(agrees=all(m['agrees'] for m in means) and tiles['agrees'], means=means, tiles=tiles)


# ---- the two renderers -----------------------------------------------------------------------------------

def three_channels(image):
    """The first three channels as float64; a single one is taken for all."""
    image = np.asarray(image, np.float64)
    image = image[..., None] if image.ndim == 2 else image
    return np.repeat(image, 3, axis=2) if image.shape[2] < 3 else image[..., :3]


def read_exr(path):
    import OpenEXR
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    for names in ('RGB', 'Y'):
        if all(name in channels for name in names):
            return three_channels(np.dstack([channels[name] for name in names]))
    raise CannotCompare(f'{path} has the channels {", ".join(channels)}, not R, G, B')


def run(command, timeout):
    """Runs one renderer; its failure is told by its own last words."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors='replace', timeout=timeout)
    except subprocess.TimeoutExpired:
        raise CannotCompare(f'took more than {timeout:.0f} s') from None
    except OSError as error:
        raise CannotCompare(f'{command[0]}: {error.strerror}') from None
    if done.returncode:
        how = f'ended by signal {-done.returncode}' if done.returncode < 0 else f'status {done.returncode}'
        last = '\n'.join((done.stderr.strip() or done.stdout.strip() or 'no message').splitlines()[-8:])
        raise CannotCompare(f'{how}: {last}')


def render_etendue(a, folder):
    images, seconds = [], 0.0
    for seed in range(1, a.seeds + 1):
        out = folder / f'etendue-{seed}.exr'
        command = [a.etendue, 'render', str(a.scene), '-o', str(out), '--spp', str(a.spp), '--seed', str(seed),
                   '--quiet']
        if a.size:
            command += ['--size', '{}x{}'.format(*a.size)]
        for definition in a.define:
            command += ['-D', definition]
        start = time.monotonic()
        run(command, a.timeout)
        seconds += time.monotonic() - start
        images.append(read_exr(out))
    return np.stack(images), seconds


def render_mitsuba(a, folder):
    """In a process of its own, so that a crash there is a message here."""
    order = dict(scene=str(a.scene), spp=a.spp, seeds=a.seeds, size=a.size, variant=a.variant,
                 define=dict(d.split('=', 1) for d in a.define), out=str(folder / 'mitsuba.npy'))
    start = time.monotonic()
    run([sys.executable, __file__, '--worker', json.dumps(order)], a.timeout * a.seeds)
    return np.load(order['out']), time.monotonic() - start


def worker(order):
    """Mitsuba's side: renders all seeds and saves them as one array."""
    import mitsuba as mi
    mi.set_variant(order['variant'])
    scene = mi.load_file(order['scene'], **order['define'])
    sensor = scene.sensors()[0]
    if order['size']:
        parameters = mi.traverse(sensor)
        parameters['film.size'] = parameters['film.crop_size'] = order['size']
        parameters['film.crop_offset'] = [0, 0]
        parameters.update()
    images = [three_channels(np.array(mi.render(scene, sensor=sensor, spp=order['spp'], seed=seed)))
              for seed in range(1, order['seeds'] + 1)]
    np.save(order['out'], np.stack(images))
    # Nothing of the interpreter's way out is of interest, and Mitsuba has been seen to hang there.
    sys.stdout.flush()
    os._exit(0)


# ---- command line ----------------------------------------------------------------------------------------

def size(text):
    """`160` or `160x90`."""
    numbers = [int(n) for n in text.split('x')]
    if len(numbers) > 2 or min(numbers) < 1:
        raise ValueError
    return [numbers[0], numbers[-1]]


def definition(text):
    if '=' not in text:
        raise argparse.ArgumentTypeError(f'{text!r} is not of the form name=value')
    return text


def report(result):
    if 'not_finite' in result:
        count = result['not_finite']
        print(f"  not finite: {count['mitsuba']} values of Mitsuba's, {count['etendue']} of Étendue's")
        return
    print(f"  {'':10s} {'Mitsuba':>11s} {'Étendue':>11s} {'difference':>11s} {'± 99 %':>9s}")
    for row in result['means']:
        print(f"  {row['channel']:10s} {row['reference']:11.6g} {row['ours']:11.6g} {row['difference']:+11.3%}"
              f" {row['half_width']:9.3%}{'' if row['agrees'] else '  differs'}")
    tile = result['tiles']
    print(f"  tiles: {tile['differing']} differ; most: t = {tile['t']:+.2f}, p = {tile['p']:.2g} (limit"
          f" {tile['threshold']:.2g}), {tile['difference']:+.2%} in {tile['channel']} at pixel"
          f" {tile['x']}, {tile['y']}")


def main():
    if sys.argv[1:2] == ['--worker']:
        return worker(json.loads(sys.argv[2]))
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument('scene', type=Path)
    p.add_argument('--etendue', required=True, help='the binary')
    p.add_argument('--spp', type=int, default=64, help='samples per pixel and seed (64)')
    p.add_argument('--seeds', type=int, default=8, help='renders a side, at least 2 (8)')
    p.add_argument('--size', type=size, help='WIDTHxHEIGHT instead of the scene\'s')
    p.add_argument('-D', dest='define', action='append', default=[], type=definition, metavar='NAME=VALUE')
    p.add_argument('--variant', default='scalar_rgb', help='of Mitsuba (scalar_rgb)')
    p.add_argument('--precision', type=float, default=math.inf,
                   help='status 2 where the luminance interval\'s half width exceeds this, e.g. 0.01')
    p.add_argument('--timeout', type=float, default=120, help='seconds a render (120)')
    p.add_argument('--json', type=Path, help='write the figures here')
    a = p.parse_args()
    if a.seeds < 2:
        p.error('--seeds must be at least 2: the spread of the seeds is the yardstick')
    a.scene = a.scene.resolve()

    result = dict(scene=str(a.scene), spp=a.spp, seeds=a.seeds)
    status = 2
    print(f'{a.scene.parent.name}/{a.scene.name}: {a.seeds} seeds of {a.spp} samples a side', flush=True)
    with tempfile.TemporaryDirectory(prefix='agree-') as folder:
        side = 'Étendue'
        try:
            ours, seconds = render_etendue(a, Path(folder))
            side = 'Mitsuba'
            reference, mitsuba_seconds = render_mitsuba(a, Path(folder))
            side = 'images'
            if ours.shape != reference.shape:
                raise CannotCompare('{2}x{1} pixels from Étendue, {5}x{4} from Mitsuba'
                                    .format(*ours.shape[:3], *reference.shape[:3]))
            result.update(judge(reference, ours), seconds=dict(etendue=seconds, mitsuba=mitsuba_seconds))
            report(result)
            print(f'  seconds: {seconds:.1f} Étendue, {mitsuba_seconds:.1f} Mitsuba')
            status = 0 if result['agrees'] else 1
            if status == 0 and result['means'][0]['half_width'] > a.precision:
                raise CannotCompare(f'noisier than {a.precision:.3%}: take more samples or seeds')
        except CannotCompare as error:
            status = 2
            result['error'] = f'{side}: {error}'
            print(f'  {side}: {error}')
    print(['PASS', 'FAIL', 'NOT COMPARED'][status])
    if a.json:
        a.json.write_text(json.dumps(result, indent=1, default=float) + '\n')
    return status


if __name__ == '__main__':
    sys.exit(main())
