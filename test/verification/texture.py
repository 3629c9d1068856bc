"""The texture of copper in plane-strain compression, input/texture.nml: without order at first, then copper,
S and brass, as rolled fcc metals of high stacking-fault energy have it (Hirsch and Luecke, Acta Metall. 36
(1988) 2863). usage: texture.py (in an empty directory; GIMP3D is the program)"""

import argparse
from pathlib import Path

import numpy as np

from run_scene import ROOT, replace, run
from checks import finish, require

from gimp3d import pole_figure

run(replace((ROOT / "input/texture.nml").read_text(), "'out/texture'", "'texture'"), 2)


def times_chance(snapshot):
    options = argparse.Namespace(snapshot=snapshot, material=None, rolling="x", normal="z")
    turns, volumes, _ = pole_figure.load(Path("texture"), options)
    return {
        name: share / chance
        for name, (share, chance) in pole_figure.fractions(turns, volumes, np.radians(15)).items()
    }


first, last = times_chance(0), times_chance(-1)
print(
    "   shares within 15 degrees over random ones: "
    + ", ".join(f"{name} {first[name]:.2f} -> {last[name]:.2f}" for name in last)
)
for name, factor in first.items():
    require(f"{name}: no order at the start", abs(factor - 1) < 0.25)
for name in ("copper", "brass", "S"):
    require(f"{name}: at least two and a half times a random share at the end", last[name] > 2.5)
require("cube: not above a random share by half", last["cube"] < 1.5)
require("copper is the strongest, and Goss weaker than brass", last["copper"] > last["brass"] > last["Goss"])
finish()
