"""Tips: what was pressed in, as an axisymmetric tool of the same area."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

BERKOVICH = 70.32  # half angle of the cone with the area of a Berkovich, degrees
VICKERS = 70.30
STEP = 0.02  # of the logarithm of a length over a depth: that of a run is within half of it
LENGTHS = {"nm": 1e-9, "um": 1e-6, "µm": 1e-6, "mm": 1e-3, "m": 1.0, "": 1.0}
SHARES = np.concatenate([[0.0], np.geomspace(0.003, 2.0, 40)])  # of the depth: points of a profile


class BadTip(Exception):
    """What TIP says is none; the text says what is allowed."""


@dataclass(frozen=True)
class Tip:
    """kind: cone, sphere or profile; half_angle in degrees; radius (m) of the sphere, or of what rounds the
    cone off (0: sharp); profile: pairs of height above the tip and area (m, m2). `pyramid`: what is of
    revolution stands for a pyramid, so that what differs is a part of the model's error. `name`: of a
    profile, its file."""

    kind: str
    half_angle: float = 0.0
    radius: float = 0.0
    pyramid: bool = False
    profile: tuple = ()
    name: str = ""

    @property
    def has_length(self):
        """Whether its loads are no power of the depth, so that the depth over its length counts."""
        return self.radius > 0 or bool(self.profile)

    @property
    def title(self):
        if self.kind == "sphere":
            return f"sphere of {self.radius * 1e6:.4g} um"
        if self.kind == "profile":
            return f"tip of {self.name}" + (", a pyramid" if self.pyramid else "")
        name = f"cone of {self.half_angle:g} degrees"
        if self.pyramid:
            name = f"pyramid as a {name}"
        return name + (f", rounded by {self.radius * 1e9:.4g} nm" if self.radius else "")

    def scene_words(self, depth):
        """The shape as a &tool has it, of a tip over its largest depth, in a scene whose largest depth is
        `depth` (m)."""
        if self.kind == "sphere":
            return f"shape='sphere', radius={self.radius * depth:.9g}"
        if self.kind == "profile":
            heights = ",".join(f"{h * depth:.7g}" for h, _ in self.profile)
            radii = ",".join(f"{math.sqrt(a / math.pi) * depth:.7g}" for _, a in self.profile)
            return f"shape='profile', heights={heights},\n          radii={radii}"
        words = f"shape='cone', half_angle={self.half_angle:.9g}"
        return words + (f", tip_radius={self.radius * depth:.9g}" if self.radius else "")

    def model(self, depth):
        """The tip that is run for an experiment to a depth (m), its lengths over the depth of the run, and
        that depth (m): within a hundredth of the experiment's, so that experiments share their runs."""
        if not self.has_length:
            half_angle = 70.3 if self.pyramid and abs(self.half_angle - 70.3) < 0.1 else self.half_angle
            return Tip(self.kind, half_angle), depth
        length = self.radius if self.kind != "profile" else 1e-9
        ratio = float(f"{math.exp(round(math.log(length / depth) / STEP) * STEP):.4g}")
        depth = length / ratio
        if self.kind != "profile":
            half_angle = 70.3 if self.pyramid and abs(self.half_angle - 70.3) < 0.1 else self.half_angle
            return Tip(self.kind, half_angle, ratio), depth
        heights, areas = np.array(self.profile).T
        if 1.1 * depth > heights[-1]:
            raise BadTip(
                f"TIP={self.name}: the area function ends at {heights[-1]:.3g} m, the curve at {depth:.3g}"
            )
        outline = np.sqrt(areas / math.pi)
        radii = np.interp(SHARES * depth, heights, outline)
        slope = (outline[-1] - outline[-2]) / (heights[-1] - heights[-2])
        radii += slope * np.maximum(SHARES * depth - heights[-1], 0.0)
        digits = lambda value: float(f"{value:.6g}")
        return Tip("profile", profile=tuple(
            (digits(share), digits(math.pi * (radius / depth) ** 2)) for share, radius in zip(SHARES, radii)
        )), depth  # fmt: skip

    def contact_radius(self, depth):
        """Of the ideal section at a depth."""
        if self.kind == "sphere":
            return math.sqrt(max(2 * self.radius * depth - depth**2, 0.0))
        if self.kind == "profile":
            heights, areas = np.array(self.profile).T
            return math.sqrt(float(np.interp(depth, heights, areas)) / math.pi)
        angle = math.radians(self.half_angle)
        missing = self.radius * (1 / math.sin(angle) - 1)
        return math.tan(angle) * (depth + missing)


