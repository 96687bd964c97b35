"""Renders a manifest of `etendue batch` on a Dask cluster, to the same bits as one machine would.

    python -m etendue.farm JOB.toml --workers 2
    python -m etendue.farm JOB.toml --scheduler tcp://head:8786
    python -m etendue.farm JOB.toml --cluster slurm --workers 40 --cores 16 --memory 32GB --queue render

Images are cut into units, which are parts: crops of the film and ranges of passes. Dask hands them to workers and gives
those of lost workers to others; an image is merged when its parts are there. Manifest, outputs and the folder for parts
must be where every worker finds them. What is there already, of the same scene, files, settings and version, is not done
again.
"""

import argparse
import contextlib
import json
import os
import queue
import shutil
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from tornado.ioloop import PeriodicCallback

import etendue
from etendue import units as cutting
from etendue import work

# Processor seconds of a unit, where nothing else is said: enough that loading a scene does not count.
UNIT_SECONDS = 60.0
# A batch system is asked so often for new jobs in place of those that ended; Dask gives a lost one up after 15 seconds.
REPLACE_SECONDS = 10.0
# A line of progress comes when so many seconds have passed and so much of the units is done, or after a minute.
LINE_SECONDS, LINE_SHARE, LONGEST_SILENCE = 10.0, 0.05, 60.0


@dataclass
class Options:
    """How a manifest is rendered."""

    # Where parts and trees are kept; JOB.farm beside the manifest where absent.
    folder: Path | None = None
    # Processor seconds of a unit, about.
    seconds: float = UNIT_SECONDS
    # Columns and rows of crops, and ranges of passes, in place of what suits the seconds.
    tiles: tuple[int, int] | None = None
    ranges: int | None = None
    # Threads of each unit; None: as many as the worker's process may use.
    threads: int | None = None
    # How often what failed is tried again.
    retries: int = 3
    # Whether parts stay when their image is there.
    keep_parts: bool = False
    # Says a line of text.
    say: object = lambda text: print(f"farm: {text}", file=sys.stderr, flush=True)


@dataclass
class Report:
    """What became of a manifest."""

    images: list[dict] = field(default_factory=list)
    units: dict = field(default_factory=dict)
    lost_workers: list[str] = field(default_factory=list)
    # What is wrong with entries of the manifest.
    problem: str = ""
    seconds: float = 0.0

    def failed(self) -> list[dict]:
        """The images that are not there."""
        return [image for image in self.images if image["status"] == "failed"]

    def json(self) -> str:
        """One object."""
        return json.dumps({"format": 1, **self.__dict__})


@dataclass
class Order:
    """An image that is being rendered."""

    image: cutting.Image
    units: list[cutting.Unit]
    # Units whose part is not there yet.
    left: int
    # How often it was merged.
    merges: int = 0


def render(job, client, options: Options | None = None) -> Report:
    """Renders the manifest `job` on the cluster of a `distributed.Client`. ManifestError where the manifest is wrong;
    what is wrong with single images stands in the report."""
    return _Farm(Path(job).resolve(), client, options or Options()).run()


