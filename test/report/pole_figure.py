"""Pole figures of made-up orientations. usage: pole_figure.py ROOT"""

import numpy as np

from gimp3d import pole_figure as pf
from checks import finish, require


angle = np.radians(15)
variants = {"copper": 2, "brass": 2, "S": 4, "Goss": 1, "cube": 1}  # of a sheet's three mirrors
for name, (plane, direction) in pf.COMPONENTS.items():
    ideal = pf.component(plane, direction)
    require(f"{name}: so many variants", len(ideal) == variants[name])
    for turn in ideal:
        require(
            f"{name}: a rotation whose plane lies in the sheet",
            np.allclose(turn @ turn.T, np.eye(3))
            and np.linalg.det(turn) > 0
            and np.isclose(np.abs(pf.poles(turn[None], plane)[0] @ [0, 0, 1]).max(), 1)
            and np.isclose(np.abs(pf.poles(turn[None], direction)[0] @ [1, 0, 0]).max(), 1),
        )
    found = pf.fractions(ideal, np.ones(len(ideal)), angle)
    require(f"{name}: is itself and no other", all(found[other][0] == (other == name) for other in found))

chance = np.random.default_rng(5)
quaternions = chance.normal(size=(20000, 4))
turns = pf.matrices(quaternions)
for name, (share, expected) in pf.fractions(turns, np.ones(len(turns)), angle).items():
    require(
        f"{name}: share among orientations without order {share:.4f}, {expected:.4f}",
        abs(share / expected - 1) < 6 / np.sqrt(20000 * expected),
    )
_, values = pf.density(pf.projected(pf.poles(turns, [1, 1, 1]).reshape(-1, 3)), np.ones(80000))
require("density without order is 1", abs(np.nanmean(values) - 1) < 0.02 and np.nanstd(values) < 0.06)

# a fibre about the normal
ring = np.array([[np.cos(a), 0, 0, np.sin(a)] for a in np.linspace(0, np.pi, 400)])
_, values = pf.density(pf.projected(pf.poles(pf.matrices(ring), [1, 0, 0]).reshape(-1, 3)), np.ones(1200))
require(
    "a fibre of cubes about the normal: poles in the middle and on the rim, none between",
    values[30, 30] > 5 and np.nanmax(values[30, 40:52]) < 0.1 and values[30, 59] > 1.5,
)

# the third component: rows of a snapshot to matrices, as src/tensors/rotations.f90 has them
turn = pf.matrices(np.array([[np.cos(np.pi / 8), 0, 0, np.sin(np.pi / 8)]]))[0]
require(
    "a turn of 45 degrees about z takes x towards y", np.allclose(turn[:, 0], [np.sqrt(0.5), np.sqrt(0.5), 0])
)
require(
    "the sheet's frame",
    np.allclose(pf.sheet_frame("y", "z") @ [0, 1, 0], [1, 0, 0])
    and np.linalg.det(pf.sheet_frame("y", "x")) > 0,
)
finish()
