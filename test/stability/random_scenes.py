#!/usr/bin/env python3
"""Valid scenes made by chance: each must end with status 0 or a clean 3. (test/hostile has scenes that are
not valid.)

usage: random_scenes.py WORK PROGRAM COUNT [--first SEED] [--ranks 1 2 3 4]

Clean: one sentence on standard error, no file left half written, no number in a file that is not finite, no
hang. What fails is kept in WORK/failed with its seed in its name. Each seed makes the same scene everywhere;
a scene is 200 steps long."""

import argparse
import collections
import os
import random
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

from hard_case import History, surroundings
from gimp3d.run_data import Unreadable

STEPS = 200
LIMIT = 60  # s: a scene that runs longer hangs


def number(x):
    return f"{x:.12g}"


def point(values):
    return ",".join(number(x) for x in values)


class Scene:
    """A valid scene from a seed. Lengths are drawn in cells, speeds in shares of the wave speed."""

    def __init__(self, seed):
        self.chance = chance = random.Random(seed)
        self.cell = 10 ** chance.uniform(-8, 0)
        self.cells = [chance.randint(8, 18) for _ in range(3)]
        self.origin = [chance.choice([0.0, -4.0, -0.5, 3.25]) for _ in range(3)]  # cells
        self.boundary = [chance.choice(["free", "symmetry", "roller", "fixed"]) for _ in range(6)]
        self.per_cell = chance.choice([1, 8, 8, 27])
        self.levels = self.make_levels()
        self.tools_wanted = chance.random() < 0.5
        # A box over everything, over which tools can stand, or bodies side by side
        self.materials = [self.make_material(n) for n in range(chance.randint(1, 2))]
        self.speed = max(one["wave"] for one in self.materials)
        self.bodies = self.make_bodies()
        self.tools = [self.make_tool(n) for n in range(chance.choice([1, 1, 2]))] if self.tools_wanted else []
        self.fastest = max([0.0] + [one["speed"] for one in self.bodies + self.tools])
        self.safety = round(chance.uniform(0.05, 0.35 if self.per_cell == 27 else 0.4), 3)
        self.end = STEPS * self.safety * self.cell / 2 ** len(self.levels) / (self.speed + self.fastest)

    def at(self, cells):
        """A point given in cells from the grid's lower corner, m."""
        return [(o + x) * self.cell for o, x in zip(self.origin, cells)]

    def make_levels(self):
        """Boxes in cells of the grid: sides of the grid, or two cells inside the box around, at least four
        wide."""
        chance, found = self.chance, []
        low, high, cell = [0.0] * 3, [float(n) for n in self.cells], 1.0
        for _ in range(chance.choice([0, 0, 0, 1, 1, 2])):
            own = []
            for a in range(3):
                n = round((high[a] - low[a]) / cell)
                lows = ([0] if low[a] == 0 else []) + list(range(2, n - 5))
                first = chance.choice(lows) if lows else None
                if first is None:
                    return found
                lasts = list(range(first + 4, n - 1)) + ([n] if high[a] == self.cells[a] else [])
                own.append((first, chance.choice(lasts)) if lasts else None)
            if None in own:
                return found
            low, high = (
                [l + cell * a for l, (a, _) in zip(low, own)],
                [l + cell * b for l, (_, b) in zip(low, own)],
            )
            cell /= 2
            found.append((low, high))
        return found

    def make_material(self, n):
        chance = self.chance
        density, young = 10 ** chance.uniform(1, 4.5), 10 ** chance.uniform(3, 11.5)
        poisson = chance.choice([0.0, 0.3, 0.49, -0.2, round(chance.uniform(-0.3, 0.495), 3)])
        model = chance.choice(["elastic", "neo_hookean", "j2", "johnson_cook"])
        text = (
            f"name='m{n}', model='{model}', density={number(density)}, young={number(young)}, "
            f"poisson={poisson}"
        )
        yields = young * 10 ** chance.uniform(-4, -1.5)
        if model == "j2" and chance.random() < 0.3:
            text += (
                f", yield_stress={number(yields)}, hardening_strain=0,0.1,0.5, "
                f"hardening_stress={point([yields, 2 * yields, 2 * yields])}"
            )
        elif model == "j2":
            text += (
                f", yield_stress={number(yields)}, "
                f"hardening_modulus={number(chance.choice([0, 0.1]) * young)}"
            )
        elif model == "johnson_cook":
            text += (
                f", yield_stress={number(yields)}, hardening_modulus={number(yields)}, "
                "hardening_exponent=0.3, rate_coefficient=0.02,"
                " thermal_exponent=1, melting_temperature=1300, specific_heat=400"
            )
        wave = (young / density * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson)) ** 0.5
        return {"text": text, "wave": wave, "young": young, "density": density}

    def make_bodies(self):
        chance, found = self.chance, []
        edge = {1: 1.0, 8: 0.5, 27: 1 / 3}[self.per_cell]
        count = 1 if self.tools_wanted else chance.randint(1, 3)
        width = self.cells[0] / count
        for n in range(count):
            speed = (
                chance.choice([0.0, 10 ** chance.uniform(-4, -1.5)]) * self.speed * (not self.tools_wanted)
            )
            motion = [chance.uniform(-1, 1) * speed / 3**0.5 for _ in range(3)]
            shape = "box" if self.tools_wanted else chance.choice(["box", "box", "sphere", "cylinder"])
            start, room = n * width, [width] + [float(x) for x in self.cells[1:]]
            if shape == "box":
                size, low = [], []
                for a in range(3):
                    most = int((room[a] - (2.5 if a == 2 and self.tools_wanted else 0.01)) / edge)
                    pieces = chance.randint(min(2, most), max(1, min(most, round(10 / edge))))
                    size.append(pieces * edge)
                    free = max(0.0, room[a] - size[a])
                    share = chance.choice([0.0, chance.random() * 0.999])
                    if a == 2 and self.tools_wanted:
                        share = 0.0
                    low.append((start if a == 0 else 0.0) + share * free)
                high = [l + s for l, s in zip(low, size)]
                text = f"shape='box', lower={point(self.at(low))}, upper={point(self.at(high))}"
            else:
                radius = chance.uniform(max(0.6, edge), min(5.0, min(room) / 2 - 0.05))
                middle = [
                    (start if a == 0 else 0.0) + chance.uniform(radius + 0.01, room[a] - radius - 0.01)
                    for a in range(3)
                ]
                low, high = [m - radius for m in middle], [m + radius for m in middle]
                if shape == "sphere":
                    text = (
                        f"shape='sphere', center={point(self.at(middle))}, "
                        f"radius={number(radius * self.cell)}"
                    )
                else:
                    height = chance.uniform(max(edge, radius), 2 * radius)
                    base = [middle[0], middle[1], middle[2] - height / 2]
                    text = (
                        f"shape='cylinder', center={point(self.at(base))}, "
                        f"radius={number(radius * self.cell)}, height={number(height * self.cell)}"
                    )
            text += (
                f", material='m{chance.randrange(len(self.materials))}', particles_per_cell={self.per_cell}"
            )
            if speed:
                text += f", velocity={point(motion)}"
            if chance.random() < 0.2 and not self.tools_wanted:
                turn = [chance.uniform(-1, 1) * 0.01 * self.speed / self.cell for _ in range(3)]
                text += f", angular_velocity={point(turn)}"
                speed += 0.15 * self.speed
            found.append({"text": text, "speed": speed, "low": low, "high": high, "shape": shape})
        return found

    def make_tool(self, n):
        """A tool that comes down on the first body, or starts a little over it."""
        chance, body = self.chance, self.bodies[0]
        shape = chance.choice(["sphere", "cone", "flat", "berkovich", "cylinder", "wedge"])
        tip = [
            chance.choice([body["low"][a], chance.uniform(body["low"][a], body["high"][a])]) for a in range(2)
        ]
        tip.append(body["high"][2] + chance.choice([1e-3, 0.3]))
        text = f"name='t{n}', shape='{shape}', tip={point(self.at(tip))}, axis=0,0,-1"
        if shape in ("cone", "wedge"):
            text += f", half_angle={chance.choice([30, 45, 70.3, 85])}"
        if shape in ("sphere", "flat", "cylinder"):
            text += f", radius={number(chance.uniform(0.7, 8) * self.cell)}"
        speed = 10 ** chance.uniform(-4, -1.3) * self.speed
        whole = STEPS * self.cell / self.speed
        if chance.random() < 0.25:
            mass = max(one["density"] for one in self.materials) * self.cell**3 * chance.uniform(1, 1000)
            text += (
                ", times=0, "
                f"loads={number(chance.uniform(0, 1e-3) * self.materials[0]['young'] * self.cell**2)}, "
                f"mass={number(mass)}, initial_speed={number(speed)}"
            )
        else:
            back = chance.choice([speed, 0.0, -speed])
            text += f", times={point([0, 0.05 * whole, 0.2 * whole])}, speeds={point([0, speed, back])}"
        text += (
            f", penetration_factor={chance.choice([0, 0.3, 0.4, 0.5])}, "
            f"friction={chance.choice([0, 0, 0.3, 5])}"
        )
        return {"text": text, "speed": speed}

    def effects(self):
        chance, lines = self.chance, []
        if chance.random() < 0.3:
            pull = 0.01 * self.speed / self.end
            lines.append(f"&gravity acceleration={point([chance.uniform(-1, 1) * pull for _ in range(3)])} /")
        if chance.random() < 0.3:
            kind = "viscous" if self.tools_wanted else chance.choice(["viscous", "local"])
            lines.append(
                f"&damping kind='{kind}', coefficient={number(0.2 if kind == 'local' else 1 / self.end)} /"
            )
        if chance.random() < 0.2:
            lines.append("&bulk_viscosity /")
        if chance.random() < 0.3:
            lines.append("&anti_locking /")
        body = self.bodies[0]
        if chance.random() < 0.3 and body["shape"] == "box":
            a = chance.randrange(3)
            low, high = list(body["low"]), list(body["high"])
            low[a] = high[a] = body["high"][a]
            value = 1e-3 * self.materials[0]["young"] * chance.uniform(-1, 1)
            lines.append(
                f"&pressure lower={point(self.at(low))}, upper={point(self.at(high))}, "
                f"times=0,{number(self.end)}, values=0,{number(value)} /"
            )
        return lines

    def text(self):
        chance = self.chance
        update = "usl" if self.levels else chance.choice(["usl", "usl", "usf", "musl"])
        lines = [
            f"&scene title='made by chance', end_time={number(self.end)} /",
            f"&grid lower={point(self.at([0] * 3))}, upper={point(self.at(self.cells))}, "
            f"cell_size={number(self.cell)},",
            "      boundary=" + ",".join(f"'{word}'" for word in self.boundary) + " /",
            f"&time safety={self.safety}, stress_update='{update}', "
            f"transfer='{chance.choice(['affine', 'affine', 'plain'])}',",
            f"      domain='{chance.choice(['fixed', 'fixed', 'stretch', 'corners'])}', "
            f"flip_fraction={chance.choice([1, 1, 0.95, 0])}, "
            f"subcycle={chance.choice(['.true.', '.false.'])} /",
        ]
        moves = chance.choice(["", "", "follow", "criterion"]) if self.levels else ""
        for low, high in self.levels:
            extra = ""
            if moves == "follow" and self.tools:
                extra = ", follow='t0'"
            if moves == "criterion":
                extra = ", criterion='stress', max_cells=5000"
            lines.append(f"&level lower={point(self.at(low))}, upper={point(self.at(high))}{extra} /")
        lines += [f"&material {one['text']} /" for one in self.materials] + [
            f"&body {one['text']} /" for one in self.bodies
        ]
        lines += [f"&tool {one['text']} /" for one in self.tools] + self.effects()
        formats = chance.choice(["'hdf5'", "'hdf5','tecplot'", "'tecplot'"])
        lines.append(
            f"&output directory='OUT', every={number(self.end / 3)}, history_every={number(self.end / 50)}, "
            f"formats={formats} /"
        )
        if chance.random() < 0.3:
            lines.append("&checkpoint every_steps=50 /")
        return "\n".join(lines) + "\n"


