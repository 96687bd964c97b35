"""Mitsuba's side of the bench: renders the scene for each line that comes, and answers with seconds of CPU time.

Arguments: variant, scene, width, height, samples per pixel, definitions as name=value. The first render compiles the
scene's kernel and is not answered for.
"""

import sys
import time

import mitsuba as mi

variant, path, width, height, spp, *defines = sys.argv[1:]
mi.set_variant(variant)

import drjit as dr  # noqa: E402 (Dr.Jit wants the variant first)

mi.set_log_level(mi.LogLevel.Error)
scene = mi.load_file(path, **dict(define.split("=", 1) for define in defines))
sensor = scene.sensors()[0]
film = mi.traverse(sensor)
film["film.size"] = [int(width), int(height)]
film["film.crop_size"] = [int(width), int(height)]
film.update()


def render(seed):
    image = mi.render(scene, sensor=sensor, spp=int(spp), seed=seed)
    dr.eval(image)
    dr.sync_thread()


render(0)
print("ready", flush=True)
for seed, _ in enumerate(sys.stdin, 1):
    start = time.process_time()
    render(seed)
    print(time.process_time() - start, flush=True)
