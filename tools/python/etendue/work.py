"""What runs on a worker: one call of the command for a unit, and one for a merge."""

import ctypes
import json
import os
import signal
import subprocess
import sys

# Exit status of the command: the input is wrong, which is no better the second time.
WRONG_INPUT = 1


class Lost(Exception):
    """The command ended without doing its work, and may do it when it is asked again."""


def die_with_parent():
    """On Linux, ends a process when its parent has gone: a unit of a lost worker is done elsewhere."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)


def call(command: str, directory: str, arguments: list[str]) -> subprocess.CompletedProcess:
    """Runs the command; the folder and the command are where every worker finds them."""
    last_will = die_with_parent if sys.platform == "linux" else None
    return subprocess.run(
        [command, *arguments],
        cwd=directory,
        capture_output=True,
        text=True,
        preexec_fn=last_will,
        env={**os.environ, "LC_ALL": "C.UTF-8"},
    )


def unit(command: str, directory: str, arguments: list[str]) -> dict:
    """Renders a part: its report, or `problem`, a text, where the input is wrong. Lost where the system failed."""
    done = call(command, directory, [*arguments, "--skip-same", "--quiet", "--json"])
    if done.returncode == 0:
        return json.loads(done.stdout)
    if done.returncode == WRONG_INPUT:
        return {"status": "failed", "problem": done.stderr.strip()}
    raise Lost(f"status {done.returncode}: {done.stderr.strip()[-2000:]}")


def merge(command: str, directory: str, output: str, parts: list[str], more: list[str]) -> dict:
    """Makes an image of its parts: the report, or `problem`, a text, where a part is not what it should be."""
    arguments = ["merge", output, *parts, *more, "--fingerprint", "--quiet", "--json"]
    done = call(command, directory, arguments)
    if done.returncode == 0:
        return {"status": "rendered", **json.loads(done.stdout)}
    if done.returncode == WRONG_INPUT:
        return {"status": "failed", "problem": done.stderr.strip()}
    raise Lost(f"status {done.returncode}: {done.stderr.strip()[-2000:]}")
