#!/usr/bin/env python3
"""Volumetric locking with and without &anti_locking: the tables of doc/user/accuracy.md.

usage: locking.py WORK GIMP3D [--long]

cantilever  input/cantilever.nml: deflection of the end over the exact one (plane_strain.py)
block       two halves that meet and ring while they fly through the grid: energy about the mean motion must
not grow
column      a plane-strain block under its weight: pressure of the particles beside the exact one
punch       a strip pressed into perfectly plastic material (Prandtl): the pressure must level off
Every bar stands beside one that the run without the effect must miss, but for the block's.
"""

import argparse
import math
import pathlib
import re
import subprocess
import sys

import numpy as np
from plane_strain import cantilever

ROOT = pathlib.Path(__file__).resolve().parents[2]
from gimp3d.run_data import History, Particles
from checks import finish, require

EFFECT = "&anti_locking /\n"
OFF = "&anti_locking kind='none' /\n"


def run(args, name, text):
    """Run a scene; the directory of what it wrote."""
    out = args.work / name
    done = subprocess.run(
        [args.gimp3d],
        input=text + f"&output directory='{out}', history_every={end_of(text) / 200!r} /\n",
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        sys.exit(f"{name} ended with status {done.returncode}:\n{done.stdout[-2000:]}{done.stderr[-500:]}")
    return out


def end_of(text):
    return float(re.search(r"end_time=([^ /,]+)", text).group(1))


def deflection(args, cells, poisson, effect):
    """Of the end of the shipped cantilever on some cells over the height, over the exact one."""
    h = 1 / cells
    text = (ROOT / "input/cantilever.nml").read_text()
    for old, new in (
        (
            "lower=0,0,-0.25, upper=5.5,0.25,1.25, cell_size=0.25",
            f"lower=0,0,{-h!r}, upper={5 + 2 * h!r},{h!r},{1 + h!r}, cell_size={h!r}",
        ),
        ("upper=5,0.25,1,", f"upper=5,{h!r},1,"),
        ("poisson=0.49", f"poisson={poisson}"),
        ("&anti_locking /\n", effect),
    ):
        if old not in text:
            sys.exit(f"input/cantilever.nml does not say {old}")
        text = text.replace(old, new)
    text = re.sub(r"&output.*/\n", "", text)
    end = History(run(args, f"cantilever_{cells}_{poisson}_{len(effect)}", text) / "probe_end.dat")
    way = end["z"] - end["z"][0]
    return way[-1] / cantilever(5.0, 1.0, 1e6, poisson, -40.0, (end["x"][0], end["z"][0]))


def cantilevers(args):
    grids = (2, 4, 8) if args.long else (2, 4)
    for poisson in (0.3, 0.49, 0.499) if args.long else (0.49,):
        off = [deflection(args, cells, poisson, "") for cells in grids]
        on = [deflection(args, cells, poisson, EFFECT) for cells in grids]
        print(
            f"cantilever, nu {poisson}: deflection over the exact one on {grids} cells over the height: "
            "without",
            *[f"{w:.3f}" for w in off],
            "with",
            *[f"{w:.3f}" for w in on],
            flush=True,
        )
        require(f"cantilever, nu {poisson}: with the effect within 4 % on 4 cells", abs(on[1] - 1) < 0.04)
        require(
            f"cantilever, nu {poisson}: nearer on the finer grid",
            all(abs(b - 1) < abs(a - 1) for a, b in zip(on, on[1:])),
        )
        if poisson > 0.4:
            require(f"cantilever, nu {poisson}: without the effect 25 % off on 4 cells", off[1] < 0.75)


def block(args, poisson, speed, effect, steps=6000):
    """Energy about the mean motion over that at the start, at the end and at most; largest change of
    momentum."""
    end = steps * 0.35 * 0.1 / (speed + math.sqrt(1e3 * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson)))
    cells = [math.ceil(10 * (2 + speed * end)), math.ceil(10 * (1.2 + 0.5 * speed * end)), 10]
    text = f"""&scene title='two halves that ring', end_time={end!r} /
&grid lower=0,0,0, upper={cells[0] / 10},{cells[1] / 10},1, cell_size=0.1 /
&material name='rubber', model='elastic', density=1000, young=1e6, poisson={poisson} /
&body material='rubber', shape='box', lower=0.3,0.3,0.3, upper=0.7,0.7,0.7, velocity={speed + 0.5},{speed / 2},0 /
&body material='rubber', shape='box', lower=0.7,0.3,0.3, upper=1.1,0.7,0.7, velocity={speed - 0.5},{speed / 2},0 /
{effect}"""
    history = History(run(args, f"block_{poisson}_{speed}_{len(effect)}", text) / "energy.dat")
    energy = history["kinetic"] - 64 * (speed**2 + (speed / 2) ** 2) + history["strain"]
    momentum = max(
        np.abs(history[f"momentum_{axis}"] - history[f"momentum_{axis}"][0]).max() for axis in "xyz"
    )
    return (
        energy[-1] / energy[0],
        energy.max() / energy[0],
        momentum / (128 * max(speed, 0.5)),
        speed * end / 0.1,
    )