def length_of(word):
    """m of `5um`, `50nm`, `50e-9`; raises ValueError."""
    for unit in sorted(LENGTHS, key=len, reverse=True):
        if unit and word.endswith(unit):
            return float(word[: -len(unit)]) * LENGTHS[unit]
    return float(word)


def read_area(text, pyramid):
    """The Tip of `FILE` (columns depth and area with their units) or of the coefficients C0,C1,... (nm) of
    A = C0 h^2 + C1 h + C2 h^(1/2) + C3 h^(1/4) + ..."""
    from .measured import read_table
    from .table_text import in_si

    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if numbers:
        h = np.concatenate([[0.0], np.geomspace(1e-9, 2e-5, 300)])
        powers = [2.0, *(2.0**-k for k in range(len(numbers) - 1))]
        area = 1e-18 * sum(c * (1e9 * h) ** p for c, p in zip(numbers, powers))
        name = "area function " + text
    else:
        names, units, rows = read_table(Path(text))
        if "area" not in names or not {"depth", "h"} & set(names):
            raise BadTip(f"TIP=area:{text}: columns depth and area are required; it has {', '.join(names)}")
        column = names.index("depth" if "depth" in names else "h")
        at = names.index("area")
        h = in_si(f"TIP=area:{text}", names[column], units[column], rows[:, column], ["length"])
        area = in_si(f"TIP=area:{text}", "area", units[at], rows[:, at], ["area"])
        name = Path(text).name
        if h[0] > 0:
            h, area = np.concatenate([[0.0], h]), np.concatenate([[0.0], area])
    if len(h) < 3 or np.any(np.diff(h) <= 0) or np.any(np.diff(area) < 0) or h[0] != 0 or area[1] <= 0:
        raise BadTip(f"TIP=area:{text}: depths and areas must increase from 0")
    return Tip("profile", pyramid=pyramid, profile=tuple(zip(h.tolist(), area.tolist())), name=name)


def read_tip(text):
    """A Tip of words: `cone:70.3`, `cone:60:rounding=50nm`, `berkovich`, `vickers`, `sphere:10um`,
    `area:FILE`, `area:24.5,400` (a pyramid's area function), `area:FILE:round` (of a turned tip). A
    length without a unit is in m."""
    kind, *rest = text.strip().split(":")
    kind = kind.lower()
    if kind.endswith((".csv", ".txt")):
        kind, rest = "area", [text.strip().split(":")[0], *rest]
    if kind == "area" and rest and len(rest) <= 2 and rest[1:] in ([], ["round"], ["berkovich"]):
        return read_area(rest[0], rest[1:] != ["round"])
    try:
        numbers = [length_of(word.strip().lower().removeprefix("rounding=")) for word in rest]
    except ValueError:
        raise BadTip(f"TIP={text}: {rest} are not numbers")
    if kind in ("berkovich", "vickers") and len(numbers) <= 1 and all(n > 0 for n in numbers):
        half_angle = BERKOVICH if kind == "berkovich" else VICKERS
        return Tip("cone", half_angle, numbers[0] if numbers else 0.0, True)
    if kind == "cone" and len(numbers) in (1, 2) and 30 <= numbers[0] <= 85 and all(n > 0 for n in numbers):
        return Tip("cone", numbers[0], numbers[1] if len(numbers) == 2 else 0.0)
    if kind == "sphere" and len(numbers) == 1 and numbers[0] > 0:
        return Tip("sphere", 0.0, numbers[0])
    raise BadTip(
        f"TIP={text}: allowed are cone:ANGLE (30 to 85 degrees), berkovich, vickers, each with "
        ":rounding=LENGTH if it is rounded, sphere:RADIUS, area:FILE or area:C0,C1,... (nm), "
        "with :round for an axisymmetric tip"
    )
