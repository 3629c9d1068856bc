#!/usr/bin/env python3
"""The surfaces of a run's tools, of any shape, as triangles.

   tool_surface.py RUN

writes RUN/tools.xdmf (with tools.h5): the tools where they are at each snapshot, for ParaView beside
particles.xdmf. As a module: `triangles(tool, reach)` of a tool of case.nml at the start, `section` of such by
a plane along the axes."""

import argparse
import json
import math
import os
import sys
from pathlib import Path

import numpy as np

from .indentation import unit_axis
from .run_data import History, Unreadable, carried, read_namelists


def word(tool, name, default=None):
    return tool[name][0] if name in tool else default


def profile_of(tool, reach):
    """A turned tool's profile of (distance from the axis, height above the tip), as far as `reach` (m); None
    of another shape."""
    shape, radius = word(tool, "shape"), word(tool, "radius")
    if shape == "sphere":
        arc = np.linspace(0, math.pi, 49)
        if radius > reach:
            arc = np.linspace(0, math.asin(reach / radius), 49)
        return np.stack([radius * np.sin(arc), radius * (1 - np.cos(arc))], axis=1)
    if shape == "flat":
        rim = min(radius, 3 * reach)
        return np.array([[0, 0], [rim, 0], [rim, reach / 2]])
    if shape == "cone":
        a, r = math.radians(word(tool, "half_angle")), word(tool, "tip_radius", 0.0)
        arc = np.linspace(0, math.pi / 2 - a, 17) if r > 0 else np.zeros(1)
        cap = np.stack([r * np.sin(arc), r * (1 - np.cos(arc))], axis=1)
        far = max(reach, 2 * cap[-1, 0])
        return np.vstack([cap, [far, cap[-1, 1] + (far - cap[-1, 0]) / math.tan(a)]])
    if shape == "profile":
        radii, heights = np.array(tool["radii"], float), np.array(tool["heights"], float)
        slope = (radii[-1] - radii[-2]) / (heights[-1] - heights[-2])
        far = heights[-1] + max(reach - radii[-1], 0.0) / slope if slope > 0 else max(reach, 2 * heights[-1])
        table = np.stack([radii, heights], axis=1)
        if far > heights[-1]:
            table = np.vstack([table, [radii[-1] + slope * (far - heights[-1]), far]])
        return table if radii[0] == 0 else np.vstack([[0.0, 0.0], table])
    return None


def pyramid_lines(faces, half_angle, radius, reach, steps=9):
    """Lines of points across a pyramid, from its tip in the origin upwards as far as `reach` from the axis,
    rounded: all that is within a radius of a sharp one. Its surface is a part of a sphere about the sharp
    one's tip, strips of cylinders about its edges, faces."""
    sin, cos = math.sin(half_angle), math.cos(half_angle)
    normal = [
        np.array([cos * math.cos(a), cos * math.sin(a), -sin])
        for a in 2 * math.pi * np.arange(faces + 1) / faces
    ]
    around, along = [], []
    for k in range(faces):
        a = math.pi * (2 * k + 1) / faces
        for t in np.linspace(0, 1, steps if radius > 0 else 2):
            n = (1 - t) * normal[k] + t * normal[k + 1]
            around.append(n / np.linalg.norm(n))
            along.append(
                reach * np.array([math.cos(a), math.sin(a), 0]) / math.cos(math.pi / faces)
                + [0, 0, reach * cos / sin]
            )
    around, along = np.array([*around, around[0]]), np.array([*along, along[0]])
    middle, lines = np.array([0, 0, radius]), []
    for t in np.linspace(0, 1, steps if radius > 0 else 1):
        n = (1 - t) * np.array([0, 0, -1]) + t * around
        lines.append(middle + radius * n / np.linalg.norm(n, axis=1)[:, None])
    return np.array([*lines, middle + radius * around + along])