def blocks(args):
    for poisson, speed in (
        [(nu, v) for nu in (0.49, 0.499) for v in (0.0, 5.0)] if args.long else [(0.499, 5.0)]
    ):
        for effect in ("", EFFECT):
            last, largest, momentum, cells = block(args, poisson, speed, effect)
            print(
                f"block, nu {poisson}, over {cells:.0f} cells, {'with' if effect else 'without'}: energy "
                "after 6000 steps "
                f"{last:.3f} of the start's, at most {largest:.4f}; momentum changed by {momentum:.1e}",
                flush=True,
            )
            require(f"block, nu {poisson}: energy does not grow", largest < 1.001)
            require(f"block, nu {poisson}: momentum", momentum < 1e-12)


def column(args, poisson, effect):
    """Root mean square error of the pressure well inside, over the pressure at the foot; the checkerboard in
    means of cells."""
    text = f"""&scene title='column', end_time=3 /
&grid lower=-0.125,0,0, upper=1.125,0.125,1.25, cell_size=0.125, boundary='free','free','symmetry','symmetry','roller','free' /
&material name='rubber', model='elastic', density=1000, young=1e6, poisson={poisson} /
&body material='rubber', shape='box', lower=0,0,0, upper=1,0.125,1 /
&gravity acceleration=0,0,-2 /
&damping kind='viscous', coefficient=20 /
{effect}"""
    last = Particles(sorted(run(args, f"column_{poisson}_{len(effect)}", text).glob("particles_*.hdf"))[-1])
    x, z = last.fields["position"][:, 0], last.fields["position"][:, 2]
    foot = 2000 * (1 + poisson) / 3
    error = -last.fields["stress"][:, :3].mean(axis=1) / foot - (1 - z)
    inside = (abs(x - 0.5) < 0.3) & (abs(z - 0.5) < 0.3)
    left = inside & (x < 0.5)  # by symmetry the sum over both halves would be 0
    sign = (-1.0) ** (np.floor(x / 0.125) + np.floor(z / 0.125))
    return math.sqrt(np.mean(error[inside] ** 2)), abs(np.mean((sign * error)[left]))


def columns(args):
    for poisson in (0.3, 0.49) if args.long else (0.49,):
        off, on = column(args, poisson, ""), column(args, poisson, EFFECT)
        print(
            f"column, nu {poisson}: error of the pressure inside over that at the foot: without {off[0]:.3f} "
            f"with {on[0]:.3f}; checkerboard: without {off[1]:.1e} with {on[1]:.1e}",
            flush=True,
        )
        require(f"column, nu {poisson}: pressure within 6 % with the effect", on[0] < 0.06)
        require(f"column, nu {poisson}: no checkerboard with the effect", on[1] < 0.005)
        if poisson > 0.4:
            require(f"column, nu {poisson}: pressure 30 % off without the effect", off[0] > 0.3)


def punch(args, cells, effect):
    """Mean pressure under a strip of half width 0.25 over the yield stress at 70 and 100 % of the way of 4 %
    of the half width."""
    h, way, speed = 0.25 / cells, 0.01, 0.005
    text = f"""&scene title='strip into plastic material', end_time={way / speed} /
&grid lower=0,0,0, upper=1.25,{h!r},{0.75 + 2 * h!r}, cell_size={h!r},
      boundary='symmetry','roller','symmetry','symmetry','roller','free' /
&time domain='fixed' /
&material name='metal', model='j2', density=1000, young=1e6, poisson=0.3, yield_stress=1e3 /
&body material='metal', shape='box', lower=0,0,0, upper=1.25,{h!r},0.75 /
&tool name='strip', shape='flat', radius=0.25, tip=0,0,0.75, times=0,{0.2 * way / speed}, speeds=0,{speed / 0.9!r},
      penetration_factor=0.5 /
{effect or OFF}"""
    load = np.abs(
        History(next(run(args, f"punch_{cells}_{len(effect)}", text).glob("tool_strip*.dat")))["load_z"]
    )
    pressure = load / (0.25 * h) / 1e3
    return [float(pressure[int((share - 0.05) * 200) : int(share * 200) + 1].mean()) for share in (0.7, 1.0)]


def punches(args):
    for cells in (4, 8) if args.long else (4,):
        off, on = punch(args, cells, ""), punch(args, cells, EFFECT)
        limit = (2 + math.pi) / math.sqrt(3)
        print(
            f"punch, {cells} cells: pressure over the yield stress at 70 and 100 % of the way (exact "
            f"{limit:.3f}):"
            f" without {off[0]:.3f} {off[1]:.3f} with {on[0]:.3f} {on[1]:.3f}",
            flush=True,
        )
        require(f"punch, {cells} cells: levels off with the effect", abs(on[1] / on[0] - 1) < 0.01)
        require(
            f"punch, {cells} cells: with the effect within 6 % of the limit load",
            abs(on[1] / limit - 1) < 0.06,
        )
        require(f"punch, {cells} cells: still rises without the effect", off[1] / off[0] - 1 > 0.01)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("gimp3d")
    parser.add_argument("--long", action="store_true")
    args = parser.parse_args()
    for part in (cantilevers, blocks, columns, punches):
        part(args)
    finish()


if __name__ == "__main__":
    main()
