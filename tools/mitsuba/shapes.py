"""Shapes `plane` and `cone` for Mitsuba 3, as Étendue has them, as meshes. They run in every variant.

`plane`: the infinite plane z = 0 facing +z, under `to_world` and `flip_normals`, with texture coordinates
(p + 1)/2. The mesh ends 16384 units from the origin, and its cells double in size from there outward, so that
distances near the origin keep their precision.

`cone`: from the circle of `radius` (1) around `p0` (the origin) to the apex `p1` (0, 0, 1), under `to_world` and
`flip_normals`, with a cylinder's texture coordinates (φ/2π, height) and, with `base` (true), a disk's on the
circle that closes it. 4096 sectors deviate from the round shape by 3e-7 of the radius.

Set the variant, then import this file: it registers both.
"""
import mitsuba as mi
import numpy as np

SECTORS = 4096
DOUBLINGS = 14


def take(props, name, default):
    """A property that Mitsuba's own mesh is not to see."""
    value = props.get(name, default)
    if name in props:
        del props[name]
    return value


def mesh(name, props, vertices, normals, uvs, faces):
    """A mesh in world space of one in object space."""
    matrix = np.array(take(props, 'to_world', mi.ScalarTransform4f()).matrix, dtype=np.float64).reshape(4, 4)
    linear = matrix[:3, :3]
    vertices = vertices @ linear.T + matrix[:3, 3]
    normals = normals @ np.linalg.inv(linear)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # A mirroring transform turns triangles over, and not the surface.
    if (np.linalg.det(linear) < 0) != take(props, 'flip_normals', False):
        faces = faces[:, ::-1]
    corners = vertices[faces]
    front = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals *= np.sign((front * normals[faces[:, 0]]).sum(1)[0])
    result = mi.Mesh(name, len(vertices), len(faces), props=props, has_vertex_normals=True,
                     has_vertex_texcoords=True)
    parameters = mi.traverse(result)
    for key, value in (('vertex_positions', vertices), ('vertex_normals', normals), ('vertex_texcoords', uvs)):
        parameters[key] = np.ascontiguousarray(value, dtype=np.float32).ravel()
    parameters['faces'] = np.ascontiguousarray(faces, dtype=np.uint32).ravel()
    parameters.update()
    return result


def frame(n):
    """Two unit vectors at right angles to n (Duff et al., 2017), as a cylinder has them."""
    sign = np.copysign(1.0, n[2])
    a = -1 / (sign + n[2])
    b = n[0] * n[1] * a
    return np.array([1 + sign * n[0] ** 2 * a, sign * b, -sign * n[0]]), np.array([b, sign + n[1] ** 2 * a, -n[1]])


def plane(props):
    steps = 2.0 ** np.arange(DOUBLINGS + 1)
    ticks = np.concatenate([-steps[::-1], [0.0], steps])
    n = len(ticks)
    x, y = np.meshgrid(ticks, ticks)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(n * n)], 1)
    low = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.stack([low, low + 1, low + n + 1], 1), np.stack([low, low + n + 1, low + n], 1)])
    normals = np.tile([0.0, 0.0, 1.0], (n * n, 1))
    return mesh('plane', props, vertices, normals, (vertices[:, :2] + 1) / 2, faces)


def cone(props):
    radius = take(props, 'radius', 1.0)
    p0 = np.array(take(props, 'p0', mi.ScalarPoint3f(0, 0, 0)), dtype=np.float64)
    p1 = np.array(take(props, 'p1', mi.ScalarPoint3f(0, 0, 1)), dtype=np.float64)
    with_base = take(props, 'base', True)
    axis = p1 - p0
    height = np.linalg.norm(axis)
    axis /= height
    s, t = frame(axis)
    rim, middle = np.arange(SECTORS + 1) / SECTORS, (np.arange(SECTORS) + 0.5) / SECTORS

    def outward(turn):
        angle = 2 * np.pi * turn[:, None]
        return np.cos(angle) * s + np.sin(angle) * t

    # Across the slope (radius inward on the way up) the normal leans up by radius/height.
    def slanted(turn):
        return outward(turn) * height + axis * radius

    around = np.arange(SECTORS)
    vertices = [p0 + radius * outward(rim), np.tile(p1, (SECTORS, 1))]
    normals = [slanted(rim), slanted(middle)]
    uvs = [np.stack([rim, 0 * rim], 1), np.stack([middle, 0 * middle + 1], 1)]
    faces = [np.stack([around, around + 1, around + SECTORS + 1], 1)]
    if with_base:
        first = 2 * SECTORS + 1
        vertices += [p0 + radius * outward(rim), np.tile(p0, (SECTORS, 1))]
        normals += [np.tile(-axis, (2 * SECTORS + 1, 1))]
        uvs += [np.stack([0 * rim + 1, rim], 1), np.stack([0 * middle, middle], 1)]
        faces += [first + np.stack([around + 1, around, around + SECTORS + 1], 1)]
    return mesh('cone', props, *(np.concatenate(part) for part in (vertices, normals, uvs, faces)))


mi.register_shape('plane', plane)
mi.register_shape('cone', cone)
