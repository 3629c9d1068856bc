#!/usr/bin/env python3
"""The texture of crystals in a snapshot: pole figures, and how much of the material lies near the rolling
components of fcc metals.

   pole_figure.py [options] RUN      RUN/pole_figure.png, and a table

   --snapshot N        number of the snapshot, from 0; -1 the last one (default)
   --pole 111          family of planes: 111 (default), 100, 110, ...
   --material NAME     only bodies of this material
   --rolling x         axis of the grid along which the material gets longer (default x)
   --normal z          axis across the sheet (default z)
   --within 15         degrees: an orientation so near to a component counts as it

Equal-area projection of the upper half of the sphere, normal in the middle, rolling direction to the right.
Densities are multiples of what orientations without order have. Components are given with all variants that a
sheet's three mirror planes make of them."""

import argparse
import sys
from itertools import permutations, product
from pathlib import Path

import numpy as np

from .run_data import Particles, Unreadable, read_namelists, snapshot_paths

# plane of the sheet, rolling direction
COMPONENTS = {
    "copper": ((1, 1, 2), (1, 1, -1)),
    "brass": ((0, 1, 1), (2, 1, -1)),
    "S": ((1, 2, 3), (6, 3, -4)),
    "Goss": ((0, 1, 1), (1, 0, 0)),
    "cube": ((0, 0, 1), (1, 0, 0)),
}


def cube_rotations():
    """The 24 rotations of a cube, as matrices."""
    return np.array(
        [
            turn
            for order in permutations(range(3))
            for signs in product((1, -1), repeat=3)
            for turn in [np.eye(3)[list(order)] * np.array(signs)[:, None]]
            if np.linalg.det(turn) > 0
        ]
    )


def matrices(quaternions):
    """(n, 3, 3): columns are where the crystal's axes point."""
    w, x, y, z = np.moveaxis(quaternions / np.linalg.norm(quaternions, axis=1)[:, None], 1, 0)
    return np.moveaxis(
        np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        ),
        2,
        0,
    )


def component(plane, direction):
    """All orientations (n, 3, 3) of a component in the sheet's frame (rolling, transverse, normal)."""
    n, r = (np.array(v) / np.linalg.norm(v) for v in (plane, direction))
    ideal = np.array([r, np.cross(n, r), n])  # takes the crystal's components to the sheet's
    found = []
    # turned by half a turn about the sheet's axes, and its mirror images: those of cubes
    for a, b in product((1, -1), repeat=2):
        for mirror in (1, -1):  # are rotations again
            turn = (
                np.diag([a, b, a * b]) @ ideal
                if mirror == 1
                else np.diag([-a, b, a * b]) @ ideal @ -np.eye(3)
            )
            if not any(misorientation(turn[None], other)[0] < 1e-6 for other in found):
                found.append(turn)
    return np.array(found)


def misorientation(turns, other):
    """Smallest angle (rad) between orientations (n, 3, 3) and one, over the rotations of a cube."""
    between = np.swapaxes(turns, 1, 2) @ other
    trace = np.einsum("nij,sji->ns", between, cube_rotations()).max(axis=1)
    return np.arccos(np.clip((trace - 1) / 2, -1, 1))


def fractions(turns, weights, within):
    """Share of the weight within an angle (rad) of each component, and that of orientations without order."""
    found = {}
    for name, (plane, direction) in COMPONENTS.items():
        variants = component(plane, direction)
        near = np.min([misorientation(turns, one) for one in variants], axis=0) < within
        # a ball of that angle about one of the 24 alike has (angle - sin angle)/pi of all rotations
        found[name] = (
            float(weights[near].sum() / weights.sum()),
            len(variants) * 24 * (within - np.sin(within)) / np.pi,
        )
    return found


def poles(turns, family):
    """Unit vectors (n, m, 3) of a family of planes in the sheet's frame, one of each pair."""
    members = {
        tuple(s * v for s, v in zip(signs, order))
        for order in permutations(family)
        for signs in product((1, -1), repeat=3)
    }
    members = np.array(sorted(m for m in members if m > tuple(-x for x in m)), dtype=float)
    return np.einsum("nij,mj->nmi", turns, members / np.linalg.norm(members[0]))


def projected(vectors):
    """Equal-area projection of directions (n, 3) of either sense: points in a circle of radius 1."""
    up = np.where(vectors[:, 2:] < 0, -vectors, vectors)
    return up[:, :2] / np.sqrt(1 + up[:, 2:])


