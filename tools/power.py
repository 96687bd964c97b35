#!/usr/bin/env python3
"""How small an error does `etendue crosscheck` find? Renders the Cornell box with a known error against Mitsuba
without one, several times with other seeds, and prints how often it was found; the first row, without an
error, says how often one is found that is not there.

  tools/power.py [--size 96] [--spp 32] [--seeds 8,16] [--runs 10] [--etendue PATH] [-- OPTION...]

What follows -- goes to `etendue crosscheck`, such as --python PATH. Writes a Markdown table.
"""
import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent
SCENE = TOP / 'scenes/cornell-box.xml'


def gain(scene, values, factor):
    """The scene with an RGB triple made brighter."""
    assert scene.count(f'value="{values}"') == 1, values
    brighter = ', '.join(f'{float(v) * factor:.9g}' for v in values.split(','))
    return scene.replace(f'value="{values}"', f'value="{brighter}"')


def shift(scene, pixels, size):
    """The scene seen so many pixels to the side."""
    lens = '<float name="fov" value="36.2"/>'
    assert scene.count(lens) == 1
    return scene.replace(lens, f'{lens}<float name="principal_point_offset_x" value="{pixels / size:.9g}"/>')


def cases(scene, size):
    yield 'none', scene
    for percent in (0.5, 1, 2):
        yield f'light +{percent} %', gain(scene, '24, 18, 11', 1 + percent / 100)
    for percent in (0.5, 1, 2):
        yield f'white BSDF +{percent} %', gain(scene, '0.74, 0.73, 0.69', 1 + percent / 100)
    for percent in (0.5, 1, 2):
        yield f'red BSDF +{percent} %', gain(scene, '0.58, 0.06, 0.05', 1 + percent / 100)
    yield 'shift by 1/3 pixel', shift(scene, 1 / 3, size)


def crosscheck(a, faulty, seeds, first):
    """What the program says, as its JSON object."""
    command = [a.etendue, 'crosscheck', faulty, '--reference', SCENE, '--json', '--quiet', '--seeds', seeds,
               '--seed', first, '--spp', a.spp, '--size', f'{a.size}x{a.size}', *a.options]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode not in (0, 1) or not done.stdout:
        sys.exit(done.stdout + done.stderr)
    return json.loads(done.stdout)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument('--size', type=int, default=96)
    p.add_argument('--spp', type=int, default=32)
    p.add_argument('--seeds', type=lambda text: [int(n) for n in text.split(',')], default=[8, 16])
    p.add_argument('--runs', type=int, default=10)
    p.add_argument('--only', default='', help='cases whose name contains this')
    p.add_argument('--etendue', default=TOP / 'target/release/etendue')
    p.add_argument('options', nargs='*')
    a = p.parse_args()
    print('| error | seeds × samples | found | by the mean | by tiles | by pixels | interval | seconds a run |')
    print('|---|---|---|---|---|---|---|---|')
    with tempfile.TemporaryDirectory() as folder:
        for name, text in cases(SCENE.read_text(), a.size):
            if a.only not in name:
                continue
            faulty = Path(folder) / 'faulty.xml'
            faulty.write_text(text)
            for seeds in a.seeds:
                begin = time.monotonic()
                verdicts = [crosscheck(a, faulty, seeds, 1 + run * seeds)['verdict'] for run in range(a.runs)]
                seconds = (time.monotonic() - begin) / a.runs
                found = [sum(not v['agrees'] for v in verdicts),
                         sum(not all(m['agrees'] for m in v['means']) for v in verdicts),
                         sum(not v['tiles']['agrees'] for v in verdicts),
                         sum(not v['pixels']['agrees'] for v in verdicts)]
                width = sum(v['means'][0]['half_width'] for v in verdicts) / a.runs
                cells = [f'{n} of {a.runs}' for n in found]
                print(f'| {name} | {seeds} × {a.spp} | {" | ".join(cells)} | ± {width:.2%} | {seconds:.1f} |', flush=True)


if __name__ == '__main__':
    main()
