"""The farm on a LocalCluster of two workers: the same bits as one run, whatever happens on the way.

    python tools/python/test_farm.py [--full] [NAME...]

It needs the package `etendue` (or ETENDUE, the command, and PYTHONPATH, tools/python) and `distributed`. Without --full the
images are small, so that all takes well under a minute. With --full the sizes are those that are promised.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from unittest import mock

import dask
from distributed import Client, LocalCluster

import etendue
from etendue import farm

SCENE = """<scene version="3.0.0">
    <default name="frame" value="0"/>
    <integrator type="aov"><string name="aovs" value="d:depth,n:sh_normal"/>
        <integrator type="path"><integer name="max_depth" value="4"/></integrator></integrator>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="96"/><integer name="height" value="72"/></film>
        <sampler type="independent"><integer name="sample_count" value="48"/></sampler>
    </sensor>
    <emitter type="constant"/>
    <shape type="sphere"><transform name="to_world"><translate x="$frame"/></transform></shape>
    <shape type="rectangle"><transform name="to_world">
        <scale value="9"/><rotate x="1" angle="-90"/><translate y="-1"/>
    </transform><bsdf type="roughconductor"/></shape>
</scene>"""

KINDS = {
    "rgb": "spp = 48",
    "bands": "spp = 48\nbands = 16",
    "adaptive": "noise_threshold = 0.05\nmax_spp = 160",
    "adaptive-bands": "noise_threshold = 0.05\nmax_spp = 160\nbands = 16",
}


class Place:
    """A folder with a scene and a manifest of `frames` frames of each kind."""

    def __init__(self, folder, kinds, frames):
        self.folder = Path(folder)
        (self.folder / "scene.xml").write_text(SCENE)
        entries = [
            f'[[images]]\nscenes = "scene.xml"\noutput = "{kind}-{{frame}}.exr"\nframes = "0:{frames}"\n{KINDS[kind]}\n'
            for kind in kinds
        ]
        self.job = self.folder / "job.toml"
        self.job.write_text("\n".join(entries))

    def whole(self):
        """The images of one process a frame, by name."""
        etendue.run("batch", str(self.job), "--quiet", check=True, stdout=subprocess.DEVNULL)
        images = {}
        for path in self.folder.glob("*.exr"):
            images[path.name] = path.read_bytes()
            path.unlink()
        return images

    def check(self, whole, report):
        """That the farm's images have these bits; EXR files of equal images are equal."""
        assert not report.failed(), report.failed()
        for name, content in whole.items():
            assert (self.folder / name).read_bytes() == content, f"{name} differs"


class Said:
    """What the farm says."""

    def __init__(self):
        self.lines = []

    def __call__(self, text):
        self.lines.append(text)
        print(f"    farm: {text}", flush=True)

    def has(self, text):
        return any(text in line for line in self.lines)


def same_bits(client, place, options):
    """Frames, crops and ranges of passes of every kind come to the bits of one run, and are not done again."""
    whole = place.whole()
    report = farm.render(place.job, client, options)
    place.check(whole, report)
    again = farm.render(place.job, client, options)
    assert [image["status"] for image in again.images] == ["skipped"] * len(whole), again.images


