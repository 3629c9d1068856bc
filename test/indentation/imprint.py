"""contact_area of post/gimp3d/imprint.py on surfaces that are made up. usage: imprint.py ROOT

A pyramid touches as far as a(angle) across its faces, further in the middle of a face than at an edge; beyond
that a gap opens as a wedge. The area within is integrated.
"""

import math

import numpy as np

from gimp3d import imprint
from checks import finish, require


width, tip = 50e-9, -300e-9


def folded(angle, faces):
    turn = np.mod(angle, 2 * math.pi / faces)
    return np.minimum(turn, 2 * math.pi / faces - turn)


def surface_under(tool, faces, end, slope):
    """Particles `width` wide, whose gap to the tool opens with `slope` beyond `end` (m, of the folded
    angle)."""
    x, y = (a.ravel() for a in np.meshgrid(*2 * [np.arange(-2e-6, 2e-6, width) + width / 2]))
    places = np.stack([x, y], axis=1)
    turn = folded(np.arctan2(y, x), faces)
    gap = slope * np.maximum(np.hypot(x, y) * np.cos(turn) - end(turn), 0.0)
    heights = tip + imprint.tool_height(tool, places) - gap
    none = np.zeros(x.size)
    return imprint.Surface(places, heights, np.full(x.size, width / 2), none, none, 2 * width)


def exact(faces, end):
    turn = 2 * math.pi * (np.arange(100000) + 0.5) / 100000
    near = folded(turn, faces)
    return np.mean(0.5 * (end(near) / np.cos(near)) ** 2) * 2 * math.pi


for name, faces, tool in (
    ("berkovich", 3, {"shape": ["berkovich"], "half_angle": [65.27]}),
    ("four faces", 4, {"shape": ["pyramid"], "half_angle": [68.0], "faces": [4]}),
):
    for bulge in (0.0, 0.1, -0.1):

        def end(turn):
            return 600e-9 * (1 + bulge * np.cos(faces * turn))

        found = imprint.contact_area(surface_under(tool, faces, end, 0.4), tool, tip)
        true = exact(faces, end)
        if found is None:
            require(f"{name}, {100 * bulge:+g} %: an area", False)
            continue
        area, sigma, mean, mean_sigma = found
        require(
            f"{name}, faces bulge by {100 * bulge:+g} %: {1e12 * area:.4g} +- {1e12 * sigma:.2g} um2, exact "
            f"{1e12 * true:.4g}, to 3 % and within the uncertainty",
            abs(area / true - 1) < 0.03 and abs(area - true) < sigma < 0.1 * area,
        )
        require(
            f"{name}: the mean edge has the area of a figure like the tool",
            abs(mean**2 * faces * math.tan(math.pi / faces) / area - 1) < 1e-12 and mean_sigma < 0.05 * mean,
        )
    require(
        f"{name}: no area where the gap opens nowhere",
        imprint.contact_area(surface_under(tool, faces, lambda turn: 9e-6, 0.4), tool, tip) is None,
    )
require(
    "none for a tool that is neither round nor a pyramid",
    imprint.contact_area(surface_under(tool, faces, end, 0.4), {"shape": ["flat"], "radius": [1e-6]}, tip)
    is None,
)


class Columns:
    """Six layers of particles below z = 0 that lean outwards by a hundredth: near the rim of what is looked
    at, tops lie beyond it and what is below them within."""

    def __init__(self):
        half = width / 2
        x, y, layer = (
            a.ravel() for a in np.meshgrid(*2 * [np.arange(-2e-6, 2e-6, width) + half], np.arange(6))
        )
        lean = 1 + 0.01 * (5 - layer) / 5
        self.fields = {
            "position": np.stack([x * lean, y * lean, -(layer + 0.5) * width], axis=1),
            "half_size": np.full((x.size, 3), half),
        }
        self.ids = np.arange(x.size)

    def __getitem__(self, name):
        return self.fields[name]

    def smooth_stress(self):
        return np.zeros((self.ids.size, 6))


frame = imprint.Frame(np.array([0, 0, 1.0]), np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), np.zeros(3))
case = {"grid": [{"cell_size": [2 * width]}]}
lowest = min(
    imprint.surface_of(Columns(), frame, case, 1, reach, ()).heights.min()
    for reach in np.linspace(0.4e-6, 1.8e-6, 41)
)
require(
    f"a flat surface is flat to the rim of what is looked at: lowest {1e9 * lowest:.3g} nm", lowest > -1e-12
)
finish()
