"""What an accuracy takes: errors of space, time step and speed from a few runs, and what other settings would
have and cost.

Curves are those of study_quantity, on the same places x. With the finest cell h (m), the speed s of what is
prescribed (1: as the scene says), the time step as a share t of the scene's, and the size k of the body over
that of the scene,

    q(h, s, t, k) = q0 + a h^p + b s k + c t + d/k

space with the order p that three grids show (Richardson), speed and time step of first order, each from one
run more: inertia counts as waves take to cross the body. Where the runs are sections of a body of revolution,
what the body itself differs from its section by, on one grid, goes with h and is a part of space. The last is only there where the answer looked for
is that of a half-space: the ends of a body that is large are felt in inverse proportion to its size. Errors are rms over the places, per cent of the largest magnitude of q0, and added as sizes, so that
none hides another."""

import dataclasses
import math

import numpy as np

from . import study_fit as fit
from .scene_text import BadSetting

LOWEST_ORDER, HIGHEST_ORDER = 0.5, 3.0
MARGIN = 0.8  # of the target: what is aimed at


@dataclasses.dataclass
class Sample:
    """One run: settings and curve."""

    cell: float  # of the finest level, m
    speed: float  # of what is prescribed, as a factor
    step: float  # of the time step, as a factor
    curve: np.ndarray
    body: float = 1.0  # size, over that of the scene


class Errors:
    """The model, from samples. `ladder`: one of each of at least two cells; `speeds`, `steps` and `bodies`:
    pairs of samples that differ in the speed, in the time step, in the size of the body, alone; None: the
    part does not exist or is not known. The body counts as a part where `half_space` says so. `surfaces`: a
    pair that differs in how particles fill curved bodies, and a factor: by so many times the difference,
    which goes with the cell, the limit is open. `sections`: a section and the body itself on the same grid;
    then all else are sections, and what is asked for is the error of the body. `faster`: as `speeds`, with a
    speed above that of the scene, for what is faster than that; None: `speeds` tell it too."""

    def __init__(
        self,
        ladder,
        speeds=None,
        steps=None,
        bodies=None,
        half_space=False,
        surfaces=None,
        sections=None,
        faster=None,
    ):
        self.ladder = sorted(ladder, key=lambda sample: -sample.cell)
        self.by_speed = self.slope(speeds, "speed")
        self.by_faster = self.by_speed if faster is None else self.slope(faster, "speed")
        self.by_step = self.slope(steps, "step")
        self.by_body = None
        if bodies is not None:
            one, other = bodies  # of about the same speed times size
            change = other.curve - one.curve
            if self.by_speed is not None:
                change = change - self.by_speed * (other.speed * other.body - one.speed * one.body)
            self.by_body = change / (1 / other.body - 1 / one.body)
        self.by_surface = None
        if surfaces is not None:
            one, other, worth = surfaces
            self.by_surface = worth * (other.curve - one.curve) / one.cell
        self.by_section = None
        if sections is not None:
            one, other = sections
            self.by_section = (other.curve - one.curve) / one.cell
        self.half_space = half_space and self.by_body is not None
        self.notes = []
        self.spread = 0.0  # of limits, where the grids show no order, per cent
        plain = [self.without(sample) for sample in self.ladder]
        cells = [sample.cell for sample in self.ladder]
        self.order, self.limit = self.extrapolate(cells, plain)
        self.scale = float(np.max(np.abs(self.limit)))
        if self.scale == 0.0:
            raise BadSetting("the quantity is 0 wherever it is compared, so that no error of it can be had")
        finest = plain[-1] - self.limit
        self.space = finest / cells[-1] ** self.order  # a, as a curve
        self.trust = self.agreement(cells, plain)

    @staticmethod
    def slope(pair, what):
        """d curve/d speed or d step."""
        if pair is None:
            return None
        one, other = pair
        return (other.curve - one.curve) / (getattr(other, what) - getattr(one, what))

    def without(self, sample):
        """A sample's curve less what speed, time step and the body's size put into it."""
        curve = sample.curve
        if self.by_speed is not None:
            curve = curve - self.by_speed * sample.speed * sample.body
        if self.by_step is not None:
            curve = curve - self.by_step * sample.step
        if self.half_space:
            curve = curve - self.by_body / sample.body
        return curve

    def extrapolate(self, cells, curves):
        """Order and limit. Where the three finest grids show no order, the first is taken, the finest is as
        far from the limit as it is from the farther of the two others, and a note says so."""
        try:
            limit, order = fit.richardson(cells, curves)
            if LOWEST_ORDER <= order <= HIGHEST_ORDER:
                return order, limit
            self.notes.append(
                f"the grids show an order of {order:.2f} in the cell; "
                f"{min(max(order, LOWEST_ORDER), HIGHEST_ORDER):g} is taken"
            )
            order = min(max(order, LOWEST_ORDER), HIGHEST_ORDER)
        except fit.NoOrder as reason:
            self.notes.append(
                f"no order in the cell ({reason}); the first is taken, and the spread of the three finest "
                "for the error"
            )
            others = [2 * curves[-1] - curve for curve in curves[-3:-1]]
            limit = max(others, key=lambda limit: float(np.mean((curves[-1] - limit) ** 2)))
            size = float(np.max(np.abs(limit))) or 1.0
            self.spread = max(100 * float(np.sqrt(np.mean((one - limit) ** 2))) / size for one in others)
            return 1.0, limit
        limits = [
            self.two_grids(order, cells[k], curves[k], cells[-1], curves[-1])
            for k in range(max(0, len(cells) - 3), len(cells) - 1)
        ]
        return order, max(limits, key=lambda limit: float(np.mean((curves[-1] - limit) ** 2)))

    @staticmethod
    def two_grids(order, coarse, coarse_curve, fine, fine_curve):
        return fine_curve - (coarse_curve - fine_curve) * fine**order / (coarse**order - fine**order)

    def agreement(self, cells, curves):
        """By how much the limit moves with what it is made of: largest rms distance to the limits of each
        pair of neighbours with orders from 1 to 2, per cent."""
        others = [
            self.two_grids(p, cells[k], curves[k], cells[k + 1], curves[k + 1])
            for k in range(max(0, len(cells) - 2), len(cells) - 1)
            for p in (1.0, self.order, 2.0)
        ]
        return max([self.spread, *(self.rms(other - self.limit) for other in others)])

    def rms(self, curve):
        """Per cent of the largest magnitude of the limit."""
        return 100 * float(np.sqrt(np.mean(curve**2))) / self.scale

    def finite_body(self):
        """By how much the body of the scene differs from a half-space, per cent; None where not known."""
        return None if self.by_body is None else self.rms(self.by_body)

    def parts(self, cell, speed=1.0, step=1.0, body=1.0):
        """Errors of settings by cause, per cent."""
        space = self.space * cell**self.order
        found = {"space": self.rms(space if self.by_section is None else space + self.by_section * cell)}
        if self.by_step is not None:
            found["time step"] = self.rms(self.by_step * step)
        if self.by_speed is not None:
            above = max(speed * body - 1.0, 0.0)
            found["speed"] = self.rms(self.by_speed * (speed * body - above) + self.by_faster * above)
        if self.half_space:
            found["finite body"] = self.rms(self.by_body / body)
        return found

    def of(self, sample):
        """Of a run: of one of the grids the sum of its parts; of any other how far it is from their limit.
        Per cent."""
        if any(sample is one for one in self.ladder):
            return self.total(sample.cell, sample.speed, sample.step, sample.body)
        return self.rms(sample.curve - self.limit)

    def total(self, cell, speed=1.0, step=1.0, body=1.0):
        return sum(self.parts(cell, speed, step, body).values())

    def surface(self, cell):
        """What another way to fill curved bodies changes, per cent; 0 where there are none."""
        return 0.0 if self.by_surface is None else self.rms(self.by_surface * cell)

    def section(self, cell):
        """What a body differs from its section by, per cent; 0 where runs are no sections."""
        return 0.0 if self.by_section is None else self.rms(self.by_section * cell)

    def uncertainty(self, cell, speed=1.0, step=1.0, body=1.0):
        """Of `total`: how far the limit is open, what another way to fill curved bodies changes, what a body
        differs from its section by, and half of what the parts beside space are said to be (their orders are
        assumed), per cent."""
        parts = self.parts(cell, speed, step, body)
        return (
            self.trust
            + self.surface(cell)
            + self.section(cell)
            + 0.5 * sum(part for name, part in parts.items() if name != "space")
        )


