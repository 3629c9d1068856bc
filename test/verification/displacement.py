"""Displacement, strain and deformation gradient beside exact motions."""

import math
from pathlib import Path

import numpy as np

from gimp3d.run_data import History, Particles, snapshot_paths
from run_scene import run
from checks import check, finish, require

FIELDS = "fields='displacement','strain','deformation_gradient'"
SPIN = """
&scene    title='once about', end_time={end} /
&grid     lower=-1,-1,-0.5, upper=1,1,0.5, cell_size=0.125 /
&material name='stiff', model='elastic', density=1000, young=1e9, poisson=0.3 /
&body     material='stiff', shape='box', lower=-0.25,-0.25,-0.125, upper=0.25,0.25,0.125, particles_per_cell=8,
          angular_velocity=0,0,{spin} /
&probe    name='corner', position=0.2,0.2,0.1 /
&output   directory='{name}', {fields}, every=0 /
"""
FLIGHT = """
&scene    title='through a level', end_time=3.2e-2 /
&grid     lower=0,0,0, upper=4.5,2,2, cell_size=0.25, boundary='free','free','free','free','free','free' /
&level    lower=1.5,0.5,0.5, upper=2.5,1.5,1.5 /
&material name='stiff', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body     material='stiff', shape='box', lower=0.75,0.75,0.75, upper=1.25,1.25,1.25, particles_per_cell=8,
          velocity=70,0,0 /
&output   directory='{name}', {fields}, every=8e-3 /
&checkpoint every=1e-2 /
"""
PRESS = """
&scene    title='pressed', end_time=1 /
&grid     lower=0,0,0, upper=1,1,1.5, cell_size=0.25, boundary='roller','roller','roller','roller','roller','free' /
&material name='soft', model='neo_hookean', density=1000, young=1e6, poisson=0.3 /
&body     material='soft', shape='box', lower=0,0,0, upper=1,1,1, particles_per_cell=8 /
&tool     name='plate', shape='flat', radius=4, tip=0.5,0.5,1, axis=0,0,-1, times=0,1, speeds=0.1,0.1 /
&quasi_static step=0.1 /
&output   directory='press', {fields}, every=0 /
"""


def last(name):
    return Particles(snapshot_paths(Path(name))[-1])


def off(name):
    """How far displacements are from what positions say, by id, over the largest of these."""
    first, end = Particles(snapshot_paths(Path(name))[0]), last(name)
    start = dict(zip(first.ids, first["position"]))
    moved = np.array([x - start[i] for i, x in zip(end.ids, end["position"])])
    return abs(end["displacement"] - moved).max() / np.linalg.norm(first["position"], axis=1).max()


def same(one, other, what):
    """The fields of two particle files by id: the same bits."""
    a, b = one.ids.argsort(), other.ids.argsort()
    for name in ("displacement", "strain", "deformation_gradient"):
        require(f"{name} {what}: the same bits", np.array_equal(one[name][a], other[name][b]))


# ---- a rigid body once about ----
spin, end = 2 * math.pi / 1e-2, 1e-2
for ranks in (1, 2, 4):
    run(SPIN.format(name=f"spin_{ranks}", end=end, spin=spin, fields=FIELDS), ranks)
turned = last("spin_1")
check("once about: displacement for the way of each particle, over the radius", off("spin_1"), 1e-12)
gradient = turned["deformation_gradient"].reshape(-1, 3, 3)
values, vectors = np.linalg.eigh(gradient @ gradient.transpose(0, 2, 1))
exact = 0.5 * np.einsum("pik,pk,pjk->pij", vectors, np.log(values), vectors)
exact = exact[:, [0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]]
check("once about: strain for ln V of F", abs(turned["strain"] - exact).max(), 1e-14)
probe = History("spin_1/probe_corner.dat")
for axis in "xyz":
    way = probe[axis] - probe[axis][0]
    check(f"once about: a probe's displacement along {axis}", probe[f"displacement_{axis}"] - way, 1e-15)
for ranks in (2, 4):
    same(turned, last(f"spin_{ranks}"), f"on {ranks} ranks")

# ---- through a level: particles become eight, and one again ----
run(FLIGHT.format(name="flight", fields=FIELDS), 2)
first = Particles(snapshot_paths(Path("flight"))[0])
counts = []
for path in snapshot_paths(Path("flight")):
    shot = Particles(path)
    counts.append(len(shot.ids))
    check(f"flight at {shot.time:g} s: displacement", shot["displacement"] - [70 * shot.time, 0, 0], 1e-9)
    check(f"flight at {shot.time:g} s: strain", shot["strain"], 1e-9)
require(f"it was split and merged: {counts}", max(counts) > counts[-1] and max(counts) > counts[0])
text = FLIGHT.format(name="half", fields=FIELDS)
run(text.replace("3.2e-2", "1.6e-2"), 2)
for ranks in (1, 2):
    again = text.replace("&scene ", "&scene restart='half', ").replace(
        "'half', fields", f"'on_{ranks}', fields"
    )
    run(again, ranks)
same(last("on_1"), last("on_2"), "after a restart on other ranks")
shot = last("on_1")
check("after a restart: displacement", shot["displacement"] - [70 * shot.time, 0, 0], 1e-9)
refused = run(again.replace(FIELDS, "fields='none'"), 1, (2,))
require(f"other fields are refused: {refused}", "fields='none' was 'displacement'" in refused)

# ---- pressed by a tenth between walls: one strain everywhere ----
run(PRESS.format(fields=FIELDS), 1)
pressed = last("press")
height = History("press/tool_plate.dat")["depth"][-1]
check("pressed: mean strain for ln(h/H)", pressed["strain"][:, 2].mean() / math.log(1 - height) - 1, 0.005)
top = pressed["displacement"][pressed["position"][:, 2].argmax(), 2]
place = pressed["position"][:, 2].max() - top
check("pressed: displacement of the top", top / (-height * place) - 1, 0.005)

# ---- none is asked for: none is there, and nothing else changes ----
run(SPIN.format(name="bare", end=end / 20, spin=spin, fields="fields='none'"), 1)
run(SPIN.format(name="full", end=end / 20, spin=spin, fields=FIELDS), 1)
bare, full = last("bare"), last("full")
require("no field that is not asked for", not {"displacement", "strain"} & set(bare.fields))
for name in bare.fields:
    require(f"{name}: the same bits with and without", np.array_equal(bare[name], full[name]))
finish()
