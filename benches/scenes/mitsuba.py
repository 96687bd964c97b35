"""Mitsuba's side of the bench: renders the scene for each line that comes, and answers with seconds of CPU time.

Arguments: variant, scene, width, height, samples per pixel, the sampler or nothing. A line is a seed, and the file that
the image goes to, if any. The first render compiles the scene's kernel and is not answered for.
"""

import os
import re
import sys
import time

import mitsuba as mi

variant, path, width, height, spp, sampler = sys.argv[1:]
mi.set_variant(variant)

import drjit as dr  # noqa: E402 (Dr.Jit wants the variant first)

mi.set_log_level(mi.LogLevel.Error)
if sampler:
    mi.file_resolver().append(os.path.dirname(os.path.abspath(path)))
    with open(path) as file:
        text = re.sub(r'(<sampler\s+type=")[^"]*', rf"\g<1>{sampler}", file.read())
    scene = mi.load_string(text)
else:
    scene = mi.load_file(path)
sensor = scene.sensors()[0]
film = mi.traverse(sensor)
film["film.size"] = [int(width), int(height)]
film["film.crop_size"] = [int(width), int(height)]
film.update()


def render(seed):
    image = mi.render(scene, sensor=sensor, spp=int(spp), seed=seed)
    dr.eval(image)
    dr.sync_thread()
    return image


render(0)
print("ready", flush=True)
for line in sys.stdin:
    seed, _, file = line.strip().partition(" ")
    start = time.process_time()
    image = render(int(seed))
    took = time.process_time() - start
    if file:
        mi.Bitmap(image).write(file)
    print(took, flush=True)