def bad_luck(client, place, options):
    """A worker that is killed, a part that is cut off and one that is rendered twice change no bit, and are told."""
    whole = place.whole()
    options.keep_parts = True
    options.say = said = Said()
    folder = place.job.with_suffix(".farm")
    go = place.folder / "go"
    # From the fourth part on every unit waits for the misfortune, so that its worker has something to lose.
    waits = place.folder / "waits"
    waits.write_text(
        f"""#!/bin/sh
while [ ! -e '{go}' ] && [ "$(find '{folder}' -name '*.part' | wc -l)" -ge 4 ]; do sleep 0.05; done
exec '{etendue.command()}' "$@"
"""
    )
    waits.chmod(0o755)

    def misfortune():
        while len(parts := sorted(folder.glob("*.part"))) < 4:
            time.sleep(0.01)
        # Cut off: rendered again when its image is merged. Gone: rendered twice if its unit was done.
        parts[0].write_bytes(parts[0].read_bytes()[: parts[0].stat().st_size // 2])
        try:
            busy = []
            while not busy:
                busy = [worker for worker, tasks in client.processing().items() if tasks]
            os.kill(client.run(os.getpid, workers=busy[:1])[busy[0]], signal.SIGKILL)
            # Not for ever: where the result of a unit that was done is lost too, the farm waits for that unit, which waits for `go`.
            for _ in range(1000):
                if said.has("was lost"):
                    break
                time.sleep(0.01)
        finally:
            go.touch()

    thread = threading.Thread(target=misfortune, daemon=True)
    thread.start()
    with mock.patch.dict(os.environ, ETENDUE=str(waits)):
        report = farm.render(place.job, client, options)
    thread.join()
    place.check(whole, report)
    assert report.lost_workers, report
    assert said.has("merged again") and said.has("damaged"), said.lines
    assert report.units["skipped"] > 0, report.units


# Stands in for `sbatch` and `scancel`: a job is a session of its own.
BATCH_SYSTEM = f"""#!{sys.executable}
import os, shutil, signal, subprocess, sys
folder, name = os.path.split(os.path.abspath(sys.argv[0]))
if name == "scancel":
    os.killpg(int(sys.argv[1]), signal.SIGKILL)
elif os.path.exists(folder + "/refuses"):
    sys.exit("sbatch: error: invalid partition")
else:
    script = shutil.copy(sys.argv[1], folder)
    job = subprocess.Popen(["bash", script], start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    print("Submitted batch job", job.pid)
"""


def lost_jobs(_client, place, options):
    """The only job of a batch system is cancelled and gets a successor; a job that is not taken is an error."""
    whole = place.whole()
    options.say = Said()
    system = place.folder / "system"
    system.mkdir()
    for name in ("sbatch", "scancel"):
        (system / name).write_text(BATCH_SYSTEM)
        (system / name).chmod(0o755)
    refuses = system / "refuses"
    refuses.touch()

    def cancel(client, made):
        while not any(client.processing().values()):
            time.sleep(0.01)
        (job,) = made.workers.values()
        subprocess.run(["scancel", job.job_id], check=True)

    path = f"{system}:{os.environ['PATH']}"
    soon = dask.config.set({"distributed.deploy.lost-worker-timeout": "1s"})
    with mock.patch.dict(os.environ, PATH=path), mock.patch.object(farm, "REPLACE_SECONDS", 0.2), soon:
        try:
            farm.cluster("slurm", 1, cores=1, memory="1GB").close()
        except farm.ClusterError as error:
            assert "invalid partition" in str(error), error
        else:
            raise AssertionError("a job that is not taken is no error")
        refuses.unlink()
        made = farm.cluster("slurm", 1, cores=1, memory="1GB")
        try:
            with Client(made) as client:
                thread = threading.Thread(target=cancel, args=(client, made), daemon=True)
                thread.start()
                report = farm.render(place.job, client, options)
                thread.join()
        finally:
            made.close()
    place.check(whole, report)
    assert report.lost_workers, report


def one_in_ten_fails(client, place, options):
    """Every image that can be is there, and the report names the others."""
    count = options.count
    entries = []
    for i in range(count):
        radius = "large" if i % 10 == 3 else "1"
        (place.folder / f"{i}.xml").write_text(SCENE.replace('<shape type="sphere">', f'<shape type="sphere"><float name="radius" value="{radius}"/>'))
        entries.append(f'[[images]]\nscenes = "{i}.xml"\noutput = "out/{i}.exr"\nspp = 1\nsize = "16x12"\n')
    place.job.write_text("\n".join(entries))
    report = farm.render(place.job, client, options)
    failed = sorted(int(Path(image["output"]).stem) for image in report.failed())
    assert failed == list(range(3, count, 10)), failed
    assert all("radius" in image["problem"] or "large" in image["problem"] for image in report.failed())
    there = sorted(int(path.stem) for path in (place.folder / "out").glob("*.exr"))
    assert there == [i for i in range(count) if i % 10 != 3], there


TESTS = {
    "same_bits": (same_bits, list(KINDS)),
    "bad_luck": (bad_luck, ["rgb", "adaptive"]),
    "lost_jobs": (lost_jobs, ["rgb", "adaptive"]),
    "one_in_ten_fails": (one_in_ten_fails, ["rgb"]),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--full", action="store_true")
    parser.add_argument("names", nargs="*")
    given = parser.parse_args()
    frames, count = (3, 500) if given.full else (1, 30)
    for name, (test, kinds) in TESTS.items():
        if given.names and name not in given.names:
            continue
        began = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            place = Place(folder, kinds, frames)
            options = farm.Options(tiles=(3, 3), ranges=4, threads=1)
            if name == "one_in_ten_fails":
                options = farm.Options(threads=1)
                options.count = count
            elif not given.full:
                options.tiles, options.ranges = (2, 2), 2
            with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
                with Client(cluster) as client:
                    test(client, place, options)
        print(f"passed   {name} ({time.monotonic() - began:.1f} s)", flush=True)


if __name__ == "__main__":
    main()
