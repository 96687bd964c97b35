"""Images of a manifest, and how they are cut into units: crops of the film and ranges of passes."""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path

import etendue

# Pixels along a tile of the command's: crops along its grid render no tile twice.
TILE = 32
# A crop is not cut below so many pixels a side: its border is rendered by both neighbours.
LEAST_SIDE = 64


class ManifestError(Exception):
    """The manifest is wrong; the text is what `etendue batch` says."""


@dataclass
class Unit:
    """A part of an image."""

    image: int
    # Left, top, width and height in pixels.
    crop: tuple[int, int, int, int]
    # The first pass, and the first that is left out.
    passes: tuple[int, int]
    part: str

    def arguments(self) -> list[str]:
        """What the command is told beside the image's own arguments."""
        crop = ",".join(map(str, self.crop))
        first, end = self.passes
        return ["-o", self.part, "--crop", crop, "--passes", f"{first}:{end}"]


@dataclass
class Image:
    """An image of a manifest, as `etendue batch --dry-run --json` tells it."""

    number: int
    output: str
    # Of the command, without the output and the crop.
    arguments: list[str]
    directory: str
    crop: tuple[int, int, int, int]
    # Whether the crop is less than the film.
    cropped: bool
    passes: int
    adaptive: bool
    # Estimated processor seconds.
    seconds: float
    # Whether it is there already, made of the same scene, files and settings.
    current: bool
    # Why it cannot be rendered.
    problems: list[dict] = field(default_factory=list)

    @classmethod
    def read(cls, told: dict) -> "Image":
        crop = told.get("crop") or {"x": 0, "y": 0, "width": 0, "height": 0}
        return cls(
            number=told["image"],
            output=told["output"],
            arguments=told["arguments"],
            directory=told["directory"],
            crop=(crop["x"], crop["y"], crop["width"], crop["height"]),
            cropped=told.get("cropped", False),
            passes=told.get("passes", 0),
            adaptive=told.get("adaptive", False),
            seconds=told.get("seconds", 0.0),
            current=told["current"],
            problems=told.get("problems", []),
        )


def images(job: Path) -> tuple[list[Image], str]:
    """The images of a manifest, and what is said of entries that are wrong. ManifestError where there are no images."""
    told = etendue.run("batch", str(job), "--dry-run", "--json", capture_output=True, text=True)
    lines = [json.loads(line) for line in told.stdout.splitlines()]
    found = [Image.read(line) for line in lines if "image" in line]
    if not found:
        raise ManifestError(told.stderr.strip() or f"{job} has no images")
    return found, told.stderr.strip()


def cut(image: Image, folder: Path, seconds: float, tiles=None, ranges=None) -> list[Unit]:
    """Units of about so many processor seconds; or `tiles`, columns and rows, times `ranges` of passes.

    Crops are preferred: the part of a crop with all its passes is the smallest, and passes of adaptive samples make
    the pilots anew.
    """
    wanted = max(1, math.ceil(image.seconds / seconds))
    columns, rows = tiles or grid(image.crop, wanted)
    if ranges is None:
        ranges = 1 if image.adaptive else math.ceil(wanted / (columns * rows))
    ranges = max(1, min(ranges, image.passes))
    bounds = [image.passes * i // ranges for i in range(ranges + 1)]
    x, y, width, height = image.crop
    units = []
    for top, bottom in spans(y, height, rows):
        for left, right in spans(x, width, columns):
            for passes in zip(bounds, bounds[1:]):
                crop = (left, top, right - left, bottom - top)
                name = f"{image.number}-{left}-{top}-{right}-{bottom}-{passes[0]}-{passes[1]}.part"
                units.append(Unit(image.number, crop, passes, str(folder / name)))
    return units


def grid(crop: tuple[int, int, int, int], wanted: int) -> tuple[int, int]:
    """Columns and rows of at least so many crops, as square as they can be, unless these would be too small."""
    _, _, width, height = crop
    most = (max(1, width // LEAST_SIDE), max(1, height // LEAST_SIDE))
    side = math.sqrt(width * height / wanted)
    columns = min(most[0], max(1, round(width / side)))
    rows = min(most[1], math.ceil(wanted / columns))
    return columns, rows


def spans(start: int, size: int, count: int) -> list[tuple[int, int]]:
    """About equal parts of a side, along the grid of tiles where that leaves each of them something."""
    bounds = [start + size * i // count for i in range(count + 1)]
    inner = [round(bound / TILE) * TILE for bound in bounds[1:-1]]
    aligned = [bounds[0], *inner, bounds[-1]]
    if all(a < b for a, b in zip(aligned, aligned[1:])):
        bounds = aligned
    return [(a, b) for a, b in zip(bounds, bounds[1:]) if a < b]
