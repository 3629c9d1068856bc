"""Tips: what was pressed in, as an axisymmetric tool of the same area."""

import math
from dataclasses import dataclass

BERKOVICH = 70.32  # half angle of the cone with the area of a Berkovich, degrees
VICKERS = 70.30


class BadTip(Exception):
    """What TIP says is none; the text says what is allowed."""


@dataclass(frozen=True)
class Tip:
    """kind: cone or sphere; half_angle in degrees; radius (m) of the sphere, or of what rounds the cone off
    (0: sharp). `pyramid`: the cone stands for one, so that what differs is a part of the model's error."""

    kind: str
    half_angle: float = 0.0
    radius: float = 0.0
    pyramid: bool = False

    @property
    def has_length(self):
        """Whether its loads are no power of the depth, so that the depth over the radius counts."""
        return self.radius > 0

    @property
    def title(self):
        if self.kind == "sphere":
            return f"sphere of {self.radius * 1e6:.4g} um"
        name = f"cone of {self.half_angle:g} degrees"
        if self.pyramid:
            name = f"pyramid as a {name}"
        return name + (f", rounded by {self.radius * 1e9:.4g} nm" if self.radius else "")

    def scene_words(self, depth):
        """The shape as a &tool has it, at a largest depth of `depth` (m) in the scene's own scale, where the
        experiment's was 1: radii are given over the depth."""
        if self.kind == "sphere":
            return f"shape='sphere', radius={self.radius * depth:.9g}"
        words = f"shape='cone', half_angle={self.half_angle:.9g}"
        return words + (f", tip_radius={self.radius * depth:.9g}" if self.radius else "")

    def over(self, depth):
        """The same tip with its radius over a depth (m)."""
        return Tip(self.kind, self.half_angle, round(self.radius / depth, 4), self.pyramid)

    def contact_radius(self, depth):
        """Of the ideal section at a depth."""
        if self.kind == "sphere":
            return math.sqrt(max(2 * self.radius * depth - depth**2, 0.0))
        angle = math.radians(self.half_angle)
        missing = self.radius * (1 / math.sin(angle) - 1)
        return math.tan(angle) * (depth + missing)


def read_tip(text):
    """A Tip of words: `cone:70.3`, `cone:60:50e-9` (rounded by a radius in m), `berkovich`, `vickers`,
    `sphere:10e-6`, `area:24.5,400` (the coefficients of an area function in nm: the cone that has its area
    at the depths of the curve comes with the data)."""
    kind, *numbers = text.strip().lower().split(":")
    try:
        values = [float(word) for word in numbers]
    except ValueError:
        raise BadTip(f"TIP={text}: {numbers} are no numbers")
    if kind in ("berkovich", "vickers") and len(values) <= 1:
        half_angle = BERKOVICH if kind == "berkovich" else VICKERS
        return Tip("cone", half_angle, values[0] if values else 0.0, True)
    if kind == "cone" and len(values) in (1, 2) and 30 <= values[0] <= 85:
        return Tip("cone", values[0], values[1] if len(values) == 2 else 0.0)
    if kind == "sphere" and len(values) == 1 and values[0] > 0:
        return Tip("sphere", 0.0, values[0])
    raise BadTip(
        f"TIP={text}: allowed are cone:ANGLE (30 to 85 degrees), cone:ANGLE:RADIUS (m), berkovich, vickers "
        "(each with :RADIUS where it is rounded), sphere:RADIUS"
    )
