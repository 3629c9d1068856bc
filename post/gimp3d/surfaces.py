#!/usr/bin/env python3
"""Closed surfaces of triangles for shape='surface', written as STL or OBJ.

    surfaces.py sphere OUT --radius R --facet F
    surfaces.py cone OUT --half-angle A --height H --facet F
    surfaces.py die OUT --entry RE --exit RX --outer RO --angle A --land L --facet F

Spheres and cones have their foremost point in the origin, the rest above. A die is about z, open at the top;
its origin is where the land begins. No edge of a sphere or cone is longer than the facet F. Angles are in
degrees.
Lengths are in the unit of the file (`scale` of the scene makes metres of it). As a module it makes any turned
body: `revolve(profile, segments)`.
"""

import argparse
import math
import struct
import sys

import numpy as np


def revolve(profile, segments):
    """Triangles (n, 3, 3) of a profile of points (radius, z) turned about z.

    The profile runs so that its outside is on the right hand, seen with the radius to the right and z
    upwards. It begins and ends on the axis (radius 0), or it is closed (its last point is its first)."""
    angle = 2 * math.pi * np.arange(segments) / segments
    turn = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    # one point on the axis, exactly
    rings = [
        np.column_stack([r * turn, np.full(segments, z)]) if r > 0 else np.tile([0.0, 0.0, z], (segments, 1))
        for r, z in profile
    ]
    found = []
    for (low, (r0, _)), (high, (r1, _)) in zip(zip(rings, profile), zip(rings[1:], profile[1:])):
        for i in range(segments):
            k = (i + 1) % segments
            if r0 > 0:
                found.append([low[i], low[k], high[k] if r1 > 0 else high[i]])
            if r1 > 0:
                found.append([low[i], high[k], high[i]])
    return np.array(found)


def box(lower, upper):
    """Triangles of a box along the axes."""
    corner = np.array([[(lower, upper)[n >> a & 1][a] for a in range(3)] for n in range(8)])
    of = [
        [0, 2, 3],
        [0, 3, 1],
        [4, 5, 7],
        [4, 7, 6],
        [0, 1, 5],
        [0, 5, 4],
        [2, 6, 7],
        [2, 7, 3],
        [0, 4, 6],
        [0, 6, 2],
        [1, 3, 7],
        [1, 7, 5],
    ]
    return corner[np.array(of)]


def sphere(radius, facet):
    """A sphere whose lowest point is the origin: an octahedron whose faces are divided, so that no edge is
    longer than `facet`; corners lie on the sphere."""
    return finer(lambda n: divided_octahedron(radius, n), 0.5 * math.pi * radius / facet, facet)


def finer(make, n, facet):
    """What is made with n divisions or somewhat more, so that no edge is longer than `facet`."""
    n = max(2, math.ceil(n))
    tried = make(8)
    longest = np.linalg.norm(tried - np.roll(tried, 1, axis=1), axis=2).max() * 8 / n
    return make(max(n, math.ceil(1.02 * n * longest / facet)))


def divided_octahedron(radius, n):
    """A sphere about (0, 0, radius) as an octahedron whose edges are divided in n."""
    found = []
    for signs in ((x, y, z) for x in (1, -1) for y in (1, -1) for z in (1, -1)):

        def corner(i, j, signs=signs):
            # equal angles along the edges
            a = np.sin(0.5 * np.pi * np.array([i, j, n - i - j]) / n) * signs
            return radius * a / np.linalg.norm(a) + [0, 0, radius]

        for i in range(n):
            for j in range(n - i):
                found.append([corner(i, j), corner(i + 1, j), corner(i, j + 1)])
                if i + j < n - 1:
                    found.append([corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)])
                if signs[0] * signs[1] * signs[2] < 0:
                    found[-1].reverse()
                    if i + j < n - 1:
                        found[-2].reverse()
    return np.array(found)