class _Farm:
    def __init__(self, job: Path, client, options: Options):
        self.job, self.client, self.options = job, client, options
        self.folder = Path(options.folder or job.with_suffix(".farm")).resolve()
        self.command = etendue.command()
        self.orders: dict[int, Order] = {}
        self.report = Report()
        # Futures that are done, as Dask tells it.
        self.done: queue.Queue = queue.Queue()
        self.running: set = set()
        self.counts = {"units": 0, "rendered": 0, "skipped": 0, "failed": 0}
        self.began = self.told = time.monotonic()
        self.told_share = 0.0
        self.looked = 0.0
        # When the last of Dask's events was that is known.
        self.last_event = time.time()

    def run(self) -> Report:
        self.folder.mkdir(parents=True, exist_ok=True)
        found, wrong = cutting.images(self.job)
        if wrong:
            self.report.problem = wrong
            self.options.say(wrong)
        for image in found:
            self._begin(image)
        images, count = len(found), self.counts["units"]
        self.options.say(f"{images} images, {len(self.orders)} to render, in {count} units")
        for order in self.orders.values():
            for unit in order.units:
                self._submit_unit(order, unit)
        while self.running:
            try:
                self._finished(self.done.get(timeout=1.0))
            except queue.Empty:
                pass
            self._look_for_lost_workers()
            self._tell()
        self.report.images.sort(key=lambda image: image["image"])
        self.report.units = self.counts
        self.report.seconds = time.monotonic() - self.began
        if not self.options.keep_parts and not self.report.failed():
            self._remove_parts_folder()
        return self.report

    def _begin(self, image: cutting.Image):
        if image.problems:
            self._ends(image, "failed", problem=image.problems[0]["message"])
        elif image.current:
            self._ends(image, "skipped")
        else:
            Path(image.directory, image.output).parent.mkdir(parents=True, exist_ok=True)
            options = self.options
            units = cutting.cut(image, self.folder, options.seconds, options.tiles, options.ranges)
            self.orders[image.number] = Order(image, units, len(units))
            self.counts["units"] += len(units)

    def _ends(self, image: cutting.Image, status: str, **more):
        told = {"image": image.number, "output": image.output, "status": status, **more}
        self.report.images.append(told)
        if status == "failed":
            self.options.say(f"{image.output}: {more['problem']}")

    def _submit_unit(self, order: Order, unit: cutting.Unit):
        image = order.image
        arguments = [*image.arguments, *unit.arguments(), "--cache", str(self.folder / "cache")]
        if self.options.threads:
            arguments += ["--threads", str(self.options.threads)]
        key = f"{Path(unit.part).stem}-of-{image.output}-{order.merges}"
        self._submit(("unit", order, unit), key, work.unit, image.directory, arguments)

    def _submit_merge(self, order: Order):
        image = order.image
        parts = [unit.part for unit in order.units]
        more = ["--crop", ",".join(map(str, image.crop))] if image.cropped else []
        key = f"merge-of-{image.output}-{order.merges}"
        order.merges += 1
        what = ("merge", order, None)
        self._submit(what, key, work.merge, image.directory, image.output, parts, more, priority=1)

    def _submit(self, what, key, function, *arguments, priority=0):
        future = self.client.submit(
            function,
            self.command,
            *arguments,
            key=f"etendue-{os.getpid()}-{id(self)}-{key}",
            retries=self.options.retries,
            priority=priority,
            pure=False,
        )
        self.running.add(future)
        future.add_done_callback(lambda future: self.done.put((what, future)))

    def _finished(self, done):
        (kind, order, unit), future = done
        self.running.discard(future)
        if future.status == "error":
            error = future.exception()
            result = {"status": "failed", "problem": f"{type(error).__name__}: {error}"}
        elif future.status == "cancelled":
            result = {"status": "failed", "problem": "it was cancelled"}
        else:
            result = future.result()
        future.release()
        if kind == "unit":
            self._unit_done(order, unit, result)
        else:
            self._merge_done(order, result)

    def _unit_done(self, order: Order, unit: cutting.Unit, result: dict):
        self.counts[result["status"]] = self.counts.get(result["status"], 0) + 1
        order.left -= 1
        if result["status"] == "failed":
            if order.image.number in self.orders:
                # The other units would be for nothing.
                del self.orders[order.image.number]
                self._ends(order.image, "failed", problem=result["problem"])
        elif order.left == 0 and order.image.number in self.orders:
            self._submit_merge(order)

    def _merge_done(self, order: Order, result: dict):
        image = order.image
        if result["status"] != "failed":
            del self.orders[image.number]
            self._ends(image, "rendered", units=len(order.units), samples=result["spp"])
            self.options.say(f"{image.output} is there, of {len(order.units)} parts")
            if not self.options.keep_parts:
                for unit in order.units:
                    Path(unit.part).unlink(missing_ok=True)
        elif order.merges <= self.options.retries:
            self.options.say(f"{image.output} is merged again, for {result['problem']}")
            order.left = len(order.units)
            self.counts["units"] += len(order.units)
            for unit in order.units:
                self._submit_unit(order, unit)
        else:
            del self.orders[image.number]
            self._ends(image, "failed", problem=result["problem"])

    def _look_for_lost_workers(self):
        if time.monotonic() - self.looked < 1.0:
            return
        self.looked = time.monotonic()
        for when, event in self.client.get_events("all"):
            if when <= self.last_event:
                continue
            self.last_event = when
            count = len(event.get("processing-tasks", ()))
            if event.get("action") == "remove-worker" and count:
                name = event["worker"]
                self.report.lost_workers.append(name)
                self.options.say(f"{name} was lost; its {count} units are done by others")

    def _tell(self):
        done = sum(self.counts[name] for name in ("rendered", "skipped", "failed"))
        share = done / max(1, self.counts["units"])
        silent = time.monotonic() - self.told
        due = silent >= LINE_SECONDS and share - self.told_share >= LINE_SHARE
        if not (due or silent >= LONGEST_SILENCE) or not self.running:
            return
        self.told, self.told_share = time.monotonic(), share
        elapsed = self.told - self.began
        left = f", about {elapsed * (1 - share) / share:.0f} s left" if share > 0 else ""
        there = sum(image["status"] != "failed" for image in self.report.images)
        idle = "" if self.client.scheduler_info()["workers"] else "; no worker is there"
        self.options.say(f"{done} of {self.counts['units']} units, {there} images are there{left}{idle}")

    def _remove_parts_folder(self):
        """What is left there is what killed processes had begun to write."""
        for left in self.folder.glob(".etendue-*"):
            left.unlink(missing_ok=True)
        if all(entry.name == "cache" for entry in self.folder.iterdir()):
            shutil.rmtree(self.folder, ignore_errors=True)


class ClusterError(Exception):
    """There is no cluster; the text is what the batch system says."""


