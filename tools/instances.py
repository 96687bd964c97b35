#!/usr/bin/env python3
"""A scene of very many instances of one mesh, for Étendue and Mitsuba alike: a cloud in the cube [-1, 1]³, each copy
turned anywhere.

  tools/instances.py dragon.ply 100000 cloud.xml --scale 0.35

With a hundred thousand dragons of 871 414 triangles that is 87 billion.
"""
import argparse
import math
import random
from pathlib import Path
from xml.sax.saxutils import quoteattr

HEAD = """<scene version="3.0.0">
    <default name="spp" value="16"/>
    <integrator type="path"><integer name="max_depth" value="4"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="45"/>
        <transform name="to_world"><lookat origin="1.6, 1.4, 2" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm">
            <integer name="width" value="1024"/><integer name="height" value="768"/><rfilter type="box"/>
        </film>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    </sensor>
    <emitter type="constant"/>
    <shape type="shapegroup" id="one">
        <shape type="{type}"><string name="filename" value={mesh}/></shape>
    </shape>
"""
COPY = (
    '    <shape type="instance"><ref id="one"/>'
    '<transform name="to_world"><matrix value="{} 0 0 0 1"/></transform></shape>\n'
)


def turned(draw):
    """The rows of a rotation, about y and then about x, and the rest of a matrix: few elements make a short file."""
    (a, b), size, at = (draw(0, math.tau), draw(0, math.tau)), draw(0.7, 1.3), [draw(-1, 1) for _ in range(3)]
    (c, s), (d, t) = ((math.cos(x), math.sin(x)) for x in (a, b))
    rows = ((c, 0, s), (t * s, d, -t * c), (-d * s, t, d * c))
    return size, rows, at



def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mesh", type=Path, help=".ply or .obj")
    parser.add_argument("count", type=int, help="how many copies")
    parser.add_argument("out", type=Path, help="the scene file")
    parser.add_argument("--scale", type=float, default=0.35, help="of the copies, give or take 30 %% (default: 0.35)")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    draw = random.Random(options.seed).uniform
    mesh = options.mesh.resolve()
    with options.out.open("w") as out:
        out.write(HEAD.format(type=mesh.suffix[1:].lower(), mesh=quoteattr(str(mesh))))
        for _ in range(options.count):
            size, rows, at = turned(draw)
            scaled = ([options.scale * size * x for x in row] + [at[i]] for i, row in enumerate(rows))
            out.write(COPY.format(" ".join(f"{x:.6g}" for row in scaled for x in row)))
        out.write("</scene>\n")


if __name__ == "__main__":
    main()