def faults_on_disk(out, status):
    """What is wrong with what a run left."""
    found = []
    if not out.exists():
        return ["it wrote nothing"] if status == 0 else []
    for path in sorted(out.rglob("*")):
        if path.suffix == ".part":
            found.append(f"{path.name} is half written")
        elif path.suffix == ".dat":
            try:
                columns = History(path).columns
                found += [
                    f"{path.name}: {name} is not finite"
                    for name, values in columns.items()
                    if not np.all(np.isfinite(values))
                ]
            except Unreadable as error:
                found.append(str(error))
        elif path.suffix in (".hdf", ".h5"):
            try:
                with h5py.File(path) as file:

                    def look(name, thing, path=path):
                        if (
                            isinstance(thing, h5py.Dataset)
                            and thing.dtype.kind == "f"
                            and not np.all(np.isfinite(thing[...]))
                        ):
                            found.append(f"{path.name}: {name} is not finite")

                    file.visititems(look)
            except OSError as error:
                found.append(f"{path.name}: {error}")
    if status == 0 and not (out / "energy.dat").exists():
        found.append("there is no energy.dat")
    return found


def judge(program, text, ranks, out, environment, limit):
    """Run a scene: its status (None: stopped at the limit, s), its sentence, and what is wrong with it."""
    shutil.rmtree(out, ignore_errors=True)
    text = text.replace("'OUT'", f"'{out}'")
    command = (["mpirun", "-n", str(ranks)] if ranks > 1 else []) + [program]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment
    )
    try:
        output, errors = process.communicate(text.encode(), timeout=limit)
    except subprocess.TimeoutExpired:
        process.terminate()
        try:
            process.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
        return None, "", [f"it was still running after {limit} s"]
    errors = errors.decode(errors="replace")
    sentences = [line for line in errors.splitlines() if line.startswith("gimp3d: ")]
    found = []
    status = process.returncode
    if status not in (0, 3):
        found.append(f"status {status}: {errors[-400:]}")
    elif status != 0 and len(sentences) != 1:
        found.append(f"{len(sentences)} sentences: {errors[-400:]}")
    return status, sentences[-1] if sentences else "", found + faults_on_disk(out, status)


