"""What guard.sh asks for."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import h5py
import numpy as np

from restarts import LEVELS, CONTACT, MOVING, SPLITTING, GIMP3D, require, finish, said
import runs
from checks import faults
from gimp3d.run_data import History

PLANTED = os.environ["PLANTED"]
FLY = """
&scene title='a block that flies', end_time={end} /
&grid lower=0,0,0, upper=2.4,1.6,1.6, cell_size=0.1 /
&material name='soft', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body material='soft', shape='box', lower=0.4,0.5,0.5, upper=0.9,1.1,1.1, velocity=6,3,2 /
"""
RING = """
&scene title='a free block that rings', end_time={end} /
&grid lower=0,0,0, upper=12,12,12, cell_size=1 /
&time domain='fixed' /
&material name='rubber', model='neo_hookean', density=1, young=1, poisson=0.3 /
&body material='rubber', shape='box', lower=4.03,4.03,4.03, upper=8.03,8.03,8.03, angular_velocity=2e-3,1e-3,1.5e-3 /
"""
WHO = r"particle \d+ of body 1 (at|between) \([-\d.e]+, [-\d.e]+, [-\d.e]+\) .*m on level {level}"


def run(
    what, ranks, text, guard="save_every=10", program=PLANTED, more="", formats="hdf5", end=0.03, every=0.012
):
    """A scene with a fault planted; status, output, directory."""
    directory = Path(f"run_{run.number}")
    run.number += 1
    shutil.rmtree(directory, ignore_errors=True)
    text = (
        text.format(end=end)
        + f"&output directory='{directory}', every={every}, formats='{formats}' /\n&guard {guard} /\n"
        + more
    )
    done = subprocess.run(
        ([] if ranks == 1 else ["mpirun", "-n", str(ranks)]) + [program],
        input=text,
        capture_output=True,
        text=True,
        env=dict(os.environ, PLANT=what),
    )
    return done.returncode, done.stdout + done.stderr, directory


run.number = 1


def bad_values(directory):
    """Files in which something is not finite, and parts of files."""
    found = [str(path) for path in directory.glob("*.part")]
    for path in [*directory.glob("*.hdf"), *directory.glob("*.h5")]:
        with h5py.File(path) as file:
            file.visititems(
                lambda name, item: (
                    found.append(f"{path} {name}")
                    if isinstance(item, h5py.Dataset)
                    and item.dtype.kind == "f"
                    and not np.all(np.isfinite(item[()]))
                    else None
                )
            )
    for path in directory.glob("*.dat"):
        if path.name == "cost.dat":
            continue
        history = History(path)
        if not all(np.all(np.isfinite(values)) for values in history.columns.values()):
            found.append(str(path))
        if path.name.startswith("outline_"):
            continue
        if not np.all(np.diff(history["time"]) > 0.0):
            found.append(f"{path}: times do not rise")
    return found


def ends(what, plant, text, sentence, ranks=(1, 2), level=1, retries=3, **options):
    """Status 3 and the sentence, whatever the ranks; the last good state is there, and nothing that is not a
    number."""
    sentences = []
    for n in ranks:
        status, output, directory = run(plant, n, text, more="&checkpoint every=0.005 /\n", **options)
        name = f"{what}, {n} ranks"
        require(f"{name}: status {status}", status == 3)
        sentences.append(said(output))
        good = (
            re.search(WHO.format(level=level), sentences[-1])
            and re.search(sentence, sentences[-1])
            and "; try a" in sentences[-1]
        )
        require(f"{name}: {sentences[-1]}", good)
        require(
            f"{name}: {retries} retries",
            len(re.findall(r"^retry \d+: ", output, re.M)) == retries
            and f"guard: {retries} retries" in output,
        )
        step = re.search(r"the last good state, of step (\d+), stands in " + str(directory), sentences[-1])
        require(
            f"{name}: the last good state is on the disk",
            step
            and (directory / f"particles_{int(step[1]):08d}.hdf").exists()
            and (directory / f"checkpoint_{int(step[1]):012d}.h5").exists(),
        )
        require(f"{name}: {bad_values(directory) or 'all numbers'}", not bad_values(directory))
    require(
        f"{what}: the same sentence on any number of ranks",
        len({one.replace("run_", "")[:200] for one in sentences}) == 1,
    )
    return directory


ends(
    "a stress that is not a number, level 2",
    "stress 15 9 2 1",
    LEVELS,
    r"has stress NaN Pa, which is not finite",
    level=2,
)
ends(
    "a stress that is not a number",
    "stress 15 9 1 1",
    FLY,
    r"has stress NaN Pa, which is not finite",
    ranks=(1,),
)
ends(
    "a contact pressure that is not a number",
    "contact_pressure 15 9 1 1",
    CONTACT,
    r"at the tool ball has a speed or force that is not a number",
)
ends(
    "a particle that is thrown",
    "throw 15 9 2 1000",
    LEVELS,
    r"moved [\d.]+ cells in a step, at [\d.e]+ m/s; at most 0.5 cells",
    level=2,
)
ends(
    "a particle that inverts",
    "swell 15 9 1 -1",
    FLY,
    r"has inverted: det F <= 0 \(volume -0.000125 m3, must be above 0\)",
    ranks=(1,),
)
ends(
    "a time step that collapses",
    "swell 15 9 1 1e8",
    FLY,
    r"sound in it at [\d.e]+ m/s: that makes the time step \S+ s, less than 0.001 of the first one",
)
last = ends(
    "spurious energy growth",
    "heat 15 9 1 3",
    LEVELS,
    r"J of spurious energy growth, more than 0.5 of the largest",
)
ends(
    "a contact problem that is not solved",
    "none 0 0 1 1",
    CONTACT.replace("&tool", "&contact max_iterations=1, tolerance=1e-12 /\n&tool"),
    r"at the tool ball: the contact problem was not solved, relative residual \S+ after \d+ \w+",
)

# the last good state can be gone on from
done = subprocess.run([GIMP3D, "--restart", str(last)], capture_output=True, text=True)
require(
    f"a run goes on from the last good state: {done.returncode}",
    done.returncode == 0 and not bad_values(last),
)

# no retries; no copy
status, output, directory = run("stress 15 9 1 1", 1, FLY, guard="save_every=10, retries=0")
require(
    "retries=0: status 3, the last good state",
    status == 3 and "of step 10, stands in" in said(output) and "\nretry" not in output,
)
status, output, directory = run("stress 15 9 1 1", 1, FLY, guard="save_every=10, memory=1e5")
require(
    "too little memory: said at the start",
    re.search(r"no copy to roll back to: it would take \S+ kB a rank, &guard memory allows 100 kB", output),
)
require(
    "too little memory: status 3, no last good state",
    status == 3 and "last good" not in output and not bad_values(directory),
)

# planted once: a retry gets over it, with the same bits on any number of ranks
reference = run("none 0 0 1 1", 1, LEVELS)[2]
healed = []
for ranks in (1, 2):
    status, output, directory = run("stress 15 1 1 1", ranks, LEVELS)
    require(
        f"planted once, {ranks} ranks: status {status}, one retry",
        status == 0 and "guard: 1 retry, the last at" in output,
    )
    require(
        f"planted once, {ranks} ranks: {bad_values(directory) or 'all numbers'}", not bad_values(directory)
    )
    healed.append(directory)
runs.same_bits(*healed)
energies = [History(one / "energy.dat") for one in (reference, healed[0])]
off = abs(energies[1]["kinetic"][-1] / energies[0]["kinetic"][-1] - 1.0)
require(f"planted once: kinetic energy at the end off by {off:.2e} (at most 1e-3)", off < 1e-3)

# back over a move of a level, and over splits
for what, plant, text, end in (
    ("a level that moves", "stress 104 1 1 1", MOVING, 0.09),
    ("splitting", "stress 20 1 1 1", SPLITTING, 0.1),
):
    healed = []
    for ranks in (1, 2):
        status, output, directory = run(plant, ranks, text, guard="save_every=15", end=end, every=0.2)
        require(
            f"back over {what}, {ranks} ranks: status {status}, one retry",
            status == 0 and "guard: 1 retry, the last at" in output,
        )
        require(
            f"back over {what}, {ranks} ranks: {bad_values(directory) or 'all numbers'}",
            not bad_values(directory),
        )
        healed.append(directory)
    runs.same_bits(*healed)

# stopped while it takes the smaller steps: it goes on with them
straight = run("stress 15 1 1 1", 1, LEVELS, more="&checkpoint every=0.012 /\n", end=0.02)[2]
again = Path("again")
shutil.copytree(straight, again)
sorted(again.glob("checkpoint_*.h5"))[-1].unlink()
done = subprocess.run([GIMP3D, "--restart", str(again)], capture_output=True, text=True)
require(
    f"stopped while it takes smaller steps: {done.returncode}, the retry is not forgotten",
    done.returncode == 0 and "guard: 1 retry, the last at" in done.stdout,
)
times = History(straight / "energy.dat")["time"]
steps = np.diff(times)
require("it was stopped while it took smaller steps", steps[np.searchsorted(times, 0.012)] < 0.6 * steps[0])
runs.same_bits(straight, again)

# nothing planted: the guard changes no bit
plain = run("none 0 0 1 1", 1, LEVELS, guard="memory=0, energy_limit=0")[2]
runs.same_bits(plain, reference)
require(
    "the same bits: on 1 and 2 ranks after a retry; stopped after it; without a fault with and without the "
    "guard",
    not faults,
)

# a step above the stable one: with the guard no energy comes from nowhere
for safety in (0.8, 1.0):
    worst = []
    for guard in ("retries=0, energy_limit=0", "retries=3"):
        status, output, directory = run(
            f"safety 0 0 1 {safety}", 1, RING, guard=guard, end=400.0, every=0.0, formats="none"
        )
        require(f"safety {safety}, {guard}: status {status}", status == 0 or "retries=0" in guard)
        history = History(directory / "energy.dat")
        worst.append(np.max(history["balance_error"]))
    retries = re.search(r"guard: (\d+) retries", output)
    require(
        f"safety {safety}: energy error {worst[0]:.2f} without the guard, {worst[1]:.2g} with it and "
        f"{retries and retries[1]} retries",
        retries and worst[0] > 0.9 and worst[1] <= 0.5,
    )

# damping that would be unstable at the step of the waves: the step is shorter
DAMPED = RING + "&damping kind='viscous', coefficient=8 /\n"
status, output, directory = run(
    "none 0 0 1 1", 1, DAMPED, program=GIMP3D, guard="retries=0", end=40.0, every=0.0, formats="none"
)
history = History(directory / "energy.dat")
require(
    f"damped hard: status {status}, it comes to rest",
    status == 0
    and history["kinetic"][-1] < 1e-6 * history["kinetic"][0]
    and np.max(history["balance_error"]) < 0.5,
)
require("damped hard: in steps of 0.2 over the coefficient", "in steps of 25 ms" in output)
DRIFT = FLY + "&time time_step=5e-4 / &damping kind='viscous', coefficient=4800 /\n"
status, output, directory = run(
    "none 0 0 1 1", 1, DRIFT, program=GIMP3D, guard="retries=0", end=0.3, every=0.0, formats="none"
)
require(
    "a given step too long for damping is refused",
    status == 2
    and "must be at most 4.16667e-5 s, the longest that line" in said(output)
    and "&damping allows" in said(output),
)
finish()