def bowl(profile):
    """Triangles of a profile of points (radius, z) that begins on the axis, turned about z; its outside is
    below. Ring m has m edges in each eighth, so that triangles stay well shaped also where they meet on the
    axis."""

    def corner(m, j):
        angle = 0.25 * math.pi * j / m if m else 0.0
        return [profile[m][0] * math.cos(angle), profile[m][0] * math.sin(angle), profile[m][1]]

    found = []
    for m in range(1, len(profile)):
        for j in range(8 * m):
            inner = (j // m) * (m - 1) + j % m, (j // m) * (m - 1) + j % m + 1
            found.append(
                [corner(m, j), corner(m - 1, inner[0] % max(1, 8 * (m - 1))), corner(m, (j + 1) % (8 * m))]
            )
            if j % m < m - 1:
                found.append(
                    [
                        corner(m, (j + 1) % (8 * m)),
                        corner(m - 1, inner[0]),
                        corner(m - 1, inner[1] % (8 * (m - 1))),
                    ]
                )
    return np.array(found)


def cone(half_angle, height, facet):
    """A cone on its tip, closed by a lid; half angle in degrees."""
    rim = height * math.tan(math.radians(half_angle))

    def make(n):
        steps = np.arange(n + 1) / n
        lid = bowl([(rim * x, height) for x in steps])
        return np.concatenate([bowl([(rim * x, height * x) for x in steps]), lid[:, ::-1]])

    return finer(make, math.hypot(rim, height) / facet, facet)


def die(entry, exit, outer, angle, land, facet):
    """A drawing die about z: material enters at the top through a hole of radius `entry`, which narrows at
    `angle` (degrees, half the opening) to `exit`; then a straight land. The origin is where the land
    begins."""
    top = (entry - exit) / math.tan(math.radians(angle))
    mouth = top + (entry - exit)
    profile = [
        (exit, -land),
        (outer, -land),
        (outer, mouth),
        (entry, mouth),
        (entry, top),
        (exit, 0.0),
        (exit, -land),
    ]
    return revolve(profile, max(16, round(2 * math.pi * exit / facet)))


def prism(outline, low, high):
    """Triangles of an outline (points (x, y), counter-clockwise, all seen from (0, 0)) from z = low to z =
    high: wheels with teeth, cams, stars."""
    found = []
    for (x, y), (u, v) in zip(outline, [*outline[1:], outline[0]]):
        found += [
            [(0, 0, low), (u, v, low), (x, y, low)],
            [(0, 0, high), (x, y, high), (u, v, high)],
            [(x, y, low), (u, v, low), (u, v, high)],
            [(x, y, low), (u, v, high), (x, y, high)],
        ]
    return np.array(found, dtype=float)


def write(path, triangles):
    """By the name: .obj, .txt.stl (STL as text), else binary STL."""
    path = str(path)
    if path.endswith('.obj'):
        corner, of = np.unique(np.asarray(triangles).reshape(-1, 3), axis=0, return_inverse=True)
        with open(path, 'w', encoding='utf-8') as f:
            f.writelines('v %r %r %r\n' % tuple(map(float, c)) for c in corner)
            f.writelines('f %d %d %d\n' % tuple(t) for t in of.reshape(-1, 3) + 1)
        return
    t = np.asarray(triangles, dtype='<f4')
    if path.endswith('.txt.stl'):
        with open(path, 'w', encoding='utf-8') as f:
            f.write('solid surface\n')
            for corners in t:
                f.write('facet normal 0 0 0\nouter loop\n')
                f.writelines('vertex %.9g %.9g %.9g\n' % tuple(c) for c in corners)
                f.write('endloop\nendfacet\n')
            f.write('endsolid surface\n')
        return
    record = np.zeros(len(t), dtype=[('normal', '<f4', 3), ('corners', '<f4', (3, 3)), ('rest', '<u2')])
    record['corners'] = t
    with open(path, 'wb') as f:
        f.write(b'gimp3d surface'.ljust(80) + struct.pack('<I', len(t)) + record.tobytes())


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    kinds = parser.add_subparsers(dest='kind', required=True)
    for make, names in (
        (sphere, ['radius', 'facet']),
        (cone, ['half_angle', 'height', 'facet']),
        (die, ['entry', 'exit', 'outer', 'angle', 'land', 'facet']),
    ):
        kind = kinds.add_parser(make.__name__)
        kind.add_argument('out')
        kind.set_defaults(make=make, names=names)
        for name in names:
            kind.add_argument('--' + name.replace('_', '-'), type=float, required=True)
    asked = parser.parse_args()
    triangles = asked.make(*(getattr(asked, name) for name in asked.names))
    write(asked.out, triangles)
    print(f'{asked.out}: {len(triangles)} triangles')


if __name__ == '__main__':
    sys.exit(main())