def cluster(kind: str, workers: int | None, **options):
    """A cluster of `workers`: "local" (a process a worker, by default one a processor), "slurm" or "pbs", whose options
    are those of dask-jobqueue. ClusterError where the batch system takes no job."""
    if kind == "local":
        from distributed import LocalCluster

        count = workers or os.cpu_count() or 1
        return LocalCluster(
            n_workers=count, threads_per_worker=1, processes=True, dashboard_address=None
        )
    import dask_jobqueue

    kinds = {"slurm": dask_jobqueue.SLURMCluster, "pbs": dask_jobqueue.PBSCluster}
    given = {name: value for name, value in options.items() if value is not None}
    # One unit a worker at a time: its processors are the command's.
    one = {"processes": 1, "worker_extra_args": ["--nthreads", "1"]}
    made = kinds[kind](**{**one, **given})
    _submit_jobs(made, workers or 1)
    return made


def _submit_jobs(made, count: int):
    """Keeps `count` jobs in the queue or at work. `scale` alone submits each of them once: when their time is over or
    they were preempted, there would be no workers for the rest."""

    async def submitted():
        await made

    # The first job as `scale` does it, which would not say that it failed.
    made.worker_spec.update(made.new_worker_spec())
    try:
        made.sync(submitted)
    except (RuntimeError, OSError) as error:
        # Dask is not prepared for jobs that never were.
        with contextlib.suppress(AssertionError):
            made.close()
        raise ClusterError(f"the batch system takes no job: {error}") from None

    made.scale(jobs=count)
    # A job that Dask has given up is submitted again by the same call.
    again = PeriodicCallback(lambda: made.scale(jobs=count), 1000 * REPLACE_SECONDS)
    made.periodic_callbacks["jobs"] = again
    made.loop.add_callback(again.start)


def _pair(text: str) -> tuple[int, int]:
    columns, rows = (int(number) for number in text.split("x"))
    return columns, rows


def _arguments():
    parser = argparse.ArgumentParser(prog="python -m etendue.farm", description=__doc__.split("\n")[0])
    parser.add_argument("job", type=Path, metavar="JOB.toml")
    where = parser.add_argument_group("the cluster")
    where.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster that is there")
    where.add_argument("--cluster", choices=["local", "slurm", "pbs"], default="local")
    where.add_argument("--workers", type=int, metavar="N", help="processes, or jobs of the batch system")
    where.add_argument("--cores", type=int, default=1, metavar="N", help="of a job of the batch system")
    where.add_argument("--memory", default="4GB", metavar="SIZE", help="of a job of the batch system")
    where.add_argument("--walltime", metavar="H:M:S", help="of a job of the batch system")
    where.add_argument("--queue", metavar="NAME", help="of the batch system")
    how = parser.add_argument_group("units")
    how.add_argument("--seconds", type=float, default=UNIT_SECONDS, metavar="S", help="processor seconds of a unit")
    how.add_argument("--tiles", type=_pair, metavar="CxR", help="columns and rows of crops, such as 3x3")
    how.add_argument("--ranges", type=int, metavar="N", help="ranges of passes")
    how.add_argument("--threads", type=int, metavar="N", help="of a unit")
    how.add_argument("--retries", type=int, default=3, metavar="N", help="of what failed")
    how.add_argument("--folder", type=Path, metavar="DIR", help="for parts and trees; JOB.farm by default")
    how.add_argument("--keep-parts", action="store_true", help="when their image is there")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    return parser.parse_args()


def main() -> int:
    """The command line: 0 when all images are there, 1 when some are not or the manifest is wrong."""
    from distributed import Client

    given = _arguments()
    local = given.cluster == "local"
    threads = given.threads
    if given.scheduler:
        made = given.scheduler
    elif local:
        made = cluster("local", given.workers)
        # So many processes share the processors.
        threads = threads or max(1, (os.cpu_count() or 1) // len(made.workers))
    else:
        threads = threads or given.cores
        jobs = {"cores": given.cores, "memory": given.memory, "walltime": given.walltime, "queue": given.queue}
        try:
            made = cluster(given.cluster, given.workers, **jobs)
        except ClusterError as error:
            print(error, file=sys.stderr)
            return 1
    options = Options(
        folder=given.folder,
        seconds=given.seconds,
        tiles=given.tiles,
        ranges=given.ranges,
        threads=threads,
        retries=given.retries,
        keep_parts=given.keep_parts,
    )
    try:
        with Client(made) as client:
            report = render(given.job, client, options)
    except cutting.ManifestError as error:
        print(error, file=sys.stderr)
        return 1
    finally:
        if not isinstance(made, str):
            made.close()
    if given.json:
        print(report.json())
    else:
        there = len(report.images) - len(report.failed())
        print(f"{there} of {len(report.images)} images are there, {report.seconds:.1f} s")
        for image in report.failed():
            print(f"  failed  {image['output']}: {image['problem']}")
    return 1 if report.failed() or report.problem else 0


if __name__ == "__main__":
    sys.exit(main())