def density(points, weights, bins=60, smooth=1.6):
    """Multiples of a random density on a grid over the circle: a histogram, made smooth."""
    edges = np.linspace(-1, 1, bins + 1)
    middle = (edges[1:] + edges[:-1]) / 2
    count, _, _ = np.histogram2d(*points.T, bins=(edges, edges), weights=weights)
    inside = (np.hypot(*np.meshgrid(middle, middle, indexing="ij")) <= 1).astype(float)
    kernel = np.exp(-0.5 * (np.arange(-6, 7) / smooth) ** 2)

    def blur(values):
        for axis in (0, 1):
            values = np.apply_along_axis(lambda line: np.convolve(line, kernel, mode="same"), axis, values)
        return values

    with np.errstate(all="ignore"):
        found = blur(count) / blur(inside) * inside.sum() / weights.sum()
    return middle, np.where(inside > 0, found, np.nan)


def sheet_frame(rolling, normal):
    """Rows: rolling, transverse and normal direction along the grid's axes."""
    r, n = (np.eye(3)["xyz".index(axis)] for axis in (rolling, normal))
    return np.array([r, np.cross(n, r), n])


def load(run, options):
    """Orientations in the sheet's frame, volumes and time of a snapshot."""
    paths = snapshot_paths(run)
    if not paths or not -len(paths) <= options.snapshot < len(paths):
        raise Unreadable(
            f"{run}: there are {len(paths)} snapshots particles_*.hdf, and no number {options.snapshot}"
        )
    rows = Particles(paths[options.snapshot])
    if "orientation" not in rows.fields:
        raise Unreadable(
            f"{paths[options.snapshot]}: its particles have no orientation: no material is cubic, "
            "orthotropic or crystal"
        )
    used = np.ones(len(rows.ids), dtype=bool)
    if options.material:
        bodies = read_namelists(run / "case.nml")["body"]
        wanted = [n + 1 for n, body in enumerate(bodies) if body["material"][0] == options.material]
        used = np.isin(rows.fields["body"].ravel(), wanted)
        if not used.any():
            raise Unreadable(f"{run}: no particle is of the material {options.material}")
    frame = sheet_frame(options.rolling, options.normal)
    return frame @ matrices(rows.fields["orientation"][used]), rows.fields["volume"].ravel()[used], rows.time


def draw(path, turns, volumes, family, time):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    found = poles(turns, family)
    points = projected(found.reshape(-1, 3))
    middle, values = density(points, np.repeat(volumes, found.shape[1]))
    figure, axes = plt.subplots(figsize=(6, 5))
    shown = axes.contourf(
        middle, middle, values.T, levels=np.linspace(0, max(2.0, np.nanmax(values)), 21), cmap="viridis"
    )
    figure.colorbar(shown, label="multiples of a random density")
    for (name, (plane, direction)), mark in zip(COMPONENTS.items(), "os^Dv"):
        if name in ("copper", "brass", "S"):
            at = projected(poles(component(plane, direction), family).reshape(-1, 3))
            axes.plot(*at.T, mark, mfc="none", mec="white", ms=7, label=name)
    axes.add_patch(plt.Circle((0, 0), 1, fill=False))
    axes.set(aspect="equal", xlim=(-1.1, 1.1), ylim=(-1.1, 1.1), title="{%d%d%d}, %.4g s" % (*family, time))
    axes.axis("off")
    axes.text(1.04, 0, "RD")
    axes.text(0, 1.04, "TD", ha="center")
    axes.legend(loc="lower left", facecolor="gray", fontsize=8)
    figure.savefig(path, dpi=150)
    plt.close(figure)


def main(arguments=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path)
    parser.add_argument("--snapshot", type=int, default=-1)
    parser.add_argument("--pole", default="111")
    parser.add_argument("--material")
    parser.add_argument("--rolling", choices="xyz", default="x")
    parser.add_argument("--normal", choices="xyz", default="z")
    parser.add_argument("--within", type=float, default=15.0)
    options = parser.parse_args(arguments)
    try:
        if len(options.pole) != 3 or not options.pole.isdigit() or options.pole == "000":
            raise Unreadable(f"--pole {options.pole}: three digits are wanted, as 111")
        if options.rolling == options.normal:
            raise Unreadable("--rolling and --normal must be two axes")
        turns, volumes, time = load(options.run, options)
        print(
            f"{len(turns)} orientations at {time:.4g} s; shares of the volume within {options.within:g} "
            "degrees of"
        )
        for name, (share, chance) in fractions(turns, volumes, np.radians(options.within)).items():
            print(f"   {name:8s} {100 * share:6.2f} %, {share / chance:5.2f} times a random share")
        draw(options.run / "pole_figure.png", turns, volumes, [int(d) for d in options.pole], time)
        print(options.run / "pole_figure.png")
        return 0
    except Unreadable as error:
        print(f"pole_figure: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