def triangles(tool, reach, base=Path(".")):
    """Triangles (n, 3, 3) of a tool of `case.nml` at the start, m. A tool without an end reaches that far
    (m). Files are looked for where the program looked (`base`: where it was started)."""
    tip, axis, shape = np.array(tool["tip"], dtype=float), unit_axis(tool), word(tool, "shape")
    if shape == "surface":
        return tip + read_surface(
            base / word(tool, "file"),
            word(tool, "scale", 1.0),
            tool.get("rotation", [0.0] * 3),
            tool.get("spacing"),
        )
    edge = np.array(tool.get("edge", [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0]), dtype=float)
    edge -= edge.dot(axis) * axis
    edge /= np.linalg.norm(edge)
    across = np.cross(axis, edge)
    profile = profile_of(tool, reach)
    if profile is not None:
        turn = 2 * math.pi * np.arange(73) / 72
        lines = [
            [tip - z * axis + r * (math.cos(a) * edge + math.sin(a) * across) for a in turn]
            for r, z in profile
        ]
    elif shape == "cylinder":
        r = word(tool, "radius")
        lines = [
            [
                tip - r * axis + r * (math.sin(a) * across + math.cos(a) * axis) + side * reach * edge
                for side in (-1, 1)
            ]
            for a in np.linspace(-math.pi, math.pi, 97)
        ]
    elif shape == "wedge":
        high = reach / math.tan(math.radians(word(tool, "half_angle")))
        lines = [
            [tip - abs(s) * high * axis + s * reach * across + side * reach * edge for side in (-1, 1)]
            for s in (-1, 0, 1)
        ]
    elif shape in ("berkovich", "pyramid"):
        faces = int(word(tool, "faces", 3))
        frame = np.array([edge, across, -axis])
        lines = (
            tip
            + pyramid_lines(
                faces, math.radians(word(tool, "half_angle", 65.27)), word(tool, "tip_radius", 0.0), reach
            )
            @ frame
        )
    else:
        raise Unreadable(f"the tool {word(tool, 'name')} is of shape {shape!r}, which is not known here")
    grid = np.array(lines)
    low, high = grid[:-1], grid[1:]
    found = np.concatenate(
        [
            np.stack([low[:, :-1], low[:, 1:], high[:, 1:]], axis=2).reshape(-1, 3, 3),
            np.stack([low[:, :-1], high[:, 1:], high[:, :-1]], axis=2).reshape(-1, 3, 3),
        ]
    )
    area = np.linalg.norm(np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0]), axis=1)
    return found[area > 1e-12 * area.max()]


def read_surface(path, scale, rotation, spacing):
    """Triangles of a file of `shape='surface'`, scaled and turned, from the file's origin."""
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise Unreadable(f"{path}: {error.strerror}") from error
    if spacing is not None:
        if data[:4] == b"\x89HDF":
            import h5py

            with h5py.File(path, "r") as file:
                height = file["height"][:]
        else:
            height = np.loadtxt(path, ndmin=2)
        top = np.unravel_index(height.argmax(), height.shape)
        y, x = (np.arange(n) - t for n, t in zip(height.shape, top))
        x, y = np.meshgrid(x * spacing[0], y * spacing[1])
        grid = np.stack([x, y, scale * (height - height[top])], axis=-1)
        found = np.concatenate(
            [
                np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:]], axis=2).reshape(-1, 3, 3),
                np.stack([grid[:-1, :-1], grid[1:, 1:], grid[1:, :-1]], axis=2).reshape(-1, 3, 3),
            ]
        )
    elif len(data) >= 84 and 84 + 50 * int.from_bytes(data[80:84], "little") == len(data):
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
        found = scale * np.frombuffer(data, record, offset=84)["corners"].astype(float)
    else:
        lines = [line.split() for line in data.decode().splitlines()]
        if data.lstrip()[:5].lower() == b"solid":
            found = scale * np.array(
                [line[1:4] for line in lines if line and line[0].lower() == "vertex"], dtype=float
            )
        else:
            corners = np.array([line[1:4] for line in lines if line and line[0] == "v"], dtype=float)
            faces = [
                [int(item.split("/")[0]) for item in line[1:]] for line in lines if line and line[0] == "f"
            ]
            of = [t for f in faces for t in cut_ears(corners, [n - 1 if n > 0 else n for n in f])]
            found = scale * corners[of]
        found = found.reshape(-1, 3, 3)
    for axis, degrees in enumerate(rotation):
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        turn = np.eye(3)
        one, other = (axis + 1) % 3, (axis + 2) % 3
        turn[[one, one, other, other], [one, other, one, other]] = c, -s, s, c
        found = found @ turn.T
    return found


def cut_ears(corners, face):
    """Triangles of a polygon, convex or not: src/geometry/polygons.f90."""
    x = corners[face] - corners[face[0]]
    normal = np.cross(x, np.roll(x, -1, axis=0)).sum(axis=0)
    axis = int(np.argmax(np.abs(normal)))
    flat = x[:, [(axis + 1) % 3, (axis + 2) % 3]] * [1, np.sign(normal[axis])]

    def turn(a, b, c):
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    def is_ear(a, b, c):
        return turn(flat[a], flat[b], flat[c]) >= 0 and all(
            min(
                turn(flat[a], flat[b], flat[p]),
                turn(flat[b], flat[c], flat[p]),
                turn(flat[c], flat[a], flat[p]),
            )
            <= 0
            for p in left
            if p not in (a, b, c)
        )

    left, found = list(range(len(face))), []
    while len(left) > 2:
        n = len(left)
        k = next((k for k in range(1, n + 1) if is_ear(left[k - 1], left[k % n], left[(k + 1) % n])), None)
        if k is None:
            raise Unreadable("a face of the tool's file crosses itself")
        found.append([face[left[k - 1]], face[left[k % n]], face[left[(k + 1) % n]]])
        del left[k % n]
    return found


