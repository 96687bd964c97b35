#!/usr/bin/env python3
"""Uses the pages of `compare --report` and `crosscheck --report` in headless Chromium: slider, flicker, differences,
inspector, zoom and tiles; nothing may be asked of a network and nothing said on the console. Needs Playwright.

  tools/test_page.py ETENDUE CHROMIUM [PYTHON]

PYTHON is one that has Mitsuba: without it there is no page of `crosscheck`.
"""
import base64
import json
import re
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import expect, sync_playwright

SCENE = Path(__file__).resolve().parent.parent / "scenes/cornell-box.xml"
WIDTH, HEIGHT, TILE = 64, 48, 16

# What columns of a screenshot look like, each as a text.
COLUMNS = """async shot => {
  const image = new Image();
  image.src = "data:image/png;base64," + shot;
  await image.decode();
  const canvas = Object.assign(document.createElement("canvas"), { width: image.width, height: image.height });
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  return Array.from({ length: image.width }, (_, x) => context.getImageData(x, 0, 1, image.height).data.join());
}"""


def run(*words, status=(0,)):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    assert done.returncode in status, f"{words}: {done.returncode}\n{done.stdout}{done.stderr}"


def values(etendue, image):
    """Red, green and blue of each pixel, read from the image as PFM, whose rows begin at the bottom."""
    pfm = image.with_suffix(".pfm")
    run(etendue, "convert", image, "-o", pfm)
    content = pfm.read_bytes()
    head = re.match(rb"PF\s(\d+) (\d+)\s(-?[\d.]+)\s", content)
    assert head and float(head[3]) < 0, head
    width, height = int(head[1]), int(head[2])
    numbers = struct.unpack(f"<{3 * width * height}f", content[head.end():])
    rows = [numbers[3 * width * row:][:3 * width] for row in range(height)][::-1]
    return [[row[3 * column:][:3] for column in range(width)] for row in rows]


def mean(pixels, x, y):
    """Of the tile that begins there."""
    tile = [pixels[row][column] for row in range(y, y + TILE) for column in range(x, x + TILE)]
    return [sum(channel) / len(tile) for channel in zip(*tile)]


def numbers(line, side):
    """What a line of the inspector tells of a side."""
    assert line.startswith(side), line
    return [float(number) for number in line[len(side):].replace("≥", "").split()]


def are_near(found, known, part):
    assert len(found) == len(known) == 3, found
    assert all(abs(f - k) <= part * abs(k) + 1e-6 for f, k in zip(found, known)), (found, known)


class Viewer:
    """The pictures of a page."""

    def __init__(self, page):
        self.page = page
        self.stage = page.locator(".stage")
        self.frame = self.stage.locator(".frame")
        self.slider = page.locator("input[type=range]")
        self.legend = page.locator(".bar > span")
        self.inspector = page.locator(".inspector")

    def press(self, name):
        self.page.get_by_role("button", name=name, exact=True).click()

    def picture(self, side):
        return self.frame.locator(f"img[alt={side}]")

    def columns(self):
        self.page.mouse.move(0, 0)
        shot = base64.b64encode(self.frame.screenshot()).decode()
        return self.page.evaluate(COLUMNS, shot)

    def slide(self, percent):
        self.slider.fill(str(percent))
        return self.columns()


