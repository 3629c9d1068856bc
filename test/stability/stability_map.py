#!/usr/bin/env python3
"""The map of stability: safety x particles a cell x domain x transfer x Poisson's ratio, as a table and a
picture.

usage: stability_map.py WORK MAP_PROGRAM [--ranks N] [--steps N] [--places N] [--guarded PROGRAM]

A block is stable where its energy stays within 5 % of the largest of the first quarter of the run, `grows` up
to ten times it, and `stops` beyond or where a step fails (test/verification/ringing.f90). PROGRAM is that of
guard_planted.f90, which takes any safety: what is not stable is run with it too, and is `retried` where the
guard's smaller steps bring it to its end. `gallery.py --page` takes table and picture into doc/user/. Exit
status 1 when a block is not stable at a safety that a scene may ask for, or nowhere unstable."""

import argparse
import collections
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

from empty_cells import blocks, inner_energy, wave_speed
from hard_case import Outcome, surroundings

STABLE, ALLOWED = 1.05, {1: 0.4, 8: 0.4, 27: 0.35}
HOPELESS = 10.0


def run(args):
    command = (["mpirun", "-n", str(args.ranks)] if args.ranks > 1 else []) + [
        str(args.program),
        str(args.steps),
        str(args.places),
    ]
    done = subprocess.run(command, capture_output=True, text=True, env=surroundings())
    found = {}
    for number, domain, transfer, poisson, safety, growth in re.findall(
        r"^row +(\d+) +(\w+) +(\w+) +(\S+) +(\S+) +(\S+)$", done.stdout, re.M
    ):
        found.setdefault((int(number), domain, transfer, float(poisson)), {})[float(safety)] = float(growth)
    if done.returncode != 0 or not found:
        sys.exit(f"{args.program} ended with status {done.returncode}: {done.stderr[-500:]}")
    return dict(sorted(found.items()))


def with_guard(args, found):
    """What the guard makes of the settings that are not stable: (setting, safety) -> retried, stops, grows
    (unnoticed) or holds: this block, which starts otherwise than that of the map, keeps its energy."""
    made = {}
    environment = surroundings()
    out = (args.work / "guarded").resolve()
    for key, row in found.items():
        number, domain, transfer, poisson = key
        for safety in sorted(safety for safety in row if safety > limit(row)):
            speed = 0.02 * wave_speed(poisson)
            scene = blocks([[0.05] * 3], speed, args.steps, number, domain, transfer, poisson).replace(
                "'OUT'", f"'{out}', formats='none'"
            )
            done = subprocess.run(
                [str(args.guarded)],
                input=scene,
                capture_output=True,
                text=True,
                timeout=600,
                env=environment | {"PLANT": f"safety 0 0 1 {safety}"},
            )
            retries = re.search(r"guard: (\d+) retr", done.stdout)
            if done.returncode not in (0, 3):
                sys.exit(
                    f"{args.guarded} ended with status {done.returncode} for {key}, safety {safety}: "
                    f"{done.stderr[-500:]}"
                )
            if done.returncode == 3 or retries:
                made[key, safety] = "stops" if done.returncode == 3 else "retried"
            else:
                _, energy = inner_energy(Outcome(out, 0, ""), speed)
                made[key, safety] = (
                    "grows" if energy.max() > STABLE * energy[: energy.size // 4].max() else "holds"
                )
    return made


def limit(row):
    """The largest safety up to which all are stable."""
    stable = 0.0
    for safety, growth in sorted(row.items()):
        if growth > STABLE:
            break
        stable = safety
    return stable


def table(found):
    numbers, domains, poissons = (sorted({key[n] for key in found}) for n in (0, 1, 3))
    lines = [
        "| particles a cell | domain | "
        + " | ".join(f"{transfer}, nu {nu:g}" for transfer in ("plain", "affine") for nu in poissons)
        + " |",
        "|---|---|" + "---|" * 2 * len(poissons),
    ]
    for number in numbers:
        for domain in domains:
            cells = [
                f"{limit(found[number, domain, transfer, nu]):g}"
                for transfer in ("plain", "affine")
                for nu in poissons
            ]
            lines.append(f"| {number} | {domain} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def picture(found, guarded, path):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.colors import BoundaryNorm, ListedColormap

    safeties = sorted(next(iter(found.values())))
    kinds = ["stable", "holds", "retried", "grows", "stops"]
    # Without the guard: what exceeds ten times the first energy stops.
    values = np.array(
        [
            [
                kinds.index(
                    "stable"
                    if safety <= limit(row)
                    else guarded.get((key, safety), "grows" if row[safety] < HOPELESS else "stops")
                )
                for safety in safeties
            ]
            for key, row in found.items()
        ]
    )
    figure, axes = pyplot.subplots(figsize=(6, 9), dpi=80, layout="constrained")
    colours = ListedColormap(["#4a9a4a", "#9ac890", "#f0d050", "#e08030", "#c04040"])
    shown = axes.pcolormesh(
        values,
        cmap=colours,
        norm=BoundaryNorm([-0.5, 0.5, 1.5, 2.5, 3.5, 4.5], 5),
        edgecolors="w",
        linewidth=0.5,
    )
    axes.set_xticks(np.arange(len(safeties)) + 0.5, [f"{safety:g}" for safety in safeties])
    axes.set_yticks(
        np.arange(len(found)) + 0.5,
        [f"{n} a cell, {domain}, {transfer}, nu {nu:g}" for n, domain, transfer, nu in found],
        fontsize=6,
    )
    for y, (number, *_) in enumerate(found):
        x = safeties.index(ALLOWED[number]) + 1
        axes.plot([x, x], [y, y + 1], "k", lw=2)
    axes.invert_yaxis()
    axes.set(xlabel="safety (a scene may ask for what is left of the black line)")
    bar = figure.colorbar(shown, ax=axes, location="top", aspect=40)
    bar.set_ticks(range(5), labels=kinds)
    figure.savefig(path)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("work", type=Path)
    parser.add_argument("program", type=Path)
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--steps", type=int, default=400)
    parser.add_argument("--places", type=int, default=2)
    parser.add_argument("--guarded", type=Path)
    args = parser.parse_args()
    found = run(args)
    args.work.mkdir(parents=True, exist_ok=True)
    text = table(found)
    (args.work / "map.md").write_text(text)
    print("largest safety up to which a block is stable\n" + text, end="")
    guarded = with_guard(args, found) if args.guarded else {}
    if guarded:
        counts = collections.Counter(guarded.values())
        line = f"Of the {len(guarded)} settings beyond, with the guard: "
        line += ", ".join(f"{counts[kind]} {kind}" for kind in ("holds", "retried", "stops", "grows"))
        print(line)
        (args.work / "map.md").write_text(text + "\n" + line + ".\n")
    picture(found, guarded, args.work / "map.png")
    wrong = [key for key, row in found.items() if limit(row) < ALLOWED[key[0]]]
    for key in wrong:
        print(f"FAILED: not stable up to {ALLOWED[key[0]]}: {key}")
    if all(growth <= STABLE for row in found.values() for growth in row.values()):
        sys.exit("FAILED: nothing was found to be unstable")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
