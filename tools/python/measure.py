"""What the farm costs: processor time of units beside one process, scheduling, and merging.

    python tools/python/measure.py [--triangles 10M] [--spp 16] [overhead] [scheduling] [merging]

It needs what test_farm.py needs. Times depend on what else the machine does: processor time (user and system) is told for
`overhead`, in turns.
"""

import argparse
import os
import resource
import tempfile
import time
from pathlib import Path

from distributed import Client, LocalCluster

import etendue
from etendue import farm
from test_farm import SCENE


def processor_seconds(*arguments):
    """Of one call of the command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    etendue.run(*arguments, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def overhead(given, folder):
    """Four crops of a large terrain at 1080p with one cache, beside the whole in one process."""
    mesh = folder / "terrain.ply"
    etendue.run("mesh", "generate", "terrain", str(mesh), "--triangles", given.triangles, "--seed", "7", "-q", check=True)
    common = ["--up", "z", "--size", "1920x1080", "--spp", str(given.spp), "--cache", str(folder / "cache"), "-q"]
    # The cache is filled before either is measured.
    etendue.run("render", str(mesh), "-o", str(folder / "one.exr"), *common, check=True)
    ratios = []
    for turn in range(given.turns):
        one = processor_seconds("render", str(mesh), "-o", str(folder / "one.exr"), *common)
        units = 0.0
        for i, crop in enumerate(["0,0,960,544", "960,0,960,544", "0,544,960,536", "960,544,960,536"]):
            part = str(folder / f"{i}.part")
            units += processor_seconds("render", str(mesh), "-o", part, *common, "--crop", crop)
        parts = [str(folder / f"{i}.part") for i in range(4)]
        units += processor_seconds("merge", str(folder / "four.exr"), *parts, "-q")
        assert (folder / "one.exr").read_bytes() == (folder / "four.exr").read_bytes(), "other bits"
        ratios.append(units / one)
        print(f"overhead: one process {one:.1f} s, four units {units:.1f} s, {units / one:.3f} of it", flush=True)
    return sorted(ratios)[len(ratios) // 2]


def scheduling(given, folder):
    """A thousand units that do nothing but run: seconds of each that are not the command's own."""
    command = folder / "nothing"
    command.write_text('#!/bin/sh\necho \'{"status": "rendered"}\'\n')
    command.chmod(0o755)
    from etendue import work

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            client.gather(client.map(work.unit, [str(command)] * 20, [str(folder)] * 20, [["warm"]] * 20, pure=False))
            began = time.monotonic()
            futures = [
                client.submit(work.unit, str(command), str(folder), [str(i)], pure=False) for i in range(1000)
            ]
            client.gather(futures)
            each = (time.monotonic() - began) / 1000
    print(f"scheduling: {1000 * each:.1f} ms a unit", flush=True)
    return each


def merging(given, folder):
    """A hundred parts of an image of 1080p: crops with all passes, and crops by ranges."""
    (folder / "scene.xml").write_text(SCENE)
    for name, columns, rows, ranges in [("crops", 10, 10, [":"]), ("ranges", 5, 5, ["0:1", "1:2", "2:3", "3:"])]:
        parts = []
        for y in range(rows):
            for x in range(columns):
                for passes in ranges:
                    width, height = 1920 // columns, 1080 // rows
                    part = str(folder / f"{name}-{x}-{y}-{passes.replace(':', 'to')}.part")
                    crop = f"{x * width},{y * height},{width},{height}"
                    etendue.run(
                        "render", str(folder / "scene.xml"), "-o", part, "--size", "1920x1080", "--integrator", "direct",
                        "--spp", "40", "--crop", crop, "--passes", passes, "-q", check=True,
                    )
                    parts.append(part)
        size = sum(os.path.getsize(part) for part in parts)
        times = []
        for _ in range(5):
            began = time.monotonic()
            etendue.run("merge", str(folder / "merged.exr"), *parts, "-q", check=True)
            times.append(time.monotonic() - began)
        print(f"merging: {len(parts)} parts by {name}, {size / 1e6:.0f} MB, {sorted(times)[2]:.2f} s", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--triangles", default="10M")
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("names", nargs="*")
    given = parser.parse_args()
    for measure in [overhead, scheduling, merging]:
        if not given.names or measure.__name__ in given.names:
            with tempfile.TemporaryDirectory() as folder:
                measure(given, Path(folder))


if __name__ == "__main__":
    main()