def section(found, normal, plane):
    """Line segments (n, 2, 3) where triangles cut the plane in which one coordinate has a value."""
    off = found[:, :, normal] - plane
    off = np.where(off == 0, 1e-300, off)
    ends = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        crosses = off[:, a] * off[:, b] < 0
        with np.errstate(all="ignore"):
            share = off[:, a] / (off[:, a] - off[:, b])
            ends.append(
                np.where(crosses[:, None], found[:, a] + share[:, None] * (found[:, b] - found[:, a]), np.nan)
            )
    ends = np.stack(ends, axis=1)
    cut = np.isfinite(ends[:, :, 0])
    pairs = ends[cut.sum(axis=1) == 2]
    return pairs[np.isfinite(pairs[:, :, 0])].reshape(-1, 2, 3)


def tools_of(run, case, reach, base=Path(".")):
    """Name, axis, triangles at the start and history of each tool that can be drawn; a word on stderr for
    each that cannot."""
    for tool in case.get("tool", []):
        name = word(tool, "name")
        path = run / f"tool_{name}.dat"
        try:
            if not path.is_file() or History(path).rows == 0:
                raise Unreadable(f"the tool {name} is not drawn: there is no {path.name} with a row")
            yield name, unit_axis(tool), triangles(tool, reach, base), History(path)
        except Unreadable as error:
            print(error, file=sys.stderr)


def reach_of(case):
    """How far tools without an end are drawn: half the size of the grid, m."""
    grid = case["grid"][0]
    return 0.5 * max(np.array(grid["upper"]) - np.array(grid["lower"]))


def write(run):
    """tools.xdmf and tools.h5 of a run; their paths, or none where there is nothing to write."""
    import h5py  # not in every Python that draws tools

    series = run / "particles.hdf.series"
    if not (run / "case.nml").is_file() or not series.is_file():
        raise Unreadable(
            f"{run}: there is no case.nml with particles.hdf.series: no run has written HDF5 snapshots there"
        )
    case = read_namelists(run / "case.nml")
    times = [file["time"] for file in json.loads(series.read_text())["files"]]
    tools = list(tools_of(run, case, reach_of(case)))
    if not tools or not times:
        return None
    heavy, light = run / ".tools.h5.part", run / ".tools.xdmf.part"
    with h5py.File(heavy, "w") as file, open(light, "w", encoding="utf-8") as text:
        count = sum(len(found) for _, _, found, _ in tools)
        file["triangles"] = np.arange(3 * count).reshape(-1, 3)
        file["tool"] = np.concatenate(
            [np.full(len(found), n + 1) for n, (_, _, found, _) in enumerate(tools)]
        )
        text.write(
            '<?xml version="1.0"?>\n<Xdmf Version="3.0"><Domain>\n'
            '<Grid Name="tools" GridType="Collection" CollectionType="Temporal">\n'
        )
        for n, time in enumerate(times):
            file[f"corners_{n}"] = np.concatenate(
                [carried(history, axis, time, found.reshape(-1, 3)) for _, axis, found, history in tools]
            )
            text.write(
                f'<Grid Name="tools"><Time Value="{time!r}"/>\n<Topology TopologyType="Triangle" '
                f'NumberOfElements="{count}">'
                f'<DataItem Dimensions="{count} 3" NumberType="Int" Precision="8" '
                'Format="HDF">tools.h5:/triangles</DataItem>'
                f'</Topology>\n<Geometry GeometryType="XYZ"><DataItem Dimensions="{3 * count} 3" '
                'NumberType="Float" '
                f'Precision="8" Format="HDF">tools.h5:/corners_{n}</DataItem></Geometry>\n<Attribute '
                'Name="tool" '
                f'AttributeType="Scalar" Center="Cell"><DataItem Dimensions="{count}" NumberType="Int" '
                f'Precision="8" Format="HDF">tools.h5:/tool</DataItem></Attribute></Grid>\n'
            )
        text.write("</Grid></Domain></Xdmf>\n")
    os.replace(heavy, run / "tools.h5")
    os.replace(light, run / "tools.xdmf")
    return run / "tools.xdmf", run / "tools.h5"


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path)
    try:
        written = write(parser.parse_args().run)
    except Unreadable as error:
        print(error, file=sys.stderr)
        return 2
    for path in written or ():
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
