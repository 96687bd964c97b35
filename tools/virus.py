#!/usr/bin/env python3
"""Writes scenes/virus.xml: a virus as a scene graph, with spikes at the points of a Poisson disc on a sphere.

The points are found by rejection: one drawn uniformly is kept if it is far enough from all that were kept before.
A spike at the spherical angles (φ, θ) stands under Rz(φ)·Ry(θ)·T(0, 0, 1). All spikes are instances of one
shapegroup; the virus is a group of its own, and stands in the scene three times.

    tools/virus.py [--seed N] [--spikes ANGLE] [--knobs ANGLE] > scenes/virus.xml
"""
import argparse
import math
import random

HEAD = """\
<!-- A virus as a scene graph: groups in groups, each under its transform and with its material; the spikes are
     instances of one shapegroup. Written by tools/virus.py{arguments}. -->
<scene version="3.0.0">
    <default name="spp" value="64"/>
    <default name="resx" value="480"/>
    <default name="resy" value="300"/>

    <integrator type="path">
        <integer name="max_depth" value="6"/>
    </integrator>

    <sensor type="perspective">
        <float name="fov" value="32"/>
        <transform name="to_world">
            <lookat origin="0, 0, 8" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <sampler type="stratified">
            <integer name="sample_count" value="$spp"/>
        </sampler>
        <film type="hdrfilm">
            <integer name="width" value="$resx"/>
            <integer name="height" value="$resy"/>
        </film>
    </sensor>

    <emitter type="constant"><rgb name="radiance" value="0.022, 0.034, 0.055"/></emitter>
    <shape type="sphere">
        <point name="center" value="-5, 6, 7"/>
        <float name="radius" value="1.6"/>
        <emitter type="area"><rgb name="radiance" value="27, 25, 21"/></emitter>
    </shape>
    <shape type="sphere">
        <point name="center" value="7, -2, -5"/>
        <float name="radius" value="2"/>
        <emitter type="area"><rgb name="radiance" value="9, 13, 19"/></emitter>
    </shape>

    <bsdf type="plastic" id="skin"><rgb name="diffuse_reflectance" value="0.42, 0.43, 0.50"/></bsdf>
    <bsdf type="plastic" id="coral"><rgb name="diffuse_reflectance" value="0.62, 0.07, 0.05"/></bsdf>
    <bsdf type="diffuse" id="stalk"><rgb name="reflectance" value="0.58, 0.22, 0.16"/></bsdf>
    <bsdf type="diffuse" id="amber"><rgb name="reflectance" value="0.80, 0.46, 0.08"/></bsdf>

    <!-- Along +z from the skin: a stalk, and on it a crown of three lobes. -->
    <shape type="shapegroup" id="spike">
        <shape type="cone">
            <ref id="stalk"/>
            <point name="p0" value="0, 0, -0.05"/>
            <point name="p1" value="0, 0, 0.36"/>
            <float name="radius" value="0.055"/>
            <boolean name="base" value="false"/>
        </shape>
        <shape type="group">
            <ref id="coral"/>
            <transform name="to_world"><translate z="0.3"/></transform>
            <shape type="sphere" id="lobe">
                <point name="center" value="0.055, 0, 0"/>
                <float name="radius" value="0.068"/>
            </shape>
            <shape type="group">
                <transform name="to_world"><rotate z="1" angle="120"/></transform>
                <ref id="lobe"/>
            </shape>
            <shape type="group">
                <transform name="to_world"><rotate z="1" angle="240"/></transform>
                <ref id="lobe"/>
            </shape>
        </shape>
    </shape>

    <shape type="group" id="virus">
        <transform name="to_world">
            <rotate x="1" angle="-62"/>
            <rotate y="1" angle="12"/>
        </transform>
        <shape type="sphere"><ref id="skin"/></shape>
"""

TAIL = """\
    </shape>

    <shape type="group">
        <transform name="to_world">
            <rotate z="1" angle="70"/>
            <scale value="0.42"/>
            <translate x="2.05" y="1.0" z="-1.2"/>
        </transform>
        <ref id="virus"/>
    </shape>
    <shape type="group">
        <transform name="to_world">
            <rotate y="1" angle="130"/>
            <scale value="0.5"/>
            <translate x="-2.45" y="-1.2" z="-3.2"/>
        </transform>
        <ref id="virus"/>
    </shape>
</scene>
"""


def direction(rng):
    """A unit vector, uniform over the sphere."""
    z, phi = rng.uniform(-1, 1), rng.uniform(0, 2 * math.pi)
    rim = math.sqrt(1 - z * z)
    return rim * math.cos(phi), rim * math.sin(phi), z


def angle_between(a, b):
    return math.acos(max(-1.0, min(1.0, sum(x * y for x, y in zip(a, b)))))


def poisson_disc(rng, least, taken=(), tries=20_000):
    """Directions at least the angle `least` from each other and from all of `taken`."""
    kept = []
    for _ in range(tries):
        candidate = direction(rng)
        if all(angle_between(candidate, other) >= least for other in [*taken, *kept]):
            kept.append(candidate)
    return kept


def placed(point):
    """Rz(φ)·Ry(θ)·T(0, 0, 1), its operations in the order in which they are carried out."""
    theta, phi = math.acos(point[2]), math.atan2(point[1], point[0])
    return (f'<translate z="1"/><rotate y="1" angle="{math.degrees(theta):.2f}"/>'
            f'<rotate z="1" angle="{math.degrees(phi):.2f}"/>')


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--spikes", type=float, default=0.36, help="least angle between spikes, in radians")
    parser.add_argument("--knobs", type=float, default=0.2, help="least angle between knobs and all else")
    arguments = parser.parse_args()
    rng = random.Random(arguments.seed)
    spikes = poisson_disc(rng, arguments.spikes)
    knobs = poisson_disc(rng, arguments.knobs, taken=spikes)

    said = "".join(f" --{name} {value}" for name, value in vars(arguments).items()
                   if value != parser.get_default(name))
    out = [HEAD.replace("{arguments}", said)]
    out.append(f"        <!-- {len(spikes)} spikes. -->\n")
    for point in spikes:
        turn, length = rng.uniform(0, 120), rng.uniform(0.9, 1.15)
        out.append(
            '        <shape type="instance"><transform name="to_world">'
            f'<scale x="1" y="1" z="{length:.3f}"/><rotate z="1" angle="{turn:.1f}"/>{placed(point)}'
            '</transform><ref id="spike"/></shape>\n')
    out.append(f"        <!-- {len(knobs)} knobs. -->\n"
               '        <shape type="group"><ref id="amber"/>\n')
    for i, point in enumerate(knobs):
        body = ('<shape type="sphere" id="knob"><float name="radius" value="0.05"/></shape>' if i == 0
                else '<ref id="knob"/>')
        out.append('            <shape type="group"><transform name="to_world">'
                   f'{placed(point)}</transform>{body}</shape>\n')
    out.append("        </shape>\n" + TAIL)
    print("".join(out), end="")


if __name__ == "__main__":
    main()