def use(page, sides, expected):
    """Does what somebody does who looks; `expected` is the pixels of both sides, where they are known."""
    viewer = Viewer(page)
    expect(page.locator("h1")).not_to_be_empty()
    expect(page.locator(".verdict")).to_have_count(1)
    for side in ["a", "b", "error", "signed"]:
        size = viewer.picture(side).evaluate("image => [image.complete, image.naturalWidth, image.naturalHeight]")
        assert size == [True, WIDTH, HEIGHT], (side, size)

    # The slider parts the two images where it stands.
    only_a, only_b, half = viewer.slide(100), viewer.slide(0), viewer.slide(50)
    assert only_a != only_b
    middle = len(half) // 2
    assert half == only_a[:middle] + only_b[middle:], "the halves are not those of the two images"
    expect(viewer.legend).to_have_text(f"{sides[0]} left, {sides[1]} right")

    # Flicker shows either, in turns, and says which.
    viewer.press("Flicker")
    expect(viewer.slider).to_be_disabled()
    for side in [sides[1], sides[0], sides[1]]:
        expect(viewer.legend).to_have_text(side)
    expect(viewer.picture("a")).to_be_hidden()

    # Differences have a scale.
    for button, side in [("Difference", "error"), ("Brighter or darker", "signed")]:
        viewer.press(button)
        expect(viewer.picture(side)).to_be_visible()
        assert viewer.columns() not in (only_a, only_b)
        expect(viewer.legend.locator(".colors")).to_be_visible()
    viewer.press("Slider")
    expect(viewer.picture("signed")).to_be_hidden()
    assert viewer.columns() == half

    # The inspector tells the pixel under the pointer, at every zoom.
    for _ in range(2):
        box = viewer.frame.bounding_box()
        scale = box["width"] / WIDTH
        page.mouse.move(box["x"] + 20.5 * scale, box["y"] + 30.5 * scale)
        expect(viewer.inspector).to_contain_text("pixel 20, 30:")
        viewer.press("+")
        assert viewer.frame.bounding_box()["width"] == 2 * box["width"]
    lines = viewer.inspector.inner_text().split("\n")
    assert lines[1].split() == ["R", "G", "B"], lines
    assert lines[5].startswith("the means of its tile of 16 × 16 pixels"), lines
    pixel, tile = [[numbers(lines[i + side], sides[side]) for side in range(2)] for i in [2, 6]]
    shown = numbers(lines[4], "difference")
    for found, one, other in zip(shown, *pixel, strict=True):
        assert abs(found - (other - one)) <= 2e-3 * max(abs(one), abs(other)), lines
    for side, known in enumerate(expected or []):
        are_near(pixel[side], known[30][20], 1e-3)
        are_near(tile[side], mean(known, TILE, TILE), 2e-3)

    # A tile that differs is outlined.
    outline = viewer.frame.locator(".tile")
    expect(outline).to_be_hidden()
    tile = page.locator(".tiles button").first
    place = tile.inner_text().split(":")[0]
    tile.click()
    expect(outline).to_be_visible()
    expect(viewer.inspector).to_contain_text(f"pixel {place}:")


def use_large(page, sides, expected):
    """Where not all pixels fit, those of the tile that differs most are told exactly, and others about."""
    viewer = Viewer(page)
    page.locator(".tiles button").first.click()
    x, y = map(int, re.match(r"pixel (\d+), (\d+):", viewer.inspector.inner_text()).groups())
    for side, line in enumerate(viewer.inspector.inner_text().split("\n")[2:4]):
        are_near(numbers(line, sides[side]), expected[side][y][x], 1e-3)
    viewer.stage.evaluate("stage => { stage.scrollTo(0, 0); stage.scrollIntoView(); }")
    box = viewer.frame.bounding_box()
    for x in range(5, 320, 10):
        page.mouse.move(box["x"] + (x + .5) * box["width"] / 320, box["y"] + 5.5 * box["height"] / 240)
        lines = viewer.inspector.inner_text().split("\n")
        if "about" in lines[0]:
            break
    assert lines[0].startswith(f"pixel {x}, 5, about"), lines
    for side, line in enumerate(lines[2:4]):
        for found, known in zip(numbers(line, sides[side]), expected[side][5][x], strict=True):
            assert abs(found - min(known, 1.0)) <= 0.02 + 0.1 * known, (found, known)


def visit(browser, file, sides, expected=None, use=use):
    context = browser.new_context(offline=True)
    page = context.new_page()
    told, asked = [], []
    page.on("console", lambda message: told.append(message.text))
    page.on("pageerror", lambda error: told.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(file.as_uri())
    use(page, sides, expected)
    assert told == [], told
    beside = [url for url in asked if url != file.as_uri() and not url.startswith("data:")]
    assert beside == [], beside
    context.close()
    print(f"{file.parent.name}: {file.stat().st_size} bytes, nothing said, nothing asked for")


def main():
    etendue, chromium, python = (*sys.argv[1:], None)[:3]
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        folder = Path(folder)
        images = [folder / "1.exr", folder / "2.exr"]
        for seed, image in enumerate(images, 1):
            run(etendue, "render", SCENE, "-o", image, "--size", f"{WIDTH}x{HEIGHT}", "--spp", 8, "--seed", seed, "-q")
        run(etendue, "compare", *images, "--report", folder / "compare", status=(1,))
        expected = [values(etendue, image) for image in images]
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        visit(browser, folder / "compare/index.html", ["A", "B"], expected)
        for seed, image in enumerate(images, 1):
            run(etendue, "render", SCENE, "-o", image, "--size", "320x240", "--spp", 2, "--seed", seed, "-q")
        run(etendue, "compare", *images, "--report", folder / "large", status=(1,))
        large = [values(etendue, image) for image in images]
        visit(browser, folder / "large/index.html", ["A", "B"], large, use_large)
        if python:
            run(etendue, "crosscheck", SCENE, "--size", f"{WIDTH}x{HEIGHT}", "--python", python,
                "--report", folder / "crosscheck", status=(0, 1, 2))
            file = folder / "crosscheck/index.html"
            data = re.search(r'id="data">(.*?)</script>', file.read_text(), re.S)
            visit(browser, file, json.loads(data[1])["sides"])
        browser.close()


if __name__ == "__main__":
    main()