def main(make_scene, what, limit=LIMIT):
    """Run the command: scenes of `make_scene(seed)`, whose method text gives the scene with 'OUT' for its
    directory; `what` is told by --help; a scene that runs longer than `limit`, s, hangs."""
    limit *= 5 if os.environ.get("BUILD") == "debug" else 1
    parser = argparse.ArgumentParser(description=what, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=Path)
    parser.add_argument("program")
    parser.add_argument("count", type=int)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2, 1, 3, 1, 1, 4, 1])
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    kept = args.work / "failed"
    shutil.rmtree(kept, ignore_errors=True)
    environment = surroundings()
    ends, wrong = collections.Counter(), 0
    for seed in range(args.first, args.first + args.count):
        text = make_scene(seed).text()
        ranks = args.ranks[seed % len(args.ranks)]
        out = (args.work / f"out_{seed}").resolve()
        program = str(Path(args.program).resolve())
        status, sentence, faults = judge(program, text, ranks, out, environment, limit)
        ends["still running" if status is None else status] += 1
        if sentence:
            print(f"   {seed} on {ranks}: {status}: {sentence[8:200]}", flush=True)
        for fault in faults:
            print(f"FAILED: scene {seed} on {ranks} ranks: {fault}", flush=True)
        if faults:
            wrong += 1
            kept.mkdir(exist_ok=True)
            (kept / f"scene_{seed}_on_{ranks}.nml").write_text(text)
        shutil.rmtree(out, ignore_errors=True)
    print(
        f"{args.count} scenes: ended with "
        + ", ".join(f"{number} x {status}" for status, number in ends.items())
        + f"; {wrong} not clean"
        + (f", kept in {kept}" if wrong else "")
    )
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main(Scene, __doc__)
