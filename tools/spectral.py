#!/usr/bin/env python3
"""Scenes of Mitsuba's own render test in bands, beside references that Mitsuba's spectral variant renders for it.

  spectral.py [--suite ../shared/data/mitsuba-data/tests/scenes] [--etendue target/release/etendue] [--bands 16] [--only REGEX]
              [--samples 8192] [--seconds 60] [--variant llvm_ad_spectral]

For scenes of which the suite has no spectral reference; the others are conformance.py's. A reference is the mean of
--samples samples, or of as many as --seconds allow, with the variance that the integrator `moment` tells. The criterion is
Mitsuba's: at least 99.75 % of values within the bounds of noise, with a significance of 1 % over the pixels; and a gain of
at most 0.2 % or four standard errors. Needs Python with mitsuba 3.9.1 and OpenEXR, as tools/venv makes it, and for the
llvm variants LLVM. Exit status 0 where every scene passes.
"""
import argparse, math, re, subprocess, sys, tempfile, time
from pathlib import Path

BUDGET = 2_000_000
SIGNIFICANCE, VAR_FLOOR, ACCEPT, GAIN = 0.01, 1e-4, 0.9975, 0.002


def reference(mi, xml, integrator, samples, seconds):
    """Mean and variance per sample of X, Y, Z; and how many samples."""
    import numpy as np
    scene = mi.load_file(str(xml), **({'integrator': 'path'} if integrator == 'ptracer' else {}))
    method = scene.integrator()
    if not any(name.startswith('m2_') for name in method.aov_names()):
        method = mi.load_dict({'type': 'moment', 'nested': method})
    chunk, count, total, begin = 256, 0, 0, time.time()
    while count * chunk < samples and (not count or time.time() - begin < seconds):
        image = np.array(mi.render(scene, integrator=method, spp=chunk, seed=count)).astype(np.float64)
        total, count = total + image, count + 1
    mean = total / count
    colors, first, second = mean[..., :3], mean[..., -6:-3], mean[..., -3:]
    return colors @ rgb_to_xyz(np).T, second - first ** 2, count * chunk


def rgb_to_xyz(np):
    return np.array([[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]])


def threshold(alpha):
    """The number of standard deviations beyond which a normal number is with probability `alpha`."""
    low, high = 0.0, 40.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if math.erfc(middle / math.sqrt(2)) > alpha else (low, middle)
    return low


def judge(np, ours, theirs, variance, spp, samples):
    pixels = theirs.shape[0] * theirs.shape[1]
    noise = np.maximum(variance, VAR_FLOOR) * (1 / spp + 1 / samples)
    z = np.abs(ours - theirs) / np.sqrt(noise)
    accepted = float((z < threshold(1 - (1 - SIGNIFICANCE) ** (1 / pixels))).mean())
    noisy = variance[..., 1] > VAR_FLOOR
    noisy = noisy if noisy.any() else np.ones_like(noisy)
    of, weight = theirs[..., 1][noisy], 1 / noise[..., 1][noisy]
    information = (of * of * weight).sum()
    gain, error = float(((ours[..., 1][noisy] - of) * of * weight).sum() / information), 1 / math.sqrt(information)
    allowed = max(GAIN, 4 * error)
    passed = accepted >= ACCEPT and abs(gain) <= allowed and bool(np.isfinite(ours).all())
    return passed, f'accepted {accepted:.5f} (need {ACCEPT}) gain {100 * gain:+.3f} % (allowed {100 * allowed:.3f})'


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument('--suite', type=Path, default=Path('../shared/data/mitsuba-data/tests/scenes'))
    p.add_argument('--etendue', default='target/release/etendue')
    p.add_argument('--bands', type=int, default=16)
    p.add_argument('--only', default='')
    p.add_argument('--samples', type=int, default=8192)
    p.add_argument('--seconds', type=float, default=60)
    p.add_argument('--variant', default='llvm_ad_spectral')
    a = p.parse_args()
    import numpy as np, OpenEXR
    import mitsuba as mi
    mi.set_variant(a.variant)
    mi.set_log_level(mi.LogLevel.Error)
    passed = failed = 0
    for xml in sorted(a.suite.glob('*/*.xml')):
        name = f'{xml.parent.name}/{xml.stem}'
        stem, integrator = xml.stem.rsplit('_', 1)
        there = (xml.parent / 'refs' / f'{stem}_ref_spectral_var.exr').exists()
        if not re.search(a.only, name) or there:
            continue
        theirs, variance, samples = reference(mi, xml, integrator, a.samples, a.seconds)
        spp = BUDGET // (theirs.shape[0] * theirs.shape[1])
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / 'ours.exr'
            ptracer = ['-D', 'integrator=path'] if integrator == 'ptracer' else []
            subprocess.run([a.etendue, 'render', str(xml), '-o', str(out), '--bands', str(a.bands), '--spp', str(spp), '--seed',
                            '1', '--quiet', *ptracer], check=True)
            with OpenEXR.File(str(out), separate_channels=True) as f:
                rgb = np.stack([f.channels()[c].pixels for c in 'RGB'], -1).astype(np.float64)
        good, words = judge(np, rgb @ rgb_to_xyz(np).T, theirs, variance, spp, samples)
        passed, failed = passed + good, failed + (not good)
        print(f"{'PASS' if good else 'FAIL'}  {name:60} {words}, {samples} samples", flush=True)
    print(f'{passed} passed, {failed} failed')
    return 0 if passed and not failed else 1


if __name__ == '__main__':
    sys.exit(main())
