"""The ray tracer etendue: where its command is, and how it is run.

`etendue.farm` renders the manifests of `etendue batch` on a Dask cluster.
"""

import os
import shutil
import subprocess
import sysconfig
from pathlib import Path

__all__ = ["command", "run"]


def command() -> str:
    """The path of the command: what the variable ETENDUE names, else what was installed with this package, else what
    PATH finds. FileNotFoundError where there is none."""
    named = os.environ.get("ETENDUE")
    if named:
        return named
    folders = [sysconfig.get_path("scripts"), sysconfig.get_path("scripts", f"{os.name}_user")]
    for folder in folders:
        found = shutil.which("etendue", path=folder)
        if found:
            return str(Path(found).resolve())
    found = shutil.which("etendue")
    if found:
        return found
    raise FileNotFoundError("the command etendue is not installed: `pip install etendue` brings it")


def run(*arguments: str, **options) -> subprocess.CompletedProcess:
    """Runs the command with these arguments; options are those of `subprocess.run`."""
    return subprocess.run([command(), *map(str, arguments)], **options)
