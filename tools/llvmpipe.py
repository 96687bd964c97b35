#!/usr/bin/env python3
"""The integrator `raster` beside Mesa's llvmpipe: how long a mesh in memory takes to become a picture, in turns.

  llvmpipe.py MESH.ply [--etendue target/release/etendue] [--size 1024x768] [--rounds 5] [--keep FOLDER]

Both look through the camera of a bare mesh, with one sample a pixel and no shadows. llvmpipe draws the mesh's indexed
triangles with their vertices' normals from buffers that it has, shades each fragment by one light, and reads the picture
back; a first drawing, which compiles its shaders, is not counted. Étendue's time is its own `seconds to render`, which begins
with vertices and triangles too, and shades by the sixteen directions of its sky and a lamp, on a ground. Needs Debian's
libegl1, libgl1-mesa-dri, and Python with PyPI moderngl 5.12, numpy and trimesh 4.
"""
import argparse
import os
import re
import statistics
import subprocess
import tempfile
import time
from pathlib import Path
from xml.etree import ElementTree

os.environ.setdefault("LIBGL_ALWAYS_SOFTWARE", "1")
os.environ.setdefault("LP_NUM_THREADS", str(os.cpu_count()))

import moderngl
import numpy as np
import trimesh

VERTEX = """#version 330
uniform mat4 seen; in vec3 place; in vec3 normal; out vec3 n;
void main() { gl_Position = seen * vec4(place, 1.0); n = normal; }"""
FRAGMENT = """#version 330
uniform vec3 light; in vec3 n; out vec4 color;
void main() { color = vec4(vec3(0.65, 0.6, 0.52) * (0.2 + 0.8 * abs(dot(normalize(n), light))), 1.0); }"""
RASTER = "<integrator type='raster'><boolean name='shadows' value='false'/><integer name='multisamples' value='1'/></integrator>"


def camera(scene, size):
    """From the world to clip space, by the sensor of a scene that `--write-scene` wrote."""
    sensor = scene.getroot().find("sensor")
    number = lambda name: float(sensor.find(f"float[@name='{name}']").get("value"))
    lookat = sensor.find("transform/lookat")
    eye, target, up = (np.array([float(v) for v in lookat.get(n).split(",")]) for n in ("origin", "target", "up"))
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = right, np.cross(back, right), back
    view[:3, 3] = -view[:3, :3] @ eye
    near, far = number("near_clip"), number("far_clip")
    scale = 1 / np.tan(np.radians(number("fov")) / 2)  # of the smaller side
    smaller = min(size)
    clip = np.zeros((4, 4))
    clip[0, 0], clip[1, 1] = scale * smaller / size[0], scale * smaller / size[1]
    clip[2, 2:] = (near + far) / (near - far), 2 * near * far / (near - far)
    clip[3, 2] = -1
    return clip @ view


def normals(mesh):
    """Of vertices: the mean of their faces', by area."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    of_faces = np.cross(b - a, c - a)
    corners = mesh.faces.ravel()
    sums = [np.bincount(corners, np.repeat(of_faces[:, axis], 3), len(mesh.vertices)) for axis in range(3)]
    return np.stack(sums, axis=1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("mesh", type=Path)
    parser.add_argument("--etendue", default="target/release/etendue")
    parser.add_argument("--size", default="1024x768")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--keep", type=Path, help="where the two pictures go")
    args = parser.parse_args()
    size = tuple(map(int, args.size.split("x")))
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        text = folder / "scene.xml"
        picture = args.keep / "etendue.png" if args.keep else folder / "etendue.png"
        command = [args.etendue, "render", str(args.mesh), "-o", str(picture), "--size", args.size, "--spp", "1", "--quiet"]
        subprocess.run([*command, "--integrator", "raster", "--write-scene", str(text)], check=True)
        scene = ElementTree.parse(text)
        root = scene.getroot()
        root.remove(root.find("integrator"))
        root.insert(0, ElementTree.fromstring(RASTER))
        scene.write(text)

        context = moderngl.create_standalone_context(backend="egl")
        mesh = trimesh.load(args.mesh, process=False)
        program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        seen = camera(scene, size)
        program["seen"].write(seen.T.astype("f4").tobytes())
        program["light"].value = (0.45, 0.75, 0.48)
        vertices = np.hstack([mesh.vertices, normals(mesh)]).astype("f4")
        array = context.vertex_array(program, [(context.buffer(vertices.tobytes()), "3f 3f", "place", "normal")],
                                     context.buffer(mesh.faces.astype("u4").tobytes()))
        target = context.framebuffer([context.texture(size, 4)], context.depth_renderbuffer(size))
        target.use()
        context.enable(moderngl.DEPTH_TEST)

        def theirs():
            begin = time.perf_counter()
            target.clear()
            array.render()
            pixels = target.read(components=3)
            return time.perf_counter() - begin, pixels

        def ours():
            told = subprocess.run([args.etendue, "render", str(text), "-o", str(picture), "--stats"],
                                  capture_output=True, text=True, check=True)
            return float(re.search(r"seconds to render\s+([\d.]+)", told.stdout + told.stderr).group(1))

        pixels = theirs()[1]
        if args.keep:
            rows = np.frombuffer(pixels, "u1").reshape(size[1], -1)[::-1]
            (args.keep / "llvmpipe.ppm").write_bytes(f"P6 {size[0]} {size[1]} 255\n".encode() + rows.tobytes())
        rounds = [(ours(), theirs()[0]) for _ in range(args.rounds)]
        print(f"{len(mesh.faces)} triangles, {args.size}, {context.info['GL_RENDERER']}, {os.environ['LP_NUM_THREADS']} threads")
        for name, times in zip(("étendue", "llvmpipe"), zip(*rounds)):
            print(f"{name:9} {statistics.median(times):.3f} s ({min(times):.3f} to {max(times):.3f})")
        ratios = [theirs / ours for ours, theirs in rounds]
        print(f"llvmpipe / étendue {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})")


main()