class Price:
    """Seconds of a run from its steps and particle-steps: T = a steps + b particle-steps, both at least 0,
    fitted to runs."""

    def __init__(self, rows):
        """rows: (steps, particle-steps, core-seconds)."""
        work = np.array([(steps, updates) for steps, updates, _ in rows], float)
        seconds = np.array([row[2] for row in rows])
        weight = 1 / seconds  # relative errors
        self.factors = None
        if len(rows) > 1:
            found = np.linalg.lstsq(work * weight[:, None], np.ones(len(rows)), rcond=None)[0]
            if np.all(found >= 0):
                self.factors = found
        if self.factors is None:  # by particle-steps alone, the last row, which is the largest
            self.factors = np.array([0.0, seconds[-1] / work[-1, 1]])

    def of(self, steps, updates):
        return float(self.factors @ [steps, updates])


@dataclasses.dataclass
class Choice:
    """Settings that may be run: what they are predicted to have and to take."""

    settings: dict
    key: tuple  # the same as solve.Key
    error: float  # per cent
    seconds: float  # core-seconds
    megabytes: float

    @property
    def said(self):
        return ", ".join(f"{name}={value:.4g}" for name, value in self.settings.items()) or "as the scene is"


def choose(choices, target, seconds, margin=MARGIN):
    """The cheapest that is predicted to meet the target with a margin; else None. And the best that the
    seconds buy; else None."""
    meeting = [choice for choice in choices if choice.error <= margin * target]
    cheapest = min(meeting, key=lambda choice: choice.seconds, default=None)
    within = [choice for choice in choices if choice.seconds <= seconds]
    best = min(within, key=lambda choice: (choice.error, choice.seconds), default=None)
    return cheapest, best
