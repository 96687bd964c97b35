#!/usr/bin/env python3
"""Étendue's bands beside the channels of Mitsuba's `specfilm`, and its RGB beside Mitsuba's.

  bands.py SCENE... [--etendue target/release/etendue] [--bands 8,16,31] [--seeds 8] [--spp 64] [--mitsuba-spp 256]
           [--size 64x48] [--variant llvm_ad_spectral]

Both sides render each scene with several seeds. Of each band the mean over the image is compared, by Welch's test and by
its relative difference; bands below 1 % of the brightest are not told. Needs Python with mitsuba 3.9.1, numpy and OpenEXR,
as tools/venv makes it, and for the llvm variants LLVM. Exit status 0 where all bands agree within 0.5 % or 3.5 standard
errors, 1 where one does not.
"""
import argparse, subprocess, sys, tempfile
from pathlib import Path
from xml.etree import ElementTree

FIRST, LAST = 360.0, 830.0


def etendue(program, scene, size, bands, spp, seed, folder):
    import OpenEXR, numpy as np
    out = folder / 'ours.exr'
    subprocess.run([program, 'render', str(scene), '-o', str(out), '--size', size, '--bands', str(bands), '--spp', str(spp),
                    '--seed', str(seed), '--quiet'], check=True)
    with OpenEXR.File(str(out), separate_channels=True) as f:
        channels = {name: c.pixels.astype(np.float64).mean() for name, c in f.channels().items()}
    names = sorted(n for n in channels if n.startswith('S0.'))
    return np.array([channels[n] for n in 'RGB']), np.array([channels[n] for n in names])


def mitsubas(mi, scene, size, bands, folder):
    """The scene with a film of bands, and with one of RGB."""
    width, height = size.split('x')
    mi.file_resolver().prepend(str(scene.parent))
    scenes = []
    for plugin in ('hdrfilm', 'specfilm'):
        root = ElementTree.parse(scene).getroot()
        for sensor in root.iter('sensor'):
            for film in sensor.findall('film'):
                filters = film.findall('rfilter')
                film.clear()
                film.set('type', plugin)
                for name, value in (('width', width), ('height', height)):
                    ElementTree.SubElement(film, 'integer', name=name, value=value)
                ElementTree.SubElement(film, 'string', name='component_format', value='float32')
                film.extend(filters)
                if plugin == 'hdrfilm':
                    ElementTree.SubElement(film, 'string', name='pixel_format', value='rgb')
                    continue
                for i in range(bands):
                    edge = [FIRST + (LAST - FIRST) * k / bands for k in (i, i + 1)]
                    band = ElementTree.SubElement(film, 'spectrum', name=f'band{i:02}', type='regular')
                    for name, value in zip(('wavelength_min', 'wavelength_max'), edge):
                        ElementTree.SubElement(band, 'float', name=name, value=repr(value))
                    ElementTree.SubElement(band, 'string', name='values', value='1, 1')
        file = folder / f'{plugin}.xml'
        ElementTree.ElementTree(root).write(file)
        scenes.append(mi.load_file(str(file)))
    return scenes


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument('scenes', nargs='+', type=Path)
    p.add_argument('--etendue', default='target/release/etendue')
    p.add_argument('--bands', default='8,16,31')
    p.add_argument('--seeds', type=int, default=8)
    p.add_argument('--spp', type=int, default=64)
    p.add_argument('--mitsuba-spp', type=int, default=256)
    p.add_argument('--size', default='64x48')
    p.add_argument('--variant', default='llvm_ad_spectral')
    a = p.parse_args()
    import numpy as np
    import mitsuba as mi
    mi.set_variant(a.variant)
    mi.set_log_level(mi.LogLevel.Error)
    failed = False
    for scene in a.scenes:
        for bands in map(int, a.bands.split(',')):
            with tempfile.TemporaryDirectory() as folder:
                folder = Path(folder)
                rgb, spectral = mitsubas(mi, scene.resolve(), a.size, bands, folder)
                ours, theirs = [], []
                for seed in range(a.seeds):
                    ours.append(np.concatenate(etendue(a.etendue, scene, a.size, bands, a.spp, seed, folder)))
                    images = [np.array(mi.render(s, spp=a.mitsuba_spp, seed=seed)).astype(np.float64) for s in (rgb, spectral)]
                    width = (LAST - FIRST) / bands
                    theirs.append(np.concatenate([images[0][..., :3].mean((0, 1)), images[1].mean((0, 1)) / width]))
            sides = [np.array(side) for side in (ours, theirs)]
            means = [side.mean(0) for side in sides]
            error = np.sqrt(sum(side.var(0, ddof=1) / a.seeds for side in sides))
            difference = means[0] / np.where(means[1], means[1], 1) - 1
            z = np.abs(means[0] - means[1]) / np.where(error, error, 1)
            told = np.concatenate([np.ones(3, bool), means[1][3:] > 0.01 * means[1][3:].max()])
            wrong = told & (np.abs(difference) > 0.005) & (z > 3.5)
            failed |= bool(wrong.any())
            worst = np.argmax(np.where(told[3:], np.abs(difference[3:]), 0)) + 3
            # What is left of a difference that noise does not explain.
            surely = np.where(told, np.maximum(np.abs(difference) - 2 * error / np.abs(means[1]), 0), 0).max()
            print(f"{'FAIL' if wrong.any() else 'pass'}  {scene.name:24} {bands:2} bands: {told[3:].sum()} told, largest difference "
                  f"{100 * difference[worst]:+.2f} % ± {100 * error[worst] / means[1][worst]:.2f}, rms z {np.sqrt((z[told] ** 2).mean()):.2f}, "
                  f"beyond two standard errors {100 * surely:.2f} %; RGB {', '.join(f'{100 * d:+.2f} %' for d in difference[:3])}",
                  flush=True)
    return failed


if __name__ == '__main__':
    sys.exit(main())
